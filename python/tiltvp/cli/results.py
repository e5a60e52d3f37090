"""The answers for many images: as a table for people, in degrees, and as a file for programs, in radians."""

from __future__ import annotations

import json
import math
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tiltvp.cli.option_words import typed
from tiltvp.cli.tables import Table, finite
from tiltvp.cli.terminal import new_table
from tiltvp.errors import counted

if TYPE_CHECKING:
    from rich.table import Table as PrintedTable

    from tiltvp import FilteredTilt, TiltEstimate

_PEOPLE: Final = (
    "file", "roll deg", "pitch deg", "alpha deg", "beta deg", "1-sigma deg", "confidence", "edges px", "inliers px",
    "ms", "reason",
)  # fmt: skip
_PEOPLE_NARROW: Final = ("file", "roll deg", "pitch deg", "1-sigma deg")
_JUDGED, _SURE = ("verdict",), ("confidence",)
_FILTERED: Final = ("filtered roll deg", "filtered pitch deg", "filtered 1-sigma deg")
_REASON_WIDTH, _FILE_WIDTH = 30, (12, 20, 40)
"""Columns of text that a folded reason takes, and those of a file's name: at least, with all columns, and at most."""
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
    taken_s: float | None = None
    """When the image was taken, by the clock of its source; None where that does not tell."""
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
    """One row for each image, angles in degrees; only the columns that matter most where `width` holds no more.

    Files are named from the folder that all are in; of a name that is too long the end is shown.
    """
    rows = [_people_row(outcome) for outcome in outcomes]
    for row, name in zip(rows, _short_names([outcome.file for outcome in outcomes]), strict=True):
        row["file"] = name
    judged = _JUDGED if any(outcome.verdict for outcome in outcomes) else ()
    filtered = any(outcome.filtered is not None for outcome in outcomes)
    columns = (*_PEOPLE[:-1], *(_FILTERED if filtered else ()), *judged, _PEOPLE[-1])
    least, enough, most = _FILE_WIDTH
    if _room(columns, rows, width) < min(enough, max((len(row["file"]) for row in rows), default=0)):
        columns = ("file", *_FILTERED[:2], *judged) if filtered else (*_PEOPLE_NARROW, *(judged or _SURE))
    room = min(most, max(least, _room(columns, rows, width)))
    table = new_table(None, columns, left=("file", "verdict", "reason"))
    for outcome, row in zip(outcomes, rows, strict=True):
        if len(row["file"]) > room:
            row["file"] = "…" + row["file"][1 - room :]
        style = "red" if outcome.estimate is None else "yellow" if _left_out(outcome) else None
        table.add_row(*[row[column] for column in columns], style=style)
    return table


def _room(columns: Sequence[str], rows: Sequence[dict[str, str]], width: int) -> int:
    """Columns of text that the others leave to the files' names."""
    taken = 0
    for column in columns:
        if column != "file":
            longest = max((len(row[column]) for row in rows), default=0)
            cells = min(longest, _REASON_WIDTH) if column == "reason" else longest
            taken += max(len(column), cells) + 3
    return width - taken - 2


def _short_names(files: Sequence[Path]) -> list[str]:
    """The files without the folders that all of them are in."""
    if not files:
        return []
    folder = os.path.commonpath([os.path.abspath(file.parent) for file in files])
    return [os.path.relpath(os.path.abspath(file), folder) for file in files]


