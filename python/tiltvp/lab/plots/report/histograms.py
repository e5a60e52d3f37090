"""Figures 11, 12, 14 and 27: (phi, s) histograms of edge pixels beside each other, with the true and fitted cosines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tiltvp.lab.plots.offsets import draw_offset_histogram
from tiltvp.lab.plots.report.style import blank_figure
from tiltvp.overlays.offsets import Cosine

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

__all__ = ["OffsetPanel", "offset_panels"]


@dataclass(frozen=True)
class OffsetPanel:
    """Edge pixels by phi (N,) in radians and s (N,) in pixels, the cosines over them, and the words above."""

    title: str
    phi_rad: NDArray[np.float64]
    offset_px: NDArray[np.float64]
    cosines: tuple[Cosine, ...]


def offset_panels(panels: Sequence[OffsetPanel], *, offset_max_px: float = 40.0) -> Figure:
    """Histograms side by side on the same axes, darker where more edge pixels are, with one legend for all."""
    figure = blank_figure(3.9)
    first = None
    for i, panel in enumerate(panels):
        axes = figure.add_subplot(1, len(panels), i + 1, sharey=first)
        draw_offset_histogram(
            axes, panel.phi_rad, panel.offset_px, panel.cosines, offset_max_px=offset_max_px, legend=False
        )
        axes.set_title(panel.title, fontsize=10)
        if first is not None:
            axes.set_ylabel("")
            axes.tick_params(labelleft=False)
        first = first or axes
    entries: dict[str, Artist] = {}
    for axes in figure.axes:
        handles, names = axes.get_legend_handles_labels()
        entries.update(zip(names, handles, strict=True))
    if entries:
        lines, words = list(entries.values()), list(entries)
        figure.legend(lines, words, loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    return figure
