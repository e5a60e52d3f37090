"""Pairs of frames of a drive, and which lines of the one are which of the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from tiltvp.lab.evaluation.line_truth import APART_RAD, PIXEL_RAD, wrapped

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.lab.datasets.driven import DrivenFrames
    from tiltvp.synth import DriveTruth

__all__ = ["FALSE", "OPEN", "RIGHT", "FramePair", "frame_pairs", "pair_verdicts"]

OPEN: Final = 0
"""The truth does not tell."""
FALSE: Final = 1
RIGHT: Final = 2


class _Bearings(Protocol):
    """Lines of a frame."""

    @property
    def bearing_rad(self) -> NDArray[np.float64]: ...


class _Which(Protocol):
    """Which frames are compared: `DescriptorExperiment` is such."""

    @property
    def frames_apart(self) -> tuple[int, ...]: ...
    @property
    def every(self) -> int: ...
    @property
    def baseline_max_m(self) -> float: ...


@dataclass(frozen=True, eq=False)
class FramePair:
    """Two frames of a drive. L is the number of the first one's lines on true edges, N and M that of all lines."""

    a: int
    b: int
    baseline_m: float
    lines: NDArray[np.int64]
    """(L,): lines of the first frame that are on true edges."""
    verdicts: NDArray[np.int8]
    """(N, M): what it would be to match a line of the first frame with one of the second: OPEN, FALSE or RIGHT."""
    findable: NDArray[np.bool_]
    """(L,): whether the second frame has a line on the same edge."""


def frame_pairs(
    drive: DrivenFrames,
    edges: Sequence[Sequence[frozenset[int]]],
    lines: Sequence[_Bearings],
    which: _Which,
) -> list[FramePair]:
    """The pairs of frames that `which` asks for, of which both have lines.

    `edges` are those of `Identities` for each frame's `lines`.
    """
    pairs: list[FramePair] = []
    for apart in which.frames_apart:
        for a in range(0, len(drive) - apart, which.every):
            b = a + apart
            baseline = float(np.hypot(*(drive.poses[b, :2] - drive.poses[a, :2])))
            if baseline > which.baseline_max_m or not edges[a] or not edges[b]:
                continue
            verdicts = pair_verdicts(edges[a], edges[b], lines[b].bearing_rad, drive.truths[b])
            known = np.flatnonzero([bool(edge) for edge in edges[a]])
            pairs.append(FramePair(a, b, baseline, known, verdicts, (verdicts[known] == RIGHT).any(axis=1)))
    return pairs


def pair_verdicts(
    a: Sequence[frozenset[int]],
    b: Sequence[frozenset[int]],
    bearing_rad: NDArray[np.float64],
    truth: DriveTruth,
) -> NDArray[np.int8]:
    """(N, M): what it would be to match each line of a frame `a` with each of a frame `b`.

    `a` and `b` are the edges that lines may be (`Identities`), `bearing_rad` (M,) and `truth` those of frame `b`. OPEN
    is a line of `b` near the edge but taken for another, or, up to 1.5 degrees from it, for none.
    """
    limits = np.where([bool(other) for other in b], PIXEL_RAD, APART_RAD)
    verdicts = np.full((len(a), len(b)), FALSE, dtype=np.int8)
    for i, edges in enumerate(a):
        places = truth.bearings_rad[np.isin(truth.edges, list(edges))]
        if len(places):
            near = np.abs(wrapped(bearing_rad[:, None] - places)).min(axis=1) <= limits
            verdicts[i, near] = OPEN
        verdicts[i, [not edges.isdisjoint(other) for other in b]] = RIGHT
    return verdicts
