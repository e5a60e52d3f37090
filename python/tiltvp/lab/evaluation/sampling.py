"""What the options of the sampling loop are worth: each alone and together, side by side on the same edges."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from tiltvp.lab.evaluation.metrics import offset_rad, relative_errors_rad
from tiltvp.lab.evaluation.views import View
from tiltvp.tilt import TiltEstimator, normal_from_alpha_beta

if TYPE_CHECKING:
    from tiltvp.cameras import Camera

__all__ = ["PLAIN", "SAMPLERS", "WAYS", "Sampler", "sample_views", "summarise_sampling"]


@dataclass(frozen=True)
class Sampler:
    """A sampling method with the options that stay the same for all ways of sampling."""

    label: str
    method: str
    options: dict[str, Any]


SAMPLERS: tuple[Sampler, ...] = (
    Sampler("image-space RANSAC, closed-form gain", "image-space-ransac", {}),
    Sampler(
        "vector consensus, tangent normals",
        "vector-consensus",
        {"normal": "tangent", "gradient_min": 300.0, "threshold_rad": float(np.deg2rad(2.0))},
    ),
)
"""Both sampling methods, in the variants that need no training, so that the errors are those of the sampling."""

_ORDERED: dict[str, Any] = {"sampling": "progressive"}
_LOCAL: dict[str, Any] = {"local_optimization": True}
_MSAC: dict[str, Any] = {"score": "msac"}

PLAIN = "plain"
"""The paper's way of sampling, with which the others are compared."""

WAYS: dict[str, dict[str, Any]] = {
    PLAIN: {},
    "progressive": _ORDERED,
    "LO": _LOCAL,
    "MSAC": _MSAC,
    "LO, MSAC": _LOCAL | _MSAC,
    "progressive, LO, MSAC": _ORDERED | _LOCAL | _MSAC,
}
"""The ways of sampling by name: the paper's, each option alone, and combinations."""


def sample_views(
    views: Iterable[View],
    camera: Camera,
    *,
    samplers: Sequence[Sampler] = SAMPLERS,
    ways: Sequence[str] = tuple(WAYS),
    seeds: int = 5,
    advance: Callable[[], None] = lambda: None,
) -> pl.DataFrame:
    """A long table, one row for each view, method, way and seed: error (eq. 44) and its vector, trials, inliers, times.

    The edges of a view are found once for each sampler; the ways then take turns on them, in an order that is
    drawn for each view. `time_edges_s` is that of finding them, `time_fit_s` that of all the rest.
    """
    made = []
    for sampler in samplers:
        base = TiltEstimator(camera, method=sampler.method, **sampler.options)
        variants = [(way, seed, base.with_options(seed=seed, **WAYS[way])) for way in ways for seed in range(seeds)]
        made.append((sampler, base, variants))
    rows: list[dict[str, object]] = []
    for number, view in enumerate(views):
        true = normal_from_alpha_beta(view.alpha_rad, view.beta_rad)
        for sampler, base, variants in made:
            base.detect(view.image)
            start = time.perf_counter()
            edges = base.detect(view.image)
            time_edges = time.perf_counter() - start
            # What the first fit on an image fetches into the caches is not the first way's fault.
            base.estimate_edges(edges)
            for place in np.random.default_rng(number).permutation(len(variants)):
                way, seed, estimator = variants[place]
                start = time.perf_counter()
                estimate = estimator.estimate_edges(edges)
                time_fit = time.perf_counter() - start
                error = offset_rad(estimate.normal, true) if estimate else np.full(2, np.nan)
                rows.append(
                    {
                        "view": number,
                        "location": view.location,
                        "method": sampler.label,
                        "way": way,
                        "seed": seed,
                        "error_x_rad": float(error[0]),
                        "error_y_rad": float(error[1]),
                        "error_rad": float(np.linalg.norm(error)),
                        "trials": estimate.report.iterations,
                        "stop": estimate.report.stop,
                        "inliers": estimate.inlier_pixels,
                        "prefiltered": estimate.prefiltered_pixels,
                        "time_edges_s": time_edges,
                        "time_fit_s": time_fit,
                    }
                )
        advance()
    return pl.DataFrame(rows, infer_schema_length=None)


def summarise_sampling(table: pl.DataFrame) -> pl.DataFrame:
    """One row for each method and way: errors in degrees, trials, times, and whether the way pays.

    `change` is the mean difference of the error to the plain way's on the same views, +- its standard error over
    locations. Times are medians over views and seeds, and `fit` and `image` their ratios to the plain way's: of the fit
    alone, and of all that an image takes. A way pays in error if it lowers it by more than two standard errors
    and by at least 5 %, whatever its time, and in time if the fit takes at most 0.95 of the plain one's and the error
    does not rise by more than two standard errors. There must be rows of the plain way.
    """
    rows: list[dict[str, object]] = []
    for (method,), part in table.group_by("method", maintain_order=True):
        first = part.filter(pl.col("way") == PLAIN)
        of_way = {way: part.filter(pl.col("way") == way) for way in WAYS}
        rows.extend(
            {"method": method, "way": way} | _numbers(found, first) for way, found in of_way.items() if len(found)
        )
    return pl.DataFrame(rows, infer_schema_length=None)


def _numbers(part: pl.DataFrame, first: pl.DataFrame) -> dict[str, object]:
    found = part.filter(pl.col("error_rad").is_finite())
    error = np.rad2deg(found["error_rad"].to_numpy())
    offsets = found.select("error_x_rad", "error_y_rad").to_numpy()
    location = found["location"].to_numpy()
    relative = [relative_errors_rad(offsets[location == name]) for name in dict.fromkeys(location)]
    paired = found.join(first, on=["view", "seed"], suffix="_first").filter(pl.col("error_rad_first").is_finite())
    change = paired.group_by("location").agg((pl.col("error_rad") - pl.col("error_rad_first")).mean())["error_rad"]
    spread = change.std() if len(change) > 1 else None
    mean_change = float(np.rad2deg(change.to_numpy().mean())) if len(change) else float("nan")
    uncertain = float(np.rad2deg(spread)) / len(change) ** 0.5 if isinstance(spread, float) else float("nan")
    fit, edges = float(np.median(part["time_fit_s"].to_numpy())), float(np.median(part["time_edges_s"].to_numpy()))
    fit_first, edges_first = (
        float(np.median(first["time_fit_s"].to_numpy())),
        float(np.median(first["time_edges_s"].to_numpy())),
    )
    fit_ratio, image_ratio = fit / fit_first, (edges + fit) / (edges_first + fit_first)
    least = max(2.0 * uncertain, 0.05 * float(np.rad2deg(np.nanmean(first["error_rad"].to_numpy()))))
    better, worse = mean_change < -least, mean_change > 2.0 * uncertain
    pays = {(True, False): "error", (False, True): "time", (True, True): "error and time"}.get(
        (better, fit_ratio <= 0.95 and not worse), "no"
    )
    return {
        "mean": float(error.mean()) if len(error) else None,
        "p95": float(np.percentile(error, 95)) if len(error) else None,
        "relative mean": float(np.rad2deg(np.concatenate(relative).mean())) if relative else None,
        "change": mean_change,
        "+-": uncertain,
        "trials": float(np.mean(part["trials"].to_numpy())),
        "fit ms": 1e3 * fit,
        "fit": fit_ratio,
        "image": image_ratio,
        "failed": len(part) - len(found),
        "pays": "" if part.equals(first) else pays,
    }
