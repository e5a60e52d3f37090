"""ROS 2 messages of what the package knows: images, cameras, wheels, attitudes and poses. Frames follow REP 103."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp.errors import InvalidInputError
from tiltvp.rotations import quaternion
from tiltvp.streams.outputs.mcap import Message

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera

__all__ = [
    "camera_info",
    "compressed_image",
    "image",
    "imu",
    "joint_states",
    "nanoseconds",
    "pose",
    "text",
    "transform",
    "transforms",
    "vector",
]

_NONE: Final = (-1.0, *(0.0,) * 8)
"""REP 145: the covariance of a quantity that a message does not carry."""


def nanoseconds(time_s: float) -> int:
    """The time in whole nanoseconds, as messages carry it."""
    return round(time_s * 1e9)


def header(time_ns: int, frame: str) -> dict[str, Any]:
    """When and in which frame."""
    second, rest = divmod(time_ns, 10**9)
    return {"stamp": {"sec": second, "nanosec": rest}, "frame_id": frame}


def image(time_ns: int, frame: str, gray: NDArray[np.uint8]) -> Message:
    """sensor_msgs/Image, mono8, of (H, W) grey levels."""
    height, width = gray.shape
    fields = {"header": header(time_ns, frame), "height": height, "width": width, "encoding": "mono8", "step": width}
    return Message("sensor_msgs/msg/Image", fields | {"data": gray})


def compressed_image(time_ns: int, frame: str, gray: NDArray[np.uint8]) -> Message:
    """sensor_msgs/CompressedImage, PNG, of (H, W) grey levels."""
    import cv2

    fields = {"header": header(time_ns, frame), "format": "mono8; png compressed mono8"}
    return Message("sensor_msgs/msg/CompressedImage", fields | {"data": cv2.imencode(".png", gray)[1]})


def camera_info(time_ns: int, frame: str, camera: Camera) -> Message:
    """sensor_msgs/CameraInfo of a pinhole camera or of a fisheye of OpenCV's model (equidistant, Kannala-Brandt).

    Raises `InvalidInputError` for other lenses: no distortion model of ROS fits.
    """
    given = camera.parameters
    focal = given.get("focal_px")
    names: tuple[str, ...]
    match camera.model:
        case "pinhole":
            model, names = "plumb_bob", ("k1", "k2", "p1", "p2", "k3")
            if any(given.get(name) for name in ("k4", "k5", "k6")):
                model, names = "rational_polynomial", (*names, "k4", "k5", "k6")
        case "equidistant" | "kannala_brandt":
            model, names = "equidistant", ("k1", "k2", "k3", "k4")
        case other:
            raise InvalidInputError(f"camera: {other}, expected pinhole, equidistant or kannala_brandt")
    fx, fy = (focal, focal) if focal is not None else (given["fx"], given["fy"])
    k = np.array([[fx, 0.0, given["cx"]], [0.0, fy, given["cy"]], [0.0, 0.0, 1.0]])
    fields = {
        "header": header(time_ns, frame), "height": camera.height, "width": camera.width, "distortion_model": model,
        "d": [given.get(name, 0.0) for name in names], "k": k, "r": np.eye(3), "p": np.pad(k, ((0, 0), (0, 1))),
    }  # fmt: skip
    return Message("sensor_msgs/msg/CameraInfo", fields)


def imu(
    time_ns: int,
    frame: str,
    *,
    orientation: tuple[ArrayLike, ArrayLike] | None = None,
    rate: tuple[ArrayLike, ArrayLike] | None = None,
    force: tuple[ArrayLike, ArrayLike] | None = None,
) -> Message:
    """sensor_msgs/Imu as REP 145 wants it, each part with its covariance (3, 3); what is None is marked as not there.

    `orientation` is the rotation (3, 3) from `frame` to the world, `rate` (3,) in rad/s, `force` (3,) in m/s^2.
    """
    turn, turn_covariance = (np.eye(3), _NONE) if orientation is None else orientation
    fields = {
        "header": header(time_ns, frame),
        "orientation": _quaternion(turn),
        "orientation_covariance": turn_covariance,
    }
    for name, part in (("angular_velocity", rate), ("linear_acceleration", force)):
        value, covariance = (np.zeros(3), _NONE) if part is None else part
        fields |= {name: _xyz(value), f"{name}_covariance": covariance}
    return Message("sensor_msgs/msg/Imu", fields)


def joint_states(time_ns: int, positions_rad: Mapping[str, float]) -> Message:
    """sensor_msgs/JointState: how far each wheel has turned, radians."""
    names, turned = list(positions_rad), list(positions_rad.values())
    return Message("sensor_msgs/msg/JointState", {"header": header(time_ns, ""), "name": names, "position": turned})


def pose(time_ns: int, frame: str, position_m: ArrayLike, rotation: ArrayLike) -> Message:
    """geometry_msgs/PoseStamped: position (3,) and rotation (3, 3) to `frame`."""
    where = {"position": _xyz(position_m), "orientation": _quaternion(rotation)}
    return Message("geometry_msgs/msg/PoseStamped", {"header": header(time_ns, frame), "pose": where})


def vector(time_ns: int, frame: str, value: ArrayLike) -> Message:
    """geometry_msgs/Vector3Stamped."""
    return Message("geometry_msgs/msg/Vector3Stamped", {"header": header(time_ns, frame), "vector": _xyz(value)})


def transform(time_ns: int, parent: str, child: str, translation_m: ArrayLike, rotation: ArrayLike) -> Message:
    """geometry_msgs/TransformStamped: where `child` is in `parent`, position (3,) and rotation (3, 3)."""
    move = {"translation": _xyz(translation_m), "rotation": _quaternion(rotation)}
    fields = {"header": header(time_ns, parent), "child_frame_id": child, "transform": move}
    return Message("geometry_msgs/msg/TransformStamped", fields)


def transforms(of: Sequence[Message]) -> Message:
    """tf2_msgs/TFMessage of several `transform`."""
    return Message("tf2_msgs/msg/TFMessage", {"transforms": [one.fields for one in of]})


def text(content: str) -> Message:
    """std_msgs/String."""
    return Message("std_msgs/msg/String", {"data": content})


def _xyz(value: ArrayLike) -> dict[str, float]:
    x, y, z = np.asarray(value, dtype=np.float64).tolist()
    return {"x": x, "y": y, "z": z}


def _quaternion(rotation: ArrayLike) -> dict[str, float]:
    return dict(zip("xyzw", quaternion(np.asarray(rotation, dtype=np.float64)).tolist(), strict=True))
