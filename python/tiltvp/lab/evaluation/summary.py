"""The tables of a run, polars in, polars out: errors and factors (table 3), times (table 4), and what Q means."""

from __future__ import annotations

from typing import Final

import polars as pl

from tiltvp.lab.evaluation.crossval import TRAINED

__all__ = [
    "PAPER_TABLE_3",
    "PAPER_TIMES_MS",
    "advantage",
    "determined",
    "errors",
    "reading_of_q",
    "table_3",
    "table_4",
    "variants",
]

PAPER_TABLE_3: Final = pl.DataFrame(
    [
        ("image-space-ransac", "factor", 1.17, 3.16, 298.0, 314.0),
        ("image-space-reject-refit", "factor", 0.85, 2.27, 234.0, 239.0),
        ("vector-consensus", "none", 1.63, 3.38, None, None),
        ("vector-consensus", "factor", 1.03, 2.30, 1.77, 1.80),
    ],
    schema=["method", "correction", "paper_mean_deg", "paper_p95_deg", "paper_factor_min", "paper_factor_max"],
    orient="row",
)
"""What the paper has on its own images: table 3, and the ranges of a_L and a'_L of section 2.4."""

PAPER_TIMES_MS: Final = pl.DataFrame(
    [
        ("image-space-ransac", "factor", 3.8, 6.3),
        ("image-space-reject-refit", "factor", 2.5, 4.1),
        ("vector-consensus", "none", 3.6, 5.7),
        ("vector-consensus", "factor", 6.2, 9.3),
    ],
    schema=["method", "correction", "paper_mean_ms", "paper_p95_ms"],
    orient="row",
)
"""Table 4 on the paper's desktop computer."""

_PAPER_READING: Final = pl.DataFrame(
    {"q": [0.8], "paper_mean_deg": [0.85], "paper_factor_min": [234.0], "paper_factor_max": [239.0],
     "paper_iterations": [8.0]}
)  # fmt: skip
"""Table 3 and section 2.4, and the iterations that figure 14 shows for one image."""

_METHOD_ORDER: Final = ("image-space-ransac", "image-space-reject-refit", "vector-consensus", "refined", "segments")
_CORRECTION_ORDER: Final = ("none", "closed-form", "factor", "affine", "posterior")
_GROUP_ORDER: Final = ("paper", "literal", "beyond")
_LEAST_VIEWS: Final = 3
"""Views of one location below which the error of its reference cannot be told from theirs."""


def errors(table: pl.DataFrame) -> pl.DataFrame:
    """One row for each combination and correction: errors in degrees (eq. 44), factors, counts, times in milliseconds.

    Columns: combination, method, label, group, correction, gradient_min, keep_fraction, threshold_px, threshold_rad,
    images, failed, mean_deg, sd_deg, median_deg, p95_deg, relative_mean_deg, relative_p95_deg, factor_min, factor_max,
    iterations, time_mean_ms, time_sd_ms, time_median_ms, time_p95_ms, time_edges_ms. *Relative* is without the median
    offset of each location, the constant error of its reference; null where a location has less than three estimates.
    Images without an estimate count in `failed` and in nothing else but iterations and times.
    """
    location = ["combination", "correction", "location"]
    x, y = (pl.col(f"offset_{axis}_rad") - pl.col(f"offset_{axis}_rad").median().over(location) for axis in "xy")
    several = pl.col("error_rad").count().over(location) >= _LEAST_VIEWS
    relative = pl.when(several).then((x**2 + y**2).sqrt())
    milliseconds = 1e3 * (pl.col("time_edges_s") + pl.col("time_fit_s"))
    measured = table.with_columns(
        error=pl.col("error_rad").degrees(), relative=relative.degrees(), milliseconds=milliseconds
    )
    same = ["method", "label", "group", "gradient_min", "keep_fraction", "threshold_px", "threshold_rad"]
    return (
        measured.group_by("combination", "correction", maintain_order=True)
        .agg(
            *(pl.col(name).first() for name in same),
            images=pl.len(),
            failed=pl.col("error").null_count(),
            mean_deg=pl.col("error").mean(),
            sd_deg=pl.col("error").std(),
            median_deg=pl.col("error").median(),
            p95_deg=pl.col("error").quantile(0.95, "linear"),
            relative_mean_deg=pl.col("relative").mean(),
            relative_p95_deg=pl.col("relative").quantile(0.95, "linear"),
            factor_min=pl.col("factor").min(),
            factor_max=pl.col("factor").max(),
            iterations=pl.col("iterations").mean(),
            time_mean_ms=pl.col("milliseconds").mean(),
            time_sd_ms=pl.col("milliseconds").std(),
            time_median_ms=pl.col("milliseconds").median(),
            time_p95_ms=pl.col("milliseconds").quantile(0.95, "linear"),
            time_edges_ms=1e3 * pl.col("time_edges_s").mean(),
        )
        .sort("combination", _rank("correction", _CORRECTION_ORDER))
    )


def determined(summary: pl.DataFrame) -> pl.DataFrame:
    """Of a table of `errors`: without the corrections that no images of other locations determine."""
    return summary.filter(~pl.col("correction").is_in(TRAINED) | pl.col("factor_min").is_not_null())


