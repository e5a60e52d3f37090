"""Upright panoramas as a source of images of known tilt: an index of them, and views of them through any camera."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import cv2
import numpy as np

from tiltvp._core import PixelRays, leaning_from_upright
from tiltvp.cameras import Camera
from tiltvp.csv_files import CsvFile
from tiltvp.errors import InvalidInputError
from tiltvp.images import gray_from, read_image

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["TABLE_1_TILTS_DEG", "Panorama", "PanoramaViews", "paper_camera", "read_index", "read_panorama_index"]

Item = TypeVar("Item")

TABLE_1_TILTS_DEG: tuple[tuple[float, float], ...] = (
    (0.0, 0.0),
    (2.06, 0.0),
    (4.15, 0.0),
    (1.38, 137.0),
    (1.38, -137.0),
    (2.80, 137.0),
    (2.80, -137.0),
)
"""The seven leans (alpha, beta) of Fleer 2017, table 1, in degrees."""


def paper_camera() -> Camera:
    """An upward fisheye like the paper's: 640 x 480, 185 degrees, equidistant, horizon at a radius of 219.5 pixels."""
    return Camera.equidistant(
        width=640, height=480, focal_px=139.7, cx=319.5, cy=239.5, max_theta_rad=float(np.deg2rad(92.5))
    )


@dataclass(frozen=True)
class Panorama:
    """An equirectangular panorama: its file, the place it shows, and the room's zenith in its frame, if known.

    The zenith is in a frame with x towards longitude 0, y towards longitude -90 degrees, z up: a unit vector, or None.
    """

    name: str
    path: Path
    location: str
    zenith: tuple[float, float, float] | None


def read_panorama_index(directory: str | os.PathLike[str]) -> list[Panorama]:
    """The panoramas of a folder with an `INDEX.csv` of columns name, environment, tilt_x_deg, tilt_z_deg.

    The room's zenith is proportional to (tan tilt_x, 1, tan tilt_z) with X towards longitude +90 degrees, Y up, Z
    towards longitude 0. Raises `InvalidInputError` that names the file and the line.
    """

    def panorama(row: dict[str, str], folder: Path) -> Panorama:
        tan_x, tan_z = (np.tan(np.deg2rad(float(row[key]))) for key in ("tilt_x_deg", "tilt_z_deg"))
        x, y, z = (float(value) for value in np.array([tan_z, -tan_x, 1.0]) / np.sqrt(tan_x**2 + tan_z**2 + 1.0))
        return Panorama(row["name"], folder / f"{row['name']}.jpg", row["environment"], (x, y, z))

    return read_index(directory, ("name", "environment", "tilt_x_deg", "tilt_z_deg"), panorama)


def read_index(
    directory: str | os.PathLike[str], columns: Sequence[str], make: Callable[[dict[str, str], Path], Item]
) -> list[Item]:
    """`make(row, folder)` of each row of a folder's `INDEX.csv`. Raises `InvalidInputError` with file and line.

    Angles (`..._deg`) are finite, and names are those of one row each.
    """
    index = Path(directory) / "INDEX.csv"
    table = CsvFile(index, "an index of panoramas")
    for column in columns:
        if column not in table.header:
            raise InvalidInputError(f"{table.where(1)}: no column {column!r}, expected {', '.join(columns)}")
    items: list[Item] = []
    names: set[str] = set()
    for line, cells in table.rows():
        row = dict(zip(table.header, cells, strict=True))
        for column in columns:
            if column.endswith("_deg"):
                table.number(line, column, row[column])
        if row["name"] in names:
            raise InvalidInputError(
                f"{table.where(line)}: name {row['name']!r} again, expected one row for each panorama"
            )
        names.add(row["name"])
        items.append(make(row, index.parent))
    if not items:
        raise InvalidInputError(f"{index}: no rows, expected a panorama in each")
    return items


