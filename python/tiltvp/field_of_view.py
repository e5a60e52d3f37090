"""How much a camera sees: angles across the image, and which pixels see anything."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tiltvp.arguments import refuse_unless
from tiltvp.images import checked_camera

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.cameras import Camera

__all__ = ["FieldOfView", "field_of_view", "looks_like_a_mirror"]

_SAMPLES = 2048
_MIRROR_RAD = math.radians(205.0)
"""Of 40 published calibrations those of mirrors see 210 to 281 degrees all round, those of fisheyes up to 190 but for a
few of 220 degrees, which are named too."""


@dataclass(frozen=True)
class FieldOfView:
    """Full angles through the axis in radians (beyond pi where the lens sees behind itself), and the valid pixels.

    Where the axis is outside the image, as in a part of one, angles are those through the image's middle. `axis_px` is
    the pixel (u, v) of the optical axis, `valid_radius_px` the distance from it to the farthest pixel that has a
    bearing, `valid_share` the share of pixels that have one; of images larger than 2048 pixels a grid of at most 2048 x
    2048 pixels is looked at.
    """

    horizontal_rad: float
    vertical_rad: float
    diagonal_rad: float
    axis_px: tuple[float, float]
    valid_radius_px: float
    valid_share: float


def field_of_view(camera: Camera) -> FieldOfView:
    """Measures a camera along row, column and diagonals through its axis or middle, as far as pixels have bearings."""
    checked_camera(camera)
    ahead = np.array([0.0, 0.0, -1.0 if camera.mirror else 1.0])
    axis = np.asarray(camera.project(ahead), dtype=np.float64)
    last = np.array([camera.width - 1.0, camera.height - 1.0])
    middle = axis
    if not (np.isfinite(axis).all() and (axis >= -0.5).all() and (axis <= last + 0.5).all()):
        middle = last / 2.0
        ahead = np.asarray(camera.unproject(middle), dtype=np.float64)
        axis = axis if np.isfinite(axis).all() else middle

    def angles(border: NDArray[np.float64], steps: NDArray[np.float64]) -> NDArray[np.float64]:
        bearings: NDArray[np.float64] = camera.unproject(middle + steps[:, None] * (border - middle))
        return np.asarray(np.arctan2(np.linalg.norm(np.cross(bearings, ahead), axis=1), bearings @ ahead))

    def reach(u: float, v: float) -> float:
        """The largest angle from the axis, or from the middle, on the way to a pixel of the border."""
        border, steps = np.array([u, v]), np.linspace(0.0, 1.0, _SAMPLES)
        seen = np.flatnonzero(np.isfinite(angles(border, steps)))
        if not seen.size:
            return 0.0
        last_seen = int(seen[-1])
        beyond = np.linspace(steps[last_seen], steps[min(last_seen + 1, _SAMPLES - 1)], _SAMPLES)
        return float(np.nanmax(angles(border, beyond)))

    (u, v), (right, bottom) = middle, last
    step = -(-max(camera.width, camera.height) // _SAMPLES)
    columns, rows = np.arange(0, camera.width, step), np.arange(0, camera.height, step)
    farthest, seen = 0.0, 0
    for row in rows:
        pixels = np.column_stack([columns, np.full(len(columns), row)])
        within = columns[np.isfinite(camera.unproject(pixels)[:, 0])]
        seen += within.size
        # The farthest pixel of a row is its first or its last.
        ends = within[[0, -1][: within.size]]
        farthest = max([farthest, *(math.hypot(column - axis[0], row - axis[1]) for column in ends)])
    return FieldOfView(
        horizontal_rad=reach(0.0, v) + reach(right, v),
        vertical_rad=reach(u, 0.0) + reach(u, bottom),
        diagonal_rad=max(reach(0.0, 0.0) + reach(right, bottom), reach(right, 0.0) + reach(0.0, bottom)),
        axis_px=(float(axis[0]), float(axis[1])),
        valid_radius_px=farthest,
        valid_share=seen / (len(rows) * len(columns)),
    )


def looks_like_a_mirror(camera: Camera, view: FieldOfView) -> bool:
    """Whether a camera that is not said to look into a mirror sees as far behind itself as mirrors do and few lenses.

    Only lens models that mirrors are calibrated with are looked at: `ocam`, whose a0 is then short beside the radius of
    the image, and `unified` with a xi of at most 1: mirrors have no more (Geyer and Daniilidis 2000).
    """
    checked_camera(camera)
    refuse_unless(view, FieldOfView, "view", "what field_of_view measures of the camera")
    all_round = min(view.horizontal_rad, view.vertical_rad) > _MIRROR_RAD
    xi = camera.parameters.get("xi", 0.0)
    of_mirrors = camera.model == "ocam" or (camera.model == "unified" and isinstance(xi, float) and xi <= 1.0)
    return of_mirrors and not camera.mirror and all_round
