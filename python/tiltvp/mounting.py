"""Roll and pitch of a camera's mounting from the tilts of a drive: what stays when the robot turns."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp.arguments import each_from, flag_from, number_from
from tiltvp.errors import InvalidInputError, counted
from tiltvp.rotations import levelling, mounting_from
from tiltvp.tilt import TiltFilter

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp.streams.odometry import Motion
    from tiltvp.tilt import FilteredTilt, TiltEstimate

__all__ = ["MountingTilt", "mounting_tilt"]

_PRIOR_RAD: Final = math.radians(5.0)
"""How far a mounting may be off before it is known: as far as a camera that is screwed on by eye."""
_KNOWN_RAD: Final = 0.5 * _PRIOR_RAD
"""Least deviation of what a drive does not tell: half of what was known before it. Parts of such a drive contradict
each other, as with odometry of another clock; rendered drives whose odometry is right state less than 0.3 degrees."""
_LEVEL: Final[dict[str, Any]] = {
    "prior_rad": math.radians(0.05), "walk_rad_per_sqrt_m": 0.0, "walk_rad_per_sqrt_step": 0.0,
}  # fmt: skip
"""How level a floor is that is said to be level: a millimetre in a metre, as a builder's spirit level tells."""
_SHARED: Final = 0.2
"""Share of the standard deviation of single images' errors that is alike at all headings, so that no turn averages it
out. Of 50 real panoramas, seen at twelve headings by a camera that looks ahead, the mean of all headings is in the 95 %
region of its jackknife in 90 %, with this in 94 %; looking up in nearly all either way."""
_PARTS: Final = 8
"""Of a drive, each left out in turn: neighbouring images err alike, and over bumps lean alike. With 16
parts stated deviations are half of the errors over bumps (`tiltvp measure mounting`, seeds 990 and 1600)."""
_FEW_PARTS: Final = (_PARTS - 1) ** 2 / (_PARTS * (_PARTS - 4))
"""Of the sum of squares by which an answer moves when each part is left out (n - 1) / n is its covariance (Efron 1982).
From n parts that is known by few: two errors' square in its variances is (n - 1) / (n - 4) times 2 in the mean."""
_PART_RAD_PER_M: Final = 0.25 * math.pi
"""A turn that shows as much that is new as a metre of the way does."""
_AGREEMENT_MAX: Final = 0.1
"""Of the deviations that images state: that they agree still better tells nothing of what they err by alike."""
_QUANTILE: Final = math.sqrt(5.991)
"""Radius of the region of 95 % of two normal angles, in standard deviations."""


