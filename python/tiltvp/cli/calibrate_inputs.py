"""Where `tiltvp calibrate` has its logs from, how they were recorded, and what is known of the robot."""

from __future__ import annotations

import glob
import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, NamedTuple, Self, TypeAlias

from cyclopts import Group, Parameter

from tiltvp._core import CALIBRATION_METHODS, option_fields
from tiltvp.cli.declared_options import LibraryOptions, from_library
from tiltvp.cli.options import Switch
from tiltvp.cli.sources import wheel_base_of
from tiltvp.cli.terminal import status
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp import LogCalibration, Robot
    from tiltvp.drive_logs import DriveLog

    Solve: TypeAlias = Callable[..., LogCalibration]
    """Of a `DriveLog`, and of where to start, if not as told."""

__all__ = ["DriveOptions", "LogOptions", "Solved", "Tables", "other_readings", "sources_from"]

_REMEDIES = {
    "reflected": ("wheels-swapped", "wheels-negated", "clockwise"),
    "left wheel negated": ("left-wheel-negated",),
    "right wheel negated": ("right-wheel-negated",),
}
"""What may mend a log that was misread, where it has another name."""
_FORMS: Final = "ODOMETRY.csv BEARINGS.csv, or the pictures of a drive with --camera FILE"
_TABLE: Final = ".csv"
_OTHER_TABLES: Final = (".json", ".parquet", ".tsv", ".txt", ".xlsx")
"""Files that hold tables elsewhere, and never pictures: they are not to be asked for a camera."""
_WIDEST_M: Final = 10.0
"""Wheels that are farther apart are those of a crane: the widest haul trucks are 9.9 m wide in all."""


@Parameter(name="*", group=Group("Drive"))
@dataclass(frozen=True, kw_only=True)
@from_library(
    {"SelfCalibrator": CALIBRATION_METHODS, "calibrate": ()},
    words={"odometry_k_m": "--odometry-k", "step_sigma_m": "--step-sigma", "start_distance_m": "--start-distance"},
    but=(
        "wheel_base_m",
        "method",
        "estimate_odometry",
        "estimate_time_offset",
        "estimate_centre",
        "estimate_rolling_shutter",
    ),
)
class DriveOptions(LibraryOptions):
    """The robot, the mounting as it is thought to be, and how sure measurements are."""

    wheel_base: Annotated[float | None, Parameter(parse=False)] = None
    """Distance between the wheels, metres, as `settled` has it."""
    start: tuple[float, float, float] | None = None
    """x and y in metres and yaw in radians (90 degrees are 1.571) of the mounting as it is thought to be; by default x
    and y of a robot's file, or 0 0 0."""
    start_sigma: tuple[float, float, float] | None = None
    """Standard deviations of x and y in metres and of yaw in radians."""
    bearing_sigma_deg: float | None = None
    """Standard deviation of a bearing; for images by default the median of what the lines' own are."""

    def settled(self, robot: Robot | None, wheel_base: float | None) -> Self:
        """With what a robot's file knows where nothing was given. Raises `InvalidInputError` without a wheel base."""
        base = wheel_base_of(robot, wheel_base)
        if base is None:
            raise InvalidInputError("--wheel-base: not given, expected the distance between the wheels in metres")
        for option, given in (("--start", self.start), ("--start-sigma", self.start_sigma)):
            if given is not None and abs(given[2]) > math.pi:
                degrees = f"{given[2]:g} degrees are {math.radians(given[2]):.4g}"
                raise InvalidInputError(f"{option}: a yaw of {given[2]:g} radians, expected at most pi; {degrees}")
        place = (0.0, 0.0) if robot is None or robot.place_m is None else robot.place_m
        return replace(self, wheel_base=base, start=self.start or (*place, 0.0))

    @property
    def start_known(self) -> tuple[float, float, float]:
        """The mounting as it is thought to be."""
        return self.start or (0.0, 0.0, 0.0)

    def odd_units(self, log: DriveLog, remedies: Sequence[str]) -> str:
        """What lengths seem to be told in other units than metres, where no reading is known that mends a log."""
        from tiltvp.drive_logs import far_steps

        assert self.wheel_base is not None  # As `settled` has it.
        if self.wheel_base > _WIDEST_M:
            return f"wheels {self.wheel_base:g} m apart: is the wheel base in centimetres or millimetres?"
        return "" if remedies else far_steps(log.odometry, self.wheel_base)

    def of_filter(self) -> dict[str, Any]:
        """What `SelfCalibrator` takes."""
        own = [option_fields("SelfCalibrator", method) for method in CALIBRATION_METHODS]
        known = {field["name"] for fields in own for field in fields}
        return {name: value for name, value in self.given().items() if name in known} | self._wheels()

    def of_whole_log(self) -> dict[str, Any]:
        """What `calibrate` takes."""
        known = {field["name"] for field in option_fields("calibrate")}
        return {name: value for name, value in self.given().items() if name in known} | self._wheels()

    def _wheels(self) -> dict[str, float]:
        assert self.wheel_base is not None  # As `settled` has it.
        return {"wheel_base_m": self.wheel_base}


