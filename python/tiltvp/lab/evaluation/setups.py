"""How often a few images tell which of a camera's directions is up, the weights for it, and how often its lens."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import polars as pl

from tiltvp.lab.datasets.ahead import FORWARD
from tiltvp.lab.datasets.hostile import (
    AHEAD,
    DOWN,
    LEAN_MAX_DEG,
    ROLLED,
    UP,
    UPWARD,
    WHOLE,
    centre_off,
    focal_off,
    pinhole_focal_off,
)
from tiltvp.lab.datasets.panoramas import Panorama, PanoramaViews
from tiltvp.lab.evaluation.choices import Network, train_network
from tiltvp.lens_check import check_lens
from tiltvp.setup_check import BELIEVABLE, SURE, log_odds, shares_of
from tiltvp.setup_features import DIRECTIONS, ImageFeatures
from tiltvp.synth import ROOM_KINDS
from tiltvp.tilt import normal_from_alpha_beta

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.cameras import Camera

__all__ = ["IMAGES", "ImageSet", "image_sets", "judge_lenses", "summarise_sets", "train_setups"]

IMAGES: Final = 5
"""Images of a set."""
MANY: Final = 20
"""Of one that right angles tell more often."""
UNITS: Final = 17
DECAY: Final = 0.02
"""Hidden units and decay of the network: with half of that decay sets are surer and more often wrong, by one in a
hundred of buildings that trained nothing."""
FOLDS: Final = 6
"""Parts of the buildings, of which each is judged by a network that the others trained."""
SETUPS: Final = {
    "upward": (UPWARD, UP),
    "downward": (UPWARD, DOWN),
    "ahead": (AHEAD, FORWARD),
    "ahead, upside down": (AHEAD, FORWARD @ ROLLED @ ROLLED),
    "ahead, portrait": (AHEAD, FORWARD @ ROLLED),
    "ahead, portrait the other way": (AHEAD, FORWARD @ ROLLED.T),
    "fisheye ahead": (UPWARD, FORWARD),
    "panorama": (WHOLE, FORWARD),
    "pinhole upward": (AHEAD, UP),
    "pinhole downward": (AHEAD, DOWN),
}


@dataclass(frozen=True)
class ImageSet:
    """Images of one building by one camera: (N, 6, F) features, and the number of the direction that is up."""

    setup: str
    location: str
    features: NDArray[np.float64]
    up: int

    @property
    def rendered(self) -> bool:
        """Whether it is of a room of `tiltvp dataset panoramas`."""
        return self.location.rpartition(" ")[0] in ROOM_KINDS


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
            features = ImageFeatures(camera)
            done.append(ImageSet(str(setup), location, np.array([features(image) for image in images]), right))
        advance()
    return done


def _views(
    own: Sequence[Panorama],
    camera: Camera,
    mounting: NDArray[np.float64],
    rng: np.random.Generator,
    seed: int,
    count: int = IMAGES,
) -> list[NDArray[np.uint8]]:
    """A set of images from panoramas of one building."""
    images = []
    for k in range(count):
        panorama = own[int(rng.integers(len(own)))]
        views = PanoramaViews(panorama, camera, robot_from_camera=mounting)
        lean = normal_from_alpha_beta(np.deg2rad(rng.uniform(0.0, LEAN_MAX_DEG)), rng.uniform(-np.pi, np.pi))
        images.append(views.render(lean, yaw_rad=rng.uniform(-np.pi, np.pi), seed=1000 * seed + k))
    return images


def judge_lenses(
    panoramas: Sequence[Panorama], *, seed: int = 0, advance: Callable[[], None] = lambda: None
) -> pl.DataFrame:
    """One row for each lens that sets of a camera, one of each building and setup, are told to be of: sets, and in
    per cent of them those that believe it; medians of the errors of what is found, in pixels of the centre and per cent
    of the focal length, which right angles tell of the pinhole.
    """
    rows = []
    for number, location in enumerate(sorted({panorama.location for panorama in panoramas})):
        own = [panorama for panorama in panoramas if panorama.location == location]
        rng = np.random.default_rng((seed, number, 1))
        for setup, count in (("upward", IMAGES), ("fisheye ahead", IMAGES), ("ahead", IMAGES), ("ahead", MANY)):
            images, (true, _) = _views(own, *SETUPS[setup], rng, seed, count), SETUPS[setup]
            lenses = {"as it is": true}
            if setup == "ahead":
                lenses["focal length off by 10 %"] = pinhole_focal_off(rng)
            else:
                lenses["centre off by 10 px"] = centre_off(rng)
                lenses["focal length off by 10 %"] = focal_off(rng)
            for lens, camera in lenses.items():
                found = check_lens(images, camera)
                was, is_ = camera.parameters, true.parameters
                off = np.array([is_["cx"] - was["cx"], is_["cy"] - was["cy"]]) - found.centre_off_px
                focal, scale = ("focal_px", found.scale) if setup != "ahead" else ("fx", found.scale_by_right_angles)
                rows.append(
                    {
                        "setup": setup,
                        "images": count,
                        "told": lens,
                        "believed": bool(found),
                        "centre_px": float(np.hypot(*off)) if setup != "ahead" else None,
                        "scale_percent": 100.0 * abs(scale - is_[focal] / was[focal]),
                    }
                )
        advance()
    return (
        pl.DataFrame(rows)
        .group_by("setup", "images", "told", maintain_order=True)
        .agg(
            pl.len().alias("sets"),
            (100.0 * pl.col("believed").mean()).alias("believed"),
            pl.col("centre_px", "scale_percent").median(),
        )
    )


def train_setups(sets: Sequence[ImageSet]) -> Network:
    """The network that scores a direction by the features of single images."""
    told = [(image, item.up) for item in sets for image in item.features]
    return train_network(told, units=UNITS, decay=DECAY, line_alone=None)


def summarise_sets(sets: Sequence[ImageSet], *, advance: Callable[[], None] = lambda: None) -> pl.DataFrame:
    """One row for each setup of real buildings, and of rendered rooms: sets, and in per cent of them those whose right
    direction is the best, those that are sure of a wrong one, those that are not sure, and how often the right one and
    each wrong one are believed. Each building is judged by a network that learned from others, a single one by the
    software's.
    """
    places = sorted({item.location for item in sets})
    fold = dict(zip(places, np.random.default_rng(0).permutation(len(places)) % FOLDS, strict=True))
    rows = []
    for part in range(min(FOLDS, len(places))):
        others = [item for item in sets if fold[item.location] != part]
        scored = train_setups(others).log_odds if others else log_odds
        rows += [_judged(item, scored) for item in sets if fold[item.location] == part]
        advance()
    table = pl.DataFrame(rows)
    table = pl.concat([table.sort("of", "setup"), table.with_columns(setup=pl.lit("all"))])
    shares = [(100.0 * pl.col(name).mean()).alias(name) for name in table.columns if name not in ("of", "setup")]
    return table.group_by("of", "setup", maintain_order=True).agg(pl.len().alias("sets"), *shares)


def _judged(item: ImageSet, scored: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> dict[str, object]:
    shares = shares_of(item.features, scored)
    right, sure = int(shares.argmax()) == item.up, float(shares.max()) >= SURE
    return {
        "of": "rooms" if item.rendered else "buildings",
        "setup": item.setup,
        "right": right,
        "sure_wrong": sure and not right,
        "not_sure": not sure,
        "right_believed": shares[item.up] >= BELIEVABLE,
        "wrong_believed": float(np.mean(np.delete(shares, item.up) >= BELIEVABLE)),
    }
