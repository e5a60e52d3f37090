"""Attitudes that one camera takes from most edges, at corners of which it sees two, and their measure."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np
import polars as pl
import pytest

from drawn_corners import CAMERA, on_wall, pose
from tiltvp.cli import main
from tiltvp.corner import CornerEstimate, CornerPoseEstimator

LEFT_OPEN = "too few edges along some axis to tell the attitude from one image"


def looked(image: np.ndarray, rotation: np.ndarray, *, told: bool = True) -> CornerEstimate:
    gravity = (rotation[:, 1], math.radians(1.0)) if told else None
    return CornerPoseEstimator(CAMERA, method="general")(image, gravity=gravity)


def test_windows_of_a_wall_tell_one_camera_its_attitude() -> None:
    rotation, _ = pose(yaw=30.0, pitch=12.0)
    image = on_wall(rotation, (-1, 0, 1), size_m=(0.5, 0.4))
    estimate = looked(image, rotation)
    assert sorted(px > 0 for px in estimate.features_left[estimate.chosen_left[0]].support_px) == [False, True, True]
    axes = np.abs(estimate.pose.camera_from_object.T @ rotation)
    assert np.allclose(np.sort(axes.ravel())[-3:], 1.0, atol=1e-5), axes
    assert axes[1, 1] > 1.0 - 1e-5
    assert estimate.pose.vertex_m is None
    # Without a vertical nothing tells what the edges run along.
    assert looked(image, rotation, told=False).pose is None


def test_small_windows_leave_a_turn_open() -> None:
    rotation, _ = pose(yaw=30.0, pitch=12.0)
    # Most of their level edges are too short to count, or far: 0.9 degrees.
    estimate = looked(on_wall(rotation, (-1, 0, 1)), rotation)
    assert estimate.pose is None
    assert estimate.reason == LEFT_OPEN


def test_one_corner_that_leaves_a_turn_open_is_none_amid_many_edges() -> None:
    rotation, _ = pose(yaw=30.0, pitch=12.0)
    image = on_wall(rotation, (-2, -1, 0, 1, 2))
    x, y, z = 0.15 * rotation.T
    for level, sides in ((230, (x, z)), (100, (y, z)), (40, (x, y))):
        corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) @ np.array(sides) + (0.2, -0.1, 1.3)
        pixels = corners[:, :2] / corners[:, 2:] * 400.0 + (240.0, 180.0)
        cv2.fillPoly(image, [np.rint(16 * pixels).astype(np.int32)], (level,) * 3, lineType=cv2.LINE_AA, shift=4)
    alone = looked(image, rotation)
    assert all(px > 0 for px in alone.features_left[alone.chosen_left[0]].support_px)
    rng = np.random.default_rng(3)
    for _ in range(14):  # Aslant, above and below the windows: 40 edges and more.
        middle, angle = rng.uniform((40, 20), (440, 60)) + (0, rng.choice([0, 280])), rng.uniform(0.5, 1.0)
        half = 30.0 * np.array([math.cos(angle), rng.choice([-1, 1]) * math.sin(angle)])
        ends = [np.rint(16 * (middle + sign * half)).astype(int).tolist() for sign in (-1, 1)]
        cv2.line(image, *ends, (40, 40, 40), 2, cv2.LINE_AA, shift=4)
    estimate = looked(image, rotation)
    assert estimate.pose is None
    assert estimate.reason == LEFT_OPEN


def test_measured_on_facades(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "attitudes.csv"
    words = ["measure", "corner-attitudes", "--kinds", "yard", "--places", "1", "--views", "3", "--out", str(out)]
    assert main(words) == 0
    assert "yard" in capsys.readouterr().out
    table = pl.read_csv(out)
    assert table.height == 3
    found = table.filter("found")
    assert found.height >= 2
    assert found["error_deg"].max() < 0.3
    assert main(["measure", "corner-attitudes", "--kinds", "castle"]) == 2
    assert "yard" in capsys.readouterr().err
