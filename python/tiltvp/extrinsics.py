"""All of a camera's extrinsics but its height: roll and pitch from tilts joined with x, y and yaw from lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Final

import numpy as np

from tiltvp.arguments import array_from, each_from, number_from, refuse_unless
from tiltvp.errors import InvalidInputError
from tiltvp.mounting import MountingTilt
from tiltvp.robot import Robot
from tiltvp.rotations import about_vertical, mounting_from
from tiltvp.selfcalib import LogCalibration, consistency_band
from tiltvp.streams.outputs.transforms import COVARIANCE_AXES, StaticTransform

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Matrix = NDArray[np.float64]

__all__ = ["Extrinsics", "JoinedLogs", "JoinedTilts", "join_logs", "join_tilts"]

CHILD_FRAMES: Final = ("camera_mount", "camera_optical")
"""Names of the camera's frame in transforms, if no other is given: of a level one, and of one whose roll and pitch mean
something."""
_FALSE_ALARM: Final = 1e-3
"""How often logs that differ by chance alone, by their covariances, are said to contradict one another."""
START_SIGMA: Final = (0.3, 0.3, 0.5)
"""That of `tiltvp.calibrate`, by default."""
_TRACE: Final = 1e-9
"""Of what drives have in common: so much each is taken to have by itself, so that one that has no more has a weight."""


@dataclass(frozen=True, eq=False, kw_only=True)
class _Joined:
    """How far what was joined is apart."""

    logs: int
    """How many logs were joined."""
    distance: float
    """Sum of the squared distances of the logs from what they have in common, each by its own covariance."""
    limit: float
    """What it exceeds once in a thousand times if all is as the covariances say; infinite for one log."""
    odd: int | None = None
    """The place of the one log without which the others agree, where there is one alone; from 0."""

    _what: ClassVar[str]

    def __bool__(self) -> bool:
        return self.distance <= self.limit

    @property
    def reason(self) -> str:
        """Whether the logs agree, in a sentence."""
        if self.logs < 2:
            return f"{self._what} of one log: nothing to compare it with"
        apart = f"{self.distance:.1f} squared standard deviations apart, by chance below {self.limit:.1f}"
        found = f"{self._what} of {self.logs} logs: {apart}"
        if self.distance <= self.limit:
            return f"{found}: they agree"
        blame = "" if self.odd is None else f"; without log {self.odd + 1} the others agree"
        return f"{found}: the logs contradict one another, as when the camera was moved between them{blame}"


@dataclass(frozen=True, eq=False)
class JoinedLogs(_Joined):
    """x, y and yaw as all logs of one robot together have them.

    False where they contradict one another, and where one of them cannot be relied upon by itself.
    """

    xy_yaw: Matrix
    """(3,): metres and radians, yaw in (-pi, pi]."""
    covariance: Matrix
    """(3, 3): of x, y and yaw. What all logs have in common, such as a wrong wheel base, is not in it."""
    unreliable: tuple[int, ...] = ()
    """The places of the logs that cannot be relied upon by themselves, from 0."""

    _what = "x, y and yaw"

    def __bool__(self) -> bool:
        return super().__bool__() and not self.unreliable

    @property
    def reason(self) -> str:
        """Whether the logs agree, and which cannot be relied upon, in a sentence."""
        doubts = [f"log {place + 1} by itself is not to be relied upon" for place in self.unreliable]
        return "; ".join([super().reason, *doubts])


@dataclass(frozen=True, eq=False)
class JoinedTilts(_Joined):
    """Roll and pitch as all drives of one robot together have them. False where they contradict one another."""

    robot_from_camera: Matrix
    """(3, 3): the mounting but for its turn about the vertical, which is as it was given."""
    covariance_rad2: Matrix
    """(2, 2): of its errors about the robot's x and y axes."""

    _what = "roll and pitch"


