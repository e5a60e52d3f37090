"""How a robot turned as the lines of its images tell without its odometry, beside what the odometry says."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp._core import match_descriptors, misreading_clause
from tiltvp.arguments import each_from
from tiltvp.errors import counted

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.line_logs import SeenFrame

    Table = NDArray[np.float64]

__all__ = ["LineTurns", "line_turns"]

_MATCHES_MIN: Final = 5
"""Lines of two frames that tell a turn: the median of five stands two wrong matches."""
_FEWEST: Final = 3
"""Lines that tell whether a turn has begun. With five an office whose images came a frame late was sure and wrong."""
_STRETCHES: Final = 200
"""Into so many a drive is cut at most. Turns from frame to frame err by 0.2 degrees, which is more than a robot turns
between many of them."""
_TURNED_RAD: Final = math.radians(45.0)
"""How far a robot has to turn in all, left and right, before there is an answer."""
_CLEARLY: Final = 3.0
"""How many times nearer to the turns of the lines than as told another reading has to be. Of 16 rendered drives those
that were misread are told by 4.7 and more; of drives as told no other reading is any nearer."""
_OTHER_FACTOR: Final = 0.1
"""By how much more or less than told lines have to turn in all to be followed by that: less is made up by what they
agree on."""
_LATE_FRAMES: Final = 3
"""Most frames that images are looked for to be late by."""
_CHANGE_RAD: Final = math.radians(1.0)
"""Frames at which turns would be others by less tell no lateness."""
_LATE_RAD: Final = math.radians(3.0)
"""Least sum of differences that go if images are late: a turn of 3 degrees a frame that begins."""
_MISSED_MAX: Final = 0.5
"""Share of the turns of the lines that a reading may miss: those of the 16 miss 0.06 to 0.25, and with another error
beside, as of a wheel base that is 30 % off, up to 0.5."""


@dataclass(frozen=True)
class LineTurns:
    """Turns that lines tell beside those that the odometry tells, and how that is read to be like them."""

    stretches: int
    """Parts of the drive that were compared."""
    turned_rad: float
    """How far the robot turned in all, left and right, by the lines."""
    missed_rad: dict[str, float]
    """Sum of the differences between the two: for the odometry as told, "", and by each other reading, as
    `LogCalibration.misreading` names them."""
    late_frames: int = 0
    """By how many frames the images are later than the odometry, where turns that begin and end tell that; earlier if
    negative."""
    turn_factor: float = 1.0
    """How many times as far as told the lines turn, where most do so by at least a tenth more or less, as with another
    wheel base."""

    @property
    def misreading(self) -> str | None:
        """How the odometry was meant where lines turn otherwise than it tells; None if they do not or nothing tells."""
        if self.turned_rad < _TURNED_RAD:
            return None
        best = min(self.missed_rad, key=lambda name: self.missed_rad[name])
        missed, as_told = self.missed_rad[best], self.missed_rad[""]
        is_meant = missed * _CLEARLY < as_told and missed < _MISSED_MAX * self.turned_rad
        return best if is_meant else None

    @property
    def reason(self) -> str:
        """What is wrong with the odometry, in a sentence; empty where nothing is."""
        if self.misreading is None and self.late_frames:
            way = "later" if self.late_frames > 0 else "earlier"
            frames = counted(abs(self.late_frames), "frames")
            remedy = "mend the times, as by frame_delay or --estimate-time-offset"
            return f"lines turn {frames} {way} than the odometry tells: {remedy}"
        if self.misreading is None:
            return ""
        turned, as_told, missed = (
            math.degrees(angle) for angle in (self.turned_rad, self.missed_rad[""], self.missed_rad[self.misreading])
        )
        mirrored = ", or the image mirrored" if self.misreading == "reflected" else ""
        return (
            f"lines turn {turned:.0f} degrees in all, from which the odometry differs by {as_told:.0f}, and by "
            f"{missed:.0f} if read otherwise: {misreading_clause(self.misreading)}{mirrored}"
        )


def line_turns(seen: Sequence[SeenFrame]) -> LineTurns:
    """Holds the turns by which lines of successive frames are alike against those of the odometry.

    Lines are matched by their descriptors alone. Where frames tell no distances, readings that need them are not tried.
    """
    seen = each_from(seen, "seen", "turn_rad", "SeenFrame")
    known = len(seen) > 1 and all(one.turn_rad is not None for one in seen)
    if not known:
        return LineTurns(0, 0.0, {"": 0.0})
    any_turned, matches = np.array([_turn(before, now) for before, now in pairwise(seen)]).T
    turned = np.where(matches < _MATCHES_MIN, np.nan, any_turned)
    stretch = np.arange(len(turned)) * min(_STRETCHES, len(turned)) // len(turned)

    def summed(values: Table) -> Table:
        return np.bincount(stretch, values).astype(np.float64)

    by_lines = summed(turned)
    told = np.isfinite(by_lines)
    by_lines = by_lines[told]

    def missed(turns: Table) -> float:
        # A stretch that is all wrong counts no more than one that is off by a radian.
        return float(np.minimum(np.abs(summed(turns[1:])[told] - by_lines), 1.0).sum())

    turns = np.array([one.turn_rad for one in seen])
    readings = {"": turns, "reflected": -turns, "millimetres": 1e-3 * turns, "cumulative": np.diff(turns, prepend=0.0)}
    if all(one.distance_m is not None for one in seen):
        # With one wheel negated the way that is told is the turn times half the wheel base.
        ways = np.array([one.distance_m for one in seen])
        per_metre = _weighted_median(by_lines, summed(ways[1:])[told])
        readings["left wheel negated" if per_metre > 0.0 else "right wheel negated"] = per_metre * ways
    differences = {name: missed(values) for name, values in readings.items()}
    late, factor = _late(any_turned, turns[1:]), _factor(by_lines, summed(turns[1:])[told])
    return LineTurns(int(told.sum()), float(np.abs(by_lines).sum()), differences, late, factor)


def _late(by_lines: Table, told: Table) -> int:
    """By how many frames turns by lines (N,) are later than those that were told (N,); 0 where that is not clear.

    Told are only frames at which turns would be others by more than they err: a slip is wrong at two of these, by one
    way or the other.
    """
    found, gained = 0, _LATE_RAD
    for late in (*range(-_LATE_FRAMES, 0), *range(1, _LATE_FRAMES + 1)):
        shifted = np.full_like(told, np.nan)
        if late > 0:
            shifted[late:] = told[:-late]
        else:
            shifted[:late] = told[-late:]
        change = np.isfinite(by_lines) & (np.abs(shifted - told) > _CHANGE_RAD)
        as_told, otherwise = (float(np.abs(by_lines - x)[change].sum()) for x in (told, shifted))
        if as_told - otherwise > gained and _CLEARLY * otherwise < as_told:
            found, gained = late, as_told - otherwise
    return found


def _factor(by_lines: Table, told: Table) -> float:
    """How many times as far as told (N,) lines turn (N,); 1 where it is about that, they turn little, or not half of
    them agree."""
    if np.abs(by_lines).sum() < _TURNED_RAD:
        return 1.0
    factor = _weighted_median(by_lines, told)
    agree = np.abs(by_lines - factor * told) < _OTHER_FACTOR * np.abs(factor * told)
    is_other = abs(factor - 1.0) > _OTHER_FACTOR and 2.0 * np.abs(told[agree]).sum() > np.abs(told).sum()
    return factor if is_other else 1.0


def _turn(before: SeenFrame, now: SeenFrame) -> tuple[float, int]:
    """How far the robot turned to the left between two frames, radians, by how many lines; NaN by too few."""
    pairs = match_descriptors(before.descriptors, now.descriptors)
    if len(pairs) < _FEWEST:
        return math.nan, len(pairs)
    moved = before.lines.bearing_rad[pairs[:, 0]] - now.lines.bearing_rad[pairs[:, 1]]
    # The median of angles: that from which all are the least away.
    away = np.abs(np.remainder(moved[:, None] - moved + math.pi, math.tau) - math.pi)
    middle = float(moved[int(np.argmin(away.sum(axis=0)))])
    return math.remainder(middle, math.tau), len(pairs)


def _weighted_median(values: Table, per: Table) -> float:
    """The x for which the sum of |values - x per| is least; 0 where there is none."""
    kept = per != 0.0
    ratios, weights = values[kept] / per[kept], np.abs(per[kept])
    if not len(ratios):
        return 0.0
    order = np.argsort(ratios, kind="stable")
    half = np.searchsorted(np.cumsum(weights[order]), 0.5 * weights.sum())
    return float(ratios[order[min(int(half), len(order) - 1)]])
