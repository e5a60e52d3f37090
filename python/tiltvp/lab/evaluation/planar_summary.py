"""Planar pose errors in short: means over tilt with bootstrap bands, and the tilt beyond which a correction pays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import polars as pl

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["crossings", "summarise_planar_pose"]

_ERRORS = ("bearing", "orientation")
_ROUNDS = 2000


def summarise_planar_pose(table: pl.DataFrame, *, seed: int = 0) -> pl.DataFrame:
    """One row for each error (bearing, orientation), correction and lean, in degrees.

    `low_deg` to `high_deg` is the 95 % bootstrap band of the mean. Whole rooms are drawn, since pairs of one room share
    views. `tilt_error_deg` is the mean of what is left of the leaning view's tilt.
    """
    rng = np.random.default_rng(seed)
    rooms = table.select("kind", "room_seed").unique(maintain_order=True)
    # The same rooms are drawn for every row, so that bands compare.
    drawn = rng.integers(len(rooms), size=(_ROUNDS, len(rooms)))
    numbered = table.join(rooms.with_row_index("room"), on=["kind", "room_seed"], maintain_order="left")
    rows = []
    for error in _ERRORS:
        for (correction, alpha), part in numbered.group_by("correction", "alpha_rad", maintain_order=True):
            errors = np.rad2deg(part[f"{error}_error_rad"].to_numpy())
            low, high = _band(errors, part["room"].to_numpy(), drawn)
            rows.append(
                {
                    "error": error,
                    "correction": correction,
                    "alpha_deg": round(float(np.rad2deg(float(str(alpha)))), 9),
                    "pairs": len(part),
                    "mean_deg": float(errors.mean()),
                    "low_deg": low,
                    "high_deg": high,
                    "median_deg": float(np.median(errors)),
                    "p95_deg": float(np.percentile(errors, 95)),
                    "tilt_error_deg": float(np.rad2deg(part["second_tilt_error_rad"].to_numpy()).mean()),
                }
            )
    return pl.DataFrame(rows)


def crossings(summary: pl.DataFrame) -> pl.DataFrame:
    """For each error and correction the lean in degrees beyond which its mean stays below that without correction.

    Linear between the measured leans; 0 where it is below throughout, null where it is not at the largest lean.
    """
    rows = []
    for (error, correction), part in summary.group_by("error", "correction", maintain_order=True):
        if correction != "none":
            without = summary.filter((pl.col("error") == error) & (pl.col("correction") == "none")).sort("alpha_deg")
            means = part.sort("alpha_deg")
            gain = without["mean_deg"].to_numpy() - means["mean_deg"].to_numpy()
            crossing = _last_crossing(means["alpha_deg"].to_numpy(), gain)
            rows.append({"error": error, "correction": correction, "crossing_deg": crossing})
    return pl.DataFrame(rows, schema={"error": pl.String, "correction": pl.String, "crossing_deg": pl.Float64})


def _last_crossing(alphas: NDArray[np.float64], gain: NDArray[np.float64]) -> float | None:
    losses = np.flatnonzero(gain <= 0.0)
    if not losses.size:
        return 0.0
    last = int(losses[-1])
    if last + 1 == len(alphas):
        return None
    share = -gain[last] / (gain[last + 1] - gain[last])
    return float(alphas[last] + share * (alphas[last + 1] - alphas[last]))


def _band(errors: NDArray[np.float64], rooms: NDArray[np.uint32], drawn: NDArray[np.int64]) -> tuple[float, float]:
    """The middle 95 % of the means over drawn rooms."""
    count = drawn.shape[1]
    sums, sizes = np.bincount(rooms, errors, count)[drawn].sum(axis=1), np.bincount(rooms, minlength=count)[drawn]
    means = sums / np.maximum(sizes.sum(axis=1), 1)
    low, high = np.percentile(means, [2.5, 97.5])
    return float(low), float(high)
