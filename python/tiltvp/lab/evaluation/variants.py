"""The variants that the paper's figures compare, each with the parameters that give it the lowest mean error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import polars as pl

from tiltvp.lab.evaluation.summary import table_3

__all__ = ["VARIANTS", "Variant", "best_of", "best_rows", "variant_points"]


@dataclass(frozen=True)
class Variant:
    """Rows of a run that are compared as one: a method with a correction, among the combinations of a group."""

    name: str
    method: str
    correction: str
    group: str = "paper"

    def of(self, table: pl.DataFrame) -> pl.DataFrame:
        """Its rows in a run's table or a summary."""
        same = [pl.col(name) == getattr(self, name) for name in ("method", "correction", "group")]
        return table.filter(pl.all_horizontal(same))


VARIANTS: Final = (
    Variant("image space, RANSAC", "image-space-ransac", "factor"),
    Variant("image space, reject-refit", "image-space-reject-refit", "factor"),
    Variant("vector consensus", "vector-consensus", "none"),
    Variant("vector consensus, corrected", "vector-consensus", "factor"),
    Variant("refined", "refined", "none", "beyond"),
    Variant("segments", "segments", "none", "beyond"),
)
"""The rows of table 3 in its order, and ours."""


def best_of(summary: pl.DataFrame) -> pl.DataFrame:
    """The rows of a summary (`summary.errors`) that table 3 chooses, with their `variant` in front.

    One for each variant that the run has, in the order of `VARIANTS`.
    """
    chosen = table_3(summary)
    return _joined(summary, [(each, each.of(chosen)["combination"].head(1).to_list()) for each in VARIANTS])


def best_rows(table: pl.DataFrame, summary: pl.DataFrame) -> pl.DataFrame:
    """The rows of a run's table that are behind those of `best_of`, in the same order."""
    best = best_of(summary)
    names = best["variant"]
    return _joined(table, [(each, best.filter(names == each.name)["combination"].to_list()) for each in VARIANTS])


def variant_points(summary: pl.DataFrame) -> pl.DataFrame:
    """The rows of a summary that belong to a variant, with `variant` and `best` (whether it is the one of table 3)."""
    best = best_of(summary).select("variant", "combination", best=pl.lit(value=True))
    known = summary.filter(pl.col("mean_deg").is_not_null())
    points = _joined(known, [(each, known["combination"].unique().to_list()) for each in VARIANTS])
    joined = points.join(best, on=["variant", "combination"], how="left", maintain_order="left")
    return joined.with_columns(pl.col("best").fill_null(value=False))


def _joined(rows: pl.DataFrame, chosen: list[tuple[Variant, list[int]]]) -> pl.DataFrame:
    """The rows of the variants' combinations, variant by variant."""
    return pl.concat(
        variant.of(rows).filter(pl.col("combination").is_in(numbers)).select(pl.lit(variant.name).alias("variant"), "*")
        for variant, numbers in chosen
    )
