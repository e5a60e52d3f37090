"""Drives read back from their folders: frames with poses, and the upright edges that are in sight in each."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tiltvp.csv_files import CsvFile
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.driving import POSES, TRUTH
from tiltvp.lab.datasets.folder import TiltDataset, read_dataset
from tiltvp.synth import DriveTruth

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["DrivenFrames", "read_drive"]


@dataclass(frozen=True, eq=False)
class DrivenFrames:
    """The frames of a drive and what is known of them. N is their number."""

    dataset: TiltDataset
    """Camera, mounting, and one image for each frame."""
    poses: NDArray[np.float64]
    """(N, 3): true x_m, y_m, yaw_rad of the robot."""
    truths: tuple[DriveTruth, ...]
    """(N,): the edges in sight."""

    @property
    def name(self) -> str:
        """That of the folder."""
        return self.dataset.directory.resolve().name

    def __len__(self) -> int:
        return len(self.truths)

    def gray(self, frame: int) -> NDArray[np.uint8]:
        """(H, W) uint8: the grey levels of a frame. Raises `ImageFileError`."""
        return self.dataset.read(self.dataset.images[frame])

    def tilt(self, frame: int) -> tuple[float, float]:
        """The true alpha_rad, beta_rad of a frame."""
        image = self.dataset.images[frame]
        return image.alpha_rad, image.beta_rad


def read_drive(directory: str | os.PathLike[str]) -> DrivenFrames:
    """The drive that `write_drive` (`tiltvp dataset drive`) has put into a folder. Images are not read yet.

    Raises `InvalidInputError` with what is wrong and where.
    """
    dataset = read_dataset(directory)
    count = len(dataset.images)
    poses = _columns(Path(directory) / "poses.csv", POSES, ("x_m", "y_m", "yaw_rad"))
    if len(poses) != count:
        raise InvalidInputError(f"{directory}: {len(poses)} poses, expected {count}, one for each image")
    path = Path(directory) / "truth.csv"
    rows = _columns(path, TRUTH, TRUTH)
    frames = rows[:, 0]
    if not (np.isin(frames, np.arange(count)).all() and (np.diff(frames) >= 0.0).all()):
        raise InvalidInputError(f"{path}: frames out of order, expected numbers from 0 to {count - 1} that rise")
    parts = np.split(rows, np.searchsorted(frames, np.arange(1, count)))
    return DrivenFrames(dataset, poses, tuple(_truth(part) for part in parts))


def _truth(rows: NDArray[np.float64]) -> DriveTruth:
    """What one frame's rows of `TRUTH` say."""
    _, edges, bearings, low, high, share, contrast = rows.T
    return DriveTruth(edges.astype(np.int64), bearings, np.stack([low, high], axis=1), share, contrast)


def _columns(path: Path, header: Sequence[str], wanted: Sequence[str]) -> NDArray[np.float64]:
    """(rows, wanted): columns of numbers of a table that has just this header."""
    table = CsvFile(path, "a file of a drive (tiltvp dataset drive)")
    if table.header != list(header):
        raise InvalidInputError(f"{table.where(1)}: other columns, expected {', '.join(header)}")
    places = {name: table.header.index(name) for name in wanted}
    rows = [[table.number(line, name, cells[place]) for name, place in places.items()] for line, cells in table.rows()]
    return np.array(rows, dtype=np.float64).reshape(len(rows), len(wanted))