@dataclass(frozen=True, eq=False)
class MountingTilt:
    """Roll and pitch of the mounting, as a drive tells them. False, with a reason, where it does not.

    What the camera's mounting and the robot itself have of a constant lean (soft wheels, a load) adds up to one: images
    do not part them. Nor do they tell the yaw, which is left as it was given.
    """

    robot_from_camera: NDArray[np.float64]
    """(3, 3): the mounting that was given, where the drive tells it turned the least so that the robot stands upright
    on a level floor."""
    lean: FilteredTilt
    """By how much the robot seems to lean on a level floor by the mounting that was given, with its covariance."""
    floor: FilteredTilt
    """The floor's tilt after the last image, in the frame of the wheels."""
    images: int
    """How many images were given."""
    driven: int
    """Of how many of them it was said what the robot had done."""
    used: int
    """How many of these had a tilt that agreed with the others'."""
    turned_rad: float
    """How far the headings are apart at most, at least 0 and at most 2 pi."""
    level_floor: bool
    """Whether the floor was said to be level."""
    covariance_rad2: NDArray[np.float64]
    """(2, 2): of the errors of the mounting about the robot's x and y axes. The sum of `shared_rad2` and of what it
    scatters by when eighths of the drive are left out; where there was not half a turn, or too few images for that, no
    less than the filter's in any direction."""
    shared_rad2: NDArray[np.float64]
    """(2, 2): what no turn averages out: a part of what images scatter by, without turns all that one may err by."""

    def __bool__(self) -> bool:
        return bool(self.lean) and self.sigma_rad < _KNOWN_RAD

    @property
    def sigma_rad(self) -> float:
        """One standard deviation in any one direction."""
        return math.sqrt(0.5 * float(np.trace(self.covariance_rad2)))

    @property
    def reason(self) -> str:
        """What was found, or why nothing was, in a sentence."""
        told = f"{self.used} of {counted(self.images, 'images')}"
        told += f", headings within {math.degrees(self.turned_rad):.0f} degrees"
        if not self:
            if not self.driven:
                return f"{told}: the odometry tells of the time of none"
            if not self.used:
                return f"{told}: no image tells a tilt"
            if self.lean:
                sigma = math.degrees(self.sigma_rad)
                need = "expected odometry of the images' clock, in the right sense and units"
                return f"{told}: parts of the drive contradict each other, 1-sigma {sigma:.3f} degrees, {need}"
            need = "expected a robot that turns in place, or a floor that is said to be level"
            return f"{told}: the floor's tilt and the mounting's are not told apart, {need}"
        off, sigma = math.degrees(self.lean.alpha_rad), math.degrees(self.sigma_rad)
        return f"{told}: the mounting is {off:.3f} degrees off, 1-sigma {sigma:.3f}"

    def within(self, tolerance_rad: float) -> bool | None:
        """Whether the mounting that was given is off by at most so much, at 95 %; None where that is not told."""
        if not 0.0 < number_from(tolerance_rad, "tolerance_rad") < math.inf:
            raise InvalidInputError(f"tolerance_rad = {tolerance_rad}, expected a positive number of radians")
        if not self:
            return None
        reach = _QUANTILE * self.sigma_rad
        if self.lean.alpha_rad + reach <= tolerance_rad:
            return True
        return False if self.lean.alpha_rad - reach > tolerance_rad else None


def mounting_tilt(
    estimates: Iterable[TiltEstimate | None],
    motions: Sequence[Motion | None],
    robot_from_camera: ArrayLike,
    *,
    level_floor: bool = False,
    half_track_m: float | None = None,
) -> MountingTilt:
    """Roll and pitch of a mounting from the tilts of a drive's images and what the robot did between them.

    `estimates` are those of a `TiltEstimator` with the mounting `robot_from_camera` (3, 3), in the images' order, best
    of method "segments"; None where there is no image. `motions` say of each how far the robot had turned and driven
    since the one before; an image of which nobody knows that, None, is left out. A floor that is plane but not level
    turns with the robot, the mounting does not: a `TiltFilter` with `estimate_mounting` tells them apart where the
    robot turns. `level_floor` says that the floor is level to 0.05 degrees, so that no turn is needed. `half_track_m`
    is half of the distance between the wheels, by default that of `TiltFilter`: of a robot that is wider the floor
    changes more in a turn. Raises `InvalidInputError` for as many motions as there are not images, and for a matrix
    that is no rotation.
    """
    rotation = mounting_from(robot_from_camera)
    images = each_from(estimates, "estimates", "normal", "TiltEstimate or None", or_none=True)
    motions = each_from(motions, "motions", "yaw_rad", "Motion or None", or_none=True)
    if len(images) != len(motions):
        raise InvalidInputError(f"motions: {len(motions)}, expected {len(images)}, one for each image")
    known = [(image, motion) for image, motion in zip(images, motions, strict=True) if motion is not None]
    given, driven = [image for image, _ in known], [motion for _, motion in known]
    told = dict(_LEVEL) if flag_from(level_floor, "level_floor") else {}
    if half_track_m is not None:
        told["half_track_m"] = half_track_m
    whole = _filtered(given, driven, told)
    lean, used = whole.lean, len(whole.covariances)
    headings = np.cumsum([0.0, *(motion.yaw_rad for motion in driven[1:])])
    turned = min(float(np.ptp(headings)), math.tau)
    shared, covariance = np.zeros((2, 2)), np.asarray(lean.covariance_rad2)
    if lean:
        # Of a filter that is right the mean normalised innovation squared is 2.
        excess = 0.5 * float(np.mean(whole.surprises)) if whole.surprises else 1.0
        # Images at headings half a turn apart show different things. At one heading they err alike, so that their
        # scatter tells nothing, and what the floor is taken for counts.
        alike = max(0.0, 1.0 - turned / math.pi)
        share = alike * max(1.0, excess) + (1.0 - alike) * _SHARED**2 * max(_AGREEMENT_MAX**2, excess)
        shared = share * np.median(whole.covariances, axis=0)
        scatter = _scatter(given, driven, lean, told) if used >= 2 * _PARTS else None
        stated = (1.0 if scatter is None else alike) * max(1.0, excess) * covariance
        covariance = shared + _beyond(stated, shared) + (0.0 if scatter is None else scatter)
    found = MountingTilt(
        rotation, lean, whole.floor, len(images), len(known), used, turned, level_floor, _about_axes(covariance),
        _about_axes(shared),
    )  # fmt: skip
    return replace(found, robot_from_camera=levelling(lean.normal) @ rotation) if found else found


