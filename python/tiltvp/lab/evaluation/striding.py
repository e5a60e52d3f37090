"""What looking at fewer rows of an image costs in accuracy and saves in time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
import polars as pl

from tiltvp.lab.evaluation.combinations import PIXEL_METHODS
from tiltvp.lab.evaluation.curves import region_shares
from tiltvp.lab.evaluation.metrics import offset_rad
from tiltvp.lab.evaluation.views import View
from tiltvp.tilt import TiltEstimator, normal_from_alpha_beta

if TYPE_CHECKING:
    from tiltvp.cameras import Camera

__all__ = ["STRIDES", "stride_views", "summarise_strides"]

STRIDES: Final = (1, 2, 3, 4)
"""The values of `row_stride` that are looked at; the first is what the others are compared with."""

_REGION: Final = 0.9
"""Nominal probability of the covariance's region in which truths are counted."""


def stride_views(
    views: Iterable[View],
    camera: Camera,
    *,
    strides: Sequence[int] = STRIDES,
    repeats: int = 5,
    advance: Callable[[], None] = lambda: None,
) -> pl.DataFrame:
    """One row for each view, method and stride: the error (eq. 44) as a vector, the covariance, and the time.

    Methods are those of edge pixels: straight edges want every row. Strides take turns on a view; `time_s` is the
    fastest of `repeats`.
    """
    made = [
        (method, stride, TiltEstimator(camera, method=method, row_stride=stride))
        for method in PIXEL_METHODS
        for stride in strides
    ]
    rows: list[dict[str, object]] = []
    for number, view in enumerate(views):
        true = normal_from_alpha_beta(view.alpha_rad, view.beta_rad)
        fastest = dict.fromkeys(range(len(made)), np.inf)
        for _ in range(repeats):
            for place, (_, _, estimator) in enumerate(made):
                start = time.perf_counter()
                estimator(view.image)
                fastest[place] = min(fastest[place], time.perf_counter() - start)
        for place, (method, stride, estimator) in enumerate(made):
            estimate = estimator(view.image)
            row: dict[str, object] = {"view": number, "method": method, "row_stride": stride, "time_s": fastest[place]}
            if estimate:
                error, covariance = offset_rad(estimate.normal, true), estimate.covariance_rad2
                row |= {
                    "offset_x_rad": float(error[0]),
                    "offset_y_rad": float(error[1]),
                    "error_rad": float(np.linalg.norm(error)),
                    "covariance_xx_rad2": float(covariance[0, 0]),
                    "covariance_xy_rad2": float(covariance[0, 1]),
                    "covariance_yy_rad2": float(covariance[1, 1]),
                }
            rows.append(row)
        advance()
    return pl.DataFrame(rows, infer_schema_length=None)


def summarise_strides(table: pl.DataFrame) -> pl.DataFrame:
    """One row for each method and stride: errors in degrees, the share of truths within the covariance's 90 % regions,
    how many views have no answer, and the median over views of the time relative to that of the first stride.
    """
    first = table.filter(pl.col("row_stride") == table["row_stride"][0]).select("view", "method", time_first_s="time_s")
    ratios = table.join(first, on=["view", "method"]).with_columns(ratio=pl.col("time_s") / pl.col("time_first_s"))
    rows: list[dict[str, object]] = []
    for (method, stride), part in ratios.group_by("method", "row_stride", maintain_order=True):
        error = np.rad2deg(part["error_rad"].drop_nulls().to_numpy())
        told = part.with_columns(variant=pl.lit(method), yaw_rad=pl.lit(0.0))
        held = region_shares(told, np.array([_REGION]))["share"]
        rows.append(
            {
                "method": method,
                "row_stride": stride,
                "mean": float(error.mean()) if len(error) else None,
                "p95": float(np.percentile(error, 95)) if len(error) else None,
                "held": float(held[0]) if len(held) else None,
                "failed": part["error_rad"].null_count(),
                "time": float(np.median(part["ratio"].to_numpy())),
            }
        )
    return pl.DataFrame(rows, infer_schema_length=None)
