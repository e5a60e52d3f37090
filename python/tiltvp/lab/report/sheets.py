"""Tables 3 and 4, the other corrections and the reading of Q as people read them, in the paper's order."""

from __future__ import annotations

from typing import Any, Final

import polars as pl

from tiltvp.lab.evaluation.summary import PAPER_TABLE_3, PAPER_TIMES_MS, reading_of_q, table_3
from tiltvp.lab.evaluation.variants import best_of
from tiltvp.lab.report.panel import Sheet

__all__ = ["error_sheet", "other_sheet", "q_sheet", "time_sheet"]

_METHODS: Final = {
    "image-space-ransac": ("image space", "RANSAC"),
    "image-space-reject-refit": ("image space", "reject-refit"),
    "vector-consensus": ("vector consensus", "RANSAC"),
    "refined": ("refined", ""),
    "segments": ("segments", ""),
}
_CORRECTIONS: Final = {
    "none": "none",
    "factor": "trained factor",
    "affine": "α = l/a + b",
    "posterior": "P(α | l)",
    "closed-form": "closed-form gain",
}
_SAME: Final = ["method", "correction"]


def error_sheet(summary: pl.DataFrame) -> Sheet:
    """Table 3 of a summary: the paper's four rows and ours, as far as the run has them."""
    chosen = best_of(summary).join(PAPER_TABLE_3, on=_SAME, how="left", maintain_order="left")
    return _errors(
        chosen, "table-3", "Table 3",
        "The tilt-estimation error (eq. 44) in degrees: mean, standard deviation (σ), median and 95th percentile, with "
        "the parameters that give each method its lowest mean. Relative errors are without the median offset of each "
        "location, which is an error of its reference. Factors a (pixels per radian) and a′ (no unit) are trained on "
        "the other locations. The columns at the right are the paper's own results on its own images.",
    )  # fmt: skip


def other_sheet(summary: pl.DataFrame) -> Sheet:
    """What else was tried: other corrections, the literal reading of Q, other prefilters and normals."""
    chosen = table_3(summary)
    best = best_of(summary).select("combination", "correction")
    others = chosen.join(best, on=["combination", "correction"], how="anti", maintain_order="left")
    methods = dict.fromkeys([*_METHODS, *others["method"]])
    parts = [others.filter(pl.col("method") == method) for method in methods]
    paper = [name for name in others.columns if name.startswith("paper_")]
    return _errors(
        pl.concat(parts).drop(paper), "table-3-others", "Table 3, continued",
        "The same for what the paper leaves open: no correction, the additive correction and the posterior of section "
        "5.1, the closed-form gain, Q read as the share rejected, a wider prefilter, exact normals.",
    )  # fmt: skip


def _errors(chosen: pl.DataFrame, stem: str, title: str, caption: str) -> Sheet:
    rows = []
    for row in chosen.iter_rows(named=True):
        cells = _names(row) | {
            "mean (σ)": _with_spread(row["mean_deg"], row["sd_deg"]),
            "50 %": _number(row["median_deg"]),
            "95 %": _number(row["p95_deg"]),
            "relative mean": _number(row["relative_mean_deg"]),
            "relative 95 %": _number(row["relative_p95_deg"]),
            "factor": _span(row["factor_min"], row["factor_max"]),
        }
        if chosen["failed"].sum():
            cells["failed"] = str(row["failed"])
        if "paper_mean_deg" in row:
            cells["paper: mean"] = _number(row["paper_mean_deg"])
            cells["paper: 95 %"] = _number(row["paper_p95_deg"])
            cells["paper: factor"] = _span(row["paper_factor_min"], row["paper_factor_max"])
        rows.append(cells)
    return Sheet(stem, title, caption, pl.DataFrame(rows), chosen)


def time_sheet(summary: pl.DataFrame, machine: str, also: tuple[pl.DataFrame, str] | None = None) -> Sheet:
    """Table 4: times in milliseconds on this machine and, of `also` (summary, name), on another one."""
    chosen = best_of(summary).join(PAPER_TIMES_MS, on=_SAME, how="left", maintain_order="left")
    rows = []
    for row in chosen.iter_rows(named=True):
        cells = _names(row) | _time_cells("this computer", row)
        if also is not None:
            same = (pl.col("label") == row["label"]) & (pl.col("correction") == row["correction"])
            for other in also[0].filter(same).head(1).iter_rows(named=True):
                cells |= _time_cells(also[1], other)
        cells["paper: mean"], cells["paper: 95 %"] = _number(row["paper_mean_ms"]), _number(row["paper_p95_ms"])
        rows.append(cells)
    return Sheet(
        "table-4", "Table 4",
        f"The time of an estimate in milliseconds, from the image to the tilt, on {machine}: mean, standard deviation "
        "(σ), median and 95th percentile, with the parameters of table 3. The columns at the right are those of the "
        "paper's desktop computer, an Intel Core i7-4790K.",
        pl.DataFrame(rows), chosen,
    )  # fmt: skip


def _time_cells(name: str, row: dict[str, Any]) -> dict[str, str]:
    return {
        f"{name}: mean (σ)": _with_spread(row["time_mean_ms"], row["time_sd_ms"]),
        f"{name}: 50 %": _number(row["time_median_ms"]),
        f"{name}: 95 %": _number(row["time_p95_ms"]),
    }


def q_sheet(summary: pl.DataFrame) -> Sheet:
    """What Q means: reject-refit with Q read as the share kept and as the share rejected, and the paper's numbers."""
    numbers = reading_of_q(summary)
    rows = [
        {
            "Q is the": row["reading"],
            "Q": f"{row['q']:g}",
            "a (px/rad)": _span(row["factor_min"], row["factor_max"]),
            "iterations": _number(row["iterations"], 1),
            "mean": _number(row["mean_deg"]),
            "95 %": _number(row["p95_deg"]),
            "relative mean": _number(row["relative_mean_deg"]),
            "paper: a": _span(row["paper_factor_min"], row["paper_factor_max"]),
            "paper: iterations": _number(row["paper_iterations"], 0),
            "paper: mean": _number(row["paper_mean_deg"]),
        }
        for row in numbers.iter_rows(named=True)
    ]
    return Sheet(
        "table-q", "What Q means",
        "Reject-refit with trained factors and I_min = 200, errors in degrees. Eqs. 34 and 35 speak of Q as the share "
        "of residuals that is rejected; the paper's numbers at Q = 0.8 are those of the row that they resemble.",
        pl.DataFrame(rows), numbers,
    )  # fmt: skip


def _names(row: dict[str, Any]) -> dict[str, str]:
    method, variant = _METHODS.get(row["method"], (row["method"], ""))
    return {
        "method": method,
        "variant": variant,
        "correction": _CORRECTIONS.get(row["correction"], row["correction"]),
        "parameters": row["label"].partition(", ")[2] or "defaults",
    }


def _number(value: float | None, digits: int = 2) -> str:
    return "" if value is None else f"{value:.{digits}f}"


def _with_spread(mean: float | None, spread: float | None) -> str:
    return _number(mean) + (f" ({_number(spread)})" if spread is not None else "")


def _span(low: float | None, high: float | None) -> str:
    """Both ends of a range, with as many digits as its size asks for."""
    if low is None or high is None:
        return ""
    digits = 2 if high < 10.0 else 0
    ends = f"{low:.{digits}f}", f"{high:.{digits}f}"
    return ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}"
