<<<<<<< HEAD
"""Corners drawn over their image: rays, vertices, and the imaginary box of each (paper 004, fig. 1c); poses over time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np
from matplotlib.figure import Figure

from tiltvp.images import gray_from

if TYPE_CHECKING:
    import polars as pl
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera, CornerFeature

__all__ = ["draw_box", "draw_corners", "pose_plot"]

_EDGE_COLOURS = ((60, 60, 255), (80, 220, 80), (255, 140, 60))
"""BGR of the edges x, y, z."""
_BOX = (170, 170, 170)
_POINTS = 24
_LENGTH = 0.15
"""Length of the box's edges where nothing is known of its distance, as a share of it."""


def draw_corners(
    image: ArrayLike, camera: Camera, features: Sequence[CornerFeature], chosen: Iterable[int] = ()
) -> NDArray[np.uint8]:
    """The image in dimmed grey, (H, W, 3) BGR uint8, with the rays x red, y green, z blue; those not `chosen` are thin."""
    gray = gray_from(image)
    canvas = np.asarray(cv2.cvtColor((gray * 0.75).astype(np.uint8), cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    wanted = set(chosen)
    order = sorted(range(len(features)), key=lambda place: place in wanted)
    for place in order:
        feature, width = features[place], 2 if place in wanted else 1
        for toward, colour in zip(feature.toward, _EDGE_COLOURS, strict=True):
            share = np.linspace(0.0, 1.0, _POINTS)[:, None]
            _curve(canvas, camera, feature.vertex * (1.0 - share) + toward * share, colour, width)
        at = _whole(camera.project(feature.vertex))
        if at is not None:
            cv2.circle(canvas, at, 6 if width == 2 else 3, (255, 255, 255), 1, cv2.LINE_AA)
    return canvas


def draw_box(
    canvas: NDArray[np.uint8], camera: Camera, vertex: ArrayLike, edges: ArrayLike, length: float | None = None
) -> None:
    """Draws the imaginary box into a picture: edges of equal `length` from the vertex along the rows of `edges`.

    `vertex` (3,) is the vertex in the camera's frame, metres, or its bearing; the default length is a share of its
    distance. The three edges from the vertex are coloured, the others grey.
    """
    origin = np.asarray(vertex, dtype=np.float64)
    axes = np.asarray(edges, dtype=np.float64) * (_LENGTH * np.linalg.norm(origin) if length is None else length)
    share = np.linspace(0.0, 1.0, _POINTS)[:, None]
    for k, axis in enumerate(axes):
        others = [axes[j] for j in range(3) if j != k]
        for start in (others[0], others[1], others[0] + others[1]):
            _curve(canvas, camera, origin + start + axis * share, _BOX, 1)
    for axis, colour in zip(axes, _EDGE_COLOURS, strict=True):
        _curve(canvas, camera, origin + axis * share, colour, 2)


def _curve(
    canvas: NDArray[np.uint8], camera: Camera, points: NDArray[np.float64], colour: tuple[int, int, int], width: int
) -> None:
    pixels = camera.project(points)
    for a, b in zip(pixels[:-1], pixels[1:], strict=True):
        start, end = _whole(a), _whole(b)
        if start is not None and end is not None:
            cv2.line(canvas, start, end, colour, width, cv2.LINE_AA)


def _whole(place: NDArray[np.float64]) -> tuple[int, int] | None:
    if not np.isfinite(place).all() or np.abs(place).max() > 1e5:
        return None
    return round(float(place[0])), round(float(place[1]))


def pose_plot(table: pl.DataFrame, truth: bool = False) -> Figure:
    """Attitude and position over time as in section IV: columns time_s, roll_deg, pitch_deg, yaw_deg, x_m, y_m, z_m.

    With `truth` also columns of the same names with `true_` in front, and below each the difference.
    """
    names = [name for name in ("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m") if name in table.columns]
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
=======
"""Attitudes and positions from corners over time, and their errors, as in section IV of paper 004."""

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
_METHOD_COLOURS: Final = ("0.55", "tab:blue", "tab:orange", "tab:purple")


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
        axes.legend(loc="upper right", ncols=3, frameon=False)
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
>>>>>>> bd11491b5671ce2a9f2f5f1f4bd639284214de90
