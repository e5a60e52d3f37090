"""The answers for many images: as a table for people, in degrees, and as a file for programs, in radians."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tiltvp.cli.tables import Table, finite
from tiltvp.cli.terminal import new_table

if TYPE_CHECKING:
    from rich.table import Table as PrintedTable

    from tiltvp import FilteredTilt, TiltEstimate

_PEOPLE: Final = (
    "file", "alpha deg", "beta deg", "roll deg", "pitch deg", "confidence", "1-sigma deg", "edges px", "inliers px",
    "ms", "reason",
)  # fmt: skip
_PEOPLE_NARROW: Final = ("file", "alpha deg", "beta deg", "confidence", "1-sigma deg")
_JUDGED: Final = ("verdict",)
_FILTERED: Final = ("filtered alpha deg", "filtered beta deg", "filtered 1-sigma deg")
_NUMBERS_WIDTH, _FILE_WIDTH = 135, 40
"""Columns of text that all but the file and a folded reason take, and those that a long file name is granted."""
_NUMBERS: Final = (
    "alpha_rad", "beta_rad", "roll_rad", "pitch_rad", "normal_x", "normal_y", "normal_z",
    "covariance_xx_rad2", "covariance_xy_rad2", "covariance_yy_rad2", "sigma_rad", "confidence",
)  # fmt: skip
_COUNTS: Final = ("edge_pixels", "prefiltered_pixels", "inlier_pixels", "iterations")
_MORE_NUMBERS: Final = ("shift_px", "residual_rms", "time_s")
_WORDS: Final = ("stop", "reason", "error")


@dataclass(frozen=True)
class Outcome:
    """What became of one image: an estimate and the seconds it took, or what went wrong; and what was made of it."""

    file: Path
    estimate: TiltEstimate | None = None
    time_s: float = math.nan
    error: str | None = None
    accepted: bool | None = None
    """Whether it was sure enough, and with a filter whether it was fused; None where nobody asked."""
    verdict: str | None = None
    verdict_reason: str | None = None
    nis: float | None = None
    filtered: FilteredTilt | None = None
    """What the filter held to be true after it; None without a filter."""
    mounting: FilteredTilt | None = None
    """The lean of the robot itself that the filter held to be true after it; None where nobody asked."""


def sigma_rad(estimate: TiltEstimate | FilteredTilt) -> float:
    """One standard deviation of the normal in any one direction: the root of half the covariance's trace."""
    covariance = estimate.covariance_rad2
    return math.sqrt(0.5 * float(covariance[0, 0] + covariance[1, 1]))


def degrees(value_rad: float, digits: int = 2) -> str:
    """Degrees for people; a dash where there is no value."""
    return f"{math.degrees(value_rad):.{digits}f}" if math.isfinite(value_rad) else "-"


def people_table(outcomes: Sequence[Outcome], width: int) -> PrintedTable:
    """One row for each image, angles in degrees; only the columns that matter most where `width` holds no more."""
    rows = [_people_row(outcome) for outcome in outcomes]
    longest = max((len(row["file"]) for row in rows), default=0)
    judged = _JUDGED if any(outcome.verdict for outcome in outcomes) else ()
    filtered = _FILTERED if any(outcome.filtered is not None for outcome in outcomes) else ()
    more = sum(len(name) + 2 for name in judged + filtered)
    if width >= _NUMBERS_WIDTH + more + min(longest, _FILE_WIDTH):
        columns = (*_PEOPLE[:-1], *filtered, *judged, _PEOPLE[-1])
    else:
        columns = (*_PEOPLE_NARROW, *filtered[:2], *judged)
    table = new_table(None, columns, left=("file", "verdict", "reason"))
    for outcome, row in zip(outcomes, rows, strict=True):
        style = "red" if outcome.estimate is None else "yellow" if _left_out(outcome) else None
        table.add_row(*[row[column] for column in columns], style=style)
    return table


def mounting_words(outcomes: Sequence[Outcome]) -> str:
    """The lean of the robot itself after the last image, in a line."""
    held = next((outcome.mounting for outcome in reversed(outcomes) if outcome.mounting is not None), None)
    if not held:
        return "the robot's own lean: not told, for the robot has not turned enough"
    angles = f"alpha {degrees(held.alpha_rad)} deg, beta {degrees(held.beta_rad, 1)} deg"
    return f"the robot's own lean: {angles}, 1-sigma {degrees(held.sigma_rad)} deg"


