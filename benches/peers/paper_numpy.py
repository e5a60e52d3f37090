"""The paper's three methods on OpenCV and NumPy, as one would write them first: peers of ours in `vertical.py`."""

from __future__ import annotations

import math
from collections.abc import Callable

import cv2
import numpy as np

from tiltvp import Camera

LEAST = 1e-12


class PaperNumpy:
    """Tables of one upward camera, robot and camera axes alike, for images (H, W) uint8.

    Calling it gives the ground normal (3,). Corrections are factors: pixels per radian for the image-space methods
    (eq. 30), without unit for vector consensus (eq. 45).
    """

    def __init__(self, camera: Camera, method: str, *, gradient_min: float, factor: float, seed: int = 0) -> None:
        rows, columns = np.mgrid[0 : camera.height, 0 : camera.width]
        bearings = camera.unproject(np.stack([columns, rows], axis=-1).reshape(-1, 2).astype(np.float64))
        elevation = np.arcsin(np.clip(bearings[:, 2], -1.0, 1.0))
        with np.errstate(invalid="ignore"):
            band = (elevation >= 0.0) & (elevation <= math.radians(45.0))
        self._band = band.reshape(rows.shape)
        inside = np.argwhere(self._band)
        (self._top, self._left), (bottom, right) = inside.min(axis=0), inside.max(axis=0) + 1
        self._box = (slice(self._top, bottom), slice(self._left, right))
        self._bearings = bearings.reshape(*rows.shape, 3)
        self._by_row, self._by_column = np.gradient(self._bearings, axis=(0, 1))
        self._center = camera.project(np.array([[0.0, 0.0, 1.0]]))[0]
        self._fit = {"image-space-ransac": self._ransac, "image-space-reject-refit": self._reject_refit}.get(method)
        self._gradient_min, self._factor = gradient_min, factor
        self._rng = np.random.default_rng(seed)

    def __call__(self, image: np.ndarray) -> np.ndarray:
        box = image[self._box]
        gx, gy = cv2.Scharr(box, cv2.CV_32F, 1, 0), cv2.Scharr(box, cv2.CV_32F, 0, 1)
        squared = gx * gx + gy * gy
        row, column = np.nonzero((squared >= self._gradient_min**2) & self._band[self._box])
        gx, gy, length = gx[row, column], gy[row, column], np.sqrt(squared[row, column])
        unit = np.stack([gx / length, gy / length], axis=1)
        return self._vector(row, column, unit) if self._fit is None else self._image_space(row, column, unit)

    def _image_space(self, row: np.ndarray, column: np.ndarray, unit: np.ndarray) -> np.ndarray:
        """Offsets of edges from the centre are a cosine of their direction (eqs. 17 to 19)."""
        offset = unit[:, 0] * (column + self._left - self._center[0]) + unit[:, 1] * (row + self._top - self._center[1])
        near = np.abs(offset) <= 40.0
        shift = self._fit(unit[near], offset[near])
        alpha = np.linalg.norm(shift) / self._factor
        # The camera looks up with its columns to the front: the vertical is seen where the robot does not lean to.
        direction = shift / max(np.linalg.norm(shift), LEAST)
        return np.array([*(direction * math.sin(alpha)), math.cos(alpha)])

    def _reject_refit(self, unit: np.ndarray, offset: np.ndarray, quantile: float = 1.2816) -> np.ndarray:
        """Eqs. 33 to 35 with Q = 0.8 kept."""
        shift = np.linalg.lstsq(unit, offset, rcond=None)[0]
        for _ in range(15):
            residual = np.abs(offset - unit @ shift)
            keep = residual <= quantile * math.sqrt(np.mean(residual**2))
            unit, offset, before = unit[keep], offset[keep], shift
            shift = np.linalg.lstsq(unit, offset, rcond=None)[0]
            if abs(np.linalg.norm(shift) - np.linalg.norm(before)) < 1e-3:
                break
        return shift

    def _ransac(self, unit: np.ndarray, offset: np.ndarray, threshold: float = 10.0) -> np.ndarray:
        """Eq. 32: the largest consensus set of random pairs, and least squares on it."""

        def model(pair: np.ndarray) -> np.ndarray | None:
            matrix = unit[pair].astype(np.float64)
            return None if abs(np.linalg.det(matrix)) < 1e-9 else np.linalg.solve(matrix, offset[pair])

        inliers = self._largest(len(offset), model, lambda shift: np.abs(offset - unit @ shift) <= threshold)
        return np.linalg.lstsq(unit[inliers], offset[inliers], rcond=None)[0]

    def _vector(self, row: np.ndarray, column: np.ndarray, unit: np.ndarray) -> np.ndarray:
        """Section 2.2: great circles of edges, the direction that most of them pass."""
        row, column = row + self._top, column + self._left
        along = self._by_column[row, column] * unit[:, 1:] - self._by_row[row, column] * unit[:, :1]
        normal = np.cross(self._bearings[row, column], along)
        length = np.linalg.norm(normal, axis=1)
        normal = normal[length > LEAST] / length[length > LEAST, None]
        normal = normal[np.abs(normal[:, 2]) <= math.sin(math.radians(7.0))]

        def model(pair: np.ndarray) -> np.ndarray | None:
            direction = np.cross(*normal[pair])
            return None if np.linalg.norm(direction) < 1e-9 else direction / np.linalg.norm(direction)

        limit = math.sin(math.radians(5.0))
        inliers = self._largest(len(normal), model, lambda direction: np.abs(normal @ direction) <= limit)
        up = np.linalg.eigh(normal[inliers].T @ normal[inliers])[1][:, 0]
        up = up if up[2] > 0.0 else -up
        alpha, beta = math.acos(min(1.0, up[2])) / self._factor, math.atan2(up[1], up[0])
        return np.array([math.sin(alpha) * math.cos(beta), math.sin(alpha) * math.sin(beta), math.cos(alpha)])

    def _largest(
        self, count: int, model: Callable[[np.ndarray], np.ndarray | None], agree: Callable[[np.ndarray], np.ndarray]
    ) -> np.ndarray:
        """The largest consensus set, sampled until one of it was drawn with 99 %, at most 1,000 times."""
        best, trials, needed = np.zeros(count, dtype=bool), 0, 1000.0
        while trials < needed:
            trials += 1
            found = model(self._rng.choice(count, 2, replace=False))
            if found is None:
                continue
            inliers = agree(found)
            if inliers.sum() > best.sum():
                best = inliers
                share = min(best.mean() ** 2, 1.0 - LEAST)
                needed = min(1000.0, math.log(0.01) / math.log(1.0 - share))
        return best
