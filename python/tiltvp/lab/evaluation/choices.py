"""How it is learned which of several things is the right one: a conditional logit (McFadden 1974)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["choice_shares", "train_weights"]


def choice_shares(log_odds: NDArray[np.float64]) -> NDArray[np.float64]:
    """(K,): how probable each is."""
    odds = np.exp(log_odds - log_odds.max())
    return np.asarray(odds / odds.sum())


def train_weights(told: Sequence[tuple[NDArray[np.float64], int]], penalty: float) -> NDArray[np.float64]:
    """(F,): weights of the features from choices with features (K, F) and the number of the right one.

    By Newton's method; `penalty` is of the squared weights of features that are scaled to a standard deviation of one.
    """
    scale = np.std(np.concatenate([features for features, _ in told]), axis=0) + 1e-9
    weights = np.zeros(len(scale))
    for _ in range(60):
        gradient, curvature = -penalty * weights, penalty * np.eye(len(weights))
        for features, right in told:
            scaled = features / scale
            shares = choice_shares(scaled @ weights)
            away = scaled - shares @ scaled
            gradient += away[right]
            curvature += (away * shares[:, None]).T @ away
        step = np.linalg.solve(curvature, gradient)
        weights += step
        if np.linalg.norm(step) < 1e-6:
            break
    return np.asarray(weights / scale)
