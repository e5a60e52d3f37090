"""The tilt over the images of a drive: what each image says, what the filter makes of it, and the truth."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

__all__ = ["draw_filtered_component", "filtered_tilt"]

_RAW, _LEFT_OUT, _FILTERED, _TRUE = "0.55", "tab:red", "tab:blue", "black"


def draw_filtered_component(axes: Axes, table: pl.DataFrame, name: str) -> None:
    """One component, "roll" or "pitch", in degrees over the rows of the table.

    Columns `{name}_rad` and `sigma_rad` of each image (drawn with two standard deviations), `filtered_{name}_rad` and
    `filtered_sigma_rad` (a line in a band of two standard deviations, interrupted where the filter abstains),
    `accepted` (images left out are crosses, also those beyond the axes' limits); and, if there, `{name}_true_rad`.
    """
    frames = np.arange(table.height)
    raw, spread = _degrees(table, f"{name}_rad"), 2.0 * _degrees(table, "sigma_rad")
    line, band = _degrees(table, f"filtered_{name}_rad"), 2.0 * _degrees(table, "filtered_sigma_rad")
    fused = table["accepted"].fill_null(False).to_numpy().astype(bool) & np.isfinite(raw)
    left_out = ~fused & np.isfinite(raw)
    low, high = _limits(raw[fused], line - band, line + band, _true(table, name))
    axes.set_ylim(low, high)
    axes.errorbar(
        frames[fused], raw[fused], spread[fused],
        fmt="o", color=_RAW, markersize=3, elinewidth=0.8, label="image, 2 sigma", zorder=2,
    )  # fmt: skip
    if left_out.any():
        axes.plot(
            frames[left_out], np.clip(raw[left_out], low, high),
            "x", color=_LEFT_OUT, markersize=7, markeredgewidth=1.6, clip_on=False, label="image left out", zorder=4,
        )  # fmt: skip
    without = ~np.isfinite(raw)
    if without.any():
        axes.plot(
            frames[without], np.full(int(without.sum()), low),
            "|", color=_LEFT_OUT, markersize=8, clip_on=False, label="image without a tilt", zorder=4,
        )  # fmt: skip
    axes.fill_between(frames, line - band, line + band, color=_FILTERED, alpha=0.22, linewidth=0, zorder=1)
    axes.plot(frames, line, color=_FILTERED, linewidth=1.8, label="filtered, 2 sigma", zorder=3)
    known = np.concatenate([[False], np.isfinite(line), [False]])
    alone = known[1:-1] & ~known[:-2] & ~known[2:]
    # Of one frame there is neither a line nor a band.
    axes.errorbar(frames[alone], line[alone], band[alone], fmt="o", color=_FILTERED, markersize=4, zorder=3)
    if f"{name}_true_rad" in table.columns:
        axes.plot(frames, _true(table, name), color=_TRUE, linewidth=1.0, linestyle="--", label="true", zorder=5)
    axes.set_ylabel(f"{name} (degrees)")
    axes.grid(color="0.9", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)


def filtered_tilt(table: pl.DataFrame) -> Figure:
    """Roll and pitch of a drive, one above the other: see `draw_filtered_component`; rows in the order of the drive."""
    figure = Figure(figsize=(10.0, 6.4), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    draw_filtered_component(upper, table, "roll")
    draw_filtered_component(lower, table, "pitch")
    lower.set_xlabel("image")
    lower.xaxis.get_major_locator().set_params(integer=True, min_n_ticks=1)
    lower.set_xlim(-0.5, max(table.height - 0.5, 0.5))
    handles, labels = upper.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    return figure


def _degrees(table: pl.DataFrame, column: str) -> NDArray[np.float64]:
    values = table[column].cast(float).fill_null(np.nan).to_numpy()
    return np.asarray(np.degrees(values), dtype=np.float64)


def _true(table: pl.DataFrame, name: str) -> NDArray[np.float64]:
    column = f"{name}_true_rad"
    return _degrees(table, column) if column in table.columns else np.empty(0)


def _limits(*parts: NDArray[Any]) -> tuple[float, float]:
    """Limits that hold all finite values, with a little room."""
    values = np.concatenate([part[np.isfinite(part)] for part in parts])
    low, high = (float(values.min()), float(values.max())) if values.size else (-1.0, 1.0)
    room = 0.06 * (high - low) + 0.1
    return low - room, high + room
