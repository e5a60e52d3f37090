"""The tilt methods side by side on views of upright panoramas, with the paper's factors cross-validated by location."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from tiltvp.datasets.panoramas import TABLE_1_TILTS_DEG, Panorama, PanoramaViews
from tiltvp.evaluation.metrics import offset_rad, relative_errors_rad
from tiltvp.tilt import TiltEstimate, TiltEstimator, normal_from_alpha_beta

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.cameras import Camera

__all__ = ["VARIANTS", "Variant", "estimate_views", "summarise"]


@dataclass(frozen=True)
class Variant:
    """A method with options, and whether a factor on its angle is trained on the other locations (eqs. 31 and 45)."""

    label: str
    method: str
    options: dict[str, Any] = field(default_factory=dict)
    trained: bool = False


_RAW: dict[str, Any] = {"correction": None}

VARIANTS: tuple[Variant, ...] = (
    Variant("image-space reject-refit, kept 0.8, trained a", "image-space-reject-refit", _RAW, trained=True),
    Variant(
        "image-space reject-refit, Q = 0.8 read literally, trained a",
        "image-space-reject-refit",
        {"keep_fraction": 0.2} | _RAW,
        trained=True,
    ),
    Variant("image-space reject-refit, closed-form gain", "image-space-reject-refit"),
    Variant("image-space RANSAC, trained a", "image-space-ransac", _RAW, trained=True),
    Variant("image-space RANSAC, closed-form gain", "image-space-ransac"),
    Variant("vector consensus, uncorrected", "vector-consensus"),
    Variant(
        "vector consensus, trained a'",
        "vector-consensus",
        {"gradient_min": 300.0, "threshold_rad": float(np.deg2rad(2.0))},
        trained=True,
    ),
    Variant(
        "vector consensus, prefilter 10 degrees, uncorrected",
        "vector-consensus",
        {"tilt_max_rad": float(np.deg2rad(10.0))},
    ),
    Variant(
        "vector consensus, prefilter 10 degrees, trained a'",
        "vector-consensus",
        {"tilt_max_rad": float(np.deg2rad(10.0)), "gradient_min": 300.0, "threshold_rad": float(np.deg2rad(2.0))},
        trained=True,
    ),
    Variant(
        "vector consensus, tangent normals",
        "vector-consensus",
        {"normal": "tangent", "gradient_min": 300.0, "threshold_rad": float(np.deg2rad(2.0))},
    ),
    Variant("refined", "refined"),
)
"""The paper's variants with the parameters of its table 3, and ours."""


def estimate_views(
    panoramas: Iterable[Panorama],
    camera: Camera,
    variants: Iterable[Variant] = VARIANTS,
    *,
    samples: int = 2,
    noise_sigma: float = 2.0,
    turn: bool = False,
    upright: bool = True,
    tilts_deg: Iterable[tuple[float, float]] = TABLE_1_TILTS_DEG,
    advance: Callable[[], None] = lambda: None,
) -> pl.DataFrame:
    """A long table, one row for each panorama, lean and variant: estimates, counts and the true lean.

    With `turn` each view also has a heading of its own, drawn with a fixed seed; errors are then turned back, so that
    the reference's error stays constant within a location.
    """
    estimators = [(variant, TiltEstimator(camera, method=variant.method, **variant.options)) for variant in variants]
    rows: list[dict[str, object]] = []
    tilts = list(tilts_deg)
    for number, panorama in enumerate(panoramas):
        views = PanoramaViews(panorama, camera, samples=samples, upright=upright)
        headings = np.random.default_rng(number).uniform(-np.pi, np.pi, len(tilts)) if turn else np.zeros(len(tilts))
        for place, ((alpha_deg, beta_deg), yaw) in enumerate(zip(tilts, headings, strict=True)):
            alpha, beta = float(np.deg2rad(alpha_deg)), float(np.deg2rad(beta_deg))
            normal = normal_from_alpha_beta(alpha, beta)
            image = views.render(normal, yaw_rad=float(yaw), noise_sigma=noise_sigma, seed=1000 * number + place)
            for variant, estimator in estimators:
                row = _row(estimator(image), variant)
                row.update(
                    name=panorama.name, location=panorama.location, alpha_true=alpha, beta_true=beta, yaw=float(yaw)
                )
                rows.append(row)
        advance()
    return pl.DataFrame(rows, infer_schema_length=None)


