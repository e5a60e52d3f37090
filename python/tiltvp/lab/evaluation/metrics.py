"""Errors of tilt estimates: the angle between normals, and what is left of it without a location's constant offset."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiltvp._core import leaning_from_upright

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["offset_rad", "relative_errors_rad", "turned"]


def offset_rad(estimated: ArrayLike, true: ArrayLike) -> NDArray[np.float64]:
    """(2,) error of an estimated ground normal in the upright robot's horizontal plane, in radians of angle.

    Its length is the error of eq. 44. Seen in the upright frame, an error of the reference is the same for all leans.
    For (N, 3) estimated normals, of one true normal (3,) or of one each (N, 3), the answer is (N, 2).
    """
    normals, truth = np.asarray(estimated, dtype=np.float64), np.asarray(true, dtype=np.float64)
    different, which = np.unique(truth.reshape(-1, 3), axis=0, return_inverse=True)
    rotations = np.stack([leaning_from_upright(normal) for normal in different])[which.ravel()]
    upright = np.einsum("...i,...ij->...j", normals, rotations.reshape(*truth.shape, 3))
    sine = np.hypot(upright[..., 0], upright[..., 1])
    angle = np.arctan2(sine, upright[..., 2])
    with np.errstate(invalid="ignore"):
        scale = np.where(sine > 0.0, angle / np.where(sine > 0.0, sine, 1.0), 0.0)
    return np.asarray(upright[..., :2] * scale[..., None])


def turned(offsets: NDArray[np.float64], yaw_rad: ArrayLike) -> NDArray[np.float64]:
    """(N, 2) offsets seen by a robot with that heading (or (N,) of them), as one with heading 0 sees them."""
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    x, y = offsets[..., 0], offsets[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


def relative_errors_rad(offsets: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) lengths of (N, 2) offsets of one location after their median, the error of the reference, is removed."""
    return np.asarray(np.linalg.norm(offsets - np.median(offsets, axis=0), axis=1))
