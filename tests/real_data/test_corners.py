"""Corners of real things: a cabinet before motion capture, a box of tea before a pair of cameras."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tiltvp.lab.evaluation import corners_real as real


def test_the_cabinet_against_motion_capture(data: Path) -> None:
    found = real.cabinet(data / "corner" / "cube_slam_cabinet")
    rms = float(np.sqrt(np.mean(found.error_deg**2)))
    print(f"{len(found.places)} of {found.frames}, rms {rms:.2f} deg, leaning {found.lean_deg:.2f} deg")
    assert len(found.places) >= 0.8 * found.frames
    assert rms <= 1.0
    # Both the cabinet and the capture's frame are level, so that one turn about the vertical brings them together.
    assert found.lean_deg < 0.5
    # The capture errs too: edges that we do not find are nearer to our axes.
    assert np.mean(found.edges_off_deg[:, 0] < found.edges_off_deg[:, 1]) > 0.7
    assert np.median(found.nees) < 10.0


def test_the_tea_box_before_two_cameras(data: Path) -> None:
    box = real.tea_box(data / "corner" / "visp_teabox_stereo")
    step_mm, turn_deg = real.steps(box)
    medians = {name: float(np.nanmedian(values)) for name, values in box.lengths_mm.items()}
    angles = np.nanmedian(box.angles_deg, axis=0)
    print(f"{len(box.places)} of {box.frames}, {medians}, angles {angles}")
    assert len(box.places) >= 0.8 * box.frames
    # One corner of the box after the other, and nothing else: neither of them jumps.
    assert set(box.objects.tolist()) == {1, 2}
    assert np.median(step_mm) < 2.5
    assert np.max(step_mm) < 15.0
    assert np.median(turn_deg) < 0.8
    assert np.max(np.abs(angles - 90.0)) < 2.0
    assert abs(medians["depth"] - 68.0) < 4.0
    assert abs(medians["height"] - 80.0) < 4.0
    # With the files' calibration the known box is 3.1 % too large all along the sequence, on all of its sides.
    assert abs(medians["long"] - 159.6) < 2.0
