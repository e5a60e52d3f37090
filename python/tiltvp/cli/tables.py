"""The tables that verbs write: typed columns, as CSV and JSON by the standard library, as Parquet by Polars."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from cyclopts import Parameter

from tiltvp.errors import InvalidInputError, MissingExtraError
from tiltvp.files import check_output, write_whole

if TYPE_CHECKING:
    import polars as pl

ENDINGS: Final = (".csv", ".json", ".parquet")
PICTURES: Final = (".png", ".jpg", ".jpeg")
Out = Annotated[Path, Parameter(allow_leading_hyphen=True)]
"""A file for results, or `STDOUT`."""
STDOUT: Final = Path("-")
"""The output of rows as they come, as JSON lines, for verbs that know it."""


@dataclass(frozen=True)
class Table:
    """Rows of named cells; None where there is no value."""

    types: Mapping[str, str]
    """The columns in their order, each with the name of its Polars type: Float64, Int64, UInt32, Boolean or String."""
    rows: list[dict[str, Any]] = field(default_factory=list)

    def add(self, columns: Mapping[str, Iterable[Any]]) -> None:
        """Appends rows that are given by their columns."""
        for cells in zip(*(columns[name] for name in self.types), strict=True):
            self.rows.append(dict(zip(self.types, cells, strict=True)))

    def cells(self) -> Iterator[dict[str, Any]]:
        """The rows as files take them: names of files that are no UTF-8 have `\\xff` for such a byte."""
        for row in self.rows:
            yield {name: _printable(row[name]) for name in self.types}

    def frame(self) -> pl.DataFrame:
        """The same as a data frame, for Parquet and plots."""
        import polars as pl

        return pl.DataFrame(list(self.cells()), schema={name: getattr(pl, word) for name, word in self.types.items()})


def check_ending(path: Path | None, option: str = "--out") -> None:
    """Refuses a file of results that cannot be written in its format, before any work is done."""
    if path is None:
        return
    if path == STDOUT:
        raise InvalidInputError(f"{option} -: only `tiltvp tilt` writes lines on stdout, expected a file")
    check_file(option, path, *ENDINGS)
    if path.suffix.lower() == ".parquet":
        need_lab(f"{option} {path}")


def check_plot(option: str, path: Path | None) -> None:
    """Refuses a plot that cannot be drawn, before any work is done."""
    check_file(option, path, ".png")
    if path is not None:
        need_lab(f"{option} {path}")


def check_file(option: str, path: Path | None, *endings: str) -> None:
    """Refuses a file that is to end otherwise, or that cannot be written, before any work is done."""
    if path is None:
        return
    if path.suffix.lower() not in endings:
        expected = f"one of {', '.join(endings)}" if len(endings) > 1 else endings[0]
        raise InvalidInputError(f"{option} {path}: ends in {path.suffix!r}, expected {expected}")
    check_output(path)


def need_lab(what: str) -> None:
    """Refuses what only the laboratory's packages can do where these are not installed."""
    try:
        import tiltvp.lab  # noqa: F401
    except MissingExtraError as error:
        raise MissingExtraError(f"{what}: {error}") from None


def write_table(table: Table, path: Path) -> None:
    """Writes the table whole or not at all; the ending says the format."""
    match path.suffix.lower():
        case ".csv":
            write_whole(path, _csv(table))
        case ".json":
            write_whole(path, _json(table))
        case _:
            write_frame(table.frame(), path)


def write_frame(frame: pl.DataFrame, path: Path) -> None:
    """Writes a data frame whole or not at all, null for NaN as in every format; the ending says the format."""
    import polars.selectors as cs

    check_ending(path)
    frame = frame.with_columns(cs.float().fill_nan(None))
    memory = io.BytesIO()
    match path.suffix.lower():
        case ".csv":
            frame.write_csv(memory)
        case ".json":
            frame.write_json(memory)
        case _:
            frame.write_parquet(memory)
    write_whole(path, memory.getvalue())


def _csv(table: Table) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.types)
    writer.writerows([_word(cell) for cell in row.values()] for row in table.cells())
    return text.getvalue()


def _printable(cell: Any) -> Any:
    if not isinstance(cell, str) or cell.isascii():
        return cell
    return os.fsencode(cell).decode("utf-8", "backslashreplace")


def _word(cell: object) -> object:
    """Booleans as Polars and most programs spell them, and nothing for NaN."""
    if isinstance(cell, bool):
        return "true" if cell else "false"
    return None if isinstance(cell, float) and math.isnan(cell) else cell


def _json(table: Table) -> str:
    rows = [finite(row) for row in table.cells()]
    return json.dumps(rows, allow_nan=False, ensure_ascii=False, separators=(",", ":"))


def json_lines(table: Table) -> str:
    """A line of JSON for each row."""
    return "\n".join(json.dumps(finite(row), allow_nan=False, ensure_ascii=False) for row in table.cells())


def finite(value: Any) -> Any:
    """The value with null for numbers that are not finite, which JSON does not know."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
