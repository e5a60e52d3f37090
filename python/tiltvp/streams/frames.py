"""What every source of images gives: frames in their order, each with its name and, where it is known, its time."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tiltvp.arguments import refuse_single
from tiltvp.errors import InvalidInputError, TiltvpError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["DEFAULT_RATE_HZ", "Frame", "Frames"]

DEFAULT_RATE_HZ = 25.0
"""Frames per second of what does not say how fast it was taken: that of a film, for those who watch it."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One image of a source."""

    name: str
    """What messages and tables call it: the path of an image file; else the source, a # and the number of the frame."""
    time_s: float | None
    """When it was taken, by the source's clock; None where the source does not tell."""
    read: Callable[[], NDArray[np.uint8]]
    """Decodes it: (H, W) or (H, W, 3) uint8, colour in BGR order. Raises `TiltvpError` with what is wrong with it."""

    @property
    def image(self) -> NDArray[np.uint8] | TiltvpError:
        """The image, or what is wrong with it, decoded at each call."""
        try:
            return self.read()
        except TiltvpError as error:
            return error

    @classmethod
    def of(cls, name: str, time_s: float | None, image: NDArray[np.uint8] | TiltvpError) -> Frame:
        """A frame that is decoded, or that cannot be."""

        def read() -> NDArray[np.uint8]:
            if isinstance(image, TiltvpError):
                raise image
            return image

        return cls(name, time_s, read)


class Frames:
    """Where frames come from. Iterating gives every `Frame` in the order of the source."""

    source: str
    """What it was opened by, for messages."""
    names: Sequence[str] | None = None
    """The names of all frames; None where their number is not known before they have come."""
    times_s: NDArray[np.float64] | None = None
    """(N,): when each was taken; None where that is not known, or not before they have come."""
    rate_hz: float = DEFAULT_RATE_HZ
    """Frames per second, in the median; 25 where nothing tells."""
    notes: tuple[str, ...] = ()
    """Sentences about the source that whoever uses it should know."""
    problems: tuple[str, ...] = ()
    """What was asked for and is not there, a sentence each."""
    told: Collection[str] = ()
    """Names of frames of which somebody has said what is wrong with them, so that it is not said again."""
    recording: Path | None = None
    """Where the odometry of the same drive is: a bag, or the table of a folder; None where nobody knows of any."""

    @property
    def count(self) -> int | None:
        """How many there are; None where that is not known before they have come."""
        return None if self.names is None else len(self.names)

    def __iter__(self) -> Iterator[Frame]:
        raise NotImplementedError

    def sample(self, numbers: Sequence[int]) -> Iterator[Frame]:
        """The frames of these numbers, which rise, without decoding others where the source allows.

        Raises `InvalidInputError` for a source that can be read only once, and for frames that are not there.
        """
        if self.names is None:
            raise InvalidInputError(f"{self.source}: can be read only once, expected a source of known length")
        wanted = set(self._these(numbers))
        for number, frame in enumerate(self):
            if number in wanted:
                yield frame
            if number >= max(wanted, default=-1):
                return

    def _these(self, numbers: Sequence[int]) -> list[int]:
        """Numbers of frames that are there. Raises `InvalidInputError`."""
        count = self.count or 0
        refuse_single(numbers, "numbers", "several numbers of frames")
        found = list(numbers)
        for one in found:
            if not (isinstance(one, int | np.integer) and 0 <= one < count):
                raise InvalidInputError(f"numbers: {one!r}, expected whole numbers from 0 below {count}")
        return found


def median_rate_hz(times_s: NDArray[np.float64] | None) -> float:
    """Frames per second by the median of the steps of times (N,) in seconds; 25 where these do not tell."""
    steps = np.diff(times_s) if times_s is not None else np.zeros(0)
    steps = steps[np.isfinite(steps) & (steps > 0.0)]
    return float(1.0 / np.median(steps)) if len(steps) else DEFAULT_RATE_HZ
