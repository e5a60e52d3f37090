"""Frames that come as they are: from a live camera, and from the standard input as file names or raw pixels."""

from __future__ import annotations

import re
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, BinaryIO, Final

import numpy as np

from tiltvp import _core
from tiltvp.errors import ImageFileError, InvalidInputError
from tiltvp.images import read_image
from tiltvp.streams.frames import Frame, Frames

if TYPE_CHECKING:
    import cv2
    from numpy.typing import NDArray

__all__ = ["LiveCamera", "NamedImages", "RawImages", "raw_size"]

LONGEST_NAME: Final = 4096
"""Bytes of a file's name on the standard input: the longest path that Linux knows."""
_AGAIN_S: Final = 0.2
"""After which a camera that has gone is opened again: half of what an interrupt may take."""
_CAMERAS: Final = 100
"""From this on OpenCV takes the hundreds for what the camera is opened by; at -1 it crashes."""


class LiveCamera(Frames):
    """A camera that OpenCV opens by its number: frames as they come, at the times of a clock that never goes back.

    A camera that gives no image is opened again, until it does: the images that it did not give are one frame that
    cannot be read and says for how long.
    """

    def __init__(self, number: int, *, patience_s: float = 60.0) -> None:
        """Opens the camera. `patience_s` is how long one that has gone is waited for; then frames end.

        Raises `ImageFileError` where there is none, `InvalidInputError` for what is no number of a camera.
        """
        import cv2

        if isinstance(number, bool) or not isinstance(number, int | np.integer) or not 0 <= number < _CAMERAS:
            raise InvalidInputError(f"number = {number!r}, expected the number of a camera, from 0 to {_CAMERAS - 1}")
        self.source = f"camera {number}"
        self._number, self._patience_s = number, patience_s
        self._ended = threading.Event()
        self.meanwhile: Callable[[], object] = lambda: None
        """Called five times a second while a camera that has gone is waited for; may call `end`."""
        self._capture = _capture(number)
        if not self._capture.isOpened():
            raise ImageFileError(f"{self.source}: cannot be opened, expected the number of a camera, from 0")
        rate = float(self._capture.get(cv2.CAP_PROP_FPS))
        if np.isfinite(rate) and rate > 0.0:
            self.rate_hz = rate

    def end(self) -> None:
        """No more frames after the one that is read now; may be called from another thread or a signal's handler."""
        self._ended.set()

    def __iter__(self) -> Iterator[Frame]:
        """Ends with `end`, and when a camera that has gone does not come back."""
        number, last_s = 0, time.monotonic()
        try:
            while not self._ended.is_set():
                image = self._image()
                if image is None:
                    image = self._awaited(last_s)
                    name, now_s = f"{self.source}#{number:06d}", time.monotonic()
                    what = "it was opened again" if image is not None else "it is waited for no longer"
                    if image is None and self._ended.is_set():
                        what = "nobody waits for it"
                    gone = ImageFileError(f"{name}: the camera gave no image for {now_s - last_s:.1f} s, {what}")
                    yield Frame.of(name, now_s, gone)
                    number += 1
                    if image is None:
                        return
                # As near to the exposure as a program knows: the image has just arrived.
                last_s = time.monotonic()
                yield Frame.of(f"{self.source}#{number:06d}", last_s, image)
                number += 1
        finally:
            self._capture.release()

    def _image(self) -> NDArray[np.uint8] | None:
        done, image = self._capture.read()
        return np.asarray(image, dtype=np.uint8) if done else None

    def _awaited(self, since_s: float) -> NDArray[np.uint8] | None:
        """The first image of the camera after it has come back; None where it does not, or nobody waits any more."""
        while time.monotonic() - since_s < self._patience_s:
            self.meanwhile()
            if self._ended.wait(_AGAIN_S):
                break
            self._capture.release()
            self._capture = _capture(self._number)
            if self._capture.isOpened():
                image = self._image()
                if image is not None:
                    return image
        return None


def _capture(number: int) -> cv2.VideoCapture:
    """A camera, or what is no open one, without the lines that OpenCV prints of it: while a camera that has gone is
    waited for they would be ten a second."""
    import cv2

    before = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)
    try:
        return cv2.VideoCapture(number)
    finally:
        cv2.utils.logging.setLogLevel(before)


class NamedImages(Frames):
    """Image files whose names come in lines."""

    def __init__(self, lines: BinaryIO | None = None) -> None:
        """By default those of the standard input."""
        self.source = "-"
        self._lines = sys.stdin.buffer if lines is None else lines

    def __iter__(self) -> Iterator[Frame]:
        while line := self._lines.readline(LONGEST_NAME + 1):
            if len(line) > LONGEST_NAME:
                raise InvalidInputError(f"-: a line of more than {LONGEST_NAME} bytes, expected the names of images")
            name = line.decode("utf-8", "surrogateescape").rstrip("\r\n")
            if name:
                yield Frame(name, None, lambda name=name: read_image(name))  # type: ignore[misc]


class RawImages(Frames):
    """Pixels without any header, image after image: rows from the top, one byte a value, colour in BGR order."""

    def __init__(self, shape: tuple[int, ...], stream: BinaryIO | None = None) -> None:
        """`shape` is (H, W) or (H, W, 3 or 4), `stream` by default the standard input."""
        self.source = "-"
        self._shape = shape
        self._stream = sys.stdin.buffer if stream is None else stream

    def __iter__(self) -> Iterator[Frame]:
        size, number = int(np.prod(self._shape)), 0
        while data := self._stream.read(size):
            name = f"-#{number:06d}"
            if len(data) < size:
                yield Frame.of(name, None, ImageFileError(f"{name}: {len(data)} bytes, expected {size}"))
                return
            yield Frame.of(name, None, self._pixels(data))
            number += 1

    def _pixels(self, data: bytes) -> NDArray[np.uint8]:
        pixels = np.frombuffer(data, np.uint8).reshape(self._shape)
        return pixels if pixels.ndim == 2 else np.ascontiguousarray(pixels[:, :, :3])


def raw_size(text: str) -> tuple[int, ...]:
    """(H, W) or (H, W, channels) from `640x480` or `640x480x3`. Raises `InvalidInputError`."""
    found = re.fullmatch(r"(\d{1,9})x(\d{1,9})(?:x([134]))?", text)
    if found is None:
        raise InvalidInputError(f"--raw {text!r}, expected WIDTHxHEIGHT or WIDTHxHEIGHTxCHANNELS, such as 640x480x3")
    width, height, channels = int(found[1]), int(found[2]), int(found[3] or 1)
    if not 0 < width * height <= _core.MOST_PIXELS:
        raise InvalidInputError(f"--raw {text}: {width * height} pixels, expected 1 to {_core.MOST_PIXELS}")
    return (height, width) if channels == 1 else (height, width, channels)
