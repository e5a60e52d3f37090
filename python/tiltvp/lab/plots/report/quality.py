"""What an estimate says about itself, against the truth: regions of covariances, ROC of the confidence, abstaining."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiltvp.lab.plots.report.style import blank_figure, legend_above, looks, tidy

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure

__all__ = ["confidence_roc", "covariance_reliability", "errors_over_rejection"]


def covariance_reliability(table: pl.DataFrame) -> Figure:
    """Share of truths inside the region of each nominal probability. Columns `variant`, `level`, `share`, in [0, 1].

    Below the diagonal the covariance promises too much.
    """
    figure = blank_figure(4.8)
    axes = figure.add_subplot()
    axes.plot([0, 100], [0, 100], color="black", linewidth=1.0, label="as promised")
    axes.fill_between([0, 100], [-5, 95], [5, 105], color="0.93", linewidth=0, label="within 5 points")
    for variant, look in looks(table["variant"]).items():
        part = table.filter(table["variant"] == variant).sort("level")
        x, y = 100.0 * part["level"].to_numpy(), 100.0 * part["share"].to_numpy()
        axes.plot(x, y, color=look.colour, linestyle=look.line, linewidth=1.6, label=variant)
        marked = np.isin(np.round(x, 6), (50.0, 90.0, 95.0))
        axes.plot(x[marked], y[marked], color=look.colour, marker=look.marker, linestyle="none", markersize=7)
    axes.set(xlim=(0, 100), ylim=(0, 101))
    tidy(axes, "nominal probability of the region (%)", "truths inside (%)")
    legend_above(axes, columns=2)
    return figure


def confidence_roc(table: pl.DataFrame, areas: pl.DataFrame) -> Figure:
    """How well low confidence tells failures. `table`: `variant`, `false_alarms`, `found`; `areas`: `variant`, `area`.

    The shares of good estimates and of failures that are rejected, in [0, 1].
    """
    figure = blank_figure(4.8)
    axes = figure.add_subplot()
    axes.plot([0, 100], [0, 100], color="0.6", linewidth=1.0, label="by chance: 0.50")
    area = dict(areas.select("variant", "area").iter_rows())
    for variant, look in looks(table["variant"]).items():
        part = table.filter(table["variant"] == variant)
        x, y = 100.0 * part["false_alarms"].to_numpy(), 100.0 * part["found"].to_numpy()
        words = f"{variant}: {area[variant]:.2f}"
        axes.plot(x, y, color=look.colour, linestyle=look.line, linewidth=1.8, label=words)
    axes.set(xlim=(0, 100), ylim=(0, 101))
    tidy(axes, "good estimates that are rejected (%)", "failures that are rejected (%)")
    legend_above(axes, columns=2)
    return figure


def errors_over_rejection(table: pl.DataFrame, *, rejected_max: float = 0.5) -> Figure:
    """Error of the accepted estimates. Columns `variant`, `rejected` in [0, 1], `mean_deg`, `p99_deg`."""
    figure = blank_figure(4.6)
    left, right = figure.subplots(1, 2)
    for axes, column, words in ((left, "mean_deg", "mean error"), (right, "p99_deg", "99th percentile of the error")):
        for variant, look in looks(table["variant"]).items():
            part = table.filter((table["variant"] == variant) & (table["rejected"] <= rejected_max)).sort("rejected")
            x, y = 100.0 * part["rejected"].to_numpy(), part[column].to_numpy()
            axes.plot(x, y, color=look.colour, linestyle=look.line, linewidth=1.8, label=variant)
        axes.set_xlim(0.0, 100.0 * rejected_max)
        axes.set_ylim(bottom=0.0)
        tidy(axes, "least confident rejected (%)", f"{words} (degrees)")
    handles, names = left.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper left", ncols=2, frameon=False, fontsize=9)
    return figure
