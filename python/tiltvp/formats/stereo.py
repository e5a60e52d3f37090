"""Pairs of cameras: Kalibr's camchain with two cameras, and our own TOML.

format = "tiltvp-stereo"
version = 1
left_from_right = [[1, 0, 0, 0.12], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
[left]
model = "pinhole"
width = 1280
height = 720
[left.parameters]
fx = 702.0
...
[right]
...
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NoReturn

import numpy as np
from numpy.typing import NDArray

from tiltvp.arguments import size_from
from tiltvp.files import write_whole
from tiltvp.formats import kalibr, opencv
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.own import as_floats, camera_from, camera_table
from tiltvp.formats.spec import CameraSpec, ImageSize

__all__ = ["StereoSpec", "is_own", "read_stereo", "rigid_motion", "write_stereo_toml"]

_FORMAT: Final = "tiltvp-stereo"
_VERSION: Final = 1
_MARK: Final = re.compile(r"^[^\S\n]*format[^\S\n]*=[^\S\n]*[\"']tiltvp-stereo[\"']", re.MULTILINE)
_EXPECTED: Final = 'a camchain of Kalibr with two cameras, or a file with format = "tiltvp-stereo"'


@dataclass(frozen=True, eq=False)
class StereoSpec:
    """Two cameras and how they sit to each other, as a file tells."""

    left: CameraSpec
    right: CameraSpec
    left_from_right: NDArray[np.float64]
    """(4, 4): takes points of the right camera's frame to the left one's, metres."""


def is_own(document: Document) -> bool:
    """Whether it is our own TOML of a pair."""
    return _MARK.search(document.text) is not None


def read_stereo(path: str | os.PathLike[str], image_size: ImageSize | None = None) -> StereoSpec:
    """The pair of a file. Raises `tiltvp.errors.CalibrationError` that says what was wrong, what was expected and
    where.
    """
    image_size = None if image_size is None else size_from(image_size, "image_size")
    document = Document.load(path)
    if is_own(document):
        return _own(document, image_size)
    if kalibr.recognise(document):
        return _camchain(document, image_size)
    if opencv.is_pair(document):
        document.fail(
            "a pair of OpenCV, which is not read: its T may be in metres, millimetres or squares of its board",
            f"{_EXPECTED}; StereoRig(left, right, left_from_right).save(path) writes one",
            "the top of the file",
        )
    document.fail("is no calibration of a pair of cameras", _EXPECTED, "the top of the file")


def write_stereo_toml(spec: StereoSpec, path: str | os.PathLike[str]) -> None:
    """Writes a pair to `path`; the file appears whole or not at all. Raises `OutputError`."""
    tree = {"format": _FORMAT, "version": _VERSION, "left_from_right": np.asarray(spec.left_from_right).tolist()}
    tree |= {"left": camera_table(as_floats(spec.left)), "right": camera_table(as_floats(spec.right))}
    import tomli_w

    write_whole(path, tomli_w.dumps(tree))


def _own(document: Document, image_size: ImageSize | None) -> StereoSpec:
    root = Node(document, document.toml("a file written by tiltvp"))
    root.only("format", "version", "left_from_right", "left", "right")
    version = root.need("version")
    if version.integer() != _VERSION:
        version.refuse(f"version {version.integer()} is not supported", f"version {_VERSION}")
    left, right = (camera_from(root.need(side), image_size) for side in ("left", "right"))
    return StereoSpec(left, right, _motion(root.need("left_from_right")))


def _camchain(document: Document, image_size: ImageSize | None) -> StereoSpec:
    cameras = kalibr.parse(document, image_size)
    if len(cameras) != 2:
        document.fail(f"{len(cameras)} cameras", "two, the left one first", "the top of the file")
    names = [key for key in document.tree if re.fullmatch(r"cam\d+", key)]
    right_from_left = _motion(Node.root(document).need(names[1]).need("T_cn_cnm1"))
    return StereoSpec(cameras[0], cameras[1], _inverse(right_from_left))


def _motion(node: Node) -> NDArray[np.float64]:
    return rigid_motion(node.value, node.fail)


def rigid_motion(value: object, fail: Callable[[str, str], NoReturn]) -> NDArray[np.float64]:
    """A (4, 4) motion between two places; a rotation to the digits that files have is made one to all.

    `fail` raises for anything else, with what was wrong and what expected.
    """
    try:
        matrix = np.array(value, dtype=np.float64)
    except (ValueError, TypeError, OverflowError):
        matrix = np.zeros(0)
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        fail("is no (4, 4) matrix of numbers", "four rows of four numbers")
    u, _, v = np.linalg.svd(matrix[:3, :3])
    nearest = u @ v
    off = float(np.abs(nearest - matrix[:3, :3]).max())
    if off > 1e-3 or np.linalg.det(nearest) < 0.0 or not np.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0]):
        fail(f"is no rigid motion (its rotation is off by {off:.1e})", "a rotation, a translation, and 0 0 0 1 below")
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = nearest, matrix[:3, 3]
    if not np.linalg.norm(motion[:3, 3]) > 0.0:
        fail("no baseline", "two places")
    return motion


def _inverse(motion: NDArray[np.float64]) -> NDArray[np.float64]:
    back = np.eye(4)
    back[:3, :3] = motion[:3, :3].T
    back[:3, 3] = -motion[:3, :3].T @ motion[:3, 3]
    return back
