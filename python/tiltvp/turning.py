"""Whether images turn as the odometry says, about which axis, and when."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.arguments import array_from, number_from, refuse_unless
from tiltvp.errors import InvalidInputError
from tiltvp.images import camera_grays, checked_camera
from tiltvp.rotations import mounting_from
from tiltvp.setup_check import DIRECTIONS, nearest_direction, opposite_direction
from tiltvp.streams.odometry import Odometry

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera

__all__ = [
    "LEAST_PAIRS", "FrameDelay", "Pictures", "TurnAxis", "TurnCheck", "check_turns", "frame_delay", "made_small",
    "pairs_of", "peak", "small_camera", "telling_frames", "turn_axis",
]  # fmt: skip

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
LEAST_PAIRS: Final = 4
_REACH_MAX_S: Final = 60.0
"""Farthest delay that is looked at: clocks of one robot that are a minute apart are not set at all."""
_COARSE_STEP_S: Final = 0.1
_FINE_STEPS: Final = 7
"""To both sides of the best coarse one: a step of these and two more."""
_DELAY_STEP_S: Final = 0.02
"""Of delays that are tried: half a frame at 25 a second."""
_DELAY_FLOOR_S: Final = 0.005
"""Least standard deviation of a delay: what a parabola over steps of 0.02 s leaves."""
_DELAY_SIGMA_MAX_S: Final = 0.03
_LIKENESS_MIN: Final = 0.3
"""Least mean correlation of a delay that is believed: pairs of unlike images have below 0.2."""
_CLOCK_FRAMES: Final = 120
_CLOCK_STEP_S: Final = 0.2
"""How many frames tell a delay, and how far apart they are at most: 24 seconds, in which turns begin and end."""
_PARTS: Final = 8
"""Of a drive, each of which is left out in turn."""


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
        return self.pairs >= LEAST_PAIRS and self.turned_rad >= _TURNED_RAD and abs(self.sigmas) >= _SIGMAS

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
        need = "turns by 45 degrees" if self.turned_rad < _TURNED_RAD else "more views that are 6 to 50 degrees apart"
        return f"{found}, over {math.degrees(self.turned_rad):.0f} degrees: not told, expected {need}"


def check_turns(
    images: Iterable[ArrayLike], yaw_rad: ArrayLike, camera: Camera, robot_from_camera: ArrayLike
) -> TurnCheck:
    """Whether images (N of them, taken one after the other) turn as headings (N,) say, left positive.

    Headings of a compass, within a turn, are followed across its end. A mirrored image, or a camera whose calibration
    says wrongly that it is one, leaves a consistent world that turns the other way round; so do wheels that are
    swapped. Which of them it is cannot be told. The mounting (3, 3) has to be right about which way is up, not about
    its yaw. Raises `InvalidInputError` for sizes that do not fit.
    """
    up = _up_of(robot_from_camera)
    turned, scores = _turned_back(images, yaw_rad, camera, [up, -up])
    if not len(scores):
        return TurnCheck(0, turned, 0.0, 0.0, 0.0)
    told, otherwise = (float(mean) for mean in scores.mean(axis=0))
    return TurnCheck(len(scores), turned, told, otherwise, _lead(scores[:, 0] - scores[:, 1]))


@dataclass(frozen=True)
class TurnAxis:
    """About which of the six directions images turn to the left where the odometry says so. True where they tell.

    That is up, but where the image is mirrored, or left and right of the odometry are swapped: then it is down.
    """

    pairs: int
    """Pairs of images that were compared."""
    turned_rad: float
    """How far the headings are apart at most."""
    likeness: dict[str, float]
    """Mean correlation of pairs turned back about each direction of `DIRECTIONS`."""
    leads: dict[str, float]
    """By how many of its standard errors each is ahead of the opposite one."""
    sigmas: float
    """The same of the best one and the next."""

    @property
    def best(self) -> str:
        """The direction about which pairs are most alike."""
        return max(self.likeness, key=lambda name: self.likeness[name])

    def __bool__(self) -> bool:
        return self.pairs >= LEAST_PAIRS and self.turned_rad >= _TURNED_RAD and self.sigmas >= _SIGMAS

    def check(self, up: str) -> TurnCheck:
        """Whether images turn as told where that direction is up: what `check_turns` says."""
        as_told, otherwise = self.likeness[up], self.likeness[opposite_direction(up)]
        return TurnCheck(self.pairs, self.turned_rad, as_told, otherwise, self.leads[up])


def turn_axis(
    images: Iterable[ArrayLike], yaw_rad: ArrayLike, camera: Camera, robot_from_camera: ArrayLike | None = None
) -> TurnAxis:
    """About which of the camera's six directions images (N of them) turn as headings (N,) say, left positive.

    With a mounting (3, 3) its own up and down stand for the directions that are nearest to them. Raises
    `InvalidInputError` for sizes that do not fit.
    """
    axes = {name: np.array(direction) for name, direction in DIRECTIONS.items()}
    if robot_from_camera is not None:
        up = _up_of(robot_from_camera)
        for sign in (1.0, -1.0):
            axes[nearest_direction(sign * up)] = sign * up
    turned, scores = _turned_back(images, yaw_rad, camera, list(axes.values()))
    if not len(scores):
        nothing = dict.fromkeys(DIRECTIONS, 0.0)
        return TurnAxis(0, turned, nothing, nothing, 0.0)
    of = dict(zip(DIRECTIONS, scores.T, strict=True))
    likeness = {name: float(each.mean()) for name, each in of.items()}
    leads = {name: _lead(each - of[opposite_direction(name)]) for name, each in of.items()}
    best = max(likeness, key=lambda name: likeness[name])
    sigmas = min(_lead(of[best] - each) for name, each in of.items() if name != best)
    return TurnAxis(len(scores), turned, likeness, leads, sigmas)


def _up_of(robot_from_camera: ArrayLike) -> NDArray[np.float64]:
    """(3,): the robot's z axis in the camera frame."""
    return np.asarray(mounting_from(robot_from_camera)[2])


