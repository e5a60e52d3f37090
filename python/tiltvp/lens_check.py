"""Whether a calibration fits its images: a centre or a focal length that is off bends what is straight, and by a focal
length that is off right angles are none."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.errors import InvalidInputError, counted
from tiltvp.images import checked_mask, grays_from
from tiltvp.right_angles import UNTOLD, scale_by_right_angles
from tiltvp.segments import SegmentDetector

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera

    Matrix = NDArray[np.float64]

__all__ = ["LensCheck", "check_lens"]

_STRAY_PX: Final = 2.0
_RMS_PX: Final = 1.5
"""Edges may bend twice as far as those of a detector that trusts its lens, which cuts bent ones into straight ones."""
_LENGTH_RAD: Final = 0.35
"""Shorter edges bend by less than they scatter."""
_LONGEST: Final = 60
"""Edges of an image that are looked at."""
_POINTS: Final = 30
"""Points of an edge that are looked at."""
_LEAST: Final = 10
"""Edges with which three numbers begin to be told from the edges' own scatter."""
_IMAGES: Final = 4
"""Images with which they begin to be told from the bent things of one place: of real photographs, one or two by each of
eight calibrations, three make a centre seem off."""
_SCATTER_PX: Final = 0.1
"""Least scatter of an edge's points: what a detector leaves of a straight one."""
_ROUNDS: Final = 3
"""How often edges are found, in images as the corrected lens sees them: what bent edges were cut into joins again."""
_STEPS: Final = 6
_WIDTHS: Final = np.array([0.1, 0.1, 0.3])
"""Standard deviations of calibrations before an image is seen: of the centre as shares of the width, of the scale."""
_FAR_SIGMAS: Final = 3.0
"""Of these, beyond which nothing is found: what bends least of a pinhole may lie anywhere."""
_DELTAS: Final = np.array([0.5, 0.5, 0.005])
"""For the slopes: half a pixel, and what moves the rim by as much."""
_OFF_RAD: Final = float(np.deg2rad(1.5))
"""Of views of panoramas by the true lens one set in fifty seems farther off; two degrees make an estimate wrong."""
_SCALE_OFF: Final = 0.04
"""A focal length that is off by less moves a lean of ten degrees by less than half a degree."""
_SIGMAS: Final = 4.0
_OPEN: Final = 0.1
"""Standard deviation of the focal length by straight edges from which on right angles are asked. Curved lenses have a
tenth of it."""


@dataclass(frozen=True)
class LensCheck:
    """How far the straight edges of some images say that a calibration is off. True if it is believable.

    `centre_off_px` (u, v) is where the centre is beside the calibration's, `scale` the focal length over the
    calibration's, `sigmas` are the standard deviations of these three, `lean_off_rad` is how far the centre tilts the
    camera's axis, `images` and `edges` are how many tell it. A pinhole keeps straight what is straight wherever its
    centre is: `sigmas` are wide then. So they are where images or edges are too few. There `scale_by_right_angles` is
    the focal length over the calibration's by which edges run along three axes at right angles, and
    `sigma_by_right_angles` its standard deviation, 0.5 where they tell nothing.
    """

    centre_off_px: tuple[float, float]
    scale: float
    sigmas: tuple[float, float, float]
    lean_off_rad: float
    images: int
    edges: int
    scale_by_right_angles: float = UNTOLD[0]
    sigma_by_right_angles: float = UNTOLD[1]

    @property
    def told(self) -> bool:
        """Whether there are images and long edges enough to tell anything."""
        return self.images >= _IMAGES and self.edges >= _LEAST

    @property
    def centre_believable(self) -> bool:
        """Whether the centre is off by less than 1.5 degrees, or by less than four standard deviations."""
        away = np.linalg.norm(np.divide(self.centre_off_px, self.sigmas[:2]))
        return self.lean_off_rad <= _OFF_RAD or float(away) <= _SIGMAS

    @property
    def scale_believable(self) -> bool:
        """Whether the focal length is off by less than 4 %, or by less than four standard deviations."""
        return _is_believable(self.scale, self.sigmas[2]) and self.right_angles_believable

    @property
    def right_angles_believable(self) -> bool:
        """The same by right angles alone."""
        return _is_believable(self.scale_by_right_angles, self.sigma_by_right_angles)

    @property
    def reason(self) -> str:
        """What was found, in a sentence."""
        by_angles = ""
        if not self.right_angles_believable:
            by_angles = (
                "edges run at right angles to each other by another focal length, "
                f"{self.scale_by_right_angles:.3f} +- {self.sigma_by_right_angles:.3f} times the calibration's"
            )
        if not self.told:
            return by_angles or (
                f"{self.edges} long straight edges of {counted(self.images, 'images')} are too few to tell whether the "
                f"calibration fits, expected {_LEAST} of {_IMAGES} at least"
            )
        off = []
        if not self.centre_believable:
            (u, v), (su, sv, _) = self.centre_off_px, self.sigmas
            lean = np.rad2deg(self.lean_off_rad)
            off.append(
                f"its centre {u:+.1f} +- {su:.1f}, {v:+.1f} +- {sv:.1f} px beside the calibration's, "
                f"by which leans err by {lean:.1f} degrees"
            )
        if not _is_believable(self.scale, self.sigmas[2]):
            off.append(f"its focal length {self.scale:.3f} +- {self.sigmas[2]:.3f} times the calibration's")
        if off:
            bent = f"{self.edges} straight edges are bent, as by another lens: {', and '.join(off)}"
            return "; ".join(filter(None, (bent, by_angles)))
        return by_angles or f"{self.edges} edges are as straight as by the calibration"

    def __bool__(self) -> bool:
        return self.right_angles_believable and (not self.told or (self.centre_believable and self.scale_believable))


