"""Logs of a drive: the displacements of the wheels step by step, and the bearings of landmarks, as two CSV files."""

from __future__ import annotations

import csv
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["DriveLog", "read_drive_log"]

_ODOMETRY = ("step", "time_s", "delta_left_m", "delta_right_m")
_BEARINGS = ("step", "landmark", "bearing_rad")


@dataclass(frozen=True)
class DriveLog:
    """What a robot has recorded."""

    odometry: NDArray[np.float64]
    """(N, 2): displacement of the left and the right wheel since the step before, metres."""
    bearings: NDArray[np.float64]
    """(M, 3): row of `odometry` after whose motion it was taken, landmark, bearing in radians."""
    times_s: NDArray[np.float64] | None
    """(N,): when each step ended; None where the file has no column time_s."""


def read_drive_log(odometry: str | os.PathLike[str], bearings: str | os.PathLike[str]) -> DriveLog:
    """Reads the two files of a drive.

    Columns of the odometry: `step`, `delta_left_m`, `delta_right_m`, and `time_s` if known; of the bearings: `step`,
    `landmark`, `bearing_rad`, taken at the end of that step's motion, in the sensor's frame, counter-clockwise. Steps
    and landmarks are whole numbers, steps of the odometry grow. Raises `InvalidInputError` that names file and line.
    """
    steps, rows = _table(odometry, _ODOMETRY, optional="time_s")
    order: dict[int, int] = {}
    for i, (where, row) in enumerate(rows):
        step = _whole(where, "step", row["step"])
        if order and step <= max(order):
            raise InvalidInputError(f"{where}: step {step} after {max(order)}, expected growing steps")
        order[step] = i
    numbers = [[_number(where, row, c) for c in ("delta_left_m", "delta_right_m")] for where, row in rows]
    times = [_number(where, row, "time_s") for where, row in rows] if "time_s" in steps else None
    _, seen = _table(bearings, _BEARINGS)
    found = []
    for where, row in seen:
        step = _whole(where, "step", row["step"])
        if step not in order:
            raise InvalidInputError(f"{where}: step {step} is not one of {os.fspath(odometry)}")
        landmark = _whole(where, "landmark", row["landmark"])
        found.append([order[step], landmark, _number(where, row, "bearing_rad")])
    return DriveLog(
        np.array(numbers, dtype=np.float64).reshape(-1, 2),
        np.array(found, dtype=np.float64).reshape(-1, 3),
        None if times is None else np.array(times, dtype=np.float64),
    )


def _table(
    path: str | os.PathLike[str], columns: tuple[str, ...], optional: str = ""
) -> tuple[list[str], list[tuple[str, dict[str, str]]]]:
    """The header, and each row with the words that say where it is."""
    name = os.fspath(path)
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InvalidInputError(f"{name}: cannot be read ({error.strerror or error}), expected a CSV file") from error
    except UnicodeDecodeError as error:
        raise InvalidInputError(f"{name}: not UTF-8, expected a CSV file") from error
    lines = csv.reader(text.splitlines())
    header = [cell.strip() for cell in next(lines, [])]
    expected = ", ".join(columns)
    for column in columns:
        if header.count(column) != 1 and not (column == optional and column not in header):
            raise InvalidInputError(
                f"{name}, line 1: column {column!r} {header.count(column)} times, expected {expected}"
            )
    rows = []
    for cells in lines:
        if not any(cell.strip() for cell in cells):
            continue
        if len(cells) != len(header):
            raise InvalidInputError(f"{name}, line {lines.line_num}: {len(cells)} cells, expected {len(header)}")
        rows.append((f"{name}, line {lines.line_num}", dict(zip(header, (c.strip() for c in cells), strict=True))))
    if not rows:
        raise InvalidInputError(f"{name}: no rows, expected {expected}")
    return header, rows


def _number(where: str, row: dict[str, str], column: str) -> float:
    try:
        value = float(row[column])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InvalidInputError(f"{where}: {column} = {row[column]!r}, expected a finite number")
    return value


def _whole(where: str, column: str, word: str) -> int:
    try:
        return int(word)
    except ValueError:
        raise InvalidInputError(f"{where}: {column} = {word!r}, expected a whole number") from None
