"""Corners in images: found, and the pose of a camera or a pair of cameras before them (Liu et al. 2018)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp import _core
from tiltvp._core import CORNER_METHODS, BelievedCorner, CornerEstimate, CornerFeature, CornerHypothesis
from tiltvp.arguments import number_from, two_from
from tiltvp.errors import InvalidInputError
from tiltvp.images import bgr_from, gray_from

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera

__all__ = [
    "CORNER_METHODS",
    "BelievedCorner",
    "CornerDetector",
    "CornerEstimate",
    "CornerFeature",
    "CornerHypothesis",
    "CornerPoseEstimator",
]

_OF_ESTIMATOR = {field["name"]: field["default"] for field in _core.option_fields("CornerPoseEstimator")}
_BESIDE: Final = {
    "down_sigma_rad": ("down",),
    "camera_height_sigma_m": ("camera_height_m",),
    "length_sigma_m": ("edge_length_m", "box_size_m"),
    "known_edge": ("edge_length_m",),
}
"""Options that tell nothing without one of others."""


class CornerDetector(_core.CornerDetector):
    """Finds corners in single images of one camera: `CornerDetector(camera, method="coloured")`.

    "coloured" finds the corner of a cuboid whose upper, left and right face are red, green and blue (`faces="rgb"`),
    "general" those of rooms, boxes and buildings, by line segments. Tables and scratch are made once; one detector
    may be called from many threads at once; frozen, comparable, and to be pickled. `mask` (H, W) bool, for "general",
    says which pixels may be used; its `gamma_rad` is the angle between the level edges, within 0.001 of pi / 2 the
    right angle. `options` lists all options, docs/corner_images.md says what they mean.
    """

    __slots__ = ()

    def __call__(self, image: ArrayLike, vertical: ArrayLike | None = None) -> list[CornerFeature]:
        """The corners of one image, the best first; at most one for "coloured", which needs colour.

        `vertical` (3,), for "general", is a direction along the vertical in the camera frame, up or down: it says
        which of the three rays is the vertical one. Without it that is the one nearest to the image's columns. Raises
        `InvalidInputError` for an image of another size than the camera's, and for a `vertical` beside colours.
        """
        if self.method != "general":
            if vertical is not None:
                raise InvalidInputError(f"vertical: got one for method {self.method!r}, expected none")
            return self._detect_color(bgr_from(image))
        return self._detect_gray(gray_from(image), vertical)

    def segments(self, image: ArrayLike) -> NDArray[np.float64]:
        """(N, 4): the ends (u, v, u, v) of the line segments that "general" joins, in pixels, the longest first."""
        return self._segments(gray_from(image))


class CornerPoseEstimator(_core.CornerPoseEstimator):
    """The pose of one camera, or of a pair, before a corner: `CornerPoseEstimator(left, right, left_from_right)`.

    `left` and `right` are cameras or `CornerDetector`s, whose `method` and, of "general", `gamma_rad` are also the
    estimator's: what is given beside them has to be the same. `left_from_right` (4, 4) is the right camera's pose in
    the left one's frame, metres. Without `right` only the attitude is estimated, and with `camera_height_m` (the height
    of the camera above the vertex), `edge_length_m` or `box_size_m` the place too; `place_reason` says why there is
    none. Call it with the images of one frame after the other: the last pose is the prior for the next one. `gamma_rad`
    is the angle between the corner's level edges, within 0.001 of pi / 2 the right angle, `down` (3,) the direction
    down in the left camera's frame as far as it is known. Other options are the estimator's, or those of detectors that
    are made here for `method`. Comparable; copies and pickles go on from the same last pose.
    """

    def __new__(
        cls,
        left: Camera | CornerDetector,
        right: Camera | CornerDetector | None = None,
        left_from_right: ArrayLike | None = None,
        *,
        method: str | None = None,
        **options: Any,
    ) -> CornerPoseEstimator:
        own = {name: options.pop(name) for name in _OF_ESTIMATOR if name in options}
        detectors = [one for one in (left, right) if isinstance(one, _core.CornerDetector)]
        if detectors and options:
            names = ", ".join(options)
            raise InvalidInputError(f"options {names}: given beside a CornerDetector, expected with cameras only")
        method = _shared(method, [one.method for one in detectors])
        if method == "general":
            if detectors and own.get("gamma_rad") is None:
                own["gamma_rad"] = detectors[0].options["gamma_rad"]
            if own.get("gamma_rad") is not None:
                options["gamma_rad"] = own["gamma_rad"]

        def detector(camera: Camera | CornerDetector) -> CornerDetector:
            if isinstance(camera, _core.CornerDetector):
                return camera
            return CornerDetector(camera, method=method, **options)

        other = None if right is None else detector(right)
        made = super().__new__(cls, detector(left), other, left_from_right, **own)
        in_force = made.options
        for name, owners in _BESIDE.items():
            if in_force[name] != _OF_ESTIMATOR[name] and all(in_force[owner] is None for owner in owners):
                raise InvalidInputError(f"{name} = {in_force[name]!r} without {' or '.join(owners)}, expected both")
        return made

    def __call__(
        self,
        left: ArrayLike,
        right: ArrayLike | None = None,
        *,
        gravity: tuple[ArrayLike, float] | None = None,
        gyro: tuple[ArrayLike, ArrayLike] | None = None,
    ) -> CornerEstimate:
        """What one frame tells; false if no pose stands out, `reason` says why. One image for one camera, two for a
        pair.

        `gravity` is which way is down in this frame: a direction (3,) in the left camera's frame, and its standard
        deviation in any one direction, radians. `gyro` is how the camera has turned since the frame before: the
        rotation `before_from_now` (3, 3), which takes vectors of the left camera's frame now to that at the frame
        before, and the covariance (3, 3) of the rotation vector of its error, frame now, square radians. Both choose
        between interpretations and say where to look; they do not move a pose. `tiltvp.streams.InertialSamples.known`
        makes them of readings. Raises `InvalidInputError` for what is no direction, rotation or covariance.
        """
        if gravity is not None:
            down, sigma_rad = two_from(gravity, "gravity", "a direction (3,) and its standard deviation")
            gravity = (down, number_from(sigma_rad, "gravity: sigma_rad"))
        if gyro is not None:
            gyro = two_from(gyro, "gyro", "a rotation (3, 3) and its covariance (3, 3)")
        made = bgr_from if self._coloured else gray_from
        if right is None:
            return self._observe(made(left), None, gravity, gyro)
        return self._observe(made(left, "left"), made(right, "right"), gravity, gyro)

    def poses(self, left: ArrayLike, right: ArrayLike | None = None, **known: Any) -> list[BelievedCorner]:
        """All corners of one frame that are believed, each with its `id`, `pose` and edges; that of the pose first.

        Empty where none is. It is `self(left, right, **known).corners`, and goes on from frame to frame alike.
        """
        return self(left, right, **known).corners


def _shared(method: str | None, told: Sequence[str]) -> str:
    """The method that is given, or else that of the detectors, which all have to have the same."""
    for one in told:
        if method is None:
            method = one
        elif one != method:
            raise InvalidInputError(f"method = {method!r} beside a CornerDetector of {one!r}, expected the same")
    return CORNER_METHODS[0] if method is None else method
