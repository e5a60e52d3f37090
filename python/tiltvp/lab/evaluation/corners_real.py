"""Corners of real things: a cabinet before motion capture, and a box of tea before a pair of cameras."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from tiltvp.cameras import Camera
from tiltvp.corner import CornerEstimate, CornerPoseEstimator
from tiltvp.errors import InvalidInputError
from tiltvp.images import read_image
from tiltvp.stereo_rigs import StereoRig
from tiltvp.streams import open_frames

Show = Callable[[int, NDArray[np.uint8], CornerEstimate], None]
"""Takes the number of a frame, its (left) image, and what was found."""

__all__ = [
    "CABINET_PITCH_DEG",
    "TEA_BOX_MM",
    "TEA_BOX_PITCH_DEG",
    "Cabinet",
    "TeaBox",
    "cabinet",
    "cabinet_camera",
    "steps",
    "tea_box",
    "tea_box_rig",
]

Matrix = NDArray[np.float64]
CABINET_PITCH_DEG: Final = -45.0
"""Roughly how the camera was held, which says which edge of the first image is vertical."""
TEA_BOX_PITCH_DEG: Final = -45.0
TEA_BOX_MM: Final = {"long": 165.0, "depth": 68.0, "height": 80.0}
"""By ViSP's model of the box."""
_INTRINSICS: Final = (535.4, 539.2, 320.1, 247.6)
_LONG_MM: Final = 110.0
_LINE_PX: Final = 25.0
"""Shorter lines tell a direction to a degree."""
_NEAR_DEG: Final = 4.0
"""Lines farther from the axes of either attitude are of other things; the attitudes differ by less."""


@dataclass(frozen=True)
class Cabinet:
    """What became of the cabinet's images."""

    frames: int
    places: NDArray[np.int64]
    """(N,): which images had a pose."""
    error_deg: Matrix
    """(N,): angle between estimated and true attitude after one constant turn about the vertical."""
    free_error_deg: Matrix
    """(N,): the same after one constant turn about any axis."""
    lean_deg: float
    """How far the cabinet's vertical is from that of the motion capture."""
    nees: Matrix
    """(N,): `error_deg` squared by the stated covariance, 3 on average at best."""
    edges_off_deg: Matrix
    """(N, 2): how far edges of OpenCV's LSD are off their axes, medians by length, with the axes as estimated and as
    captured. We do not find these edges, so that they tell which of the two is wrong."""


@dataclass(frozen=True)
class TeaBox:
    """What became of the pairs of images of the box."""

    frames: int
    places: NDArray[np.int64]
    """(N,): which pairs had a pose."""
    objects: NDArray[np.int64]
    """(N,): the number of the corner that each pose is of."""
    vertex_m: Matrix
    """(N, 3)"""
    attitudes: Matrix
    """(N, 3, 3): `camera_from_object`."""
    angles_deg: Matrix
    """(N, 3): between the edges x y, y z, z x, each from the vertex to its end, both triangulated: nothing makes them
    right. NaN where an end is not seen in both images."""
    lengths_mm: dict[str, Matrix]
    """(N,) each: lengths of the edges `long`, `depth` and `height`, from vertex to vertex; NaN where no end is seen."""


