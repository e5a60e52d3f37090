"""Figure 17: the normals m_k of edge pixels as arrows on the sphere of bearings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mpl_toolkits.mplot3d  # type: ignore[import-untyped]  # noqa: F401  (makes the projection "3d" known)
import numpy as np

from tiltvp.lab.plots.report.style import ESTIMATE_COLOUR, blank_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

__all__ = ["ARROW_LENGTH", "NormalPanel", "normal_panels"]

ARROW_LENGTH = 0.22
"""Of an arrow, in radii of the sphere of bearings."""


@dataclass(frozen=True)
class NormalPanel:
    """Unit bearings (N, 3) and unit normals (N, 3) of edge pixels in the robot frame, and the words above."""

    title: str
    bearings: NDArray[np.float64]
    normals: NDArray[np.float64]


def normal_panels(panels: Sequence[NormalPanel]) -> Figure:
    """Arrows with their base on the bearing of the pixel and the direction of its normal, robot frame."""
    figure = blank_figure(3.6)
    for i, panel in enumerate(panels):
        axes = figure.add_subplot(1, len(panels), i + 1, projection="3d")
        start, step = panel.bearings.T, ARROW_LENGTH * panel.normals.T
        axes.quiver(*start, *step, color=ESTIMATE_COLOUR, linewidth=0.7, arrow_length_ratio=0.3)
        axes.quiver(0, 0, 0, 0, 0, 1.25, color="black", linewidth=1.6, arrow_length_ratio=0.08)
        axes.text(0.0, 0.0, 1.3, "z", fontsize=10)
        axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(0, 1.25))
        axes.set_xticks([-1, 0, 1])
        axes.set_yticks([-1, 0, 1])
        axes.set_zticks([0, 0.5, 1])
        axes.set_box_aspect((2, 2, 1.25), zoom=1.2)
        axes.view_init(elev=22.0, azim=-60.0)
        axes.set_xlabel("x, forward", fontsize=9)
        axes.set_ylabel("y, left", fontsize=9)
        axes.tick_params(labelsize=8, pad=-1)
        axes.set_title(panel.title, fontsize=10)
    return figure
