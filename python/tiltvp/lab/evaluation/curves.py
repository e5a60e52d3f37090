"""The numbers behind the figures: errors by tilt and environment, reliability of covariances, confidence as alarm."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import polars as pl

from tiltvp.lab.evaluation.combinations import PAPER_METHODS

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = [
    "FAILURE_RAD", "alarm_areas", "alarm_curves", "angles_by_tilt", "errors_by_environment", "errors_by_tilt",
    "overall_errors", "region_limit", "region_shares", "rejection_curves",
]  # fmt: skip

FAILURE_RAD: Final = float(np.deg2rad(2.0))
"""An estimate with a larger error than this has failed: what planar-motion methods bear (section 4)."""

_MOST_TILTS: Final = 12
_CLASS_DEG: Final = 0.5


def overall_errors(rows: pl.DataFrame) -> pl.DataFrame:
    """`variant`, `mean_deg` over all images with an estimate, their number `images`; the variants in their order."""
    return _means(rows, ["variant"])


def errors_by_tilt(rows: pl.DataFrame) -> pl.DataFrame:
    """Figure 22: `variant`, `alpha_true_deg`, `mean_deg`, `images`."""
    return _means(_with_tilt_classes(rows), ["variant", "alpha_true_deg"])


def errors_by_environment(rows: pl.DataFrame) -> pl.DataFrame:
    """Figure 23: `variant`, `environment`, `mean_deg`, `images`."""
    return _means(rows, ["variant", "environment"])


def _means(rows: pl.DataFrame, keys: list[str]) -> pl.DataFrame:
    numbers = {"mean_deg": pl.col("error_rad").mean().degrees(), "images": pl.col("error_rad").count()}
    return rows.group_by(keys, maintain_order=True).agg(**numbers).drop_nulls("mean_deg")


def _with_tilt_classes(rows: pl.DataFrame) -> pl.DataFrame:
    """With `alpha_true_deg`, of a few values: its own to a hundredth, or the means of half-degree classes if many."""
    exact = pl.col("alpha_true_rad").degrees()
    if rows.select(exact.round(2)).n_unique() <= _MOST_TILTS:
        return rows.with_columns(alpha_true_deg=exact.round(2))
    return rows.with_columns(alpha_true_deg=exact.mean().over((exact / _CLASS_DEG).floor()))


def angles_by_tilt(table: pl.DataFrame, rows: pl.DataFrame) -> pl.DataFrame:
    """Figure 28: `variant`, `corrected`, `alpha_true_deg`; of the estimates `alpha_deg` (mean), `p05_deg`, `p95_deg`.

    `rows` are those of `variants.best_rows`; the uncorrected ones of the same combinations come from the run's
    table. `corrected` is null for a method that needs no correction.
    """
    angles = ["alpha_true_rad", "alpha_rad"]
    parts = []
    for part in rows.filter(pl.col("correction") == "factor").partition_by("variant", maintain_order=True):
        plain = table.filter((pl.col("combination") == part["combination"][0]) & (pl.col("correction") == "none"))
        name = pl.lit(part["variant"][0].removesuffix(", corrected"))
        parts.append(plain.select(*angles, variant=name, corrected=pl.lit(value=False)))
        parts.append(part.select(*angles, variant=name, corrected=pl.lit(value=True)))
    ours = rows.filter(pl.col("method").is_in(PAPER_METHODS).not_())
    parts.append(ours.select(*angles, variant="variant", corrected=pl.lit(None, pl.Boolean)))
    alpha = pl.col("alpha_rad").degrees()
    return (
        _with_tilt_classes(pl.concat(parts))
        .drop_nulls("alpha_rad")
        .group_by("variant", "corrected", "alpha_true_deg", maintain_order=True)
        .agg(alpha_deg=alpha.mean(), p05_deg=alpha.quantile(0.05, "linear"), p95_deg=alpha.quantile(0.95, "linear"))
    )


def region_shares(rows: pl.DataFrame, levels: NDArray[np.float64] | None = None) -> pl.DataFrame:
    """Reliability of the covariance: `variant`, `level` (nominal probability), `share` of truths inside that region.

    Variants without covariances (corrected after the fit) are left out.
    """
    grid = np.arange(1, 100) / 100.0 if levels is None else levels
    parts = []
    for part in rows.partition_by("variant", maintain_order=True):
        known = part.drop_nulls(["error_rad", "covariance_xx_rad2"])
        if known.is_empty():
            continue
        inside = _squared_distances(known)[None, :] <= region_limit(grid)[:, None]
        parts.append(pl.DataFrame({"variant": part["variant"][0], "level": grid, "share": inside.mean(axis=1)}))
    return pl.concat(parts) if parts else pl.DataFrame(schema=dict.fromkeys(("variant", "level", "share"), pl.Float64))


def region_limit(level: ArrayLike) -> NDArray[np.float64]:
    """The squared Mahalanobis length of two numbers that is not exceeded with that probability; of any shape."""
    return np.asarray(-2.0 * np.log1p(-np.asarray(level, dtype=np.float64)))


def _squared_distances(rows: pl.DataFrame) -> NDArray[np.float64]:
    """(N,) squared Mahalanobis lengths of errors; covariances have the robot's axes, errors those of heading 0.

    An infinite covariance holds every truth.
    """
    cos, sin = np.cos(rows["yaw_rad"].to_numpy()), np.sin(rows["yaw_rad"].to_numpy())
    x0, y0 = rows["offset_x_rad"].to_numpy(), rows["offset_y_rad"].to_numpy()
    x, y = cos * x0 + sin * y0, cos * y0 - sin * x0
    xx, xy, yy = (rows[f"covariance_{pair}_rad2"].to_numpy() for pair in ("xx", "xy", "yy"))
    finite = np.isfinite(xx) & np.isfinite(xy) & np.isfinite(yy)
    xx, xy, yy = (np.where(finite, entry, entry_open) for entry, entry_open in ((xx, 1.0), (xy, 0.0), (yy, 1.0)))
    return np.where(finite, (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy), 0.0)


def alarm_curves(rows: pl.DataFrame, *, failure_rad: float = FAILURE_RAD) -> pl.DataFrame:
    """ROC of the confidence: `variant`, `threshold`, `false_alarms` (share of good estimates below it), `found`.

    Images without an estimate are failures. Variants that never or always fail are left out.
    """
    parts = []
    for part in rows.partition_by("variant", maintain_order=True):
        failed, confidence = _failures(part, failure_rad)
        if not 0 < failed.sum() < len(failed):
            continue
        thresholds = np.unique(confidence)
        below = np.searchsorted(np.sort(confidence[failed]), thresholds, side="right") / failed.sum()
        alarms = np.searchsorted(np.sort(confidence[~failed]), thresholds, side="right") / (~failed).sum()
        parts.append(
            pl.DataFrame(
                {
                    "variant": part["variant"][0],
                    "threshold": np.concatenate([[-np.inf], thresholds]),
                    "false_alarms": np.concatenate([[0.0], alarms]),
                    "found": np.concatenate([[0.0], below]),
                }
            )
        )
    names = ("threshold", "false_alarms", "found")
    return pl.concat(parts) if parts else pl.DataFrame(schema={"variant": pl.String} | dict.fromkeys(names, pl.Float64))


def alarm_areas(curves: pl.DataFrame) -> pl.DataFrame:
    """The area under each curve of `alarm_curves`: `variant`, `area` (0.5 is chance, 1 perfect)."""
    rows = [
        {
            "variant": part["variant"][0],
            "area": _area(part["false_alarms"].to_numpy(), part["found"].to_numpy()),
        }
        for part in curves.partition_by("variant", maintain_order=True)
    ]
    return pl.DataFrame(rows, schema={"variant": pl.String, "area": pl.Float64})


def rejection_curves(rows: pl.DataFrame, *, steps: int = 100) -> pl.DataFrame:
    """Abstaining: `variant`, `rejected` share (least confident); `mean_deg`, `p95_deg`, `p99_deg` of the others."""
    out = []
    for part in rows.partition_by("variant", maintain_order=True):
        order = pl.col("confidence").fill_null(0.0)
        ordered = part.sort(order, "image", descending=[True, False])
        ranked = ordered.select(pl.col("error_rad").degrees()).to_series()
        for step in range(steps):
            accepted = ranked.head(len(ranked) - round(len(ranked) * step / steps)).drop_nulls().to_numpy()
            if len(accepted):
                p95, p99 = np.percentile(accepted, [95, 99])
                out.append((part["variant"][0], step / steps, float(accepted.mean()), float(p95), float(p99)))
    names = ("rejected", "mean_deg", "p95_deg", "p99_deg")
    return pl.DataFrame(out, schema={"variant": pl.String} | dict.fromkeys(names, pl.Float64), orient="row")


def _failures(part: pl.DataFrame, failure_rad: float) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    failed = part["error_rad"].fill_null(np.inf).to_numpy() > failure_rad
    return failed, part["confidence"].fill_null(0.0).to_numpy()


def _area(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """That below a curve of straight pieces; NumPy has it by one name before 2.0, and by another since."""
    return float(0.5 * np.diff(x) @ (y[1:] + y[:-1]))