def summary_words(outcomes: Sequence[Outcome]) -> str:
    """All images in a line: how many, how they lean, how many have no tilt and why, and the time of one.

    The time is the median of all but the first, which finds nothing in the processor's caches.
    """
    count = counted(len(outcomes), "images")
    given = [outcome.estimate for outcome in outcomes if outcome.estimate is not None]
    leans = sorted(estimate.alpha_rad for estimate in given if estimate)
    if leans:
        low, middle, high = (leans[round(share * (len(leans) - 1))] for share in (0.05, 0.5, 0.95))
        spread = f", 90 % from {degrees(low)} to {degrees(high)}" if len(leans) > 1 else ""
        words = [f"{count}: lean {degrees(middle)} deg{' in the median' if spread else ''}{spread}"]
    else:
        words = [f"{count}: no tilt"]
    stops = Counter(estimate.report.stop.replace("-", " ") for estimate in given if not estimate)
    if stops:
        told = ", ".join(f"{number} {stop}" for stop, number in stops.most_common())
        words.append(f"{stops.total()} without a tilt ({told})")
    refused = Counter(outcome.verdict for outcome in outcomes if outcome.estimate and outcome.accepted is False)
    words += [f"{number} {verdict}" for verdict, number in refused.most_common()]
    if unread := len(outcomes) - len(given):
        words.append(f"{unread} could not be used")
    times = sorted(outcome.time_s for outcome in outcomes[1:] if outcome.estimate is not None)
    if times:
        words.append(f"{1e3 * times[len(times) // 2]:.2f} ms an image")
    return "; ".join(words)


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
    row = dict.fromkeys((*_PEOPLE, *_FILTERED), "-") | {"reason": outcome.error or ""}
    row["verdict"] = outcome.verdict or "-"
    e, filtered = outcome.estimate, outcome.filtered
    if filtered is not None:
        held = (filtered.roll_rad, filtered.pitch_rad, filtered.sigma_rad)
        row |= {name: degrees(angle) for name, angle in zip(_FILTERED, held, strict=True)}
    if e is None:
        return row
    angles = {name: degrees(getattr(e, f"{name}_rad")) for name in ("alpha", "beta", "roll", "pitch")}
    row |= {f"{name} deg": words for name, words in angles.items()}
    row |= {"confidence": f"{e.confidence:.3f}", "1-sigma deg": degrees(sigma_rad(e)), "reason": typed(e.reason)}
    return row | {
        "edges px": str(e.edge_pixels),
        "inliers px": str(e.inlier_pixels),
        "ms": f"{1e3 * outcome.time_s:.2f}",
    }


def outcome_table(outcomes: Sequence[Outcome], method: str) -> Table:
    """One row for each image in SI units; None where there is no value, `error` where the image could not be used.

    `taken_s` is there where images tell when they were taken. Judged outcomes have `accepted`, `verdict` and
    `verdict_reason`; those of a filter also `nis`, and the filtered tilt in columns `filtered_...`, None where the
    filter abstains but for covariance, sigma and confidence. The lean of the robot itself, where it was asked for, is
    in columns `mounting_...`. Of the method "segments" there are `alternatives`, as a text of JSON.
    """
    types = {"file": "String", "method": "String"}
    if any(outcome.taken_s is not None for outcome in outcomes):
        types |= {"taken_s": "Float64"}
    types |= dict.fromkeys(_NUMBERS, "Float64") | dict.fromkeys(_COUNTS, "Int64")
    types |= dict.fromkeys(_MORE_NUMBERS, "Float64") | dict.fromkeys(_WORDS, "String")
    if method == "segments":
        types |= {"alternatives": "String"}
    if any(outcome.accepted is not None for outcome in outcomes):
        types |= {"accepted": "Boolean", "verdict": "String", "verdict_reason": "String"}
    if any(outcome.filtered is not None for outcome in outcomes):
        types |= {"nis": "Float64"} | {f"filtered_{name}": "Float64" for name in _NUMBERS}
    if any(outcome.mounting is not None for outcome in outcomes):
        types |= {f"mounting_{name}": "Float64" for name in _NUMBERS}
    rows = [
        {"file": str(outcome.file), "method": method, "taken_s": outcome.taken_s} | _row(outcome) | _judged(outcome)
        for outcome in outcomes
    ]
    return Table(types, [{name: finite(row.get(name)) for name in types} for row in rows])


def _row(outcome: Outcome) -> dict[str, object]:
    e = outcome.estimate
    if e is None:
        return {"error": outcome.error}
    alternatives = json.dumps([one.to_dict() for one in e.alternatives])
    return e.to_dict() | _numbers(e) | {"time_s": outcome.time_s, "alternatives": alternatives}


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
    known = all(map(math.isfinite, covariance.flat))  # Without a tilt the variances are infinite, and 0 between them.
    row |= {f"covariance_{name}_rad2": float(covariance[place]) if known else None for name, place in places.items()}
    return row | {"sigma_rad": sigma_rad(e)}
