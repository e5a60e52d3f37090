"""Marks on images: the horizon and the vertical vanishing points, leaning and upright, and a line of words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiltvp.images import gray_from
from tiltvp.overlays.edges import draw_edges

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera, EdgeElements, TiltEstimate
    from tiltvp.tilt import TiltEstimator

    Picture = NDArray[np.uint8]
    Colour = tuple[int, int, int]

__all__ = ["draw_tilt", "draw_words", "tilt_overlay"]

ESTIMATED: Colour = (80, 220, 255)
UPRIGHT: Colour = (150, 150, 150)
_HORIZON_POINTS = 1440


def tilt_overlay(
    image: ArrayLike, estimator: TiltEstimator, estimate: TiltEstimate, edges: EdgeElements, words: str = ""
) -> Picture:
    """The image in dimmed grey, (H, W, 3) BGR uint8, with inlier edges in colour, horizons, zenith, nadir and `words`.

    Camera and mounting are those of the `estimator`. Yellow are the horizon and the vertical vanishing points of the
    estimate, grey those of an upright robot.
    """
    gray, camera, mounting = gray_from(image), estimator.camera, estimator.robot_from_camera
    inlier_offsets = np.abs(edges.offset_px[edges.inlier])
    largest = float(np.nanmax(inlier_offsets)) if np.isfinite(inlier_offsets).any() else 0.0
    dimmed = np.asarray(gray * 0.6, dtype=np.uint8)
    picture = draw_edges(dimmed, edges, offset_max_px=max(40.0, 1.5 * largest), only="inlier")
    picture = draw_tilt(picture, camera, (0.0, 0.0, 1.0), mounting, colour=UPRIGHT)
    if estimate:
        picture = draw_tilt(picture, camera, estimate.normal, mounting, colour=ESTIMATED)
    return draw_words(picture, words) if words else picture


def draw_tilt(
    picture: Picture,
    camera: Camera,
    normal: ArrayLike,
    robot_from_camera: ArrayLike,
    *,
    colour: Colour = ESTIMATED,
) -> Picture:
    """A copy with the horizon of a ground normal (3,) of the robot frame as a curve, zenith and nadir as rings."""
    import cv2

    canvas = picture.copy()
    up = np.asarray(robot_from_camera, dtype=np.float64).T @ np.asarray(normal, dtype=np.float64)
    scale = max(1, round(min(canvas.shape[:2]) / 480))
    for place in camera.project(np.stack([up, -up])):
        if _inside(canvas, place):
            cv2.circle(canvas, _whole(place), 6 * scale, colour, scale, cv2.LINE_AA)
            cv2.circle(canvas, _whole(place), scale, colour, -1, cv2.LINE_AA)
    for part in _horizon(camera, up):
        cv2.polylines(canvas, [part], False, colour, scale, cv2.LINE_AA)
    return canvas


def draw_words(picture: Picture, words: str) -> Picture:
    """A copy with one line of words in the upper left corner, white with a black rim, as large as fits."""
    import cv2

    canvas = picture.copy()
    height, width = canvas.shape[:2]
    space = max(2, round(0.012 * width))
    ink = _ink(words)
    scale = min(height / 38.0 / ink.shape[0], (width - 2.0 * space) / ink.shape[1], height / 2.0 / ink.shape[0])
    if min(scale * ink.shape[0], scale * ink.shape[1]) < 1.0:
        return canvas
    ink = np.asarray(cv2.resize(ink, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    ink = np.pad(ink, 2)[: height - space, : width - space]
    rim = np.asarray(cv2.dilate(ink, np.ones((5, 5), dtype=np.uint8)), dtype=np.float64)[:, :, None] / 255.0
    part = canvas[space : space + ink.shape[0], space : space + ink.shape[1]]
    part[:] = np.maximum((1.0 - rim) * part, ink[:, :, None]).astype(np.uint8)
    return canvas


def _ink(words: str) -> Picture:
    """The words, white on black, cut to what they cover; large, so that they can be made smaller."""
    import cv2

    strip = np.zeros((120, 80 * (len(words) + 2)), dtype=np.uint8)
    cv2.putText(strip, words, (40, 80), cv2.FONT_HERSHEY_SIMPLEX, 2.0, 255, 3, cv2.LINE_AA)
    rows, columns = np.flatnonzero(strip.any(axis=1)), np.flatnonzero(strip.any(axis=0))
    return strip[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] if rows.size else strip


def _horizon(camera: Camera, up: NDArray[np.float64]) -> list[NDArray[np.int32]]:
    """Pixels along the parts in the image of the curve on which bearings are orthogonal to `up`; jumps (panoramas)
    are left out."""
    helper = np.eye(3)[int(np.argmin(np.abs(up)))]
    first = np.cross(up, helper)
    first /= np.linalg.norm(first)
    turn = np.linspace(0.0, 2.0 * np.pi, _HORIZON_POINTS + 1)[:, None]
    places: NDArray[np.float64] = camera.project(np.cos(turn) * first + np.sin(turn) * np.cross(up, first))
    seen = np.all((places > -1.0) & (places < [camera.width, camera.height]), axis=1)
    places[~seen] = 0.0
    jumps = np.abs(np.diff(places, axis=0)).max(axis=1) >= 0.1 * max(camera.width, camera.height)
    parts = np.split(np.rint(places).astype(np.int32), np.flatnonzero(jumps | ~seen[:-1] | ~seen[1:]) + 1)
    return [part for part in parts if len(part) > 1]


def _inside(picture: Picture, place: NDArray[np.float64]) -> bool:
    height, width = picture.shape[:2]
    return bool(np.isfinite(place).all() and -1.0 < place[0] < width and -1.0 < place[1] < height)


def _whole(place: NDArray[np.float64]) -> tuple[int, int]:
    return round(float(place[0])), round(float(place[1]))
