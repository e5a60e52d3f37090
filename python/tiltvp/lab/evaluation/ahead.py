"""The vertical of views that look anywhere: what is found, and how well it is learned which direction is up."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import polars as pl

from tiltvp.lab.datasets.ahead import AHEAD_CAMERAS, AheadView, ahead_views, roll_pitch
from tiltvp.lab.evaluation.choices import Network, choice_shares, train_network
from tiltvp.lab.evaluation.curves import region_limit
from tiltvp.lab.evaluation.metrics import offset_rad
from tiltvp.rotations import read_rotation
from tiltvp.tilt import TiltEstimator

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.lab.datasets.panoramas import Panorama

__all__ = ["REACH_RAD", "LearnedView", "ahead_table", "any_lean_table", "look_ahead", "prior_table", "train_choice"]

REACH_RAD: Final = float(np.deg2rad(60.0))
"""Roll and pitch of 45 degrees each lean by 60 together."""
SEEDS: Final = (0, 1000, 2000, 3000)
"""What is added to the number of a panorama for the seed of its views."""
FRESH: Final = 4000
"""The same for views that trained nothing, as the software's network judges them; it knows their buildings."""
UNITS: Final = 16
"""Hidden units of the network: by unseen buildings 12 and 20 are as good."""
DECAY: Final = 0.01
"""With half of it unseen buildings are surer, and more often wrong."""
EXPECTED: Final = (1, 2, 3)
"""Features that say what was expected, as in `choice.rs`: they count in proportion, so that no lean is ruled out."""
RIGHT_DEG: Final = 5.0
"""A view trains if one of its hypotheses is as near as this."""
FOLDS: Final = 5
REGIONS: Final = (0.5, 0.9, 0.95, 0.999)
"""Nominal probabilities of the covariance's regions in which truths are counted."""
NONE_ODDS: Final = 0.08
"""Odds, against the best hypothesis, that none is right, as the software has them."""


@dataclass(frozen=True)
class LearnedView:
    """One view: where it is, what is up, hypotheses (K, 3) with features (K, F), and what the estimate said."""

    camera: str
    location: str
    up: NDArray[np.float64]
    ups: NDArray[np.float64]
    features: NDArray[np.float64]
    estimate: NDArray[np.float64] | None
    confidence: float

    def errors_deg(self) -> NDArray[np.float64]:
        """(K,): how far each hypothesis is off."""
        return np.rad2deg(np.arccos(np.clip(self.ups @ self.up, -1.0, 1.0)))


def look_ahead(
    panoramas: Sequence[Panorama],
    *,
    seeds: Sequence[int] = SEEDS,
    samples: int = 2,
    noise_sigma: float = 2.0,
    advance: Callable[[], None] = lambda: None,
) -> list[LearnedView]:
    """What "segments" finds in views of panoramas, in the camera frame. `advance` is called per panorama."""
    forward = np.array(read_rotation("forward"))
    estimators = _estimators(REACH_RAD)
    seen = []
    for number, panorama in enumerate(panoramas):
        for seed in seeds:
            for view in ahead_views(panorama, number + seed, samples=samples, noise_sigma=noise_sigma):
                estimator = estimators[view.camera]
                ups, features = estimator._hypotheses(view.image)
                estimate = estimator(view.image)
                found = np.asarray(estimate.normal) @ forward if estimate else None
                answer = (ups @ forward, features, found, estimate.confidence)
                seen.append(LearnedView(view.camera, panorama.location, view.up, *answer))
        advance()
    return seen


def prior_table(
    panoramas: Sequence[Panorama],
    prior_deg: float,
    *,
    samples: int = 2,
    noise_sigma: float = 2.0,
    advance: Callable[[], None] = lambda: None,
) -> pl.DataFrame:
    """What "segments" makes of views that are known to lean by at most so many degrees, by the kind of camera.

    In per cent of all views: right (off by at most two degrees), answered, sure (a confidence of at least 0.9), sure
    and wrong; the median error of the answers; in per cent of these, truths inside the 50, 90, 95 and 99.9 % regions of
    the covariance.
    """
    # Roll and pitch of the corner of a square lean by the square's half diagonal.
    lean_max_deg = prior_deg / float(np.sqrt(2.0))
    estimators = _estimators(float(np.deg2rad(prior_deg)))
    rows = []
    for number, panorama in enumerate(panoramas):
        seed = number + FRESH
        own = ahead_views(panorama, seed, lean_max_deg=lean_max_deg, samples=samples, noise_sigma=noise_sigma)
        rows += [_told(estimators[view.camera], view) for view in own]
        advance()
    return _shares(rows)


def any_lean_table(
    panoramas: Sequence[Panorama],
    *,
    samples: int = 2,
    noise_sigma: float = 2.0,
    advance: Callable[[], None] = lambda: None,
) -> pl.DataFrame:
    """As `prior_table`, of views rolled and pitched by up to 45 degrees, as held and turned upside down, where any lean
    is allowed, by the software's network. `opposite` are answers that take down for up.
    """
    estimators = _estimators(np.pi)
    rows = []
    for number, panorama in enumerate(panoramas):
        for view in ahead_views(panorama, number + FRESH, samples=samples, noise_sigma=noise_sigma):
            # All lenses are about the middle of the image.
            over = AheadView(view.camera, np.ascontiguousarray(view.image[::-1, ::-1]), view.up * [-1.0, -1.0, 1.0])
            for held, one in (("as held", view), ("upside down", over)):
                rows.append(_told(estimators[view.camera], one) | {"held": held})
        advance()
    return _shares(rows, "held", opposite=pl.col("error").fill_null(0.0) > 170.0)


