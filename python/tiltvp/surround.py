"""The dark surround of a lens' image circle, found in images where nothing else says where it ends."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.images import camera_grays, checked_camera
from tiltvp.rim import circle_through

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera

__all__ = ["surround_mask"]

_PATCH: Final = 0.03
"""Side of the corners that are looked at, as a share of the image's shorter side."""
_DARKEST: Final = 45.0
"""Grey level that a surround has at most: of the real photographs with one, the lightest is at 30."""
_ABOVE: Final = 8.0
"""Grey levels by which the surround may vary."""
_ROUND: Final = 0.02
"""Share of the radius by which the rim may stray from a circle."""
_INSIDE: Final = 0.03
"""Share of the radius that is left out within the circle, where lenses darken."""
_KNOWN: Final = 0.03
"""Share of the circle's area that the calibration may see beyond it and yet know the rim: centres that are off by four
pixels in a hundred of radius. Formulas that end somewhere in the corners do not know it."""


def surround_mask(images: Iterable[ArrayLike], camera: Camera) -> NDArray[np.bool_] | None:
    """(H, W), True within the image circle; None without a dark surround, and where the camera knows its rim.

    At least three corners are dark in every image, and what is not dark has a round rim. Five images of different
    places tell a surround from shadows. Raises `InvalidInputError` for what is no image or camera.
    """
    import cv2

    checked_camera(camera)
    lightest: NDArray[np.uint8] | None = None
    for image in camera_grays(images, camera):
        gray = np.asarray(cv2.medianBlur(image, 5), dtype=np.uint8)
        lightest = gray if lightest is None else np.maximum(lightest, gray)
    if lightest is None:
        return None
    side = max(3, round(_PATCH * min(lightest.shape)))
    corners = [
        lightest[rows, columns]
        for rows in (slice(side), slice(-side, None))
        for columns in (slice(side), slice(-side, None))
    ]
    levels = np.sort([np.percentile(corner, 90) for corner in corners])
    if levels[2] > _DARKEST:
        return None
    seen = np.asarray(lightest > levels[2] + _ABOVE, dtype=np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(seen)
    if count < 2:
        return None
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    outline, _ = cv2.findContours(
        np.asarray(labels == largest, dtype=np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    rim = cv2.convexHull(max(outline, key=len))[:, 0].astype(np.float64)
    border = np.array([camera.width, camera.height]) - 2.0
    rim = rim[((rim > 1.0) & (rim < border)).all(axis=1)]
    circle = _circle(rim)
    if circle is None:
        return None
    centre, radius = circle
    v, u = np.indices(lightest.shape)
    away = np.hypot(u - centre[0], v - centre[1])
    beyond = np.count_nonzero(camera.valid_mask() & (away > (1.0 + _ROUND) * radius))
    return away <= (1.0 - _INSIDE) * radius if beyond > _KNOWN * np.count_nonzero(away <= radius) else None


def _circle(rim: NDArray[np.float64]) -> tuple[NDArray[np.float64], float] | None:
    """Centre and radius of the circle through points (N, 2), if they lie on one and on half of it at least."""
    if len(rim) < 12:
        return None
    centre, radius = circle_through(rim)
    away = rim - centre
    sectors = np.unique(np.floor(np.arctan2(away[:, 1], away[:, 0]) * 6.0 / np.pi))
    strays = float(np.sqrt(np.mean((np.linalg.norm(away, axis=1) - radius) ** 2)))
    return (centre, radius) if strays <= _ROUND * radius and len(sectors) >= 6 else None
