"""Figures 21, 22 and 23: the distribution of the error, and its mean by true tilt and by environment."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiltvp.lab.plots.report.style import blank_figure, legend_above, looks, tidy

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure

__all__ = ["cumulative_errors", "errors_by_environment", "errors_by_tilt"]

_MOST_BARS = 12


def cumulative_errors(table: pl.DataFrame, *, error_max_deg: float = 5.0) -> Figure:
    """Figure 21: share of images with an error of at most epsilon'. Columns `variant`, `error_rad` (null: no estimate).

    Images without an estimate count as images with an error beyond the axis.
    """
    figure = blank_figure()
    axes = figure.add_subplot()
    for variant, look in looks(table["variant"]).items():
        part = table.filter(table["variant"] == variant)["error_rad"]
        errors = np.sort(np.degrees(part.drop_nulls().to_numpy()))
        share = np.arange(1, len(errors) + 1) / max(len(part), 1)
        reached = float(share[-1]) if len(share) else 0.0
        x, y = np.concatenate([[0.0], errors, [np.inf]]), np.concatenate([[0.0], share, [reached]])
        x = np.minimum(x, max(error_max_deg, float(errors[-1]) if len(errors) else 0.0))
        axes.step(x, y, where="post", color=look.colour, linestyle=look.line, linewidth=1.8, label=variant)
    axes.set(xlim=(0.0, error_max_deg), ylim=(0.0, 1.005))
    tidy(axes, "error ε′ (degrees)", "share of images with ε ≤ ε′")
    legend_above(axes, columns=2)
    return figure


def errors_by_tilt(table: pl.DataFrame, overall: pl.DataFrame) -> Figure:
    """Figure 22. `table`: `variant`, `alpha_true_deg`, `mean_deg`; `overall`: `variant`, `mean_deg` of all images."""
    figure = blank_figure()
    axes = figure.add_subplot()
    means = dict(overall.select("variant", "mean_deg").iter_rows())
    for variant, look in looks(overall["variant"]).items():
        part = table.filter(table["variant"] == variant).sort("alpha_true_deg")
        x, y = part["alpha_true_deg"].to_numpy(), part["mean_deg"].to_numpy()
        colour, line = look.colour, look.line
        axes.plot(x, y, color=colour, linestyle=line, marker=look.marker, markersize=6, linewidth=1.8, label=variant)
        axes.axhline(means[variant], color=colour, linestyle=line, linewidth=1.0, alpha=0.45)
    axes.set_ylim(bottom=0.0)
    tidy(axes, r"true tilt $\alpha_T$ (degrees)", "mean error (degrees)")
    legend_above(axes, columns=2)
    return figure


def errors_by_environment(table: pl.DataFrame, overall: pl.DataFrame) -> Figure:
    """Figure 23. `table`: `variant`, `environment`, `mean_deg`; `overall`: `variant`, `mean_deg` of all images.

    Bars for as many environments as the paper has and some more, a line of marks for each of many.
    """
    places = table["environment"].unique().sort().to_list()
    if len(places) > _MOST_BARS:
        return _marks_by_environment(table, overall, places)
    variants = looks(overall["variant"])
    means = dict(overall.select("variant", "mean_deg").iter_rows())
    figure = blank_figure(4.6)
    axes = figure.add_subplot()
    width = 0.8 / max(len(variants), 1)
    for number, (variant, look) in enumerate(variants.items()):
        part = table.filter(table["variant"] == variant)
        by_place = dict(part.select("environment", "mean_deg").iter_rows())
        heights = np.array([by_place.get(place, np.nan) for place in places])
        at = np.arange(len(places)) + (number - 0.5 * (len(variants) - 1)) * width
        axes.bar(at, heights, 0.92 * width, color=look.colour, label=variant)
        axes.axhline(means[variant], color=look.colour, linestyle=look.line, linewidth=1.0, alpha=0.45)
    longest = max((len(place) for place in places), default=0)
    slanted = len(places) * longest > 75
    turned, side = (30, "right") if slanted else (0, "center")
    # Names of others are no mathematics.
    axes.set_xticks(range(len(places)), places, rotation=turned, ha=side, parse_math=False)
    axes.set_ylim(bottom=0.0)
    tidy(axes, "environment", "mean error (degrees)")
    axes.grid(visible=False, axis="x")
    legend_above(axes, columns=2)
    return figure


def _marks_by_environment(table: pl.DataFrame, overall: pl.DataFrame, places: list[str]) -> Figure:
    """One line for each environment, from the top, and a mark on it for each variant."""
    figure = blank_figure(1.3 + 0.19 * len(places))
    axes = figure.add_subplot()
    means = dict(overall.select("variant", "mean_deg").iter_rows())
    for variant, look in looks(overall["variant"]).items():
        by_place = dict(table.filter(table["variant"] == variant).select("environment", "mean_deg").iter_rows())
        across = [by_place.get(place, np.nan) for place in places]
        axes.plot(across, range(len(places)), look.marker, color=look.colour, markersize=6, label=variant)
        axes.axvline(means[variant], color=look.colour, linestyle=look.line, linewidth=1.0, alpha=0.45)
    axes.set_yticks(range(len(places)), places, fontsize=8, parse_math=False)
    axes.set_ylim(len(places) - 0.5, -0.5)
    axes.set_xlim(left=0.0)
    tidy(axes, "mean error (degrees)", "environment")
    legend_above(axes, columns=2)
    return figure
