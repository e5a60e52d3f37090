"""The circle of a mirror's or a lens' rim in one image: the first step of Scaramuzza, Siegwart and Martinelli 2009."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.errors import InvalidInputError
from tiltvp.images import gray_from

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["RimCircle", "circle_through", "rim_circle"]

_SECTORS: Final = 64
"""Directions from the centre in which the circle is looked for."""
_COVERED: Final = 0.8
"""Share of its directions that a circle must cover beyond chance. Of 50 photographs by mirrors and fisheyes 23 have
0.81 or more, all of them right, wrong ones 0.75 at most; parts of panoramas, without a rim, 0.34, noise 0.63."""
_CHANCE: Final = 0.5
"""Share of directions that chance may cover at most: beyond, a few directions would decide. About rims that are found
it is 0.17 at most, of noise in 640 x 480 pixels 0.9."""
_BESIDE_PX: Final = (-12.0, -8.0, 8.0, 12.0)
"""Where circles lie beside it whose coverage is what chance makes."""
_WITHIN: Final = 0.55
"""Share of its directions in which a circle must lie within the image."""
_OUTERMOST: Final = 0.85
"""Share of the best circle's coverage at which a larger one about the same centre is the rim: mirrors reflect
round things."""
_REACH: Final = 0.15
"""How far the centre may lie from the image's, as a share of its shorter side; of the photographs 0.04 at most."""
_RADII: Final = (0.2, 0.62)
"""Radii that are looked for, as shares of the shorter side: up to circles that all four sides cut, almost."""
_RADIAL: Final = float(np.cos(np.radians(15.0)))
"""How far gradients may turn from the direction to the centre: the paper's 5 degrees, and the first look's offset."""
_STEEP: Final = 5.0
"""Grey levels a pixel that an edge has at least: the rim of the darkest photographs has 10."""
_SIDE: Final = 480
"""Pixels of the shorter side to which larger images are shrunk: rims are soft."""
_COARSE: Final = 80
"""Steps in the shorter side by which centres and radii are looked for first."""
_MOST: Final = 20_000
"""Edge pixels that the first look takes, spread evenly: the rim has a hundred or more of them."""
_NEAR_PX: Final = 2.0
"""How far a pixel of the rim may lie from the circle: edges blur over as much."""


@dataclass(frozen=True)
class RimCircle:
    """The circle of the rim in an image, in pixels."""

    centre_px: tuple[float, float]
    """u and v of its centre."""
    radius_px: float
    covered: float
    """Share of its directions within the image in which it has an edge, beyond what those beside it have: 0.8 to 1."""


