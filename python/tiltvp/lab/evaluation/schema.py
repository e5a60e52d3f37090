"""The columns of an evaluation's long table: one row for each image, combination and correction."""

from __future__ import annotations

from typing import Final

import polars as pl

__all__ = ["COLUMNS", "CORRECTIONS", "TIMES", "sorted_rows", "without_times"]

CORRECTIONS: Final = ("none", "factor", "affine", "posterior", "closed-form")
"""The corrections in the order of rows: those in the middle are trained on the other locations."""

COLUMNS: Final[dict[str, type[pl.DataType]]] = {
    # The image: number in the dataset, and the true lean. `yaw_rad` is the heading of the view.
    "image": pl.UInt32,
    "file": pl.String,
    "location": pl.String,
    "environment": pl.String,
    "alpha_true_rad": pl.Float64,
    "beta_true_rad": pl.Float64,
    "yaw_rad": pl.Float64,
    # The combination: number in the manifest, and the parameters of table 2 (null where the method has none).
    "combination": pl.UInt16,
    "method": pl.String,
    "label": pl.String,
    "group": pl.String,
    "gradient_min": pl.Float64,
    "keep_fraction": pl.Float64,
    "threshold_px": pl.Float64,
    "threshold_rad": pl.Float64,
    # The correction: a in pixels per radian or a' without unit, and b; null where none of them is meant.
    "correction": pl.String,
    "factor": pl.Float64,
    "offset_rad": pl.Float64,
    # The estimate; null without one. The raw angle is that of eq. 26, or of the vector consensus, or the refined one.
    "alpha_raw_rad": pl.Float64,
    "shift_px": pl.Float64,
    "alpha_rad": pl.Float64,
    "beta_rad": pl.Float64,
    # The error of eq. 44, and as a vector in the upright robot's frame, turned back by the heading.
    "error_rad": pl.Float64,
    "offset_x_rad": pl.Float64,
    "offset_y_rad": pl.Float64,
    # What the estimate says about itself; the covariance is null in rows corrected afterwards and without an estimate.
    "covariance_xx_rad2": pl.Float64,
    "covariance_xy_rad2": pl.Float64,
    "covariance_yy_rad2": pl.Float64,
    "confidence": pl.Float64,
    "edge_pixels": pl.UInt32,
    "prefiltered_pixels": pl.UInt32,
    "inlier_pixels": pl.UInt32,
    "iterations": pl.UInt32,
    "stop": pl.String,
    # Seconds for gradients and edge pixels, and for the fit; an estimate takes their sum.
    "time_edges_s": pl.Float64,
    "time_fit_s": pl.Float64,
}
"""Name and type of each column, in order."""

TIMES: Final = ("time_edges_s", "time_fit_s")
"""The columns that are not the same bytes when an evaluation is repeated."""


def sorted_rows(table: pl.DataFrame) -> pl.DataFrame:
    """The rows by image, combination and correction."""
    rank = pl.col("correction").replace_strict(CORRECTIONS, range(len(CORRECTIONS)), return_dtype=pl.UInt8)
    return table.sort("image", "combination", rank)


def without_times(table: pl.DataFrame) -> pl.DataFrame:
    """The columns that are the same for any number of threads, workers and resumptions."""
    return table.drop(TIMES)