@dataclass(frozen=True, eq=False)
class Extrinsics:
    """Where a camera is on a robot. True if what is known of it can be relied upon.

    Roll and pitch rest on what stays of the images' leans when the robot turns, x, y and yaw on how bearings change
    with the wheels, each taken about its own image's vertical. The errors of the two parts are taken to be independent;
    within each part they are correlated, as the parts say.
    """

    robot_from_camera: Matrix
    """(3, 3): rotation R of v_robot = R v_camera."""
    place_m: Matrix
    """(2,): x and y of the camera in the robot's frame."""
    covariance: Matrix
    """(5, 5): of the errors of x and y and of the rotation vector w about the robot's axes, with R_true = exp(w) R;
    metres and radians. NaN where roll and pitch were not measured."""
    height_m: float | None
    """Its height in the robot's frame, as it was given: no drive on a floor tells it."""
    oriented: bool
    """Whether roll and pitch mean anything: they were measured, or given."""
    reasons: tuple[str, ...]
    """What keeps it from being relied upon, a sentence each."""

    def __bool__(self) -> bool:
        return not self.reasons

    @classmethod
    def of(
        cls,
        place: JoinedLogs | LogCalibration,
        tilt: JoinedTilts | MountingTilt | Robot | None = None,
        *,
        robot_from_camera: ArrayLike | None = None,
        height_m: float | None = None,
    ) -> Extrinsics:
        """x, y and yaw of logs with roll and pitch of drives, or of a robot's file.

        `robot_from_camera` (3, 3) is the mounting that was given, where no drive tells roll and pitch. The yaw turns
        the mounting further.
        """
        if isinstance(place, JoinedLogs):
            (x, y, yaw), plane = place.xy_yaw, place.covariance
        else:
            if not hasattr(place, "mounting"):
                raise InvalidInputError(f"place: {type(place).__name__}, expected a LogCalibration or JoinedLogs")
            one = place.mounting
            (x, y, yaw), plane = (one.x_m, one.y_m, one.yaw_rad), one.covariance_xy_yaw
        reasons = [] if place else [place.reason]
        if tilt is not None:
            refuse_unless(tilt, JoinedTilts | MountingTilt | Robot, "tilt", "a JoinedTilts, MountingTilt or Robot")
        lean = None if tilt is None else tilt.covariance_rad2
        if isinstance(tilt, JoinedTilts | MountingTilt) and not tilt:
            reasons.append(tilt.reason)
        turn = about_vertical(yaw)
        covariance = np.full((5, 5), np.nan)
        covariance[np.ix_(_PLANE, _PLANE)] = plane
        if lean is not None:
            covariance[2:4] = covariance[:, 2:4] = 0.0
            covariance[2:4, 2:4] = turn[:2, :2] @ np.asarray(lean) @ turn[:2, :2].T
            covariance[np.ix_(_PLANE, _PLANE)] = plane
        given = np.eye(3) if robot_from_camera is None else robot_from_camera
        rotation = mounting_from(given if tilt is None else tilt.robot_from_camera)
        height_m = None if height_m is None else number_from(height_m, "height_m")
        return cls(
            turn @ rotation, np.array([x, y]), covariance, height_m,
            tilt is not None or robot_from_camera is not None, tuple(reasons),
        )  # fmt: skip

    @property
    def measured(self) -> bool:
        """Whether roll and pitch were measured, so that the covariance is complete."""
        return bool(np.isfinite(self.covariance).all())

    @property
    def missing(self) -> tuple[str, ...]:
        """What is not known, of x, y, z, roll, pitch and yaw."""
        return (*(("z",) if self.height_m is None else ()), *(() if self.oriented else ("roll", "pitch")))

    def transform(self, *, parent: str = "base_link", child: str | None = None) -> StaticTransform:
        """As a transform for ROS and for files; what is missing is 0 there, and named.

        The child is the camera's frame (`camera_optical`, z along the optical axis), or a level frame at the camera
        (`camera_mount`) where roll and pitch mean nothing. Raises `InvalidInputError` for names that no frame can have,
        for one name of both, and for numbers that are not finite.
        """
        sigmas = zip(COVARIANCE_AXES, np.sqrt(np.diag(self.covariance)).tolist(), strict=True)
        return StaticTransform(
            parent, CHILD_FRAMES[self.oriented] if child is None else child,
            np.array([*self.place_m, self.height_m or 0.0]), self.robot_from_camera, self.missing,
            tuple((name, sigma) for name, sigma in sigmas if not math.isnan(sigma)),
            self.covariance if self.measured else None,
        )  # fmt: skip

    def robot(self, robot: Robot) -> Robot:
        """That robot with these extrinsics; without covariance where they cannot be relied upon."""
        refuse_unless(robot, Robot, "robot", "a tiltvp.Robot")
        x, y = self.place_m.tolist()
        return replace(
            robot, robot_from_camera=self.robot_from_camera, place_m=(x, y), height_m=self.height_m,
            covariance_rad2=None, covariance=self.covariance if self and self.measured else None,
        )  # fmt: skip


