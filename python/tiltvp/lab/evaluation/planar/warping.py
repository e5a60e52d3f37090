"""Min-warping: the relative pose of two places on a plane from their panoramas alone.

R. Möller, M. Krzykawski, L. Gerstmayr. Three 2D-warping schemes for visual robot navigation. Autonomous Robots 29,
253-291, 2010. It matches no features: every pose is tried, and judged by how well whole columns of the one panorama are
found in the other, each at an azimuth and in a size that the pose allows. Here columns are compared by correlation, the
search goes both ways, so that neither panorama comes first, and the best pose of the grid is refined to the vertex of a
paraboloid.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from tiltvp.errors import InvalidInputError
from tiltvp.lab.evaluation.planar.panorama import PanoramaGrid

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Scores = NDArray[np.float32]

__all__ = ["MinWarping", "PlanarPose", "bearing_and_orientation"]


@dataclass(frozen=True, eq=False)
class PlanarPose:
    """Where the second place is, seen from the first; panoramas do not tell how far.

    `bearing_rad` is the azimuth of the second place in the first robot's frame (alpha of the source) and
    `orientation_rad` the second robot's heading minus the first one's (psi), both in (-pi, pi], counter-clockwise.
    `scores` (columns, columns) is the mean distance of matched columns, smaller is better: entry [i, j] belongs to the
    bearing (i + 1/2) steps and the orientation j steps of the grid.
    """

    bearing_rad: float
    orientation_rad: float
    scores: Scores


class MinWarping:
    """Estimates planar poses from panoramas of one grid; its tables are made once.

    It assumes an upright robot that moves in a plane: then what is vertical is a column of both panoramas, and only its
    azimuth and its size, about the horizon, change. That is what a lean breaks.
    """

    def __init__(self, grid: PanoramaGrid, *, scale_max: float = 4.0, scales: int = 8) -> None:
        """A thing is up to `scale_max` times nearer to one place than to the other, in `scales` equal ratios.

        Raises `tiltvp.errors.InvalidInputError`.
        """
        if not (1.0 < scale_max < np.inf and scales >= 1):
            raise InvalidInputError(f"scale_max = {scale_max}, scales = {scales}, expected more than 1, and 1 or more")
        self.grid, self._scale_max, self._scales = grid, scale_max, scales

    def __call__(self, first: NDArray[np.float32], second: NDArray[np.float32]) -> PlanarPose:
        """The pose of the second place relative to the first: panoramas (rows, columns) as `Unwrapper` makes them."""
        expected = (self.grid.rows, self.grid.columns)
        for name, panorama in (("first", first), ("second", second)):
            if panorama.shape != expected:
                raise InvalidInputError(f"{name}: shape {panorama.shape}, expected {expected}, as the grid's")
        distances = self._distances(first, second)
        there = self._scores(distances)
        back = self._scores(distances[::-1].transpose(0, 2, 1))
        # Seen from the second place the bearing is bearing + pi - orientation, and the orientation is -orientation.
        n, step = self.grid.columns, self.grid.step_rad
        i, j = np.ogrid[:n, :n]
        scores = (there + back[(i + n // 2 - j) % n, -j % n]) / np.float32(2.0)
        bearing, orientation = _lowest(scores)
        return PlanarPose(_wrapped((bearing + 0.5) * step), _wrapped(orientation * step), scores)

    def _distances(self, first: NDArray[np.float32], second: NDArray[np.float32]) -> NDArray[np.float32]:
        """(2 scales + 1, columns, columns): 1 - correlation of every column of the first with each of the second.

        Plane k takes things to be `scale_max^(k/scales - 1)` times as far from the first place as from the second. The
        panorama that has them smaller is magnified.
        """
        k = self._scales
        ones = [_unit_columns(magnifier @ first) for magnifier in self._magnifiers]
        twos = [_unit_columns(magnifier @ second) for magnifier in self._magnifiers]
        planes = [ones[max(scale, 0)].T @ twos[max(-scale, 0)] for scale in range(-k, k + 1)]
        return np.asarray(np.float32(1.0) - np.stack(planes), dtype=np.float32)

    def _scores(self, distances: NDArray[np.float32]) -> Scores:
        """(bearing, orientation): the mean over all columns of the least distance to a column that may be the same.

        A column at theta lies at u = theta - bearing from the direction of motion, and its match at theta' at
        w = theta' + orientation - bearing. As theta - theta' = orientation - (w - u), one pair of u and w is, for all
        bearings and orientations at once, one shifted block of the distances over theta and theta - theta'.
        """
        n = self.grid.columns
        theta = np.arange(n)
        blocks = np.tile(distances[:, theta[:, None], (theta[:, None] - theta) % n], (1, 3, 2))
        total = np.zeros((n, n), dtype=np.float32)
        for column, matches in enumerate(self._matches):
            least = np.full((n, n), np.inf, dtype=np.float32)
            for shift, scale in matches:
                start = -shift % n
                np.minimum(least, blocks[scale, column + 1 : column + 1 + n, start : start + n], out=least)
            total += least
        return total / np.float32(n)

    @cached_property
    def _magnifiers(self) -> list[NDArray[np.float32]]:
        """(rows, rows) each, to magnify a panorama about the horizon, where tan(elevation) is height over distance."""
        rows, elevations = np.arange(self.grid.rows), self.grid.elevations_rad
        matrices = []
        for k in range(self._scales + 1):
            source = np.arctan(np.tan(elevations) / self._scale_max ** (k / self._scales))
            place = np.interp(-source, -elevations, rows)
            matrices.append(np.clip(1.0 - np.abs(place[:, None] - rows), 0.0, 1.0).astype(np.float32))
        return matrices

    @cached_property
    def _matches(self) -> list[list[tuple[int, int]]]:
        """For the column at u = (number + 1/2) steps: the shifts w - u in columns and the planes of possible matches.

        Both places and the thing are a triangle with the angles u, pi - w and w - u, all positive (for things to the
        right of the motion, all negative). By the law of sines the distances have the ratio r / r' = sin w / sin u. A
        column covers half a step to each side, and so a range of ratios.
        """
        n, k, step = self.grid.columns, self._scales, self.grid.step_rad
        left: list[list[tuple[int, int]]] = []
        for column in range(n // 2):
            u = (column + 0.5) * step
            found = []
            for shift in range(n // 2 - column):
                low, high = max((shift - 0.5) * step, 0.0), min((shift + 0.5) * step, np.pi - u - _TINY)
                ratios = np.sin(u + np.linspace(low, high, _RATIOS)) / np.sin(u)
                planes = np.round(k * (1.0 + np.log(ratios) / np.log(self._scale_max))).astype(int)
                found += [(shift, plane) for plane in range(max(planes.min(), 0), min(planes.max(), 2 * k) + 1)]
            left.append(found)
        return left + [[(-shift, plane) for shift, plane in matches] for matches in reversed(left)]


_NEAR_I = np.array([0, 1, -1, 0, 0, 1, -1])
_NEAR_J = np.array([0, 0, 0, 1, -1, 1, -1])
_TINY = 1e-9
_RATIOS = 9
"""Places within a column at which the ratio of distances is looked at."""


def bearing_and_orientation(first: Sequence[float], second: Sequence[float]) -> tuple[float, float]:
    """The true bearing and orientation, in radians, of two poses (x_m, y_m, yaw_rad)."""
    bearing = np.arctan2(second[1] - first[1], second[0] - first[0]) - first[2]
    return _wrapped(float(bearing)), _wrapped(float(second[2] - first[2]))


def _unit_columns(panorama: NDArray[np.float32]) -> NDArray[np.float32]:
    """Each column without its mean and of length one; all zero where there is nothing to see."""
    centred = panorama - panorama.mean(axis=0)
    return np.asarray(centred / (np.linalg.norm(centred, axis=0) + np.float32(1e-3)), dtype=np.float32)


def _lowest(scores: Scores) -> tuple[float, float]:
    """Row and column of the least score, between the entries where the paraboloid around it has its vertex near by.

    The neighbours are those six that stay neighbours when the two places change their roles.
    """
    n = scores.shape[0]
    i, j = divmod(int(np.argmin(scores)), n)
    around = scores[(i + _NEAR_I) % n, (j + _NEAR_J) % n].astype(np.float64)
    terms = np.stack([np.ones(7), _NEAR_I, _NEAR_J, _NEAR_I**2, _NEAR_I * _NEAR_J, _NEAR_J**2], axis=1)
    _, slope_i, slope_j, bend_ii, bend_ij, bend_jj = np.linalg.lstsq(terms, around, rcond=None)[0]
    hessian = np.array([[2.0 * bend_ii, bend_ij], [bend_ij, 2.0 * bend_jj]])
    if bend_ii <= 0.0 or np.linalg.det(hessian) <= 0.0:
        return float(i), float(j)
    di, dj = (float(x) for x in -np.linalg.solve(hessian, [slope_i, slope_j]))
    return (i + di, j + dj) if max(abs(di), abs(dj), abs(di - dj)) <= 1.0 else (float(i), float(j))


def _wrapped(angle_rad: float) -> float:
    """The same angle in (-pi, pi]."""
    return float(np.pi - (np.pi - angle_rad) % (2.0 * np.pi))
