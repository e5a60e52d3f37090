"""What an inertial sensor tells `tiltvp corner` of each frame."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np
from cyclopts import Group, Parameter

from tiltvp.cli.terminal import complain
from tiltvp.errors import InvalidInputError
from tiltvp.rotations import read_rotation

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp import Robot
    from tiltvp.streams import InertialSamples, Recording

_OTHER_UNIT: Final = 0.1
"""By which share accelerations are off in the median where their unit is another, or the sensor is not calibrated: a
hand that holds a camera adds less."""


@Parameter(name="*", group=Group("Inertial sensor"))
@dataclass(frozen=True, kw_only=True)
class InertialOptions:
    """Readings between and at the frames."""

    imu: Path | None = None
    """Table with time_s, rate_x_radps, rate_y_radps, rate_z_radps and, where there are any, acceleration_x_mps2 and
    so on, or recording of ROS with sensor_msgs/Imu. Times are those of the frames, or from 0 with --frame-rate."""
    imu_topic: str | None = None
    """Its topic in a recording, where that has several."""
    camera_from_imu: str | None = None
    """File with nine numbers, row by row: the rotation that takes vectors of the sensor's axes to the left camera's. By
    default that of a recording's /tf_static; of others the axes are the same."""

    def of_robot(self, robot: Robot | None) -> Self:
        """With the topic that a robot's file names, where the readings are a recording's and the topic is not given."""
        from tiltvp.streams import is_recording

        if robot is None or self.imu is None or not is_recording(self.imu):
            return self
        return replace(self, imu_topic=self.imu_topic or robot.topics.get("inertial"))

    def knowledge(self, topic: str | None) -> Inertial | None:
        """What tells each frame; None without a sensor. `topic` is that of the left images, where it is chosen."""
        from tiltvp.streams import InertialSamples, Recording, inertial_samples, is_recording

        if self.imu is None:
            for name in ("imu_topic", "camera_from_imu"):
                if getattr(self, name) is not None:
                    raise InvalidInputError(f"--{name.replace('_', '-')} without --imu, expected both")
            return None
        turn = np.eye(3) if self.camera_from_imu is None else read_rotation(self.camera_from_imu)
        if is_recording(self.imu):
            recording = Recording(self.imu)
            samples = inertial_samples(recording, self.imu_topic)
            return Inertial(
                samples, _recorded_turn(recording, samples, topic) if self.camera_from_imu is None else turn
            )
        if self.imu_topic is not None:
            raise InvalidInputError(f"--imu-topic {self.imu_topic} of {self.imu}, expected a recording")
        return Inertial(InertialSamples.read(self.imu), turn)


def _recorded_turn(recording: Recording, samples: InertialSamples, topic: str | None) -> NDArray[np.float64]:
    """(3, 3): the rotation from the sensor's axes to the camera's by the static transforms of a recording; a line says
    so, or why the axes are taken to be the same. Without such transforms they are."""
    from tiltvp.streams import robot_from_camera

    topics = [one.name for one in recording.topics]
    if "/tf_static" not in topics:
        return np.eye(3)
    try:
        found = robot_from_camera(recording, robot_frame=samples.frame, topic=topic if topic in topics else None)
    except InvalidInputError as error:
        complain(f"--camera-from-imu: not given, and the axes are taken to be the same: {error}")
        return np.eye(3)
    complain(f"--camera-from-imu: not given, that of {recording.path} /tf_static is taken")
    return found.T


@dataclass
class Inertial:
    """A sensor, and the time of the frame before that was not refused."""

    samples: InertialSamples
    camera_from_sensor: NDArray[np.float64]
    first_s: float | None = None
    """The time of the first frame."""
    before_s: float | None = None
    told: dict[str, int] = field(default_factory=lambda: {"frames": 0, "gravity": 0, "gyro": 0})
    """How many frames there were, and of how many there is something to tell."""

    def known(self, now_s: float) -> dict[str, Any]:
        """The keywords of the estimator for the frame of a time."""
        return self.samples.known(self.before_s, now_s, self.camera_from_sensor)

    def took(self, now_s: float, known: dict[str, Any]) -> None:
        """The estimator has taken this frame: the next one's turn is since it."""
        self.before_s = now_s
        self.first_s = now_s if self.first_s is None else self.first_s
        self.told["frames"] += 1
        for name, value in known.items():
            self.told[name] += value is not None

    def summary(self) -> str:
        """In how many frames it told something, what of it is missing, and where its times are if in no frame."""
        from tiltvp.streams.inertial import GRAVITY_M_S2

        told, times_s = self.told, self.samples.times_s
        text = f"{self.samples.source}: turns of {told['gyro']}, down of {told['gravity']} of {told['frames']} frames"
        text = "; ".join([text, *filter(None, (self.samples.gaps, *self.samples.notes))])
        forces = self.samples.accelerations_m_s2
        length = GRAVITY_M_S2 if forces is None else float(np.median(np.linalg.norm(forces, axis=1)))
        if abs(length / GRAVITY_M_S2 - 1.0) > _OTHER_UNIT:
            text += f"; its accelerations have {length:.3g} m/s^2 in the median, expected {GRAVITY_M_S2:g} at rest"
        if told["gyro"] or told["gravity"] or self.first_s is None:
            return text
        spans = (times_s[0], times_s[-1], self.first_s, self.before_s)
        return "{}; its times are {:.3f} to {:.3f} s, those of the frames {:.3f} to {:.3f} s".format(text, *spans)
