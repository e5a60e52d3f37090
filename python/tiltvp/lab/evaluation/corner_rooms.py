"""What an estimate in a rendered room is of: a corner of the list of the scene's, or one that the list lacks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.corner_images import BelievedCorner, CornerEstimate, CornerHypothesis
from tiltvp.synth import SceneCorner, StereoSequence

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "attitude_near",
    "attitudes_of",
    "lengths_off",
    "named_near",
    "own_places",
    "rotation_vector",
    "surface_off",
    "truth_near",
]

_SAME_M: Final = 0.08
"""An estimate is of the listed corner that is this near"""

_SAME_PX: Final = 8.0
"""and as near to it in the image: closer vertices are one to the detector. How far away it is remains to be judged."""

_PIXEL_RAD: Final = 1.5e-3
"""A pixel of the cameras of `zed_cameras` at 1280 x 720."""

_EDGE_WIDTH: Final = 0.005
"""How thick what makes an edge may be, as a share of the distance: rounded edges, joints of boards."""

_OFF_SIGMAS: Final = 3.0
"""A place of an edge is on no surface that is as many standard deviations from each"""

_OFF_LENGTH: Final = 0.25
"""and an edge's length is wrong of which this share is on none."""

_PARTS: Final = np.linspace(0.1, 0.97, 12)
"""Where along edges is looked, between the vertex and the end."""

_BESIDE_M: Final = 1.0
"""Corners that are this near may be of the same piece of furniture, and their edges parallel."""

_QUARTER: Final = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
_NAMINGS: Final = [
    np.linalg.matrix_power(_QUARTER, k) @ np.diag([1.0, over, over]) for k, over in product(range(4), (1.0, -1.0))
]
"""An object's axes keep their directions from corner to corner, whichever way the edges of each run along them."""


def own_places(sequence: StereoSequence, estimates: Sequence[CornerEstimate]) -> dict[int, NDArray[np.float64]]:
    """For each number of an object its median place in the world, by the true motion."""
    seen: dict[int, list[NDArray[np.float64]]] = {}
    for world_from_left, estimate in zip(sequence.poses_at(sequence.times_s), estimates, strict=False):
        pose = estimate.pose
        if pose is not None and pose.vertex_m is not None:
            place = world_from_left[:3, :3] @ pose.vertex_m + world_from_left[:3, 3]
            seen.setdefault(estimate.object, []).append(place)
    return {number: np.median(places, axis=0) for number, places in seen.items()}


def surface_off(sequence: StereoSequence, frame: int, pose: CornerHypothesis) -> float:
    """How far along its line of sight a vertex is from the nearest surface seen there, in its standard deviations.

    Surfaces are those within 2 pixels; half a percent of the distance, which the edges' own width makes, is added to
    the standard deviation. Listed or not, a corner of two things that meet in the image alone is on neither.
    """
    assert pose.vertex_m is not None
    sigma_m = _share_along(pose) * float(np.linalg.norm(pose.vertex_m))
    return _beside_surface_m(sequence, frame, pose.vertex_m) / sigma_m


def lengths_off(sequence: StereoSequence, frame: int, corners: Iterable[BelievedCorner]) -> tuple[int, int]:
    """How many lengths of edges are told of a frame, and those of which a quarter or more is on no surface: an edge
    that ends where a line before or behind it crosses it, or that another one goes on in the image alone.
    """
    told, off = 0, 0
    for corner in corners:
        if (vertex_m := corner.pose.vertex_m) is None:
            continue
        share = _share_along(corner.pose)
        for edge, length_m in zip(corner.pose.edges, corner.edge_lengths_m, strict=True):
            if not np.isfinite(length_m):
                continue
            places = [vertex_m + edge * (length_m * part) for part in _PARTS]
            away = [_beside_surface_m(sequence, frame, place) / float(np.linalg.norm(place)) for place in places]
            told += 1
            off += bool(np.mean(np.array(away) > _OFF_SIGMAS * share) >= _OFF_LENGTH)
    return told, off


def _share_along(pose: CornerHypothesis) -> float:
    """The standard deviation of how far a vertex is, as a share of that, with that of the edges' own width."""
    assert pose.vertex_m is not None
    distance = float(np.linalg.norm(pose.vertex_m))
    along = pose.vertex_m / distance
    return float(np.sqrt(along @ pose.covariance[3:, 3:] @ along)) / distance + _EDGE_WIDTH


