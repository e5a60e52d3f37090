"""Straight edges drawn over their image, each as the arc of its great circle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiltvp._core import Segments
from tiltvp.arguments import refuse_unless
from tiltvp.errors import InvalidInputError
from tiltvp.images import checked_camera, gray_from
from tiltvp.overlays.lines import curves, track_colour

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera

__all__ = ["draw_segments", "segment_pixels"]

_POINTS = 24


def segment_pixels(camera: Camera, segments: Segments) -> NDArray[np.float64]:
    """(N, 24, 2): pixels (u, v) along each arc from its first to its second end; NaN where the camera sees none."""
    middle = segments.middle
    along = np.cross(segments.normal, middle)
    first, last = (
        np.arctan2(np.sum(end * along, axis=1), np.sum(end * middle, axis=1))
        for end in (segments.ends[:, 0], segments.ends[:, 1])
    )
    angle = first[:, None] + (last - first)[:, None] * np.linspace(0.0, 1.0, _POINTS)
    bearings = np.cos(angle)[..., None] * middle[:, None] + np.sin(angle)[..., None] * along[:, None]
    pixels: NDArray[np.float64] = camera.project(bearings.reshape(-1, 3))
    return pixels.reshape(len(segments), _POINTS, 2)


def draw_segments(image: ArrayLike, camera: Camera, segments: Segments) -> NDArray[np.uint8]:
    """The image in dimmed grey, (H, W, 3) BGR uint8, with the arc of each segment in a colour of its own.

    Arcs that cross the seam of a panorama are drawn on both sides of it.
    """
    import cv2

    checked_camera(camera)
    refuse_unless(segments, Segments, "segments", "Segments")
    gray = gray_from(image)
    if gray.shape != (camera.height, camera.width):
        raise InvalidInputError(f"image: shape {gray.shape}, expected ({camera.height}, {camera.width})")
    canvas = np.asarray(cv2.cvtColor((gray * 0.6).astype(np.uint8), cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    scale = max(1, round(min(canvas.shape[:2]) / 480))
    for i, pixels in enumerate(segment_pixels(camera, segments)):
        seen = pixels[np.isfinite(pixels).all(axis=1)]
        if len(seen) < 2:
            continue
        cv2.polylines(canvas, curves(camera, seen), False, track_colour(i), scale, cv2.LINE_AA, shift=4)
    return canvas
