"""The vertical of an image by us and by what a user would otherwise write or install, in one process on one thread.

First upward fisheye views of rendered rooms (or, with `--panoramas DIR`, of upright panoramas): the paper's three
methods on OpenCV and NumPy (`paper_numpy.py`), and segments of OpenCV's LSD and FLD as great circles for
`common_direction`. Then views of a pinhole camera that looks ahead in rendered rooms: `lu-vp-detect`, of whose three
vanishing points the one nearest to the vertical counts, and segments again. Prints errors, times, and the times' ratios
to our method's on the same image. Wants the cv2 of opencv-contrib-python-headless and lu-vp-detect: see the recipe
`measure-vertical-peers`.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Sequence

import cv2
import numpy as np
from lu_vp_detect import VPDetection
from paper_numpy import PaperNumpy
from scharr import images

from tiltvp import Camera, TiltEstimator, common_direction, normal_from_alpha_beta, tilt_error_rad
from tiltvp.lab.datasets.panoramas import TABLE_1_TILTS_DEG, paper_camera
from tiltvp.rotations import read_rotation
from tiltvp.synth import ROOM_KINDS, render_room

FACTORS = {"image-space-ransac": 308.0, "image-space-reject-refit": 234.0, "vector-consensus": 1.0}
GRADIENTS = {"image-space-ransac": 150.0, "image-space-reject-refit": 200.0, "vector-consensus": 600.0}
SEGMENT_MIN_PX = 20.0
LU_SEGMENT_MIN_PX = 30.0
FOCAL_PX = 320.0

LSD = cv2.createLineSegmentDetector

Method = Callable[[np.ndarray], np.ndarray | None]


def ours(camera: Camera, **options: object) -> Method:
    """Our normal, or none."""
    estimator = TiltEstimator(camera, **options)

    def normal(image: np.ndarray) -> np.ndarray | None:
        estimate = estimator(image)
        return estimate.normal if estimate else None

    return normal


def segments(detect: Callable[[np.ndarray], np.ndarray | None], camera: Camera, rotation: np.ndarray) -> Method:
    """Segments (N, 4) as great circles, weighted by their length, and the direction that they have in common."""

    def normal(image: np.ndarray) -> np.ndarray | None:
        found = detect(image)
        if found is None:
            return None
        ends = np.asarray(found, dtype=np.float64).reshape(-1, 2, 2)
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        rays = (camera.unproject(ends.reshape(-1, 2)) @ rotation.T).reshape(-1, 2, 3)
        circles = np.cross(rays[:, 0], rays[:, 1])
        with np.errstate(invalid="ignore"):
            kept = (length >= SEGMENT_MIN_PX) & (np.linalg.norm(circles, axis=1) > 0.0)
        if kept.sum() < 2:
            return None
        found = common_direction(circles[kept], weights=length[kept], max_angle_rad=math.radians(12.0))
        return found.direction if found else None

    return normal


class FourDetector:
    """OpenCV's detector of segments with the shape (N, 1, 4) of OpenCV 4, for which lu-vp-detect was written."""

    def __init__(self, *_: object) -> None:
        self._detector = LSD()

    def detect(self, image: np.ndarray) -> tuple[np.ndarray, None]:
        return np.asarray(self._detector.detect(image)[0]).reshape(-1, 1, 4), None


def lu(rotation: np.ndarray) -> Method:
    """Of the three vanishing points the one nearest to the robot's vertical."""
    detector = VPDetection(LU_SEGMENT_MIN_PX, (319.5, 239.5), FOCAL_PX, seed=0)
    cv2.createLineSegmentDetector = FourDetector

    def normal(image: np.ndarray) -> np.ndarray | None:
        points = detector.find_vps(image) @ rotation.T
        best = points[np.argmax(np.abs(points[:, 2]))]
        return best / np.linalg.norm(best) * np.sign(best[2])

    return normal


