"""How often a few images tell which of a camera's directions is up, the weights for it, and how often its lens."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import polars as pl

from tiltvp.lab.datasets.hostile import (
    AHEAD,
    DOWN,
    FORWARD,
    LEAN_MAX_DEG,
    ROLLED,
    UP,
    UPWARD,
    WHOLE,
    centre_off,
    focal_off,
)
from tiltvp.lab.datasets.panoramas import Panorama, PanoramaViews
from tiltvp.lab.evaluation.choices import train_weights
from tiltvp.lab.evaluation.trust import was_set_on
from tiltvp.lens_check import check_lens
from tiltvp.setup_check import BELIEVABLE, DIRECTIONS, setup_features, shares_of
from tiltvp.tilt import normal_from_alpha_beta

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.cameras import Camera

__all__ = ["IMAGES", "ImageSet", "image_sets", "judge_lenses", "summarise_sets", "train_setups"]

IMAGES: Final = 5
"""Images of a set."""
PENALTY: Final = 3.0
"""Of the squared weights of features that are scaled to a standard deviation of one."""
SETUPS: Final = {
    "upward": (UPWARD, UP),
    "downward": (UPWARD, DOWN),
    "ahead": (AHEAD, FORWARD),
    "ahead, upside down": (AHEAD, FORWARD @ ROLLED @ ROLLED),
    "ahead, portrait": (AHEAD, FORWARD @ ROLLED),
    "ahead, portrait the other way": (AHEAD, FORWARD @ ROLLED.T),
    "fisheye ahead": (UPWARD, FORWARD),
    "panorama": (WHOLE, FORWARD),
}


@dataclass(frozen=True)
class ImageSet:
    """Images of one building by one camera: (N, 6, F) features, and the number of the direction that is up."""

    setup: str
    location: str
    features: NDArray[np.float64]
    up: int


def image_sets(
    panoramas: Sequence[Panorama], *, sets: int = 2, seed: int = 0, advance: Callable[[], None] = lambda: None
) -> list[ImageSet]:
    """So many sets of each building, each by a drawn setup, from its panoramas with headings and leans of their own."""
    done = []
    for number, location in enumerate(sorted({panorama.location for panorama in panoramas})):
        own = [panorama for panorama in panoramas if panorama.location == location]
        rng = np.random.default_rng((seed, number))
        for setup in rng.permutation(list(SETUPS))[:sets]:
            camera, mounting = SETUPS[setup]
            images = _views(own, camera, mounting, rng, seed)
            up = mounting.T @ np.array([0.0, 0.0, 1.0])
            right = int(np.argmax([np.dot(up, direction) for direction in DIRECTIONS.values()]))
            done.append(ImageSet(str(setup), location, setup_features(images, camera), right))
        advance()
    return done


def _views(
    own: Sequence[Panorama], camera: Camera, mounting: NDArray[np.float64], rng: np.random.Generator, seed: int
) -> list[NDArray[np.uint8]]:
    """A set of images from panoramas of one building."""
    images = []
    for k in range(IMAGES):
        panorama = own[int(rng.integers(len(own)))]
        views = PanoramaViews(panorama, camera, robot_from_camera=mounting)
        lean = normal_from_alpha_beta(np.deg2rad(rng.uniform(0.0, LEAN_MAX_DEG)), rng.uniform(-np.pi, np.pi))
        images.append(views.render(lean, yaw_rad=rng.uniform(-np.pi, np.pi), seed=1000 * seed + k))
    return images


def judge_lenses(
    panoramas: Sequence[Panorama], *, seed: int = 0, advance: Callable[[], None] = lambda: None
) -> pl.DataFrame:
    """One row for each lens that sets of the fisheye, one of each building and setup, are told to be of: sets, and in
    per cent of them those that believe it; medians of the errors of what is found, in pixels of the centre and per cent
    of the focal length.
    """
    rows = []
    for number, location in enumerate(sorted({panorama.location for panorama in panoramas})):
        own = [panorama for panorama in panoramas if panorama.location == location]
        rng = np.random.default_rng((seed, number, 1))
        for setup in ("upward", "fisheye ahead"):
            images = _views(own, *SETUPS[setup], rng, seed)
            lenses = {
                "as it is": UPWARD,
                "centre off by 10 px": centre_off(rng),
                "focal length off by 10 %": focal_off(rng),
            }
            for lens, camera in lenses.items():
                found = check_lens(images, camera)
                was, is_ = camera.parameters, UPWARD.parameters
                off = np.array([is_["cx"] - was["cx"], is_["cy"] - was["cy"]]) - found.centre_off_px
                rows.append(
                    {
                        "setup": setup,
                        "told": lens,
                        "believed": bool(found),
                        "centre_px": float(np.hypot(*off)),
                        "scale_percent": 100.0 * abs(found.scale - is_["focal_px"] / was["focal_px"]),
                    }
                )
        advance()
    return (
        pl.DataFrame(rows)
        .group_by("setup", "told", maintain_order=True)
        .agg(
            pl.len().alias("sets"),
            (100.0 * pl.col("believed").mean()).alias("believed"),
            pl.col("centre_px", "scale_percent").median(),
        )
    )


def train_setups(sets: Sequence[ImageSet]) -> NDArray[np.float64]:
    """(F,): weights of the features of single images."""
    return train_weights([(image, item.up) for item in sets for image in item.features], PENALTY)


def summarise_sets(sets: Sequence[ImageSet], weights: NDArray[np.float64] | None = None) -> pl.DataFrame:
    """One row for each setup and half of the buildings: sets, and in per cent of them those whose right direction is
    the best, that believe the right one, and that believe each wrong one. `weights` are those of the software.
    """
    rows = []
    for item in sets:
        shares = shares_of(item.features, weights)
        rows.append(
            {
                "setup": item.setup,
                "half": "set" if was_set_on(item.location) else "unseen",
                "right": int(shares.argmax()) == item.up,
                "right_believed": shares[item.up] >= BELIEVABLE,
                "wrong_believed": float(np.mean(np.delete(shares, item.up) >= BELIEVABLE)),
            }
        )
    table = pl.DataFrame(rows)
    table = pl.concat([table.sort("half", "setup"), table.with_columns(setup=pl.lit("all"))])
    shares_ = [(100.0 * pl.col(name).mean()).alias(name) for name in ("right", "right_believed", "wrong_believed")]
    return table.group_by("half", "setup", maintain_order=True).agg(pl.len().alias("sets"), *shares_)