def _row(estimate: TiltEstimate, variant: Variant) -> dict[str, object]:
    covariance = estimate.covariance_rad2
    return {
        "variant": variant.label,
        "trained": variant.trained,
        "alpha": estimate.alpha_rad,
        "beta": estimate.beta_rad,
        "shift_px": estimate.shift_px,
        "confidence": estimate.confidence,
        "covariance_xx": float(covariance[0, 0]),
        "covariance_xy": float(covariance[0, 1]),
        "covariance_yy": float(covariance[1, 1]),
        "inliers": estimate.inlier_pixels,
        "iterations": estimate.report.iterations,
        "stop": estimate.report.stop,
    }


def summarise(table: pl.DataFrame) -> pl.DataFrame:
    """One row for each variant: errors in degrees (eq. 44), absolute and relative, and the range of the trained factor.

    Images without an estimate count in `failed` and in nothing else.
    """
    rows = []
    for (label,), part in table.group_by("variant", maintain_order=True):
        found = part.filter(pl.col("alpha").is_finite())
        factors = _trained_factors(found) if found["trained"].any() else np.ones(len(found))
        measured = (
            found["shift_px"].fill_null(np.nan).to_numpy() if found["trained"].any() else found["alpha"].to_numpy()
        )
        measured = np.where(np.isnan(measured), found["alpha"].to_numpy(), measured)
        offsets = _offsets(found, measured / factors)
        absolute = np.rad2deg(np.linalg.norm(offsets, axis=1))
        names = found["name"].to_numpy()
        relative = np.rad2deg(
            np.concatenate([relative_errors_rad(offsets[names == name]) for name in dict.fromkeys(names)])
        )
        rows.append(
            {
                "variant": label,
                "mean": float(absolute.mean()),
                "median": float(np.median(absolute)),
                "p95": float(np.percentile(absolute, 95)),
                "relative mean": float(relative.mean()),
                "relative p95": float(np.percentile(relative, 95)),
                "factor min": float(factors.min()) if found["trained"].any() else None,
                "factor max": float(factors.max()) if found["trained"].any() else None,
                "images": len(part),
                "failed": len(part) - len(found),
            }
        )
    return pl.DataFrame(rows)


def _trained_factors(found: pl.DataFrame) -> NDArray[np.float64]:
    """(N,) the mean ratio of measured to true angle over the leaning images of all other locations, eq. 31."""
    measured = found["shift_px"].fill_null(np.nan).to_numpy()
    measured = np.where(np.isnan(measured), found["alpha"].to_numpy(), measured)
    true, location = found["alpha_true"].to_numpy(), found["location"].to_numpy()
    factors = np.empty(len(found))
    for place in dict.fromkeys(location):
        others = (location != place) & (true > 0.0)
        factors[location == place] = float(np.mean(measured[others] / true[others])) if others.any() else np.nan
    return factors


def _offsets(found: pl.DataFrame, alphas: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 2) errors in the upright frame, turned back by the heading."""
    offsets = np.empty((len(found), 2))
    for i, (row, alpha) in enumerate(zip(found.iter_rows(named=True), alphas, strict=True)):
        true = normal_from_alpha_beta(row["alpha_true"], row["beta_true"])
        error = offset_rad(normal_from_alpha_beta(float(alpha), row["beta"]), true)
        cos, sin = np.cos(row["yaw"]), np.sin(row["yaw"])
        offsets[i] = (cos * error[0] - sin * error[1], sin * error[0] + cos * error[1])
    return offsets
