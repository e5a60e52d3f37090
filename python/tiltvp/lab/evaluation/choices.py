"""How it is learned which of several things is right: a conditional logit (McFadden 1974) of a network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Network", "choice_shares", "train_network"]

STEPS: Final = 400
RATE: Final = 0.01
"""Steps of Adam and their size: 1500 steps lead to the same within half a per cent."""
FARTHEST: Final = 4.0
"""Standard deviations beyond which a feature tells no more, as in `choice.rs`."""


def choice_shares(log_odds: NDArray[np.float64]) -> NDArray[np.float64]:
    """(K,): how probable each is."""
    odds = np.exp(log_odds - log_odds.max())
    return np.asarray(odds / odds.sum())


_HEAD: Final = """//! The weights of the network in `choice.rs`: `tiltvp measure views --weights` prints this file.

#![allow(clippy::unreadable_literal)]

use super::hypothesis::FEATURES;

/// Hidden units.
"""


_PYTHON_HEAD: Final = '''"""The network of `setup_check`, as `tiltvp measure trust --weights` prints it.

A row of HIDDEN is of a hidden unit.
"""

# ruff: noqa: E501
# fmt: off

from __future__ import annotations

from typing import Final

import numpy as np
'''


@dataclass(frozen=True)
class Network:
    """Log-odds of features: a line, and a layer of hidden units (H) over all features but those of the line alone.
    Features are less `means` over `scales`, clipped at `FARTHEST` where they are hidden units'."""

    means: NDArray[np.float64]
    scales: NDArray[np.float64]
    linear: NDArray[np.float64]
    biases: NDArray[np.float64]
    out: NDArray[np.float64]
    hidden: NDArray[np.float64]
    line_alone: tuple[int, ...] = ()

    def log_odds(self, features: NDArray[np.float64]) -> NDArray[np.float64]:
        """(K,): of the features (K, F)."""
        scaled = _scaled(features, self.means, self.scales, self.line_alone)
        return np.asarray(scaled @ self.linear + np.tanh(scaled @ self.hidden.T + self.biases) @ self.out)

    def rust(self) -> str:
        """The text of `choice_weights.rs`."""
        docs = (
            "Means of the features.",
            "Their standard deviations.",
            "Weights of the line.",
            "Constants of the hidden units.",
        )
        values = (self.means, self.scales, self.linear, self.biases, self.out)
        names = ("MEANS", "SCALES", "LINEAR", "BIASES", "OUT")
        sizes = ("FEATURES", "FEATURES", "FEATURES", "UNITS", "UNITS")
        what = (*docs, "How much each counts.")
        lines = [
            f"/// {doc}\npub(super) static {name}: [f64; {size}] = [{_literals(own)}];"
            for doc, name, size, own in zip(what, names, sizes, values, strict=True)
        ]
        rows = ", ".join(f"[{_literals(row)}]" for row in self.hidden)
        lines.append(
            f"/// Weights of each hidden unit.\npub(super) static HIDDEN: [[f64; FEATURES]; UNITS] = [{rows}];"
        )
        return "\n".join([f"{_HEAD}const UNITS: usize = {len(self.out)};\n", *lines])

    def python(self) -> str:
        """The text of `setup_weights.py`: of a network without a line."""
        rows = ",\n".join(f"    [{_literals(row)}]" for row in self.hidden)
        names = ("MEANS", "SCALES", "BIASES", "OUT")
        values = (self.means, self.scales, self.biases, self.out)
        lines = [f"{name}: Final = np.array([{_literals(own)}])" for name, own in zip(names, values, strict=True)]
        return "\n".join([_PYTHON_HEAD, *lines, f"HIDDEN: Final = np.array([\n{rows},\n])"])


def train_network(
    told: Sequence[tuple[NDArray[np.float64], int]],
    *,
    units: int,
    decay: float,
    line_alone: tuple[int, ...] | None,
) -> Network:
    """A network that makes the right ones of choices with features (K, F) likeliest. Same choices, same network.

    `decay` is of half the squared weights, beside the mean log-loss; the features `line_alone` go past the hidden
    units, and without it there is no line.
    """
    rows = np.concatenate([features for features, _ in told])
    means, scales = rows.mean(axis=0), rows.std(axis=0) + 1e-9
    scaled = _scaled(rows, means, scales, line_alone or ())
    sizes = np.array([len(features) for features, _ in told])
    starts = np.cumsum(sizes) - sizes
    choice = np.repeat(np.arange(len(told)), sizes)
    right = starts + np.array([number for _, number in told])
    rng, count = np.random.default_rng(0), rows.shape[1]
    hidden = rng.normal(0.0, count**-0.5, (units, count))
    past = list(line_alone or ())
    hidden[:, past] = 0.0
    values = [np.zeros(count), np.zeros(units), rng.normal(0.0, 0.3 * units**-0.5, units), hidden]
    moments = [np.zeros_like(value) for value in values]
    squares = [np.zeros_like(value) for value in values]
    for step in range(1, STEPS + 1):
        linear, biases, out, hidden = values
        seen = np.tanh(scaled @ hidden.T + biases)
        log_odds = scaled @ linear + seen @ out
        odds = np.exp(log_odds - np.maximum.reduceat(log_odds, starts)[choice])
        off = odds / np.add.reduceat(odds, starts)[choice]
        off[right] -= 1.0
        off /= len(told)
        back = np.outer(off, out) * (1.0 - seen**2)
        gradients = [off @ scaled, back.sum(axis=0), off @ seen, back.T @ scaled]
        gradients[3][:, past] = 0.0
        if line_alone is None:
            gradients[0][:] = 0.0
        # Adam (Kingma and Ba 2015).
        for i, (value, gradient) in enumerate(zip(values, gradients, strict=True)):
            pull = gradient if value is biases else gradient + decay * value
            moments[i] = 0.9 * moments[i] + 0.1 * pull
            squares[i] = 0.999 * squares[i] + 0.001 * pull**2
            size = np.sqrt(squares[i] / (1.0 - 0.999**step)) + 1e-8
            values[i] = value - RATE * moments[i] / (1.0 - 0.9**step) / size
    linear, biases, out, hidden = values
    return Network(means, scales, linear, biases, out, hidden, line_alone or ())


def _scaled(
    features: NDArray[np.float64], means: NDArray[np.float64], scales: NDArray[np.float64], line_alone: tuple[int, ...]
) -> NDArray[np.float64]:
    scaled = (features - means) / scales
    told = np.delete(np.arange(scaled.shape[1]), line_alone)
    scaled[:, told] = np.clip(scaled[:, told], -FARTHEST, FARTHEST)
    return scaled


def _literals(values: NDArray[np.float64]) -> str:
    return ", ".join(repr(float(f"{value:.4g}")) for value in values)
