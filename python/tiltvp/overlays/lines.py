"""Vertical lines drawn over their image, each over the elevations at which it was seen."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tiltvp._core import leaning_from_upright
from tiltvp.errors import InvalidInputError
from tiltvp.images import gray_from

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera, Lines

__all__ = ["curves", "draw_lines", "line_pixels", "track_colour"]

_POINTS = 32


def line_pixels(camera: Camera, lines: Lines, robot_from_camera: ArrayLike | None = None) -> NDArray[np.float64]:
    """(N, 32, 2): pixels (u, v) along each line from its lower to its upper end; NaN where the camera sees none.

    Raises `InvalidInputError` for another camera or mounting than that which found the lines.
    """
    lines._check_seen_by(camera, robot_from_camera)
    turn = np.eye(3) if robot_from_camera is None else np.asarray(robot_from_camera, dtype=np.float64)
    camera_from_upright = turn.T @ leaning_from_upright(lines.normal)
    share = np.linspace(0.0, 1.0, _POINTS)
    low, high = lines.elevation_min_rad[:, None], lines.elevation_max_rad[:, None]
    elevation = low + (high - low) * share
    azimuth = lines.bearing_rad[:, None] + 0.0 * elevation
    bearings = np.stack(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=-1
    )
    pixels: NDArray[np.float64] = camera.project((bearings @ camera_from_upright.T).reshape(-1, 3))
    return pixels.reshape(len(lines), _POINTS, 2)


def draw_lines(
    image: ArrayLike,
    camera: Camera,
    lines: Lines,
    robot_from_camera: ArrayLike | None = None,
    *,
    tracks: Sequence[int] | None = None,
    labels: bool = True,
) -> NDArray[np.uint8]:
    """The image in dimmed grey, (H, W, 3) BGR uint8, with each line in a colour of its own.

    Lines that cross the seam of a panorama are drawn on both sides of it.
    `tracks` (N,) are the identities that colours and labels follow; without them they are the places among the lines.
    """
    import cv2

    gray = gray_from(image)
    if gray.shape != (camera.height, camera.width):
        raise InvalidInputError(f"image: shape {gray.shape}, expected ({camera.height}, {camera.width})")
    names = range(len(lines)) if tracks is None else [int(track) for track in tracks]
    if len(names) != len(lines):
        raise InvalidInputError(f"tracks: {len(names)} values, expected {len(lines)}, one for each line")
    canvas = np.asarray(cv2.cvtColor((gray * 0.7).astype(np.uint8), cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    scale = max(1, round(min(canvas.shape[:2]) / 480))
    for name, pixels in zip(names, line_pixels(camera, lines, robot_from_camera), strict=True):
        seen = pixels[np.isfinite(pixels).all(axis=1)]
        if not len(seen):
            continue
        colour = track_colour(name)
        cv2.polylines(canvas, curves(camera, seen), False, colour, scale, cv2.LINE_AA, shift=4)
        if labels:
            place = (round(float(seen[-1, 0])), round(float(seen[-1, 1])))
            cv2.putText(canvas, str(name), place, cv2.FONT_HERSHEY_SIMPLEX, 0.35 * scale, colour, scale, cv2.LINE_AA)
    return canvas


def curves(camera: Camera, seen: NDArray[np.float64]) -> list[NDArray[np.int32]]:
    """What `cv2.polylines` draws with shift=4 along pixels (N, 2) of an edge: its parts beside a panorama's seam."""
    # A step of half the image is a seam and no edge.
    seams = np.flatnonzero(np.abs(np.diff(seen[:, 0])) > 0.5 * camera.width) + 1
    return [np.rint(part * 16.0).astype(np.int32).reshape(-1, 1, 2) for part in np.split(seen, seams)]


def track_colour(name: int) -> tuple[int, int, int]:
    """A bright colour (blue, green, red), far from those of neighbouring numbers."""
    red, green, blue = colorsys.hsv_to_rgb((name * 0.618034) % 1.0, 0.75, 1.0)
    return round(255 * blue), round(255 * green), round(255 * red)
