"""Whether images turn as the odometry says: a mirrored image, and wheels that are swapped, turn the other way round."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.errors import InvalidInputError
from tiltvp.images import gray_from
from tiltvp.rotations import about_vertical

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera

__all__ = ["TurnCheck", "check_turns"]

_SIDE_PX: Final = 120
"""Longer side to which images are made smaller: what is near moves by less than a pixel while the robot drives on."""
_TURNS_RAD: Final = (math.radians(6.0), math.radians(50.0))
"""Turns between two images that are compared: below, both directions look alike; above, views ahead share little."""
_PARTNERS: Final = 2
"""Images that each is compared with: the nearest that have turned by so much."""
_SHARED_MIN: Final = 100
"""Least number of pixels that two images have to share."""
_TURNED_RAD: Final = math.radians(45.0)
"""Headings have to be so far apart before there is an answer."""
_SIGMAS: Final = 3.0
"""By how many of its standard errors the mean difference has to be off zero."""
_LEAST: Final = 4


@dataclass(frozen=True)
class TurnCheck:
    """Whether images turn as the odometry says. True if they do; `reversed` if they turn the other way round."""

    pairs: int
    """Pairs of images that were compared."""
    turned_rad: float
    """How far the headings are apart at most."""
    as_told: float
    """Mean correlation of pairs turned back as the odometry tells."""
    otherwise: float
    """The same, turned back the other way round."""
    sigmas: float
    """Their mean difference in its standard errors, positive where images turn as told."""

    @property
    def told(self) -> bool:
        """Whether the images tell at all."""
        return self.pairs >= _LEAST and self.turned_rad >= _TURNED_RAD and abs(self.sigmas) >= _SIGMAS

    @property
    def reversed(self) -> bool:
        """Whether images turn the other way round."""
        return self.told and self.sigmas < 0.0

    def __bool__(self) -> bool:
        return self.told and self.sigmas > 0.0

    @property
    def reason(self) -> str:
        """What was found, in a sentence."""
        found = (
            f"{self.pairs} pairs of images correlate by {self.as_told:.2f} when turned as the odometry tells, by "
            f"{self.otherwise:.2f} the other way round"
        )
        if self.reversed:
            return f"{found}: the image is mirrored, or left and right of the odometry are swapped"
        if self:
            return f"{found}: images turn as told"
        return f"{found}, over {math.degrees(self.turned_rad):.0f} degrees: not told, expected turns by 45 degrees"


def check_turns(
    images: Iterable[ArrayLike], yaw_rad: ArrayLike, camera: Camera, robot_from_camera: ArrayLike
) -> TurnCheck:
    """Whether images (N of them, taken one after the other) turn as headings (N,) say, left positive.

    A mirrored image, or a camera whose calibration says wrongly that it is one, leaves a consistent world that turns
    the other way round; so do wheels that are swapped. Which of them it is cannot be told. The mounting (3, 3) has to
    be right about which way is up, not about its yaw. Raises `InvalidInputError` for sizes that do not fit.
    """
    small, grays = _small(images, camera)
    headings = np.asarray(yaw_rad, dtype=np.float64)
    if headings.shape != (len(grays),) or not np.isfinite(headings).all():
        raise InvalidInputError(f"yaw_rad: shape {headings.shape}, expected ({len(grays)},) of finite angles")
    places, rays = _robot_rays(small, np.asarray(robot_from_camera, dtype=np.float64))
    differences, scores = [], []
    for k in range(len(grays)):
        here = grays[k][places[:, 1], places[:, 0]]
        for other in _partners(headings, k):
            turn = float(headings[k] - headings[other])
            pair = []
            for sign in (1.0, -1.0):
                # A direction that is seen here at ray r was seen there at Rz(turn) r.
                there = rays @ about_vertical(sign * turn).T @ np.asarray(robot_from_camera, dtype=np.float64)
                pair.append(_correlation(here, grays[other], small.project(there)))
            if np.isfinite(pair).all():
                scores.append(pair)
                differences.append(pair[0] - pair[1])
    turned = min(float(np.ptp(headings)) if len(headings) else 0.0, math.tau)
    if not scores:
        return TurnCheck(0, turned, 0.0, 0.0, 0.0)
    mean = np.mean(scores, axis=0)
    # Both pairs of an image err together.
    spread = float(np.std(differences)) / math.sqrt(max(1.0, len(differences) / _PARTNERS))
    return TurnCheck(
        len(scores), turned, float(mean[0]), float(mean[1]), float(np.mean(differences) / max(spread, 1e-6))
    )


def _small(images: Iterable[ArrayLike], camera: Camera) -> tuple[Camera, list[NDArray[np.float64]]]:
    import cv2

    scale = min(1.0, _SIDE_PX / max(camera.width, camera.height))
    small = camera.scaled(scale)
    grays = []
    for number, image in enumerate(images):
        gray = gray_from(image, f"images[{number}]")
        if gray.shape != (camera.height, camera.width):
            expected = f"({camera.height}, {camera.width}), as the camera's images"
            raise InvalidInputError(f"images[{number}]: shape {gray.shape}, expected {expected}")
        grays.append(cv2.resize(gray, (small.width, small.height), interpolation=cv2.INTER_AREA).astype(np.float64))
    return small, grays


def _robot_rays(
    camera: Camera, robot_from_camera: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Pixels (M, 2) with a bearing, and these (M, 3) in the robot's frame."""
    v, u = np.nonzero(camera.valid_mask())
    places = np.column_stack([u, v])
    return places, camera.unproject(places.astype(np.float64)) @ robot_from_camera.T


def _partners(headings: NDArray[np.float64], k: int) -> list[int]:
    """The next images that have turned by an angle that is compared."""
    low, high = _TURNS_RAD
    turns = np.abs(headings[k + 1 :] - headings[k])
    return [int(k + 1 + at) for at in np.flatnonzero((turns >= low) & (turns <= high))[:_PARTNERS]]


def _correlation(here: NDArray[np.float64], image: NDArray[np.float64], pixels: NDArray[np.float64]) -> float:
    """Of grey levels (M,) with those of an image at pixels (M, 2); NaN where too few are in it."""
    with np.errstate(invalid="ignore"):
        inside = (pixels >= 0.0).all(axis=1) & (pixels <= np.array(image.shape[::-1]) - 1.0).all(axis=1)
    if inside.sum() < _SHARED_MIN:
        return math.nan
    u, v = np.rint(pixels[inside]).astype(int).T
    a, b = here[inside] - here[inside].mean(), image[v, u] - image[v, u].mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 1e-6 else math.nan
