"""The covariance of the mounting from a whole log where errors are not each on its own."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tiltvp
from test_calibration import START
from tiltvp.errors import InvalidInputError
from tiltvp.synth import simulate_drive


def test_landmarks_left_out_in_turn_widen_the_covariance() -> None:
    drive = simulate_drive("paper", seed=4)
    plain = tiltvp.calibrate(drive.odometry, drive.bearings, **START).mounting
    wide = tiltvp.calibrate(drive.odometry, drive.bearings, jackknife_parts=5, **START).mounting
    assert (wide.x_m, wide.y_m, wide.yaw_rad) == (plain.x_m, plain.y_m, plain.yaw_rad)
    assert np.linalg.eigvalsh(wide.covariance_xy_yaw - plain.covariance_xy_yaw).min() > -1e-15
    assert np.trace(wide.covariance_xy_yaw) > np.trace(plain.covariance_xy_yaw)
    for parts in (1, -2, 1001, 2.5):
        with pytest.raises(InvalidInputError, match="jackknife_parts"):
            tiltvp.calibrate(drive.odometry, drive.bearings, jackknife_parts=parts, **START)


def test_motions_of_a_part_of_the_drive_that_err_together_are_doubted() -> None:
    """A quarter of the drive is on a carpet, where wheels run 8 % too far."""
    drive = simulate_drive("alternating", seed=2)
    odometry, count = drive.odometry.copy(), len(drive.odometry)
    odometry[count // 2 : 3 * count // 4] *= 1.08
    found = tiltvp.calibrate(odometry, drive.bearings, **START)
    assert found, found.reason
    np.testing.assert_allclose(found.doubted, [[0.5, 0.75]], atol=0.01)
    assert found.reason.endswith("; odometry from 50 to 75 % of the drive doubted")
    even = tiltvp.calibrate(drive.odometry, drive.bearings, **START)
    assert even.doubted.shape == (0, 2)
    assert "doubted" not in even.reason
    # Errors are hardly larger than without it: 2 mm.
    assert math.hypot(found.mounting.x_m - even.mounting.x_m, found.mounting.y_m - even.mounting.y_m) < 2e-3
    # The filter, which takes the noise of the wheels as told, names that.
    calibrator = tiltvp.SelfCalibrator(**START)
    calibrator.follow(odometry, drive.bearings)
    assert calibrator.estimate.suspect == "odometry_k_m"


def test_motions_of_most_of_the_drive_that_err_together_are_named() -> None:
    """Parts of a carpet under most of a drive cannot be told from the others."""
    drive = simulate_drive("alternating", seed=2)
    odometry, count = drive.odometry.copy(), len(drive.odometry)
    odometry[count // 5 : 4 * count // 5] *= 1.08
    found = tiltvp.calibrate(odometry, drive.bearings, **START)
    assert not found
    assert found.mounting.suspect == "drift"
    assert found.mounting.suspect_value > 5.0
    assert "err together" in found.reason


@pytest.mark.parametrize("kind", ["paper", "alternating"])
def test_steps_without_bearings_tell_the_filter_nothing(kind: str) -> None:
    """The first of them made the mounting up to five times surer until the next bearings came."""
    drive = simulate_drive(kind, seed=1)
    seen = drive.bearings[drive.bearings[:, 0] % 4 == 0]
    told = tiltvp.SelfCalibrator(**START).follow(drive.odometry, seen)  # type: ignore[arg-type]
    # At the end the filter is examined.
    for step in range(1, len(told) - 1):
        if step % 4:
            assert np.array_equal(told[step].covariance_xy_yaw, told[step - 1].covariance_xy_yaw)
