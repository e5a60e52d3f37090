"""Tilts as attitudes: messages of inertial sensors in an MCAP file, or the format of TUM."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, Protocol, runtime_checkable

import numpy as np

from tiltvp._core import leaning_from_upright
from tiltvp.arguments import array_from, each_from, path_from, refuse_unless, shaped_from
from tiltvp.errors import InvalidInputError
from tiltvp.files import check_output
from tiltvp.rotations import quaternion
from tiltvp.streams.outputs import messages
from tiltvp.streams.outputs.mcap import check_recording, new_recording
from tiltvp.streams.outputs.tum import write_tum

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Matrix = NDArray[np.float64]

__all__ = ["TILT_ENDINGS", "TILT_TOPIC", "YAW_VARIANCE_RAD2", "attitude", "check_tilts", "check_times", "write_tilts"]

TILT_ENDINGS: Final = (".mcap", ".tum")
"""Of the files that `write_tilts` writes."""
TILT_TOPIC: Final = "/tiltvp/imu"
YAW_VARIANCE_RAD2: Final = 1e6
"""Of the yaw, which a tilt does not tell. ROS has no word for an unknown part of an attitude; with a finite number a
covariance can be inverted, and the yaw then weighs nothing."""
_LAST_S: Final = 2.0**31
"""Seconds in a stamp of ROS 2, a signed number of 32 bits."""


@runtime_checkable
class Tilt(Protocol):
    """An estimate of one image or of a filter; false where there is none."""

    @property
    def roll_rad(self) -> float:
        """About x, right side down positive."""

    @property
    def pitch_rad(self) -> float:
        """About y, nose down positive."""

    @property
    def normal(self) -> Matrix:
        """(3,): the ground normal in the robot frame."""

    @property
    def covariance_rad2(self) -> Matrix:
        """(2, 2): of the normal in its tangent plane."""


def attitude(tilt: Tilt) -> tuple[Matrix, Matrix]:
    """`world_from_robot` (3, 3), Ry(pitch) Rx(roll) with yaw 0, and the covariance (3, 3) of its error in radians^2.

    The error is a rotation vector in the world's axes, which are level: x is where the robot heads, z up. About x and y
    it is that of the tilt, about z `YAW_VARIANCE_RAD2`. Raises `InvalidInputError` for an estimate without a tilt.
    """
    refuse_unless(tilt, Tilt, "tilt", "an estimate of a tilt")
    if not tilt:
        raise InvalidInputError("tilt: an estimate without a tilt, expected one with a tilt")
    world_from_robot = _about_y(tilt.pitch_rad) @ _about_x(tilt.roll_rad)
    # An error d of the normal in its tangent plane is the turn T (d_y, -d_x, 0) of the robot, T = leaning_from_upright;
    # T takes the vertical to the normal and the attitude takes that back, so that the turn is level in the world.
    turn = world_from_robot @ leaning_from_upright(tilt.normal) @ [[0.0, 1.0], [-1.0, 0.0], [0.0, 0.0]]
    covariance = turn @ tilt.covariance_rad2 @ turn.T
    covariance[2, :] = covariance[:, 2] = 0.0
    covariance[2, 2] = YAW_VARIANCE_RAD2
    return world_from_robot, covariance


def check_tilts(path: str | os.PathLike[str]) -> None:
    """Refuses what `write_tilts` cannot write, before any work is done. Raises as it does."""
    match path_from(path).suffix.lower():
        case ".mcap":
            check_recording(path)
        case ".tum":
            check_output(path)
        case other:
            raise InvalidInputError(f"{path}: ends in {other!r}, expected {' or '.join(TILT_ENDINGS)}")


def check_times(times_s: ArrayLike) -> None:
    """Refuses times (N,), seconds, that no stamp can be. Raises `InvalidInputError`."""
    times = shaped_from(times_s, "times_s", None)
    bad = np.flatnonzero(~((times >= 0.0) & (times < _LAST_S)))
    if len(bad):
        raise InvalidInputError(f"times_s[{bad[0]}] = {times[bad[0]]}, expected seconds from 0 to 2^31")


def write_tilts(
    path: str | os.PathLike[str],
    times_s: ArrayLike,
    tilts: Sequence[Tilt | None],
    *,
    frame: str = "base_link",
    topic: str = TILT_TOPIC,
) -> int:
    """Writes the tilts of images taken at `times_s` (N,), whole or not at all, and gives how many there are.

    An MCAP file (.mcap) has a sensor_msgs/Imu for each on `topic`: the attitude of `frame` and its covariance as
    `attitude` says, and neither rates nor accelerations. A file of TUM (.tum) has orientations alone: the position is
    0. None and estimates without a tilt are left out. Stamps are exact to a quarter of a microsecond. Raises
    `InvalidInputError` for times that no stamp can be, `MissingExtraError` without the packages of the extra `bags`,
    `OutputError` where the file cannot be written.
    """
    check_tilts(path)
    refuse_unless(frame, str, "frame", "the name of a frame")
    refuse_unless(topic, str, "topic", "the name of a topic")
    tilts = each_from(tilts, "tilts", "normal", "tilt or None", or_none=True)
    times = array_from(times_s, "times_s")
    if times.shape != (len(tilts),):
        raise InvalidInputError(f"times_s: shape {times.shape}, expected ({len(tilts)},), one for each tilt")
    check_times(times)
    known = [(float(time_s), *attitude(tilt)) for time_s, tilt in zip(times, tilts, strict=True) if tilt]
    if path_from(path).suffix.lower() == ".tum":
        quaternions = np.array([quaternion(rotation) for _, rotation, _ in known]).reshape(-1, 4)
        about = f"of world_from_{frame}: orientation alone, with yaw 0; x, y and z are not known"
        write_tum(path, [time_s for time_s, _, _ in known], np.zeros((len(known), 3)), quaternions, about)
        return len(known)
    with new_recording(path) as recording:
        for time_s, rotation, covariance in known:
            stamp = messages.nanoseconds(time_s)
            recording.write(topic, stamp, messages.imu(stamp, frame, orientation=(rotation, covariance)))
    return len(known)


def _about_x(angle_rad: float) -> Matrix:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _about_y(angle_rad: float) -> Matrix:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