def cabinet(folder: Path, advance: Callable[[], None] = lambda: None, show: Show | None = None) -> Cabinet:
    """The attitude of the one camera in each image of the cabinet, against motion capture."""
    files = sorted((folder / "raw_imgs").glob("*.jpg"))
    truth = np.loadtxt(folder / "truth_cam_poses.txt", ndmin=2)
    if not files or len(files) != len(truth):
        raise InvalidInputError(f"{folder}: {len(files)} images and {len(truth)} poses, expected as many of both")
    estimator = CornerPoseEstimator(cabinet_camera(), method="general", down=_down(CABINET_PITCH_DEG))
    places, seen, looks = [], [], []
    for place, file in enumerate(files):
        image = read_image(file)
        estimate = estimator(image)
        if show is not None:
            show(place, image, estimate)
        if estimate.pose is not None:
            places.append(place)
            seen.append(_rotation(truth[place, 4:8]) @ estimate.pose.camera_from_object)
            looks.append((_line_normals(image), estimate.pose.covariance[:3, :3]))
        advance()
    if not seen:
        raise InvalidInputError(f"{folder}: no corner in any image")
    mean = seen[len(seen) // 2]
    for _ in range(10):
        renamed = [
            max((turn @ naming for naming in _namings()), key=lambda a: float(np.trace(mean.T @ a))) for turn in seen
        ]
        mean = mean @ _exp(np.median([_log(mean.T @ turn) for turn in renamed], axis=0))
    lean = math.acos(min(1.0, abs(float(mean[2, 1]))))
    up = mean[:, 1] * np.sign(mean[2, 1])
    axis = np.cross(up, [0.0, 0.0, 1.0])
    level = _exp(axis) @ mean
    for _ in range(5):
        level = level @ _exp(np.array([0.0, np.mean([_log(level.T @ turn)[1] for turn in renamed]), 0.0]))
    errors = [[np.degrees(np.linalg.norm(_log(one.T @ turn))) for turn in renamed] for one in (level, mean)]
    nees, edges = [], []
    for place, turn, (lines, covariance) in zip(places, renamed, looks, strict=True):
        from_capture = _rotation(truth[place, 4:8]).T
        own, told = from_capture @ turn, from_capture @ level
        error = _log(own @ told.T)
        nees.append(error @ np.linalg.solve(covariance, error))
        edges.append(_off_axes_deg(*lines, (own, told)))
    return Cabinet(
        len(files),
        np.array(places),
        np.array(errors[0]),
        np.array(errors[1]),
        math.degrees(lean),
        np.array(nees),
        np.array(edges),
    )


def _line_normals(image: NDArray[np.uint8]) -> tuple[Matrix, Matrix]:
    """The normals (K, 3) of OpenCV's line segments in an image of the cabinet, and their lengths, pixels."""
    found = cv2.createLineSegmentDetector().detect(image if image.ndim == 2 else image.mean(axis=2).astype(np.uint8))[0]
    ends = np.zeros((0, 2, 2)) if found is None else np.asarray(found, dtype=np.float64).reshape(-1, 2, 2)
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    ends, lengths = ends[lengths >= _LINE_PX], lengths[lengths >= _LINE_PX]
    lens = cabinet_camera()
    normals = np.cross(lens.unproject(ends[:, 0]), lens.unproject(ends[:, 1]))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True), lengths


def _off_axes_deg(normals: Matrix, lengths: Matrix, attitudes: tuple[Matrix, Matrix]) -> tuple[float, float]:
    """How far lines are from the nearest axis of either attitude, medians by length, of those that are near both."""
    off = np.degrees(np.array([np.arcsin(np.abs(normals @ attitude).min(axis=1)) for attitude in attitudes]))
    near = off.max(axis=0) <= _NEAR_DEG
    medians = []
    for one in off[:, near]:
        order = np.argsort(one)
        half = np.searchsorted(np.cumsum(lengths[near][order]), 0.5 * lengths[near].sum())
        medians.append(float(one[order][half]) if near.any() else math.nan)
    return medians[0], medians[1]


def cabinet_camera() -> Camera:
    """The camera of the cabinet's images, whose distortion has been taken out."""
    fx, fy, cx, cy = _INTRINSICS
    return Camera.pinhole(width=640, height=480, fx=fx, fy=fy, cx=cx, cy=cy)


def tea_box_rig(folder: Path) -> StereoRig:
    """The cameras of the box, from ViSP's files."""
    cameras = []
    for side in ("left", "right"):
        tree = ElementTree.parse(folder / f"teabox_{side}.xml")
        values = {name: float(tree.findtext(f".//camera/{name}") or "nan") for name in ("px", "py", "u0", "v0")}
        cameras.append(
            Camera.pinhole(width=640, height=480, fx=values["px"], fy=values["py"], cx=values["u0"], cy=values["v0"])
        )
    right_from_left: Matrix = np.loadtxt(folder / "cRightMcLeft.txt")
    u, _, v = np.linalg.svd(right_from_left[:3, :3])
    right_from_left[:3, :3] = u @ v
    return StereoRig(cameras[0], cameras[1], np.asarray(np.linalg.inv(right_from_left), dtype=np.float64))


