"""How far answers are from the truth that a recording of `tiltvp lab drive` carries."""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from tiltvp._core import tilt_error_rad
from tiltvp.errors import InvalidInputError
from tiltvp.rotations import rotation_from_quaternion
from tiltvp.streams import Recording
from tiltvp.streams.odometry import SAME_S
from tiltvp.streams.outputs.tilts import TILT_TOPIC

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.robot import Robot

    Rows = NDArray[np.float64]

__all__ = ["RecordedTruth", "TiltErrors"]


class TiltErrors(NamedTuple):
    """Of the tilts in a file, radians."""

    frames: int
    rms_rad: float
    largest_rad: float


class RecordedTruth(NamedTuple):
    """What is true of a drive, by its recording."""

    robot_from_camera: Rows
    """(3, 3): rotation R of v_robot = R v_camera."""
    place_m: Rows
    """(2,): x and y of the camera in the robot's frame."""
    times_s: Rows
    """(N,): of the frames, by their stamps."""
    normals: Rows
    """(N, 3): ground normals in the robot's frame."""

    @classmethod
    def of(cls, path: str | os.PathLike[str]) -> RecordedTruth:
        """Raises `InvalidInputError` for a recording that carries no truth."""
        recording = Recording(path)
        (_, mounted), *_ = _messages(recording, "/truth/mounting")
        move = mounted.transform
        leans = [(stamp_s, _xyz(one.vector)) for stamp_s, one in _messages(recording, "/truth/tilt")]
        return cls(
            _rotation(move.rotation, path),
            np.array(_xyz(move.translation)[:2]),
            np.array([stamp_s for stamp_s, _ in leans]),
            np.array([normal for _, normal in leans]),
        )

    def mounting_error(self, robot: Robot) -> Rows:
        """(3,): by how much a robot's file is off in roll, pitch and yaw, radians about the robot's axes."""
        off = robot.robot_from_camera @ self.robot_from_camera.T
        # Small angles are all that a mounting that was found is off by.
        return 0.5 * np.array([off[2, 1] - off[1, 2], off[0, 2] - off[2, 0], off[1, 0] - off[0, 1]])

    def tilt_errors(self, path: str | os.PathLike[str]) -> TiltErrors:
        """Of the attitudes that `tiltvp tilt --out FILE.mcap` wrote, frame by frame."""
        normals = {round(stamp_s / SAME_S): normal for stamp_s, normal in zip(self.times_s, self.normals, strict=True)}
        errors = []
        for stamp_s, answer in _messages(Recording(path), TILT_TOPIC):
            near = round(stamp_s / SAME_S)
            true = next((normals[key] for key in (near, near - 1, near + 1) if key in normals), None)
            if true is None:
                raise InvalidInputError(f"{os.fspath(path)}: a tilt at {stamp_s:.6f} s, expected those of the frames")
            found = _rotation(answer.orientation, path)[2]
            errors.append(tilt_error_rad(found, true))
        if not errors:
            raise InvalidInputError(f"{os.fspath(path)}: no tilts on {TILT_TOPIC}, expected at least one")
        return TiltErrors(len(errors), math.sqrt(float(np.mean(np.square(errors)))), max(errors))


def _messages(recording: Recording, name: str) -> list[tuple[float, Any]]:
    topic = next((topic for topic in recording.topics if topic.name == name), None)
    if topic is None:
        raise InvalidInputError(f"{recording.path}: no topic {name}, expected a recording of `tiltvp lab drive`")
    return list(recording.decoded(topic))


def _xyz(vector: Any) -> tuple[float, float, float]:
    return float(vector.x), float(vector.y), float(vector.z)


def _rotation(turn: Any, path: str | os.PathLike[str]) -> Rows:
    return rotation_from_quaternion(np.array([turn.x, turn.y, turn.z, turn.w]), os.fspath(path))