def _is_believable(scale: float, sigma: float) -> bool:
    off = abs(scale - 1.0)
    return off <= _SCALE_OFF or off <= _SIGMAS * sigma


def check_lens(images: Iterable[ArrayLike], camera: Camera, *, mask: ArrayLike | None = None) -> LensCheck:
    """Whether straight edges are straight by the calibration, and by which centre and focal length they are so.

    The lens by which edges are bent least (Devernay and Faugeras 2001) is looked for among those that see pixels moved
    and scaled as the calibration says, whatever its model. Five images from different places, or with different
    headings, are enough. `mask` (H, W) bool is True where images show the world: the rims of a mirror are no straight
    edges.

    Where that leaves the focal length open, as of a pinhole, right angles are asked (Caprile and Torre 1990): most
    edges of buildings run along three axes. Twenty images tell more often than five.

    Raises `InvalidInputError` for no images, for images and masks of another size than the camera's, and for masks of
    another type than bool.
    """
    grays = grays_from(images)
    if not grays:
        raise InvalidInputError("images: none, expected at least one")
    known = None if mask is None else checked_mask(mask, camera)
    detector = SegmentDetector(camera, mask=known, stray_max_px=_STRAY_PX, rms_max_px=_RMS_PX)
    prior = np.append(camera.width * _WIDTHS[:2], _WIDTHS[2]) ** -2.0
    off, covariance, telling, edges = np.zeros(3), np.diag(1.0 / prior), len(grays), 0
    for _ in range(_ROUNDS if len(grays) >= _IMAGES else 0):
        found = [own for own in (list(_long_edges(detector, _as_told(gray, off))) for gray in grays) if own]
        count = sum(map(len, found))
        is_enough = count >= _LEAST and len(found) >= _IMAGES
        if is_enough or not edges:
            telling, edges = len(found), count
        if not is_enough:
            break
        image_of = np.repeat(np.arange(len(found)), [len(own) for own in found])
        points = np.array([points for own in found for points in own])
        step, covariance = _straightest(camera, points, image_of, np.diag(prior), off)
        off = off + step
        if not (np.abs(off) < _FAR_SIGMAS / np.sqrt(prior)).all():
            off, covariance = np.zeros(3), np.diag(1.0 / prior)
            break
        if (np.abs(step) < np.sqrt(np.diag(covariance))).all():
            break
    u, v, scale = off.tolist()
    sigma_u, sigma_v, sigma_scale = np.sqrt(np.diag(covariance)).tolist()
    by_right_angles = UNTOLD
    if sigma_scale > _OPEN and len(grays) >= _IMAGES:
        straight = SegmentDetector(camera, mask=known)
        by_right_angles = scale_by_right_angles(camera, map(straight, grays))
    return LensCheck(
        (u, v),
        1.0 + scale,
        (sigma_u, sigma_v, sigma_scale),
        float(np.hypot(u, v)) / _per_rad(camera),
        telling,
        edges,
        *by_right_angles,
    )


