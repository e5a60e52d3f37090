"""What is in the report of a run: every figure and table that its data allow, and words in place of the others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import polars as pl

from tiltvp.errors import RunError, TiltvpError
from tiltvp.lab.datasets.folder import read_dataset
from tiltvp.lab.evaluation import curves
from tiltvp.lab.evaluation.runner import VARIED
from tiltvp.lab.evaluation.runs import Run
from tiltvp.lab.evaluation.summary import errors
from tiltvp.lab.evaluation.variants import best_rows, variant_points
from tiltvp.lab.plots.report import angles, quality, times, web
from tiltvp.lab.plots.report import errors as error_plots
from tiltvp.lab.report.choice import choose_examples
from tiltvp.lab.report.panel import Contents, Panel, Section, Sheet
from tiltvp.lab.report.sheets import error_sheet, other_sheet, q_sheet, time_sheet
from tiltvp.lab.report.views import PARAMETERS, Lens, example_panels

__all__ = ["OtherRun", "contents_of", "scaling_of"]

_REJECT: Final = "image space, reject-refit"
_ERROR_MAX_DEG: Final = 3.0


@dataclass(frozen=True)
class OtherRun:
    """The same evaluation on another computer, and what to call that computer."""

    run: Run
    name: str


def contents_of(
    run: Run,
    *,
    also: OtherRun | None = None,
    scaling: pl.DataFrame | None = None,
    advance: Callable[[str], None] = lambda _: None,
) -> Contents:
    """Everything on the page of a run, with figure 25 of `also` and the cost of `scaling` if they are given.

    `advance` is told what comes next.

    Raises `RunError` for a table without the columns of a run, or without any method that the figures know, and for an
    `also` of another dataset.
    """
    if also is not None and also.run.manifest["dataset"]["digest"] != run.manifest["dataset"]["digest"]:
        names = " and ".join(str(each.manifest["dataset"]["path"]) for each in (run, also.run))
        raise RunError(f"the runs are of different datasets ({names}), expected one on two computers")
    advance("tables")
    summary = errors(run.table)
    rows = best_rows(run.table, summary)
    if rows["error_rad"].drop_nulls().is_empty():
        raise RunError("the run has no estimate of a method that the report knows, expected one or more")
    machine = _machine(run)
    other = (errors(also.run.table), also.name) if also else None
    sections = [
        Section("Errors and times", items=tuple(_filled(error_sheet(summary), time_sheet(summary, machine, other)))),
        _pictures(run, rows, advance),
        _results(run, rows, advance),
        _time_section(summary, machine, other, scaling),
        _honesty(rows),
    ]
    beyond = _filled(other_sheet(summary), q_sheet(summary))
    if beyond:
        sections.append(Section("Beyond the paper's table", items=tuple(beyond)))
    return Contents("Tilt estimation: the report of a run", _facts(run, machine), tuple(sections))


def scaling_of(directory: Path) -> pl.DataFrame | None:
    """The table of `tiltvp measure scaling`, if the folder of the run has it as scaling.parquet or scaling.csv.

    Raises `RunError` if it is there and cannot be one.
    """
    readers: dict[str, Callable[[Path], pl.DataFrame]] = {"parquet": pl.read_parquet, "csv": pl.read_csv}
    for ending, read in readers.items():
        path = directory / f"scaling.{ending}"
        if path.is_file():
            try:
                table = read(path)
            except (OSError, pl.exceptions.PolarsError) as error:
                raise RunError(f"{path}: cannot be read ({error}), expected a table of costs") from error
            missing = [name for name in ("over", "images", "megapixels", "seconds") if name not in table.columns]
            if missing:
                raise RunError(f"{path}: no column {', '.join(missing)}, expected a table of `tiltvp measure scaling`")
            return table
    return None


def _filled(*sheets: Sheet) -> list[Sheet]:
    return [sheet for sheet in sheets if not sheet.cells.is_empty()]


def _machine(run: Run) -> str:
    return str(run.manifest.get("machine", {}).get("cpu") or "this computer")


def _facts(run: Run, machine: str) -> dict[str, str]:
    table, dataset = run.table, run.manifest["dataset"]
    versions = run.manifest["versions"]
    return {
        "images": str(table["image"].n_unique()),
        "locations": str(table["location"].n_unique()),
        "environments": str(table["environment"].n_unique()),
        "combinations of parameters": str(table["combination"].n_unique()),
        "dataset": f"{Path(str(dataset['path'])).name} (SHA-256 {str(dataset['digest'])[:16]})",
        "computer": machine,
        "seed": str(run.manifest["seed"]),
        "versions": ", ".join(f"{name} {versions[name]}" for name in sorted(versions)),
    }


def _pictures(run: Run, rows: pl.DataFrame, advance: Callable[[str], None]) -> Section:
    title = "How the methods see an image"
    advance(title.lower())
    refit = rows.filter(pl.col("variant") == _REJECT)
    examples = choose_examples(refit)
    if examples is None:
        return Section(title, "The run has no estimate of the reject-refit scheme, by which example images are chosen.")
    directory = Path(str(run.manifest["dataset"]["path"]))
    try:
        dataset = read_dataset(directory)
        if dataset.digest() != run.manifest["dataset"]["digest"]:
            return Section(
                title,
                f"The dataset in {directory.name} is not the one of this run: figures 10 to 14, 17, 18 and 27 need it.",
            )
        own = dict(enumerate(run.manifest["combinations"]))
        best = {part["method"][0]: own[part["combination"][0]] for part in rows.partition_by("variant")}
        lens = Lens(
            dataset,
            options={each["method"]: _usable(each) for each in reversed(own.values())},
            best={method: _usable(each) for method, each in best.items()},
            factors_px=_factors(run.table, rows),
        )
        return Section(title, items=tuple(example_panels(lens, examples)))
    except TiltvpError as error:
        words = "figures 10 to 14, 17, 18 and 27 need the dataset of the run, which cannot be read"
        return Section(title, f"{words[0].upper()}{words[1:]}: {error}")


def _factors(table: pl.DataFrame, rows: pl.DataFrame) -> dict[str, float]:
    """The mean trained factor by method: of the combination of the captions if the run has it, else of the best one."""
    trained = table.filter((pl.col("correction") == "factor") & (pl.col("group") == "paper"))
    factors = {}
    for method, parameters in PARAMETERS.items():
        same = [pl.col(name) == value for name, value in parameters.items() if name in VARIED]
        own, best = (
            part.filter(pl.col("method") == method, *more)["factor"].mean()
            for part, more in ((trained, same), (rows, ()))
        )
        factor = own if own is not None else best
        if isinstance(factor, float):
            factors[method] = factor
    return factors


def _usable(combination: dict[str, Any]) -> dict[str, Any]:
    return dict(combination.get("options", {}))


def _results(run: Run, rows: pl.DataFrame, advance: Callable[[str], None]) -> Section:
    advance("errors")
    overall = curves.overall_errors(rows)
    by_tilt, by_environment = curves.errors_by_tilt(rows), curves.errors_by_environment(rows)
    by_angle = curves.angles_by_tilt(run.table, rows)
    items = (
        Panel(
            "figure-21", "Figure 21",
            "The fraction of images for which the tilt-estimation error is ε ≤ ε′, with the parameters of table 3, up "
            "to 5 degrees. High errors can occasionally occur; images without an estimate count as such.",
            error_plots.cumulative_errors(rows), web.cumulative_errors_web(rows),
        ),
        Panel(
            "figure-22", "Figure 22",
            "The mean error by the true tilt angle. The pale lines are each method's mean over all images. "
            "Parameters of table 3.",
            error_plots.errors_by_tilt(by_tilt, overall), web.errors_by_tilt_web(by_tilt, overall),
        ),
        Panel(
            "figure-23", "Figure 23",
            "The mean error for each environment. The pale lines are each method's mean over all images. Parameters of "
            "table 3.",
            error_plots.errors_by_environment(by_environment, overall),
        ),
        Panel(
            "figure-28", "Figure 28",
            "The true and the mean estimated tilt angle, corrected (solid, filled) and uncorrected (dashed, hollow). "
            "Parameters that minimise the mean error after correction; factors are trained on the other locations. "
            "Uncorrected image-space angles are those of eq. 26. On the black line estimate and truth are equal.",
            angles.true_and_estimated(by_angle), web.true_and_estimated_web(by_angle),
        ),
    )  # fmt: skip
    return Section("Errors", items=items)


def _time_section(
    summary: pl.DataFrame, machine: str, other: tuple[pl.DataFrame, str] | None, scaling: pl.DataFrame | None
) -> Section:
    items = [_time_panel(summary, "24", machine)]
    words = ""
    if other is None:
        words = "Figure 25 is figure 24 on an embedded computer: it is drawn when the run of another computer is given."
    else:
        items.append(_time_panel(other[0], "25", other[1]))
    if scaling is not None:
        items.append(
            Panel(
                "cost", "Cost",
                "The time of a whole evaluation, against the number of images and against their pixels. The dashed "
                "lines are proportional to images and to pixels.",
                times.cost(scaling),
            )
        )  # fmt: skip
    return Section("Time", words, tuple(items))


def _time_panel(summary: pl.DataFrame, number: str, machine: str) -> Panel:
    points = variant_points(summary)
    left_out = len(points) - len(times.points_shown(points, error_max_deg=_ERROR_MAX_DEG))
    omitted = f" {left_out} points beyond {_ERROR_MAX_DEG:g}° are left out." if left_out else ""
    return Panel(
        f"figure-{number}", f"Figure {number}",
        f"Mean error against mean time on {machine}. Each point is a combination of parameters from table 2; those of "
        f"table 3, with the lowest mean error, are large and rimmed in black.{omitted}",
        times.errors_over_time(points, error_max_deg=_ERROR_MAX_DEG),
        web.errors_over_time_web(points, error_max_deg=_ERROR_MAX_DEG),
    )  # fmt: skip


def _honesty(rows: pl.DataFrame) -> Section:
    items = []
    shares = curves.region_shares(rows)
    if len(shares):
        items.append(
            Panel(
                "covariance", "Reliability of the covariance",
                "The share of true normals inside the estimate's region of a nominal probability; 50, 90 and 95 % are "
                "marked. A curve below the diagonal promises too much. Only angles that are not corrected afterwards "
                "have a covariance.",
                quality.covariance_reliability(shares),
            )
        )  # fmt: skip
    alarms = curves.alarm_curves(rows)
    words = ""
    if len(alarms):
        items.append(
            Panel(
                "confidence", "Confidence as an alarm",
                "Estimates whose confidence is below a threshold are rejected: the share of failures (errors above 2°, "
                "and images without an estimate) that are found, against the share of good estimates that are lost, "
                "for every threshold. The number is the area under the curve.",
                quality.confidence_roc(alarms, curves.alarm_areas(alarms)),
            )
        )  # fmt: skip
    silent = [name for name in dict.fromkeys(rows["variant"]) if name not in alarms["variant"]]
    if silent:
        words = f"Without a curve of alarms, because no image is a failure or all are: {', '.join(silent)}."
    items.append(
        Panel(
            "abstaining", "Abstaining",
            "The error of the estimates that are accepted when the least confident images are rejected, first those "
            "without an estimate: mean and 99th percentile.",
            quality.errors_over_rejection(curves.rejection_curves(rows)),
        )
    )  # fmt: skip
    return Section("What an estimate says about itself", words, tuple(items))
