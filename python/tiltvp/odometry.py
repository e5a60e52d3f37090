"""Odometry files: how far a robot has turned and driven from each image to the next."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tiltvp.csv_files import CsvFile
from tiltvp.errors import InvalidInputError

__all__ = ["Motion", "read_odometry"]

_COLUMNS = ("file", "yaw_rad", "yaw_deg", "distance_m")
_WHEELS = ("left_m", "right_m")
"""Columns that may stand, both, beside the motion that they add up to."""


@dataclass(frozen=True)
class Motion:
    """What the robot did between the image before and this one."""

    yaw_rad: float = 0.0
    """How far it turned, to the left positive."""
    distance_m: float = 0.0
    """How far it drove, forwards positive."""
    wheels_m: tuple[float, float] | None = None
    """How far the left and the right wheel rolled; None where that is not recorded."""


def read_odometry(path: str | os.PathLike[str], files: Sequence[Path]) -> list[Motion]:
    """The motion that led to each of `files`, in their order, from a CSV of increments.

    Columns: `yaw_rad` or `yaw_deg`, `distance_m`, at least one of the two kinds; and `file`, the images' names or
    paths, in any order; and `left_m` and `right_m`, what the wheels rolled, beside them. Without `file` there is one
    row for each image, in their order. Raises `InvalidInputError` that names the file and the line for columns and
    images that are not known, images without a row, and numbers that are none.
    """
    table = CsvFile(path, "odometry as CSV")
    name, header = table.name, table.header
    _check_header(name, header)
    rows = [(line, dict(zip(header, cells, strict=True))) for line, cells in table.rows()]
    motions = [(line, row, _motion(f"{name}, line {line}", row)) for line, row in rows]
    if "file" not in header:
        if len(motions) != len(files):
            raise InvalidInputError(f"{name}: {len(motions)} rows, expected {len(files)}, one for each image")
        return [motion for _, _, motion in motions]
    return _by_file(name, motions, files)


def _check_header(name: str, header: Sequence[str]) -> None:
    where = f"{name}, line 1"
    for column in header:
        if column not in (*_COLUMNS, *_WHEELS):
            raise InvalidInputError(f"{where}: unknown column {column!r}, expected {', '.join(_COLUMNS)}")
        if header.count(column) > 1:
            raise InvalidInputError(f"{where}: column {column!r} twice, expected once")
    if "yaw_rad" in header and "yaw_deg" in header:
        raise InvalidInputError(f"{where}: columns yaw_rad and yaw_deg, expected one of them")
    if len(set(header) & set(_WHEELS)) == 1:
        raise InvalidInputError(f"{where}: one of the columns left_m and right_m, expected both or none")
    if not set(header) & {"yaw_rad", "yaw_deg", "distance_m"}:
        raise InvalidInputError(f"{where}: no motion, expected a column yaw_rad, yaw_deg or distance_m")


def _motion(where: str, row: dict[str, str]) -> Motion:
    numbers = {}
    for column in ("yaw_rad", "yaw_deg", "distance_m", *_WHEELS):
        word = row.get(column, "0")
        try:
            numbers[column] = float(word)
        except ValueError:
            numbers[column] = math.nan
        if not math.isfinite(numbers[column]):
            raise InvalidInputError(f"{where}: {column} = {word!r}, expected a finite number")
    wheels = (numbers["left_m"], numbers["right_m"]) if "left_m" in row else None
    return Motion(numbers["yaw_rad"] + math.radians(numbers["yaw_deg"]), numbers["distance_m"], wheels)


def _by_file(name: str, motions: Sequence[tuple[int, dict[str, str], Motion]], files: Sequence[Path]) -> list[Motion]:
    """The motions in the order of the files: a row names a path as it was given, or the one file of that name."""
    places: dict[str, list[int]] = {}
    for i, file in enumerate(files):
        for key in dict.fromkeys((str(file), file.name)):
            places.setdefault(key, []).append(i)
    found: dict[int, Motion] = {}
    for line, row, motion in motions:
        where, word = f"{name}, line {line}", row["file"]
        known = places.get(word, [])
        if len(known) != 1:
            what = "is no image given" if not known else f"is the name of {len(known)} images"
            raise InvalidInputError(f"{where}: file {word!r} {what}, expected the name or path of one image")
        if known[0] in found:
            raise InvalidInputError(f"{where}: file {word!r} again, expected one row for each image")
        found[known[0]] = motion
    missing = [str(file) for i, file in enumerate(files) if i not in found]
    if missing:
        raise InvalidInputError(
            f"{name}: no row for {missing[0]} ({len(missing)} missing), expected one for each image"
        )
    return [found[i] for i in range(len(files))]
