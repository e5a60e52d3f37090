"""Figure 28: the estimated against the true tilt angle, with and without the corrections."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tiltvp.lab.plots.report.style import blank_figure, by_correction, legend_above, tidy

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure

__all__ = ["true_and_estimated"]


def true_and_estimated(table: pl.DataFrame) -> Figure:
    """Columns `variant`, `corrected`, `alpha_true_deg`, `alpha_deg` (mean estimate of the images of that tilt).

    `corrected` is a bool, or null for a method that needs no correction. Solid lines and full markers are corrected,
    dashed lines and hollow markers are not; the thin black line is a perfect estimate.
    """
    figure = blank_figure(5.4)
    axes = figure.add_subplot()
    for label, look, raw, part in by_correction(table):
        x, y = part["alpha_true_deg"].to_numpy(), part["alpha_deg"].to_numpy()
        axes.plot(
            x, y, color=look.colour, marker=look.marker, markersize=8 if look.marker == "*" else 6, linewidth=1.6,
            linestyle=(0, (5, 2)) if raw else "-", markerfacecolor="white" if raw else look.colour, label=label,
        )  # fmt: skip
    most = max(table["alpha_true_deg"].to_list(), default=0.0)
    axes.plot([0.0, most], [0.0, most], color="black", linewidth=1.0, label="estimate = truth", zorder=1)
    axes.set_xlim(left=-0.03 * max(most, 1.0))
    axes.set_ylim(bottom=0.0)
    tidy(axes, r"true tilt $\alpha_T$ (degrees)", "mean estimated tilt α (degrees)")
    legend_above(axes, columns=2)
    return figure
