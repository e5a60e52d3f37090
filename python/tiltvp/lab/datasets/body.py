"""A robot's body painted into images: a mast, a wheel, a cable and a textured plate, at the same pixels in all."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.cameras import Camera

__all__ = ["PaintedBody"]

_FINER: Final = 4
"""Pixels of the drawing to one of the image and side."""
_NOISE: Final = 2.0


class PaintedBody:
    """What a camera sees of the robot that carries it. `seed` draws where its parts are, and how dark.

    `cover` (H, W) in [0, 1] is the share of each pixel that the body takes.
    """

    def __init__(self, camera: Camera, seed: int) -> None:
        rng = np.random.default_rng(seed)
        height, width = camera.height, camera.width
        self._unit = min(height, width) / 480.0
        self._middle = np.array([width / 2.0, height / 2.0])
        self._drawn = np.zeros((height * _FINER, width * _FINER), dtype=np.uint8)
        self._levels = np.zeros(self._drawn.shape, dtype=np.float32)
        mast, wheel, cable, plate = rng.uniform(0.0, 2.0 * np.pi) + np.array([0.0, 1.6, 3.0, 4.5])
        self._line([(mast, 1.3), (mast, 0.55)], 14.0, rng.uniform(15.0, 200.0))
        self._ring((wheel, 1.15), 70.0, None, rng.uniform(15.0, 90.0))
        self._ring((wheel, 1.15), 40.0, 6.0, rng.uniform(100.0, 220.0))
        along = np.linspace(0.0, 1.0, 30)
        self._line([(cable + 0.25 * np.sin(3.0 * t), 1.2 - 0.6 * t) for t in along], 4.0, rng.uniform(10.0, 60.0))
        cells = rng.uniform(-40.0, 40.0, (height // 6, width // 6)).astype(np.float32) + rng.uniform(80.0, 150.0)
        corners = [(plate + side, reach) for side, reach in ((-0.3, 1.2), (-0.25, 0.8), (0.25, 0.8), (0.3, 1.2))]
        self._plate(corners, cells)
        size = (width, height)
        self.cover: NDArray[np.float32] = np.asarray(
            cv2.resize(self._drawn, size, interpolation=cv2.INTER_AREA), dtype=np.float32
        ) / np.float32(255.0)
        self._light: NDArray[np.float32] = np.asarray(
            cv2.resize(self._levels, size, interpolation=cv2.INTER_AREA), dtype=np.float32
        )

    def paint(self, gray: NDArray[np.uint8], seed: int) -> NDArray[np.uint8]:
        """(H, W) uint8: the image with the body before it, in light and noise of its own."""
        rng = np.random.default_rng(seed)
        body = self._light * rng.uniform(0.7, 1.2) + rng.normal(0.0, _NOISE, gray.shape) * self.cover
        return np.asarray(np.clip(np.rint(gray * (1.0 - self.cover) + body), 0, 255), dtype=np.uint8)

    def _pixels(self, places: list[tuple[float, float]]) -> NDArray[np.int32]:
        """Of the drawing, from angles about the image's middle and shares of 0.92 of half its shorter side."""
        angles, reaches = np.array(places).T
        away = 0.92 * 240.0 * self._unit * reaches * np.stack([np.cos(angles), np.sin(angles)])
        return np.asarray((self._middle + away.T) * _FINER, dtype=np.int32)

    def _line(self, places: list[tuple[float, float]], width_px: float, level: float) -> None:
        shape = np.zeros_like(self._drawn)
        cv2.polylines(shape, [self._pixels(places)], False, 255, self._fine(width_px))
        self._lay(shape, level)

    def _ring(self, centre: tuple[float, float], radius_px: float, width_px: float | None, level: float) -> None:
        shape = np.zeros_like(self._drawn)
        u, v = self._pixels([centre])[0].tolist()
        cv2.circle(shape, (u, v), self._fine(radius_px), 255, -1 if width_px is None else self._fine(width_px))
        self._lay(shape, level)

    def _plate(self, corners: list[tuple[float, float]], cells: NDArray[np.float32]) -> None:
        shape = np.zeros_like(self._drawn)
        cv2.fillPoly(shape, [self._pixels(corners)], 255)
        size = (shape.shape[1], shape.shape[0])
        self._lay(shape, np.asarray(cv2.resize(cells, size, interpolation=cv2.INTER_NEAREST), dtype=np.float32))

    def _lay(self, shape: NDArray[np.uint8], levels: float | NDArray[np.float32]) -> None:
        self._drawn[shape > 0] = 255
        self._levels = np.where(shape > 0, np.float32(levels) if isinstance(levels, float) else levels, self._levels)

    def _fine(self, length_px: float) -> int:
        return max(1, round(length_px * self._unit * _FINER))