def _turned_back(
    images: Iterable[ArrayLike], yaw_rad: ArrayLike, camera: Camera, ups: list[NDArray[np.float64]]
) -> tuple[float, NDArray[np.float64]]:
    """How far headings are apart at most, and how alike pairs are, (P, U), turned back about each direction (3,)."""
    pictures = Pictures(images, camera)
    headings = pictures.headings(yaw_rad)
    scores = np.array([
        [pictures.likeness(k, other, up * float(headings[k] - headings[other])) for up in ups]
        for k, other in pairs_of(headings)
    ]).reshape(-1, len(ups))  # fmt: skip
    turned = min(float(np.ptp(headings)) if len(headings) else 0.0, math.tau)
    return turned, scores[np.isfinite(scores).all(axis=1)]


def _lead(differences: NDArray[np.float64]) -> float:
    """The mean of differences in its standard errors."""
    # Both pairs of an image err together.
    spread = float(np.std(differences)) / math.sqrt(max(1.0, len(differences) / _PARTNERS))
    return float(np.mean(differences)) / max(spread, 1e-6)


@dataclass(frozen=True)
class FrameDelay:
    """By how much the times of images are later than those of the odometry. False where the drive does not tell."""

    delay_s: float
    sigma_s: float
    """Its standard deviation, by leaving out parts of the drive."""
    likeness: float
    """Mean correlation of pairs turned back with that delay."""
    pairs: int

    def __bool__(self) -> bool:
        return self.likeness >= _LIKENESS_MIN and self.sigma_s <= _DELAY_SIGMA_MAX_S

    @property
    def reason(self) -> str:
        """What was found, in a sentence."""
        told = f"{self.pairs} pairs of images correlate by {self.likeness:.2f} at a delay of {self.delay_s:.3f} s"
        return f"{told}, 1-sigma {self.sigma_s:.3f}" if self else f"{told}: not told, expected turns that begin and end"


