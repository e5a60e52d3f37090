"""Errors against known truth on small rendered sets: they say whether a changed constant does good or harm."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

import tiltvp
from golden.cases import CAMERAS
from tiltvp import lines, synth
from tiltvp.corner import CornerPoseEstimator

NEAR_RAD = math.radians(0.5)
"""How far a line's bearing may be from an edge's to count as that edge's."""


def tilt_errors() -> dict[str, float]:
    """Mean error of each method in degrees over twelve rendered rooms."""
    camera, errors = CAMERAS["fisheye"], {method: [] for method in tiltvp.METHODS}
    estimators = {method: tiltvp.TiltEstimator(camera, method=method) for method in tiltvp.METHODS}
    for number in range(12):
        alpha, beta = math.radians(0.7 * number), 2.0 * number
        kind = synth.ROOM_KINDS[number % len(synth.ROOM_KINDS)]
        image = synth.render_room(camera, kind=kind, seed=500 + number, alpha_rad=alpha, beta_rad=beta, samples=2).gray
        for method, estimator in estimators.items():
            error = tiltvp.tilt_error_rad(estimator(image).normal, tiltvp.normal_from_alpha_beta(alpha, beta))
            errors[method].append(math.degrees(error))
    return {f"{method}, degrees": float(np.mean(values)) for method, values in errors.items()}


def line_errors() -> dict[str, float]:
    """Edges found, lines that are no edge, and the rms error of bearings, over eight frames of two rendered drives."""
    camera = synth.mirror_camera()
    extractor = lines.LineExtractor(camera)
    edges = found = total = false = 0
    squares: list[float] = []
    for kind in ("corridor", "hall"):
        room = synth.Room("corridor" if kind == "corridor" else "office", 600)
        drive = synth.Drive(room, camera=camera, frames=4, seed=3, blind_rad=synth.MIRROR_BLIND_RAD, samples=2)
        for frame in range(len(drive)):
            truth = drive.truth(frame)
            bearings = extractor(drive.render(frame).gray, tuple(drive.tilts[frame])).bearing_rad
            off = np.abs((bearings[:, None] - truth.bearings_rad[None] + math.pi) % (2.0 * math.pi) - math.pi)
            nearest = off.min(axis=1) if off.size else np.zeros(0)
            total, false = total + len(bearings), false + int((nearest > NEAR_RAD).sum())
            edges, found = edges + off.shape[1], found + int((off.min(axis=0) <= NEAR_RAD).sum() if off.size else 0)
            squares += list(np.degrees(nearest[nearest <= NEAR_RAD]) ** 2)
    return {
        "edges found": found / max(edges, 1),
        "false lines": false / max(total, 1),
        "bearing rms, degrees": math.sqrt(float(np.mean(squares))) if squares else math.nan,
    }


def calibration_errors() -> dict[str, float]:
    """Rms error over the Cramer-Rao bound, and NEES of 3, of the filter and of whole logs, on 8 simulated drives."""
    true = np.array([0.23 * math.cos(-0.34), 0.23 * math.sin(-0.34), -0.01])
    start = {"wheel_base_m": 0.4, "start": (0.2, 0.0, 0.0), "start_sigma": (0.2, 0.2, 0.6)}
    ratios: dict[str, list[float]] = {"filter": [], "whole": []}
    nees: dict[str, list[float]] = {"filter": [], "whole": []}
    for seed in range(8):
        drive = synth.simulate_drive(("paper", "alternating")[seed % 2], seed=700 + seed)
        bound = np.diag(drive.cramer_rao_bound(start_sigma=(0.2, 0.2, 0.6)))
        calibrator = tiltvp.SelfCalibrator(**start)
        calibrator.follow(drive.odometry, drive.bearings)
        whole = tiltvp.calibrate(drive.odometry, drive.bearings, **start).mounting
        for name, estimate in (("filter", calibrator.estimate), ("whole", whole)):
            error = np.array([estimate.x_m, estimate.y_m, estimate.yaw_rad]) - true
            ratios[name].append(float(np.mean(error**2 / bound)))
            nees[name].append(float(error @ np.linalg.solve(estimate.covariance_xy_yaw, error)))
    rows = {f"{name}, rms over bound": math.sqrt(float(np.mean(values))) for name, values in ratios.items()}
    return rows | {f"{name}, NEES of 3": float(np.mean(values)) for name, values in nees.items()}


def corner_errors() -> dict[str, float]:
    """Share of frames with a pose, and the rms error of attitude, before the coloured cuboid and in a room."""
    left, right = (camera.scaled(0.5) for camera in synth.zed_cameras())
    rows = {}
    for method, scene in (("coloured", synth.Laboratory(3)), ("general", synth.Room("office", 7007))):
        sequence = synth.StereoSequence(scene, left=left, right=right, frames=6, seed=5, samples=2)
        down = sequence.poses[0][:3, :3].T @ [0.0, 0.0, -1.0]
        estimator = CornerPoseEstimator(
            left, right, sequence.left_from_right, method=method, down=down / np.linalg.norm(down)
        )
        errors = []
        for frame in range(len(sequence)):
            pose = estimator(*sequence.render(frame)).pose
            if pose is not None:
                vertical = np.abs(pose.camera_from_object.T @ sequence.poses[frame][:3, :3].T @ [0.0, 0.0, 1.0]).max()
                errors.append(math.degrees(math.acos(min(1.0, vertical))))
        rows[f"{method}, found"] = len(errors) / len(sequence)
        rows[f"{method}, vertical rms, degrees"] = float(np.sqrt(np.mean(np.square(errors)))) if errors else math.nan
    return rows


ERRORS: dict[str, Callable[[], dict[str, float]]] = {
    "tilt": tilt_errors,
    "lines": line_errors,
    "calibration": calibration_errors,
    "corners": corner_errors,
}
"""By the golden group whose answers they judge."""