_PLANE: Final = (0, 1, 4)
"""Of (x, y, about x, about y, about z)."""


def join_logs(
    logs: Sequence[LogCalibration],
    *,
    start: ArrayLike = (0.0, 0.0, 0.0),
    start_sigma: ArrayLike = START_SIGMA,
) -> JoinedLogs:
    """x, y and yaw of one camera from several logs, each weighed by its information.

    What the logs were started from counts once: `start` and `start_sigma`, as for `tiltvp.calibrate`, are x, y and yaw
    (3,) in metres and radians, and their standard deviations (3,) or covariance (3, 3). Logs whose answers are farther
    apart than chance has it once in a thousand times make the result false, and so does one that is false itself.
    Raises `InvalidInputError` for no log, for one that is given twice, for a log whose covariance is none, and for a
    start of other shapes.
    """
    logs = each_from(logs, "logs", "mounting", "LogCalibration")
    for number, log in enumerate(logs):
        if isinstance(log, LogCalibration) and log in logs[:number]:
            raise InvalidInputError(f"logs[{number}]: the same as one before, expected logs of different drives")
    first, prior = _start(start, start_sigma)
    found = [log.mounting for log in logs]
    values = np.array([[one.x_m, one.y_m, one.yaw_rad] for one in found]).reshape(-1, 3)
    if len(values):
        # About the first, so that no two are a turn apart.
        values[:, 2] = [_nearest(yaw, values[0, 2]) for yaw in values[:, 2]]
        first[2] = _nearest(first[2], values[0, 2])
    covariances = np.array([one.covariance_xy_yaw for one in found]).reshape(-1, 3, 3)
    value, covariance, distance, limit, odd = _joined(values, covariances, "logs", start=first, prior=prior)
    value[2] = math.remainder(value[2], math.tau)
    unreliable = tuple(place for place, log in enumerate(logs) if not log)
    return JoinedLogs(value, covariance, unreliable, logs=len(found), distance=distance, limit=limit, odd=odd)


def _start(start: ArrayLike, start_sigma: ArrayLike) -> tuple[Matrix, Matrix]:
    """(3,) and (3, 3): where logs were started from, and the information of that."""
    first, sigma = array_from(start, "start"), array_from(start_sigma, "start_sigma")
    if first.shape != (3,) or not np.isfinite(first).all():
        raise InvalidInputError(f"start = {first.tolist()}, expected finite numbers (x_m, y_m, yaw_rad)")
    covariance = np.diag(np.square(sigma)) if sigma.shape == (3,) and (sigma > 0.0).all() else sigma
    fits = covariance.shape == (3, 3) and np.isfinite(covariance).all() and np.allclose(covariance, covariance.T)
    if not fits or np.linalg.eigvalsh(covariance)[0] <= 0.0:
        raise InvalidInputError(
            f"start_sigma = {sigma.tolist()}, expected three positive standard deviations of (x_m, y_m, yaw_rad), or "
            "their covariance (3, 3)"
        )
    return first, _inverse(covariance)


def _nearest(angle: float, other: float) -> float:
    """That angle within half a turn of another one."""
    return other + math.remainder(angle - other, math.tau)


