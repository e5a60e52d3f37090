"""Corners drawn over their image: rays, vertices and imaginary boxes (Liu et al. 2018, fig. 1c)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from tiltvp.images import gray_from

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import BelievedCorner, Camera, CornerFeature

__all__ = ["draw_box", "draw_corners", "draw_names"]

EDGE_COLOURS = ((60, 60, 255), (80, 220, 80), (255, 140, 60))
"""BGR of the edges x, y, z."""
_BOX = (170, 170, 170)
_POINTS = 24
_TEXT = 0.6
"""Size of names: 13 pixels, that of the vertices' circles."""
_LENGTH = 0.15
"""Length of the box's edges where nothing is known of its distance, as a share of it."""


def draw_corners(
    image: ArrayLike, camera: Camera, features: Sequence[CornerFeature], chosen: Iterable[int] = ()
) -> NDArray[np.uint8]:
    """The image in dimmed grey, (H, W, 3) BGR uint8, with the rays x red, y green, z blue, without edges that
    are not seen; those not `chosen` are thin.
    """
    import cv2

    gray = gray_from(image)
    canvas = np.asarray(cv2.cvtColor((gray * 0.75).astype(np.uint8), cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    wanted = set(chosen)
    order = sorted(range(len(features)), key=lambda place: place in wanted)
    for place in order:
        feature, width = features[place], 2 if place in wanted else 1
        for toward, colour, support in zip(feature.toward, EDGE_COLOURS, feature.support_px, strict=True):
            if support == 0:
                continue
            share = np.linspace(0.0, 1.0, _POINTS)[:, None]
            _curve(canvas, camera, feature.vertex * (1.0 - share) + toward * share, colour, width)
        at = _whole(camera.project(feature.vertex))
        if at is not None:
            cv2.circle(canvas, at, 6 if width == 2 else 3, (255, 255, 255), 1, cv2.LINE_AA)
    return canvas


def draw_box(
    canvas: NDArray[np.uint8], camera: Camera, vertex: ArrayLike, edges: ArrayLike, length: ArrayLike | None = None
) -> None:
    """Draws the imaginary box into a picture: edges of equal `length`, or of one each, along the rows of `edges`.

    `vertex` (3,) is the vertex in the camera's frame, metres, or its bearing; the default length is a share of its
    distance. The three edges from the vertex are coloured, the others grey. A length that is NaN is 0.
    """
    origin = np.asarray(vertex, dtype=np.float64)
    lengths = np.nan_to_num(np.asarray(_LENGTH * np.linalg.norm(origin) if length is None else length))
    axes = np.asarray(edges, dtype=np.float64) * np.broadcast_to(lengths, 3)[:, None]
    share = np.linspace(0.0, 1.0, _POINTS)[:, None]
    for k, axis in enumerate(axes):
        others = [axes[j] for j in range(3) if j != k]
        for start in (others[0], others[1], others[0] + others[1]):
            _curve(canvas, camera, origin + start + axis * share, _BOX, 1)
    for axis, colour in zip(axes, EDGE_COLOURS, strict=True):
        _curve(canvas, camera, origin + axis * share, colour, 2)


def draw_names(
    canvas: NDArray[np.uint8], camera: Camera, features: Sequence[CornerFeature], corners: Iterable[BelievedCorner]
) -> None:
    """Writes the names of corners into a picture (H, W, 3) of the left image, beside their vertices; those without one
    have none.
    """
    import cv2

    for corner in corners:
        at = _whole(camera.project(features[corner.left].vertex))
        if at is not None and corner.id is not None:
            place = (at[0] + 9, at[1] - 9)
            # Dark around light, for any ground.
            for colour, width in (((0, 0, 0), 4), ((255, 255, 255), 1)):
                cv2.putText(canvas, str(corner.id), place, cv2.FONT_HERSHEY_SIMPLEX, _TEXT, colour, width, cv2.LINE_AA)


def _curve(
    canvas: NDArray[np.uint8], camera: Camera, points: NDArray[np.float64], colour: tuple[int, int, int], width: int
) -> None:
    import cv2

    pixels = camera.project(points)
    for a, b in pairwise(pixels):
        start, end = _whole(a), _whole(b)
        if start is not None and end is not None:
            cv2.line(canvas, start, end, colour, width, cv2.LINE_AA)


def _whole(place: NDArray[np.float64]) -> tuple[int, int] | None:
    if not np.isfinite(place).all() or np.abs(place).max() > 1e5:
        return None
    return round(float(place[0])), round(float(place[1]))
