"""Poses before a corner over time, as in section IV of Liu et al. 2018."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

if TYPE_CHECKING:
    import polars as pl

__all__ = ["pose_plot"]


def pose_plot(table: pl.DataFrame, truth: bool = False) -> Figure:
    """Attitude and position over time as in section IV: columns time_s, roll_deg, pitch_deg, yaw_deg, x_m, y_m, z_m.

    A position that no row has, as from one camera, is left out. With `truth` also columns of the same names with
    `true_` in front, and beside each the difference.
    """
    names = ["roll_deg", "pitch_deg", "yaw_deg"]
    names += [name for name in ("x_m", "y_m", "z_m") if name in table.columns and table[name].count()]
    figure = Figure(figsize=(11.0, 1.6 * len(names) + 0.8), layout="constrained")
    columns = 2 if truth else 1
    panels = figure.subplots(len(names), columns, sharex=True, squeeze=False)
    time = table["time_s"].to_numpy()
    for row, name in zip(panels, names, strict=True):
        quantity, unit = name.rsplit("_", 1)
        label = f"{quantity} ({'degrees' if unit == 'deg' else 'm'})"
        values = table[name].to_numpy()
        row[0].plot(time, values, ".", markersize=3.0, color="C0", label="estimate")
        if truth:
            true = table[f"true_{name}"].to_numpy()
            row[0].plot(time, true, "-", linewidth=0.8, color="0.4", label="truth")
            row[1].plot(time, values - true, ".", markersize=3.0, color="C3")
            row[1].set_ylabel(f"error, {label}")
        row[0].set_ylabel(label)
        for axes in row:
            axes.grid(color="0.92", linewidth=0.6)
            axes.spines[["top", "right"]].set_visible(False)
    for axes in panels[-1]:
        axes.set_xlabel("time (s)")
    if truth:
        panels[0, 0].legend(frameon=False, fontsize=8)
    return figure
