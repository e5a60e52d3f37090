"""The focal length by right angles: most edges of what people build run along three axes that are at right angles
(Caprile and Torre 1990), by one focal length alone."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp._core import Camera
    from tiltvp.segments import Segments

    Matrix = NDArray[np.float64]

__all__ = ["UNTOLD", "scale_by_right_angles"]

_LOG_SCALES: Final = np.linspace(-0.4, 0.4, 17)
"""Logarithms of the focal lengths that are tried, in units of the calibration's. With steps half as large answers are
the same."""
_PRIOR: Final = 0.5
"""Standard deviation of that logarithm before an image is seen."""
_EDGES: Final = 80
_LEAST_EDGES: Final = 12
"""Edges of an image that are looked at, the longest, and with which an image tells anything."""
_LENGTH_RAD: Final = 0.06
_FULL_RAD: Final = 0.2
"""Length of an edge from which on it is looked at, and from which on it counts in full."""
_SCATTER_RAD: Final = float(np.deg2rad(0.5))
"""By how much edges miss their axis. Beyond it the loss (Geman and McClure 1985) is nearly even: by one that grows on,
as Cauchy's, narrower lenses fit better, by edges of other things. With 0.3 degrees answers are the same."""
_TRIPLES: Final = 300
_KEPT: Final = 4
"""Triples of edges that tell an attitude, and those of them whose attitude is refined, at each scale."""
_STEPS: Final = 8
_IMAGES: Final = 4
"""Images with which their scatter begins to tell a standard deviation."""
_LOG_RATIO: Final = 2.0
"""Logarithm of by how much an edge along an axis is likelier than a stray."""
UNTOLD: Final = (1.0, _PRIOR)
"""Scale and standard deviation where nothing is told."""
_LEAST_SIGMA: Final = 0.01
"""Rooms are at right angles to half a degree or so."""


def scale_by_right_angles(camera: Camera, found: Iterable[Segments]) -> tuple[float, float]:
    """The focal length over the calibration's by which the straight edges of images run along three axes at right
    angles, each image's along its own, and its standard deviation.

    That is how the images scatter (jackknife), and no less than chance has it with as many more edges along the axes.
    `UNTOLD` of fewer than four images with a dozen edges, and where the ends of what is tried fit best.
    """
    costs = np.array([own for own in (_costs(camera, segments) for segments in found) if own is not None])
    if len(costs) < _IMAGES:
        return UNTOLD
    total = costs.sum(axis=0)
    best = _best(total)
    if abs(best) >= _LOG_SCALES[-1]:
        return UNTOLD
    others = np.array([_best(total - own) for own in costs])
    scatter = np.sqrt((len(costs) - 1.0) * np.var(others))
    gain = total[len(total) // 2] - total.min()
    chance = abs(best) / np.sqrt(2.0 * _LOG_RATIO * gain) if gain > 0.0 else 0.0
    return float(np.exp(best)), float(max(scatter, chance, _LEAST_SIGMA))


def _costs(camera: Camera, segments: Segments) -> Matrix | None:
    """How badly the longest edges of an image run along the axes that fit them best, at each scale."""
    order = np.argsort(-segments.length_rad, kind="stable")[:_EDGES]
    order = order[segments.length_rad[order] >= _LENGTH_RAD]
    ends = camera.project(segments.ends[order].reshape(-1, 3)).reshape(-1, 2, 2)
    normals = np.array([_normals(camera, ends, scale) for scale in np.exp(_LOG_SCALES)])
    seen = np.isfinite(normals).all(axis=(0, 2))
    normals, weights = normals[:, seen], np.minimum(segments.length_rad[order][seen] / _FULL_RAD, 1.0)
    if len(weights) < _LEAST_EDGES:
        return None
    triples = np.random.default_rng(0).integers(len(weights), size=(3, _TRIPLES))
    costs, before = [], np.empty((0, 3, 3))
    for own in normals:
        frames = np.concatenate([_attitudes(own, weights, triples), before])
        frames, losses = _refined(own, weights, frames)
        costs.append(losses.min())
        before = frames[losses.argmin()][None]
    return np.array(costs)


def _normals(camera: Camera, ends: Matrix, scale: float) -> Matrix:
    """(N, 3) unit normals of the great circles of edges by a lens with another focal length, NaN where it has none."""
    middle = 0.5 * np.array([camera.width - 1.0, camera.height - 1.0])
    bearings = camera.unproject(((ends - middle) / scale + middle).reshape(-1, 2)).reshape(-1, 2, 3)
    normals = np.cross(bearings[:, 0], bearings[:, 1])
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12))


