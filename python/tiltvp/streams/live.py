"""Frames that come as they are: from a live camera, and from the standard input as file names or raw pixels."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, BinaryIO, Final

import numpy as np

from tiltvp import _core
from tiltvp.errors import ImageFileError, InvalidInputError
from tiltvp.images import read_image
from tiltvp.streams.frames import Frame, Frames

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["LiveCamera", "NamedImages", "RawImages", "raw_size"]

LONGEST_NAME: Final = 4096
"""Bytes of a file's name on the standard input: the longest path that Linux knows."""


class LiveCamera(Frames):
    """A camera that OpenCV opens by its number: frames as they come, at the times of a clock that never goes back."""

    def __init__(self, number: int) -> None:
        """Opens the camera. Raises `ImageFileError` where there is none."""
        import cv2

        self.source = f"camera {number}"
        self._capture = cv2.VideoCapture(number)
        if not self._capture.isOpened():
            raise ImageFileError(f"{self.source}: cannot be opened, expected the number of a camera, from 0")
        rate = float(self._capture.get(cv2.CAP_PROP_FPS))
        if np.isfinite(rate) and rate > 0.0:
            self.rate_hz = rate

    def __iter__(self) -> Iterator[Frame]:
        """Ends when the camera gives no more images."""
        number = 0
        try:
            while True:
                done, image = self._capture.read()
                # As near to the exposure as a program knows: the image has just arrived.
                time_s = time.monotonic()
                if not done:
                    return
                yield Frame.of(f"{self.source}#{number:06d}", time_s, np.asarray(image, dtype=np.uint8))
                number += 1
        finally:
            self._capture.release()


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
