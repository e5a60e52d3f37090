"""Frames of video files: with their own time stamps by PyAV, evenly spaced by OpenCV where that is not installed."""

from __future__ import annotations

import os
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp import _core
from tiltvp.errors import ImageFileError, MissingExtraError, TiltvpError, counted
from tiltvp.streams.frames import DEFAULT_RATE_HZ, Frame, Frames, median_rate_hz

if TYPE_CHECKING:
    import av
    from numpy.typing import NDArray

__all__ = ["VIDEO_ENDINGS", "open_video"]

VIDEO_ENDINGS: Final = (".mp4", ".avi", ".mkv", ".mov", ".webm", ".m4v", ".mpg", ".mpeg")
_DAMAGED: Final = "cannot be decoded"
_TURNED: Final = (
    "is to be shown turned by {} degrees counter-clockwise, which is not followed: pixels stay where the sensor has "
    "them, as those of the calibration have to"
)
_NO_SEEKING: Final = "mpeg"
"""Program streams of MPEG, in which seeking does not lead to key frames."""
_MATROSKA: Final = b"\x1a\x45\xdf\xa3"
_SEGMENT: Final = b"\x18\x53\x80\x67"
_SEGMENT_WITHIN: Final = 128
"""Beginning of a Matroska file, beginning of all else in it (RFC 9559, 5.1), and in how many bytes that is: the head in
front has some 40, of fixed fields."""


def open_video(path: Path) -> Frames:
    """The frames of a video. Raises `ImageFileError` with the path for what is none, and for one without frames."""
    if not path.is_file():
        raise ImageFileError(f"{path}: no such file, expected a video")
    try:
        import av  # noqa: F401
    except ImportError as error:
        return _OpenCvVideo(path, error)
    return _Video(path)


def _names(path: Path, count: int) -> list[str]:
    digits = len(str(count - 1))
    return [f"{path}#{k:0{digits}d}" for k in range(count)]


