"""How a method looks in every figure of the report: colour, marker and line, told apart without colour as well."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.axes import Axes

__all__ = [
    "ESTIMATE_COLOUR",
    "KNOWN",
    "TRUE_COLOUR",
    "Look",
    "blank_figure",
    "by_correction",
    "legend_above",
    "looks",
    "tidy",
]

TRUE_COLOUR = "#c8102e"
ESTIMATE_COLOUR = "#0072b2"

WIDTH_IN = 7.2
"""Width of a figure in inches: the page shows it at about this size, so that text of 10 points stays legible."""


@dataclass(frozen=True)
class Look:
    """Colour, matplotlib marker and line style of one variant, and plotly's names of marker and line style."""

    colour: str
    marker: str
    line: str | tuple[int, tuple[float, ...]]
    web_marker: str
    web_line: str


# The colours of Okabe and Ito, which people of every colour vision tell apart.
_LOOKS: tuple[Look, ...] = (
    Look("#0072b2", "o", "-", "circle", "solid"),
    Look("#d55e00", "s", (0, (6, 2)), "square", "dash"),
    Look("#009e73", "^", (0, (2, 1.5)), "triangle-up", "dot"),
    Look("#cc79a7", "D", (0, (6, 2, 1.5, 2)), "diamond", "dashdot"),
    Look("#000000", "*", "-", "star", "solid"),
    Look("#e69f00", "v", (0, (4, 1)), "triangle-down", "longdash"),
    Look("#56b4e9", "P", (0, (1, 1)), "cross", "dot"),
    Look("#8c6d1f", "X", (0, (8, 2, 2, 2)), "x", "longdashdot"),
)


KNOWN: tuple[str, ...] = (
    "image space, RANSAC", "image space, reject-refit", "vector consensus", "vector consensus, corrected", "refined",
    "segments",
)  # fmt: skip
"""The variants that look the same in every figure, whichever of them it shows."""


def looks(variants: Iterable[str]) -> dict[str, Look]:
    """The look of each variant, in the order in which they come: its own if it is known, else one that is free."""
    names = list(dict.fromkeys(variants))
    others = [name for name in names if name not in KNOWN]
    free = _LOOKS[len(KNOWN) :]
    return {
        name: _LOOKS[KNOWN.index(name)] if name in KNOWN else free[others.index(name) % len(free)] for name in names
    }


def by_correction(table: pl.DataFrame) -> Iterator[tuple[str, Look, bool, pl.DataFrame]]:
    """The rows of each variant, not corrected and corrected, by true tilt: label, look, whether they are not, rows.

    The column `corrected` is null for a method that needs no correction.
    """
    for variant, look in looks(table["variant"]).items():
        for corrected, words in ((False, ", not corrected"), (True, ", corrected"), (None, "")):
            part = table.filter((table["variant"] == variant) & table["corrected"].eq_missing(corrected))
            if not part.is_empty():
                yield variant + words, look, corrected is False, part.sort("alpha_true_deg")


def blank_figure(height_in: float = 4.4, width_in: float = WIDTH_IN) -> Figure:
    """An empty figure of the report's width."""
    return Figure(figsize=(width_in, height_in), layout="constrained")


def tidy(axes: Axes, x: str, y: str) -> None:
    """Labels with units, a pale grid, and no frame where there is no axis."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(color="0.9", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def legend_above(axes: Axes, columns: int = 3) -> None:
    """The legend above the axes, where it covers nothing."""
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.01), ncols=columns, frameon=False, fontsize=9, borderaxespad=0.0
    )