@dataclass(frozen=True, eq=False)
class _Filtered:
    """What the filter makes of a drive."""

    lean: FilteredTilt
    floor: FilteredTilt
    covariances: list[NDArray[np.float64]]
    """(2, 2) each: of the images that agree with the others."""
    surprises: list[float]
    """Normalised innovations squared."""


def _filtered(estimates: Sequence[TiltEstimate | None], motions: Sequence[Motion], told: dict[str, Any]) -> _Filtered:
    held = TiltFilter(
        estimate_mounting=True, mounting_prior_rad=_PRIOR_RAD, mounting_walk_rad_per_sqrt_m=0.0, **told
    )  # fmt: skip
    covariances, surprises = [], []
    for estimate, motion in zip(estimates, motions, strict=True):
        held.predict(motion.yaw_rad, motion.distance_m)
        if estimate is None:
            continue
        step = held.update(estimate)
        if step.accepted:
            covariances.append(estimate.covariance_rad2)
        if step.nis is not None and math.isfinite(step.nis):
            surprises.append(step.nis)
    lean = held.mounting
    assert lean is not None  # It was asked for.
    return _Filtered(lean, held.floor, covariances, surprises)


def _scatter(
    estimates: Sequence[TiltEstimate | None], motions: Sequence[Motion], lean: FilteredTilt, told: dict[str, Any]
) -> NDArray[np.float64] | None:
    """(2, 2): the covariance by how far the mounting moves when each part of the drive is left out in turn.

    None where what is left does not tell it.
    """
    way = np.cumsum([motion.distance_m + abs(motion.yaw_rad) / _PART_RAD_PER_M for motion in motions])
    seen = [number for number, estimate in enumerate(estimates) if estimate is not None]
    first, last = way[seen[0]], way[seen[-1]]
    parts = np.floor(_PARTS * (way - first) / max(last - first, np.finfo(np.float64).tiny)).clip(0, _PARTS - 1)
    moves = []
    for part in range(_PARTS):
        rest = [None if own == part else estimate for own, estimate in zip(parts, estimates, strict=True)]
        other = _filtered(rest, motions, told).lean
        if not other:
            return None
        moves.append(np.asarray(other.normal)[:2] - np.asarray(lean.normal)[:2])
    together = np.array(moves)
    scatter: NDArray[np.float64] = _FEW_PARTS * together.T @ together
    return scatter


def _beyond(larger: NDArray[np.float64], than: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2, 2): by how much a covariance exceeds another one, in the directions in which it does."""
    values, axes = np.linalg.eigh(larger - than)
    exceeding: NDArray[np.float64] = axes * np.maximum(values, 0.0) @ axes.T
    return exceeding


def _about_axes(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2, 2): of the small turn (w_x, w_y) of a mounting, by which the normal that it sees moves by (-w_y, w_x)."""
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    turned: NDArray[np.float64] = turn @ covariance @ turn.T
    return turned
