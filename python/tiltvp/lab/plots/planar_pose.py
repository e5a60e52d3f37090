"""Planar pose error over tilt, one line for each correction: the shape of figure 26."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.axes import Axes

__all__ = ["draw_pose_errors", "planar_pose"]

_STYLES = {
    "none": ("tab:blue", "o", "-"),
    "reject-refit, trained a": ("tab:orange", "s", "-"),
    "reject-refit, closed form": ("tab:green", "^", "-"),
    "refined": ("tab:red", "D", "-"),
    "true tilt": ("black", "", "--"),
}
_LABELS = {"none": "no correction"}


def draw_pose_errors(axes: Axes, summary: pl.DataFrame, error: str, crossing_deg: float | None = None) -> None:
    """The means of one `error` of the summary and their bands, on axes of yours; a grey line where correction pays.

    Columns `error`, `correction`, `alpha_deg`, `mean_deg`, `low_deg`, `high_deg`, as the evaluation makes them.
    """
    rows = summary.filter(summary["error"] == error)
    for (correction,), part in rows.group_by("correction", maintain_order=True):
        colour, marker, line = _STYLES.get(str(correction), ("tab:purple", "x", "-"))
        means = part.sort("alpha_deg")
        tilts = means["alpha_deg"].to_numpy()
        axes.fill_between(
            tilts, means["low_deg"].to_numpy(), means["high_deg"].to_numpy(), color=colour, alpha=0.13, linewidth=0.0
        )
        label = _LABELS.get(str(correction), str(correction))
        axes.plot(tilts, means["mean_deg"].to_numpy(), color=colour, marker=marker, linestyle=line, label=label, ms=5)
    if crossing_deg is not None:
        axes.axvline(crossing_deg, color="0.55", linewidth=1.2, zorder=0)
        axes.annotate(
            f"refined pays\nbeyond {crossing_deg:.1f}°", (crossing_deg, 0.97), xytext=(4, 0),
            xycoords=("data", "axes fraction"), textcoords="offset points", color="0.4", va="top",
        )  # fmt: skip
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    axes.grid(color="0.92")
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlabel("tilt angle (degrees)")
    axes.set_ylabel(f"mean {error} error (degrees)")


def planar_pose(summary: pl.DataFrame, crossings: pl.DataFrame) -> Figure:
    """Orientation and bearing error side by side.

    `summary` as for `draw_pose_errors`; `crossings` has columns `error`, `correction`, `crossing_deg`.
    """
    figure = Figure(figsize=(11.0, 4.6), layout="constrained")
    for axes, error in zip(figure.subplots(1, 2), ("orientation", "bearing"), strict=True):
        chosen = crossings.filter((crossings["error"] == error) & (crossings["correction"] == "refined"))
        draw_pose_errors(axes, summary, error, chosen["crossing_deg"].item() if len(chosen) else None)
        axes.set_title(f"{error} error of min-warping")
    figure.axes[1].legend(loc="upper left", bbox_to_anchor=(0.12, 0.86), frameon=False)
    return figure
