"""Logs of a drive: the displacements of the wheels step by step, and the bearings of landmarks, as two CSV files."""

from __future__ import annotations

import math
import os
from array import array
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.csv_files import CsvFile
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

__all__ = ["READINGS", "DriveLog", "doubled_rows", "far_steps", "read_drive_log"]

_ODOMETRY = ("step", "time_s", "delta_left_m", "delta_right_m")
_BEARINGS = ("step", "landmark", "bearing_rad")
LARGEST_WHOLE: Final = 2**53 - 1
"""Of steps and landmarks: from the next on, two of them would be the same float."""
_LAGS: Final = range(2, 11)
"""Rows so far apart show how often two are equal by chance, as of counters and at an even speed."""
_BEYOND: Final = 5.0
"""Deviations of that chance: of logs whose rows never repeat two that do are told, and one is not."""
_COARSE: Final = 10.0
"""Finest steps of a counter by which rows change at least, in the median: slower changes take two rows for a step."""

_FAR_M: Final = 20.0
"""Steps of robots are shorter: told in millimetres, 98 % and more of those of five simulated and two real drives are
longer or turn by more than half a turn, and in metres none."""
_CHANCE: Final = 1e-3
"""Probability that all motions of equal times are equal although each was driven, where a clock is coarse."""


@dataclass(frozen=True, eq=False)
class DriveLog:
    """What a robot has recorded."""

    odometry: NDArray[np.float64]
    """(N, 2): displacement of the left and the right wheel since the step before, metres."""
    bearings: NDArray[np.float64]
    """(M, 3): row of `odometry` after whose motion it was taken, landmark, bearing in radians."""
    times_s: NDArray[np.float64] | None
    """(N,): when each step ended; None where the file has no column time_s."""

    def read_as(self, *conventions: str) -> DriveLog:
        """This log, recorded by other conventions than ours, by ours; names of `READINGS`.

        Raises `InvalidInputError` for other names.
        """
        log = self
        for name in conventions:
            if name not in READINGS:
                raise InvalidInputError(f"{name!r}: no convention of a log, expected one of {', '.join(READINGS)}")
            log = READINGS[name](log)
        return log

    def about_centre(self, off_rad: NDArray[np.float64]) -> DriveLog:
        """This log about the true image centre, where that is off by `LogCalibration.centre_off_rad`."""
        bearings = self.bearings.copy()
        forward, left = off_rad
        bearings[:, 2] += left * np.cos(self.bearings[:, 2]) - forward * np.sin(self.bearings[:, 2])
        return replace(self, bearings=bearings)


def _wheels(left: float, right: float) -> Callable[[DriveLog], DriveLog]:
    return lambda log: replace(log, odometry=log.odometry * [left, right])


def _bearings(factor: float) -> Callable[[DriveLog], DriveLog]:
    return lambda log: replace(log, bearings=log.bearings * [1.0, 1.0, factor])


READINGS: Final[dict[str, Callable[[DriveLog], DriveLog]]] = {
    "wheels-swapped": lambda log: replace(log, odometry=log.odometry[:, ::-1].copy()),
    "wheels-negated": _wheels(-1.0, -1.0),
    "left-wheel-negated": _wheels(-1.0, 1.0),
    "right-wheel-negated": _wheels(1.0, -1.0),
    "clockwise": _bearings(-1.0),
    "degrees": _bearings(math.pi / 180.0),
    "millimetres": _wheels(1e-3, 1e-3),
    "cumulative": lambda log: replace(log, odometry=np.diff(log.odometry, axis=0, prepend=0.0)),
}
"""How logs are recorded elsewhere: which wheel is which, which way they count, and in which units."""


def read_drive_log(odometry: str | os.PathLike[str], bearings: str | os.PathLike[str]) -> DriveLog:
    """Reads the two files of a drive.

    Columns of the odometry: `step`, `delta_left_m`, `delta_right_m`, and `time_s` if known; of the bearings: `step`,
    `landmark`, `bearing_rad`, taken at the end of that step's motion, in the sensor's frame, counter-clockwise. Steps
    and landmarks are whole numbers, these from 0, steps of the odometry grow and times do not fall, and a landmark has
    one bearing in a step. Raises `InvalidInputError` that names file and line.
    """
    table, columns = _table(odometry, _ODOMETRY, optional="time_s")
    order: dict[int, int] = {}
    last, wheels, times = None, array("d"), array("d")
    for line, cells in table.rows():
        step = _whole(table, line, "step", cells[columns["step"]])
        if last is not None and step <= last:
            raise InvalidInputError(f"{table.where(line)}: step {step} after {last}, expected growing steps")
        order[step], last = len(order), step
        wheels.extend(table.number(line, name, cells[columns[name]]) for name in ("delta_left_m", "delta_right_m"))
        if "time_s" in columns:
            time = table.number(line, "time_s", cells[columns["time_s"]])
            if times and time < times[-1]:
                raise InvalidInputError(
                    f"{table.where(line)}: time_s = {time} after {times[-1]}, expected rising times"
                )
            times.append(time)
    _refuse_nothing(table, len(order), _ODOMETRY)
    seen_from, columns = _table(bearings, _BEARINGS)
    found, lines = array("d"), array("q")
    for line, cells in seen_from.rows():
        step = _whole(seen_from, line, "step", cells[columns["step"]])
        if step not in order:
            raise InvalidInputError(f"{seen_from.where(line)}: step {step} is not one of {os.fspath(odometry)}")
        landmark = _whole(seen_from, line, "landmark", cells[columns["landmark"]], least=0)
        bearing = seen_from.number(line, "bearing_rad", cells[columns["bearing_rad"]])
        found.extend((order[step], landmark, bearing))
        lines.append(line)
    _refuse_nothing(seen_from, len(found), _BEARINGS)
    _refuse_twice(seen_from, np.array(found, dtype=np.float64).reshape(-1, 3)[:, :2], lines, list(order))
    return DriveLog(
        np.array(wheels, dtype=np.float64).reshape(-1, 2),
        np.array(found, dtype=np.float64).reshape(-1, 3),
        np.array(times, dtype=np.float64) if times else None,
    )


