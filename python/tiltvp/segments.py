"""Straight edges of any central image as arcs of great circles: fisheye, mirror, pinhole, panorama."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tiltvp import _core
from tiltvp._core import Segments
from tiltvp.images import gray_from

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["SegmentDetector", "Segments"]


class SegmentDetector(_core.SegmentDetector):
    """Finds the straight edges of single images of one camera, whatever its lens.

    Tables and scratch are made once. Call it with an image: (H, W) uint8, or colour (BGR), uint16, float in [0, 1], any
    strides. One detector may be called from many threads at once; frozen, comparable, and to be pickled. Options: see
    docs/options.md; how it works: docs/segments.md.
    """

    __slots__ = ()

    def __call__(self, image: ArrayLike) -> Segments:
        """The straight edges of one image, the longest first; directions are in the camera frame.

        Raises `InvalidInputError` for an image of another size than the camera's.
        """
        return self._detect(gray_from(image))
