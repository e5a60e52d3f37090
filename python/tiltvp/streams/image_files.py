"""Frames that are image files: from files, folders and glob patterns, with their times where a table or names tell."""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.csv_files import CsvFile
from tiltvp.errors import InvalidInputError
from tiltvp.image_headers import file_orientation
from tiltvp.images import is_shallow, read_image
from tiltvp.streams.frames import Frame, Frames, median_rate_hz

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["IMAGE_ENDINGS", "ImageFiles", "find_images"]

IMAGE_ENDINGS: Final = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm", ".pnm", ".webp", ".jp2")
_INNER: Final = ("images", "frames")
"""Folders in which the images of a drive's folder are: that of `tiltvp dataset drive`, and a usual other name."""
_TIMES, _ODOMETRY = "frames.csv", "odometry.csv"
_TABLE: Final = "a table of frames with the columns file and time_s"
_NUMBER: Final = r"((?<![0-9])(?<![0-9]\.)[0-9]+)"
"""A whole number in a name; decimals after it are text, which is in their order."""
_NANOSECONDS: Final = r"1\d{18}"
"""Names of images as EuRoC's tools write them: nanoseconds since 1970, of the years 2001 to 2033."""
_SECONDS: Final = r"1\d{9}\.\d+"
"""Names of images as the RGB-D tools of TUM write them: seconds of the same years, with decimals."""


class ImageFiles(Frames):
    """Image files in the order in which they are given; those of a folder or pattern in that of their names, or of the
    times that the folder's table tells."""

    def __init__(self, words: Sequence[str]) -> None:
        """Finds the files, each once. Raises `InvalidInputError` for a table of times that is wrong."""
        self.source = " ".join(words)
        self.files, problems, repeated = find_images(words)
        self.problems = tuple(problems)
        drive = _drive_folder(words)
        if drive is not None and (drive / _ODOMETRY).is_file():
            self.recording = drive / _ODOMETRY
        table = None if drive is None else _table_of(drive)
        folders = {Path(os.path.realpath(file.parent)) for file in self.files}
        folders |= {folder.parent for folder in folders if folder.name in _INNER}
        self.tables = [folder / name for folder in folders for name in (_TIMES, _ODOMETRY)]
        """Where tables are that are read with the images of a folder, or would be if they were there."""
        if table is not None:
            self.tables.append(table[0])
            self.times_s = _table_times(*table, self.files)
            if self.times_s is None:
                told = f"{table[0]}: without the columns {table[1]} and time_s"
                self.notes = (f"{told}: images are taken in the order of their names, and without times",)
            if self.times_s is not None and (np.diff(self.times_s) < 0.0).any():
                order = np.argsort(self.times_s, kind="stable")
                self.files, self.times_s = [self.files[place] for place in order], self.times_s[order]
                self.notes = (f"{self.source}: images are taken in the order of their times, not of their names",)
        else:
            self.times_s = _times_of_names(self.files)
            if self.times_s is not None:
                self.notes = (f"{self.source}: times are those that the names of the images tell",)
        if repeated:
            (other, file), such = repeated[0], f" ({len(repeated)} such)" if len(repeated) > 1 else ""
            self.notes += (f"{self.source}: {other} leads to {file}, which is taken once{such}",)
        if turned := [(file, tag) for file in self.files if (tag := _orientation(file)) != 1]:
            (file, tag), such = turned[0], f" ({len(turned)} such)" if len(turned) > 1 else ""
            told = f"{file}: its orientation tag {tag} is not followed{such}"
            self.notes += (f"{told}: pixels stay where the sensor has them, as those of the calibration have to",)
        if self.files and is_shallow(self.files[0]):
            told = f"{self.files[0]}: no value of its 16 bits is above 255"
            self.notes += (f"{told}: it is read as one of 10 bits, expected files of 8 bits for values of 8",)
        self.names = [str(file) for file in self.files]
        self.rate_hz = median_rate_hz(self.times_s)

    def __iter__(self) -> Iterator[Frame]:
        return self.sample(range(len(self.files)))

    def sample(self, numbers: Sequence[int]) -> Iterator[Frame]:
        """Those frames."""
        for number in self._these(numbers):
            file = self.files[number]
            time_s = None if self.times_s is None else float(self.times_s[number])
            yield Frame(str(file), time_s, lambda file=file: read_image(file))  # type: ignore[misc]


