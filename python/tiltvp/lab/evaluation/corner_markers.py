"""ArUco markers on the cuboid: what OpenCV makes of them, in the frames in which corners are sought."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from tiltvp._core import Camera
    from tiltvp.synth import StereoSequence

    Corners = dict[int, NDArray[np.float64]]

__all__ = ["MarkerLooks", "MarkerPose"]

_APRILTAG_SHIFT_PX: Final = 0.45
"""By how much AprilTag's corners are too far to the right and below, in the mean over drawn squares (OpenCV 5.0)."""

_WAYS: Final = {
    "": ("CORNER_REFINE_SUBPIX", 0.0, False),
    ", AprilTag's corners": ("CORNER_REFINE_APRILTAG", _APRILTAG_SHIFT_PX, False),
    ", AprilTag's corners, linear light": ("CORNER_REFINE_APRILTAG", _APRILTAG_SHIFT_PX, True),
}
"""How corners are found between pixels, by how much they are shifted, and whether levels are made proportional to light
first: as is usual, and as was best of OpenCV's four ways (12 frames at 1.1 m), of images as they are and without their
display curve, by which what is black on white looks smaller where it is blurred."""

_LIGHT: Final = np.rint(255.0 * (np.arange(256) / 255.0) ** 2.2).astype(np.uint8)
"""Of grey levels: without the display curve of rendered images."""

_ITERATIONS: Final = 10
"""Of Gauss and Newton's method, from one camera's pose; no test of convergence."""

_CARD_M: Final = 0.001
"""How far a marker is before its face (`tiltvp.synth.Laboratory`)."""


@dataclass(frozen=True)
class MarkerPose:
    """The pose of the cuboid that markers tell."""

    camera_from_object: NDArray[np.float64]
    """(3, 3): the attitude of the corner's frame in the left camera."""
    vertex_m: NDArray[np.float64]
    """(3,): the corner in the left camera."""


class MarkerLooks:
    """What OpenCV makes of the markers on the coloured cuboid: of all that it finds in the left image, and in both."""

    def __init__(self, sequence: StereoSequence, marker_m: float) -> None:
        """`marker_m` is the markers' side."""
        import cv2

        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        self._detectors = {}
        for name, (refinement, shift_px, linear) in _WAYS.items():
            parameters = cv2.aruco.DetectorParameters()
            parameters.cornerRefinementMethod = getattr(cv2.aruco, refinement)
            self._detectors[name] = (cv2.aruco.ArucoDetector(dictionary, parameters), shift_px, linear)
        self._cameras = sequence.cameras
        right_from_left = np.linalg.inv(sequence.left_from_right)
        self._to_right = (cv2.Rodrigues(right_from_left[:3, :3])[0], right_from_left[:3, 3:])
        x, y, z = np.diag(sequence.corners[sequence.corner].lengths_m)
        e_x, e_y, e_z = np.eye(3)
        faces = [(x + y, e_z, e_x, -e_y), (y + z, e_x, -e_z, -e_y), (x + z, e_y, e_x, e_z)]
        around = np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])
        self._places = {
            name: 0.5 * both - _CARD_M * inwards + 0.5 * marker_m * around @ np.array([right, up])
            for name, (both, inwards, right, up) in enumerate(faces)
        }
        """(4, 3) each: corners in the object's frame, in the order in which OpenCV finds them."""
        self.poses: dict[str, list[tuple[MarkerPose | None, float]]] = {}
        """For each frame so far the pose, and the processor time it took, milliseconds; by method."""

    def look(self, pair: Sequence[NDArray[np.uint8]]) -> None:
        """The next frame."""
        for name, detector in self._detectors.items():
            start = time.thread_time()
            seen = [self._corners(detector, self._cameras[0], pair[0])]
            one = self._pose(seen)
            between = time.thread_time()
            seen.append(self._corners(detector, self._cameras[1], pair[1]))
            both = self._pose(seen)
            end = time.thread_time()
            for cameras, pose, took in (("one camera", one, between - start), ("two cameras", both, end - start)):
                self.poses.setdefault(f"cv2.aruco, {cameras}{name}", []).append((pose, 1000.0 * took))

    def _corners(self, detector: tuple[Any, float, bool], camera: Camera, image: NDArray[np.uint8]) -> Corners:
        """(4, 2) of each marker: its corners on the plane at distance 1."""
        finder, shift_px, linear = detector
        corners, names, _ = finder.detectMarkers(_LIGHT[image] if linear else image)
        out = {}
        for name, at in zip(() if names is None else np.ravel(names).tolist(), corners, strict=True):
            rays = camera.unproject(np.asarray(at, dtype=np.float64).reshape(4, 2) - shift_px)
            out[name] = np.asarray(rays[:, :2] / rays[:, 2:], dtype=np.float64)
        return {name: at for name, at in out.items() if name in self._places}

    def _pose(self, seen: Sequence[Corners]) -> MarkerPose | None:
        """The pose with the least squares of all corners, from the left image's by SQPNP."""
        import cv2

        if not seen[0]:
            return None
        places = [np.concatenate([self._places[name] for name in side]) if side else np.empty((0, 3)) for side in seen]
        corners = [np.concatenate(list(side.values())) if side else np.empty((0, 2)) for side in seen]
        _, turn, shift = cv2.solvePnP(places[0], corners[0], np.eye(3), None, flags=cv2.SOLVEPNP_SQPNP)
        for _ in range(_ITERATIONS):
            normal, right_side = np.zeros((6, 6)), np.zeros(6)
            for side in range(len(seen)):
                if len(places[side]):
                    off, jacobian = self._off(side, places[side], corners[side], turn, shift)
                    normal += jacobian.T @ jacobian
                    right_side += jacobian.T @ off
            step = np.linalg.solve(normal, right_side).reshape(6, 1)
            turn, shift = turn + step[:3], shift + step[3:]
        return MarkerPose(np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64), np.asarray(shift.ravel()))

    def _off(self, side: int, places: Any, corners: Any, turn: Any, shift: Any) -> tuple[Any, Any]:
        """(2 N,): how far corners are from where they should be; (2 N, 6): derivatives of their places by the pose."""
        import cv2

        by_left = np.eye(6)
        if side:
            turn, shift, *parts = cv2.composeRT(turn, shift, *self._to_right)
            by_left = np.block([[parts[0], parts[1]], [parts[4], parts[5]]])
        at, jacobian = cv2.projectPoints(places, turn, shift, np.eye(3), None)
        return (corners - at.reshape(-1, 2)).ravel(), jacobian[:, :6] @ by_left