def _left_out(outcome: Outcome) -> bool:
    return not outcome.estimate or outcome.accepted is False


def _people_row(outcome: Outcome) -> dict[str, str]:
    row = dict.fromkeys((*_PEOPLE, *_FILTERED), "-") | {"file": str(outcome.file), "reason": outcome.error or ""}
    row["verdict"] = outcome.verdict or "-"
    e, filtered = outcome.estimate, outcome.filtered
    if filtered is not None:
        held = (filtered.alpha_rad, filtered.beta_rad, filtered.sigma_rad)
        row |= {name: degrees(angle) for name, angle in zip(_FILTERED, held, strict=True)}
    if e is None:
        return row
    angles = {name: degrees(getattr(e, f"{name}_rad")) for name in ("alpha", "beta", "roll", "pitch")}
    row |= {f"{name} deg": words for name, words in angles.items()}
    row |= {"confidence": f"{e.confidence:.3f}", "1-sigma deg": degrees(sigma_rad(e)), "reason": e.reason}
    return row | {
        "edges px": str(e.edge_pixels),
        "inliers px": str(e.inlier_pixels),
        "ms": f"{1e3 * outcome.time_s:.2f}",
    }


def outcome_table(outcomes: Sequence[Outcome], method: str) -> Table:
    """One row for each image in SI units; None where there is no value, `error` where the image could not be used.

    Judged outcomes have `accepted`, `verdict` and `verdict_reason`; those of a filter also `nis`, and the filtered tilt
    in columns `filtered_...`, None where the filter abstains but for covariance, sigma and confidence. The lean of the
    robot itself, where it was asked for, is in columns `mounting_...`.
    """
    types = {"file": "String", "method": "String"}
    types |= dict.fromkeys(_NUMBERS, "Float64") | dict.fromkeys(_COUNTS, "Int64")
    types |= dict.fromkeys(_MORE_NUMBERS, "Float64") | dict.fromkeys(_WORDS, "String")
    if any(outcome.accepted is not None for outcome in outcomes):
        types |= {"accepted": "Boolean", "verdict": "String", "verdict_reason": "String"}
    if any(outcome.filtered is not None for outcome in outcomes):
        types |= {"nis": "Float64"} | {f"filtered_{name}": "Float64" for name in _NUMBERS}
    if any(outcome.mounting is not None for outcome in outcomes):
        types |= {f"mounting_{name}": "Float64" for name in _NUMBERS}
    rows = [{"file": str(outcome.file), "method": method} | _row(outcome) | _judged(outcome) for outcome in outcomes]
    return Table(types, [{name: finite(row.get(name)) for name in types} for row in rows])


def _row(outcome: Outcome) -> dict[str, object]:
    e = outcome.estimate
    if e is None:
        return {"error": outcome.error}
    row = _numbers(e)
    row |= {name: getattr(e, name) for name in ("edge_pixels", "prefiltered_pixels", "inlier_pixels", "shift_px")}
    row |= e.report.to_dict()
    return row | {"time_s": outcome.time_s}


def _judged(outcome: Outcome) -> dict[str, object]:
    row: dict[str, object] = {name: getattr(outcome, name) for name in ("accepted", "verdict", "verdict_reason", "nis")}
    if outcome.filtered is not None:
        row |= {f"filtered_{name}": value for name, value in _numbers(outcome.filtered).items()}
    if outcome.mounting is not None:
        row |= {f"mounting_{name}": value for name, value in _numbers(outcome.mounting).items()}
    return row


def _numbers(e: TiltEstimate | FilteredTilt) -> dict[str, object]:
    """The values of `_NUMBERS`."""
    normal, covariance = e.normal, e.covariance_rad2
    row: dict[str, object] = {
        name: getattr(e, name) for name in ("alpha_rad", "beta_rad", "roll_rad", "pitch_rad", "confidence")
    }
    row |= {f"normal_{axis}": float(normal[i]) for i, axis in enumerate("xyz")}
    places = {"xx": (0, 0), "xy": (0, 1), "yy": (1, 1)}
    row |= {f"covariance_{name}_rad2": float(covariance[place]) for name, place in places.items()}
    return row | {"sigma_rad": sigma_rad(e)}
