"""The histogram of edge offsets over gradient directions, with the cosines of tilts (Fleer 2017, fig. 11)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiltvp.overlays.offsets import Cosine, offset_counts

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

__all__ = ["draw_offset_histogram"]


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
    axes.imshow(
        offset_counts(phi_rad, offset_px, offset_max_px).T,
        origin="lower",
        extent=(0.0, 180.0, -offset_max_px, offset_max_px),
        aspect="auto",
        cmap="Greys",
        vmin=0.0,
        vmax=1.0,
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
