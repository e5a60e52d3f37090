"""From a record of odometry, a table or a bag, to what the robot did from each frame to the next."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.arguments import refuse_unless
from tiltvp.drive_logs import DriveLog, doubled_rows
from tiltvp.errors import InvalidInputError, counted
from tiltvp.streams.bags import Recording, is_recording
from tiltvp.streams.frames import Frames
from tiltvp.streams.odometry import Motion, Odometry, refuse_set_back
from tiltvp.streams.odometry_tables import OdometryTable
from tiltvp.streams.wheels import Wheels

if TYPE_CHECKING:
    from numpy.typing import NDArray


__all__ = ["FrameMotions", "frame_motions", "read_odometry"]

_DEFAULTS = Wheels()
_UNITS: Final = ("millimetres", "cumulative")
"""Readings of `DriveLog.read_as` that are not about which wheel is which."""
_FARTHEST_M: Final = 50.0
"""Between two images: lines of a room are not followed over a tenth of it."""


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
    distances_known: bool = True
    """Whether `distance_m` of the motions means anything."""
    doubt: str = ""
    """Why they cannot be relied upon, which is among the notes too; empty where nothing speaks against it."""


def read_odometry(
    source: str | os.PathLike[str],
    *,
    topic: str | None = None,
    wheels: Wheels = _DEFAULTS,
    read_as: Sequence[str] = (),
) -> Odometry:
    """The odometry of a recording, or of a table with the column `time_s`.

    `topic` is that of a bag, by default the only one; `wheels` is what the record does not say of the wheels; `read_as`
    names conventions about wheels by which it was recorded, as of `DriveLog.read_as`. Raises `InvalidInputError` that
    says what is missing, or what is wrong in which line.
    """
    refuse_unless(wheels, Wheels, "wheels", "tiltvp.streams.Wheels")
    refuse_unless(read_as, Sequence, "read_as", "names of conventions")
    if is_recording(source):
        from tiltvp.streams.bag_motion import bag_odometry

        return _by_ours(bag_odometry(Recording(source), topic, wheels), wheels, read_as)
    return _of_table(OdometryTable.read(source), wheels, read_as)[0]


def frame_motions(
    frames: Frames,
    source: str | os.PathLike[str],
    *,
    topic: str | None = None,
    wheels: Wheels = _DEFAULTS,
    read_as: Sequence[str] = (),
) -> FrameMotions:
    """What the robot did up to each frame, by a recording or a table; other arguments are those of `read_odometry`.

    A table with a column `file` has a row for each frame. Other records are interpolated at the frames' times; a table
    of as many rows as frames without times has one for each of these, in their order. Raises `InvalidInputError`.
    """
    refuse_unless(frames, Frames, "frames", "what tiltvp.streams.open_frames opens")
    refuse_unless(wheels, Wheels, "wheels", "tiltvp.streams.Wheels")
    refuse_unless(read_as, Sequence, "read_as", "names of conventions")
    if frames.names is None:
        raise InvalidInputError(f"{frames.source}: frames of unknown number, expected a recording for odometry")
    if is_recording(source):
        return _interpolated(frames, read_odometry(source, topic=topic, wheels=wheels, read_as=read_as))
    table = OdometryTable.read(source)
    if table.times_s is not None and table.files is None:
        if frames.times_s is not None:
            record, doubt = _of_table(table, wheels, read_as)
            return replace(_interpolated(frames, record), distances_known=table.distances_known, doubt=doubt)
        if len(table) != len(frames.names):
            raise InvalidInputError(
                f"{frames.source}: no times of the images, expected them in frames.csv (file, time_s) beside these, or "
                f"as many rows in {table.name} as images"
            )
    motions, rows, turns = table.motions(frames.names, wheels)
    if read_as:
        steps = np.arange(len(motions), dtype=np.float64)
        recorded = _by_ours(_summed(motions, turns, table.name), wheels, read_as)
        motions, turns = [motion or Motion() for motion in recorded.motions(steps)], recorded.yaw_rad is not None
    times = frames.times_s
    if times is None and table.times_s is not None:
        times = table.times_s[rows]
        refuse_set_back(times, f"{frames.source} in the order of its images, by the times of {table.name}")
    notes = (*(() if turns else (_no_turns(table.name),)), *_far_steps(motions, frames.names, table.name))
    return FrameMotions(motions, turns, times, notes, table.distances_known)


def _of_table(table: OdometryTable, wheels: Wheels, read_as: Sequence[str]) -> tuple[Odometry, str]:
    """The record of a table with times, and what speaks against relying on it."""
    record = _by_ours(table.odometry(wheels), wheels, read_as)
    steps = None if "cumulative" in read_as else table.steps
    told = "" if steps is None else doubled_rows(steps)
    if not told:
        return record, ""
    doubt = f"{table.name}: {told}"
    return replace(record, notes=(*record.notes, doubt)), doubt


def _by_ours(record: Odometry, wheels: Wheels, read_as: Sequence[str]) -> Odometry:
    """A record of other conventions by ours, sample by sample; wheels that are not recorded are those of the motion.

    Turns and ways that are told beside wheels know nothing of which wheel is which: only their units are read.
    """
    if not read_as:
        return record
    base, rolled = wheels.wheel_base_m, record.wheels_m
    if rolled is None:
        if record.yaw_rad is None or base is None:
            raise InvalidInputError(f"{record.source}: no wheels to read as {' '.join(read_as)}, expected a wheel base")
        rolled = _wheels_of(record, base, read_as)

    def of_wheels(rolled: NDArray[np.float64], base: float | None, words: Sequence[str]) -> Odometry:
        log = DriveLog(np.diff(rolled, axis=0, prepend=0.0), np.array([[0.0, 0.0, 1.0]]), None).read_as(*words)
        if log.bearings[0, 2] != 1.0:
            raise InvalidInputError(f"{record.source}: read as {' '.join(words)}, expected words about the wheels")
        return Odometry.from_wheels(
            record.times_s, np.cumsum(log.odometry, axis=0), wheel_base_m=base, source=record.source,
            notes=record.notes, gap_max_s=record.gap_max_s,
        )  # fmt: skip

    ours = of_wheels(rolled, base, read_as)
    if record.wheels_m is None:
        return ours
    units = [word for word in read_as if word in _UNITS]
    told, derived = of_wheels(_wheels_of(record, 1.0, units), 1.0, units), of_wheels(rolled, base, ())
    if record.yaw_rad is not None and (derived.yaw_rad is None or not np.allclose(record.yaw_rad, derived.yaw_rad)):
        ours = replace(ours, yaw_rad=told.yaw_rad)
    return ours if np.allclose(record.distance_m, derived.distance_m) else replace(ours, distance_m=told.distance_m)


def _wheels_of(record: Odometry, base: float, read_as: Sequence[str]) -> NDArray[np.float64]:
    """(N, 2): how far wheels so far apart would have rolled."""
    # Turns that were told by themselves have no unit of length, and those of the wheels will be divided by it.
    per_metre = 1e3 ** list(read_as).count("millimetres")
    yaw = np.zeros(len(record.times_s)) if record.yaw_rad is None else record.yaw_rad
    aside = 0.5 * base * per_metre * yaw
    return np.stack([record.distance_m - aside, record.distance_m + aside], axis=1)


def _summed(motions: Sequence[Motion], turns_known: bool, source: str) -> Odometry:
    """Motions, one a second."""
    yaw = np.cumsum([motion.yaw_rad for motion in motions]) if turns_known else None
    wheels = [motion.wheels_m for motion in motions if motion.wheels_m is not None]
    return Odometry(
        np.arange(len(motions), dtype=np.float64), np.cumsum([motion.distance_m for motion in motions]), yaw,
        np.cumsum(wheels, axis=0) if len(wheels) == len(motions) else None, source,
    )  # fmt: skip


def _interpolated(frames: Frames, odometry: Odometry) -> FrameMotions:
    if frames.times_s is None or frames.names is None:
        raise InvalidInputError(f"{frames.source}: no times of the images, expected them for {odometry.source}")
    refuse_set_back(frames.times_s, frames.source)
    told, gaps = odometry.missing(frames.times_s, frames.names), odometry.gaps(frames.times_s)
    motions = odometry.motions(frames.times_s)
    if not any(motion is not None for motion in motions):
        first, last = frames.times_s[0], frames.times_s[-1]
        alone = odometry.at(frames.times_s).outside.all()
        expected = "clocks that agree" if alone else f"samples at most {odometry.gap_max_s:g} s apart"
        raise InvalidInputError(
            f"{told}: none is left of {frames.source}, from {first:.3f} to {last:.3f} s; expected {expected}"
        )
    turns = odometry.yaw_rad is not None
    notes = (*odometry.notes, None if turns else _no_turns(odometry.source), told, gaps, odometry.jumps)
    return FrameMotions(motions, turns, frames.times_s, tuple(note for note in notes if note is not None))


def _far_steps(motions: Sequence[Motion], names: Sequence[str], source: str) -> Iterator[str]:
    """Sentences about steps from image to image that no robot makes, as of other units, or of rows that are sums."""
    for what, most, unit, told in (
        ("yaw_rad", math.pi, "rad", "degrees"), ("distance_m", _FARTHEST_M, "m", "millimetres")
    ):  # fmt: skip
        far = [k for k, motion in enumerate(motions) if abs(getattr(motion, what)) > most]
        if far:
            steps = f"{counted(len(far), 'steps')} of more than {most:.3g} {unit}"
            first = f"the first to {names[far[0]]} by {getattr(motions[far[0]], what):.3g} {unit}"
            yield f"{source}: {steps}, {first}: are they in {told}, or summed up?"


def _no_turns(source: str) -> str:
    return f"{source}: distances without turns, which want the distance between the wheels (--wheel-base)"
