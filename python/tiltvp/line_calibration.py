"""Where a camera sits on a robot, from the lines of a drive's images: which line is which, and the mounting, in turns.

Tracks are predicted from where the camera is thought to be. From a wrong place near lines are lost where the robot
turns, or taken for their neighbours, and what is left says that the camera is nearer to that place than it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp.arguments import each_from, refuse_uncallable, shaped_from
from tiltvp.errors import InvalidInputError
from tiltvp.line_logs import FollowedFrame, SeenFrame, bearing_log
from tiltvp.line_turns import LineTurns, line_turns
from tiltvp.lines import LineTracker

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.selfcalib import LogCalibration

    Place = tuple[float, float, float]

__all__ = ["LineCalibration", "calibrate_lines", "place_of_longest_tracks"]

_MOVED: Final = (0.1, 0.05)
"""Radians and metres, of which the robot moves at least one between frames on which a place is judged: by less no place
of the camera is told from another. A frame of the recordings that we render, at 5 a second, is as far from the next."""
_FRAMES: Final = 30
"""On which a place is judged: the robot turns by at least 3 radians in them, or drives 1.5 m."""
_LOOK_BACK: Final = 3
"""Frames for which a lost line is remembered there: the time of a search grows with the square of it."""
_STEPS_M: Final = (0.1, 0.05, 0.025)
"""Of the search. Within 0.05 m of the truth a rendered office has 67 to 125 tracks, and 300 elsewhere; from 0.025 m
away tracks and mounting settle in two rounds."""
_REACH: Final = 3
"""Steps to each side of the start that are looked at at first: cameras are on the robots that they look from. The
search goes on beyond where tracks grow longer there."""
_PARTS: Final = 8
"""Of the lines, each of which is left out in turn. Of 36 rendered drives ahead that are relied upon without it the NEES
of x, y and yaw (3 asked) is 12.7 in the mean and beyond chance in four, with it 2.5 and in none; with 16 parts 2.4."""
_FARTHEST_M: Final = 10.0
"""From the robot's middle that lines are followed from; a mounting beyond is none."""
_ROUNDS: Final = 5
"""Most rounds: those of 12 rendered drives settled in 2 or 3, from a start 0.1 m off in up to 5."""


@dataclass(frozen=True, eq=False)
class LineCalibration:
    """Tracks and mounting that belong together."""

    frames: Sequence[FollowedFrame]
    """The lines, and whose they are."""
    bearings: NDArray[np.float64]
    """(M, 3): number of the frame, track, bearing in radians, as of `bearing_log`."""
    whole: LogCalibration
    """The mounting from that log."""
    settled: bool
    """Whether tracks followed from this mounting lead to it again, within its standard deviations."""
    turns: LineTurns
    """Whether lines turn as the odometry says. Where they do not, nothing is looked for in turns."""

    @property
    def misreading(self) -> str | None:
        """How the odometry was meant, by the turns of the lines or the whole log: see `LogCalibration.misreading`."""
        return self.turns.misreading or self.whole.misreading

    @property
    def doubt(self) -> str:
        """Why it cannot be relied upon, though the log may fit; empty where nothing speaks against it."""
        if self.turns.reason:
            return self.turns.reason
        if not self.settled:
            return "which line is which does not settle with the mounting"
        return ""


def calibrate_lines(
    seen: Sequence[SeenFrame],
    solve: Callable[..., LogCalibration],
    *,
    start: Place = (0.0, 0.0, 0.0),
    frames_min: int = 3,
) -> LineCalibration:
    """Follows the lines of a drive and finds the mounting, until the one does not change the other any more.

    `solve` makes the mounting of bearings (M, 3) in the frame of the lines, with options of `tiltvp.calibrate` by
    keyword; `start` is x, y in metres and yaw in radians, as far as they are known; lines that are seen in `frames_min`
    frames count. The image centre is estimated too where lines are seen all round the camera. The covariance is no less
    than what leaving out lines in turn tells. Raises `InvalidInputError` if there are none, and what `solve` raises.
    """
    refuse_uncallable(solve, "solve", "what makes a LogCalibration of bearings")

    def solved(bearings: NDArray[np.float64], **options: Any) -> LogCalibration:
        return solve(bearings, estimate_centre=_are_all_round(bearings[:, 2]), **options)

    turns = line_turns(seen)
    if turns.misreading is not None:
        return replace(_in_turns(seen, solved, start, frames_min, turns, rounds=1), settled=False)
    # With another wheel base lines turn elsewhere than they are looked for.
    seen = [one if one.turn_rad is None else replace(one, turn_rad=turns.turn_factor * one.turn_rad) for one in seen]
    found = _in_turns(seen, solved, start, frames_min, turns)
    return replace(found, whole=solved(found.bearings, jackknife_parts=_PARTS))


