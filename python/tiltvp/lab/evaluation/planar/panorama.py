"""Panoramas of what an upward camera sees, azimuth by elevation, made level on the way if the lean is known."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import cv2
import numpy as np

from tiltvp._core import leaning_from_upright
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp.cameras import Camera

__all__ = ["PanoramaGrid", "Unwrapper"]

_UPRIGHT = (0.0, 0.0, 1.0)
_ACROSS, _DOWN = 4, 2
"""Places that are averaged in each pixel of a panorama, along the row and along the column."""


@dataclass(frozen=True)
class PanoramaGrid:
    """Where the pixels of a panorama look to.

    Column j is at the azimuth `2 pi j / columns`, from the robot's front to its left. Row 0 is the highest; rows are
    equally spaced from the horizon to `elevation_max_rad`, half a step clear of both.
    """

    columns: int = 72
    rows: int = 40
    elevation_max_rad: float = float(np.deg2rad(60.0))

    def __post_init__(self) -> None:
        """Raises `tiltvp.errors.InvalidInputError` for a grid that is none."""
        if self.columns < 8 or self.columns % 2 or self.rows < 4:
            size = f"{self.columns} columns, {self.rows} rows"
            raise InvalidInputError(f"grid: {size}, expected an even number of at least 8 columns, at least 4 rows")
        if not 0.0 < self.elevation_max_rad < np.pi / 2.0:
            raise InvalidInputError(f"elevation_max_rad = {self.elevation_max_rad}, expected a number in (0, pi/2)")

    @property
    def step_rad(self) -> float:
        """The angle between neighbouring columns."""
        return 2.0 * np.pi / self.columns

    @cached_property
    def elevations_rad(self) -> NDArray[np.float64]:
        """(rows,): falling elevations of the rows."""
        return self.elevation_max_rad * (1.0 - (np.arange(self.rows) + 0.5) / self.rows)


class Unwrapper:
    """Turns images of one camera into panoramas of one grid.

    The lean goes into the map from panorama to image, so that an image is resampled once whether it is made level or
    not. Each pixel is the mean of `4 x 2` places.
    """

    def __init__(self, camera: Camera, grid: PanoramaGrid, *, robot_from_camera: ArrayLike | None = None) -> None:
        """`robot_from_camera` (3, 3) is R of v_robot = R v_camera; default identity, an upward camera."""
        self._camera, self.grid = camera, grid
        rotation = np.eye(3) if robot_from_camera is None else np.asarray(robot_from_camera, dtype=np.float64)
        azimuth = (np.arange(_ACROSS * grid.columns) + 0.5 - 0.5 * _ACROSS) * grid.step_rad / _ACROSS
        rows = _DOWN * grid.rows
        elevation = grid.elevation_max_rad * (1.0 - (np.arange(rows) + 0.5) / rows)
        across, up = np.meshgrid(azimuth, elevation)
        bearings = np.stack([np.cos(up) * np.cos(across), np.cos(up) * np.sin(across), np.sin(up)], axis=-1)
        self._bearings, self._robot_from_camera = bearings.reshape(-1, 3), rotation
        self._shape = across.shape
        self._upright_map = self._map(_UPRIGHT)

    def __call__(self, gray: NDArray[np.uint8], normal: ArrayLike = _UPRIGHT) -> NDArray[np.float32]:
        """(rows, columns) grey levels of an image (H, W), made level by the ground normal (3,) of the robot frame.

        Without a normal the robot is taken to be upright. What lies below the lens' reach repeats the lowest place
        that is seen at that azimuth.
        """
        is_upright = np.array_equal(np.asarray(normal), _UPRIGHT)
        across, down = self._upright_map if is_upright else self._map(normal)
        fine = cv2.remap(gray, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        size = (self.grid.columns, self.grid.rows)
        return np.asarray(cv2.resize(fine.astype(np.float32), size, interpolation=cv2.INTER_AREA))

    def _map(self, normal: ArrayLike) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        camera_from_upright = self._robot_from_camera.T @ leaning_from_upright(normal)
        places = self._camera.project(self._bearings @ camera_from_upright.T).reshape(*self._shape, 2)
        seen = np.isfinite(places[:, :, 0])
        # The number of the last row that is seen, from the top down to each row.
        rows = np.maximum.accumulate(np.where(seen, np.arange(self._shape[0])[:, None], 0), axis=0)
        places = np.nan_to_num(np.take_along_axis(places, rows[:, :, None], axis=0), nan=-1e6).astype(np.float32)
        return np.ascontiguousarray(places[:, :, 0]), np.ascontiguousarray(places[:, :, 1])
