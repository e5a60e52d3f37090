"""Lines matched between frames that are metres apart: how many of the possible matches are right, how many false."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp.lab.evaluation.line_pairs import FALSE, RIGHT, pair_verdicts
from tiltvp.lab.evaluation.line_truth import wrapped
from tiltvp.lines import match, match_wide

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.lab.datasets.driven import DrivenFrames
    from tiltvp.lines import Lines

__all__ = ["WIDE_MATCHERS", "metres_apart", "wide_rows"]

WIDE_MATCHERS: Final = ("match (eqs. 8 to 10)", "match_wide", "match_wide, motion told")
"""What is compared: the paper's rules, the profiles, and those with the direction of motion to 2 degrees."""

_BASELINES_M: Final = (1.0, 1.25, 1.5, 1.75)
"""The least distance of the next pairs' second frames, one after the other."""
_WITHIN: Final = 200
"""How many frames the second one may be behind the first."""
_EVERY: Final = 10
"""From the first frame of a pair to that of the next."""
_TOLD_SIGMA_RAD: Final = math.radians(2.0)
"""How far off a told direction of motion is: wheels over two metres are better."""


def metres_apart(poses: NDArray[np.float64]) -> Iterator[tuple[int, int]]:
    """Pairs of frames 1 to 2 m apart, of true poses (N, 3): every tenth frame and the first far enough behind it."""
    for a, least in zip(range(0, len(poses), _EVERY), cycle(_BASELINES_M), strict=False):
        away = np.hypot(*(poses[a : a + _WITHIN, :2] - poses[a, :2]).T)
        far = np.flatnonzero(away >= least)
        if len(far) and away[far[0]] <= 2.0:
            yield a, a + int(far[0])


def _ahead(poses: NDArray[np.float64], a: int, b: int) -> NDArray[np.float64]:
    """(2,): the bearing of the way from a frame to another, as the one and the other see it."""
    x, y = poses[b, :2] - poses[a, :2]
    return wrapped(math.atan2(y, x) - poses[[a, b], 2])


def wide_rows(
    drive: DrivenFrames,
    lines: Sequence[Lines],
    edges: Sequence[tuple[frozenset[int], ...]],
    areas: Sequence[NDArray[np.float32]],
    profiles: Sequence[NDArray[np.float32]],
    seed: int,
) -> list[dict[str, Any]]:
    """A row for each pair of frames and each of `WIDE_MATCHERS`: matcher, possible, right, false.

    `possible` are lines of the first frame whose edge has a line in the second. Everything is a list over frames:
    lines, their edges, the descriptors of areas and the profiles. `seed` is that of the errors of told motions. The
    camera is taken to be where the robot is.
    """
    rows: list[dict[str, Any]] = []
    for a, b in metres_apart(drive.poses):
        verdicts = pair_verdicts(edges[a], edges[b], lines[b].bearing_rad, drive.truths[b])
        known = np.array([bool(edge) for edge in edges[a]], dtype=bool)
        if not len(lines[a]) or not len(lines[b]):
            continue
        possible = int((verdicts == RIGHT).any(axis=1).sum())
        noise = np.random.default_rng((seed, a, b)).normal(0.0, _TOLD_SIGMA_RAD, 2)
        pair = (lines[a], profiles[a], lines[b], profiles[b])
        found = (
            match(areas[a], areas[b]),
            match_wide(*pair)[0],
            match_wide(*pair, ahead_rad=_ahead(drive.poses, a, b) + noise)[0],
        )
        for matcher, pairs in zip(WIDE_MATCHERS, found, strict=True):
            judged = verdicts[pairs[:, 0], pairs[:, 1]][known[pairs[:, 0]]]
            counts = {"right": int((judged == RIGHT).sum()), "false": int((judged == FALSE).sum())}
            rows.append({"matcher": matcher, "pairs": 1, "possible": possible} | counts)
    return rows