def _are_all_round(bearings_rad: NDArray[np.float64]) -> bool:
    """Whether no quarter of the circle is without bearings: of a part of it another centre is as another yaw."""
    ascending = np.sort(bearings_rad % math.tau)
    return bool(np.diff(ascending, append=ascending[0] + math.tau).max() < math.pi / 2.0)


def _in_turns(
    seen: Sequence[SeenFrame],
    solve: Callable[..., LogCalibration],
    start: Place,
    frames_min: int,
    turns: LineTurns,
    rounds: int = _ROUNDS,
) -> LineCalibration:
    """Lines followed from the mounting that they tell, until that does not change any more."""
    (x, y), yaw, before = place_of_longest_tracks(seen, start), start[2], None
    for _ in range(rounds):
        tracker = LineTracker(camera_m=(x, y), camera_yaw_rad=yaw)
        frames = [one.followed(tracker) for one in seen]
        bearings = bearing_log(frames, frames_min=frames_min)
        if not len(bearings):
            raise InvalidInputError(f"no line is seen in {frames_min} of {len(seen)} frames")
        if before is not None and np.array_equal(bearings, before.bearings):
            return LineCalibration(frames, bearings, before.whole, True, turns)
        found = LineCalibration(frames, bearings, solve(bearings), False, turns)
        if before is not None and _agree(before.whole, found.whole):
            return LineCalibration(frames, bearings, found.whole, True, turns)
        before, mounting = found, found.whole.mounting
        x, y, yaw = mounting.x_m, mounting.y_m, mounting.yaw_rad
        if not math.hypot(x, y) < _FARTHEST_M:
            break
    assert before is not None  # There is a round.
    return before


def place_of_longest_tracks(seen: Sequence[SeenFrame], start: Place) -> tuple[float, float]:
    """x and y of the camera, metres, from which the fewest tracks explain the lines, to a few centimetres.

    Looks at the stretch in which the robot both turns and drives most: a turn alone does not tell how far away lines
    are. The start where there is none.
    """
    shaped_from(start, "start", 3)
    seen = _apart(each_from(seen, "seen", "turn_rad", "SeenFrame"))
    turn, way = np.abs([(one.turn_rad or 0.0, one.distance_m or 0.0) for one in seen]).reshape(-1, 2).T
    count = min(_FRAMES, len(seen))
    if not count:
        return start[0], start[1]
    both = np.convolve(turn, np.ones(count), "valid") * np.convolve(way, np.ones(count), "valid")
    if not both.max() > 0.0:
        return start[0], start[1]
    first = int(np.argmax(both))
    window = seen[first : first + count]
    fine, known = _STEPS_M[-1], dict[tuple[int, int], int]()

    def at(i: int, j: int) -> tuple[float, float]:
        return start[0] + fine * i, start[1] + fine * j

    def best(middle: tuple[int, int], step_m: float, reach: int) -> tuple[int, int]:
        """Of a square of places that with the fewest tracks, of equal ones that nearest to the start."""
        stride = round(step_m / fine)
        offsets = range(-reach * stride, reach * stride + 1, stride)
        places = [(middle[0] + i, middle[1] + j) for i in offsets for j in offsets]
        for place in places:
            if place not in known:
                tracker = LineTracker(camera_m=at(*place), camera_yaw_rad=start[2], look_back=_LOOK_BACK)
                for one in window:
                    one.followed(tracker)
                known[place] = tracker.track_count
        return min(places, key=lambda place: (known[place], place[0] ** 2 + place[1] ** 2, place))

    middle = best((0, 0), _STEPS_M[0], _REACH)
    for step_m in _STEPS_M:
        while (nearer := best(middle, step_m, 1)) != middle:
            middle = nearer
    return at(*middle)


def _apart(seen: Sequence[SeenFrame]) -> list[SeenFrame]:
    """Frames between which the robot moves so far that a place can be told."""
    kept: list[SeenFrame] = []
    turn_rad, distance_m = 0.0, 0.0
    for one in seen:
        turn_rad += one.turn_rad or 0.0
        distance_m += one.distance_m or 0.0
        if not kept or abs(turn_rad) >= _MOVED[0] or abs(distance_m) >= _MOVED[1]:
            kept.append(replace(one, turn_rad=turn_rad, distance_m=distance_m))
            turn_rad, distance_m = 0.0, 0.0
    return kept


def _agree(before: LogCalibration, now: LogCalibration) -> bool:
    """Whether two mountings are within one standard deviation of each other."""
    a, b = before.mounting, now.mounting
    turned = math.remainder(b.yaw_rad - a.yaw_rad, math.tau)
    off = np.array([b.x_m - a.x_m, b.y_m - a.y_m, turned])
    try:
        return float(off @ np.linalg.solve(b.covariance_xy_yaw, off)) < 1.0
    except np.linalg.LinAlgError:
        return False
