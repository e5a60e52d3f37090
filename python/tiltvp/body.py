"""The robot's own body in view: edges that stay in place in images of different places."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.errors import counted
from tiltvp.images import camera_grays, checked_camera, checked_mask

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera

__all__ = ["BodyMask", "body_mask"]

_LEAST: Final = 5
"""Images, as `_share_of` asks for: of four, an edge would have to be in more than all."""
_SIDE_PX: Final = 640
"""Longer side to which images are made smaller: sums stay below 4 MB, and an edge may tremble with the robot."""
_SMOOTHING_PX: Final = 1.0
_GRADIENT: Final = 80.0
"""Least magnitude of an edge's gradient for the Scharr kernel (3, 10, 3): half of what the methods of edge pixels ask
for, since a body's edges stand before what is light here and dark there."""
_WORLD: Final = 0.55
"""Share of images in which a place of the world shows an edge of one direction, at most: 0.54 between the pillars of
rendered corridors, whose upright edges have one direction at each place of the image."""
_SIGMAS: Final = 2.0
"""By which an edge must stay in place more often: one in 40 of such places does so by chance, seldom side by side."""
_LENGTH: Final = 0.025
"""Least extent of what stays in place, as a share of the shorter side: what does so by chance is scattered."""
_GOES_ON: Final = 0.15
"""Share of images in which an edge may be harder to see along its way: 0.2 joins edges of corridors to a body's."""
_REACH_PX: Final = 3
"""Pixels of the smaller image by which an edge is wider than its sharpest part."""
_STAYING_MAX: Final = 0.5
"""Share of all edges that stay in place, at most: beyond, it is the world that does, or a body that hides it."""
_ALIKE_MAX: Final = 0.12
"""Share of the other edges that two images have in common, at most: of real and rendered sets from different places,
the largest is at 0.11, and of those from one place, or half from one place, the least at 0.15."""


@dataclass(frozen=True, eq=False)
class BodyMask:
    """Where images show the world and not the robot's own body. True if something of a body was found."""

    mask: NDArray[np.bool_] | None
    """(H, W), False on and about edges that stay in place; None where the images do not tell."""
    images: int
    """How many were looked at."""
    reason: str
    """What was found, or why it is not known, in a sentence."""

    def __bool__(self) -> bool:
        return self.mask is not None and not self.mask.all()


def body_mask(images: Iterable[ArrayLike], camera: Camera, *, mask: ArrayLike | None = None) -> BodyMask:
    """Finds the edges of the robot's own body, and of a rim: they stay in place where those of the world move.

    At least 5 images from places, and with headings, that differ; 24 find more. `mask` (H, W) bool is True where images
    are looked at. What is alike in all images but has no edges is left in, for so is a ceiling. Images are taken one
    after the other and not kept. Raises `InvalidInputError` for what is no image or camera, for images and masks of
    another size than the camera's, and for masks of another type than bool.
    """
    import cv2

    checked_camera(camera)
    shape = (camera.height, camera.width)
    looked = camera.valid_mask() & (True if mask is None else checked_mask(mask, camera))
    scale = min(1.0, _SIDE_PX / max(shape))
    size = (max(1, round(scale * shape[1])), max(1, round(scale * shape[0])))
    inside = cv2.erode(cv2.resize(looked.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST), _disc()) > 0
    sums, seen, count = np.zeros((2, *inside.shape), np.float32), np.zeros(inside.shape, np.float32), 0
    for gray in camera_grays(images, camera):
        small = np.asarray(cv2.resize(gray, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        at, directions = _edges_of(small, inside)
        sums.reshape(2, -1)[:, at] += directions
        seen.ravel()[at] += 1.0
        count += 1
    if count < _LEAST:
        return BodyMask(None, count, f"{counted(count, 'images')}, expected at least {_LEAST} from different places")
    length = np.hypot(*sums)
    staying = _staying(length / count, _share_of(count))
    apart = ~staying
    total, others = float(seen.sum()), float(seen[apart].sum())
    if total == 0.0:
        return BodyMask(None, count, f"{counted(count, 'images')} without an edge")
    share = 1.0 - others / total
    if share > _STAYING_MAX:
        what = f"{100 * share:.0f} % of their edges stay in place, expected at most {100 * _STAYING_MAX:.0f} %"
        return BodyMask(None, count, f"{counted(count, 'images')}: {what}: they are not from different places")
    alike = (float(np.sum(length[apart] ** 2)) / others - 1.0) / (count - 1)
    if alike > _ALIKE_MAX:
        what = f"two of them share {100 * alike:.0f} % of their edges, expected at most {100 * _ALIKE_MAX:.0f} %"
        return BodyMask(None, count, f"{counted(count, 'images')}: {what}: they are not from different places")
    large = cv2.resize(staying.astype(np.uint8), (shape[1], shape[0]), interpolation=cv2.INTER_NEAREST) > 0
    covered = 100.0 * float(np.sum(large & looked)) / max(1, int(looked.sum()))
    found = f"edges that stay in place cover {covered:.1f} %" if covered > 0.0 else "no edges stay in place"
    return BodyMask(~large, count, f"{counted(count, 'images')}: {found}")


def _edges_of(gray: NDArray[np.uint8], inside: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """(N,): where edges are, in row order; (2, N): cosine and sine of twice the direction of each one's gradient.

    Twice, for a body is darker than one background and lighter than the next.
    """
    import cv2

    smooth = cv2.GaussianBlur(gray, (0, 0), _SMOOTHING_PX)
    x, y = cv2.Scharr(smooth, cv2.CV_32F, 1, 0), cv2.Scharr(smooth, cv2.CV_32F, 0, 1)
    at = np.flatnonzero((x * x + y * y >= _GRADIENT**2) & inside)
    along, across = x.ravel()[at], y.ravel()[at]
    square = along * along + across * across
    doubled = np.stack([along * along - across * across, 2.0 * along * across]) / square
    return at, np.asarray(doubled, dtype=np.float32)


def _share_of(count: int) -> float:
    """The share of so many images in which an edge of the body has its place and direction."""
    return min(0.97, _WORLD + _SIGMAS * float(np.sqrt(_WORLD * (1.0 - _WORLD) / count)))


def _staying(shares: NDArray[np.float32], least: float) -> NDArray[np.bool_]:
    """(H, W): what has its place and direction in the least share of the images, where it is long enough; what goes on
    from there in a somewhat smaller share; and what is about both.
    """
    import cv2

    _, labels, stats, _ = cv2.connectedComponentsWithStats((shares >= least).astype(np.uint8), connectivity=8)
    extents = stats[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]].max(axis=1)
    keep = extents >= max(3.0, _LENGTH * min(shares.shape))
    keep[0] = False
    _, wider = cv2.connectedComponents((shares >= least - _GOES_ON).astype(np.uint8), connectivity=8)
    found = np.isin(wider, np.unique(wider[keep[labels]]))
    return np.asarray(cv2.dilate(found.astype(np.uint8), _disc()) > 0)


def _disc() -> NDArray[np.uint8]:
    import cv2

    side = 2 * _REACH_PX + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)), dtype=np.uint8)
