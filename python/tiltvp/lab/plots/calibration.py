"""How a self-calibration converges: x, y and yaw over the steps, and how sure they are."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from tiltvp.selfcalib import MountingEstimate

__all__ = ["convergence"]

_ROWS: Final = (("x_m", "x", "m", 1.0), ("y_m", "y", "m", 1.0), ("yaw_rad", "yaw", "deg", math.degrees(1.0)))
"""Column, name, unit, and units per what the column has."""
_LATE: Final = 0.5
"""From this share of the steps on values set the scale: before, the band may be as wide as the circle."""
_DECADES: Final = 5.0
"""Of a logarithmic axis at most: what is wider had nothing to say."""


def convergence(
    tables: Mapping[str, Mapping[str, NDArray[Any]]], answers: Mapping[str, MountingEstimate] | None = None
) -> Figure:
    """x, y (metres) and yaw (degrees) over the steps, in a band of two standard deviations, beside these.

    `tables` are those of `tiltvp.selfcalib.convergence_table`, by the name of the log; `answers` those of the whole
    logs, or the truth, drawn dashed in the same colours.
    """
    figure = Figure(figsize=(11.0, 7.6), layout="constrained")
    axes = figure.subplots(3, 2, sharex=True)
    for row, (left, right) in zip(_ROWS, axes, strict=True):
        column, name, unit, factor = row
        shown, spreads = [], []
        for k, (log, table) in enumerate(tables.items()):
            values = factor * np.asarray(table[column], dtype=np.float64)
            sigma = factor * _sigma(table[f"variance_{name}"])
            steps, colour = np.arange(len(values)), f"C{k}"
            left.fill_between(steps, values - 2.0 * sigma, values + 2.0 * sigma, color=colour, alpha=0.2, linewidth=0)
            left.plot(steps, values, color=colour, linewidth=1.6, label=log)
            right.plot(steps, sigma, color=colour, linewidth=1.6)
            late = slice(int(_LATE * len(values)), None)
            shown += [values[late], (values[-1:] + 4.0 * sigma[-1:]), (values[-1:] - 4.0 * sigma[-1:])]
            spreads.append(sigma)
            if answers is not None and log in answers:
                answer = factor * float(getattr(answers[log], column))
                left.axhline(answer, color=colour, linewidth=1.0, linestyle="--")
                shown.append(np.array([answer]))
        _scale(left, right, np.concatenate(shown), np.concatenate(spreads))
        left.set_ylabel(f"{name} ({unit})")
        right.set_ylabel(f"1-sigma of {name} ({unit})")
        for one in (left, right):
            one.grid(color="0.9", linewidth=0.6)
            one.spines[["top", "right"]].set_visible(False)
    axes[2][0].set_xlabel("step")
    axes[2][1].set_xlabel("step")
    axes[0][0].set_title("filter, two standard deviations" + ("" if answers is None else "; dashed: the whole log"))
    axes[0][1].set_title("how sure the filter is")
    if len(tables) > 1:
        logs = [line for line in axes[0][0].get_lines() if line.get_label() in tables]
        # Given by hand names that begin with _ are shown too; names of others are no mathematics.
        for text in axes[0][0].legend(logs, list(tables), fontsize="small").get_texts():
            text.set_parse_math(False)
    return figure


def _sigma(variances: NDArray[Any]) -> NDArray[np.float64]:
    """Standard deviations; NaN where there is none."""
    known = np.isfinite(variances) & (variances >= 0.0)
    return np.sqrt(np.where(known, variances, np.nan))


def _scale(left: Axes, right: Axes, values: NDArray[np.float64], sigmas: NDArray[np.float64]) -> None:
    """Axes that show the end of the drive well, whatever its start was."""
    values, sigmas = values[np.isfinite(values)], sigmas[np.isfinite(sigmas) & (sigmas > 0.0)]
    if values.size:
        room = 0.1 * float(np.ptp(values)) + 1e-6
        left.set_ylim(float(values.min()) - room, float(values.max()) + room)
    if sigmas.size:
        low = float(sigmas.min())
        right.set_yscale("log")
        right.set_ylim(0.7 * low, 1.4 * min(float(sigmas.max()), low * 10.0**_DECADES))