class PanoramaViews:
    """Views of one panorama through one camera by a leaning robot. Good for several threads at once."""

    def __init__(
        self, panorama: Panorama, camera: Camera, *, robot_from_camera: ArrayLike | None = None, samples: int = 2,
        upright: bool = True,
    ) -> None:  # fmt: skip
        """`samples` x `samples` rays are averaged in each pixel; `upright` turns the panorama by its zenith first.

        Raises `ImageFileError`, and `InvalidInputError` for an image that shows no whole sphere.
        """
        self._rays = _rays_of(camera, samples)
        self._pixels = self._rays.pixels
        self._shape = (camera.height, camera.width)
        image = gray_from(read_image(panorama.path), str(panorama.path))
        self._size = (image.shape[1], image.shape[0])
        if self._size[0] != 2 * self._size[1]:
            told = f"{self._size[0]} x {self._size[1]} pixels"
            raise InvalidInputError(f"{panorama.path}: {told}, expected a panorama, twice as wide as high")
        # A few columns of each side on the other, so that interpolation goes round, and the poles' rows once more.
        self._image = np.pad(np.pad(image, ((0, 0), (_WRAP, _WRAP)), "wrap"), ((_WRAP, _WRAP), (0, 0)), "edge")
        zenith = panorama.zenith if upright and panorama.zenith is not None else (0.0, 0.0, 1.0)
        self._sphere_from_upright = _SPHERE_FROM_ROBOT @ leaning_from_upright(zenith)
        self._robot_from_camera = np.eye(3) if robot_from_camera is None else np.asarray(robot_from_camera, np.float64)

    def render(
        self, normal: ArrayLike, *, yaw_rad: float = 0.0, noise_sigma: float = 2.0, seed: int = 0
    ) -> NDArray[np.uint8]:
        """(H, W) uint8: seen by a robot whose ground normal is `normal` (3,); noise in grey levels, outside black.

        `yaw_rad` is the robot's heading, counter-clockwise from the middle of the panorama. Raises `InvalidInputError`
        for noise that is none.
        """
        if not 0.0 <= noise_sigma <= 255.0:
            raise InvalidInputError(f"noise_sigma = {noise_sigma}, expected grey levels from 0 to 255")
        levels = self.levels(normal, yaw_rad=yaw_rad)
        if noise_sigma > 0.0:
            levels += np.random.default_rng(seed).normal(0.0, noise_sigma, levels.shape).astype(np.float32)
        return np.asarray(np.clip(np.rint(levels, out=levels), 0, 255, out=levels), dtype=np.uint8)

    def levels(self, normal: ArrayLike, *, yaw_rad: float = 0.0) -> NDArray[np.float32]:
        """(H, W) float32: the grey levels of that view before noise and rounding."""
        cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
        turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        rotation = self._sphere_from_upright @ turn @ leaning_from_upright(normal).T @ self._robot_from_camera
        across, down = self._rays.panorama_map(rotation, width=self._size[0], height=self._size[1])
        across += _WRAP
        down += _WRAP
        n, seen = across.shape
        sums = np.empty(seen, dtype=np.float32)
        for start in range(0, seen, _BLOCK):
            block = slice(start, start + _BLOCK)
            # Rays that the lens does not see are far outside, where it is black.
            values = cv2.remap(
                self._image, across[:, block], down[:, block], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT
            )
            np.sum(values, axis=0, dtype=np.float32, out=sums[block])
        levels = np.zeros(self._shape, dtype=np.float32)
        levels.ravel()[self._pixels] = sums / n
        return levels


@functools.lru_cache(maxsize=6)
def _rays_of(camera: Camera, samples: int) -> PixelRays:
    return PixelRays(camera, samples=samples)


_WRAP = 4
_BLOCK = 16384
"""Columns that are looked up at once; OpenCV takes less than 32767."""

_SPHERE_FROM_ROBOT = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""Forward, left, up to the panorama's right, down, forward."""
