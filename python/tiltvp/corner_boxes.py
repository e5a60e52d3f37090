"""Cuboids of which corners are seen: corners that share edges, joined, with the sizes that visible edges tell."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.arguments import each_from

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp._core import BelievedCorner

__all__ = ["CornerBox", "join_boxes"]

_PARALLEL: Final = math.cos(math.radians(5.0))
"""Edges of one box are parallel: within 5 degrees, a little more than corners of one image may differ (4)."""

_SIGMAS: Final = 4.0
_SHARE: Final = 0.03
"""How far two lengths of one edge may differ: by four standard deviations, and 3 %, as edges are rounded and worn."""


@dataclass(frozen=True, eq=False)
class CornerBox:
    """A cuboid, as the corners of it that are seen tell it."""

    corners: tuple[int, ...]
    """Which of the corners given are its own; the first is `vertex_m`."""
    vertex_m: NDArray[np.float64]
    """(3,): the vertex of the first, left camera's frame, metres."""
    edges: NDArray[np.float64]
    """(3, 3): the directions of the edges x, y, z of the first in rows."""
    sizes_m: NDArray[np.float64]
    """(3,): how long the box is along them, metres; NaN where no edge along it is seen from end to end."""
    size_sigmas_m: NDArray[np.float64]
    """(3,): the standard deviations of the sizes, metres: each is that of the one edge that is known best, as the
    errors of a box' edges have much in common."""


def join_boxes(corners: Sequence[BelievedCorner]) -> list[CornerBox]:
    """The cuboids of one frame's believed corners (`CornerEstimate.corners`), those of most corners first.

    Two corners are of one cuboid if the one lies where an edge of the other ends, as far as that end is seen, and their
    edges are parallel, the shared one the other way round. A corner alone is a cuboid if all three of its edges are
    seen up to their ends. Whether it is full or hollow is not asked: a room is one too. Corners without a place, and
    those whose edges are not at right angles, are of none.
    """
    corners = each_from(corners, "corners", "pose", "BelievedCorner")
    usable = [place for place, corner in enumerate(corners) if _is_right(corner)]
    groups: dict[int, set[int]] = {place: {place} for place in usable}
    for a in usable:
        for b in usable:
            if b > a and groups[a] is not groups[b] and _shared(corners[a], corners[b]) is not None:
                both = groups[a] | groups[b]
                groups.update(dict.fromkeys(both, both))
    boxes = []
    for place in usable:
        members = sorted(groups[place])
        if members[0] == place:
            sizes, sigmas = _sizes([corners[member] for member in members])
            if len(members) > 1 or np.isfinite(sizes).all():
                pose = corners[place].pose
                assert pose.vertex_m is not None
                boxes.append(CornerBox(tuple(members), pose.vertex_m, pose.edges, sizes, sigmas))
    return sorted(boxes, key=lambda box: -len(box.corners))


def _is_right(corner: BelievedCorner) -> bool:
    edges = corner.pose.edges
    return corner.pose.vertex_m is not None and bool(np.abs(edges @ edges.T - np.eye(3)).max() < 1.0 - _PARALLEL)


def _alike(a: float, sigma_a: float, b: float, sigma_b: float) -> bool:
    return abs(a - b) <= _SIGMAS * math.hypot(sigma_a, sigma_b) + _SHARE * max(a, b)


def _shared(a: BelievedCorner, b: BelievedCorner) -> tuple[int, float, float] | None:
    """The edge of the first that both share, its length and the standard deviation of that; None if there is none.

    At least one of them has to show where it ends: what merely stands in line is not joined.
    """
    assert a.pose.vertex_m is not None
    assert b.pose.vertex_m is not None
    away = b.pose.vertex_m - a.pose.vertex_m
    length = float(np.linalg.norm(away))
    cosines = a.pose.edges @ b.pose.edges.T
    order = np.argmax(np.abs(cosines), axis=1)
    for axis in range(3):
        senses = np.ones(3)
        senses[axis] = -1.0
        parallel = len(set(order.tolist())) == 3 and bool((senses * cosines[range(3), order] >= _PARALLEL).all())
        if not parallel or a.pose.edges[axis] @ away < _PARALLEL * length:
            continue
        along = away / length
        # Both vertices, each by its own errors.
        sigma = math.sqrt(sum(float(along @ c.pose.covariance[3:, 3:] @ along) for c in (a, b)))
        seen = [(a.edge_lengths_m[axis], a.edge_length_sigmas_m[axis])]
        seen += [(b.edge_lengths_m[order[axis]], b.edge_length_sigmas_m[order[axis]])]
        seen = [(own, own_sigma) for own, own_sigma in seen if np.isfinite(own)]
        if seen and all(_alike(length, sigma, own, own_sigma) for own, own_sigma in seen):
            return axis, length, sigma
    return None


def _sizes(corners: Sequence[BelievedCorner]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The sizes along the edges of the first corner, and their standard deviations; NaN where edges disagree."""
    sizes, sigmas = np.full(3, np.nan), np.full(3, np.nan)
    lengths = list(_lengths(corners))
    for axis in range(3):
        own = [(length, sigma) for along, length, sigma in lengths if along == axis]
        if own and all(_alike(*own[0], *other) for other in own):
            sizes[axis], sigmas[axis] = min(own, key=lambda one: one[1])
    return sizes, sigmas


def _lengths(corners: Sequence[BelievedCorner]) -> Iterator[tuple[int, float, float]]:
    """Axis of the first corner, length and standard deviation of each edge that is seen from end to end."""
    for k, corner in enumerate(corners):
        axes = np.argmax(np.abs(corners[0].pose.edges @ corner.pose.edges.T), axis=0).tolist()
        for edge, axis in enumerate(axes):
            length, sigma = float(corner.edge_lengths_m[edge]), float(corner.edge_length_sigmas_m[edge])
            if math.isfinite(length):
                yield axis, length, sigma
        for other in corners[k + 1 :]:
            shared = _shared(corner, other)
            if shared is not None:
                yield axes[shared[0]], shared[1], shared[2]
