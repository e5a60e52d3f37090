"""Figure 28: the estimated against the true tilt angle, with and without the corrections."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tiltvp.plots.report.style import blank_figure, legend_above, looks, tidy

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
    for variant, look in looks(table["variant"]).items():
        for corrected, words in ((False, ", not corrected"), (True, ", corrected"), (None, "")):
            part = table.filter((table["variant"] == variant) & table["corrected"].eq_missing(corrected))
            part = part.sort("alpha_true_deg")
            if part.is_empty():
                continue
            x, y = part["alpha_true_deg"].to_numpy(), part["alpha_deg"].to_numpy()
            axes.plot(
                x, y, color=look.colour, marker=look.marker, markersize=8 if look.marker == "*" else 6, linewidth=1.6,
                linestyle=(0, (5, 2)) if corrected is False else "-",
                markerfacecolor="white" if corrected is False else look.colour, label=f"{variant}{words}",
            )  # fmt: skip
    most = max(table["alpha_true_deg"].to_list(), default=0.0)
    axes.plot([0.0, most], [0.0, most], color="black", linewidth=1.0, label="estimate = truth", zorder=1)
    axes.set_xlim(left=-0.03 * max(most, 1.0))
    axes.set_ylim(bottom=0.0)
    tidy(axes, r"true tilt $\alpha_T$ (degrees)", "mean estimated tilt α (degrees)")
    legend_above(axes, columns=2)
    return figure