@Parameter(name="*", group=Group("Log"))
@dataclass(frozen=True, kw_only=True)
class LogOptions:
    """How logs were recorded, and what else they are to tell."""

    read_as: Annotated[tuple[str, ...], Parameter(consume_multiple=True)] = ()
    """How logs were recorded, where not by our conventions: wheels-swapped, wheels-negated, left-wheel-negated,
    right-wheel-negated, clockwise, degrees, millimetres, cumulative."""
    estimate_odometry: Switch = False
    """From each whole log also the wheel base and which wheel runs farther."""
    estimate_time_offset: Switch = False
    """From each whole log also by how much the bearings are later than the odometry."""
    estimate_centre: Switch = False
    """From each whole log also how far the image centre is off, which a camera that leans looks like. From pictures
    with lines all round it always is."""
    estimate_rolling_shutter: Switch = False
    """From each whole log also by how much lines are seen later on one side of the camera than on the other."""


class Solved(NamedTuple):
    """A log by our conventions, and the mounting that it tells."""

    log: DriveLog
    whole: LogCalibration
    doubt: str = ""
    """Why the mounting cannot be relied upon, beside what it says itself."""
    remedies: tuple[str, ...] = ()
    """Words of `--read-as` to try."""
    left_out: str = ""
    """How many images were left out of it, and why; empty: none."""


@dataclass(frozen=True)
class Tables:
    """A log of two tables."""

    odometry: Path
    bearings: Path
    read: DriveLog | None = None
    sigma_rad: float | None = None
    bad: int = 0
    late_s: float = 0.0

    @property
    def name(self) -> str:
        """What it is called."""
        return str(self.bearings)

    def checked(self, how: LogOptions) -> Tables:
        """The same, read. Raises `InvalidInputError` that names file and line."""
        from tiltvp.drive_logs import read_drive_log

        log = read_drive_log(self.odometry, self.bearings)
        if how.estimate_time_offset and log.times_s is None:
            raise InvalidInputError(f"{self.odometry}: no column time_s, expected one with --estimate-time-offset")
        return replace(self, read=log.read_as(*how.read_as))

    def solved(self, _: NDArray[Any] | None, solve: Solve) -> Solved:
        """What was read, and what it says; bearings are what they are, whatever the mounting."""
        from tiltvp.drive_logs import doubled_rows

        assert self.read is not None  # As `checked` has it.
        with status(f"{self.name}: the whole log, {len(self.read.bearings)} bearings"):
            whole = solve(self.read)
        doubt = doubled_rows(self.read.odometry, self.read.times_s)
        return Solved(self.read, whole, doubt, other_readings(whole.misreading))


def sources_from(words: Sequence[str]) -> list[Tables | str]:
    """The logs that words name: tables come in pairs, all else is pictures. Raises `InvalidInputError`, also for one
    that is named twice."""
    from tiltvp.streams.image_files import IMAGE_ENDINGS

    found: list[Tables | str] = []
    rest = list(words)
    while rest:
        word = rest.pop(0)
        if Path(word).suffix.lower() in IMAGE_ENDINGS and Path(word).is_file():
            raise InvalidInputError(f"{word}: one image, expected the folder of a drive's, or a pattern in quotes")
        if (ending := Path(word).suffix.lower()) in _OTHER_TABLES and Path(word).is_file():
            raise InvalidInputError(f"{word}: a file that ends in {ending}, expected {_FORMS}")
        if ending != _TABLE:
            if not (Path(word).exists() or glob.has_magic(word)):
                raise InvalidInputError(f"{word}: no such file or folder, expected {_FORMS}")
            found.append(word)
        elif rest and Path(rest[0]).suffix.lower() == _TABLE:
            found.append(Tables(Path(word), Path(rest.pop(0))))
        else:
            raise InvalidInputError(f"{word}: a table without another one, expected {_FORMS}")
    if not found:
        raise InvalidInputError(f"calibrate: no log, expected {_FORMS}")
    seen: set[str] = set()
    for name in (one.name if isinstance(one, Tables) else one for one in found):
        if os.path.realpath(name) in seen:
            raise InvalidInputError(f"{name}: given twice, expected logs of different drives: each counts as one")
        seen.add(os.path.realpath(name))
    return found


def other_readings(misreading: str | None) -> tuple[str, ...]:
    """The words of `--read-as` to try for a log that fits in another reading only."""
    return () if misreading is None else _REMEDIES.get(misreading, (misreading,))
