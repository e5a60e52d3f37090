"""Upright panoramas as a source of images of known tilt: an index of them, and views of them through any camera."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import cv2
import numpy as np

from tiltvp._core import leaning_from_upright
from tiltvp.cameras import Camera
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
"""The seven leans (alpha, beta) of paper 000, table 1, in degrees."""


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
    """`make(row, folder)` of each row of a folder's `INDEX.csv`; what it cannot read is named with file and line."""
    index = Path(directory) / "INDEX.csv"
    try:
        with index.open(newline="", encoding="utf-8") as lines:
            rows = list(csv.DictReader(lines))
    except OSError as error:
        raise InvalidInputError(f"{index}: {error.strerror or error}, expected an index of panoramas") from error
    items = []
    for number, row in enumerate(rows, start=2):
        try:
            items.append(make(row, index.parent))
        except (KeyError, ValueError, TypeError) as error:
            expected = f"the columns {', '.join(columns)}"
            raise InvalidInputError(f"{index}, line {number}: {error!r}, expected {expected}") from error
    if not items:
        raise InvalidInputError(f"{index}: no rows, expected a panorama in each")
    return items


class PanoramaViews:
    """Views of one panorama through one camera by a leaning robot."""

    def __init__(
        self, panorama: Panorama, camera: Camera, *, robot_from_camera: ArrayLike | None = None, samples: int = 2,
        upright: bool = True,
    ) -> None:  # fmt: skip
        """`samples` x `samples` rays are averaged in each pixel; `upright` turns the panorama by its zenith first."""
        if samples < 1:
            raise InvalidInputError(f"samples = {samples}, expected 1 or more")
        image = gray_from(read_image(panorama.path), str(panorama.path))
        self._size = (image.shape[1], image.shape[0])
        # A few columns of each side on the other, so that interpolation goes round.
        self._image = np.concatenate([image[:, -_WRAP:], image, image[:, :_WRAP]], axis=1)
        self._camera, self._samples = camera, samples
        zenith = panorama.zenith if upright and panorama.zenith is not None else (0.0, 0.0, 1.0)
        self._panorama_from_upright = leaning_from_upright(zenith)
        places = (np.arange(samples) + 0.5) / samples - 0.5
        u = (np.arange(camera.width)[:, None] + places).ravel()
        v = (np.arange(camera.height)[:, None] + places).ravel()
        bearings = camera.unproject(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2))
        rotation = np.eye(3) if robot_from_camera is None else np.asarray(robot_from_camera, dtype=np.float64)
        self._seen = ~np.isnan(bearings[:, 0])
        self._bearings = np.nan_to_num(bearings, nan=1.0) @ rotation.T

    def render(
        self, normal: ArrayLike, *, yaw_rad: float = 0.0, noise_sigma: float = 2.0, seed: int = 0
    ) -> NDArray[np.uint8]:
        """(H, W) uint8: seen by a robot whose ground normal is `normal` (3,); noise in grey levels, outside black."""
        turn = np.array(
            [[np.cos(yaw_rad), -np.sin(yaw_rad), 0.0], [np.sin(yaw_rad), np.cos(yaw_rad), 0.0], [0.0, 0.0, 1.0]]
        )
        directions = self._bearings @ (self._panorama_from_upright @ turn @ leaning_from_upright(normal).T).T
        # Forward, left, up to the panorama's camera frame: right, down, forward.
        eye = np.stack([-directions[:, 1], -directions[:, 2], directions[:, 0]], axis=1)
        sphere = Camera.equirectangular(width=self._size[0], height=self._size[1])
        places = sphere.project(eye).astype(np.float32) + np.array([_WRAP, 0.0], dtype=np.float32)
        shape = (self._camera.height * self._samples, self._camera.width * self._samples)
        across, down = (np.ascontiguousarray(places[:, axis]).reshape(shape) for axis in (0, 1))
        values = cv2.remap(self._image, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).astype(
            np.float32
        )
        values[~self._seen.reshape(shape)] = 0.0
        n = self._samples
        levels = values.reshape(self._camera.height, n, self._camera.width, n).mean(axis=(1, 3))
        levels += np.random.default_rng(seed).normal(0.0, noise_sigma, levels.shape).astype(np.float32)
        return np.asarray(np.clip(np.rint(levels), 0, 255), dtype=np.uint8)


_WRAP = 4
