"""Figures 24 and 25: the mean error of every combination of parameters against its mean time; and the cost's law."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiltvp.lab.plots.report.style import ESTIMATE_COLOUR, blank_figure, legend_above, looks, tidy

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure

__all__ = ["cost", "errors_over_time", "points_shown"]


def points_shown(table: pl.DataFrame, *, error_max_deg: float) -> pl.DataFrame:
    """The combinations inside the figure: those with a mean error up to the limit, and the best of each variant."""
    return table.filter((table["mean_deg"] <= error_max_deg) | table["best"])


def errors_over_time(table: pl.DataFrame, *, error_max_deg: float = 3.0) -> Figure:
    """Figure 24. Columns `variant`, `time_mean_ms`, `mean_deg`, `best` (bool): a point each, the best ones rimmed."""
    shown = points_shown(table, error_max_deg=error_max_deg)
    figure = blank_figure(4.8)
    axes = figure.add_subplot()
    for variant, look in looks(table["variant"]).items():
        part = shown.filter(shown["variant"] == variant)
        x, y = part["time_mean_ms"].to_numpy(), part["mean_deg"].to_numpy()
        best = part["best"].to_numpy()
        axes.scatter(x[~best], y[~best], s=26, marker=look.marker, color=look.colour, alpha=0.55, linewidths=0)
        star = 220 if look.marker == "*" else 110
        axes.scatter(
            x[best], y[best], s=star, marker=look.marker, color=look.colour, edgecolors="black", linewidths=1.8,
            label=variant, zorder=3,
        )  # fmt: skip
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    tidy(axes, "mean time (ms)", "mean error (degrees)")
    legend_above(axes, columns=2)
    return figure


def cost(table: pl.DataFrame) -> Figure:
    """How the time of an evaluation grows: columns `over` ("images" or "pixels"), `images`, `megapixels`, `seconds`.

    The dashed lines are proportional to images and to pixels, through the largest of each.
    """
    figure = blank_figure(3.8)
    left, right = figure.subplots(1, 2)
    for axes, over, column, words in (
        (left, "images", "images", "images"), (right, "pixels", "megapixels", "megapixels of an image"),
    ):  # fmt: skip
        part = table.filter(table["over"] == over).sort(column)
        x, y = part[column].to_numpy().astype(np.float64), part["seconds"].to_numpy()
        axes.plot(x, y, marker="o", linestyle="none", color=ESTIMATE_COLOUR, markersize=7, label="measured")
        if len(x):
            axes.plot([0.0, x[-1]], [0.0, y[-1]], color="black", linewidth=1.0, linestyle="--", label="proportional")
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
        tidy(axes, words, "time of the evaluation (s)")
    legend_above(left, columns=2)
    return figure
