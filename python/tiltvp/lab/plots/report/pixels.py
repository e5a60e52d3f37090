"""Figures 10, 13, 18 and 27: edge pixels over the images they were found in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from tiltvp.lab.plots.offsets import draw_offset_histogram
from tiltvp.lab.plots.picture import show_picture
from tiltvp.lab.plots.report.style import blank_figure
from tiltvp.overlays.edges import draw_edges

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from tiltvp._core import EdgeElements
    from tiltvp.lab.plots.report.histograms import OffsetPanel

__all__ = ["SeenEdges", "consensus_pixels", "pixels_and_offsets", "prefiltered_pixels"]

_RED = (50, 50, 255)
_DIMMED = 0.7


@dataclass(frozen=True)
class SeenEdges:
    """An image (H, W) uint8, its edge pixels, and the words above it."""

    image: NDArray[np.uint8]
    edges: EdgeElements
    title: str


def prefiltered_pixels(seen: Sequence[SeenEdges], *, offset_max_px: float = 40.0) -> Figure:
    """Figures 10 and 13: the prefiltered set F in colour, hue for phi and saturation for |s|, with a key below."""
    figure = blank_figure(4.9 if len(seen) > 1 else 6.4)
    shapes = figure.subplot_mosaic(
        [[f"image {i}" for i in range(len(seen))], ["key"] * len(seen)],
        height_ratios=(1.0, 0.13 if len(seen) > 1 else 0.1),
    )
    for i, item in enumerate(seen):
        dimmed = np.asarray(item.image * _DIMMED, dtype=np.uint8)
        picture = draw_edges(dimmed, item.edges, offset_max_px=offset_max_px)
        _show(shapes[f"image {i}"], picture[_crop(item)], item.title)
    _draw_key(shapes["key"], offset_max_px)
    return figure


def pixels_and_offsets(seen: SeenEdges, panel: OffsetPanel, *, offset_max_px: float = 40.0) -> Figure:
    """Figure 27: the prefiltered edge pixels of one image, and their (phi, s) histogram."""
    figure = blank_figure(4.0)
    picture, histogram = figure.subplots(1, 2, width_ratios=(1.0, 1.15))
    dimmed = np.asarray(seen.image * _DIMMED, dtype=np.uint8)
    _show(picture, draw_edges(dimmed, seen.edges, offset_max_px=offset_max_px)[_crop(seen)], seen.title)
    draw_offset_histogram(
        histogram, panel.phi_rad, panel.offset_px, panel.cosines, offset_max_px=offset_max_px, legend=False
    )
    histogram.set_title(panel.title, fontsize=10)
    figure.legend(*histogram.get_legend_handles_labels(), loc="outside lower right", ncols=3, frameon=False, fontsize=9)
    return figure


def consensus_pixels(seen: Sequence[SeenEdges]) -> Figure:
    """Figure 18: the edge pixels that agree with the estimate in red."""
    figure = blank_figure(4.2 if len(seen) > 1 else 6.0)
    for axes, item in zip(np.atleast_1d(figure.subplots(1, len(seen))), seen, strict=True):
        crop = _crop(item)
        picture = _enlarged(np.asarray(cv2.cvtColor(item.image[crop], cv2.COLOR_GRAY2BGR), dtype=np.uint8))
        agree = _enlarged(item.edges.inlier_mask[crop].astype(np.uint8))
        picture[np.asarray(cv2.dilate(agree, np.ones((3, 3), dtype=np.uint8))) > 0] = _RED
        show_picture(axes, picture)
        axes.set_title(item.title, fontsize=10)
    return figure


def _crop(item: SeenEdges) -> tuple[slice, slice]:
    """Rows and columns of the part of the image in which there are edge pixels, a little wider."""
    if not len(item.edges):
        return slice(None), slice(None)
    height, width = item.image.shape
    u, v = item.edges.u.astype(int), item.edges.v.astype(int)
    margin = round(0.02 * max(height, width))
    rows = slice(max(int(v.min()) - margin, 0), min(int(v.max()) + margin + 1, height))
    return rows, slice(max(int(u.min()) - margin, 0), min(int(u.max()) + margin + 1, width))


def _show(axes: Axes, picture: NDArray[np.uint8], title: str) -> None:
    show_picture(axes, _enlarged(picture))
    axes.set_title(title, fontsize=10)


def _enlarged(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Twice as large, so that single coloured pixels keep their colour in a figure of another size."""
    return np.repeat(np.repeat(picture, 2, axis=0), 2, axis=1)


def _draw_key(axes: Axes, offset_max_px: float) -> None:
    """Which colour means what: phi to the right, |s| upwards."""
    hue, away = np.meshgrid(np.linspace(0.0, 179.0, 360), np.linspace(1.0, 0.0, 40))
    hsv = np.stack([hue, 255.0 * (1.0 - away), np.full_like(hue, 255.0)], axis=-1).astype(np.uint8)
    rgb = cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB)
    axes.imshow(rgb, extent=(0.0, 180.0, 0.0, offset_max_px), aspect="auto")
    axes.set_xticks([0, 45, 90, 135, 180])
    axes.set_yticks([0.0, offset_max_px], ["0", f"{offset_max_px:.0f}"])
    axes.set_xlabel("hue: gradient direction φ (degrees)", fontsize=9)
    axes.set_ylabel("|s| (px)", fontsize=9)
    axes.tick_params(labelsize=8)
