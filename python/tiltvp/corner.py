"""Attitude and position from corners: one vertex and three edges, one vertical and two horizontal (Liu et al. 2018).

Bearings are unit vectors of the camera frame. The object's frame has y along the vertical edge, away from the vertex, x
along the edge x, z = x cross y. The edges x and z include `gamma_rad`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from tiltvp import _core
from tiltvp._core import CornerAttitude, CornerAttitudes, CornerFeature, CornerPose, ResolvedAttitude
from tiltvp.arguments import flag_from, number_from, refuse_single, refuse_unless, shaped_from
from tiltvp.corner_boxes import CornerBox, join_boxes
from tiltvp.corner_images import (
    CORNER_METHODS,
    BelievedCorner,
    CornerDetector,
    CornerEstimate,
    CornerHypothesis,
    CornerPoseEstimator,
)
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import ArrayLike, NDArray

    Prior: TypeAlias = "GravityPrior | ElevationPrior | KnownAttitude"

__all__ = [
    "CORNER_METHODS",
    "BelievedCorner",
    "CornerAttitude",
    "CornerAttitudes",
    "CornerBox",
    "CornerDetector",
    "CornerEstimate",
    "CornerFeature",
    "CornerHypothesis",
    "CornerPose",
    "CornerPoseEstimator",
    "ElevationPrior",
    "GravityPrior",
    "KnownAttitude",
    "ResolvedAttitude",
    "attitudes",
    "fit",
    "included_angle",
    "join_boxes",
    "poses",
    "resolve",
    "screen",
    "solve",
    "solve_many",
    "triangulate",
]

_RIGHT: Final = math.pi / 2

Sense = Literal["either", "down", "up"]
"""Which way a corner's vertical edge runs from the vertex."""


@dataclass(frozen=True)
class GravityPrior:
    """The direction of gravity in the camera frame, as from an accelerometer at rest.

    `down` is a unit vector, `sigma_rad` its standard deviation in any one direction, `sense` which way the vertical
    edge runs from the vertex: "down" as from a table's corner, "up" as from a corner on the floor, or "either".
    """

    down: tuple[float, float, float]
    sigma_rad: float
    sense: Sense = "either"

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name."""
        return {"down": [float(x) for x in self.down], "sigma_rad": float(self.sigma_rad), "sense": self.sense}


@dataclass(frozen=True)
class ElevationPrior:
    """How far the optical axis points above the horizon, in [-pi/2, pi/2] radians; its sign alone often decides."""

    elevation_rad: float
    sigma_rad: float
    sense: Sense = "either"

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name."""
        return {"elevation_rad": float(self.elevation_rad), "sigma_rad": float(self.sigma_rad), "sense": self.sense}


