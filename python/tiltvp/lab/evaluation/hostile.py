"""How often tilt estimates are wrong and sure of themselves, where images, cameras and mountings mislead them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
import polars as pl

from tiltvp._core import METHODS
from tiltvp.errors import InvalidInputError
from tiltvp.images import gray_from
from tiltvp.lab.datasets.hostile import UNHARMED, HostileImage
from tiltvp.lab.evaluation.combinations import PAPER_METHODS
from tiltvp.lab.evaluation.trust import was_set_on
from tiltvp.tilt import TiltEstimator, tilt_error_rad

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.cameras import Camera
    from tiltvp.tilt import TiltEstimate

__all__ = ["SURE", "judge_images", "summarise_cases", "train_trust"]

SURE: Final = 0.9
"""Confidence from which on an estimate is sure of itself."""
WRONG_DEG: Final = 2.0
"""Errors beyond are wrong: confidence is the probability of a smaller one."""

CAUSES: Final = {
    "read as": "mounting",
    "focal": "calibration",
    "centre": "calibration",
    "rim": "rim",
    "robot": "mask",
    "160 x": "pixels for each degree",
    "80 x": "pixels for each degree",
    "40 x": "pixels for each degree",
    "dark": "contrast",
    "over": "contrast",
    "blurred": "blur",
    "focus": "blur",
    "turned": "blur",
    "noisy": "noise",
    "noise": "noise",
    "texture": "texture",
    "hidden": "directions",
    "lean": "tilt_max_rad",
}
"""What a reason names the cause by, for each case whose name begins with or holds the words; others have none."""


TWINS: Final = ("upward read as downward", "downward read as upward")
"""Cases that only lightness and heights tell from the truth, and these seldom: they count less."""
TWIN: Final = 0.3
"""How much they count: at one, with as many right views sure over all six mountings, 64 % of the downward ones are so
by `segments` where 69 % are, cross-validated by building."""
HOPELESS: Final = 0.3
"""Confidence by the covariance below which an estimate is not sure anyway, and teaches nothing."""
RIGHT: Final[dict[str, dict[str, float]]] = {
    "refined": {"vertical": 2.0, "up": 20.0},
    "segments": {"vertical": 1.0, "up": 8.0},
    **{method: {"vertical": 2.0} for method in PAPER_METHODS},
}
"""How much a right estimate weighs against a wrong one, for whether a fit is of the vertical and for whether up is as
told: so much that of the right ones of unharmed upward views nine in ten stay sure, cross-validated by building. Of
the paper's methods, whose stated errors are larger, half and fewer were sure before; whether up is as told is not
learned of them, for it would change little."""
KEPT: Final = 32
"""Estimators of a method that are kept for the next images: more than the pairs of a camera and a mounting that come
again. Cameras with a centre that is off do not."""
PENALTY: Final = 1.0
"""Of the squared weights of features that are scaled to a standard deviation of one."""
OF_FIT: Final = 8
"""So many of the features tell of the fit."""
FINENESS: Final = 2
"""So many of these tell how fine an image is. Small and noisy ones are shown by cameras as told alone, and whether they
are is not to be told by that."""


def judge_images(
    images: Iterable[HostileImage], *, features: bool = False, advance: Callable[[], None] = lambda: None
) -> pl.DataFrame:
    """One row for each image and method: error in degrees (NaN without a truth, null without an answer), confidence,
    reason, and with `features` also what tells whether the fit is of the vertical.

    An estimator that cannot be made, for the camera sees nothing of what the method looks at, has no answer.
    """

    @lru_cache(maxsize=KEPT * len(METHODS))
    def estimator_of(method: str, camera: Camera, mounting: tuple[float, ...]) -> TiltEstimator | InvalidInputError:
        try:
            return TiltEstimator(camera, method=method, robot_from_camera=np.reshape(mounting, (3, 3)))
        except InvalidInputError as error:
            return error

    rows: list[dict[str, object]] = []
    for item in images:
        for method in METHODS:
            estimator = estimator_of(method, item.camera, tuple(item.robot_from_camera.ravel().tolist()))
            row: dict[str, object] = {"case": item.case, "location": item.location, "method": method}
            if isinstance(estimator, InvalidInputError):
                rows.append(row | {"confidence": 0.0, "reason": str(estimator)})
                continue
            row |= _judged(estimator(item.image), item)
            if features:
                row["features"] = estimator._trust_features(gray_from(item.image)).tolist()
            rows.append(row)
        advance()
    return pl.DataFrame(rows, infer_schema_length=None)


def _judged(estimate: TiltEstimate, item: HostileImage) -> dict[str, object]:
    error = None
    if estimate:
        wanted = item.normal
        error = np.nan if wanted is None else float(np.rad2deg(tilt_error_rad(estimate.normal, wanted)))
    return {"error_deg": error, "confidence": estimate.confidence, "reason": estimate.reason}


def summarise_cases(table: pl.DataFrame) -> pl.DataFrame:
    """One row for each method and case, and for all hostile ones together: images, and in per cent of them answers,
    sure ones, and those wrong and sure; of what was right, how much is sure; of what is not sure, how much names its
    cause, null where a case has none to name.
    """
    right = pl.col("error_deg").is_not_nan() & (pl.col("error_deg") <= WRONG_DEG)
    judged = table.with_columns(
        answer=pl.col("error_deg").is_not_null(),
        sure=pl.col("confidence") >= SURE,
        right=right.fill_null(value=False),
        named=pl.struct("case", "reason").map_elements(_names_cause, return_dtype=pl.Boolean),
    ).with_columns(wrong=pl.col("sure") & pl.col("answer") & ~pl.col("right"))
    together = judged.filter(~pl.col("case").is_in(UNHARMED)).with_columns(case=pl.lit("all that mislead"))
    share = pl.concat([judged, together]).group_by("method", "case", maintain_order=True)

    def percent(what: pl.Expr) -> pl.Expr:
        return 100.0 * what.mean()

    return share.agg(
        images=pl.len(),
        answers=percent(pl.col("answer")),
        sure=percent(pl.col("sure")),
        wrong_and_sure=percent(pl.col("wrong")),
        abstained=percent(~pl.col("answer")),
        right=percent(pl.col("right")),
        sure_of_right=percent(pl.col("sure").filter(pl.col("right"))),
        cause_named=percent(pl.col("named").filter(~pl.col("sure"))),
    )


def _names_cause(row: dict[str, str]) -> bool | None:
    causes = [cause for words, cause in CAUSES.items() if row["case"].startswith(words) or f" {words}" in row["case"]]
    return all(re.search(cause, row["reason"]) for cause in causes) if causes else None


def train_trust(table: pl.DataFrame, method: str) -> dict[str, tuple[float, NDArray[np.float64]]]:
    """Constant and weights (F,) of what tells whether a fit is `vertical`, and of some methods whether `up` is as told.

    From rows with features: logistic regressions on the half of the buildings that is for setting things. The first
    learns from mountings that are as told, the second from those that are not and from what is right. Raises
    `InvalidInputError` where none of them has an answer.
    """
    told = table.filter(
        (pl.col("method") == method)
        & pl.col("error_deg").is_not_null()
        & pl.col("location").map_elements(was_set_on, return_dtype=pl.Boolean)
    )
    if told.is_empty():
        raise InvalidInputError(
            f"{method}: no answer on the half that sets the weights, expected more images of each case"
        )
    features = np.array(told["features"].to_list())
    # The first is the logarithm of the stated error in degrees.
    hopeful = 1.0 - np.exp(-((WRONG_DEG / np.exp(features[:, 0])) ** 2)) > HOPELESS
    right = told["error_deg"].fill_nan(np.inf).to_numpy() <= WRONG_DEG
    misread = told["case"].str.contains("read as").to_numpy()
    uses = {
        "vertical": (hopeful & ~misread, slice(None, OF_FIT)),
        "up": (hopeful & (misread | right), slice(FINENESS, None)),
    }
    counts = np.where(told["case"].is_in(TWINS).to_numpy(), TWIN, 1.0)
    return {
        what: _logistic(features[rows, columns], right[rows], np.where(right, RIGHT[method][what], counts)[rows])
        for what, (rows, columns) in uses.items()
        if what in RIGHT[method]
    }


def _logistic(
    features: NDArray[np.float64], right: NDArray[np.bool_], count: NDArray[np.float64]
) -> tuple[float, NDArray[np.float64]]:
    """Constant and weights (F,) by Newton's method, of rows that count so much each."""
    scale = features.std(axis=0) + 1e-9
    rows = np.column_stack([np.ones(len(features)), features / scale])
    weights, stiffness = np.zeros(rows.shape[1]), PENALTY * np.eye(rows.shape[1])
    stiffness[0, 0] = 1e-3
    for _ in range(100):
        shares = 1.0 / (1.0 + np.exp(-rows @ weights))
        gradient = rows.T @ (count * (right - shares)) - stiffness @ weights
        step = np.linalg.solve((rows.T * (count * shares * (1.0 - shares))) @ rows + stiffness, gradient)
        weights += step
        if np.abs(step).max() < 1e-7:
            break
    return float(weights[0]), np.asarray(weights[1:] / scale)