def find_images(words: Sequence[str]) -> tuple[list[Path], list[str], list[tuple[Path, Path]]]:
    """The image files that files, folders and glob patterns name, each once; what is wrong with the words; and what
    links have left out, each with the file of them that is there.

    A folder stands for the images directly in it, or, if there are none, in its folder `images` or `frames`; a pattern
    for what it matches (`**` for folders below), both sorted by their names, in which numbers count as such: 2 comes
    before 10, and 0.10 before 0.2.
    """
    files: list[Path] = []
    problems: list[str] = []
    for word in words:
        if "\0" in word:
            raise InvalidInputError(f"{word!r}: a name with a zero byte, expected a file, folder or pattern")
        path = Path(word)
        if os.path.isdir(path):
            found = _images_of(path)
            if not found:
                inner = ", nor in a folder images or frames in it"
                problems.append(f"{word}: a folder without images, expected files in {' '.join(IMAGE_ENDINGS)}{inner}")
        elif os.path.exists(path) or (not glob.has_magic(word) and path.suffix.lower() in IMAGE_ENDINGS):
            found = [path]
        elif not glob.has_magic(word):
            found = []
            problems.append(f"{word}: no such file or folder, expected images, a video or a recording")
        else:
            found = [Path(match) for match in glob.glob(word, recursive=True) if not os.path.isdir(match)]
            found.sort(key=_by_name)
            if not found:
                problems.append(f"{word}: no file fits this pattern")
        files.extend(found)
    once = {os.path.realpath(file): file for file in reversed(files)}
    first = {file: once[os.path.realpath(file)] for file in files}
    repeated = [(file, one) for file, one in first.items() if os.path.abspath(file) != os.path.abspath(one)]
    return [file for file, one in first.items() if one is file], problems, repeated


def _orientation(file: Path) -> int:
    """Its orientation tag; 1, upright, of what cannot be read, which reading it tells."""
    with suppress(OSError, ValueError):
        return file_orientation(file) if file.is_file() else 1
    return 1


def _images_of(folder: Path) -> list[Path]:
    for place in (folder, *(folder / name for name in _INNER)):
        if place.is_dir():
            # Hidden ones, as the ._a.png that a Mac puts beside a.png, are no images; patterns pass over them too.
            files = (file for file in place.iterdir() if not file.name.startswith("."))
            found = [file for file in files if file.suffix.lower() in IMAGE_ENDINGS and file.is_file()]
            if found:
                return sorted(found, key=_by_name)
    return []


def _by_name(file: Path) -> tuple[list[str | int], str]:
    # Numbers are at odd places, so that only like is compared with like.
    parts: list[str | int] = [*re.split(_NUMBER, str(file.with_suffix("")))]
    parts[1::2] = map(int, parts[1::2])
    return parts, str(file)


def _drive_folder(words: Sequence[str]) -> Path | None:
    """The one folder that was given, where tables may be beside the images."""
    return Path(words[0]) if len(words) == 1 and os.path.isdir(words[0]) else None


def _table_of(folder: Path) -> tuple[Path, str] | None:
    """The table of times of a folder and its column of files: its own, or that above with a column of its name, as a
    stereo pair's has left and right."""
    if (folder / _TIMES).is_file():
        return folder / _TIMES, "file"
    whole = Path(os.path.realpath(folder))
    name, above = whole.name, whole.parent / _TIMES
    return (above, name) if above.is_file() and name in CsvFile(above, _TABLE).header else None


def _table_times(path: Path, column: str, files: Sequence[Path]) -> NDArray[np.float64] | None:
    """(N,): the times that a table of a column of files and `time_s` tells; None for a table without these columns."""
    table = CsvFile(path, _TABLE)
    if not {column, "time_s"} <= set(table.header):
        return None
    which, when = table.header.index(column), table.header.index("time_s")
    rows: dict[str, dict[str, float]] = {}
    for line, cells in table.rows():
        when_s = table.number(line, "time_s", cells[when])
        named = rows.setdefault(Path(cells[which]).name, {})
        if named.setdefault(Path(cells[which]).as_posix(), when_s) != when_s:
            raise InvalidInputError(f"{table.where(line)}: {column} {cells[which]!r} again, expected one time of each")

    def times_of(file: Path) -> set[float]:
        """Of rows with its path, as a table of several cameras has them, else of those with its name."""
        named = rows.get(file.name, {})
        return {time_s for word, time_s in named.items() if f"/{file.as_posix()}".endswith(f"/{word}")} or {
            *named.values()
        }

    found = [times_of(file) for file in files]
    for file, one in zip(files, found, strict=True):
        if len(one) > 1:
            raise InvalidInputError(f"{path}: {len(one)} times of {file}, expected one, by its path")
    if missing := [str(file) for file, one in zip(files, found, strict=True) if not one]:
        raise InvalidInputError(
            f"{path}: no time of {missing[0]} ({len(missing)} missing), expected one for each image"
        )
    return np.array([one.pop() for one in found])


def _times_of_names(files: Sequence[Path]) -> NDArray[np.float64] | None:
    """(N,): the times that the names of all files are; None where one is no time."""
    for pattern, scale in ((_NANOSECONDS, 1e-9), (_SECONDS, 1.0)):
        if files and all(re.fullmatch(pattern, file.stem) for file in files):
            return np.array([float(file.stem) * scale for file in files])
    return None
