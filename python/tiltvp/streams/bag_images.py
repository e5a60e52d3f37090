"""Frames of a recording: messages of sensor_msgs/Image and CompressedImage, decoded as OpenCV has images."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp import _core
from tiltvp.errors import ImageFileError, InvalidInputError, TiltvpError
from tiltvp.images import bgr_from, bits_of, decode_image, gray_from
from tiltvp.streams.bags import Message, Recording
from tiltvp.streams.frames import Frame, Frames, median_rate_hz

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["CAMERA_KINDS", "IMAGE_KINDS", "BagFrames", "image_from_message", "is_rectified"]

IMAGE_KINDS: Final = ("sensor_msgs/Image", "sensor_msgs/CompressedImage")
CAMERA_KINDS: Final = ("sensor_msgs/CameraInfo",)
_TURN_TOLD_DEG: Final = 0.1
"""A turn of rectified images that is told: what a tilt of one image is off by."""
_DEPTH_8: Final = {"mono8": 1, "8UC1": 1, "rgb8": 3, "bgr8": 3, "8UC3": 3, "rgba8": 4, "bgra8": 4, "8UC4": 4}
_DEPTH_16: Final = {"mono16": 1, "16UC1": 1, "rgb16": 3, "bgr16": 3, "rgba16": 4, "bgra16": 4}
_BAYER: Final = ("rggb", "bggr", "gbrg", "grbg")
"""Which colours the first two pixels of the first two rows have."""
_YUV: Final = ("uyvy", "yuv422", "yuyv", "yuv422_yuy2")
"""Two values a pixel, of which two pixels share the colour; the first two names are of one order."""
_PLANAR: Final = ("nv12", "nv21")
"""Rows of grey levels, then half as many of the colours that four pixels share."""
_EXPECTED: Final = (
    f"mono8, mono16, rgb8, bgr8, rgba8, bgra8, the same with 16, bayer_rggb8 and the like, {', '.join(_YUV + _PLANAR)}"
)


_RECTIFIED: Final = "/image_rect"


def is_rectified(topic: str) -> bool:
    """Whether images of a topic are called rectified, as those of image_proc and stereo_image_proc are."""
    return _RECTIFIED in topic


def _turned_deg(recording: Recording, topic: str) -> float:
    """How far rectified images are turned against the raw ones, degrees; 0 where CameraInfo does not tell."""
    infos = [one for one in recording.topics if one.kind in CAMERA_KINDS and one.count > 0]
    beside = [one for one in infos if one.name == topic.split(_RECTIFIED)[0] + "/camera_info"] or infos
    if len(beside) != 1:
        return 0.0
    try:
        _, info = next(recording.decoded(beside[0]))
    except InvalidInputError:
        return 0.0
    turn = np.reshape(getattr(info, "r", getattr(info, "R", np.eye(3))), (3, 3))
    sine = math.hypot(turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1])
    return math.degrees(math.atan2(sine, np.trace(turn) - 1.0)) if turn.any() else 0.0


class BagFrames(Frames):
    """The images of one topic of a recording, at the times of their headers."""

    def __init__(self, recording: Recording, topic: str | None = None, *, option: str = "--topic") -> None:
        """Reads the times of all. Raises `InvalidInputError` without one topic of images."""
        self._recording = recording
        self._topic = recording.choose(IMAGE_KINDS, option, topic)
        self.source, self.recording = str(recording.path), recording.path
        times, self._bits, from_zero = [], 0, recording.is_from_zero(self._topic)
        for message in recording.messages(self._topic):
            time_s, bits = _seen(message, from_zero=from_zero)
            times.append(time_s)
            self._bits = max(self._bits, bits)
        digits = len(str(max(len(times) - 1, 0)))
        self.names = [f"{recording.path}#{k:0{digits}d}" for k in range(len(times))]
        self.times_s = np.array(times)
        self.problems = recording.unread(self._topic, len(times))
        self.rate_hz = median_rate_hz(self.times_s)
        told = []
        if is_rectified(self.topic):
            told.append("is called rectified: its lens is P of CameraInfo, as of a recording as --camera, not K and D")
            if (turned_deg := _turned_deg(recording, self.topic)) > _TURN_TOLD_DEG:
                told.append(
                    f"is turned by {turned_deg:.1f} degrees against the raw images (R of CameraInfo): "
                    "a mounting by /tf_static is taken for theirs, as image_geometry takes it"
                )
        if standing := int((np.diff(self.times_s) <= 0.0).sum()):
            told.append(f"has {standing} images that are stamped no later than those before: what moved is not told")
        if self._bits == 8:
            self._bits = 10
            told.append("has no value above 255 in its 16 bits: it is read as of 10 bits, a quarter as bright as of 8")
        self.notes = tuple(f"{recording.path}: {self.topic} {words}" for words in told)

    @property
    def topic(self) -> str:
        """The name of the topic."""
        return self._topic.name

    def __iter__(self) -> Iterator[Frame]:
        assert self.names is not None
        assert self.times_s is not None
        messages = self._recording.messages(self._topic)
        for name, time_s, message in zip(self.names, self.times_s.tolist(), messages, strict=False):
            yield Frame(name, time_s, _reading(name, message, self._bits or None))


def _reading(name: str, message: Message, bits: int | None) -> Callable[[], NDArray[np.uint8]]:
    def read() -> NDArray[np.uint8]:
        try:
            return image_from_message(message.decode(), bits=bits)
        except TiltvpError as error:
            raise ImageFileError(f"{name}: {error}") from error

    return read


def _seen(message: Message, *, from_zero: bool) -> tuple[float, int]:
    """The time of an image, that of its writing where the message is damaged, and how many bits its values have.

    The bits are 0 where the encoding tells them.
    """
    try:
        content = message.decode()
        time_s = message.taken_s(content, from_zero=from_zero)
    except InvalidInputError:
        return message.time_s, 0
    try:
        deep = _is_deep(getattr(content, "encoding", ""))
        if not deep:
            return time_s, 0
        levels = np.atleast_3d(_levels(content))[:, :, :3]
        return time_s, 8 if levels.max() <= 255 else bits_of(levels)
    except ImageFileError:  # It is told where it is read.
        return time_s, 0


def _is_deep(encoding: str) -> bool:
    """Whether values have 16 bits, of which sensors may use fewer."""
    bayer = encoding.removeprefix("bayer_")
    return encoding in _DEPTH_16 or (bayer[:-2] in _BAYER and bayer.endswith("16"))


def image_from_message(message: Any, *, bits: int | None = None) -> NDArray[np.uint8]:
    """(H, W) or (H, W, 3) uint8, colour in BGR order, of a sensor_msgs/Image or CompressedImage.

    The message is one of a recording, of rclpy or of rospy; the image has memory of its own. Of encodings with 16 bits
    a value `bits` is how many the sensor has: without it images are scaled one by one, as files of 16 bits are. Raises
    `ImageFileError` that says what does not fit, `InvalidInputError` for values of more than `bits`.
    """
    if not hasattr(message, "data"):
        raise ImageFileError(f"a {type(message).__name__}, expected a message of {' or '.join(IMAGE_KINDS)}")
    if not hasattr(message, "encoding"):
        return decode_image(_data(message).tobytes(), "an image")
    return _bgr(_levels(message), str(message.encoding), bits)


def _data(message: Any) -> NDArray[np.uint8]:
    # Those of rospy are bytes.
    raw = message.data
    return np.frombuffer(raw, np.uint8) if isinstance(raw, bytes) else np.asarray(raw, dtype=np.uint8)


def _levels(message: Any) -> NDArray[Any]:
    """The values of a sensor_msgs/Image, as its encoding has them: (rows, width) or (rows, width, channels)."""
    data = _data(message)
    width, height, encoding = int(message.width), int(message.height), str(message.encoding)
    if not 0 < width * height <= _core.MOST_PIXELS:
        raise ImageFileError(f"{width} x {height} pixels, expected 1 to {_core.MOST_PIXELS} in all")
    bayer, sixteen = encoding.removeprefix("bayer_"), _is_deep(encoding)
    channels = _DEPTH_8.get(encoding) or _DEPTH_16.get(encoding) or (2 if encoding in _YUV else None)
    if encoding in _PLANAR or (bayer.rstrip("168") in _BAYER and bayer != encoding):
        channels = 1
    if channels is None:
        raise ImageFileError(f"encoding {encoding!r}, expected {_EXPECTED}")
    if encoding in _YUV and width % 2:
        raise ImageFileError(f"{width} x {height} {encoding}, expected an even width: two pixels share a colour")
    if encoding in _PLANAR and (width % 2 or height % 2):
        raise ImageFileError(f"{width} x {height} {encoding}, expected even numbers: four pixels share a colour")
    rows = height + (height // 2 if encoding in _PLANAR else 0)
    row = width * channels * (2 if sixteen else 1)
    step = int(message.step) or row
    if step < row or len(data) < step * (rows - 1) + row:
        raise ImageFileError(
            f"{len(data)} bytes in rows of {step}, expected {rows} rows of {row} ({width} x {height} {encoding})"
        )
    whole = np.zeros(step * rows, np.uint8)
    whole[: min(len(data), step * rows)] = data[: step * rows]
    levels: NDArray[Any] = np.ascontiguousarray(whole.reshape(rows, step)[:, :row])
    if sixteen:
        levels = levels.view(">u2" if message.is_bigendian else "<u2").astype(np.uint16)
    return levels.reshape((rows, width, channels) if channels > 1 else (rows, width))


def _bgr(levels: NDArray[Any], encoding: str, bits: int | None) -> NDArray[np.uint8]:
    import cv2

    if encoding.startswith("bayer_"):
        # OpenCV names the pattern by the second row's second and third pixel: its RG is the sensor's BGGR.
        code = {
            "rggb": cv2.COLOR_BayerBG2BGR, "bggr": cv2.COLOR_BayerRG2BGR,
            "gbrg": cv2.COLOR_BayerGR2BGR, "grbg": cv2.COLOR_BayerGB2BGR,
        }[encoding[6:10]]  # fmt: skip
        levels = np.asarray(cv2.cvtColor(levels, code))
    elif encoding in _YUV:
        code = cv2.COLOR_YUV2BGR_UYVY if encoding in _YUV[:2] else cv2.COLOR_YUV2BGR_YUY2
        levels = np.asarray(cv2.cvtColor(levels, code))
    elif encoding in _PLANAR:
        code = cv2.COLOR_YUV2BGR_NV12 if encoding == "nv12" else cv2.COLOR_YUV2BGR_NV21
        levels = np.asarray(cv2.cvtColor(levels, code))
    elif encoding.startswith("rgb"):
        levels = levels[:, :, 2::-1]
    elif levels.ndim == 3:
        levels = levels[:, :, :3]
    return gray_from(levels, bits=bits) if levels.ndim == 2 else bgr_from(levels, bits=bits)
