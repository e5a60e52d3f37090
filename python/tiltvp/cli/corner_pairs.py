"""Frames of two cameras: each taken together with its partner."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np

from tiltvp.cli.sources import tell
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.streams import Frame, Frames

T = TypeVar("T")


_NEAR: Final = 0.25
"""Share of the time between two frames by which partners are apart at most, where frames of one side are missing: half
of what those of even frames may be apart, as another frame is near."""


def partners_of(left: Frames, right: Frames, *, timed: bool) -> list[int | None]:
    """The number of the right frame that belongs to each left one, rising; None where there is none.

    Where both sides tell times, which count if `timed`, partners are at most half a frame apart by their numbers; else
    by their times, and a line says how many frames are left out. Where files have the names of files on the other side,
    they are their partners. Raises `InvalidInputError` for frames that are no pairs, and says which.
    """
    for side in (left, right):
        if side.names is None:
            known = "expected files, a video or a recording, whose frames can be counted"
            raise InvalidInputError(f"{side.source}: frames of one of two cameras as they come, {known}")
    assert left.names is not None
    by_number: list[int | None] = list(range(len(left.names)))
    if timed and left.times_s is not None and right.times_s is not None:
        if right.count != left.count or not _is_even(left, right):
            return _nearest(left, right)
        return by_number
    if right.count != left.count:
        raise InvalidInputError(f"{right.source}: {right.count} frames, expected {left.count} as in {left.source}")
    if left.times_s is None or right.times_s is None:
        _check_names(left, right)
    return by_number


def pairs_of(lefts: Iterable[T], rights: Iterable[Frame], partners: Sequence[int | None]) -> Iterator[tuple[T, Frame]]:
    """The left ones that have a partner, each with it."""
    numbered = enumerate(rights)
    for left, wanted in zip(lefts, partners, strict=False):
        if wanted is None:
            continue
        for number, right in numbered:
            if number == wanted:
                yield left, right
                break


def _is_even(left: Frames, right: Frames) -> bool:
    """Whether frames of equal numbers are at most half a frame apart. Raises `InvalidInputError` where none are, as of
    clocks that differ."""
    assert left.names is not None
    assert right.names is not None
    assert left.times_s is not None
    assert right.times_s is not None
    late_s, most_s = right.times_s - left.times_s, 0.5 / left.rate_hz
    apart = ~(np.abs(late_s) <= most_s)
    if apart.all():
        how = f"{abs(late_s[0]):.3f} s {'after' if late_s[0] > 0.0 else 'before'} the left {left.names[0]}"
        expected = f"expected at most {most_s:.3f} s, or --frame-rate where no frame is missing and clocks differ"
        raise InvalidInputError(f"the right {right.names[0]}: taken {how} ({apart.sum()} such pairs), {expected}")
    return not apart.any()


def _nearest(left: Frames, right: Frames) -> list[int | None]:
    """Partners by their times: each is the nearest to the other."""
    assert left.times_s is not None
    assert right.times_s is not None
    most_s = _NEAR / left.rate_hz
    for side in (left, right):
        assert side.times_s is not None
        if not (np.diff(side.times_s) > 0.0).all():
            raise InvalidInputError(f"{side.source}: {side.count} frames whose times do not rise, expected pairs")
    of_left, of_right = _nearest_of(left.times_s, right.times_s), _nearest_of(right.times_s, left.times_s)
    mutual = of_right[of_left] == np.arange(len(of_left))
    near = mutual & (np.abs(left.times_s - right.times_s[of_left]) <= most_s)
    count = int(near.sum())
    told = f"{count} pairs of {left.count} left and {right.count} right frames are at most {most_s:.3f} s apart"
    if not count:
        raise InvalidInputError(f"{right.source}: {told}, expected frames of the same times as in {left.source}")
    tell(f"{told}; the others are left out")
    return [int(number) if known else None for number, known in zip(of_left, near, strict=True)]


def _nearest_of(times_s: NDArray[np.float64], rising_s: NDArray[np.float64]) -> NDArray[np.intp]:
    """(N,): the place of the nearest of rising times for each time (N,)."""
    after = np.minimum(np.searchsorted(rising_s, times_s), len(rising_s) - 1)
    before = np.maximum(after - 1, 0)
    return np.where(np.abs(times_s - rising_s[before]) <= np.abs(rising_s[after] - times_s), before, after)


def _check_names(left: Frames, right: Frames) -> None:
    from tiltvp.streams.image_files import ImageFiles

    if not isinstance(left, ImageFiles) or not isinstance(right, ImageFiles):
        return
    lefts, rights = [file.stem for file in left.files], [file.stem for file in right.files]
    both = set(lefts) & set(rights)
    for one, other, file, partner in zip(lefts, rights, left.files, right.files, strict=True):
        if one != other and not both.isdisjoint((one, other)):
            shared = one if one in both else other
            raise InvalidInputError(f"{partner}: beside {file}, expected the two {shared!r} to be a pair")
