"""Data frames as tables for people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from tiltvp.cli.terminal import new_table, show

if TYPE_CHECKING:
    import polars as pl


def show_frame(title: str, frame: pl.DataFrame, words: Sequence[str], hidden: Sequence[str] = ()) -> None:
    """A table of numbers on stdout; the columns in `words` hold words, those in `hidden` are left out.

    The title has the unit of the columns that end in one.
    """
    shown = frame.select(name for name in frame.columns if name not in hidden)
    table = new_table(title, (_heading(name) for name in shown.columns), left=words)
    for row in shown.iter_rows():
        table.add_row(*(_cell(cell) for cell in row))
    show(table)


def _heading(column: str) -> str:
    """The name of a column without its unit, which the title of the table has."""
    return column.removesuffix("_deg").removesuffix("_ms").replace("_", " ")


def _cell(value: object) -> str:
    if value is None:
        return ""
    if not isinstance(value, float):
        return str(value)
    if 0.0 < abs(value) < 5e-4:
        return f"{value:.1e}"
    return f"{value:.3f}" if abs(value) < 100.0 else f"{value:.1f}"