@dataclass(frozen=True)
class KnownAttitude:
    """A whole attitude, as of the frame before: rows of (3, 3) matrices.

    `covariance_rad2` is that of the rotation vector (camera frame) of its error.
    """

    camera_from_object: tuple[tuple[float, ...], ...]
    covariance_rad2: tuple[tuple[float, ...], ...]

    @classmethod
    def of(cls, camera_from_object: ArrayLike, sigma_rad: float) -> KnownAttitude:
        """From a (3, 3) rotation that may be off by `sigma_rad` about any axis. Raises `InvalidInputError`."""
        rotation = shaped_from(camera_from_object, "camera_from_object", 3, 3)
        sigma_rad = number_from(sigma_rad, "sigma_rad")
        if not 0.0 <= sigma_rad < math.inf:
            raise InvalidInputError(f"sigma_rad = {sigma_rad}, expected a standard deviation, finite and not negative")
        rows = tuple(tuple(float(x) for x in row) for row in rotation)
        return cls(rows, tuple(tuple(float(x) for x in row) for row in np.eye(3) * sigma_rad * sigma_rad))

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name."""
        return {
            "camera_from_object": [list(row) for row in self.camera_from_object],
            "covariance_rad2": [list(row) for row in self.covariance_rad2],
        }


def solve(
    vertex: ArrayLike, x_ray: ArrayLike, y_ray: ArrayLike, z_ray: ArrayLike, gamma_rad: float = _RIGHT
) -> list[CornerAttitude]:
    """Every attitude under which a corner looks like this, in closed form (section III).

    (3,) bearings of any length: of the vertex, and of a further point on the ray of each edge, y the vertical one.
    Mostly two attitudes, the two interpretations of fig. 3, plain and mirrored; four where an edge points towards
    the camera and the angle is obtuse (III-C); none where no such corner looks like this. Raises
    `InvalidInputError` for a ray's point at the vertex, for what is not finite, and unless 0 < gamma_rad < pi.
    """
    return _core.solve_corner(vertex, x_ray, y_ray, z_ray, gamma_rad)


def solve_many(
    vertex: ArrayLike, x_ray: ArrayLike, y_ray: ArrayLike, z_ray: ArrayLike, gamma_rad: ArrayLike = _RIGHT
) -> CornerAttitudes:
    """The same for many corners: (N, 3) arrays; one included angle, or (N,)."""
    return _core.solve_corners(vertex, x_ray, y_ray, z_ray, gamma_rad)


def fit(x: ArrayLike, y: ArrayLike, z: ArrayLike, *, sigma_rad: float) -> CornerFeature:
    """The feature of bearings along three rays, each fitted by least squares, and their vertex (eqs. 25 to 27).

    (N, 3) unit bearings for each edge, from the vertex outwards, y the vertical one; `sigma_rad` is the standard
    deviation of each bearing across its ray. Raises `InvalidInputError` for bearings that are no three rays with a
    common vertex.
    """
    return _core.fit_corner(x, y, z, sigma_rad)


def attitudes(
    feature: CornerFeature, gamma_rad: float = _RIGHT, *, gamma_sigma_rad: float = 0.0
) -> list[CornerAttitude]:
    """Every attitude that a feature admits, with the covariance that its rays' covariances and gamma's bring."""
    _checked([feature])
    return _core.corner_attitudes(feature, gamma_rad, gamma_sigma_rad)


def screen(feature: CornerFeature, gamma_rad: float = _RIGHT) -> str | None:
    """Why no corner of that angle looks like the feature (section II-A3), in a sentence; None if one does."""
    _checked([feature])
    return _core.screen_corner(feature, gamma_rad)


def included_angle(
    feature: CornerFeature, vertical: ArrayLike, vertical_covariance_rad2: ArrayLike | None = None
) -> tuple[float, float] | None:
    """The angle between the horizontal edges and its standard deviation, radians, from a known vertical (III-E).

    `vertical` is a unit vector along the vertical edge, either way, camera frame, as the column y of a known attitude;
    `vertical_covariance_rad2` (3, 3) is the covariance of the rotation vector of its error. None where the vertex is
    seen horizontally, when both edges' planes hold the line of sight and nothing tells the angle.
    """
    _checked([feature])
    covariance = np.zeros((3, 3)) if vertical_covariance_rad2 is None else vertical_covariance_rad2
    return _core.included_angle(feature, vertical, covariance)


def resolve(
    features: Sequence[CornerFeature],
    gamma_rad: float = _RIGHT,
    *,
    common_from_camera: Sequence[ArrayLike] | None = None,
    gamma_sigma_rad: float = 0.0,
    alignment: Literal["same", "manhattan", "vertical"] = "same",
    right_handed: bool | None = None,
    priors: Sequence[Prior] = (),
) -> list[ResolvedAttitude]:
    """The attitudes that several features agree on, the likeliest first, with probabilities that add up to 1 (but for
    those below 1e-9, which are left out).

    Features of one camera, or of several whose rotations to a common frame are given, (3, 3) each. `alignment` says how
    the objects' frames stand: the "same", "manhattan" (right angles, named anyhow), or sharing the "vertical" only.
    `right_handed` says, for a known object, whether its edges x, y, z are a right-handed triple. One feature will do,
    with priors or without. Nothing is guessed: what cannot be told apart is returned as it is. Empty where one of them
    is no corner of that angle.
    """
    corners = _checked(features)
    if common_from_camera is None:
        common_from_camera = [np.eye(3)] * len(corners)
    refuse_single(common_from_camera, "common_from_camera", "several rotations (3, 3)")
    known = _known_beforehand(gamma_rad, gamma_sigma_rad, right_handed, priors)
    return _core.resolve_corners(corners, list(common_from_camera), known, alignment)


def poses(
    left: CornerFeature,
    right: CornerFeature,
    left_from_right: ArrayLike,
    gamma_rad: float = _RIGHT,
    *,
    gamma_sigma_rad: float = 0.0,
    right_handed: bool | None = None,
    priors: Sequence[Prior] = (),
    fuse: bool = True,
) -> list[CornerPose]:
    """The poses that explain the features of a pair of cameras, the likeliest first; their probabilities add up to 1
    (but for those below 1e-9, which are left out).

    `left_from_right` is the (4, 4) rigid motion, metres, that takes points of the right camera's frame to the left
    one's; the cameras may be of any kind. The interpretations are told apart by the agreement of the two views, by
    `right_handed` and by `priors` (left camera's frame). With `fuse` the six rays are fused by least squares from
    there. Empty where either feature is no corner of that angle, and where the vertex is not before both cameras.
    """
    _checked([left, right])
    known = _known_beforehand(gamma_rad, gamma_sigma_rad, right_handed, priors)
    return _core.corner_poses(left, right, left_from_right, known, flag_from(fuse, "fuse"))


def _checked(features: Iterable[CornerFeature]) -> list[CornerFeature]:
    refuse_single(features, "features", "several CornerFeature")
    found = list(features)
    for one in found:
        refuse_unless(one, CornerFeature, "feature", "a CornerFeature, as fit gives it")
    return found


def _known_beforehand(
    gamma_rad: float, gamma_sigma_rad: float, right_handed: bool | None, priors: Sequence[Prior]
) -> dict[str, object]:
    if not isinstance(right_handed, bool | np.bool_ | None):
        raise InvalidInputError(f"right_handed = {right_handed!r}, expected True, False or None")
    return {
        "gamma_rad": number_from(gamma_rad, "gamma_rad"), "right_handed": right_handed, "priors": priors,
        "gamma_sigma_rad": number_from(gamma_sigma_rad, "gamma_sigma_rad"),
    }  # fmt: skip


def triangulate(
    bearings: ArrayLike, covariances_rad2: Sequence[ArrayLike], rig_from_camera: Sequence[ArrayLike]
) -> tuple[NDArray[np.float64], NDArray[np.float64], float] | None:
    """A point (3,) in metres, its covariance (3, 3), and the chi-square of the bearings' misses.

    (N, 3) unit bearings, each with its (2, 2) covariance in its tangent plane and the (4, 4) place of its camera. None
    where the lines of sight are parallel or the point would be behind a camera.
    """
    rays = shaped_from(bearings, "bearings", None, 3)
    spread = shaped_from(covariances_rad2, "covariances_rad2", len(rays), 2, 2)
    places = shaped_from(rig_from_camera, "rig_from_camera", len(rays), 4, 4)
    return _core.triangulate(rays, list(spread), list(places))
