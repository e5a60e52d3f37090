"""Methods compared: the error of each estimate, and where it lies beside the truth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.axes import Axes

__all__ = ["draw_leans", "draw_method_errors", "method_errors", "method_styles"]

_MARKERS = "oX^sDvP*<>hp"
_COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:purple", "tab:brown", "tab:pink", "tab:olive", "tab:cyan")


def method_styles(count: int) -> list[tuple[str, str]]:
    """A colour and a marker for each of `count` methods, in the order of the rows."""
    return [(_COLOURS[i % len(_COLOURS)], _MARKERS[i % len(_MARKERS)]) for i in range(count)]


def draw_method_errors(axes: Axes, table: pl.DataFrame) -> None:
    """Horizontal bars: the column `error_rad` of each row, named by the column `method`, first row on top."""
    names, errors = table["method"].to_list(), np.degrees(table["error_rad"].to_numpy().astype(np.float64))
    rows = np.arange(len(names))[::-1]
    colours = [colour for colour, _ in method_styles(len(names))]
    axes.barh(rows, np.nan_to_num(errors), color=colours, height=0.62)
    for row, error in zip(rows, errors, strict=True):
        axes.annotate(
            f"{error:.2f}°" if np.isfinite(error) else "no tilt",
            (float(np.nan_to_num(error)), float(row)),
            xytext=(5, 0),
            textcoords="offset points",
            va="center",
        )
    largest = float(np.nanmax(errors)) if np.isfinite(errors).any() else 1.0
    axes.set_xlim(0.0, max(1.22 * largest, 0.1))
    axes.set_yticks(rows, names)
    axes.set_xlabel("error: angle between true and estimated normal (degrees)")
    axes.spines[["top", "right"]].set_visible(False)


def draw_leans(axes: Axes, table: pl.DataFrame, *, alpha_rad: float, beta_rad: float) -> None:
    """Where the robot leans to, forward up and left to the left: the truth as a cross, each row as a marker.

    Columns `method`, `alpha_rad`, `beta_rad`. A step in the picture is the error of eq. 44 for small tilts.
    """
    true = np.degrees(alpha_rad) * np.array([-np.sin(beta_rad), np.cos(beta_rad)])
    leans = [(true[0], true[1])]
    styles = method_styles(table.height)
    for row, (colour, marker) in zip(table.iter_rows(named=True), styles, strict=True):
        if row["alpha_rad"] is None or row["beta_rad"] is None:
            continue
        alpha, beta = np.degrees(row["alpha_rad"]), row["beta_rad"]
        place = (-alpha * np.sin(beta), alpha * np.cos(beta))
        if np.isfinite(place).all():
            leans.append(place)
            label = row["method"]
            axes.plot(*place, marker=marker, color=colour, markersize=8, linestyle="none", label=label, zorder=3)
    axes.plot(*true, marker="+", color="red", markersize=16, markeredgewidth=2.4, label="true", zorder=4)
    axes.annotate("true", true, xytext=(9, 7), textcoords="offset points", color="red")
    places = np.array([*leans, (0.0, 0.0)])
    low, high = places.min(axis=0), places.max(axis=0)
    reach = 0.5 * float((high - low).max()) + 0.7
    (x, y), turn = (low + high) / 2.0, np.linspace(0.0, 2.0 * np.pi, 361)
    for radius in range(1, int(np.hypot(abs(x) + reach, abs(y) + reach)) + 1):
        axes.plot(radius * np.cos(turn), radius * np.sin(turn), color="0.85", linewidth=0.8, zorder=0)
    axes.axhline(0.0, color="0.75", linewidth=0.8, zorder=0)
    axes.axvline(0.0, color="0.75", linewidth=0.8, zorder=0)
    axes.set(xlim=(x - reach, x + reach), ylim=(y - reach, y + reach), aspect="equal")
    axes.set_xlabel("lean to the right (degrees)")
    axes.set_ylabel("lean forward (degrees)")


def method_errors(table: pl.DataFrame) -> Figure:
    """The figure of `draw_method_errors` alone."""
    figure = Figure(figsize=(8.0, 0.45 * table.height + 1.2), layout="constrained")
    draw_method_errors(figure.add_subplot(), table)
    return figure
