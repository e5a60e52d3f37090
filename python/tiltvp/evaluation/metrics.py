"""Errors of tilt estimates: the angle between normals, and what is left of it without a location's constant offset."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiltvp._core import leaning_from_upright

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["offset_rad", "relative_errors_rad"]


def offset_rad(estimated: ArrayLike, true: ArrayLike) -> NDArray[np.float64]:
    """(2,) error of an estimated ground normal in the upright robot's horizontal plane, in radians of angle.

    Its length is the error of eq. 44. Seen in the upright frame, an error of the reference is the same for all leans.
    """
    upright = leaning_from_upright(true).T @ np.asarray(estimated, dtype=np.float64)
    sine = float(np.hypot(upright[0], upright[1]))
    angle = float(np.arctan2(sine, upright[2]))
    return upright[:2] * (angle / sine) if sine > 0.0 else np.zeros(2)


def relative_errors_rad(offsets: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) lengths of (N, 2) offsets of one location after their median, the error of the reference, is removed."""
    return np.asarray(np.linalg.norm(offsets - np.median(offsets, axis=0), axis=1))