def join_tilts(tilts: Sequence[MountingTilt]) -> JoinedTilts:
    """Roll and pitch of one mounting from several drives, each weighed by its information; all from one given mounting.

    What no turn averages out (`MountingTilt.shared_rad2`) is taken to be the same in all drives. Raises
    `InvalidInputError` for no drive, and for one that does not tell.
    """
    tilts = each_from(tilts, "tilts", "shared_rad2", "MountingTilt")
    for number, tilt in enumerate(tilts):
        if not tilt:
            raise InvalidInputError(f"tilts[{number}]: {tilt.reason}")
    shared = np.array([tilt.shared_rad2 for tilt in tilts]).reshape(-1, 2, 2)
    covariances = np.array([tilt.covariance_rad2 for tilt in tilts]).reshape(-1, 2, 2)
    # Turns about the robot's axes from the first one's mounting to each.
    turns = [tilt.robot_from_camera @ tilts[0].robot_from_camera.T for tilt in tilts]
    values = np.array([[turn[2, 1], -turn[2, 0]] for turn in turns]).reshape(-1, 2)
    own = covariances - (1.0 - _TRACE) * shared
    value, covariance, distance, limit, odd = _joined(values, own, "tilts", looked_at=covariances)
    about_x, about_y = value
    rotation = _small_turn(about_x, about_y) @ tilts[0].robot_from_camera
    covariance = covariance + shared.mean(axis=0)
    return JoinedTilts(rotation, covariance, logs=len(tilts), distance=distance, limit=limit, odd=odd)


def _joined(
    values: Matrix,
    covariances: Matrix,
    what: str,
    *,
    start: Matrix | None = None,
    prior: Matrix | None = None,
    looked_at: Matrix | None = None,
) -> tuple[Matrix, Matrix, float, float, int | None]:
    """Values (N, D) weighed by their information; their distances by the covariances `looked_at`; the odd one out."""
    if not len(values):
        raise InvalidInputError(f"{what}: none, expected one or more")
    for number, covariance in enumerate(covariances):
        if not np.isfinite(covariance).all() or np.linalg.eigvalsh(covariance)[0] <= 0.0:
            raise InvalidInputError(f"{what}[{number}]: a covariance of {covariance.tolist()}, expected a finite one")
    value, covariance = _weighed(values, _inverse(covariances), start, prior)
    weights = _inverse(covariances if looked_at is None else looked_at)
    distance, limit = _spread(values, weights)
    odd = None
    if distance > limit and len(values) > 2:
        others = [[k for k in range(len(values)) if k != out] for out in range(len(values))]
        spreads = [_spread(values[rest], weights[rest]) for rest in others]
        agreeing = [out for out, (far, most) in enumerate(spreads) if far <= most]
        odd = agreeing[0] if len(agreeing) == 1 else None
    return value, covariance, distance, limit, odd


def _inverse(matrices: Matrix) -> Matrix:
    return np.asarray(np.linalg.inv(matrices), dtype=np.float64)


def _weighed(
    values: Matrix, informations: Matrix, start: Matrix | None = None, prior: Matrix | None = None
) -> tuple[Matrix, Matrix]:
    total, moment = informations.sum(axis=0), np.einsum("nij,nj->i", informations, values)
    if start is not None and prior is not None:
        again = (len(values) - 1) * prior
        total, moment = total - again, moment - again @ start
        if np.linalg.eigvalsh(total)[0] <= 0.0:
            raise InvalidInputError("logs: no more is known than at the start, expected drives that tell the mounting")
    covariance = np.linalg.inv(total)
    return covariance @ moment, 0.5 * (covariance + covariance.T)


def _spread(values: Matrix, weights: Matrix) -> tuple[float, float]:
    """Sum of squared distances from the weighed mean, and its limit."""
    if len(values) < 2:
        return 0.0, math.inf
    off = values - _weighed(values, weights)[0]
    degrees = values.shape[1] * (len(values) - 1)
    # The band is of two sides.
    _, limit = consistency_band(1.0 - 2.0 * _FALSE_ALARM, degrees, 1)
    return float(np.einsum("ni,nij,nj->", off, weights, off)), limit


def _small_turn(about_x: float, about_y: float) -> Matrix:
    """(3, 3): the turn by the rotation vector (about_x, about_y, 0), by Rodrigues' formula."""
    angle = math.hypot(about_x, about_y)
    cross = np.array([[0.0, 0.0, about_y], [0.0, 0.0, -about_x], [-about_y, about_x, 0.0]])
    # sin(a) / a and (1 - cos(a)) / a^2, without a difference of equals.
    turned: Matrix = (
        np.eye(3) + np.sinc(angle / math.pi) * cross + 0.5 * np.sinc(0.5 * angle / math.pi) ** 2 * cross @ cross
    )
    return turned
