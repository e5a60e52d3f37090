"""Drives read back from their folders: frames with poses, and the upright edges that are in sight in each."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tiltvp.csv_files import LARGEST_CSV_BYTES
from tiltvp.errors import InvalidInputError
from tiltvp.files import read_text
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
    try:
        lines = csv.reader(io.StringIO(read_text(path, LARGEST_CSV_BYTES), newline=""))
    except OSError as error:
        problem = error.strerror or error
        raise InvalidInputError(f"{path}: {problem}, expected a file of a drive (tiltvp dataset drive)") from error
    except UnicodeDecodeError as error:
        raise InvalidInputError(f"{path}: not UTF-8, expected a file of a drive (tiltvp dataset drive)") from error
    try:
        found = next(lines, [])
        if tuple(found) != tuple(header):
            raise InvalidInputError(f"{path}, line 1: expected the columns {', '.join(header)}")
        places = [found.index(name) for name in wanted]
        rows = [[float(row[place]) for place in places] for row in lines if row]
    except (ValueError, IndexError, csv.Error) as error:
        raise InvalidInputError(f"{path}, line {lines.line_num}: {error}, expected {len(header)} cells") from error
    return np.array(rows, dtype=np.float64).reshape(len(rows), len(wanted))
