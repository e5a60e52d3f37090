"""Corrections of the angle, each trained on all locations but the one it is used at (eqs. 30, 31 and 45)."""

from __future__ import annotations

from collections.abc import Callable
from threading import Event
from typing import TYPE_CHECKING, Final

import numpy as np
import polars as pl

from tiltvp._core import (
    AffineCorrection,
    apply_correction,
    normal_from_alpha_beta,
    train_affine,
    train_factor,
    train_posterior,
)
from tiltvp.corrections import Correction
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.new import in_order
from tiltvp.lab.evaluation.combinations import PAPER_METHODS
from tiltvp.lab.evaluation.metrics import offset_rad, turned
from tiltvp.lab.evaluation.schema import COLUMNS, sorted_rows

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["TRAINED", "cross_validated"]


TRAINED: Final = ("factor", "affine", "posterior")
"""The corrections that are trained: a of eq. 30 or a' of eq. 45, a and b of section 4, P(alpha | l) of section 5.1."""

_FOLDS_MAX: Final[dict[str, int | None]] = {"factor": None, "affine": None, "posterior": 20}
"""In how many parts the locations are left out, None for one by one."""


def _nothing() -> None:
    return None


def cross_validated(rows: pl.DataFrame, *, threads: int = 1, advance: Callable[[], None] = _nothing) -> pl.DataFrame:
    """The rows of a run, and behind those without a correction the same with each trained one.

    A correction of the images at one location is trained on the estimates of all other locations; where these do not
    determine one, there is no angle. The posterior, which is dear to train, leaves out several locations together where
    there are more than twenty. `advance` is called after each combination.
    """

    def corrected(part: pl.DataFrame) -> list[pl.DataFrame]:
        trainable = part["method"][0] in PAPER_METHODS and part["correction"][0] == "none"
        return [_corrected(part, kind) for kind in TRAINED] if trainable else []

    tables = [rows]
    with in_order(corrected, rows.partition_by("combination", maintain_order=True), threads, Event()) as found:
        for more in found:
            tables.extend(more)
            advance()
    return sorted_rows(pl.concat(tables))


def _corrected(part: pl.DataFrame, kind: str) -> pl.DataFrame:
    """The rows of one combination with the angle corrected location by location."""
    measured = _measured(part)
    true, location = part["alpha_true_rad"].to_numpy(), part["location"].to_numpy()
    found = np.isfinite(measured)
    alpha, factor, offset = (np.full(len(part), np.nan) for _ in range(3))
    for places in _folds(list(dict.fromkeys(location)), _FOLDS_MAX[kind]):
        here = np.isin(location, places)
        others = found & ~here
        correction = _trained(kind, measured[others], true[others])
        if correction is not None:
            alpha[here] = apply_correction(correction, measured[here])
            factor[here] = correction if isinstance(correction, float) else correction.factor
            offset[here] = correction.offset_rad if isinstance(correction, AffineCorrection) else np.nan
    offsets = _offsets(part, alpha)
    columns = {
        "factor": factor,
        "offset_rad": offset,
        "alpha_rad": alpha,
        "error_rad": np.hypot(offsets[:, 0], offsets[:, 1]),
        "offset_x_rad": offsets[:, 0],
        "offset_y_rad": offsets[:, 1],
    }
    nothing = [pl.lit(None, COLUMNS[name]).alias(name) for name in COLUMNS if name.startswith("covariance_")]
    numbers = [pl.Series(name, values, pl.Float64).fill_nan(None) for name, values in columns.items()]
    return part.with_columns(pl.lit(kind).alias("correction"), *numbers, *nothing)


def _folds(places: list[str], most: int | None) -> list[list[str]]:
    """The locations that are left out together: one by one, or in as many groups as may be."""
    count = len(places) if most is None else min(most, len(places))
    return [places[first::count] for first in range(count)]


def _trained(kind: str, measured: NDArray[np.float64], true: NDArray[np.float64]) -> Correction | None:
    """The correction that a training set gives; None where it does not determine one."""
    try:
        match kind:
            case "factor":
                leaning = true > 0.0
                return train_factor(measured[leaning], true[leaning])
            case "affine":
                return train_affine(measured, true)
            case _:
                return train_posterior(measured, true)
    except InvalidInputError:
        return None


def _measured(part: pl.DataFrame) -> NDArray[np.float64]:
    """(N,): what is corrected, the shift in pixels (eq. 30) or the angle (eq. 45); NaN without an estimate."""
    shifts = part["shift_px"].cast(pl.Float64)
    return (part["alpha_raw_rad"] if shifts.null_count() == len(part) else shifts).fill_null(np.nan).to_numpy()


def _offsets(part: pl.DataFrame, alpha: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 2): the errors of the corrected leans in the upright frame, turned back by the heading; NaN without one."""
    beta = part["beta_rad"].fill_null(np.nan).to_numpy()
    found = np.isfinite(alpha) & np.isfinite(beta)
    true = part.select("alpha_true_rad", "beta_true_rad").filter(found)
    offsets = np.full((len(part), 2), np.nan)
    if found.any():
        estimated = _normals(alpha[found].tolist(), beta[found].tolist())
        truth = _normals(*(true[name].to_list() for name in true.columns))
        offsets[found] = turned(offset_rad(estimated, truth), part["yaw_rad"].filter(found).to_numpy())
    return offsets


def _normals(alpha_rad: list[float], beta_rad: list[float]) -> NDArray[np.float64]:
    return np.array([normal_from_alpha_beta(*lean) for lean in zip(alpha_rad, beta_rad, strict=True)])
