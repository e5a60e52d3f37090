"""A dataset made harder: each image half hidden, blurred or darkened, so that a confidence has failures to foresee."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from threading import Event
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from tiltvp.arguments import path_from
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.folder import TiltDataset
from tiltvp.lab.datasets.new import in_order, new_dataset
from tiltvp.lab.datasets.rows import TiltImage

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.cameras import Camera

__all__ = ["HARDSHIPS", "beneath", "degrade_dataset", "degrade_image", "pixel_bearings", "turned", "unfocused"]

HARDSHIPS: Final = ("hidden", "blurred", "dark")
"""What may befall an image: all but 20 to 160 degrees of azimuth hidden; out of focus by 1.5 to 8 pixels; 4 to 40 % of
the light with noise of 2 to 6 grey levels."""

_NOISE: Final = 2.0
_HIDDEN_LEVEL: Final = 40.0
_SHADE_RAD: Final = math.radians(20.0)
_EDGE_RAD: Final = math.radians(0.4)
"""Width of an edge in focus: a pixel of the upward camera."""


def degrade_image(
    gray: NDArray[np.uint8], hardship: str, camera: Camera, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """(H, W) uint8: the image with one of `HARDSHIPS`, as strong as `rng` draws it."""
    image: NDArray[np.float64] = gray.astype(np.float64)
    if hardship == "hidden":
        seen = _window(camera, rng)
        hidden = _HIDDEN_LEVEL + rng.normal(0.0, _NOISE, image.shape)
        image = seen * image + (1.0 - seen) * hidden
    elif hardship == "blurred":
        blurred = cv2.GaussianBlur(image, (0, 0), rng.uniform(1.5, 8.0)).astype(np.float64)
        image = blurred + rng.normal(0.0, _NOISE, image.shape)
    elif hardship == "dark":
        image = rng.uniform(0.04, 0.4) * image + rng.normal(0.0, rng.uniform(2.0, 6.0), image.shape)
    else:
        raise InvalidInputError(f"hardship = {hardship!r}, expected one of {', '.join(HARDSHIPS)}")
    return np.asarray(np.clip(np.rint(image), 0, 255), dtype=np.uint8)


def unfocused(gray: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """(H, W) uint8: out of focus by 2 to 8 pixels and without noise, as where a camera takes it away."""
    return np.asarray(cv2.GaussianBlur(gray, (0, 0), rng.uniform(2.0, 8.0)), dtype=np.uint8)


def turned(gray: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """(H, W) uint8: exposed while the robot turns by 1 to 8 degrees, as at 2 rad/s in 9 to 70 ms."""
    height, width = gray.shape
    whole = rng.uniform(1.0, 8.0)
    middle = (0.5 * (width - 1), 0.5 * (height - 1))
    turns = [cv2.getRotationMatrix2D(middle, share * whole, 1.0) for share in np.linspace(-0.5, 0.5, 17)]
    seen = [cv2.warpAffine(gray, turn, (width, height), borderMode=cv2.BORDER_REPLICATE) for turn in turns]
    noisy = np.mean(seen, axis=0) + rng.normal(0.0, 1.0, gray.shape)
    return np.asarray(np.clip(np.rint(noisy), 0, 255), dtype=np.uint8)


def beneath(
    gray: NDArray[np.uint8],
    camera: Camera,
    up: NDArray[np.float64],
    rng: np.random.Generator,
    widest_deg: float | None = None,
) -> NDArray[np.uint8]:
    """(H, W) uint8: beneath a level beam of 1 to `widest_deg` degrees, or a table that hides a side.

    `up` (3,) is the vertical in the camera frame. Edges are straight in space, the first one within 10 degrees of it.
    """
    bearings, azimuth, first = pixel_bearings(camera), rng.uniform(-math.pi, math.pi), rng.uniform(-10.0, 10.0)
    last = 90.0 if widest_deg is None else first + rng.uniform(1.0, widest_deg)
    level = np.cross(up, [math.cos(azimuth), math.sin(azimuth), 0.0])
    across, above = bearings @ (level / np.linalg.norm(level)), bearings @ up

    def beyond(angle_deg: float) -> NDArray[np.float64]:
        angle = math.radians(angle_deg)
        aside = across * math.cos(angle) - above * math.sin(angle)
        return np.asarray(np.clip(0.5 + aside / _EDGE_RAD, 0.0, 1.0))

    hidden = beyond(first) * (1.0 - beyond(last)) * (above > 0.0)
    image = gray + hidden * (rng.uniform(10.0, 245.0) - gray) + rng.normal(0.0, _NOISE, gray.shape)
    return np.asarray(np.clip(np.rint(image), 0, 255), dtype=np.uint8)


def pixel_bearings(camera: Camera) -> NDArray[np.float64]:
    """(H, W, 3): of each pixel; zero outside of the lens."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    bearings = camera.unproject(np.stack([u.ravel(), v.ravel()], axis=1).astype(np.float64))
    return np.asarray(np.nan_to_num(bearings).reshape(*u.shape, 3), dtype=np.float64)


def _window(camera: Camera, rng: np.random.Generator) -> NDArray[np.float64]:
    """(H, W) in [0, 1]: one within an azimuth about the optical axis, fading so gently that no edge appears."""
    bearings = pixel_bearings(camera)
    azimuth = np.arctan2(bearings[..., 1], bearings[..., 0])
    half, middle = 0.5 * math.radians(rng.uniform(20.0, 160.0)), rng.uniform(-math.pi, math.pi)
    away = np.abs((azimuth - middle + math.pi) % (2.0 * math.pi) - math.pi)
    return np.asarray(np.clip((half + _SHADE_RAD - away) / _SHADE_RAD, 0.0, 1.0), dtype=np.float64)


def degrade_dataset(
    dataset: TiltDataset,
    out: str | os.PathLike[str],
    *,
    seed: int = 0,
    threads: int = 1,
    source: dict[str, Any] | None = None,
    force: bool = False,
    advance: Callable[[], None] = lambda: None,
) -> None:
    """Writes the dataset again with a hardship for each image, drawn by `seed` and the image's place in the table.

    Locations, environments and truth stay, tables beside these are left out. `advance` is called after each image.
    Raises `InvalidInputError`.
    """
    if dataset.mask is not None:
        raise InvalidInputError(f"{dataset.directory}: has a mask, expected a dataset without one")
    if os.path.realpath(path_from(out)) == os.path.realpath(dataset.directory):
        raise InvalidInputError(f"{os.fspath(out)}: is the dataset that is read, expected another folder")
    stop = Event()
    about = {"kind": "degraded", "hardships": list(HARDSHIPS), "seed": seed, "of": dict(dataset.source)}
    with new_dataset(
        out,
        dataset.camera,
        robot_from_camera=dataset.robot_from_camera,
        source=about | (source or {}),
        force=force,
    ) as new:

        def work(numbered: tuple[int, TiltImage]) -> TiltImage:
            number, image = numbered
            rng = np.random.default_rng((seed, number))
            hardship = HARDSHIPS[int(rng.integers(len(HARDSHIPS)))]
            gray = degrade_image(dataset.read(image), hardship, dataset.camera, rng)
            return new.write(
                f"{number:05d}_{hardship}",
                gray,
                location=image.location,
                environment=image.environment,
                alpha_rad=image.alpha_rad,
                beta_rad=image.beta_rad,
                yaw_rad=image.yaw_rad,
            )

        with in_order(work, list(enumerate(dataset.images)), threads, stop) as images:
            for image in images:
                new.images.append(image)
                advance()