def _attitudes(normals: Matrix, weights: Matrix, triples: NDArray[np.int64]) -> Matrix:
    """(K, 3, 3): axes by columns, the first along two edges and the second along a third one, of the best triples."""
    one, other, third = normals[triples]
    first = np.cross(one, other)
    second = np.cross(third, first)
    sizes = np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)
    first /= np.maximum(sizes[0], 1e-12)[:, None]
    second /= np.maximum(sizes[1], 1e-12)[:, None]
    frames = np.stack([first, second, np.cross(first, second)], axis=2)
    # Two edges on nearly one great circle, or one along the first axis, tell no axis.
    cost = np.where(
        (sizes[0] > 0.02) & (sizes[1] > 0.3 * sizes[0]), _loss(_nearest(normals, frames)[0], weights), np.inf
    )
    return np.asarray(frames[np.argsort(cost, kind="stable")[:_KEPT]])


def _nearest(normals: Matrix, frames: Matrix) -> tuple[Matrix, NDArray[np.int64]]:
    """(K, N): the sine by which each edge misses the axis that it is nearest to, and which one that is."""
    sines = np.einsum("ni,kia->kna", normals, frames)
    axes = np.abs(sines).argmin(axis=2)
    return np.take_along_axis(sines, axes[:, :, None], axis=2)[:, :, 0], axes


def _loss(sines: Matrix, weights: Matrix) -> Matrix:
    squares = sines**2
    return np.asarray((weights * squares / (squares + _SCATTER_RAD**2)).sum(axis=1))


def _refined(normals: Matrix, weights: Matrix, frames: Matrix) -> tuple[Matrix, Matrix]:
    """Attitudes turned to where their loss is least, and the losses."""
    for _ in range(_STEPS):
        sines, axes = _nearest(normals, frames)
        along = np.take_along_axis(frames.transpose(0, 2, 1), axes[:, :, None], axis=1)
        slopes = np.cross(along, normals)
        weight = weights / (1.0 + (sines / _SCATTER_RAD) ** 2) ** 2
        information = np.einsum("kn,kni,knj->kij", weight, slopes, slopes) + 1e-9 * np.eye(3)
        pull = np.einsum("kn,kni,kn->ki", weight, slopes, sines)
        turn = -np.linalg.solve(information, pull[:, :, None])[:, :, 0]
        turned = frames + np.cross(turn[:, None], frames.transpose(0, 2, 1)).transpose(0, 2, 1)
        # The rotation next to a small turn's first order.
        left, _, right = np.linalg.svd(turned)
        frames = left @ right
    return frames, _loss(_nearest(normals, frames)[0], weights)


def _best(costs: Matrix) -> float:
    """The logarithm of the scale with the least cost, between those that were tried by a parabola."""
    costs = 2.0 * _LOG_RATIO * costs + (_LOG_SCALES / _PRIOR) ** 2
    k, step = int(costs.argmin()), _LOG_SCALES[1] - _LOG_SCALES[0]
    if not 0 < k < len(costs) - 1:
        return float(_LOG_SCALES[k])
    before, here, after = costs[k - 1 : k + 2]
    return float(_LOG_SCALES[k] + 0.5 * step * (before - after) / (before - 2.0 * here + after))