def table_3(summary: pl.DataFrame) -> pl.DataFrame:
    """Of a table of `errors`: for each method and correction the parameters with the least mean error.

    Those of table 2 compete with each other, for each reading of Q; what goes beyond the paper has a row for each
    combination, with and without a trained factor. The paper's own numbers stand beside those that it has.
    """
    shown = summary.filter((pl.col("group") == "paper") | pl.col("correction").is_in(["none", "closed-form", "factor"]))
    shown = shown.filter((pl.col("group") != "literal") | (pl.col("correction") == "factor"))
    rival = pl.when(pl.col("group") == "beyond").then(pl.col("combination"))
    ranked = shown.with_columns(rival=rival).sort("mean_deg", "combination", nulls_last=True)
    chosen = (
        ranked.group_by("group", "method", "correction", "rival", maintain_order=True)
        .first()
        .sort(
            _rank("group", _GROUP_ORDER),
            _rank("method", _METHOD_ORDER),
            pl.col("rival"),
            _rank("correction", _CORRECTION_ORDER),
        )
    )
    return _beside(chosen, PAPER_TABLE_3).select(
        "method", "label", "correction", "images", "failed", "mean_deg", "sd_deg", "median_deg", "p95_deg",
        "relative_mean_deg", "relative_p95_deg", "factor_min", "factor_max",
        "paper_mean_deg", "paper_p95_deg", "paper_factor_min", "paper_factor_max", "combination", "group",
    )  # fmt: skip


def table_4(summary: pl.DataFrame) -> pl.DataFrame:
    """Of a table of `errors`: the times in milliseconds of what table 3 chooses, with the paper's beside them."""
    chosen = table_3(summary).select("combination", "correction", "group")
    timed = chosen.join(summary.drop("group"), on=["combination", "correction"], how="left", maintain_order="left")
    timed = timed.filter(pl.col("correction").is_in(["none", "closed-form", "factor"]))
    return _beside(timed, PAPER_TIMES_MS).select(
        "method", "label", "correction", "time_mean_ms", "time_sd_ms", "time_median_ms", "time_p95_ms",
        "time_edges_ms", "paper_mean_ms", "paper_p95_ms",
    )  # fmt: skip


def reading_of_q(summary: pl.DataFrame, gradient_min: float = 200.0) -> pl.DataFrame:
    """Of a table of `errors`: reject-refit with a trained factor at one I_min, for each Q read as kept and as rejected.

    The paper's own numbers stand beside Q = 0.8.
    """
    trained = summary.filter(
        (pl.col("method") == "image-space-reject-refit")
        & (pl.col("correction") == "factor")
        & (pl.col("gradient_min") == gradient_min)
    )
    kept = trained.filter(pl.col("group") == "paper").with_columns(
        q=pl.col("keep_fraction").round(6), reading=pl.lit("share kept")
    )
    # At Q = 1/2 both readings are one, which is only in the table once.
    half = kept.filter(pl.col("q") == 0.5).with_columns(group=pl.lit("literal"))
    rejected = pl.concat([half.drop("q", "reading"), trained.filter(pl.col("group") == "literal")]).with_columns(
        q=(1.0 - pl.col("keep_fraction")).round(6), reading=pl.lit("share rejected")
    )
    both = pl.concat([kept.select(sorted(kept.columns)), rejected.select(sorted(rejected.columns))])
    return (
        both.join(_PAPER_READING, on="q", how="left")
        .sort("reading", "q")
        .select(
            "reading", "q", "factor_min", "factor_max", "iterations", "mean_deg", "p95_deg", "relative_mean_deg",
            "paper_factor_min", "paper_factor_max", "paper_iterations", "paper_mean_deg",
        )
    )  # fmt: skip


def variants(summary: pl.DataFrame) -> pl.DataFrame:
    """Of a table of `errors`: one row for each combination and correction, in a word, with errors in degrees."""
    words = pl.col("correction").replace_strict(
        {"none": "", "closed-form": "", "factor": ", trained factor", "affine": ", trained line",
         "posterior": ", trained posterior"}
    )  # fmt: skip
    names = {"mean": "mean_deg", "median": "median_deg", "p95": "p95_deg", "relative mean": "relative_mean_deg",
             "relative p95": "relative_p95_deg", "factor min": "factor_min", "factor max": "factor_max",
             "images": "images", "failed": "failed"}  # fmt: skip
    return summary.select(variant=pl.col("label") + words, **{name: pl.col(column) for name, column in names.items()})


def advantage(summary: pl.DataFrame) -> pl.DataFrame:
    """Of a table of `errors`: how many times smaller the errors of `refined` are than those of the paper's methods.

    One row for each of the paper's methods with its factor and the parameters of least mean error, and one for the
    best paper method with the paper's own parameters, if it is there.
    """
    own = summary.filter((pl.col("method") == "refined") & (pl.col("correction") == "none")).head(1)
    paper = summary.filter((pl.col("group") == "paper") & (pl.col("correction") == "factor"))
    best = paper.sort("mean_deg", nulls_last=True).group_by("method", maintain_order=True).first()
    named = paper.filter((pl.col("gradient_min") == 200.0) & (pl.col("keep_fraction") == 0.8))
    others = pl.concat([named.select(sorted(named.columns)), best.select(sorted(best.columns))]).unique(
        "combination", maintain_order=True
    )
    measures = ("mean_deg", "p95_deg", "relative_mean_deg", "relative_p95_deg")
    if own.is_empty():
        others = others.clear()
    ratios = [
        (pl.col(name) / (own[name][0] if len(own) else 1.0)).alias(name.replace("_deg", "_ratio")) for name in measures
    ]
    return others.select(pl.col("label"), *ratios)


def _beside(chosen: pl.DataFrame, paper: pl.DataFrame) -> pl.DataFrame:
    """The paper's numbers in the rows of its own methods and parameters' choice."""
    own = chosen.with_columns(_own=pl.col("group") == "paper")
    values = paper.with_columns(_own=pl.lit(True))
    return own.join(values, on=["method", "correction", "_own"], how="left", maintain_order="left").drop("_own")


def _rank(column: str, order: tuple[str, ...]) -> pl.Expr:
    return pl.col(column).replace_strict(order, range(len(order)), default=len(order), return_dtype=pl.UInt8)
