"""Figures 9 to 18 of Scaramuzza et al. 2009: how well descriptors of vertical lines tell one line from another."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.figure import Figure

from tiltvp.lab.plots.report.style import ESTIMATE_COLOUR, TRUE_COLOUR, tidy

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.axes import Axes

__all__ = ["correct_matches", "rule_densities", "similarity_matrices"]

_MATRICES: Final = (
    ("descriptor", "descriptor: distance"),
    ("ssd", "grey levels: SSD"),
    ("zncc", "grey levels: 1 - ZNCC"),
)
_SWEEPS: Final = (
    ("clip", "greatest value of a bin before the\nsecond normalisation", True),
    ("noise", "standard deviation of the noise\n(% of the grey levels)", False),
    ("bins", "orientation bins\n ", True),
)
_RULES: Final = (
    ("distance", "F1", "distance to the nearest"),
    ("mean_ratio", "F2", "nearest / mean of all"),
    ("second_ratio", "F3", "nearest / second nearest"),
)
_STYLES: Final = (("-", "o"), ((0, (5, 2)), "s"), ((0, (2, 1.5)), "^"), ((0, (6, 2, 1.5, 2)), "D"))
_COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")


def similarity_matrices(table: pl.DataFrame) -> Figure:
    """Figures 9, 11 and 12: columns first_deg, second_deg, descriptor, ssd, zncc (0: alike), in degrees all round.

    Black is alike. White is the 99th percentile of a matrix, so that none looks paler for a few large values.
    """
    figure = Figure(figsize=(11.4, 4.1), layout="constrained")
    places = table["first_deg"].unique().sort().to_numpy()
    step = float(places[1] - places[0]) if len(places) > 1 else 360.0
    low, high = float(places[0]) - 0.5 * step, float(places[-1]) + 0.5 * step
    ordered = table.sort("first_deg", "second_deg")
    for axes, (column, title) in zip(figure.subplots(1, 3, sharey=True), _MATRICES, strict=True):
        matrix = ordered[column].to_numpy().reshape(len(places), len(places))
        white = float(np.nanpercentile(matrix, 99.0))
        axes.imshow(
            matrix, cmap="gray", vmin=0.0, vmax=white if white > 0.0 else 1.0, extent=(low, high, high, low),
            interpolation="nearest",
        )  # fmt: skip
        axes.set_title(title)
        axes.set_xticks(range(-180, 181, 90))
        axes.set_yticks(range(-180, 181, 90))
        axes.set_xlabel("direction (degrees)")
    figure.axes[0].set_ylabel("direction (degrees)")
    return figure


def correct_matches(table: pl.DataFrame) -> Figure:
    """Figures 13, 14 and 15: columns sweep, chart, areas, value, correct_%. One panel for each sweep."""
    figure = Figure(figsize=(11.4, 4.0), layout="constrained")
    for axes, (sweep, label, by_powers) in zip(figure.subplots(1, 3, sharey=True), _SWEEPS, strict=True):
        part = table.filter(table["sweep"] == sweep)
        for number, ((chart, areas), curve) in enumerate(part.group_by("chart", "areas", maintain_order=True)):
            line, marker = _STYLES[number % len(_STYLES)]
            curve = curve.sort("value")
            axes.plot(
                curve["value"].to_numpy(), curve["correct_%"].to_numpy(), linestyle=line, marker=marker, markersize=5,
                color=_COLOURS[number % len(_COLOURS)], label=f"{areas} areas, {chart}",
            )  # fmt: skip
        if by_powers:
            axes.set_xscale("log")
            values = part["value"].unique().sort().to_list()
            # Labels of neighbours on a logarithmic axis must not touch.
            last, labels = 0.0, []
            for value in values:
                labels.append(f"{value:g}" if value >= 1.45 * last else "")
                last = value if labels[-1] else last
            axes.set_xticks(values, labels)
            axes.minorticks_off()
        tidy(axes, label, "")
        axes.legend(frameon=False, fontsize=8, loc="lower center")
    figure.axes[0].set_ylabel("correct matches (%)")
    return figure


def rule_densities(table: pl.DataFrame, limits: dict[str, float], *, bins: int = 40) -> Figure:
    """Figures 16, 17 and 18: columns distance, mean_ratio, second_ratio, correct.

    The density of each over the matches that are correct, and over those that are not; `limits` are F1, F2 and F3.
    """
    figure = Figure(figsize=(11.4, 4.0), layout="constrained")
    for axes, (column, name, label) in zip(figure.subplots(1, 3), _RULES, strict=True):
        _densities(axes, table, column, bins)
        axes.axvline(limits[name], color="black", linewidth=1.0, linestyle="--")
        axes.annotate(
            f"{name} = {limits[name]:g}", (limits[name], 1.0), (4, -2), xycoords=("data", "axes fraction"),
            textcoords="offset points", va="top", fontsize=9,
        )  # fmt: skip
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
        tidy(axes, label, "")
    figure.axes[0].set_ylabel("density")
    figure.axes[2].legend(frameon=False, fontsize=9, loc="upper left")
    return figure


def _densities(axes: Axes, table: pl.DataFrame, column: str, bins: int) -> None:
    """Both densities over equal bins, up to the greatest value."""
    most = max((value for value in table[column].to_list()), default=1.0)
    edges = np.linspace(0.0, 1.0 if column != "distance" else 1.02 * most, bins + 1)
    middles = 0.5 * (edges[1:] + edges[:-1])
    for correct, colour, line, words in ((True, ESTIMATE_COLOUR, "-", "correct"), (False, TRUE_COLOUR, "--", "false")):
        values = table.filter(table["correct"] == correct)[column].to_numpy()
        if not len(values):
            continue
        heights, _ = np.histogram(values, edges, density=True)
        axes.plot(middles, heights, color=colour, linestyle=line, linewidth=1.8, label=words)
        axes.fill_between(middles, heights, color=colour, alpha=0.12, linewidth=0.0)
