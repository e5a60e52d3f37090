"""Vertical lines of images: found, described, matched and followed (Scaramuzza, Siegwart and Martinelli 2009)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp import _core
from tiltvp._core import (
    LINE_METHODS,
    FilteredTilt,
    Lines,
    LineTracker,
    TiltEstimate,
    TrackedLines,
    descriptor_distances,
    match_wide,
    ssd_matrix,
    zncc_matrix,
)
from tiltvp.arguments import number_from, refuse_unless
from tiltvp.images import gray_from
from tiltvp.tilt import normal_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera
    from tiltvp.tilt import Tilt

__all__ = [
    "LINE_METHODS",
    "LineExtractor",
    "LineTracker",
    "Lines",
    "TrackedLines",
    "describe",
    "descriptor_distances",
    "extract",
    "match",
    "match_wide",
    "ssd_matrix",
    "zncc_matrix",
]

_SUPPORT_KEPT: Final = 0.75
"""The least share of the upright robot's edge pixels on lines that lines keep under a lean that is believed."""


class LineExtractor(_core.LineExtractor):
    """Finds and describes the vertical lines of single images of one camera.

    Tables and scratch are made once. Call it with an image: (H, W) uint8, or colour (BGR), uint16, float in [0, 1], any
    strides; and with the lean of the frame where it is known. One extractor may be called from many threads at once;
    frozen, comparable, and to be pickled. Options: see `tiltvp._core.LineExtractor` and docs/lines.md.
    """

    __slots__ = ()

    def __call__(self, image: ArrayLike, tilt: Tilt | None = None) -> Lines:
        """The vertical lines of one image, by rising bearing.

        `tilt` is an estimate, a filter's or an image's, (alpha_rad, beta_rad), or a ground normal (3,); None: upright.
        Lines may slant by what an estimate's covariance says that it is off, else by `tilt_sigma_rad`.
        Bearings are azimuths about the vertical in the upright robot's frame. "radial" knows no tilt. Raises
        `InvalidInputError` for an image of another size than the camera's and for an estimate without a tilt.
        """
        return self._extract(gray_from(image), None if tilt is None else normal_of(tilt), _sigma_rad(tilt))

    def believes(self, image: ArrayLike, tilt: TiltEstimate, *, confidence_min: float = 0.5) -> bool:
        """Whether an estimate of the lean is confident enough, and the lines of the image do not speak against it.

        Under a true lean verticals are lines; edges that mislead the estimate make fewer: the edge pixels on lines must
        be at least three quarters of those of an upright robot. Costs two extractions. False for an estimate without
        a tilt. Raises `InvalidInputError` for what is no estimate.
        """
        refuse_unless(tilt, TiltEstimate | FilteredTilt, "tilt", "an estimate")
        if not (tilt and tilt.confidence >= number_from(confidence_min, "confidence_min")):
            return False
        # Both may slant by the same.
        leaning, upright = (int(self(image, lean).support_px.sum()) for lean in (tilt.normal, None))
        return leaning >= _SUPPORT_KEPT * upright

    def describe(self, image: ArrayLike, lines: Lines) -> NDArray[np.float32]:
        """(N, 192) float32: the descriptors of the lines of an image, eqs. 2 to 5; other options, other widths.

        `lines` carry the vertical that they were found about, in the robot frame. Raises `InvalidInputError` for lines
        of the other method, and for those that were found with another camera or mounting (`Lines.seen_by`).
        """
        refuse_unless(lines, Lines, "lines", "Lines")
        return self._describe(gray_from(image), lines)

    def patches(self, image: ArrayLike, lines: Lines) -> NDArray[np.float32]:
        """(N, rows, columns) float32: grey levels about each line, as `ssd_matrix` and `zncc_matrix` compare them.

        Rows run along the line, from low to high, columns across it; NaN where the world is not seen. Reshape to
        (N, -1) for the matrices.
        """
        refuse_unless(lines, Lines, "lines", "Lines")
        return self._patches(gray_from(image), lines)

    def lines_at(self, bearing_rad: ArrayLike, tilt: Tilt | None = None) -> Lines:
        """Lines at any bearings (N,), without support: to describe places where there may be no line."""
        return self._lines_at(bearing_rad, None if tilt is None else normal_of(tilt))


def _sigma_rad(tilt: Any) -> float | None:
    """The standard deviation of a lean, in the direction in which it is known least; None where it tells none."""
    if not isinstance(tilt, TiltEstimate | FilteredTilt):
        return None
    return float(np.sqrt(np.linalg.eigvalsh(tilt.covariance_rad2)[-1]))


def extract(
    image: ArrayLike,
    camera: Camera,
    tilt: Tilt | None = None,
    robot_from_camera: ArrayLike | None = None,
    method: str = LINE_METHODS[0],
    **options: Any,
) -> Lines:
    """The vertical lines of one image; for many of one camera make a `LineExtractor`, which keeps its tables."""
    extractor = LineExtractor(camera, method=method, robot_from_camera=robot_from_camera, **options)
    return extractor(image, tilt)


def describe(
    image: ArrayLike,
    camera: Camera,
    lines: Lines,
    robot_from_camera: ArrayLike | None = None,
    **options: Any,
) -> NDArray[np.float32]:
    """(N, 192) float32: the descriptors of lines; for many images of one camera make a `LineExtractor`.

    `robot_from_camera` is the mounting that the lines were found with: others are refused.
    """
    refuse_unless(lines, Lines, "lines", "Lines")
    method = LINE_METHODS[0] if lines.center_px is None else LINE_METHODS[1]
    return LineExtractor(camera, method=method, robot_from_camera=robot_from_camera, **options).describe(image, lines)


def match(a: NDArray[np.float32], b: NDArray[np.float32], **options: Any) -> NDArray[np.int64]:
    """(M, 2) int64: rows of `a` and the rows of `b` that are the same lines, by rising row of `a`.

    The nearest descriptor (eq. 6) if it passes the tests of eqs. 8 to 10 with `f1`, `f2`, `f3`; `mutual` (default) asks
    for the nearest both ways, `ordered` for matches in the lines' cyclic order. `expected_rad` (N_A,), `seen_rad`
    (N_B,) and `gate_rad` leave only lines that are close to where they are expected.
    """
    return _core.match_descriptors(a, b, **options)
