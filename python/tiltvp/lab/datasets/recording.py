"""Drives as recordings of a robot: frames, wheel ticks and inertial data in an MCAP file, and the truth beside them."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from threading import Event
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import tomli_w

from tiltvp._core import leaning_from_upright, read_imu
from tiltvp.cameras import Camera
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.motion import RobotMotion
from tiltvp.lab.datasets.new import in_order
from tiltvp.rotations import about_vertical
from tiltvp.streams.outputs import messages
from tiltvp.streams.outputs.mcap import Message, NewRecording, check_recording, new_recording
from tiltvp.synth import Drive, Room

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Rows = NDArray[np.float64]

__all__ = ["LEGS", "MOUNT", "Mount", "RecordedDrive"]

_TURN: Final = math.radians(120.0)
LEGS: Final[tuple[tuple[float, float], ...]] = (
    (0.0, 2.0 * math.pi), (1.0, 0.0), (0.0, _TURN), (0.8, 0.5), (0.0, _TURN), (0.9, 0.0),
)  # fmt: skip
"""A turn in place, which tells the mounting's lean from the floor's, and most of a triangle: room for it is in each
kind of room."""

FRAME_HZ: Final = 5.0
ODOMETRY_HZ: Final = 50.0
IMU_HZ: Final = 100.0
START_S: Final = 1_700_000_000
"""Of the first stamp: a date, as in the recordings of robots."""

WHEEL_RADIUS_M: Final = 0.05
TICKS_PER_TURN: Final = 2048
"""Of an encoder, a power of two as usual: a tick is 0.15 mm of way."""
_LEAN_MAX: Final = 0.5
"""Of mounting, floor and bumps, radians, as in `Drive`."""
LEFT, RIGHT = "left_wheel_joint", "right_wheel_joint"
BASE, CAMERA, IMU, WORLD = "base_link", "camera_optical", "imu_link", "world"


class Mount(NamedTuple):
    """Where a camera is on the robot, its height above the floor included; metres, and radians to the left."""

    x_m: float = 0.10
    y_m: float = 0.03
    yaw_rad: float = 0.0
    height_m: float = 0.4


MOUNT: Final = Mount()


@dataclass(frozen=True, eq=False)
class RecordedDrive:
    """A robot's drive through a room as its sensors tell of it: `write` makes the recording. The same arguments, the
    same bytes.

    The camera sits at `mount`, nominally turned by `robot_from_camera` and the mount's yaw, in truth moreover by
    `mounting_rad` (roll, pitch) about the robot's axes. The floor falls by `floor_slope_rad` towards a direction to the
    left of the robot's first heading. Stamps of frames are later than the frames by `camera_delay_s`. Raises
    `InvalidInputError` for what cannot be, as for legs for which the room has no space.
    """

    room: Room
    camera: Camera
    legs: ArrayLike = LEGS
    robot_from_camera: ArrayLike | None = None
    mount: Mount = MOUNT
    mounting_rad: tuple[float, float] = (0.0, 0.0)
    floor_slope_rad: tuple[float, float] = (0.0, 0.0)
    bumps_max_rad: float = math.radians(2.0)
    camera_delay_s: float = 0.0
    compressed: bool = False
    noise_sigma: float | None = None
    samples: int | None = None
    encoder_k_m: float | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        """Checks what the drive itself does not."""
        roll, pitch = self.mounting_rad
        for name, value, least, most in (
            ("mounting_rad", roll, -_LEAN_MAX, _LEAN_MAX),
            ("mounting_rad", pitch, -_LEAN_MAX, _LEAN_MAX),
            ("floor_slope_rad", self.floor_slope_rad[0], 0.0, _LEAN_MAX),
            ("bumps_max_rad", self.bumps_max_rad, 0.0, _LEAN_MAX),
            ("camera_delay_s", self.camera_delay_s, 0.0, 1.0),
        ):
            if not least <= value <= most:
                raise InvalidInputError(f"{name}: {value:g}, expected a number in [{least:g}, {most:g}]")
        if not math.isfinite(self.floor_slope_rad[1]):
            raise InvalidInputError(f"floor_slope_rad: {self.floor_slope_rad[1]:g}, expected a finite direction")

    @cached_property
    def nominal(self) -> Rows:
        """(3, 3) `robot_from_camera` as the robot's makers mean it, the mount's yaw included."""
        given = np.eye(3) if self.robot_from_camera is None else np.asarray(self.robot_from_camera, dtype=np.float64)
        return about_vertical(self.mount.yaw_rad) @ given

    @cached_property
    def robot_from_mounted_camera(self) -> Rows:
        """(3, 3): the same as it is."""
        return _roll_pitch(*self.mounting_rad) @ self.nominal

    @cached_property
    def drive(self) -> Drive:
        """What renders; its place is free for all the legs."""
        x, y, _, height = self.mount
        return Drive(
            self.room, camera=self.camera, legs=self.legs, mount=(x, y, 0.0, height),
            robot_from_camera=self.robot_from_mounted_camera, lighting=0.0, encoder_k_m=self.encoder_k_m,
            samples=self.samples, noise_sigma=self.noise_sigma, seed=self.seed,
        )  # fmt: skip

    @cached_property
    def motion(self) -> RobotMotion:
        """How the robot moves."""
        return RobotMotion(
            tuple(self.drive.poses[0].tolist()), np.asarray(self.legs, dtype=np.float64), self.drive.wheel_base_m,
            self.bumps_max_rad, self.floor_slope_rad, self.seed,
        )  # fmt: skip

    @cached_property
    def frame_times_s(self) -> Rows:
        """(N,): when the frames are taken, from the first stamp on."""
        return _grid(self.motion.duration_s, FRAME_HZ)

    def __len__(self) -> int:
        return len(self.frame_times_s)

    def write(
        self, out: str | os.PathLike[str], *, threads: int = 1, advance: Callable[[], None] = lambda: None
    ) -> None:
        """The MCAP file, whole or not at all; `advance` is called after each frame.

        Raises `MissingExtraError` without the packages of the extra `bags`, and `OutputError`.
        """
        check_recording(out)
        stop = Event()

        def render(frame: int) -> NDArray[np.uint8]:
            if stop.is_set():
                raise CancelledError
            pose, (alpha, beta) = self._stands[frame]
            return self.drive.render_at(frame, pose=pose, alpha_rad=alpha, beta_rad=beta, threads=1).gray

        events = sorted(self._events(), key=lambda event: event[0])
        with new_recording(out) as recording, in_order(render, range(len(self)), threads, stop) as images:
            self._write_constants(recording)
            for stamp, topic, message in events:
                if message is None:
                    recording.write(topic, stamp, self._picture(stamp, next(images)))
                    advance()
                else:
                    recording.write(topic, stamp, message)

    @cached_property
    def tilts(self) -> Rows:
        """(N, 3): the true ground normals in the robot frame when the frames are taken."""
        return self.motion.world_from_robot(self.frame_times_s)[:, 2, :]

    @cached_property
    def _stands(self) -> list[tuple[Rows, tuple[float, float]]]:
        """Pose and lean of each frame: the attitude as a heading and the smallest turn that leans the robot."""
        attitudes = self.motion.world_from_robot(self.frame_times_s)
        places = self.motion.places(self.frame_times_s)
        stands = []
        for place, attitude, (x, y, z) in zip(places, attitudes, self.tilts, strict=True):
            heading = attitude @ leaning_from_upright((x, y, z))
            pose = np.array([place[0], place[1], math.atan2(heading[1, 0], heading[0, 0])])
            stands.append((pose, (math.atan2(math.hypot(x, y), z), math.atan2(-y, -x))))
        return stands

    def _write_constants(self, recording: NewRecording) -> None:
        """What does not change: the nominal transforms, and the truth that a robot does not know."""
        start = _stamp(0.0)
        x, y, _, height = self.mount
        camera = messages.transform(start, BASE, CAMERA, (x, y, height), self.nominal)
        imu = messages.transform(start, BASE, IMU, (x, y, height), np.eye(3))
        recording.write("/tf_static", start, messages.transforms([camera, imu]), latched=True)
        true = messages.transform(start, BASE, CAMERA, (x, y, height), self.robot_from_mounted_camera)
        recording.write("/truth/mounting", start, true, latched=True)
        recording.write("/truth/description", start, messages.text(tomli_w.dumps(self.description())), latched=True)

    def description(self) -> dict[str, Any]:
        """What is true of the drive, for a TOML file: angles in degrees, and the options that it was made with."""
        roll, pitch = np.degrees(self.mounting_rad).tolist()
        slope, where = np.degrees(self.floor_slope_rad).tolist()
        return {
            "seed": self.seed,
            "room": {"kind": self.room.kind, "seed": self.room.seed},
            "wheels": {
                "base_m": self.drive.wheel_base_m,
                "radius_m": WHEEL_RADIUS_M,
                "ticks_per_turn": TICKS_PER_TURN,
                "encoder_k_m": self.drive.encoder_k_m,
            },
            "camera": self.mount._asdict() | {"roll_deg": roll, "pitch_deg": pitch, "delay_s": self.camera_delay_s},
            "floor": {"slope_deg": slope, "direction_deg": where, "bumps_max_deg": math.degrees(self.bumps_max_rad)},
        }

    def _events(self) -> Iterator[tuple[int, str, Message | None]]:
        """Stamp, topic and message of everything that changes; None for the picture of the next frame."""
        with suppress(InvalidInputError):
            messages.camera_info(0, CAMERA, self.camera)
            for time_s in self.frame_times_s:
                stamp = _stamp(time_s + self.camera_delay_s)
                yield stamp, "/camera/camera_info", messages.camera_info(stamp, CAMERA, self.camera)
        for time_s, normal in zip(self.frame_times_s, self.tilts, strict=True):
            stamp = _stamp(time_s + self.camera_delay_s)
            yield stamp, "/camera/image_raw" + ("/compressed" if self.compressed else ""), None
            yield stamp, "/truth/tilt", messages.vector(stamp, BASE, normal)
        times = _grid(self.motion.duration_s, ODOMETRY_HZ)
        places, attitudes = self.motion.places(times), self.motion.world_from_robot(times)
        for time_s, angles, place, attitude in zip(times, self.wheel_angles(times), places, attitudes, strict=True):
            stamp = _stamp(time_s)
            turned = dict(zip((LEFT, RIGHT), angles.tolist(), strict=True))
            yield stamp, "/joint_states", messages.joint_states(stamp, turned)
            yield stamp, "/truth/pose", messages.pose(stamp, WORLD, (place[0], place[1], 0.0), attitude)
        times = _grid(self.motion.duration_s, IMU_HZ)
        rates, forces = self.motion.inertia(times, self.mount[:2])
        _, rates, forces, _ = read_imu(rates, forces, rate_hz=IMU_HZ, seed=self.seed)
        for time_s, rate, force in zip(times, rates, forces, strict=True):
            stamp = _stamp(time_s)
            reading = messages.imu(stamp, IMU, rate=(rate, np.zeros(9)), force=(force, np.zeros(9)))
            yield stamp, "/imu/data_raw", reading

    def wheel_angles(self, times_s: Rows) -> Rows:
        """(N, 2): how far the left and the right wheel have turned by their encoders' ticks, radians."""
        rolled = np.diff(self.motion.rolled_m(times_s), axis=0, prepend=0.0)
        noise = np.random.default_rng((self.seed, 0xE)).standard_normal(rolled.shape)
        read = rolled + np.sqrt(self.drive.encoder_k_m * np.abs(rolled)) * noise
        tick = 2.0 * math.pi / TICKS_PER_TURN
        return np.asarray(np.round(np.cumsum(read, axis=0) / WHEEL_RADIUS_M / tick) * tick)

    def _picture(self, stamp: int, gray: NDArray[np.uint8]) -> Message:
        make = messages.compressed_image if self.compressed else messages.image
        return make(stamp, CAMERA, gray)


def _roll_pitch(roll_rad: float, pitch_rad: float) -> Rows:
    """(3, 3): Ry(pitch) Rx(roll)."""
    (sr, cr), (sp, cp) = ((math.sin(angle), math.cos(angle)) for angle in (roll_rad, pitch_rad))
    return np.array([[cp, sp * sr, sp * cr], [0.0, cr, -sr], [-sp, cp * sr, cp * cr]])


def _grid(duration_s: float, rate_hz: float) -> Rows:
    return np.arange(math.floor(duration_s * rate_hz) + 1) / rate_hz


def _stamp(time_s: float) -> int:
    return START_S * 10**9 + messages.nanoseconds(time_s)