def _estimators(tilt_max_rad: float) -> dict[str, TiltEstimator]:
    forward = np.array(read_rotation("forward"))
    return {
        name: TiltEstimator(camera, method="segments", robot_from_camera=forward, tilt_max_rad=tilt_max_rad)
        for name, camera in AHEAD_CAMERAS.items()
    }


def _told(estimator: TiltEstimator, view: AheadView) -> dict[str, Any]:
    """What an estimator makes of a view."""
    estimate, error, squared = estimator(view.image), None, None
    if estimate:
        off = offset_rad(estimate.normal, estimator.robot_from_camera @ view.up)
        error = float(np.rad2deg(np.linalg.norm(off)))
        squared = float(off @ np.linalg.solve(estimate.covariance_rad2, off))
    camera = view.camera.split()[0]
    return {"camera": camera, "error": error, "squared": squared, "sure": estimate.confidence >= 0.9}


def _shares(rows: Sequence[dict[str, Any]], *by: str, **more: pl.Expr) -> pl.DataFrame:
    """Shares of views in per cent, by the kind of camera and other columns."""
    error, squared = pl.col("error"), pl.col("squared")

    shares = {
        "right": error.fill_null(180.0) <= 2.0,
        "answered": error.is_not_null(),
        "sure": pl.col("sure"),
        "sure_wrong": pl.col("sure") & (error.fill_null(0.0) > 2.0),
    } | more
    return (
        pl.DataFrame(rows, schema_overrides={"error": pl.Float64, "squared": pl.Float64})
        .group_by("camera", *by, maintain_order=True)
        .agg(
            pl.len().alias("views"),
            *((100.0 * share.mean()).alias(name) for name, share in shares.items()),
            error.median().alias("median"),
            *((100.0 * (squared <= region_limit(p)).mean()).alias(f"inside_{100.0 * p:g}") for p in REGIONS),
        )
    )


def train_choice(views: Sequence[LearnedView]) -> Network:
    """What tells the right one by the features."""
    told = [view for view in views if len(view.ups) > 1 and view.errors_deg().min() <= RIGHT_DEG]
    choices = [(view.features, int(view.errors_deg().argmin())) for view in told]
    return train_network(choices, units=UNITS, decay=DECAY, line_alone=EXPECTED)


def ahead_table(views: Sequence[LearnedView], *, rng_seed: int = 0) -> pl.DataFrame:
    """Area under the recall curve up to 1, 5 and 10 degrees, for roll and pitch, by the kind of camera and of choice.

    "unseen buildings" chooses by a network that was trained without the building of the view, in five folds; "as
    shipped" by that in the software, which has seen all; "best" is the nearest hypothesis. `sure_wrong` is the share
    of all views whose error exceeds two degrees at a probability (as shipped: a confidence) of at least 0.9.
    """
    locations = np.random.default_rng(rng_seed).permutation(sorted({view.location for view in views}))
    fold = {location: k % FOLDS for k, location in enumerate(locations)}
    networks = [train_choice([view for view in views if fold[view.location] != k]) for k in range(FOLDS)]
    nothing = np.full(3, np.nan)

    def unseen(view: LearnedView) -> tuple[NDArray[np.float64], float]:
        if not len(view.ups):
            return nothing, 0.0
        shares = choice_shares(networks[fold[view.location]].log_odds(view.features))
        best = float(shares.max())
        return view.ups[shares.argmax()], best / (1.0 + NONE_ODDS * best)

    def best(view: LearnedView) -> tuple[NDArray[np.float64], float]:
        return (view.ups[view.errors_deg().argmin()], 0.0) if len(view.ups) else (nothing, 0.0)

    def shipped(view: LearnedView) -> tuple[NDArray[np.float64], float]:
        return (view.ups[0] if len(view.ups) else nothing), view.confidence

    rows = []
    for kind in ("pinhole", "fisheye"):
        own = [view for view in views if view.camera.startswith(kind)]
        truth = np.array([view.up for view in own])
        for name, choose in (("unseen buildings", unseen), ("as shipped", shipped), ("best", best)):
            picked = [choose(view) for view in own]
            ups, sure = np.array([up for up, _ in picked]), np.array([share >= 0.9 for _, share in picked])
            roll, pitch = (np.rad2deg(np.abs(a - b)) for a, b in zip(roll_pitch(ups), roll_pitch(truth), strict=True))
            roll = np.minimum(roll, 360.0 - roll)
            error = np.rad2deg(np.arccos(np.clip(np.sum(ups * truth, axis=1), -1.0, 1.0)))
            # A view without a hypothesis is off by more than any limit.
            roll, pitch, error = (np.nan_to_num(off, nan=np.inf) for off in (roll, pitch, error))
            row: dict[str, str | int | float | None] = {"camera": kind, "choice": name, "views": len(own)}
            for what, errors in (("roll", roll), ("pitch", pitch)):
                row |= {f"{what} {limit}": _area(errors, limit) for limit in (1, 5, 10)}
            answered = sum(view.estimate is not None for view in own) / len(own)
            row |= {
                "above 5 deg": 100.0 * float(np.mean(error > 5.0)),
                "sure": 100.0 * float(np.mean(sure)),
                "sure_wrong": 100.0 * float(np.mean(sure & (error > 2.0))),
                "answered": 100.0 * answered if name == "as shipped" else None,
            }
            rows.append(row)
    return pl.DataFrame(rows)


def _area(errors: NDArray[np.float64], limit: float) -> float:
    """Area under the share of errors below x, for x from 0 to a limit, in per cent of the whole."""
    return float(100.0 * np.mean(np.clip(1.0 - errors / limit, 0.0, 1.0)))
