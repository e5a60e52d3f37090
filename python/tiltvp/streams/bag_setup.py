"""What a recording says of its camera: the calibration of CameraInfo, and the mounting of the static transforms."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tiltvp.arguments import refuse_unless
from tiltvp.cameras import Camera
from tiltvp.errors import CalibrationError, InvalidInputError
from tiltvp.formats.document import Document
from tiltvp.formats.ros import parse
from tiltvp.rotations import rotation_from_document, rotation_from_quaternion
from tiltvp.streams.bag_images import CAMERA_KINDS, IMAGE_KINDS, is_rectified
from tiltvp.streams.bags import Recording, Topic
from tiltvp.streams.outputs.transforms import TRANSFORM_TOPIC

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["CAMERA_KINDS", "camera_from_message", "recorded_camera", "robot_from_camera"]

_TRANSFORMS, _STATIC = "tf2_msgs/TFMessage", "/tf_static"
_ALIKE = 1e-6
"""Radians by which transforms that were sent twice may differ: quaternions of floats of 32 bits do."""


def recorded_camera(recording: Recording, topic: str | None = None, *, images: str | None = None) -> Camera:
    """The camera of a topic of CameraInfo, or of the only one: of its first message.

    `images` is the topic of its images, by default the only one: where they are called rectified (`image_rect`) their
    lens is the pinhole of P, else that of K and D.

    Raises `InvalidInputError` that lists the topics, and where the only one is of the frame of other images;
    `CalibrationError` for a lens that is not supported and for a camera that was not calibrated.
    """
    refuse_unless(recording, Recording, "recording", "a tiltvp.streams.Recording")
    chosen = recording.choose(CAMERA_KINDS, "--camera-name", topic)
    seen = [one for one in recording.topics if one.kind in IMAGE_KINDS and one.count > 0]
    if images is None:
        images = seen[0].name if len(seen) == 1 else ""
    info = _first(recording, chosen)
    if topic is None:
        _refuse_of_others(recording, chosen, str(info.header.frame_id), seen, images)
    return camera_from_message(info, rectified=is_rectified(images), source=f"{recording.path} {chosen.name}")


def _refuse_of_others(recording: Recording, info: Topic, frame: str, seen: Sequence[Topic], images: str) -> None:
    """Refuses the CameraInfo of a frame that is that of other images than those that were chosen."""
    frames = dict[str, str]()
    for one in seen:
        with suppress(InvalidInputError):  # Of a damaged message, which reading it tells.
            frames[one.name] = _plain(_first(recording, one).header.frame_id)
    own = [name for name, of_images in frames.items() if of_images == _plain(frame)]
    if own and frames.get(images) not in (None, "", _plain(frame)):
        raise InvalidInputError(
            f"{recording.path}: {info.name} is of the frame of {', '.join(own)}, not of that of {images}, expected its "
            f"own calibration, or --camera-name {info.name} where that is it"
        )


def _first(recording: Recording, topic: Topic) -> Any:
    return next(content for _, content in recording.decoded(topic))


def camera_from_message(message: Any, *, rectified: bool = False, source: str = "CameraInfo") -> Camera:
    """The camera of a sensor_msgs/CameraInfo, of a recording, of rclpy or of rospy.

    Its lens is that of K and D, of `rectified` images (`image_rect`) the pinhole of P. `source` begins what errors say.

    Raises `InvalidInputError` for what is no such message, `CalibrationError` for a lens that is not supported and for
    a camera that was not calibrated.
    """
    if not all(hasattr(message, name) for name in ("width", "height", "distortion_model", "roi", "binning_x")):
        raise InvalidInputError(f"{source}: a {type(message).__name__}, expected a message of {CAMERA_KINDS[0]}")
    model, coefficients = str(message.distortion_model), _numbers(message, "D")
    matrix = _numbers(message, "K")
    if rectified:
        model, coefficients = "none", []
        matrix = np.reshape(_numbers(message, "P"), (3, 4))[:, :3].ravel().tolist()
    if not any(matrix):
        raise CalibrationError(f"{source}: a camera that was not calibrated, expected a matrix that is not 0")
    tree: dict[str, object] = {
        "image_width": int(message.width), "image_height": int(message.height), "camera_name": "cam0",
        "distortion_model": model, "K": [matrix[k : k + 3] for k in (0, 3, 6)], "D": coefficients,
    }  # fmt: skip
    return _as_taken(Camera.from_spec(parse(Document(Path(source), json.dumps(tree)), None)[0]), message, source)


def _numbers(info: Any, name: str) -> list[float]:
    """Those of a field of CameraInfo, which ROS 1 writes with a capital."""
    return [float(x) for x in np.ravel(getattr(info, name.lower(), getattr(info, name, [])))]


def _as_taken(camera: Camera, info: Any, source: str) -> Camera:
    """The camera of the images: of the region of the sensor that is read out, and binned."""
    region = info.roi
    width, height = int(region.width) or camera.width, int(region.height) or camera.height
    corner = (int(region.x_offset), int(region.y_offset))
    if (*corner, width, height) != (0, 0, camera.width, camera.height):
        camera = camera.cropped(*corner, width, height)
    binned = (max(1, int(info.binning_x)), max(1, int(info.binning_y)))
    if binned == (1, 1):
        return camera
    if binned[0] != binned[1]:
        raise CalibrationError(
            f"{source}: binned {binned[0]} x {binned[1]}, expected as many pixels in both directions"
        )
    # Pixels that do not fill a bin are left out.
    whole = camera.cropped(0, 0, width // binned[0] * binned[0], height // binned[1] * binned[1])
    return whole.scaled(1.0 / binned[0])


def robot_from_camera(
    recording: Recording,
    *,
    robot_frame: str = "base_link",
    camera_frame: str | None = None,
    topic: str | None = None,
) -> NDArray[np.float64]:
    """The (3, 3) rotation R in v_robot = R v_camera by the static transforms of a recording.

    `camera_frame` is the optical frame, z ahead and x right; by default that of the headers of images, of `topic` or of
    the only one; of a file without images that `StaticTransform.write` has written it is that of the transform. Raises
    `InvalidInputError` that names the frames there are, where they do not join the two, and where two transforms of one
    frame between them contradict each other.
    """
    refuse_unless(recording, Recording, "recording", "a tiltvp.streams.Recording")
    written = [one for one in recording.topics if one.name == TRANSFORM_TOPIC]
    if camera_frame is None and written and not any(one.kind in IMAGE_KINDS for one in recording.topics):
        text = str(_first(recording, written[0]).data)
        return rotation_from_document(Document(recording.path, text))
    if camera_frame is None:
        images = recording.choose(IMAGE_KINDS, "--topic", topic)
        camera_frame = str(_first(recording, images).header.frame_id)
    static = recording.choose((_TRANSFORMS,), _STATIC, _STATIC)
    parents: dict[str, tuple[str, NDArray[np.float64]]] = {}
    several: set[str] = set()
    for _, content in recording.decoded(static):
        for one in content.transforms:
            frame, told = _plain(one.child_frame_id), (_plain(one.header.frame_id), _rotation(one, str(recording.path)))
            first = parents.setdefault(frame, told)
            if first[0] != told[0] or not np.allclose(first[1], told[1], atol=_ALIKE):
                several.add(frame)
    robot, camera = _plain(robot_frame), _plain(camera_frame)
    robot_up, camera_up = _up(robot, parents), _up(camera, parents)
    common = next((frame for frame in camera_up if frame in robot_up), None)
    known = sorted({*parents, *(parent for parent, _ in parents.values())})
    if common is None or robot not in known or camera not in known:
        raise InvalidInputError(
            f"{recording.path}: {_STATIC} does not join {robot!r} and {camera!r}, expected both among its frames: "
            + (", ".join(known) or "none")
        )
    for way in (robot_up, camera_up):
        for frame in [*way][: [*way].index(common)]:
            if frame in several:
                raise InvalidInputError(
                    f"{recording.path}: {_STATIC} has transforms of {frame!r} that contradict each other, expected one"
                )
    found: NDArray[np.float64] = robot_up[common].T @ camera_up[common]
    return found


def _up(frame: str, parents: dict[str, tuple[str, NDArray[np.float64]]]) -> dict[str, NDArray[np.float64]]:
    """A frame and those above it in turn, each with the rotation of the frame's vectors to it."""
    up = {frame: np.eye(3)}
    while frame in parents and parents[frame][0] not in up:
        above, step = parents[frame]
        up[above] = step @ up[frame]
        frame = above
    return up


def _plain(frame: object) -> str:
    return str(frame).lstrip("/")


def _rotation(transform: Any, source: str) -> NDArray[np.float64]:
    q = transform.transform.rotation
    return rotation_from_quaternion(np.array([q.x, q.y, q.z, q.w]), f"{source} {_STATIC}")
