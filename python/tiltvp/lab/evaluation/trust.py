"""How far an estimate's own words can be trusted: the covariance's regions, and the confidence as an alarm."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Final

import numpy as np
import polars as pl

from tiltvp.lab.evaluation.curves import FAILURE_RAD, alarm_areas, alarm_curves, region_shares

__all__ = ["ACCEPTED_SHARE", "LEVELS", "TOGETHER", "trust", "was_set_on"]

LEVELS: Final = (0.5, 0.9, 0.95)
"""Nominal probabilities of the regions that are looked at."""

ACCEPTED_SHARE: Final = 0.9
"""Share of the estimates that is accepted, the most confident ones."""

TOGETHER: Final = "all together"


def was_set_on(location: str) -> bool:
    """Whether the covariance was set on this panorama, and the confidence on this building; others check them."""
    return hashlib.md5(location.encode(), usedforsecurity=False).digest()[-1] % 2 == 0


def trust(runs: Mapping[str, pl.DataFrame]) -> pl.DataFrame:
    """One row for each run and variant, and for all runs together.

    `runs` holds rows as `tiltvp.lab.evaluation.variants.best_rows` gives them. Columns: `run`, `variant`, `images`,
    `failures` (errors above two degrees, or no estimate), `roc_area` (null where all or none fail) and `held_roc_area`,
    of the environments (of panoramas: buildings) on which the confidence was not set, `accepted_p99_deg`
    (99th percentile of the error of the most confident `ACCEPTED_SHARE`), and for the two halves of the locations the
    shares of truths inside the regions of `LEVELS`: `set_50`, ..., `held_50`, ... (null without covariances).
    """
    parts = dict(runs)
    if len(parts) > 1:
        parts[TOGETHER] = pl.concat(runs.values(), how="vertical")
    rows = [
        {"run": run, **_row(part)}
        for run, table in parts.items()
        for part in table.partition_by("variant", maintain_order=True)
    ]
    return pl.DataFrame(rows, infer_schema_length=None)


def _row(part: pl.DataFrame) -> dict[str, object]:
    errors = part["error_rad"].fill_null(np.inf)
    unseen = part.filter(~pl.col("environment").map_elements(was_set_on, return_dtype=pl.Boolean))
    ranked = part.sort(pl.col("confidence").fill_null(0.0), descending=True, maintain_order=True)
    accepted = ranked.head(round(ACCEPTED_SHARE * len(ranked)))["error_rad"].drop_nulls().to_numpy()
    row: dict[str, object] = {
        "variant": part["variant"][0],
        "images": len(part),
        "failures": int((errors > FAILURE_RAD).sum()),
        "roc_area": _area(part),
        "held_roc_area": _area(unseen),
        "accepted_p99_deg": float(np.rad2deg(np.percentile(accepted, 99))) if len(accepted) else None,
    }
    on = part["location"].map_elements(was_set_on, return_dtype=pl.Boolean)
    for half, rows in (("set", part.filter(on)), ("held", part.filter(~on))):
        shares = region_shares(rows, np.array(LEVELS))["share"].to_list() or [None] * len(LEVELS)
        row |= {f"{half}_{100 * level:.0f}": share for level, share in zip(LEVELS, shares, strict=True)}
    return row


def _area(part: pl.DataFrame) -> float | None:
    areas = alarm_areas(alarm_curves(part))["area"]
    return areas[0] if len(areas) else None