def _beside_surface_m(sequence: StereoSequence, frame: int, place_m: NDArray[np.float64]) -> float:
    """How far along its line of sight a place is from the nearest surface seen there, within 2 pixels."""
    distance = float(np.linalg.norm(place_m))
    along = place_m / distance
    across = np.linalg.svd(along[None])[2][1:]
    reach = 2.0 * _PIXEL_RAD
    angles = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    ring = np.column_stack([np.cos(angles), np.sin(angles)]) @ across
    bearings = np.concatenate([[along], along + 0.5 * reach * ring, along + reach * ring])
    return float(np.nanmin(np.abs(sequence.distances(frame, bearings) - distance)))


def truth_near(
    sequence: StereoSequence, frame: int, pose: CornerHypothesis, own_place_m: NDArray[np.float64]
) -> tuple[int, NDArray[np.float64]]:
    """The listed corner that an estimate is of, or -1, and its pose (4, 4) in the left camera.

    It is of the nearest that both cameras see, near it in space and in the image, by whichever edges: boards that end
    in one place have several. Where there is none the place is `own_place_m`, in the world, which tells how steady
    estimates are and not whether they are right; the attitude is that of the room's walls or of a corner beside it.
    Axes are named as the estimate has them.
    """
    assert pose.vertex_m is not None
    from_world = np.linalg.inv(sequence.poses_at([sequence.times_s[frame]])[0])
    corners = sequence.corners
    vertices = np.array([corner.position_m for corner in corners]) @ from_world[:3, :3].T + from_world[:3, 3]
    away = np.linalg.norm(vertices - pose.vertex_m, axis=1)
    number = int(np.argmin(away))
    truth = np.eye(4)
    towards = pose.vertex_m / np.linalg.norm(pose.vertex_m)
    aside = np.linalg.norm(np.cross(vertices, towards), axis=1) / np.linalg.norm(vertices, axis=1)
    near = (away <= _SAME_M) & (aside <= _SAME_PX * _PIXEL_RAD)
    same = [k for k in sequence.truth(frame).corners if near[k]]
    if same:
        number = min(same, key=lambda k: float(away[k]))
        # Of corners in one place, as of stacked boxes, the one nearest to the estimate.
        candidates = np.array([k for k in same if away[k] < away[number] + 1e-6])
        truth[:3, 3] = vertices[number]
    else:
        number = -1
        # The room's own corners come first.
        candidates = np.union1d([0], np.flatnonzero(away <= _BESIDE_M))
        truth[:3, 3] = from_world[:3, :3] @ own_place_m + from_world[:3, 3]
    every = [
        (int(k), from_world[:3, :3] @ corners[k].world_from_object @ naming) for k in candidates for naming in _NAMINGS
    ]
    nearest, truth[:3, :3] = max(every, key=lambda one: float(np.trace(one[1] @ pose.camera_from_object.T)))
    return (number if number < 0 else nearest), truth


def attitude_near(sequence: StereoSequence, frame: int, camera_from_object: NDArray[np.float64]) -> NDArray[np.float64]:
    """The attitude (3, 3) of a listed corner that is nearest to an estimate's, its axes named as the estimate has them:
    that of one camera, which tells no place.
    """
    from_world = np.linalg.inv(sequence.poses_at([sequence.times_s[frame]])[0])[:3, :3]
    return named_near([from_world @ attitude for attitude in attitudes_of(sequence.corners)], camera_from_object)


def attitudes_of(corners: Sequence[SceneCorner]) -> NDArray[np.float64]:
    """(N, 3, 3): the different attitudes of corners, in the world."""
    listed: NDArray[np.float64] = np.unique(np.round([corner.world_from_object for corner in corners], 9), axis=0)
    return listed


def named_near(attitudes: Iterable[NDArray[np.float64]], estimate: NDArray[np.float64]) -> NDArray[np.float64]:
    """The one of some attitudes (3, 3), its axes named as the estimate has them, that is nearest to it."""
    every = [attitude @ naming for attitude in attitudes for naming in _NAMINGS]
    return max(every, key=lambda one: float(np.trace(one @ estimate.T)))


def rotation_vector(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,): from the rotation's quaternion, for any angle."""
    import cv2

    return np.asarray(cv2.Rodrigues(rotation)[0], dtype=np.float64).ravel()
