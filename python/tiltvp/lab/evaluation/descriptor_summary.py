"""What the figures of the descriptor come to: directions that look alike, and what each matching rule keeps out."""

from __future__ import annotations

from typing import Final

import numpy as np
import polars as pl

from tiltvp.lines import LineTracker

__all__ = ["RULES", "alike", "rules"]

RULES: Final[dict[str, float]] = {name.upper(): float(LineTracker().options[name]) for name in ("f1", "f2", "f3")}
"""The default limits of eqs. 8 to 10, by name."""

_COLUMNS: Final = {"F1": "distance", "F2": "mean_ratio", "F3": "second_ratio"}


def alike(table: pl.DataFrame, *, near_deg: int = 2, far_deg: int = 10) -> pl.DataFrame:
    """What the matrices of `similarity` show: columns measure and `alike_%`, one row for each measure.

    `alike_%` is the share of pairs of directions more than `far_deg` apart that are no less alike than half of the
    pairs `near_deg` apart are: the dark blocks off the diagonal.
    """
    apart = np.abs((table["first_deg"] - table["second_deg"]).to_numpy().astype(np.int64))
    apart = np.minimum(apart, 360 - apart)
    rows: list[tuple[str, float]] = []
    for measure in ("descriptor", "ssd", "zncc"):
        values = table[measure].to_numpy()
        usual = float(np.nanmedian(values[apart == near_deg]))
        rows.append((measure, 100.0 * float((values[apart > far_deg] <= usual).mean())))
    return pl.DataFrame(rows, schema={"measure": pl.String, "alike_%": pl.Float64}, orient="row")


def rules(matches: pl.DataFrame) -> pl.DataFrame:
    """Section 6.0.5: the share of false and of correct matches that each rule refuses, and all three together.

    Columns rule, limit, `false_refused_%`, `correct_refused_%`. `matches` as in `DescriptorTables`.
    """
    kept = {rule: pl.col(_COLUMNS[rule]) <= limit for rule, limit in RULES.items()}
    kept["all three"] = pl.all_horizontal(*kept.values())
    rows: list[dict[str, object]] = []
    for rule, passes in kept.items():
        row: dict[str, object] = {"rule": rule, "limit": RULES.get(rule)}
        for name, correct in (("false_refused_%", False), ("correct_refused_%", True)):
            part = matches.filter(pl.col("correct") == correct)
            row[name] = None if part.is_empty() else 100.0 * (1.0 - part.select(passes.mean()).item())
        rows.append(row)
    return pl.DataFrame(rows)
