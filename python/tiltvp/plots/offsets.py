"""The edge offset over the gradient direction, figure 11: a histogram of edge pixels, and the cosines of tilts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera

__all__ = ["Cosine", "cosine_of_tilt", "draw_offset_histogram", "offset_histogram"]


@dataclass(frozen=True)
class Cosine:
    """The offsets `s = shift_px cos(direction_rad - phi)` that the vertical edges of one tilt have, eq. 18."""

    label: str
    shift_px: float
    direction_rad: float
    colour: str = "tab:blue"
    dashed: bool = False


def cosine_of_tilt(
    label: str,
    camera: Camera,
    normal: ArrayLike,
    shift_px: float,
    robot_from_camera: ArrayLike | None = None,
    *,
    colour: str = "tab:blue",
    dashed: bool = False,
) -> Cosine:
    """The cosine of a ground normal (3,): its direction is where the vertical vanishing point moves in the image.

    NaN, and therefore no line, where the camera sees neither zenith nor nadir.
    """
    rotation = np.eye(3) if robot_from_camera is None else np.asarray(robot_from_camera, dtype=np.float64)
    leaning, upright = rotation.T @ np.asarray(normal, dtype=np.float64), rotation.T @ np.array([0.0, 0.0, 1.0])
    for sign in (1.0, -1.0):
        moved, still = camera.project(sign * np.stack([leaning, upright]))
        if np.isfinite(moved).all() and np.isfinite(still).all():
            du, dv = moved - still
            return Cosine(label, shift_px, float(np.arctan2(dv, du)), colour, dashed)
    return Cosine(label, shift_px, float("nan"), colour, dashed)


def draw_offset_histogram(
    axes: Axes,
    phi_rad: ArrayLike,
    offset_px: ArrayLike,
    cosines: tuple[Cosine, ...] = (),
    *,
    offset_max_px: float = 40.0,
    legend: bool = True,
) -> None:
    """Draws the (phi, s) histogram, darker where more edge pixels are, and the cosines, on axes of yours."""
    phi, offset = np.asarray(phi_rad, dtype=np.float64), np.asarray(offset_px, dtype=np.float64)
    limits = [[0.0, 180.0], [-offset_max_px, offset_max_px]]
    counts: NDArray[np.float64] = np.histogram2d(np.degrees(phi), offset, bins=(90, 80), range=limits)[0]
    brightest = float(np.quantile(counts[counts > 0], 0.99)) if (counts > 0).any() else 1.0
    axes.imshow(
        counts.T,
        origin="lower",
        extent=(0.0, 180.0, -offset_max_px, offset_max_px),
        aspect="auto",
        cmap="Greys",
        vmin=0.0,
        vmax=brightest,
    )
    axes.axhline(0.0, color="black", linewidth=0.8, linestyle=(0, (4, 4)))
    grid = np.linspace(0.0, np.pi, 181)
    for cosine in cosines:
        if np.isfinite([cosine.shift_px, cosine.direction_rad]).all():
            axes.plot(
                np.degrees(grid),
                cosine.shift_px * np.cos(cosine.direction_rad - grid),
                color=cosine.colour,
                linestyle="--" if cosine.dashed else "-",
                linewidth=2.2,
                label=cosine.label,
            )
    axes.set(xlim=(0.0, 180.0), ylim=(-offset_max_px, offset_max_px), xticks=[0, 45, 90, 135, 180])
    axes.set_xlabel("gradient direction φ (degrees)")
    axes.set_ylabel("edge offset s (pixels)")
    if cosines and legend:
        axes.legend(loc="upper right", framealpha=0.9)


def offset_histogram(
    phi_rad: ArrayLike, offset_px: ArrayLike, cosines: tuple[Cosine, ...] = (), *, offset_max_px: float = 40.0
) -> Figure:
    """The figure of `draw_offset_histogram` alone."""
    figure = Figure(figsize=(6.0, 4.0), layout="constrained")
    draw_offset_histogram(figure.add_subplot(), phi_rad, offset_px, cosines, offset_max_px=offset_max_px)
    return figure