def tea_box(folder: Path, advance: Callable[[], None] = lambda: None, show: Show | None = None) -> TeaBox:
    """The pose of the pair of cameras before the box, in each pair of frames, and the box' angles and lengths."""
    rig = tea_box_rig(folder)
    estimator = CornerPoseEstimator(
        rig.left, rig.right, rig.left_from_right, method="general", down=_down(TEA_BOX_PITCH_DEG)
    )
    videos = [open_frames(folder / f"teabox_{side}.mp4") for side in ("left", "right")]
    rows = []
    frames = 0
    for place, pair in enumerate(zip(*videos, strict=True)):
        frames += 1
        left, right = (frame.read() for frame in pair)
        estimate = estimator(left, right)
        if show is not None:
            show(place, left, estimate)
        pose = estimate.pose
        if pose is not None and pose.vertex_m is not None and estimate.chosen_right is not None:
            rows.append((
                place, estimate.object, pose.vertex_m, pose.camera_from_object, _angles(estimate), _lengths_mm(estimate)
            ))  # fmt: skip
        advance()
    if not rows:
        raise InvalidInputError(f"{folder}: no corner in any pair of frames")
    places, objects, vertices, attitudes, angles, lengths = zip(*rows, strict=True)
    return TeaBox(
        frames, np.array(places), np.array(objects), np.array(vertices), np.array(attitudes), np.array(angles),
        dict(zip(TEA_BOX_MM, np.array(lengths).T, strict=True)),
    )  # fmt: skip


def steps(box: TeaBox) -> tuple[Matrix, Matrix]:
    """How far vertex (mm) and attitude (degrees) move between neighbouring frames of the same corner."""
    next_to = (np.diff(box.places) == 1) & (np.diff(box.objects) == 0)
    move = 1e3 * np.linalg.norm(np.diff(box.vertex_m, axis=0), axis=1)
    turn = [
        np.degrees(np.linalg.norm(_log(a.T @ b))) for a, b in zip(box.attitudes[:-1], box.attitudes[1:], strict=True)
    ]
    return move[next_to], np.array(turn)[next_to]


def _angles(estimate: CornerEstimate) -> Matrix:
    """(3,): degrees between the edges, each from the triangulated vertex to its triangulated end."""
    assert estimate.pose is not None
    assert estimate.pose.vertex_m is not None
    edges = estimate.edge_ends_m - estimate.pose.vertex_m
    edges /= np.linalg.norm(edges, axis=1, keepdims=True)
    cosines = np.clip([edges[0] @ edges[1], edges[1] @ edges[2], edges[2] @ edges[0]], -1.0, 1.0)
    return np.asarray(np.degrees(np.arccos(cosines)), dtype=np.float64)


def _lengths_mm(estimate: CornerEstimate) -> tuple[float, float, float]:
    """The edges long, depth and height: y is the upright one, of the others the longer one is long."""
    x, y, z = (1e3 * estimate.edge_lengths_m).tolist()
    level = [length for length in (x, z) if not math.isnan(length)]
    long = [length for length in level if length > _LONG_MM]
    short = [length for length in level if length <= _LONG_MM]
    return (max(long, default=math.nan), min(short, default=math.nan), y)


def _down(pitch_deg: float) -> tuple[float, float, float]:
    pitch = math.radians(pitch_deg)
    return 0.0, math.cos(pitch), -math.sin(pitch)


def _namings() -> Iterator[Matrix]:
    for quarter, over in product(range(4), (1.0, -1.0)):
        yield _exp(np.array([0.0, 0.5 * math.pi * quarter, 0.0])) @ np.diag([1.0, over, over])


def _exp(vector: Matrix) -> Matrix:
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Matrix = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross
    return turn


def _log(rotation: Matrix) -> Matrix:
    axis = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    sine = float(np.linalg.norm(axis))
    angle = math.atan2(sine, float(np.trace(rotation)) - 1.0)
    return np.asarray(axis * (angle / sine if sine > 1e-12 else 0.5), dtype=np.float64)


def _rotation(quaternion: Matrix) -> Matrix:
    """From x, y, z, w, to the digits that the file has."""
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
