"""How unlike descriptors are by the measures that Scaramuzza et al. 2009, section 4, tried beside Euclid's."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.lines import descriptor_distances

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import NDArray

    Rows: TypeAlias = NDArray[np.float32]
    Matrix: TypeAlias = NDArray[np.float64]

__all__ = ["DISSIMILARITIES"]

_BINS: Final = 32
"""Bins of a histogram of the default descriptor, over the whole circle of orientations."""
_EMPTY: Final = 1e-12
"""Added to bins, of 1 in sum, that would be divided by."""


def _shares(rows: Rows) -> NDArray[np.float64]:
    """Descriptors as distributions: the sum of each is 1, or 0 for one without any gradient."""
    values = rows.astype(np.float64)
    return np.asarray(values / np.maximum(values.sum(axis=1, keepdims=True), _EMPTY), dtype=np.float64)


def _by_bins(pair: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]) -> Callable[..., Matrix]:
    """(N, M) of (N, K) and (M, K): the sum over bins of what `pair` makes of two of them, line by line of the first."""

    def measure(a: Rows, b: Rows) -> Matrix:
        first, second = _shares(a), _shares(b)
        rows = [pair(row, second).sum(axis=1) for row in first]
        return np.array(rows, dtype=np.float64).reshape(len(first), len(second))

    return measure


def _chi_square(h: NDArray[np.float64], k: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rubner et al. 2001, eq. 8: squared differences from the mean over the mean."""
    mean = 0.5 * (h + k)
    return np.asarray((h - mean) ** 2 / (mean + _EMPTY), dtype=np.float64)


def _jeffrey(h: NDArray[np.float64], k: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rubner et al. 2001, eq. 9: both relative entropies to the mean."""
    mean = np.log(0.5 * (h + k) + _EMPTY)
    return np.asarray(h * (np.log(h + _EMPTY) - mean) + k * (np.log(k + _EMPTY) - mean), dtype=np.float64)


def _bhattacharyya(a: Rows, b: Rows) -> Matrix:
    """The root of 1 minus the sum of the geometric means of bins."""
    common = np.sqrt(_shares(a)) @ np.sqrt(_shares(b)).T
    return np.asarray(np.sqrt(np.maximum(1.0 - common, 0.0)), dtype=np.float64)


def _quadratic_form(a: Rows, b: Rows) -> Matrix:
    """Rubner et al. 2001, eq. 12: bins of a histogram are alike if near in orientation, not at half a turn."""
    first, second = a.astype(np.float64), b.astype(np.float64)
    apart = np.abs(np.arange(_BINS)[:, None] - np.arange(_BINS))
    alike = 1.0 - np.minimum(apart, _BINS - apart) / (_BINS / 2)
    # The form is positive: its root turns the histograms, and Euclid measures the rest.
    values, vectors = np.linalg.eigh(alike)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    turned = [(rows.reshape(len(rows), -1, _BINS) @ root).reshape(len(rows), -1) for rows in (first, second)]
    return descriptor_distances(turned[0].astype(np.float32), turned[1].astype(np.float32))


DISSIMILARITIES: Final[dict[str, Callable[[Rows, Rows], Matrix]]] = {
    "descriptor": descriptor_distances,
    "descriptor, L1": _by_bins(lambda h, k: np.abs(h - k)),
    "descriptor, chi-square": _by_bins(_chi_square),
    "descriptor, Jeffrey divergence": _by_bins(_jeffrey),
    "descriptor, Bhattacharyya": _bhattacharyya,
    "descriptor, histogram intersection": _by_bins(lambda h, k: -np.minimum(h, k)),
    "descriptor, quadratic form": _quadratic_form,
}
"""(N, M) of descriptors (N, K) and (M, K) of the default options; less is more alike. The first is Euclid's."""
