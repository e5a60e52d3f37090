"""From a record of odometry, a table or a bag, to what the robot did from each frame to the next."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tiltvp.errors import InvalidInputError
from tiltvp.streams.bags import Recording, is_recording
from tiltvp.streams.odometry import Motion, Odometry
from tiltvp.streams.odometry_tables import OdometryTable
from tiltvp.streams.wheels import Wheels

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp.streams.frames import Frames

__all__ = ["FrameMotions", "frame_motions", "read_odometry"]

_DEFAULTS = Wheels()


@dataclass(frozen=True, eq=False)
class FrameMotions:
    """What a robot did up to each frame since the last frame before it that the record tells of."""

    motions: Sequence[Motion | None]
    """One for each frame; None where the record does not tell of its time."""
    turns_known: bool
    """Whether `yaw_rad` of the motions means anything."""
    times_s: NDArray[np.float64] | None
    """(N,): when each frame was taken; None where neither frames nor record tell."""
    notes: tuple[str, ...] = ()
    """Sentences that whoever uses it should know: frames left out, counters that began anew."""


def read_odometry(source: str | os.PathLike[str], *, topic: str | None = None, wheels: Wheels = _DEFAULTS) -> Odometry:
    """The odometry of a recording, or of a table with the column `time_s`.

    `topic` is that of a bag, by default the only one; `wheels` is what the record does not say of the wheels. Raises
    `InvalidInputError` that says what is missing, or what is wrong in which line.
    """
    if is_recording(source):
        from tiltvp.streams.bag_motion import bag_odometry

        return bag_odometry(Recording(source), topic, wheels)
    return OdometryTable.read(source).odometry(wheels)


def frame_motions(
    frames: Frames,
    source: str | os.PathLike[str],
    *,
    topic: str | None = None,
    wheels: Wheels = _DEFAULTS,
) -> FrameMotions:
    """What the robot did up to each frame, by a recording or a table.

    A table with a column `file` has a row for each frame. Other records are interpolated at the frames' times; a table
    of as many rows as frames without times has one for each of these, in their order. Raises `InvalidInputError`.
    """
    if frames.names is None:
        raise InvalidInputError(f"{frames.source}: frames of unknown number, expected a recording for odometry")
    if is_recording(source):
        return _interpolated(frames, read_odometry(source, topic=topic, wheels=wheels))
    table = OdometryTable.read(source)
    if table.times_s is not None and table.files is None:
        if frames.times_s is not None:
            return _interpolated(frames, table.odometry(wheels))
        if len(table) != len(frames.names):
            raise InvalidInputError(
                f"{frames.source}: no times of the images, expected them in frames.csv (file, time_s) beside these, or "
                f"as many rows in {table.name} as images"
            )
    motions, rows, turns = table.motions(frames.names, wheels)
    times = frames.times_s
    if times is None and table.times_s is not None:
        times = table.times_s[rows]
    return FrameMotions(motions, turns, times, () if turns else (_no_turns(table.name),))


def _interpolated(frames: Frames, odometry: Odometry) -> FrameMotions:
    if frames.times_s is None or frames.names is None:
        raise InvalidInputError(f"{frames.source}: no times of the images, expected them for {odometry.source}")
    told = odometry.missing(frames.times_s, frames.names)
    motions = odometry.motions(frames.times_s)
    if not any(motion is not None for motion in motions):
        first, last = frames.times_s[0], frames.times_s[-1]
        raise InvalidInputError(
            f"{told}: none is left of {frames.source}, from {first:.3f} to {last:.3f} s; expected clocks that agree"
        )
    turns = odometry.yaw_rad is not None
    notes = [*odometry.notes, *([] if turns else [_no_turns(odometry.source)]), *([] if told is None else [told])]
    return FrameMotions(motions, turns, frames.times_s, tuple(notes))


def _no_turns(source: str) -> str:
    return f"{source}: distances without turns, which want the distance between the wheels (--wheel-base)"
