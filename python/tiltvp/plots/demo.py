"""The figures of the demo: one image explained from its edges to the errors of every method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from tiltvp.plots.methods import draw_leans, draw_method_errors
from tiltvp.plots.offsets import Cosine, draw_offset_histogram
from tiltvp.plots.picture import show_picture

if TYPE_CHECKING:
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
    figure = Figure(figsize=(13.0, 11.0), layout="constrained")
    parts = np.ravel(np.asarray(figure.subfigures(2, 1, height_ratios=(1.0, 0.72)), dtype=object))
    above, below = parts[0], parts[1]
    picture, histogram = above.subplots(1, 2, width_ratios=(1.0, 1.0))
    show_picture(picture, data.overlay, "edges that agree (hue: direction), horizon and zenith")
    draw_offset_histogram(histogram, data.phi_rad, data.offset_px, data.cosines)
    histogram.set_title("offsets of all edge pixels: a tilt is a cosine")
    errors, leans = below.subplots(1, 2, width_ratios=(1.0, 0.72))
    draw_method_errors(errors, data.table)
    errors.set_title("error of every method")
    draw_leans(leans, data.table, alpha_rad=data.alpha_rad, beta_rad=data.beta_rad)
    leans.set_title("true and estimated lean")
    return figure


def demo_summary(data: DemoData) -> Figure:
    """One row for a README: the leaning image with its edges, the image made level, and the histogram."""
    figure = Figure(figsize=(13.0, 4.7), layout="constrained")
    edges, levelled, histogram = figure.subplots(1, 3)
    show_picture(edges, data.overlay, "vertical edges of a leaning robot's view")
    show_picture(levelled, data.levelled, "made level by the estimate")
    draw_offset_histogram(histogram, data.phi_rad, data.offset_px, data.cosines)
    histogram.set_title("edge offsets, and the tilt behind them")
    return figure
