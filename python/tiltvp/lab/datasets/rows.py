"""`images.csv`: where each image was taken, and how the robot leaned."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final

from tiltvp._core import tilt_from_wheel_heights
from tiltvp.csv_files import LARGEST_CSV_BYTES
from tiltvp.errors import InvalidInputError
from tiltvp.files import read_text
from tiltvp.lab.datasets.description import Wheels
from tiltvp.lab.datasets.findings import Findings, near

__all__ = ["ROWS", "TiltImage", "read_rows"]

ROWS: Final = "images.csv"

_PLACES: Final = ("file", "location", "environment")
_ANGLES: Final = ("alpha_deg", "beta_deg")
_HEIGHTS: Final = ("left_mm", "right_mm", "caster_mm")
_COLUMNS: Final = (*_PLACES, *_ANGLES, *_HEIGHTS, "yaw_deg")
_FORMS: Final = f"{', '.join(_PLACES)} and either {', '.join(_ANGLES)} or {', '.join(_HEIGHTS)}"


@dataclass(frozen=True)
class TiltImage:
    """An image of known lean: its file as the dataset names it, where that is, where it was taken, and the truth.

    `yaw_rad` is the heading of the view, which turns errors into a frame that the views of a location share.
    """

    file: str
    path: Path
    location: str
    environment: str
    alpha_rad: float
    beta_rad: float
    yaw_rad: float = 0.0


def read_rows(directory: Path, wheels: Wheels | None, findings: Findings) -> tuple[TiltImage, ...]:
    """The images of a dataset, in the order of the file; rows that cannot be read go to `findings` instead."""
    file = directory / ROWS
    try:
        text = read_text(file, LARGEST_CSV_BYTES)
        reader = csv.reader(text.splitlines(), strict=True)
        lines = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except OSError as error:
        findings.add(file, None, error.strerror or str(error), f"a table with the columns {_FORMS}")
        return ()
    except (UnicodeDecodeError, csv.Error) as error:
        findings.add(file, None, f"is not CSV in UTF-8 ({error})", f"a table with the columns {_FORMS}")
        return ()
    lines = [(number, row) for number, row in lines if any(row)]
    if not lines or not _columns_are_sound(file, *lines[0], wheels, findings):
        if not lines:
            findings.add(file, None, "is empty", f"a table with the columns {_FORMS}")
        return ()
    (_, columns), *rows = lines
    if not rows:
        findings.add(file, None, "no rows", "an image in each")
    reading = _Reading(directory, file, wheels, findings)
    images = []
    for number, row in rows:
        if len(row) != len(columns):
            findings.add(file, number, f"{len(row)} cells", f"{len(columns)}, one for each column")
            continue
        image = reading.image(number, dict(zip(columns, row, strict=True)))
        if image is not None:
            images.append(image)
    return tuple(images)


def _columns_are_sound(file: Path, line: int, columns: list[str], wheels: Wheels | None, findings: Findings) -> bool:
    before = len(findings.all)
    for place, column in enumerate(columns):
        if column not in _COLUMNS:
            findings.add(file, line, f"unknown column {column!r}{near(column, _COLUMNS)}", f"{_FORMS}, perhaps yaw_deg")
        elif column in columns[:place]:
            findings.add(file, line, f"the column {column} twice", "each column once")
    for column in _PLACES:
        if column not in columns:
            findings.add(file, line, f"no column {column}", _FORMS)
    angles, heights = ([name for name in form if name in columns] for form in (_ANGLES, _HEIGHTS))
    one_form = f"either {', '.join(_ANGLES)} or {', '.join(_HEIGHTS)}"
    if angles and heights:
        findings.add(file, line, f"the columns {', '.join(angles + heights)}", one_form)
    elif not angles and not heights:
        findings.add(file, line, "no columns of the true lean", one_form)
    else:
        for column in _ANGLES if angles else _HEIGHTS:
            if column not in columns:
                findings.add(file, line, f"no column {column}", one_form)
    if heights and not angles and wheels is None:
        findings.add(file, line, "wheel heights without the wheels", "a table [wheels] in dataset.toml")
    return len(findings.all) == before


class _Reading:
    """Reads row after row, and remembers what may not come again."""

    def __init__(self, directory: Path, file: Path, wheels: Wheels | None, findings: Findings) -> None:
        self._directory, self._file, self._wheels, self._findings = directory, file, wheels, findings
        self._line_of_file: dict[str, int] = {}
        self._environment_of: dict[str, tuple[str, int]] = {}

    def image(self, line: int, row: Mapping[str, str]) -> TiltImage | None:
        """The image of a row; None if anything is wrong with it."""
        before = len(self._findings.all)
        for column in _PLACES:
            if not row[column]:
                self._add(line, f"{column} is empty", "a name")
        self._check_file(line, row["file"])
        self._check_places(line, row["location"], row["environment"])
        alpha_rad, beta_rad = self._angles(line, row) if "alpha_deg" in row else self._angles_of_wheels(line, row)
        yaw_deg = self._number(line, row, "yaw_deg", "degrees") if "yaw_deg" in row else 0.0
        if len(self._findings.all) > before:
            return None
        path = self._directory / row["file"]
        return TiltImage(
            row["file"], path, row["location"], row["environment"], alpha_rad, beta_rad, math.radians(yaw_deg)
        )

    def _add(self, line: int, what: str, expected: str) -> None:
        self._findings.add(self._file, line, what, expected)

    def _check_file(self, line: int, name: str) -> None:
        if not name:
            return
        path = PurePosixPath(name)
        if path.is_absolute() or ".." in path.parts:
            self._add(line, f"file {name!r}", "the path of an image in this folder, from this folder on")
        elif not os.path.isfile(self._directory / name):
            self._add(line, f"no file {name!r}", "an image in this folder")
        first = self._line_of_file.setdefault(str(path), line)
        if first != line:
            self._add(line, f"file {name!r} is in line {first} too", "each image once")

    def _check_places(self, line: int, location: str, environment: str) -> None:
        if location and environment:
            known, first = self._environment_of.setdefault(location, (environment, line))
            if known != environment:
                what = f"location {location!r} is in {environment!r}, in line {first} in {known!r}"
                self._add(line, what, "each location in one environment")

    def _angles(self, line: int, row: Mapping[str, str]) -> tuple[float, float]:
        alpha_deg = self._number(line, row, "alpha_deg", "degrees")
        if not 0.0 <= alpha_deg <= 90.0 and math.isfinite(alpha_deg):
            self._add(line, f"alpha_deg = {alpha_deg:g}", "a lean from 0 to 90 degrees")
        return math.radians(alpha_deg), math.radians(self._number(line, row, "beta_deg", "degrees"))

    def _angles_of_wheels(self, line: int, row: Mapping[str, str]) -> tuple[float, float]:
        left, right, caster = (1e-3 * self._number(line, row, column, "millimetres") for column in _HEIGHTS)
        if self._wheels is None or not all(map(math.isfinite, (left, right, caster))):
            return math.nan, math.nan
        try:
            return tilt_from_wheel_heights(
                left_m=left,
                right_m=right,
                caster_m=caster,
                half_track_m=self._wheels.half_track_m,
                caster_behind_m=self._wheels.caster_m,
            )
        except InvalidInputError as error:
            what, _, expected = str(error).partition(", expected ")
            self._add(line, what, expected)
            return math.nan, math.nan

    def _number(self, line: int, row: Mapping[str, str], column: str, unit: str) -> float:
        """A finite number; NaN, and a finding, for anything else."""
        try:
            value = float(row[column])
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self._add(line, f"{column} = {row[column]!r}", f"a number of {unit}")
            return math.nan
        return value
