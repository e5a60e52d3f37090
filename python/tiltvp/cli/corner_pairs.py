"""Frames of two cameras: as many of each, and each taken together with its partner."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from tiltvp.streams import Frames


def check_pairs(left: Frames, right: Frames, *, timed: bool) -> None:
    """Refuses frames that are no pairs by their numbers, and says which.

    Where both sides tell times, which count if `timed`, partners are at most half a frame apart. Where files have the
    names of files on the other side, they are their partners.
    """
    for side in (left, right):
        if side.names is None:
            known = "expected files, a video or a recording, whose frames can be counted"
            raise InvalidInputError(f"{side.source}: frames of one of two cameras as they come, {known}")
    if right.count != left.count:
        raise InvalidInputError(f"{right.source}: {right.count} frames, expected {left.count} as in {left.source}")
    if left.times_s is not None and right.times_s is not None:
        if timed:
            _check_times(left, right)
    else:
        _check_names(left, right)


def _check_times(left: Frames, right: Frames) -> None:
    import numpy as np

    assert left.names is not None
    assert right.names is not None
    assert left.times_s is not None
    assert right.times_s is not None
    late_s, most_s = right.times_s - left.times_s, 0.5 / left.rate_hz
    apart = np.flatnonzero(~(np.abs(late_s) <= most_s))
    if len(apart):
        first = int(apart[0])
        how = f"{abs(late_s[first]):.3f} s {'after' if late_s[first] > 0.0 else 'before'} the left {left.names[first]}"
        expected = f"expected at most {most_s:.3f} s, or --frame-rate where no frame is missing and clocks differ"
        raise InvalidInputError(f"the right {right.names[first]}: taken {how} ({len(apart)} such pairs), {expected}")


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
