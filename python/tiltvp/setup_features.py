"""What tells in one image which of the camera's six directions is up: edges, and blocks of pixels by elevation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.images import checked_mask
from tiltvp.segments import SegmentDetector

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera, Segments

    Matrix = NDArray[np.float64]
    Cells = NDArray[np.int64]

__all__ = ["DIRECTIONS", "EDGE_FEATURES", "ImageFeatures"]

DIRECTIONS: Final[dict[str, tuple[float, float, float]]] = {
    "-y": (0.0, -1.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "+x": (1.0, 0.0, 0.0),
    "+z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}
"""The six directions of the camera frame that may be up, by name."""

_REACH_RAD: Final = float(np.deg2rad(14.0))
"""How far from a direction the vertical is looked for: 10 degrees of lean, and 4 by which mountings are off."""
_STEP_RAD: Final = float(np.deg2rad(1.75))
_SCATTER_RAD: Final = float(np.deg2rad(0.8))
"""By how much the edges of vertical things miss the vertical, with half a step of the grid."""
_EVEN_RAD: Final = float(np.deg2rad(3.0))
"""As of the method "segments": the scatter at which a segment is as likely vertical as not."""
_LENGTH_RAD: Final = 0.2
_LONGEST: Final = 120
"""Straight edges of an image that are looked at."""
_BANDS: Final = 8
"""Of equal solid angle, from straight down to straight up; twelve tell no more."""
EDGE_FEATURES: Final = 12 + 3 * _BANDS
"""Of the features of a direction the first so many are of straight edges, 0 where there are none."""
_BLOCKS: Final = 4800
"""Blocks of pixels of an image, about; of 8 x 8 at 640 x 480."""
_FEW: Final = 0.01
"""Share of the blocks below which a band is drawn to the mean of the image, and its spread not told."""
_VARIES: Final = 1.0
"""Grey levels by which a view varies at least, for one that does not; and as gradient, below which it is noise."""
_BLACK: Final = 12.0
"""Grey level up to which a pixel counts as black: shadows, and what is outside the image circle."""
_BRIGHT: Final = 1.5
"""Standard deviations above the mean from which a block counts as bright: lamps, windows."""


class ImageFeatures:
    """The features of the images of one camera. `mask` (H, W) bool is True where images show the world."""

    def __init__(self, camera: Camera, *, mask: ArrayLike | None = None) -> None:
        shown = None if mask is None else checked_mask(mask, camera)
        self._detector = SegmentDetector(camera, mask=shown)
        self._blocks = _Blocks(camera)

    def __call__(self, gray: NDArray[np.uint8]) -> Matrix:
        """(6, F): of one grey image, for each of `DIRECTIONS`."""
        edges, blocks = _Edges(self._detector(gray)), self._blocks.measured(gray)
        centre = self._blocks.bearings
        rows = {}
        for axis in np.eye(3):
            up, vertical, score = edges.vertical_near(axis)
            way = self._blocks.upward(up)
            for name, direction in DIRECTIONS.items():
                sign = float(axis @ direction)
                if sign:
                    height = float((centre @ (sign * up)).mean())
                    own = edges.told(sign * up, axis, vertical, score, height)
                    rows[name] = [*own, *self._blocks.told(blocks, sign * up, sign * way)]
        return np.array([rows[name] for name in DIRECTIONS])


class _Edges:
    """The longest straight edges of an image."""

    def __init__(self, edges: Segments) -> None:
        self.normal, self.middle = edges.normal[:_LONGEST], edges.middle[:_LONGEST]
        self.length, self.contrast = edges.length_rad[:_LONGEST], edges.contrast[:_LONGEST]
        self.variance = edges.variances_rad2[:_LONGEST].max(axis=1, initial=0.0)
        self.weight = np.sqrt(self.length / _LENGTH_RAD)

    def vertical_near(self, axis: Matrix) -> tuple[Matrix, Matrix, float]:
        """The most likely vertical near an axis, how likely each edge is vertical, and the sum of the log odds."""
        if not len(self.length):
            return axis, np.zeros(0), 0.0
        cap = _cap()
        ups = cap @ np.eye(3)[axis == 0.0] + np.sqrt(1.0 - np.sum(cap**2, axis=1))[:, None] * axis
        variance = _SCATTER_RAD**2 + self.variance
        chance = np.sqrt(np.maximum(1.0 - (self.middle @ axis) ** 2, 1e-3))
        odds = _EVEN_RAD * chance / np.sqrt(variance) * np.exp(-0.5 * (ups @ self.normal.T) ** 2 / variance)
        score = np.log1p(odds) @ self.weight
        best = int(np.argmax(score))
        return ups[best], odds[best] / (1.0 + odds[best]), float(score[best])

    def told(self, up: Matrix, axis: Matrix, vertical: Matrix, score: float, centre: float) -> list[float]:
        """What they tell of a direction; `centre` is the mean height of what is seen."""
        if not len(self.length):
            return [0.0] * EDGE_FEATURES
        weight, length, level = self.weight, self.length, 1.0 - vertical
        total, upright = float(weight.sum()) + 1.0, float(weight @ vertical)
        height, brighter = self.middle @ up, self.normal @ up
        short = length < np.median(length)
        across = self.middle[vertical > 0.5] @ np.eye(3)[axis == 0.0].T
        sectors = np.unique(np.floor(np.arctan2(across[:, 1], across[:, 0]) * 6.0 / np.pi))
        flat = level * np.abs(brighter)
        histograms = (weight * level * brighter, weight * flat, weight * level)
        return [
            score / total,
            upright / total,
            np.log1p(len(sectors)),
            float(weight @ (vertical * np.abs(height))) / (1.0 + upright),
            float(weight @ (level * brighter)) / total,
            float(weight @ (level * height)) / total,
            float(np.max(length * vertical)),
            float(height[short].mean()) - centre if short.any() else 0.0,
            float(height.mean()) - centre,
            float((vertical @ height) / (1.0 + vertical.sum())),
            float(weight @ (flat * np.sign(brighter) * height)) / total,
            float(np.log(self.contrast) @ (height - height.mean())) / len(height),
            *np.concatenate([np.bincount(_band(height), values, _BANDS) / total for values in histograms]),
        ]  # fmt: skip


class _Blocks:
    """Blocks of an image's pixels with the bearings of their middles, and how the image runs there."""

    def __init__(self, camera: Camera) -> None:
        self._side = max(1, round(float(np.sqrt(camera.width * camera.height / _BLOCKS))))
        self._shape = camera.height // self._side, camera.width // self._side
        v, u = np.mgrid[: self._shape[0], : self._shape[1]]
        cells = np.column_stack([u.ravel(), v.ravel()])
        bearings = camera.unproject(cells * float(self._side) + 0.5 * (self._side - 1))
        seen = np.isfinite(bearings).all(axis=1)
        self._cells, self.bearings = cells[seen], bearings[seen]
        self._numbers = np.full(self._shape, -1)
        self._numbers[self._cells[:, 1], self._cells[:, 0]] = np.arange(len(self._cells))
        self._right, self._down = (self._change(np.array(step)) for step in ((1, 0), (0, 1)))

    def _change(self, step: Cells) -> Matrix:
        """(N, 3): by how much bearings change over a step of one block."""
        own = np.arange(len(self._cells))
        ahead, behind = self._neighbours(step), self._neighbours(-step)
        steps = (ahead != own).astype(float) + (behind != own)
        return np.asarray((self.bearings[ahead] - self.bearings[behind]) / np.maximum(steps, 1.0)[:, None])

    def _neighbours(self, step: Cells) -> Cells:
        """(N,): numbers of the blocks a step away; of a block itself where none is."""
        u, v = (self._cells + step).T
        inside = (u >= 0) & (v >= 0) & (u < self._shape[1]) & (v < self._shape[0])
        found = self._numbers[np.where(inside, v, 0), np.where(inside, u, 0)]
        return np.where(inside & (found >= 0), found, np.arange(len(self._cells)))

    def upward(self, up: Matrix) -> Matrix:
        """(N, 2): unit directions in the image in which elevation grows."""
        rr, rd, dd = (np.sum(a * b, axis=1) for a, b in (
            (self._right, self._right), (self._right, self._down), (self._down, self._down),
        ))  # fmt: skip
        right, down = self._right @ up, self._down @ up
        way = np.stack([dd * right - rd * down, rr * down - rd * right], axis=1)
        return np.asarray(way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12))

    def measured(self, gray: NDArray[np.uint8]) -> Matrix:
        """(7, N): means over blocks of lightness, of products of gradients, of gradients times their size, of black."""
        import cv2

        rows, columns = self._shape
        levels = gray[: rows * self._side, : columns * self._side].astype(np.float32)
        smooth = cv2.GaussianBlur(levels, (0, 0), 1.0)
        gx, gy = (cv2.Sobel(smooth, cv2.CV_32F, dx, 1 - dx, scale=0.125) for dx in (1, 0))
        size = np.hypot(gx, gy)
        maps = (levels, gx * gx, gy * gy, gx * gy, gx * size, gy * size, (levels <= _BLACK).astype(np.float32))
        small = np.array([cv2.resize(each, (columns, rows), interpolation=cv2.INTER_AREA) for each in maps])
        blocks = small[:, self._cells[:, 1], self._cells[:, 0]].astype(np.float64)
        blocks[0] = (blocks[0] - blocks[0].mean()) / max(float(blocks[0].std()), _VARIES)
        return blocks

    def told(self, blocks: Matrix, up: Matrix, way: Matrix) -> list[float]:
        """What they tell of a direction by bands: lightness, its spread, texture, which way it grows, black, bright."""
        light, xx, yy, xy, x_size, y_size, black = blocks
        band = _band(self.bearings @ up)
        count, few = np.bincount(band, minlength=_BANDS), _FEW * len(light)

        def mean(values: Matrix) -> Matrix:
            return np.asarray(np.bincount(band, values, _BANDS) / (count + few))

        u, v = way.T
        along = np.maximum(u * u * xx + v * v * yy + 2.0 * u * v * xy, 0.0)
        texture = 0.5 * np.log(np.maximum(xx + yy - along, 0.0) + _VARIES)
        lighter_above = (u * x_size + v * y_size) / (xx + yy + _VARIES)
        level = mean(light)
        spread = np.sqrt(np.maximum(mean(light**2) - level**2, 0.0))
        return [
            *level, *np.where(count > few, spread, 0.0), *mean(texture - texture.mean()), *mean(lighter_above),
            *mean(black), *mean(np.maximum(light - _BRIGHT, 0.0)),
        ]  # fmt: skip


def _cap() -> Matrix:
    """(K, 2): offsets across an axis, a grid of steps within the reach."""
    n = int(_REACH_RAD / _STEP_RAD)
    i, k = np.mgrid[-n : n + 1, -n : n + 1]
    grid = np.column_stack([i.ravel(), k.ravel()]) * _STEP_RAD
    return np.asarray(np.sin(grid[np.hypot(grid[:, 0], grid[:, 1]) <= _REACH_RAD]))


def _band(height: Matrix) -> Cells:
    """The number of the band of a sine of the elevation."""
    return np.clip(((height + 1.0) * (0.5 * _BANDS)).astype(np.int64), 0, _BANDS - 1)
