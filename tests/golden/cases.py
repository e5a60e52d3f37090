"""The questions whose answers are kept: every method, filter, calibration and pose, on fixed images and logs."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import tiltvp
from tiltvp import corner, lines, synth
from tiltvp.corner import CornerDetector, CornerPoseEstimator

CAMERAS = {
    "fisheye": tiltvp.Camera.equidistant(
        width=640, height=480, focal_px=139.7, cx=319.5, cy=239.5, max_theta_rad=math.radians(95)
    ),
    "mirror": synth.mirror_camera(),
    "pinhole": tiltvp.Camera.pinhole(width=480, height=360, fx=400.0, fy=400.0, cx=240.0, cy=180.0, k1=-0.1),
    "kannala-brandt": tiltvp.Camera.kannala_brandt(
        width=320, height=240, fx=70.0, fy=71.0, cx=160.0, cy=119.0, k1=0.01, k2=-0.002, k3=0.0, k4=0.0,
        max_theta_rad=1.6,
    ),
    "double-sphere": tiltvp.Camera.double_sphere(
        width=320, height=240, fx=120.0, fy=120.0, cx=160.0, cy=119.0, xi=-0.2, alpha=0.55
    ),
    "extended-unified": tiltvp.Camera.extended_unified(
        width=320, height=240, fx=110.0, fy=111.0, cx=160.0, cy=119.0, alpha=0.6, beta=1.05
    ),
    "radial-polynomial": tiltvp.Camera.radial_polynomial(
        width=320, height=240, k1=85.0, k2=-8.0, k3=12.0, k4=-1.8, cx=160.0, cy=119.0, aspect_ratio=1.02,
        max_theta_rad=1.6,
    ),
    "ocam": tiltvp.Camera.ocam(
        width=320, height=240, polynomial=[-70.0, 0.0, 2e-3, -3e-6, 2e-8], cx=160.0, cy=119.0, max_theta_rad=1.6
    ),
    "equirectangular": tiltvp.Camera.equirectangular(width=256, height=128),
}  # fmt: skip
AHEAD = ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
LONG = 24
"""Arrays and lists of more values than this are kept as a hash."""


def plain(answer: Any) -> Any:
    """An answer as JSON holds it: numbers to the last bit, long arrays and lists by their hash."""
    if answer is None or isinstance(answer, bool | int | str):
        return answer
    if isinstance(answer, float | np.floating):
        return repr(float(answer))
    if isinstance(answer, np.integer | np.bool_):
        return answer.item()
    if isinstance(answer, np.ndarray):
        if answer.size > LONG:
            digest = hashlib.sha256(np.ascontiguousarray(answer).tobytes()).hexdigest()[:16]
            return f"{answer.dtype} {list(answer.shape)} {digest}"
        return plain(answer.tolist())
    if hasattr(answer, "to_dict"):
        return plain(answer.to_dict())
    if dataclasses.is_dataclass(answer):
        return {field.name: plain(getattr(answer, field.name)) for field in dataclasses.fields(answer)}
    if isinstance(answer, dict):
        return {str(key): plain(value) for key, value in answer.items()}
    if isinstance(answer, list | tuple):
        if len(answer) <= LONG:
            return [plain(value) for value in answer]
        if all(isinstance(x, float | int) for x in answer):
            return plain(np.array(answer))
        digest = hashlib.sha256(json.dumps([plain(value) for value in answer]).encode()).hexdigest()[:16]
        return f"{len(answer)} values {digest}"
    raise TypeError(f"{type(answer).__name__}: expected an answer that has a dict")


def lenses() -> Iterator[tuple[str, Any]]:
    for name, camera in CAMERAS.items():
        v, u = np.mgrid[0 : camera.height : 7, 0 : camera.width : 7].reshape(2, -1).astype(float)
        bearings = camera.unproject(np.column_stack([u, v]))
        yield f"{name} unproject", bearings
        yield f"{name} project", camera.project(bearings)
        yield f"{name} unproject_jacobian", list(camera.unproject_jacobian(np.column_stack([u, v])))


def leaning_views() -> Iterator[tuple[str, tiltvp.Camera, np.ndarray, Any]]:
    """Images of leaning robots, each with its camera and mounting."""
    for kind, seed, alpha, beta in (
        ("office", 3, 0.05, 0.7),
        ("corridor", 4, 0.09, -2.0),
        ("living-room", 5, 0.0, 0.0),
    ):
        camera = CAMERAS["fisheye"]
        image = synth.render_room(camera, kind=kind, seed=seed, alpha_rad=alpha, beta_rad=beta, samples=2).gray
        yield f"{kind} {seed}", camera, image, None
    camera = CAMERAS["pinhole"]
    image = synth.render_room(
        camera, kind="office", seed=6, alpha_rad=0.05, beta_rad=0.3, samples=2, robot_from_camera=AHEAD
    ).gray
    yield "office 6 ahead", camera, image, AHEAD
    yield "blank", CAMERAS["fisheye"], np.full((480, 640), 90, np.uint8), None


EDGES = ("inlier", "inlier_mask", "normal", "offset_px", "phi_rad", "prefiltered", "u", "v")
METHODS: dict[str, tuple[str, dict[str, Any]]] = {
    "refined": ("refined", {}),
    "refined wide": ("refined", {"elevation_max_rad": 1.2, "gradient_min": 80.0, "smoothing_px": 1.2, "row_stride": 2}),
    "ransac": ("image-space-ransac", {"seed": 3}),
    "ransac lo": ("image-space-ransac", {"sampling": "progressive", "local_optimization": True, "score": "msac"}),
    "reject-refit": ("image-space-reject-refit", {}),
    "consensus": ("vector-consensus", {"seed": 5}),
    "consensus tangent": (
        "vector-consensus", {"normal": "tangent", "local_optimization": True, "score": "msac", "correction": 1.1}
    ),
}  # fmt: skip


def level_images() -> Iterator[tuple[str, Any]]:
    for name, camera, image, mounting in leaning_views():
        estimator = tiltvp.TiltEstimator(camera, robot_from_camera=mounting)
        if estimate := estimator(image):
            yield name, tiltvp.level(image, estimator, estimate)


def tilts() -> Iterator[tuple[str, Any]]:
    for name, camera, image, mounting in leaning_views():
        yield f"{name} image", image
        for title, (method, options) in METHODS.items():
            if mounting is not None and method.startswith("image-space"):
                continue  # They are for cameras that see the zenith.
            estimator = tiltvp.TiltEstimator(camera, method=method, robot_from_camera=mounting, **options)
            yield f"{name} {title}", estimator(image)
            if title == "refined":
                _, edges = estimator.with_edges(image)
                yield f"{name} edges", {part: getattr(edges, part) for part in EDGES}
    rng = np.random.default_rng(1)
    normals = rng.normal(size=(60, 3)) * [1.0, 1.0, 0.03]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    yield "common direction", tiltvp.common_direction(normals, sigma_rad=0.02)
    yield "common direction prior", tiltvp.common_direction(normals, prior=(0.0, 0.0, 1.0), max_angle_rad=0.2)
    alpha = rng.uniform(0.0, 0.12, 300)
    shift = np.abs(230.0 * alpha + rng.normal(size=300))
    yield "factor", tiltvp.train_factor(shift, alpha)
    yield "affine", tiltvp.train_affine(shift, alpha)
    posterior = tiltvp.train_posterior(shift, alpha)
    yield "posterior", posterior
    yield "posterior applied", tiltvp.apply_correction(posterior, shift[:20])


def straight_edges() -> Iterator[tuple[str, Any]]:
    for name, camera, image, mounting in leaning_views():
        yield f"{name} image", image
        for title, options in (("", {}), ("apart", {"gap_max": 0.0, "stray_max_px": 0.5, "support_min_px": 20})):
            yield f"{name} edges {title}".rstrip(), tiltvp.SegmentDetector(camera, **options)(image)
        estimator = tiltvp.TiltEstimator(camera, method="segments", robot_from_camera=mounting)
        estimate, edges = estimator.with_edges(image)
        yield f"{name} tilt", estimate
        yield f"{name} tilt edges", {part: getattr(edges, part) for part in EDGES}
    camera = CAMERAS["equirectangular"]
    image = synth.Room("office", 7).render_panorama(pose=(2.0, 2.0, 0.4), height=128, samples=2).gray
    yield "panorama", tiltvp.SegmentDetector(camera)(image)


def looking_anywhere() -> Iterator[tuple[str, Any]]:
    for name, camera, image, mounting in leaning_views():
        for limit in (1.0, math.pi):
            options = {"method": "segments", "robot_from_camera": mounting, "tilt_max_rad": limit}
            yield f"{name} within {limit:.2f}", tiltvp.TiltEstimator(camera, **options)(image)
    camera = tiltvp.Camera.equirectangular(width=512, height=256)
    image = synth.Room("office", 7).render_panorama(pose=(2.0, 2.0, 0.4), height=256, samples=2).gray
    options = {"method": "segments", "robot_from_camera": AHEAD, "tilt_max_rad": math.pi}
    yield "panorama", tiltvp.TiltEstimator(camera, **options)(image)


def filters() -> Iterator[tuple[str, Any]]:
    rng = np.random.default_rng(2)
    for title, options in (("plain", {}), ("mounting", {"estimate_mounting": True})):
        fused = tiltvp.TiltFilter(**options)
        verdicts = []
        for step in range(120):
            lean = np.array([0.03 * math.sin(step / 15.0), 0.02]) + 0.004 * rng.normal(size=2)
            if step % 17 == 0:
                lean += 0.2
            normal = np.append(lean, math.sqrt(1.0 - lean @ lean))
            fused.predict(0.02, 0.1)
            verdicts.append(fused.update((normal, np.eye(2) * 0.004**2)).verdict)
        yield f"{title} verdicts", " ".join(verdicts)
        yield f"{title} estimate", fused.estimate
        yield f"{title} floor", fused.floor
        yield f"{title} mounting", fused.mounting
    gyroscope = tiltvp.ComplementaryFilter(np.eye(3))
    for _ in range(50):
        gyroscope.predict(rng.normal(size=3), 0.01)
    gyroscope.correct(np.eye(3))
    yield "complementary", [gyroscope.reference_from_body, gyroscope.bias_rad_s]


def lines_and_tracks() -> Iterator[tuple[str, Any]]:
    camera = synth.mirror_camera()
    drive = synth.Drive(
        synth.Room("corridor", 31), camera=camera, frames=6, seed=2, blind_rad=synth.MIRROR_BLIND_RAD,
        bumps_max_rad=0.03, samples=2,
    )  # fmt: skip
    extractors = {
        "great-circle": lines.LineExtractor(camera),
        "loose": lines.LineExtractor(camera, length_min_rad=0.1, scatter_max_px=0.6, gradient_min=60.0),
        "radial": lines.LineExtractor(camera, method="radial"),
    }
    trackers = {name: lines.LineTracker() for name in extractors}
    before: dict[str, np.ndarray] = {}
    for frame in range(len(drive)):
        image = drive.render(frame).gray
        yield f"frame {frame} image", image
        for name, extractor in extractors.items():
            tilt = None if name == "radial" else tuple(drive.tilts[frame])
            found = extractor(image, tilt)
            described = extractor.describe(image, found)
            yield f"frame {frame} {name}", found
            yield f"frame {frame} {name} descriptors", described
            if frame == 0:
                yield f"frame {frame} {name} patches", extractor.patches(image, found)
            if name in before:
                yield f"frame {frame} {name} matches", lines.match(before[name], described)
            before[name] = described
            motion = {} if frame == 0 else {"yaw_change_rad": 0.01}
            tracked = trackers[name].update(found, described, **motion)
            yield f"frame {frame} {name} tracks", tracked.track


def calibrations() -> Iterator[tuple[str, Any]]:
    start = {"wheel_base_m": 0.4, "start": (0.2, 0.0, 0.0), "start_sigma": (0.2, 0.2, 0.6)}
    for kind, seed, noise in (("paper", 1, {}), ("alternating", 2, {"outliers": 0.03}), ("alternating", 3, {})):
        drive = synth.simulate_drive(kind, seed=seed, **noise)
        yield f"{kind} {seed} log", [drive.odometry, drive.bearings]
        for method in tiltvp.CALIBRATION_METHODS:
            calibrator = tiltvp.SelfCalibrator(method=method, **start)
            followed = calibrator.follow(drive.odometry, drive.bearings)
            yield f"{kind} {seed} {method}", [followed[step] for step in (0, 9, len(followed) // 2, -1)]
        yield f"{kind} {seed} whole", tiltvp.calibrate(drive.odometry, drive.bearings, **start)
    times = 0.1 * np.arange(len(drive.odometry))
    yield (
        f"{kind} {seed} everything",
        tiltvp.calibrate(
            drive.odometry, drive.bearings, **start, estimate_odometry=True, estimate_time_offset=True, times_s=times
        ),
    )
    yield f"{kind} {seed} centre", tiltvp.calibrate(drive.odometry, drive.bearings, **start, estimate_centre=True)
    yield "cramer-rao", drive.cramer_rao_bound(start_sigma=(0.2, 0.2, 0.6))


def corners() -> Iterator[tuple[str, Any]]:
    rng = np.random.default_rng(4)
    rays = rng.normal(size=(200, 4, 3)) + [0.0, 0.0, 4.0]
    yield "closed form", corner.solve_many(*rays.transpose(1, 0, 2), rng.uniform(0.5, 2.6, 200)).camera_from_object
    left, right = (camera.scaled(0.5) for camera in synth.zed_cameras())
    scenes = {"laboratory": synth.Laboratory(3), "office": synth.Room("office", 7007)}
    for title, scene in scenes.items():
        sequence = synth.StereoSequence(scene, left=left, right=right, frames=3, seed=5, samples=2)
        for method in corner.CORNER_METHODS:
            pair = CornerPoseEstimator(left, right, sequence.left_from_right, method=method)
            down = sequence.poses[0][:3, :3].T @ [0.0, 0.0, -1.0]
            alone = CornerPoseEstimator(left, method=method, down=down / np.linalg.norm(down))
            detector = CornerDetector(left, method=method)
            for frame in range(len(sequence)):
                images = sequence.render(frame)
                yield f"{title} {method} {frame} images", list(images)
                yield f"{title} {method} {frame} features", detector(images[0])
                yield f"{title} {method} {frame} pair", pair(*images)
                yield f"{title} {method} {frame} one", alone(images[0])
            if method == "general":
                yield f"{title} segments", detector.segments(images[0])


GROUPS: dict[str, Callable[[], Iterator[tuple[str, Any]]]] = {
    "cameras": lenses,
    "tilt": tilts,
    "level": level_images,
    "segments": straight_edges,
    "anywhere": looking_anywhere,
    "filters": filters,
    "lines": lines_and_tracks,
    "calibration": calibrations,
    "corners": corners,
}


def kept_file(group: str) -> Path:
    """Where the answers of a group are kept."""
    return Path(__file__).parent / f"{group}.json"


def answers(group: str) -> dict[str, Any]:
    """The answers of today to the questions of a group."""
    return {name: plain(answer) for name, answer in GROUPS[group]()}
