"""One image through every combination: gradients and edge pixels once for each threshold, then every fit on them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np
import polars as pl

from tiltvp._core import normal_from_alpha_beta
from tiltvp.lab.evaluation.combinations import PIXEL_METHODS, Combination
from tiltvp.lab.evaluation.metrics import offset_rad, turned
from tiltvp.lab.evaluation.schema import COLUMNS
from tiltvp.tilt import TiltEstimate, TiltEstimator

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp.cameras import Camera

__all__ = ["ImageRunner", "View"]

P = ParamSpec("P")
T = TypeVar("T")

_EDGE_OPTIONS = ("gradient_min", "smoothing_px", "elevation_min_rad", "elevation_max_rad", "margin_px", "row_stride")
"""What edge pixels depend on beside the camera, its mounting and the mask."""

VARIED = ("gradient_min", "keep_fraction", "threshold_px", "threshold_rad")


@dataclass(frozen=True)
class View:
    """What is known of an image: its number and file, where it was taken, the true lean and the heading in radians."""

    number: int
    file: str
    location: str
    environment: str
    alpha_true_rad: float
    beta_true_rad: float
    yaw_rad: float = 0.0


class ImageRunner:
    """The estimators of all combinations for one camera, made once; threads share them."""

    def __init__(
        self,
        camera: Camera,
        combinations: Sequence[Combination],
        *,
        robot_from_camera: ArrayLike | None = None,
        mask: NDArray[np.bool_] | None = None,
        seed: int = 0,
    ) -> None:
        """`seed` is that of all sampling. Raises `InvalidInputError` for an option that its method does not have."""
        mounting: dict[str, Any] = {"robot_from_camera": robot_from_camera, "mask": mask, "seed": seed}
        firsts: dict[str, TiltEstimator] = {}
        estimators = []
        for combination in combinations:
            if combination.method not in firsts:
                firsts[combination.method] = TiltEstimator(camera, method=combination.method, **mounting)
            estimators.append(firsts[combination.method].with_options(**combination.options))
        self.combinations = tuple(combinations)
        self.options: tuple[dict[str, Any], ...] = tuple(_plain_options(each) for each in estimators)
        """The options in force of each combination, without the mask."""
        self._by_edges: dict[tuple[object, ...], list[tuple[int, TiltEstimator]]] = {}
        self._whole: list[tuple[int, TiltEstimator]] = []
        for number, (options, estimator) in enumerate(zip(self.options, estimators, strict=True)):
            if combinations[number].method not in PIXEL_METHODS:
                self._whole.append((number, estimator))
                continue
            key = tuple(options[name] for name in _EDGE_OPTIONS)
            self._by_edges.setdefault(key, []).append((number, estimator))
        self._constant = _constant_columns(self.combinations, self.options)

    def __call__(self, image: NDArray[np.uint8], view: View) -> pl.DataFrame:
        """The rows of an image (H, W) before any training: one for each combination, in their order."""
        count = len(self.combinations)
        estimates: dict[int, TiltEstimate] = {}
        times_edges, times_fit = np.zeros(count), np.zeros(count)
        for members in self._by_edges.values():
            edges, time_edges = _timed(members[0][1].detect, image)
            for number, estimator in members:
                estimate, time_fit = _timed(estimator.estimate_edges, edges)
                estimates[number], times_edges[number], times_fit[number] = estimate, time_edges, time_fit
        # All the time of a method that is not given edge pixels counts as that of its fit.
        for number, estimator in self._whole:
            estimates[number], times_fit[number] = _timed(estimator, image)
        in_order = [estimates[number] for number in range(count)]
        normals = np.stack([each.normal for each in in_order])
        columns: dict[str, Any] = _view_columns(view, count) | self._constant | _estimate_columns(in_order)
        columns |= _error_columns(normals, view) | {"time_edges_s": times_edges, "time_fit_s": times_fit}
        return pl.DataFrame({name: columns[name] for name in COLUMNS}, schema=COLUMNS)


def _timed(work: Callable[P, T], *arguments: P.args, **keywords: P.kwargs) -> tuple[T, float]:
    start = time.perf_counter()
    result = work(*arguments, **keywords)
    return result, time.perf_counter() - start


def _plain_options(estimator: TiltEstimator) -> dict[str, Any]:
    return {name: value for name, value in estimator.options.items() if name != "mask"}


def _constant_columns(
    combinations: Sequence[Combination], options: Sequence[dict[str, Any]]
) -> dict[str, Sequence[object]]:
    """The columns that do not depend on the image."""
    kinds = ["closed-form" if each.options.get("correction") == "closed-form" else "none" for each in combinations]
    nothing: list[object] = [None] * len(combinations)
    columns: dict[str, Sequence[object]] = {name: [each.get(name) for each in options] for name in VARIED}
    return columns | {
        "combination": range(len(combinations)),
        "method": [each.method for each in combinations],
        "label": [each.label for each in combinations],
        "group": [each.group for each in combinations],
        "correction": kinds,
        "factor": nothing,
        "offset_rad": nothing,
    }


def _view_columns(view: View, count: int) -> dict[str, Sequence[object]]:
    values = {
        "image": view.number,
        "file": view.file,
        "location": view.location,
        "environment": view.environment,
        "alpha_true_rad": view.alpha_true_rad,
        "beta_true_rad": view.beta_true_rad,
        "yaw_rad": view.yaw_rad,
    }
    return {name: [value] * count for name, value in values.items()}


def _estimate_columns(estimates: Sequence[TiltEstimate]) -> dict[str, Any]:
    """The columns that estimates fill; null where there is no estimate."""
    covariances = np.stack([each.covariance_rad2 for each in estimates])
    alphas = [_finite(each.alpha_rad) for each in estimates]
    reports = [each.report for each in estimates]
    return {
        "alpha_raw_rad": alphas,
        "alpha_rad": alphas,
        "beta_rad": [_finite(each.beta_rad) for each in estimates],
        "shift_px": [each.shift_px for each in estimates],
        "covariance_xx_rad2": [_finite(value) for value in covariances[:, 0, 0].tolist()],
        "covariance_xy_rad2": [_finite(value) for value in covariances[:, 0, 1].tolist()],
        "covariance_yy_rad2": [_finite(value) for value in covariances[:, 1, 1].tolist()],
        "confidence": [each.confidence for each in estimates],
        "edge_pixels": [each.edge_pixels for each in estimates],
        "prefiltered_pixels": [each.prefiltered_pixels for each in estimates],
        "inlier_pixels": [each.inlier_pixels for each in estimates],
        "iterations": [each.iterations for each in reports],
        "stop": [each.stop for each in reports],
    }


def _error_columns(normals: NDArray[np.float64], view: View) -> dict[str, Sequence[object]]:
    """The errors of (N, 3) normals against the view's own; null where a normal is NaN."""
    true = normal_from_alpha_beta(view.alpha_true_rad, view.beta_true_rad)
    offsets = turned(offset_rad(normals, true), view.yaw_rad)
    lengths = np.hypot(offsets[:, 0], offsets[:, 1])
    columns = {"error_rad": lengths, "offset_x_rad": offsets[:, 0], "offset_y_rad": offsets[:, 1]}
    return {name: [_finite(value) for value in values.tolist()] for name, values in columns.items()}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
