"""Images that are the same as the one before, to the last byte: those of a sensor differ by its noise, unless a video's
compression has taken that."""

from __future__ import annotations

import threading
import zlib
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final

from tiltvp.cli.terminal import complain
from tiltvp.errors import counted

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp.streams import Frame, Frames

__all__ = ["Repeats"]

_KEPT: Final = 1_000
"""Frames whose sums are kept: more than are read at the same time."""


class Repeats:
    """Counts them as frames are read, once or several times, in any order and by any thread."""

    def __init__(self, frames: Frames) -> None:
        """Nothing of the frames is read."""
        self._frames = frames
        self._sums = dict[int, int]()
        self._lock = threading.Lock()
        self.count = 0
        """How many are the same as the one before."""
        self.images = 0
        """How many have been read."""
        self.is_empty = False
        """Whether the frames have come to their end without any."""
        self._told = 0, 0

    def __iter__(self) -> Iterator[Frame]:
        number = -1
        for number, frame in enumerate(self._frames):
            yield replace(frame, read=partial(self._read, number, frame))
        self.is_empty = number < 0

    def tell(self) -> None:
        """A line on stderr, if there are any and it has not been told."""
        if self.count and (self.count, self.images) != self._told:
            self._told = self.count, self.images
            complain(
                f"{self._frames.source}: {self.count} of {counted(self.images, 'images')}: the same as the one before "
                "to the last byte: a frozen camera, images that are there twice, or what stands in a compressed video"
            )

    def _read(self, number: int, frame: Frame) -> NDArray[np.uint8]:
        import numpy as np

        image = frame.read()
        told = zlib.crc32(np.ascontiguousarray(image).data)
        with self._lock:
            if number not in self._sums:
                self._note(number, told)
        return image

    def _note(self, number: int, told: int) -> None:
        same = sum(self._sums.get(near) == told for near in (number - 1, number + 1))
        self._sums[number] = told
        self._sums.pop(number - _KEPT, None)
        self.images += 1
        self.count += same
        # Of a source without an end as it happens, and then ever more seldom: at 1, 10, 100, ...
        if same and self._frames.count is None and str(self.count).strip("0") == "1":
            self.tell()
