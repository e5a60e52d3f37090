"""Corners over their image: rays, vertices and imaginary boxes (paper 004, fig. 1c); poses over time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
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
    """The image in dimmed grey, (H, W, 3) BGR uint8, with the rays x red, y green, z blue; those not `chosen` are
    thin.
    """
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
    for a, b in pairwise(pixels):
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
