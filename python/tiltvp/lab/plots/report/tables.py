"""Tables as figures, for papers and slides: the same cells as on the page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tiltvp.lab.plots.report.style import blank_figure

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure

__all__ = ["table_figure"]

_ROW_IN = 0.27
_CHARACTER_IN = 0.078


def table_figure(cells: pl.DataFrame) -> Figure:
    """A table of words, as wide as its columns need: strings are set as they are, the first row is the header."""
    columns = cells.columns
    rows = [[str(cell) if cell is not None else "" for cell in row] for row in cells.iter_rows()]
    widths = [max(len(text) for text in (name, *(row[i] for row in rows))) + 2 for i, name in enumerate(columns)]
    figure = blank_figure(_ROW_IN * (len(rows) + 1) + 0.3, max(_CHARACTER_IN * sum(widths), 2.0) + 0.2)
    axes = figure.add_subplot()
    axes.set_axis_off()
    total, lines = sum(widths), len(rows) + 1
    axes.set(xlim=(0, total), ylim=(lines, 0))
    words = [_is_words([row[i] for row in rows]) for i in range(len(columns))]
    at = 0
    for i, width in enumerate(widths):
        x, side = (at + 0.5, "left") if words[i] else (at + width - 0.5, "right")
        # Names of others are no mathematics.
        axes.text(x, 0.5, columns[i], ha=side, va="center", weight="bold", fontsize=9, parse_math=False)
        for line, row in enumerate(rows):
            axes.text(x, line + 1.5, row[i], ha=side, va="center", fontsize=9, parse_math=False)
        at += width
    for y, thickness in ((0.0, 1.2), (1.0, 0.7), (float(lines), 1.2)):
        axes.plot([0, total], [y, y], color="black", linewidth=thickness, clip_on=False)
    return figure


def _is_words(cells: list[str]) -> bool:
    """Whether a column is set to the left: it has a cell that does not start like a number."""
    return any(cell and not (cell[0].isdigit() or cell[0] == "-") for cell in cells)
