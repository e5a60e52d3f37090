"""Recordings written for tests: bags of ROS 1 and 2 and MCAP by rosbags, videos by PyAV."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tiltvp.streams import Motion, Wheels
from tiltvp.streams.odometry_tables import OdometryTable

KINDS = ("ros1", "sqlite3", "mcap")
START_S = 1_700_000_000.0
"""When the recordings begin: an hour of the real world, where floats of seconds have few digits left."""


class Bag:
    """Makes messages of one version of ROS, and writes them."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.store = get_typestore(Stores.ROS1_NOETIC if kind == "ros1" else Stores.ROS2_JAZZY)
        if kind == "ros1":
            self.store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/TFMessage"))
        self.rows: list[tuple[str, str, float, Any]] = []

    def make(self, name: str, *values: Any) -> Any:
        """A message by its fields in their order."""
        return self.store.types[name.replace("/", "/msg/", 1)](*values)

    def header(self, time_s: float, frame: str = "camera") -> Any:
        ns = round(time_s * 1e9)
        stamp = self.make("builtin_interfaces/Time", ns // 10**9, ns % 10**9)
        return self.make("std_msgs/Header", *((0,) if self.kind == "ros1" else ()), stamp, frame)

    def add(self, topic: str, name: str, written_s: float, *values: Any) -> None:
        """A message that is written down at that time."""
        self.rows.append((topic, name.replace("/", "/msg/", 1), written_s, self.make(name, *values)))

    def image(self, topic: str, time_s: float, pixels: np.ndarray, encoding: str, *, late_s: float = 0.0) -> None:
        big = int(pixels.dtype.byteorder == ">")
        data = np.frombuffer(pixels.tobytes(), np.uint8)
        height, width = pixels.shape[:2]
        self.add(
            topic, "sensor_msgs/Image", time_s + late_s, self.header(time_s), height, width, encoding, big,
            data.size // height, data,
        )  # fmt: skip

    def compressed(self, topic: str, time_s: float, content: bytes) -> None:
        data = np.frombuffer(content, np.uint8)
        self.add(topic, "sensor_msgs/CompressedImage", time_s, self.header(time_s), "jpeg", data)

    def odometry(self, time_s: float, x_m: float, y_m: float, yaw_rad: float, topic: str = "/odom") -> None:
        turn = self.make("geometry_msgs/Quaternion", 0.0, 0.0, np.sin(yaw_rad / 2), np.cos(yaw_rad / 2))
        pose = self.make("geometry_msgs/Pose", self.make("geometry_msgs/Point", x_m, y_m, 0.0), turn)
        zero = self.vector(0.0, 0.0, 0.0)
        self.add(
            topic, "nav_msgs/Odometry", time_s, self.header(time_s, "odom"), "base_link",
            self.make("geometry_msgs/PoseWithCovariance", pose, np.zeros(36)),
            self.make("geometry_msgs/TwistWithCovariance", self.make("geometry_msgs/Twist", zero, zero), np.zeros(36)),
        )  # fmt: skip

    def joints(self, time_s: float, names: list[str], angles: Sequence[float], topic: str = "/joint_states") -> None:
        none = np.zeros(0)
        self.add(topic, "sensor_msgs/JointState", time_s, self.header(time_s), names, np.array(angles), none, none)

    def vector(self, x: float, y: float, z: float) -> Any:
        return self.make("geometry_msgs/Vector3", x, y, z)

    def twist(self, time_s: float, speed: float, rate: float, topic: str = "/cmd_vel") -> None:
        self.add(topic, "geometry_msgs/Twist", time_s, self.vector(speed, 0.0, 0.0), self.vector(0.0, 0.0, rate))

    def imu(
        self,
        time_s: float,
        rates: Sequence[float],
        accelerations: Sequence[float],
        topic: str = "/imu",
        *,
        told: float = -1.0,
    ) -> None:
        turn = self.make("geometry_msgs/Quaternion", 0.0, 0.0, 0.0, 1.0)
        unknown = np.full(9, told)
        self.add(
            topic, "sensor_msgs/Imu", time_s, self.header(time_s, "imu"), turn, unknown,
            self.vector(*rates), np.zeros(9), self.vector(*accelerations), np.zeros(9),
        )  # fmt: skip

    def camera_info(
        self, time_s: float, width: int, height: int, model: str, d: Sequence[float], k: Sequence[float],
        binning: tuple[int, int] = (0, 0), part: tuple[int, int, int, int] = (0, 0, 0, 0),
        p: Sequence[float] = (0.0,) * 12, r: Sequence[float] = (1, 0, 0, 0, 1, 0, 0, 0, 1),
    ) -> None:  # fmt: skip
        """`part` is x_offset, y_offset, height and width, in the message's order."""
        region = self.make("sensor_msgs/RegionOfInterest", *part, False)
        self.add(
            "/camera_info", "sensor_msgs/CameraInfo", time_s, self.header(time_s), height, width, model,
            np.array(d), np.array(k), np.array(r, dtype=float), np.array(p), *binning, region,
        )  # fmt: skip

    def static(self, parent: str, child: str, xyzw: Sequence[float], topic: str = "/tf_static") -> None:
        transform = self.make(
            "geometry_msgs/Transform", self.vector(0.1, 0.2, 0.3), self.make("geometry_msgs/Quaternion", *xyzw)
        )
        stamped = self.make("geometry_msgs/TransformStamped", self.header(START_S, parent), child, transform)
        self.add(topic, "tf2_msgs/TFMessage", START_S, [stamped])

    def write(self, folder: Path) -> Path:
        """The path of the bag: a file for ROS 1, a folder for ROS 2."""
        path = folder / ("drive.bag" if self.kind == "ros1" else f"drive_{self.kind}")
        ordered = sorted(self.rows, key=lambda row: row[2])
        if self.kind == "ros1":
            with Writer1(path) as writer:
                self._put(writer, ordered, self.store.serialize_ros1)
        else:
            plugin = StoragePlugin.MCAP if self.kind == "mcap" else StoragePlugin.SQLITE3
            with Writer2(path, version=9, storage_plugin=plugin) as writer:
                self._put(writer, ordered, self.store.serialize_cdr)
        return path

    def _put(self, writer: Any, rows: Iterable[tuple[str, str, float, Any]], serialize: Any) -> None:
        connections: dict[str, Any] = {}
        for topic, name, time_s, message in rows:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=self.store)
            writer.write(connections[topic], round(time_s * 1e9), serialize(message, name))


def write_video(
    path: Path,
    images: Iterable[np.ndarray],
    times_ms: Sequence[int],
    *,
    codec: str = "mpeg4",
    options: dict[str, str] | None = None,
) -> None:
    """A video whose frames have their own times, (H, W, 3) uint8 BGR each; with options of the codec."""
    base = Fraction(1, 1000)
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=30, options=options or {})
        stream.time_base = stream.codec_context.time_base = base
        for number, (image, time_ms) in enumerate(zip(images, times_ms, strict=True)):
            frame = av.VideoFrame.from_ndarray(image, format="bgr24")
            if number == 0:
                stream.height, stream.width = image.shape[:2]
                stream.pix_fmt = "yuv420p"
            frame.pts, frame.time_base = time_ms, base
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def motions_of(path: Path, files: Sequence[Path]) -> list[Motion]:
    """The motion that led to each image, by a table with a row for each."""
    return OdometryTable.read(path).motions([str(file) for file in files], Wheels())[0]
