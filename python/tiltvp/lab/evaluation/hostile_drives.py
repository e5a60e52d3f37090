"""How often calibrations are wrong and sure, where logs mislead them, and how often they name the cause."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, Final

import numpy as np
import polars as pl

from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.hostile_drives import HostileDrive
from tiltvp.selfcalib import LogCalibration, MountingEstimate, SelfCalibrator, calibrate

__all__ = ["judge_drives", "judged", "judged_refusal", "summarise_drive_cases"]

NEES_LIMIT: Final = 16.27
"""99.9 % quantile of chi-square with three degrees of freedom."""
BOUND_SIGMAS: Final = 5.0
"""Errors beyond so many standard deviations of the Cramer-Rao bound are wrong."""
SURELY: Final = 3.0
"""Standard deviations by which a centre that is off is known to be."""

CAUSES: Final = {
    "wheels swapped": "wheels swapped",
    "both wheels negated": "wheels swapped",
    "bearings clockwise": "wheels swapped",
    "left wheel negated": "left wheel",
    "right wheel negated": "right wheel",
    "bearings in degrees": "degrees",
    "lengths in millimetres": "millimetres",
    "cumulative": "cumulative",
    "wheel base": "wheel base",
    "sigma": "bearing_sigma_rad",
    "K told": "odometry_k_m",
    "bearings 0.2 s late": "later than the odometry",
    "images 0.2 s late": "later than the odometry",
    "images mirrored": "wheels swapped",
    "camera bumped": "bump",
    "camera creeps": "works loose",
    "two landmarks merged": "under one name",
    "rows read": "rolling shutter",
    "image centre": "image centre",
    "straight": "rotate in place",
    "rotation": "drive straight",
    "too short": "drive straight",
}
"""What a reason names the cause by, for each case whose name begins so; reflections are one family."""


def judge_drives(drives: Iterable[HostileDrive], *, advance: Callable[[], None] = lambda: None) -> pl.DataFrame:
    """Two rows for each drive, of the filter and of the whole log.

    Columns: case, seed, by, answered (the verdict says that it can be relied upon), nees, worst (the largest error
    of x, y and yaw in standard deviations of the bound), wrong, named, reason.
    """
    rows: list[dict[str, Any]] = []
    for item in drives:
        calibrator = SelfCalibrator(**item.options)
        calibrator.follow(item.odometry, item.bearings)
        rows.append(judged(item, "filter", calibrator.estimate, calibrator.estimate))
        rows.append(_whole_log(item))
        advance()
    return pl.DataFrame(rows)


def summarise_drive_cases(table: pl.DataFrame) -> pl.DataFrame:
    """One row for each case and way: drives, and shares in per cent of answers, wrong and sure, abstained, and named.

    Named is null where a case has no cause to name.
    """
    sure = pl.col("answered")
    columns = {
        "drives": pl.len(),
        "answers": 100.0 * sure.mean(),
        "wrong and sure": 100.0 * (sure & pl.col("wrong")).mean(),
        "abstained": 100.0 * (~sure).mean(),
        "cause named": 100.0 * pl.col("named").mean(),
    }
    return table.group_by("case", "by", maintain_order=True).agg(**columns)


def _whole_log(item: HostileDrive) -> dict[str, Any]:
    try:
        whole = calibrate(item.odometry, item.bearings, **item.options, **item.asked)
    except InvalidInputError as error:
        return judged_refusal(item, "whole log", error)
    return judged(item, "whole log", whole, whole.mounting)


def _cause(item: HostileDrive) -> str:
    return next((words for name, words in CAUSES.items() if item.case.startswith(name)), "")


def _columns(item: HostileDrive, by: str, nees: float, worst: float) -> dict[str, Any]:
    """The columns of a drive without an answer."""
    columns = {"case": item.case, "seed": item.seed, "by": by, "answered": False, "nees": nees, "worst": worst}
    return columns | {"wrong": True, "named": False, "reason": ""}


def judged_refusal(item: HostileDrive, by: str, error: Exception) -> dict[str, Any]:
    """The row of a drive without an answer."""
    cause, reason = _cause(item), str(error)
    return _columns(item, by, math.nan, math.nan) | {"named": cause in reason if cause else None, "reason": reason}


def judged(
    item: HostileDrive, by: str, verdict: LogCalibration | MountingEstimate, e: MountingEstimate, *, doubt: str = ""
) -> dict[str, Any]:
    """The row of an answer; `doubt` is why it cannot be relied upon, beside what it says itself."""
    error = np.array([e.x_m, e.y_m, e.yaw_rad]) - item.truth
    error[2] = math.remainder(error[2], math.tau)
    try:
        nees = float(error @ np.linalg.solve(e.covariance_xy_yaw, error))
    except np.linalg.LinAlgError:
        nees = math.inf
    worst = float(np.max(np.abs(error) / np.sqrt(np.diag(item.bound))))
    cause, reason = _cause(item), "; ".join(filter(None, (doubt, verdict.reason)))
    return _columns(item, by, nees, worst) | {
        "answered": bool(verdict) and not doubt,
        "wrong": not (nees <= NEES_LIMIT and worst <= BOUND_SIGMAS),
        "named": cause in reason or _is_estimated(item, verdict, cause) if cause else None,
        "reason": reason,
    }


def _is_estimated(item: HostileDrive, verdict: LogCalibration | MountingEstimate, cause: str) -> bool:
    """Whether the cause is something that the whole log estimates, which need not be named."""
    if not isinstance(verdict, LogCalibration):
        return False
    of_camera = {
        "image centre": (verdict.centre_off_rad, verdict.centre_off_sigma_rad),
        "rolling shutter": (verdict.rolling_shutter_s, verdict.rolling_shutter_sigma_s),
    }
    if cause in of_camera:
        off, sigma = of_camera[cause]
        return bool(np.hypot(*off) > SURELY * np.hypot(*sigma))
    told = SelfCalibrator(**item.options).options
    own = {"bearing_sigma_rad": verdict.bearing_sigma_rad, "odometry_k_m": verdict.odometry_k_m}
    return own.get(cause) not in (None, told.get(cause))
