"""The answers of `tiltvp tilt` as files: tables, and attitudes over time for ROS and for programs that judge them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tiltvp.cli.results import Outcome, outcome_table
from tiltvp.cli.tables import ENDINGS, check_ending, write_table
from tiltvp.errors import InvalidInputError, TiltvpError, counted
from tiltvp.streams.frames import DEFAULT_RATE_HZ
from tiltvp.streams.outputs.tilts import TILT_ENDINGS, TILT_TOPIC, check_tilts, check_times, write_tilts

if TYPE_CHECKING:
    from tiltvp.streams import Frames

__all__ = ["check_answers", "check_stamps", "write_answers"]


def check_answers(path: Path) -> None:
    """Refuses a file of answers that cannot be written in its format, before any work is done."""
    ending = path.suffix.lower()
    if ending not in (*ENDINGS, *TILT_ENDINGS):
        known = ", ".join((*ENDINGS, *TILT_ENDINGS))
        raise InvalidInputError(f"--out {path}: ends in {path.suffix!r}, expected one of {known}")
    if ending in ENDINGS:
        check_ending(path)
        return
    try:
        check_tilts(path)
    except TiltvpError as error:
        raise type(error)(f"--out {error}") from None


def check_stamps(path: Path | None, frames: Frames, frame_rate: float | None) -> None:
    """Refuses times of frames that attitudes cannot have, before any work is done."""
    if path is None or path.suffix.lower() not in TILT_ENDINGS or frame_rate is not None or frames.times_s is None:
        return
    try:
        check_times(frames.times_s)
    except InvalidInputError as error:
        raise InvalidInputError(f"--out {path}: {error}, or --frame-rate") from None


def write_answers(outcomes: Sequence[Outcome], method: str, path: Path, frame_rate: float | None) -> str | None:
    """Writes the answers, the ending says how. A line of what a file of attitudes has and lacks; None of tables.

    Attitudes are those of the filter where there is one, else the estimates that were accepted. `frame_rate` is how
    many frames there are in a second, None for the times that they tell themselves.
    """
    if path.suffix.lower() in ENDINGS:
        write_table(outcome_table(outcomes, method), path)
        return None
    is_filtered = any(outcome.filtered is not None for outcome in outcomes)
    tilts = [
        outcome.filtered if is_filtered else None if outcome.accepted is False else outcome.estimate
        for outcome in outcomes
    ]
    known = [outcome.taken_s for outcome in outcomes if outcome.taken_s is not None]
    if frame_rate is None and len(known) == len(outcomes):
        times, clock = known, "at the frames' own times"
    else:
        rate_hz = frame_rate or DEFAULT_RATE_HZ
        times = [number / rate_hz for number in range(len(outcomes))]
        clock = f"at {rate_hz:g} frames a second from 0"
        clock += "" if frame_rate else ", as not all tell a time: --frame-rate"
    count = write_tilts(path, times, tilts)
    what = counted(count, "filtered tilts" if is_filtered else "tilts")
    where = f" as sensor_msgs/Imu on {TILT_TOPIC}" if path.suffix.lower() == ".mcap" else ""
    lacking = len(outcomes) - count
    left_out = f"; {counted(lacking, 'frames')} without one left out" if lacking else ""
    return f"{path}: {what}{where}, yaw 0, {clock}{left_out}"