class _Video(Frames):
    """A video by PyAV. Which packets there are, and when each is shown, is read first; nothing is decoded for that."""

    def __init__(self, path: Path) -> None:
        self.source, self._path = str(path), path
        with _opened(path) as container:
            stream = container.streams.video[0]
            _check_size(path, stream.codec_context.width, stream.codec_context.height)
            stamps, keys, complete = _stamps(container, stream)
            if not stamps:
                raise ImageFileError(f"{path}: a video without frames, expected at least one")
            rate = stream.average_rate
            seeks = container.format.name != _NO_SEEKING
            base = None if stream.time_base is None or any(stamp is None for stamp in stamps) else stream.time_base
        self.names = _names(path, len(stamps))
        notes = []
        self._stamps: list[int] | None = None
        self._keys: list[int] = []
        if base is None:
            self.rate_hz = float(rate) if rate else DEFAULT_RATE_HZ
            self.times_s = np.arange(len(stamps)) / self.rate_hz
            notes.append(f"{path}: its frames have no time stamps; {self.rate_hz:.6g} a second are assumed")
        else:
            self._stamps = sorted(stamp for stamp in stamps if stamp is not None)
            self._keys = sorted(stamp for stamp in keys if stamp is not None) if seeks else []
            self.times_s = np.array([float(stamp * base) for stamp in self._stamps])
            self.rate_hz = median_rate_hz(self.times_s)
        if not complete or _is_cut_off(path):
            notes.append(f"{path}: ends before its end, after {counted(len(stamps), 'frames')} (cut off?)")
        if turned_deg := self._turned_deg():
            notes.append(f"{path}: {_TURNED.format(turned_deg)}")
        self.notes = tuple(notes)

    def _turned_deg(self) -> int:
        with _opened(self._path) as container:
            first = next(_decoded(container), None)
            return 0 if first is None else first.rotation % 360

    def __iter__(self) -> Iterator[Frame]:
        """Frames in the places that their stamps have; what is missing cannot be decoded."""
        with _opened(self._path) as container:
            count, at = self.count or 0, 0
            for number, frame in self._numbered(_decoded(container)):
                if at <= number < count:
                    yield from map(self._missing, range(at, number))
                    yield self._frame(number, frame)
                    at = number + 1
            yield from map(self._missing, range(at, count))

    def sample(self, numbers: Sequence[int]) -> Iterator[Frame]:
        """Those frames, decoded from the key frame before them, once for all that follow one."""
        if self._stamps is None or not self._keys:
            yield from super().sample(numbers)
            return
        with _opened(self._path) as container:
            coming: Iterator[tuple[int, av.VideoFrame]] = iter(())
            at, begun = -1, None
            for number in self._these(numbers):
                stamp = self._stamps[number]
                # To the key frame itself: from a frame shown before it but stored after it, seeking leads to the next.
                key = self._keys[max(0, bisect_right(self._keys, stamp) - 1)]
                if key != begun or number <= at:
                    container.seek(min(key, stamp), stream=container.streams.video[0], backward=True)
                    coming, begun = self._numbered(_decoded(container)), key
                at, frame = next((one for one in coming if one[0] >= number), (len(self._stamps), None))
                yield self._missing(number) if frame is None or at > number else self._frame(number, frame)

    def _numbered(self, decoded: Iterator[av.VideoFrame]) -> Iterator[tuple[int, av.VideoFrame]]:
        places = None if self._stamps is None else {stamp: k for k, stamp in enumerate(self._stamps)}
        for k, frame in enumerate(decoded):
            if places is None:
                yield k, frame
            elif frame.pts in places:
                yield places[frame.pts], frame

    def _frame(self, number: int, frame: av.VideoFrame) -> Frame:
        def read() -> NDArray[np.uint8]:
            return np.ascontiguousarray(frame.to_ndarray(format="bgr24"), dtype=np.uint8)

        return Frame(self._name(number), self._time_s(number), read)

    def _missing(self, number: int) -> Frame:
        name = self._name(number)
        return Frame.of(name, self._time_s(number), ImageFileError(f"{name}: {_DAMAGED}"))

    def _name(self, number: int) -> str:
        assert self.names is not None
        return self.names[number]

    def _time_s(self, number: int) -> float:
        assert self.times_s is not None
        return float(self.times_s[number])


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """The container of a video; everything that PyAV says of it is an `ImageFileError`."""
    import av

    try:
        # PyAV would take a name with a colon for an address, and the network has nothing to do with a file.
        with av.open(f"file:{os.fspath(path)}") as container:
            if not container.streams.video:
                raise ImageFileError(f"{path}: no video stream, expected a video")
            if container.streams.video[0].codec_context is None:
                raise ImageFileError(f"{path}: {_DAMAGED}, for its codec is not known, expected another, as H.264")
            container.streams.video[0].thread_type = "AUTO"
            yield container
    except TiltvpError:
        raise
    except (av.FFmpegError, ValueError, UnicodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise ImageFileError(f"{path}: not a video that can be decoded ({why})") from error


def _check_size(path: Path, width: int, height: int) -> None:
    if not 0 < width * height <= _core.MOST_PIXELS:
        raise ImageFileError(f"{path}: {width} x {height} pixels, expected 1 to {_core.MOST_PIXELS} in all")


def _stamps(container: Any, stream: Any) -> tuple[list[int | None], list[int | None], bool]:
    """When each packet is shown, in the order of the file, and those of key frames, which need not be shown themselves
    where a video was trimmed; whether the file was read to its end."""
    import av

    found: list[tuple[int | None, bool, bool]] = []
    complete = True
    try:
        found.extend(
            (packet.pts, packet.is_keyframe, packet.is_discard)
            for packet in container.demux(stream)
            if packet.size and not packet.is_corrupt
        )
    except av.FFmpegError:
        complete = False
    shown = [stamp for stamp, _, is_discard in found if not is_discard]
    return shown, [stamp for stamp, is_key, _ in found if is_key], complete


def _is_cut_off(path: Path) -> bool:
    """Whether a Matroska file has fewer bytes than it says at its beginning: its reader takes what is there for all."""
    with open(path, "rb") as stream:
        head = stream.read(_SEGMENT_WITHIN)
    at = head.find(_SEGMENT) + len(_SEGMENT)
    if not head.startswith(_MATROSKA) or at < len(_SEGMENT) or at == len(head):
        return False
    # The zeros before its first one bit say how many bytes a number has; all ones: not known, as of a live recording.
    length = 9 - head[at].bit_length()
    most = (1 << 7 * length) - 1
    size = int.from_bytes(head[at : at + length], "big") & most
    return size != most and at + length + size > path.stat().st_size


def _decoded(container: Any) -> Iterator[av.VideoFrame]:
    """The frames that can be decoded: what is between them is passed over."""
    import av

    packets = container.demux(video=0)
    while True:
        try:
            packet = next(packets, None)
        except av.FFmpegError:
            packet = None
        if packet is None:
            return
        with suppress(av.FFmpegError):
            yield from packet.decode()


class _OpenCvVideo(Frames):
    """A video by OpenCV, which tells no time stamps that can be relied upon: its frames are taken to be even."""

    def __init__(self, path: Path, without: ImportError) -> None:
        import cv2

        self.source, self._path = str(path), path
        capture = self._capture()
        count, turned_deg = (
            max(0, int(capture.get(one))) for one in (cv2.CAP_PROP_FRAME_COUNT, cv2.CAP_PROP_ORIENTATION_META)
        )
        rate = float(capture.get(cv2.CAP_PROP_FPS))
        _check_size(path, *(int(capture.get(side)) for side in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)))
        capture.release()
        if count == 0:
            raise ImageFileError(f"{path}: a video without frames, expected at least one")
        self.rate_hz = rate if np.isfinite(rate) and rate > 0.0 else DEFAULT_RATE_HZ
        self.times_s = np.arange(count) / self.rate_hz
        self.names = _names(path, count)
        self.notes = (
            f"{path}: read as {self.rate_hz:.6g} even frames a second; "
            f"{MissingExtraError.of('reading its time stamps', 'video', without)}",
        )
        if turned_deg:
            self.notes += (f"{path}: {_TURNED.format(-turned_deg % 360)}",)

    def _capture(self) -> Any:
        import cv2

        capture = cv2.VideoCapture(str(self._path))
        if not capture.isOpened():
            raise ImageFileError(f"{self._path}: not a video that can be decoded")
        # As with photographs, pixels stay where the sensor has them.
        capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
        return capture

    def __iter__(self) -> Iterator[Frame]:
        assert self.names is not None
        assert self.times_s is not None
        capture = self._capture()
        try:
            for name, time_s in zip(self.names, self.times_s.tolist(), strict=True):
                done, image = capture.read()
                error = ImageFileError(f"{name}: {_DAMAGED}")
                yield Frame.of(name, time_s, np.asarray(image, dtype=np.uint8) if done else error)
        finally:
            capture.release()