def frame_delay(
    images: Iterable[ArrayLike],
    times_s: ArrayLike,
    odometry: Odometry,
    camera: Camera,
    robot_from_camera: ArrayLike,
    *,
    reach_s: float = 1.0,
) -> FrameDelay:
    """By how much the times (N,) of images are later than the odometry's, where the robot's turns begin and end.

    For each delay within `reach_s` images are turned back by what the odometry says of their true times, and compared.
    The mounting (3, 3) has to be right about which way is up. Raises `InvalidInputError` for sizes that do not fit.
    """
    refuse_unless(odometry, Odometry, "odometry", "a tiltvp.streams.Odometry")
    if not 0.0 < number_from(reach_s, "reach_s") <= _REACH_MAX_S:
        raise InvalidInputError(f"reach_s = {reach_s}, expected seconds above 0, at most {_REACH_MAX_S:g}")
    pictures, up = Pictures(images, camera), _up_of(robot_from_camera)
    times = array_from(times_s, "times_s")
    if times.shape != (len(pictures),) or not np.isfinite(times).all():
        raise InvalidInputError(f"times_s: shape {times.shape}, expected ({len(pictures)},) of finite times")
    headings = odometry.at(times).yaw_rad
    if headings is None:
        raise InvalidInputError(f"{odometry.source}: distances without turns, expected the distance between the wheels")
    pairs = pairs_of(headings)

    def likenesses(delays: NDArray[np.floating]) -> NDArray[np.float64]:
        found = np.full((len(pairs), len(delays)), np.nan)
        for column, delay in enumerate(delays):
            turned = odometry.at(times - delay).yaw_rad
            assert turned is not None  # As above.
            found[:, column] = [
                pictures.likeness(k, other, up * float(turned[k] - turned[other])) for k, other in pairs
            ]
        return found

    coarse = np.arange(-reach_s, reach_s + 0.5 * _COARSE_STEP_S, _COARSE_STEP_S)
    table = likenesses(coarse)
    known = np.isfinite(table).all(axis=1)
    if known.sum() < _PARTS:
        return FrameDelay(0.0, math.inf, 0.0, int(known.sum()))
    rough = float(coarse[int(np.argmax(table[known].mean(axis=0)))])
    delays = rough + np.arange(-_FINE_STEPS, _FINE_STEPS + 1) * _DELAY_STEP_S
    fine = likenesses(delays)
    fine = fine[known & np.isfinite(fine).all(axis=1)]
    if len(fine) < _PARTS:
        return FrameDelay(rough, math.inf, 0.0, len(fine))
    best, likeness = peak(delays, fine)
    parts = np.arange(len(fine)) * _PARTS // len(fine)
    without = np.array([peak(delays, fine[parts != part])[0] for part in range(_PARTS)])
    sigma = math.sqrt((_PARTS - 1) / _PARTS * float(np.sum((without - without.mean()) ** 2)))
    # At the border of what is looked at there is no peak.
    sigma = math.inf if abs(rough) > reach_s - 0.5 * _COARSE_STEP_S else max(sigma, _DELAY_FLOOR_S)
    return FrameDelay(best, sigma, likeness, len(fine))


