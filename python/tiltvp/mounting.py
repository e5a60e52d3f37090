"""Roll and pitch of a camera's mounting from the tilts of a drive: what stays when the robot turns."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp.errors import InvalidInputError
from tiltvp.rotations import levelling, rotation_from
from tiltvp.tilt import TiltFilter

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp.streams.odometry import Motion
    from tiltvp.tilt import FilteredTilt, TiltEstimate

__all__ = ["MountingTilt", "mounting_tilt"]

_PRIOR_RAD: Final = math.radians(5.0)
"""How far a mounting may be off before it is known: as far as a camera that is screwed on by eye."""
_LEVEL: Final[dict[str, Any]] = {
    "prior_rad": math.radians(0.05), "walk_rad_per_sqrt_m": 0.0, "walk_rad_per_sqrt_step": 0.0,
}  # fmt: skip
"""How level a floor is that is said to be level: a millimetre in a metre, as a builder's spirit level tells."""
_SHARED: Final = 0.5
"""Share of a single image's standard deviation by which images err alike at all headings, so that no turn averages it
out: over bumps the mounting errs by 0.14 to 0.22 degrees where single images state 0.2 (`tiltvp measure mounting`,
seeds 990 and 1600, by which this was chosen: the largest of eighteen is just inside the 95 % region)."""
_QUANTILE: Final = math.sqrt(5.991)
"""Radius of the region of 95 % of two normal angles, in standard deviations."""


@dataclass(frozen=True, eq=False)
class MountingTilt:
    """Roll and pitch of the mounting, as a drive tells them. False, with a reason, where it does not.

    What the camera's mounting and the robot itself have of a constant lean (soft wheels, a load) adds up to one: images
    do not part them. Nor do they tell the yaw, which is left as it was given.
    """

    robot_from_camera: NDArray[np.float64]
    """(3, 3): the mounting that was given, turned the least so that the robot stands upright on a level floor."""
    lean: FilteredTilt
    """By how much the robot seems to lean on a level floor by the mounting that was given, with its covariance."""
    floor: FilteredTilt
    """The floor's tilt after the last image, in the frame of the wheels."""
    images: int
    """How many images were given."""
    used: int
    """How many of them had a tilt that agreed with the others'."""
    turned_rad: float
    """How far the headings are apart at most, at least 0 and at most 2 pi."""
    level_floor: bool
    """Whether the floor was said to be level."""
    covariance_rad2: NDArray[np.float64]
    """(2, 2): of the errors of the mounting about the robot's x and y axes. To the filter's covariance, larger where
    images disagree more than it expects, as over bumps, comes `shared_rad2`."""
    shared_rad2: NDArray[np.float64]
    """(2, 2): what no turn averages out, for which one image errs at all headings alike."""

    def __bool__(self) -> bool:
        return bool(self.lean)

    @property
    def sigma_rad(self) -> float:
        """One standard deviation in any one direction."""
        return math.sqrt(0.5 * float(np.trace(self.covariance_rad2)))

    @property
    def reason(self) -> str:
        """What was found, or why nothing was, in a sentence."""
        told = f"{self.used} of {self.images} images, headings within {math.degrees(self.turned_rad):.0f} degrees"
        if not self:
            if not self.used:
                return f"{told}: no image tells a tilt"
            need = "expected a robot that turns in place, or a floor that is said to be level"
            return f"{told}: the floor's tilt and the mounting's are not told apart, {need}"
        off, sigma = math.degrees(self.lean.alpha_rad), math.degrees(self.sigma_rad)
        return f"{told}: the mounting is {off:.3f} degrees off, 1-sigma {sigma:.3f}"

    def within(self, tolerance_rad: float) -> bool | None:
        """Whether the mounting that was given is off by at most so much, at 95 %; None where that is not told."""
        if not (math.isfinite(tolerance_rad) and tolerance_rad > 0.0):
            raise InvalidInputError(f"tolerance_rad = {tolerance_rad}, expected a positive number of radians")
        if not self:
            return None
        reach = _QUANTILE * self.sigma_rad
        if self.lean.alpha_rad + reach <= tolerance_rad:
            return True
        return False if self.lean.alpha_rad - reach > tolerance_rad else None


def mounting_tilt(
    estimates: Iterable[TiltEstimate | None],
    motions: Sequence[Motion],
    robot_from_camera: ArrayLike,
    *,
    level_floor: bool = False,
) -> MountingTilt:
    """Roll and pitch of a mounting from the tilts of a drive's images and what the robot did between them.

    `estimates` are those of a `TiltEstimator` with the mounting `robot_from_camera` (3, 3), in the images' order, best
    of method "segments"; None where there is no image. `motions` say of each how far the robot had turned and driven
    since the one before. A floor that is plane but not level turns with the robot, the mounting does not: a
    `TiltFilter` with `estimate_mounting` tells them apart where the robot turns. `level_floor` says that the floor is
    level to 0.05 degrees, so that no turn is needed. Raises `InvalidInputError` for as many motions as there are not
    images, and for a matrix that is no rotation.
    """
    rotation = rotation_from(np.asarray(robot_from_camera, dtype=np.float64).tolist(), "robot_from_camera")
    held = TiltFilter(
        estimate_mounting=True, mounting_prior_rad=_PRIOR_RAD, mounting_walk_rad_per_sqrt_m=0.0,
        **(_LEVEL if level_floor else {}),
    )  # fmt: skip
    given = list(estimates)
    if len(given) != len(motions):
        raise InvalidInputError(f"motions: {len(motions)}, expected {len(given)}, one for each image")
    used, surprises, covariances = 0, [], []
    for estimate, motion in zip(given, motions, strict=True):
        held.predict(motion.yaw_rad, motion.distance_m)
        if estimate is None:
            continue
        step = held.update(estimate)
        if step.accepted:
            used += 1
            covariances.append(estimate.covariance_rad2)
        if step.nis is not None and math.isfinite(step.nis):
            surprises.append(step.nis)
    lean = held.mounting
    assert lean is not None  # It was asked for.
    headings = np.cumsum([0.0, *(motion.yaw_rad for motion in motions[1:])])
    turned = min(float(np.ptp(headings)), math.tau)
    upright = levelling(lean.normal) @ rotation if lean else rotation
    # Of a filter that is right the mean normalised innovation squared is 2.
    excess = max(1.0, 0.5 * float(np.mean(surprises))) if surprises else 1.0
    shared = _about_axes(_SHARED**2 * np.median(covariances, axis=0) if covariances else np.zeros((2, 2)))
    covariance = _about_axes(excess * np.asarray(lean.covariance_rad2)) + shared
    return MountingTilt(upright, lean, held.floor, len(given), used, turned, level_floor, covariance, shared)


def _about_axes(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2, 2): of the small turn (w_x, w_y) of a mounting, by which the normal that it sees moves by (-w_y, w_x)."""
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    turned: NDArray[np.float64] = turn @ covariance @ turn.T
    return turned
