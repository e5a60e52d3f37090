"""Attitudes that one camera takes from most edges, at corners of which it sees two, and their measure."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from drawn_corners import CAMERA, on_wall, pose
from tiltvp.cli import main
from tiltvp.corner import CornerEstimate, CornerPoseEstimator


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


def test_edges_of_one_direction_tell_no_heading() -> None:
    rotation, _ = pose(yaw=30.0, pitch=12.0)
    # Their upper and lower edges are too short to count.
    bars = on_wall(rotation, (-1, 0, 1), size_m=(0.08, 0.4))
    assert looked(bars, rotation).pose is None


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
