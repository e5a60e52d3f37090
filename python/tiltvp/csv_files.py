"""CSV files as rows of words, of which each knows its line."""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections.abc import Iterator
from typing import Final, Self

from tiltvp.arguments import path_from
from tiltvp.errors import InvalidInputError
from tiltvp.files import read_text
from tiltvp.image_headers import is_image_file

__all__ = ["LARGEST_CSV_BYTES", "CsvFile"]

LARGEST_CSV_BYTES: Final = 64 << 20
"""Of a table: the bearings of a drive of an hour, 20 at 10 Hz, take 20 MB."""


class CsvFile:
    """A table with a header."""

    def __init__(self, path: str | os.PathLike[str], expected: str) -> None:
        """Reads the header. `expected` is what the file should be, for messages. Raises `InvalidInputError`."""
        self.name = str(path_from(path))
        self._expected = expected
        try:
            text = read_text(path, LARGEST_CSV_BYTES)
        except (OSError, UnicodeDecodeError) as error:
            problem = f"cannot be read ({error.strerror or error})" if isinstance(error, OSError) else "not UTF-8"
            what = "is an image" if is_image_file(path) else problem
            raise InvalidInputError(f"{self.name}: {what}, expected {expected}") from error
        self._lines = csv.reader(io.StringIO(text, newline=None))
        self.header = [cell.strip() for cell in self._next() or []]

    @classmethod
    def asked(cls, path: str | os.PathLike[str], expected: str) -> Self:
        """A table that somebody named. Raises `InvalidInputError`, also for other marks than commas between cells."""
        table = cls(path, expected)
        if len(table.header) == 1 and (between := re.search("[;\t]", table.header[0])):
            what = "semicolons" if between[0] == ";" else "tabs"
            raise InvalidInputError(f"{table.where(1)}: {what} between the cells, expected commas")
        return table

    def where(self, line: int) -> str:
        """The place of a line, for messages."""
        return f"{self.name}, line {line}"

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """Line and cells of each row that is not empty, as many as the header has. Raises `InvalidInputError`."""
        while (cells := self._next()) is not None:
            cells = [cell.strip() for cell in cells]
            if not any(cells):
                continue
            line = self._lines.line_num
            if len(cells) != len(self.header):
                raise InvalidInputError(f"{self.where(line)}: {len(cells)} cells, expected {len(self.header)}")
            yield line, cells

    def number(self, line: int, column: str, word: str) -> float:
        """A finite number of a cell. Raises `InvalidInputError` that names its place."""
        try:
            # Python would read 1_0, the name of a part of something, as 10.
            value = math.nan if "_" in word else float(word)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise InvalidInputError(f"{self.where(line)}: {column} = {word!r}, expected a finite number")
        return value

    def _next(self) -> list[str] | None:
        try:
            return next(self._lines, None)
        except csv.Error as error:
            raise InvalidInputError(f"{self.where(self._lines.line_num)}: {error}, expected {self._expected}") from None
