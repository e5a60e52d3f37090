"""The tilt of single and of successive images: the estimator over images of any usual kind, the filter."""

from __future__ import annotations

import math
from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from tiltvp import _core
from tiltvp._core import (
    CommonDirection,
    EdgeElements,
    FilteredTilt,
    FilterStep,
    FitReport,
    ImageEdges,
    TiltEstimate,
    TiltFilter,
    common_direction,
    normal_from_alpha_beta,
    tilt_error_rad,
    tilt_from_wheel_heights,
)
from tiltvp.arguments import array_from
from tiltvp.errors import InvalidInputError
from tiltvp.images import gray_from, grays_from

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import ArrayLike, NDArray

    Tilt: TypeAlias = TiltEstimate | FilteredTilt | ArrayLike

__all__ = [
    "CommonDirection",
    "EdgeElements",
    "FilterStep",
    "FilteredTilt",
    "FitReport",
    "ImageEdges",
    "TiltEstimate",
    "TiltEstimator",
    "TiltFilter",
    "common_direction",
    "normal_from_alpha_beta",
    "normal_of",
    "tilt_error_rad",
    "tilt_from_wheel_heights",
]

_FIXED: Final = ("camera", "method", "robot_from_camera")
"""What `with_options` leaves as it is."""


def normal_of(tilt: Tilt) -> NDArray[np.float64]:
    """(3,): the ground normal of an estimate, a filter's or an image's, of (alpha_rad, beta_rad), or of a normal.

    Raises `InvalidInputError` for an estimate without a tilt, an alpha beyond pi, as of degrees, and for anything else.
    """
    if isinstance(tilt, TiltEstimate | FilteredTilt):
        if not tilt:
            raise InvalidInputError(f"tilt: an estimate without a tilt ({tilt.reason}), expected one with a tilt")
        return tilt.normal
    numbers = np.empty(0)
    with suppress(InvalidInputError):
        numbers = array_from(tilt, "tilt")
    if numbers.shape == (2,):
        if abs(numbers[0]) > math.pi:
            raise InvalidInputError(f"tilt: alpha = {numbers[0]:g}, expected radians, at most pi")
        return normal_from_alpha_beta(*numbers.tolist())
    if numbers.shape != (3,):
        raise InvalidInputError(f"tilt = {tilt!r}, expected an estimate, (alpha_rad, beta_rad) or a normal (3,)")
    return numbers


class TiltEstimator(_core.TiltEstimator):
    """Estimates how far and in which direction a robot leans from single images of one camera.

    Tables and scratch are made once. Call it with an image: (H, W) uint8, or colour (BGR), uint16, float in [0, 1], any
    strides. The answer is a frozen `TiltEstimate`; an image without enough edges has an estimate with confidence 0, NaN
    angles and a reason. Wrong shapes, NaN, empty images and impossible options raise `tiltvp.errors.InvalidInputError`.
    One estimator may be called from many threads at once; frozen, comparable, and to be pickled.

    Parameters
    ----------
    camera : tiltvp.Camera
    method : {"refined", "image-space-ransac", "image-space-reject-refit", "vector-consensus", "segments"}
    robot_from_camera : (3, 3) rotation R, v_robot = R v_camera; default identity: an upward camera, columns to
        the front.
    gradient_min, smoothing_px, elevation_min_rad, elevation_max_rad, margin_px, tilt_max_rad, mask, row_stride, seed
        Options of every method: see docs/options.md. `mask` is (H, W) bool, True where the image shows the world.
    keep_fraction, scale_rad, tolerance_rad, max_iterations
        Of "refined"; `keep_fraction` and `max_iterations` also of "image-space-reject-refit".
    threshold_px, offset_max_px, correction
        Of the image-space methods; `correction` is "closed-form" (default), a factor in pixels per radian, None, an
        `AffineCorrection` or a `PosteriorCorrection`.
    threshold_rad, normal, correction
        Of "vector-consensus"; `normal` is "gradient" (the paper's) or "tangent", `correction` a factor without unit
        or one of those trained on raw angles.
    sampling, local_optimization, score
        Of "image-space-ransac" and "vector-consensus": "uniform" (default) or "progressive"; a bool; "count" (default)
        or "msac".
    gradient_start, stray_max_px, rms_max_px, support_min_px, gap_max, scatter_rad, segments_max
        Of "segments"; it takes every row: `row_stride` is 1.
    """

    __slots__ = ()

    def __call__(self, image: ArrayLike) -> TiltEstimate:
        """The tilt of one image."""
        return self._estimate(gray_from(image))

    def detect(self, image: ArrayLike) -> ImageEdges:
        """The edge pixels of one image, for `estimate_edges` of any estimator with equal camera and edge options."""
        return self._detect(gray_from(image))

    def with_options(self, **options: Any) -> Self:
        """An estimator of the same camera, mounting and method with some options changed.

        It shares every table that the change leaves alone: one for each of many thresholds takes next to no time and
        memory. Raises `InvalidInputError` as the constructor does, and for another camera, mounting or method.
        """
        fixed = ", ".join(name for name in _FIXED if name in options)
        if fixed:
            raise InvalidInputError(f"{fixed}: given to with_options, expected options alone: make a new TiltEstimator")
        return type(self)(self.camera, _like=self, **options)

    def with_edges(self, image: ArrayLike) -> tuple[TiltEstimate, EdgeElements]:
        """The tilt of one image and its edge pixels: position, phi and s of eqs. 16 and 17, prefiltered, inlier."""
        return self._estimate_with_edges(gray_from(image))

    def estimate_many(self, images: Iterable[ArrayLike], *, threads: int = 1) -> list[TiltEstimate]:
        """The tilts of many images, in their order, the same for any number of threads."""
        return self._estimate_many(grays_from(images), threads=threads)
