"""Attitudes and positions from corners over time, and their errors, as in section IV of Liu et al. 2018."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.figure import Figure

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

__all__ = ["corner_errors", "draw_attitude_errors", "draw_position_errors", "inertial_errors"]

_COLOURS: Final = ("tab:red", "tab:green", "tab:blue")
_METHOD_COLOURS: Final = ("0.55", "black", "tab:olive", "tab:green", "tab:blue", "tab:orange", "tab:purple")


def draw_attitude_errors(axes: Axes, table: pl.DataFrame) -> None:
    """Columns `time_s`, `roll_deg`, `pitch_deg`, `yaw_deg`: their errors over time; null where nothing was found."""
    for name, colour in zip(("roll", "pitch", "yaw"), _COLOURS, strict=True):
        axes.plot(*_over_time(table, f"{name}_deg"), color=colour, linewidth=0.9, label=name)
    _furnish(axes, "attitude error (degrees)")


def draw_position_errors(axes: Axes, table: pl.DataFrame) -> None:
    """Columns `time_s`, `x_m`, `y_m`, `z_m`: the errors of the camera's place in the object's frame, in millimetres."""
    for name, colour in zip(("x", "y", "z"), _COLOURS, strict=True):
        times, values = _over_time(table, f"{name}_m")
        axes.plot(times, 1000.0 * values, color=colour, linewidth=0.9, label=name)
    _furnish(axes, "position error (mm)")


def corner_errors(table: pl.DataFrame, title: str = "") -> Figure:
    """Errors of attitude and position, and the distance (`distance_m`), over the time of one sequence.

    Moments at which nothing was found (`found`) are marked at the foot.
    """
    figure = Figure(figsize=(10.0, 7.2), layout="constrained")
    upper, middle, lower = figure.subplots(3, 1, sharex=True, height_ratios=(3, 3, 1.4))
    draw_attitude_errors(upper, table)
    draw_position_errors(middle, table)
    lower.plot(*_over_time(table, "distance_m"), color="black", linewidth=1.0)
    _furnish(lower, "distance (m)")
    missing = table["time_s"].to_numpy()[~table["found"].to_numpy().astype(bool)]
    if missing.size:
        low = lower.get_ylim()[0]
        lower.plot(missing, np.full(missing.size, low), "|", color="tab:red", markersize=9, label="no corner found")
        lower.legend(loc="lower right", frameon=False)
    lower.set_xlabel("time (s)")
    for axes in (upper, middle):
        # Above the panel, where no curve is.
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.1, ncols=3, frameon=False)
    if title:
        figure.suptitle(title)
    return figure


def inertial_errors(table: pl.DataFrame) -> Figure:
    """Errors of roll, pitch and yaw in degrees over time, one line for each `method`.

    Columns `method`, `time_s`, `roll`, `pitch`, `yaw` (null where a method does not know it).
    """
    figure = Figure(figsize=(10.0, 7.2), layout="constrained")
    rows = figure.subplots(3, 1, sharex=True)
    for axes, name in zip(rows, ("roll", "pitch", "yaw"), strict=True):
        parts = table.partition_by("method", as_dict=True, maintain_order=True)
        for k, ((method,), part) in enumerate(parts.items()):
            if part[name].null_count() < part.height:
                colour = _METHOD_COLOURS[k % len(_METHOD_COLOURS)]
                axes.plot(*_over_time(part, name), color=colour, linewidth=0.9, label=str(method), zorder=10 - k)
        _furnish(axes, f"{name} error (degrees)")
    rows[-1].set_xlabel("time (s)")
    handles, labels = rows[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2, frameon=False)
    return figure


def _over_time(table: pl.DataFrame, column: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    values = table[column].cast(float).fill_null(np.nan).to_numpy()
    return table["time_s"].to_numpy(), np.asarray(values, dtype=np.float64)


def _furnish(axes: Axes, label: str) -> None:
    axes.set_ylabel(label)
    axes.axhline(0.0, color="0.6", linewidth=0.6, zorder=0)
    axes.grid(color="0.92", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
