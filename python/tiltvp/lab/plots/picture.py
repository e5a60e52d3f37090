"""Figures as images, and images in figures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

__all__ = ["figure_picture", "show_picture"]


def figure_picture(figure: Figure, *, dpi: float = 150.0) -> NDArray[np.uint8]:
    """The figure rendered as (H, W, 3) BGR uint8; no window and no process-wide setting is involved."""
    figure.set_dpi(dpi)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # type: ignore[no-untyped-call]
    rgba = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
    return np.asarray(cv2.cvtColor(rgba, cv2.COLOR_RGBA2BGR), dtype=np.uint8)


def show_picture(axes: Axes, bgr: NDArray[np.uint8], title: str = "") -> None:
    """Shows a BGR or grey image on axes of yours, without ticks."""
    rgb = bgr[:, :, ::-1] if bgr.ndim == 3 else bgr
    axes.imshow(rgb, cmap=None if bgr.ndim == 3 else "gray", vmin=0, vmax=255, interpolation="antialiased")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title(title)
