"""Tables of odometry: the one format, docs/recordings.md, in which each kind of record has its columns."""

from __future__ import annotations

import os
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp.csv_files import CsvFile
from tiltvp.errors import InvalidInputError, counted
from tiltvp.streams.odometry import Motion, Odometry
from tiltvp.streams.wheels import Wheels, cumulative_m

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["OdometryTable"]

_KINDS: Final[dict[str, tuple[str, ...]]] = {
    "poses": ("x_m", "y_m"),
    "velocities": ("speed_mps", "yaw_rate_radps"),
    "ticks": ("left_ticks", "right_ticks"),
    "wheels": ("left_m", "right_m"),
    "increments": (),
}
"""The columns that tell each kind from the others."""
_MOTION: Final = ("yaw_rad", "yaw_deg", "distance_m")
_ALIASES: Final = {"delta_left_m": "left_m", "delta_right_m": "right_m"}
"""Columns of the logs of `tiltvp calibrate`."""
_KEYS: Final = ("time_s", "file", "step")
_KNOWN: Final = (*_KEYS, *(name for names in _KINDS.values() for name in names), *_MOTION, *_ALIASES)


@dataclass(frozen=True, eq=False)
class OdometryTable:
    """A table of odometry as it was read. N is the number of rows."""

    name: str
    """The path, for messages."""
    kind: str
    columns: dict[str, NDArray[np.float64]]
    """(N,) each: the numbers of the columns, of `left_m` and `right_m` where others are called differently."""
    lines: list[int]
    """(N,): where in the file each row is."""
    files: list[str] | None = None
    """(N,): the image that each row belongs to; None without such a column."""

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> OdometryTable:
        """Reads a CSV file. Raises `InvalidInputError` that names file and line."""
        table = CsvFile.asked(path, "odometry as CSV")
        kind = _kind_of(table.name, table.header)
        names = [_ALIASES.get(column, column) for column in table.header]
        places = {name: place for place, name in enumerate(names) if name not in ("file", "step")}
        numbers, lines, files = {name: array("d") for name in places}, [], []
        for line, cells in table.rows():
            lines.append(line)
            for name, place in places.items():
                numbers[name].append(table.number(line, name, cells[place]))
            if "file" in names:
                files.append(cells[names.index("file")])
        columns = {name: np.array(values, dtype=np.float64) for name, values in numbers.items()}
        return cls(table.name, kind, columns, lines, files if "file" in names else None)

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def times_s(self) -> NDArray[np.float64] | None:
        """(N,): when each row was recorded; None without such a column."""
        return self.columns.get("time_s")

    @property
    def steps(self) -> NDArray[np.float64] | None:
        """(N, D): what each row tells since the row before; None where rows tell poses, counters or velocities."""
        if self.kind not in ("wheels", "increments"):
            return None
        return np.stack([values for name, values in self.columns.items() if name not in _KEYS], axis=1)

    @property
    def distances_known(self) -> bool:
        """Whether it tells how far the robot drove, and not its turns alone."""
        return self.kind != "increments" or "distance_m" in self.columns

    @property
    def _yaw(self) -> NDArray[np.float64] | None:
        degrees = self.columns.get("yaw_deg")
        return self.columns.get("yaw_rad") if degrees is None else np.radians(degrees)

    def odometry(self, wheels: Wheels) -> Odometry:
        """The record over time. Raises `InvalidInputError` for times that do not rise, and for what `wheels` lacks."""
        times = self.times_s
        if times is None:
            raise InvalidInputError(f"{self.name}: no column time_s, expected one")
        falls = np.flatnonzero(np.diff(times) <= 0.0)
        if len(falls):
            before, after = times[falls[0] : falls[0] + 2].tolist()
            line = self.lines[falls[0] + 1]
            raise InvalidInputError(f"{self.name}, line {line}: time_s = {after} after {before}, expected rising times")
        more: dict[str, Any] = {"source": self.name, "gap_max_s": wheels.gap_max_s}
        c = self.columns
        if self.kind == "poses":
            return Odometry.from_poses(times, c["x_m"], c["y_m"], self._needed_yaw(), **more)
        if self.kind == "velocities":
            return Odometry.from_velocities(times, c["speed_mps"], c["yaw_rate_radps"], **more)
        if self.kind == "ticks":
            turned, notes = self._ticks(wheels)
            return Odometry.from_wheels(times, turned, wheel_base_m=wheels.wheel_base_m, notes=notes, **more)
        rolled = self._rolled()
        if rolled is not None and not set(_MOTION) & set(c):
            return Odometry.from_wheels(times, np.cumsum(rolled, axis=0), wheel_base_m=wheels.wheel_base_m, **more)
        distance, yaw = self._increments(wheels)
        summed = None if yaw is None else np.cumsum(yaw)
        return Odometry(
            times, np.cumsum(distance), summed, None if rolled is None else np.cumsum(rolled, axis=0), **more
        )

    def motions(self, names: Sequence[str], wheels: Wheels) -> tuple[list[Motion], list[int], bool]:
        """The motion that led to each frame, by its row; the row of each; and whether turns are known.

        Raises `InvalidInputError` for rows of no frame and frames without a row.
        """
        rows = list(range(len(self))) if self.files is None else self._rows_of(names)
        if len(rows) != len(names):
            told = counted(len(self), "rows")
            raise InvalidInputError(f"{self.name}: {told}, expected {len(names)}, one for each image")
        if self.kind == "velocities":
            raise InvalidInputError(f"{self.name}: velocities without times of the images, expected these to be known")
        if self.kind in ("poses", "ticks"):
            return *self._by_differences(rows, wheels), self.kind == "poses" or wheels.wheel_base_m is not None
        distance, yaw = self._increments(wheels)
        rolled = self._rolled()
        pairs = [None] * len(self) if rolled is None else [(left, right) for left, right in rolled.tolist()]
        turns = np.zeros(len(self)) if yaw is None else yaw
        return [Motion(float(turns[k]), float(distance[k]), pairs[k]) for k in rows], rows, yaw is not None

    def _by_differences(self, rows: list[int], wheels: Wheels) -> tuple[list[Motion], list[int]]:
        order = np.array(rows, dtype=np.int64)
        columns = {name: values[order] for name, values in self.columns.items()}
        columns["time_s"] = np.arange(len(rows), dtype=np.float64)
        record = OdometryTable(self.name, self.kind, columns, [self.lines[k] for k in rows]).odometry(wheels)
        return [motion or Motion() for motion in record.motions(columns["time_s"])], rows

    def _rolled(self) -> NDArray[np.float64] | None:
        """(N, 2): how far both wheels rolled since the row before."""
        return None if self.kind != "wheels" else np.stack([self.columns["left_m"], self.columns["right_m"]], axis=1)

    def _increments(self, wheels: Wheels) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
        """(N,) each: distance and turn since the row before, as recorded, or as the wheels have it."""
        rolled, yaw = self._rolled(), self._yaw
        distance = self.columns.get("distance_m")
        if rolled is not None:
            distance = rolled.mean(axis=1) if distance is None else distance
            if yaw is None and wheels.wheel_base_m is not None:
                yaw = (rolled[:, 1] - rolled[:, 0]) / wheels.wheel_base_m
        return np.zeros(len(self)) if distance is None else distance, yaw

    def _ticks(self, wheels: Wheels) -> tuple[NDArray[np.float64], tuple[str, ...]]:
        if wheels.wheel_radius_m is None or wheels.ticks_per_turn is None:
            raise InvalidInputError(f"{self.name}: counters of wheels, expected --wheel-radius and --ticks-per-turn")
        counts = np.stack([self.columns["left_ticks"], self.columns["right_ticks"]], axis=1)
        return cumulative_m(counts, wheels.ticks_per_turn, wheels.wheel_radius_m, self.name)

    def _needed_yaw(self) -> NDArray[np.float64]:
        yaw = self._yaw
        assert yaw is not None
        return yaw

    def _rows_of(self, names: Sequence[str]) -> list[int]:
        """The row of each frame: a row names a path as it was given, or the one file of that name."""
        assert self.files is not None
        places: dict[str, list[int]] = {}
        for i, name in enumerate(names):
            for key in dict.fromkeys((name, Path(name).name)):
                places.setdefault(key, []).append(i)
        found: dict[int, int] = {}
        for k, (line, word) in enumerate(zip(self.lines, self.files, strict=True)):
            known = places.get(word, [])
            where = f"{self.name}, line {line}: file {word!r}"
            if len(known) != 1:
                what = "is no image given" if not known else f"is the name of {counted(len(known), 'images')}"
                raise InvalidInputError(f"{where} {what}, expected the name or path of one image")
            if known[0] in found:
                raise InvalidInputError(f"{where} again, expected one row for each image")
            found[known[0]] = k
        missing = [name for i, name in enumerate(names) if i not in found]
        if missing:
            raise InvalidInputError(
                f"{self.name}: no row for {missing[0]} ({len(missing)} missing), expected one for each image"
            )
        return [found[i] for i in range(len(names))]