def compare(
    title: str, pictures: Sequence[np.ndarray], truths: np.ndarray, methods: dict[str, tuple[Method, str]], rounds: int
) -> None:
    """Prints the table: each method beside the one of ours that it stands for, timed in turn on the same images."""
    times: dict[str, list[float]] = {name: [] for name in methods}
    errors: dict[str, list[float]] = {name: [] for name in methods}
    for turn in range(rounds + 1):
        for picture, truth in zip(pictures, truths, strict=True):
            for name, (method, _) in methods.items():
                start = time.perf_counter()
                normal = method(picture)
                elapsed = time.perf_counter() - start
                if turn == 0:
                    # The first round warms up, and is the one whose answers count.
                    errors[name].append(math.nan if normal is None else math.degrees(tilt_error_rad(normal, truth)))
                else:
                    times[name].append(elapsed)
    print(title)
    print(f"{'':46} {'mean deg':>9} {'95 % deg':>9} {'none':>5} {'median ms':>10} {'times ours':>11}")
    for name, (_, beside) in methods.items():
        known = np.array(errors[name])[np.isfinite(errors[name])]
        ratio = np.median(np.array(times[name]) / np.array(times[beside]))
        print(
            f"{name:46} {known.mean():9.2f} {np.percentile(known, 95):9.2f} {len(errors[name]) - len(known):5d} "
            f"{1e3 * np.median(times[name]):10.3f} {ratio:11.1f}"
        )


def main() -> None:
    """Prints both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--panoramas", help="folder with an INDEX.csv of upright panoramas")
    parser.add_argument("--images", type=int, default=28)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    lsd, fld = LSD(), cv2.ximgproc.createFastLineDetector()
    tilts = [TABLE_1_TILTS_DEG[i % len(TABLE_1_TILTS_DEG)] for i in range(arguments.images)]
    truths = np.array([normal_from_alpha_beta(*np.deg2rad(tilt)) for tilt in tilts])

    camera, upward = paper_camera(), np.eye(3)
    methods: dict[str, tuple[Method, str]] = {"refined": (ours(camera), "refined")}
    for method, factor in FACTORS.items():
        options = {"normal": "tangent"} if method == "vector-consensus" else {}
        methods[method] = (ours(camera, method=method, correction=factor, **options), method)
        peer = PaperNumpy(camera, method, gradient_min=GRADIENTS[method], factor=factor)
        methods[f"{method}, OpenCV + NumPy"] = (peer, method)
    methods["LSD + common_direction"] = (segments(lambda image: lsd.detect(image)[0], camera, upward), "refined")
    methods["FLD + common_direction"] = (segments(fld.detect, camera, upward), "refined")
    pictures = images(arguments.panoramas, arguments.images)
    compare("Upward fisheye of 185 degrees, 640 x 480", pictures, truths, methods, arguments.rounds)

    ahead = Camera.pinhole(width=640, height=480, fx=FOCAL_PX, fy=FOCAL_PX, cx=319.5, cy=239.5)
    rotation = read_rotation("forward")
    methods = {
        "refined": (ours(ahead, robot_from_camera=rotation, elevation_max_rad=math.radians(36.0)), "refined"),
        "lu-vp-detect": (lu(rotation), "refined"),
        "LSD + common_direction": (segments(lambda image: lsd.detect(image)[0], ahead, rotation), "refined"),
        "FLD + common_direction": (segments(fld.detect, ahead, rotation), "refined"),
    }
    pictures = [
        render_room(
            ahead, kind=ROOM_KINDS[i % len(ROOM_KINDS)], seed=i, alpha_rad=float(alpha), beta_rad=float(beta),
            robot_from_camera=rotation, samples=2,
        ).gray
        for i, (alpha, beta) in enumerate(np.deg2rad(tilts))
    ]  # fmt: skip
    compare("Pinhole camera that looks ahead, 640 x 480", pictures, truths, methods, arguments.rounds)


if __name__ == "__main__":
    main()
