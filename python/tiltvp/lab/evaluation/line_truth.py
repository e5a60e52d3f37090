"""Which true edge a line is, and whether a tracker is right about it (Scaramuzza et al. 2009, section 9.1)."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp._core import Lines, TrackedLines
    from tiltvp.synth import Drive, DriveTruth

__all__ = ["Identities", "Judge", "Verdicts", "edge_bearings", "identities"]

TOLERANCE_RAD: Final = math.radians(0.6)
"""How far a line may be from the true edge that it is taken for."""
_AS_NEAR_RAD: Final = math.radians(0.1)
"""Edges that are farther than the nearest by no more than this may be the line as well."""
PIXEL_RAD: Final = math.radians(0.3)
"""One pixel of `mirror_camera` in the mean over a line's elevations (0.25 degrees at its top, 0.4 at the horizon).

An edge is about two pixels wide in a smoothed gradient: edges this close are one line, which is either's."""
APART_RAD: Final = math.radians(1.5)
"""A line on no true edge that is this far from where an edge stands is not that edge, whatever else it may be."""
_CONTRAST_MIN: Final = 0.02
"""Fainter edges drown in noise: no line is taken for one."""


@dataclass(frozen=True, eq=False)
class Identities:
    """Which edges the lines of a frame may be."""

    edges: tuple[frozenset[int], ...]
    """(N,): the numbers of the nearest true edge and of those as near; empty for lines on no true edge."""
    error_rad: NDArray[np.float64]
    """(N,): bearing minus that of the nearest true edge; NaN for lines on none."""
    due: int
    """How many true edges of that frame the extractor is meant to find."""
    found: int
    """How many of them have a line."""


def identities(lines: Lines, truth: DriveTruth, *, length_min_rad: float, contrast_min: float = 0.1) -> Identities:
    """The true edges of lines, by bearing where elevations overlap; silhouettes, shadows and mirror images are none.

    Edges of `contrast_min` that are in sight over `length_min_rad` of elevation are `due`.
    """
    clear = truth.contrast >= _CONTRAST_MIN
    low, high = truth.elevations_rad[:, 0], truth.elevations_rad[:, 1]
    apart = wrapped(lines.bearing_rad[:, None] - truth.bearings_rad)
    overlap = np.minimum(lines.elevation_max_rad[:, None], high) - np.maximum(lines.elevation_min_rad[:, None], low)
    distance = np.where((overlap > 0.0) & clear, np.abs(apart), np.inf)
    n = len(lines)
    error = np.full(n, np.nan)
    edges: list[frozenset[int]] = [frozenset()] * n
    if distance.shape[1]:
        nearest = distance.argmin(axis=1)
        least = distance[np.arange(n), nearest]
        known = least <= TOLERANCE_RAD
        error[known] = apart[np.arange(n), nearest][known]
        for i in np.flatnonzero(known):
            edges[i] = frozenset(truth.edges[distance[i] <= least[i] + _AS_NEAR_RAD].tolist())
    due = (truth.contrast >= contrast_min) & (high - low >= length_min_rad)
    found = due & (distance <= TOLERANCE_RAD).any(axis=0) if n else np.zeros_like(due)
    return Identities(tuple(edges), error, int(due.sum()), int(found.sum()))


def edge_bearings(drive: Drive, frame: int) -> NDArray[np.float64]:
    """(E,): azimuth of every upright edge of the room from a frame, in sight or not, in the levelled robot's frame."""
    x_m, y_m, yaw_rad = drive.poses[frame]
    ahead_m, left_m = drive.mount[:2]
    center_x = x_m + math.cos(yaw_rad) * ahead_m - math.sin(yaw_rad) * left_m
    center_y = y_m + math.sin(yaw_rad) * ahead_m + math.cos(yaw_rad) * left_m
    edges = drive.edges_m
    return wrapped(np.arctan2(edges[:, 1] - center_y, edges[:, 0] - center_x) - yaw_rad)


@dataclass(frozen=True)
class Verdicts:
    """What became of the lines of a frame that have been seen before, or that a tracker says have been."""

    correct: int = 0
    """Continued on the track of the same edge."""
    false_matches: int = 0
    """Continued on the track of another edge."""
    false_new: int = 0
    """New tracks on edges that have been followed within the tracker's memory, and that no other line continues."""
    unknown: int = 0
    """Continued where the truth does not tell: a line of the pair is on no true edge, or they are a pixel apart."""


@dataclass(frozen=True)
class _Seen:
    """A frame that the judge remembers."""

    bearings_rad: NDArray[np.float64]
    edges: tuple[frozenset[int], ...]
    all_bearings_rad: NDArray[np.float64]
    """(E,): of every edge of the room."""
    places: dict[int, int]
    """Which line each track has."""


@dataclass
class Judge:
    """Holds a tracker's answers against the truth, frame by frame."""

    look_back: int
    """How many frames the tracker looks back."""
    _frames: deque[_Seen] = field(default_factory=deque)

    def __call__(self, tracked: TrackedLines, known: Identities, all_bearings_rad: NDArray[np.float64]) -> Verdicts:
        """The verdicts on the next frame. Its edges are `known`, and every edge of the room has a bearing there."""
        tracks, back = tracked.track.tolist(), tracked.frames_back.tolist()
        bearings = tracked.lines.bearing_rad
        now = _Seen(bearings, known.edges, all_bearings_rad, {track: i for i, track in enumerate(tracks)})
        counts = dict.fromkeys(("correct", "false_matches", "false_new", "unknown"), 0)
        for i, track in enumerate(tracks):
            if back[i] > 0:
                before = self._frames[-back[i]]
                counts[_pair(now, i, before, before.places[track])] += 1
            elif known.edges[i] and self._followed(known.edges[i], now.places):
                counts["false_new"] += 1
        self._frames.append(now)
        if len(self._frames) > self.look_back:
            self._frames.popleft()
        return Verdicts(**counts)

    def _followed(self, edges: frozenset[int], continued: dict[int, int]) -> bool:
        """Whether a line on one of these edges is remembered whose track no line of the frame continues."""
        return any(
            not edges.isdisjoint(frame.edges[place]) and track not in continued
            for frame in self._frames
            for track, place in frame.places.items()
        )


def _pair(now: _Seen, i: int, before: _Seen, j: int) -> str:
    here, there = now.edges[i], before.edges[j]
    if not here.isdisjoint(there):
        return "correct"
    least = PIXEL_RAD if here and there else APART_RAD
    away = [_all_apart(*place, least) for place in ((before, j, here), (now, i, there)) if place[2]]
    if here and there:
        return "false_matches" if all(away) else "unknown"
    return "false_matches" if any(away) else "unknown"


def _all_apart(frame: _Seen, line: int, edges: frozenset[int], least_rad: float) -> bool:
    """Whether the line of a frame is at least so far from where these edges stand."""
    apart = wrapped(frame.all_bearings_rad[list(edges)] - frame.bearings_rad[line])
    return bool((np.abs(apart) > least_rad).all())


def wrapped(angle_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles in [-pi, pi)."""
    return np.asarray((angle_rad + np.pi) % (2.0 * np.pi) - np.pi, dtype=np.float64)