def _as_told(gray: NDArray[np.uint8], off: Matrix) -> NDArray[np.uint8]:
    """The image as a lens with the calibration's centre and focal length sees it."""
    import cv2

    if not off.any():
        return gray
    middle, scale = 0.5 * (np.array(gray.shape[::-1]) - 1.0), 1.0 + off[2]
    moved = np.column_stack([np.eye(2) * scale, middle + scale * (off[:2] - middle)])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(gray, moved, gray.shape[::-1], flags=flags), dtype=np.uint8)


def _long_edges(detector: SegmentDetector, gray: NDArray[np.uint8]) -> Iterable[Matrix]:
    """(K, 2) pixels along each of the long edges of an image."""
    edges = detector(gray)
    for number in range(min(len(edges), _LONGEST)):
        points = edges.pixels(number)
        if edges.length_rad[number] >= _LENGTH_RAD and len(points) >= _POINTS:
            yield points[np.linspace(0, len(points) - 1, _POINTS).astype(np.int64)]


def _per_rad(camera: Camera) -> float:
    """Pixels for each radian in the middle of the image, or about so many where the lens sees nothing there."""
    middle = _middle(camera)
    first, second = camera.unproject(np.array([middle, middle + [1.0, 0.0]]))
    angle = float(np.linalg.norm(np.cross(first, second)))
    return 1.0 / angle if np.isfinite(angle) and angle > 0.0 else camera.width / np.pi


def _middle(camera: Camera) -> Matrix:
    return 0.5 * np.array([camera.width - 1.0, camera.height - 1.0])


def _bends(camera: Camera, points: Matrix, off: Matrix) -> Matrix:
    """(N, K) pixels of the image by which points (N, K, 2) lie beside the great circle that fits each edge best. (In
    angles a lens that sees finer would bend them less.)
    """
    middle = _middle(camera)
    told = ((points - middle) / (1.0 + off[2]) + middle - off[:2]).reshape(-1, 2)
    bearings = np.nan_to_num(camera.unproject(told)).reshape(*points.shape[:2], 3)
    _, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", bearings, bearings))
    normals = axes[:, :, 0]
    largest = np.take_along_axis(normals, np.abs(normals).argmax(axis=1)[:, None], axis=1)
    normals = normals * np.sign(largest)
    sines = np.einsum("nki,ni->nk", bearings, normals)
    nearest = camera.project((bearings - sines[:, :, None] * normals[:, None, :]).reshape(-1, 3))
    away = np.linalg.norm(np.nan_to_num(told - nearest), axis=1).reshape(sines.shape)
    return np.asarray(np.sign(sines) * away * (1.0 + off[2]))


def _straightest(
    camera: Camera, points: Matrix, image_of: NDArray[np.int64], prior: Matrix, before: Matrix
) -> tuple[Matrix, Matrix]:
    """By how much the lens is off beyond what is known, and its covariance: least squares of the bends, edges that stay
    bent weighed down, and the covariance from how edges disagree, and images of them: things of one place that are bent
    (tables, arches, roads) err together.
    """
    off = np.zeros(3)
    for _ in range(_STEPS):
        bends = _bends(camera, points, off)
        slopes = np.stack(
            [
                (_bends(camera, points, off + delta) - _bends(camera, points, off - delta)) / (2.0 * delta.sum())
                for delta in np.diag(_DELTAS)
            ],
            axis=2,
        )
        mean = np.mean(bends**2, axis=1)
        usual = max(float(np.median(mean)), _SCATTER_PX**2)
        weight = (1.0 + mean / (4.0 * usual)) ** -2.0 / usual
        pulls = np.einsum("n,nkp,nk->np", weight, slopes, bends)
        information = prior + np.einsum("n,nkp,nkq->pq", weight, slopes, slopes)
        step = -np.linalg.solve(information, pulls.sum(axis=0) + prior @ (off + before))
        off = off + step
        if (np.abs(step) < 0.02 * _DELTAS).all():
            break
    inverse = np.linalg.inv(information)
    together = np.array([pulls[image_of == image].sum(axis=0) for image in range(int(image_of.max()) + 1)])
    scatter = pulls.T @ pulls + together.T @ together * len(together) / (len(together) - 1.0)
    return off, inverse @ (prior + scatter) @ inverse