def telling_frames(times_s: ArrayLike, odometry: Odometry) -> NDArray[np.intp]:
    """Numbers of at most 120 of the frames at these times (N,), by which `frame_delay` tells most.

    A delay turns the views of two frames apart by as much as the robot turned faster at the one than at the other: of
    all stretches these are of that in which the rates of its turns differ most. Frames of more than 5 a second are
    passed over as far as there are others.
    """
    times = np.asarray(times_s, dtype=np.float64)
    step = float(np.median(np.diff(times))) if len(times) > 1 else _CLOCK_STEP_S
    stride = max(1, min(len(times) // _CLOCK_FRAMES, int(_CLOCK_STEP_S / max(step, 1e-3))))
    numbers = np.arange(0, len(times), stride)
    headings = odometry.at(times[numbers]).yaw_rad
    if headings is None or len(numbers) <= _CLOCK_FRAMES:
        return numbers[:_CLOCK_FRAMES]
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = np.diff(headings) / np.diff(times[numbers])
    known = np.isfinite(rates)
    rates = np.where(known, rates, 0.0)
    count, total, squares = (
        np.convolve(values, np.ones(_CLOCK_FRAMES - 1), "valid") for values in (known.astype(float), rates, rates**2)
    )
    told = np.maximum(squares - total**2 / np.maximum(count, 1.0), 0.0)
    # Of stretches that tell as much that in the middle, so that turns do not begin at their borders.
    best = np.flatnonzero(told >= 0.99 * told.max())
    first = best[len(best) // 2]
    return numbers[first : first + _CLOCK_FRAMES]


def peak(delays: NDArray[np.floating], table: NDArray[np.float64]) -> tuple[float, float]:
    """The delay (D,) at which pairs (P, D) are most alike, by a parabola, and how much they are."""
    mean = table.mean(axis=0)
    at = int(np.clip(np.argmax(mean), 1, len(delays) - 2))
    low, top, high = mean[at - 1 : at + 2]
    bend = low - 2.0 * top + high
    shift = 0.5 * (low - high) / bend if bend < 0.0 else 0.0
    return float(delays[at] + np.clip(shift, -1.0, 1.0) * (delays[1] - delays[0])), float(top)


class Pictures:
    """Small images, and how alike two of them are after a turn of the robot."""

    def __init__(self, images: Iterable[ArrayLike], camera: Camera) -> None:
        checked_camera(camera)
        self._camera = small_camera(camera)
        # A byte a pixel: of 20,000 images those of hours, in 0.2 GB.
        self._grays = [made_small(gray, camera) for gray in camera_grays(images, camera)]
        v, u = np.nonzero(self._camera.valid_mask())
        self._places = np.column_stack([u, v])
        self._rays = self._camera.unproject(self._places.astype(np.float64))

    def __len__(self) -> int:
        return len(self._grays)

    def headings(self, yaw_rad: ArrayLike) -> NDArray[np.float64]:
        """One for each image; those of a compass jump by a turn, which is none. Raises `InvalidInputError`."""
        headings = array_from(yaw_rad, "yaw_rad")
        if headings.shape != (len(self),) or not np.isfinite(headings).all():
            raise InvalidInputError(f"yaw_rad: shape {headings.shape}, expected ({len(self)},) of finite angles")
        found: NDArray[np.float64] = np.unwrap(headings)
        return found

    def likeness(self, k: int, other: int, turn_rad: NDArray[np.float64]) -> float:
        """Correlation of two images where the camera turned by a rotation vector (3,) from the other to `k`; NaN: not
        known."""
        import cv2

        if not np.isfinite(turn_rad).all():
            return math.nan
        # A direction that is seen here at ray r was seen there at R r.
        there = self._rays @ cv2.Rodrigues(turn_rad)[0].T
        here = self._grays[k][self._places[:, 1], self._places[:, 0]].astype(np.float64)
        return _correlation(here, self._grays[other], self._camera.project(there))


def small_camera(camera: Camera) -> Camera:
    """The camera of images made smaller by `made_small`."""
    return camera.scaled(min(1.0, _SIDE_PX / max(camera.width, camera.height)))


def made_small(image: NDArray[np.uint8], camera: Camera) -> NDArray[np.uint8]:
    """A grey image (H, W) of a camera as it is compared: turns are told at 120 pixels."""
    import cv2

    small = small_camera(camera)
    return np.asarray(cv2.resize(image, (small.width, small.height), interpolation=cv2.INTER_AREA))


def pairs_of(headings: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Each image with the next ones that have turned by an angle that is compared."""
    low, high = _TURNS_RAD
    found = []
    for k in range(len(headings)):
        turns = np.abs(headings[k + 1 :] - headings[k])
        found += [(k, int(k + 1 + at)) for at in np.flatnonzero((turns >= low) & (turns <= high))[:_PARTNERS]]
    return found


def _correlation(here: NDArray[np.float64], image: NDArray[np.uint8], pixels: NDArray[np.float64]) -> float:
    """Of grey levels (M,) with those of an image at pixels (M, 2); NaN where too few are in it."""
    with np.errstate(invalid="ignore"):
        inside = (pixels >= 0.0).all(axis=1) & (pixels <= np.array(image.shape[::-1]) - 1.0).all(axis=1)
    if inside.sum() < _SHARED_MIN:
        return math.nan
    u, v = np.rint(pixels[inside]).astype(int).T
    there = image[v, u].astype(np.float64)
    a, b = here[inside] - here[inside].mean(), there - there.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 1e-6 else math.nan