def doubled_rows(rows: NDArray[np.float64], times_s: NDArray[np.float64] | None = None) -> str:
    """A sentence about motions (N, D) that repeat the one before more often than chance has it; empty: none.

    With times (N,) also where they have the one before's time, as coarse counters do not tell otherwise.
    """
    if times_s is not None and (count := _doubled_at_once(rows, times_s)):
        return f"{count} of {len(rows)} motions repeat the one before and its time: were messages written down twice?"
    changes = np.abs(np.diff(rows, axis=0)).ravel()
    changes = changes[changes > 0.0]
    if not len(changes) or np.median(changes) < _COARSE * changes.min():
        return ""

    def equal(lag: int) -> int:
        return int(((rows[lag:] == rows[:-lag]).all(axis=1) & rows[lag:].any(axis=1)).sum())

    count, chance = equal(1), (sum(map(equal, _LAGS)) + 1) / len(_LAGS)
    if count <= chance + _BEYOND * math.sqrt(chance):
        return ""
    return f"{count} of {len(rows)} motions repeat the one before to the last digit: were messages written down twice?"


def far_steps(odometry: NDArray[np.float64], wheel_base_m: float) -> str:
    """A sentence about steps (N, 2) of which most turn or drive as far as no robot does; empty: fewer."""
    (left, right), moved = odometry.T, odometry.any(axis=1)
    far = (np.abs(right - left) > math.pi * wheel_base_m) | (np.abs(left + right) > 2.0 * _FAR_M)
    count, of = int(far.sum()), int(moved.sum())
    if 2 * count <= of:
        return ""
    told = f"{count} of {of} motions are of more than half a turn or {_FAR_M:g} m"
    return f"{told}: are displacements in millimetres, or summed up?"


def _doubled_at_once(rows: NDArray[np.float64], times_s: NDArray[np.float64]) -> int:
    """How many motions repeat one of their own time; 0 where others of equal times differ, as of a coarse clock."""
    moved, equal, at_once = rows[1:].any(axis=1), (rows[1:] == rows[:-1]).all(axis=1), np.diff(times_s) == 0.0
    often, rest = moved & at_once, moved & ~at_once
    chance = (int((equal & rest).sum()) + 1) / (int(rest.sum()) + 1)
    count = int(often.sum())
    return count if count and equal[often].all() and chance**count < _CHANCE else 0


def _table(path: str | os.PathLike[str], names: tuple[str, ...], optional: str = "") -> tuple[CsvFile, dict[str, int]]:
    """The file, and the places of its columns."""
    table = CsvFile.asked(path, "a CSV file")
    expected = ", ".join(names)
    for name in names:
        count = table.header.count(name)
        if count != 1 and not (name == optional and count == 0):
            found = f"column {name!r} {count} times" if count else f"no column {name!r}"
            raise InvalidInputError(f"{table.where(1)}: {found}, expected {expected}")
    return table, {name: table.header.index(name) for name in names if name in table.header}


def _refuse_nothing(table: CsvFile, rows: int, names: tuple[str, ...]) -> None:
    if not rows:
        raise InvalidInputError(f"{table.name}: no rows, expected {', '.join(names)}")


def _refuse_twice(table: CsvFile, seen: NDArray[np.float64], lines: array[int], steps: list[int]) -> None:
    """Refuses a second row of a step and a landmark (M, 2)."""
    order = np.lexsort(seen.T)
    again = order[1:][(np.diff(seen[order], axis=0) == 0.0).all(axis=1)]
    if len(again):
        at = int(again.min())
        step, landmark = steps[int(seen[at, 0])], int(seen[at, 1])
        raise InvalidInputError(
            f"{table.where(lines[at])}: landmark {landmark} of step {step} again, expected one bearing of it in a step"
        )


def _whole(table: CsvFile, line: int, column: str, word: str, *, least: int = -LARGEST_WHOLE) -> int:
    try:
        # The longest within the limit has 16 digits and a sign.
        value = int(word) if len(word) < 20 and "_" not in word else None
    except ValueError:
        value = None
    if value is None or not least <= value <= LARGEST_WHOLE:
        raise InvalidInputError(
            f"{table.where(line)}: {column} = {word!r}, expected a whole number from {least} to {LARGEST_WHOLE}"
        )
    return value