def rim_circle(image: ArrayLike) -> RimCircle | None:
    """The outermost circle on which an image gets darker outwards; None where no circle is seen well enough.

    `image` is of any usual kind. The circle's centre lies near the image's middle, its radius is a fifth of the shorter
    side to where nearly all of it is outside; more than half of it must be in the image. For `rim_radius_px` of the
    lines' method "radial", which then follows its centre from frame to frame, and for `Camera.from_view`. It takes
    about half a second. Raises `InvalidInputError` for what is no image.
    """
    import cv2

    gray = gray_from(image)
    if min(gray.shape) < _COARSE:
        raise InvalidInputError(f"image: {gray.shape[1]} x {gray.shape[0]} pixels, expected {_COARSE} or more a side")
    shrink = min(1.0, _SIDE / min(gray.shape))
    if shrink < 1.0:
        gray = np.asarray(cv2.resize(gray, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    edges = _Edges.of(gray)
    side = float(min(gray.shape))
    step = side / _COARSE
    few = edges.spread(_MOST)
    reach = int(_REACH * side / step)
    middle = np.array([gray.shape[1] - 1.0, gray.shape[0] - 1.0]) / 2.0
    found = few.best(_grid(middle, reach, step), step, (_RADII[0] * side, _RADII[1] * side))
    while found is not None and step > 0.7:
        step /= 2.0
        about = (found[1] - 4.0 * step, found[1] + 4.0 * step)
        found = edges.best(_grid(found[0], 2, step), max(1.5 * step, 1.0), about)
    if found is None:
        return None
    centre, radius = found
    for _ in range(4):
        on = edges.on(centre, radius)
        if np.count_nonzero(on) < _SECTORS // 2:
            return None
        centre, radius = circle_through(edges.pixels[on].astype(np.float64))
    seen, within = edges.seen(centre, radius)
    others = [edges.seen(centre, radius + beside)[0][within] for beside in _BESIDE_PX]
    chance = float(np.mean(others)) if within.any() else 1.0
    if chance > _CHANCE:
        return None
    covered = (float(np.mean(seen[within])) - chance) / (1.0 - chance)
    if covered < _COVERED or np.count_nonzero(within) < _WITHIN * _SECTORS:
        return None
    u, v = (centre + 0.5) / shrink - 0.5
    return RimCircle((float(u), float(v)), float(radius) / shrink, covered)


def circle_through(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Centre (2,) and radius of the circle through points (N, 2), by least squares of squared distances."""
    rows = np.column_stack([2.0 * points, np.ones(len(points))])
    found = np.linalg.lstsq(rows, np.sum(points**2, axis=1), rcond=None)[0]
    centre = found[:2]
    return centre, float(np.sqrt(found[2] + centre @ centre))


def _grid(middle: NDArray[np.float64], reach: int, step: float) -> NDArray[np.float64]:
    """(N, 2): points about a middle, so many steps to each side."""
    steps = np.arange(-reach, reach + 1, dtype=np.float64) * step
    return np.asarray(middle + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2), dtype=np.float64)


def _sector(away: NDArray[np.floating]) -> NDArray[np.intp]:
    turn = np.arctan2(away[:, 1], away[:, 0]) / (2.0 * np.pi) + 0.5
    return np.asarray(np.minimum(turn * _SECTORS, _SECTORS - 1), dtype=np.intp)


_TURNS = ((np.arange(_SECTORS) + 0.5) / _SECTORS - 0.5) * 2.0 * np.pi
_DIRECTIONS: Final = np.column_stack([np.cos(_TURNS), np.sin(_TURNS)])
"""The middle of each sector, (64, 2)."""


@dataclass(frozen=True)
class _Edges:
    """Thinned edge pixels of an image."""

    shape: tuple[int, int]
    pixels: NDArray[np.float32]
    """(N, 2), u and v."""
    inwards: NDArray[np.float32]
    """(N, 2), unit gradients: towards what is lighter."""

    @classmethod
    def of(cls, gray: NDArray[np.uint8]) -> _Edges:
        import cv2

        smooth = cv2.GaussianBlur(gray, (5, 5), 0)
        gx, gy = (cv2.Sobel(smooth, cv2.CV_32F, *order, scale=0.125) for order in ((1, 0), (0, 1)))
        steep = np.hypot(gx, gy)
        top = np.zeros(gray.shape, dtype=bool)
        # Thinning: the greatest of three across the edge.
        across = np.abs(gx[1:-1, 1:-1]) >= np.abs(gy[1:-1, 1:-1])
        here = steep[1:-1, 1:-1]
        along_u = (here >= steep[1:-1, :-2]) & (here > steep[1:-1, 2:])
        along_v = (here >= steep[:-2, 1:-1]) & (here > steep[2:, 1:-1])
        top[1:-1, 1:-1] = np.where(across, along_u, along_v) & (here >= _STEEP)
        v, u = np.nonzero(top)
        inwards = np.asarray(np.column_stack([gx[top], gy[top]]) / steep[top][:, None], dtype=np.float32)
        return cls((gray.shape[0], gray.shape[1]), np.column_stack([u, v]).astype(np.float32), inwards)

    def spread(self, most: int) -> _Edges:
        """At most so many of them."""
        every = max(1, -(-len(self.pixels) // most))
        return _Edges(self.shape, self.pixels[::every], self.inwards[::every])

    def distances(self, centre: NDArray[np.float64]) -> NDArray[np.float32]:
        """(N,): distances of those that get darker away from a centre; NaN for the others."""
        away = self.pixels - centre.astype(np.float32)
        distance = np.hypot(away[:, 0], away[:, 1])
        radial = -np.einsum("ij,ij->i", away, self.inwards) >= _RADIAL * distance
        return np.where(radial, distance, np.float32(np.nan))

    def on(self, centre: NDArray[np.float64], radius: float) -> NDArray[np.bool_]:
        """(N,): which lie on a circle."""
        return np.asarray(np.abs(self.distances(centre) - radius) <= _NEAR_PX)

    def seen(self, centre: NDArray[np.float64], radius: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """(64,) each: in which directions a circle has an edge, and in which it lies within the image."""
        seen = np.zeros(_SECTORS, dtype=bool)
        seen[_sector(self.pixels[self.on(centre, radius)] - centre)] = True
        return seen, self.within(centre, np.array([radius]))[0]

    def within(self, centre: NDArray[np.float64], radii: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(R, 64): which directions of circles lie within the image, clear of its border."""
        at = centre + radii[:, None, None] * _DIRECTIONS
        far = np.array([self.shape[1], self.shape[0]]) - 3.0
        return np.asarray(((at > 2.0) & (at < far)).all(axis=-1))

    def best(
        self, centres: NDArray[np.float64], width: float, radii: tuple[float, float]
    ) -> tuple[NDArray[np.float64], float] | None:
        """Centre and radius of the circle that has edges in most of its directions; radii go by steps of a width."""
        middle = centres.mean(axis=0)
        sector = _sector(self.pixels - middle.astype(np.float32))
        steps = int((radii[1] - radii[0]) / width) + 1
        middles = np.asarray(radii[0] + (np.arange(steps) + 0.5) * width, dtype=np.float64)
        most, found = 0.0, None
        for centre in centres:
            distance = self.distances(centre)
            # NaN compares false.
            near = (distance >= radii[0]) & (distance < radii[0] + steps * width)
            seen = np.zeros((steps, _SECTORS), dtype=bool)
            seen[((distance[near] - radii[0]) / width).astype(np.intp), sector[near]] = True
            within = np.count_nonzero(self.within(centre, middles), axis=1)
            covered = np.where(within >= _WITHIN * _SECTORS, seen.sum(axis=1) / np.maximum(within, 1), 0.0)
            k = int(np.nonzero(covered >= _OUTERMOST * covered.max())[0].max())
            if covered[k] > most:
                most, found = float(covered[k]), (centre, float(middles[k]))
        return found