def _kind_of(name: str, header: Sequence[str]) -> str:
    where = f"{name}, line 1"
    names = [_ALIASES.get(column, column) for column in header]
    for column, known in zip(header, names, strict=True):
        if column not in _KNOWN:
            raise InvalidInputError(f"{where}: unknown column {column!r}, expected {', '.join(_KNOWN)}")
        if names.count(known) > 1:
            raise InvalidInputError(f"{where}: column {known!r} twice, expected once")
    if {"yaw_rad", "yaw_deg"} <= set(names):
        raise InvalidInputError(f"{where}: columns yaw_rad and yaw_deg, expected one of them")
    kinds = [kind for kind, columns in _KINDS.items() if set(columns) & set(names)]
    for kind in kinds:
        if not set(_KINDS[kind]) <= set(names):
            raise InvalidInputError(f"{where}: one of the columns {' and '.join(_KINDS[kind])}, expected both or none")
    motion = set(_MOTION) & set(names)
    if len(kinds) > 1 or (motion and kinds and kinds[0] in ("velocities", "ticks")):
        raise InvalidInputError(f"{where}: columns of several kinds of odometry, expected those of one")
    if kinds == ["poses"] and (not motion or "distance_m" in motion):
        raise InvalidInputError(f"{where}: poses by {', '.join(names)}, expected x_m, y_m and yaw_rad or yaw_deg")
    if not kinds and not motion:
        every = "; ".join(",".join(columns) for columns in _KINDS.values() if columns)
        raise InvalidInputError(
            f"{where}: no motion, expected a column yaw_rad, yaw_deg or distance_m, or both of one of: {every}"
        )
    return kinds[0] if kinds else "increments"
