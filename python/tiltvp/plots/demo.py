"""The figures of the demo: one image explained from its edges to the errors of every method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from tiltvp.plots.methods import draw_leans, draw_method_errors
from tiltvp.plots.offsets import Cosine, draw_offset_histogram
from tiltvp.plots.picture import show_picture

if TYPE_CHECKING:
    import numpy as np
    import polars as pl
    from numpy.typing import NDArray

    Picture = NDArray[np.uint8]

__all__ = ["DemoData", "demo_plot", "demo_summary"]


@dataclass(frozen=True)
class DemoData:
    """What the figures of the demo show; pictures are BGR uint8, `table` has method, alpha_rad, beta_rad, error_rad."""

    overlay: Picture
    leaning: Picture
    levelled: Picture
    phi_rad: NDArray[np.float64]
    offset_px: NDArray[np.float64]
    cosines: tuple[Cosine, ...]
    table: pl.DataFrame
    alpha_rad: float
    beta_rad: float


def demo_plot(data: DemoData) -> Figure:
    """Edges over the image and their (phi, s) histogram above, errors and leans of every method below."""
    figure = Figure(figsize=(13.0, 10.4), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(1.0, 0.68), width_ratios=(1.0, 1.0))
    show_picture(figure.add_subplot(grid[0, 0]), data.overlay, "edges that agree: hue is their direction")
    histogram = figure.add_subplot(grid[0, 1])
    draw_offset_histogram(histogram, data.phi_rad, data.offset_px, data.cosines)
    histogram.set_title("offset of every edge pixel: a tilt is a cosine")
    errors = figure.add_subplot(grid[1, 0])
    draw_method_errors(errors, data.table)
    errors.set_title("error of every method")
    leans = figure.add_subplot(grid[1, 1])
    draw_leans(leans, data.table, alpha_rad=data.alpha_rad, beta_rad=data.beta_rad)
    leans.set_title("true and estimated lean")
    leans.legend(loc="center left", bbox_to_anchor=(1.02, 0.5), frameon=False, fontsize="medium")
    return figure


def demo_summary(data: DemoData) -> Figure:
    """One row for a README: the leaning image with its edges, the image made level, and the histogram."""
    figure = Figure(figsize=(13.0, 4.6), layout="constrained")
    grid = figure.add_gridspec(1, 3, width_ratios=(1.0, 1.0, 1.0))
    show_picture(figure.add_subplot(grid[0, 0]), data.overlay, "a leaning robot's view: vertical edges, horizon, zenith")
    show_picture(figure.add_subplot(grid[0, 1]), data.levelled, "made level by the estimate")
    histogram = figure.add_subplot(grid[0, 2])
    draw_offset_histogram(histogram, data.phi_rad, data.offset_px, data.cosines)
    histogram.set_title("edge offsets, and the tilt that explains them")
    return figure
