"""The options of self-calibration: each changes something."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tiltvp
from tiltvp._core import option_fields
from tiltvp.synth import simulate_drive

START: dict[str, Any] = {"wheel_base_m": 0.4, "start": (0.2, 0.0, 0.0), "start_sigma": (0.2, 0.2, 0.6)}
OTHER: dict[str, Any] = {
    "start": (0.1, 0.1, 0.1), "start_sigma": (0.1, 0.1, 0.3), "gate_probability": 0.9, "keyframes_max": 8,
    "step_sigma_m": 0.01, "step_sigma_rad": 0.01, "estimate_odometry": True, "estimate_time_offset": True,
    "estimate_centre": True, "estimate_rolling_shutter": True, "max_iterations": 1, "jackknife_parts": 3,
}  # fmt: skip
"""Another value of each option but of lengths, angles and factors, of which there is half as much again."""


@pytest.mark.slow
@pytest.mark.parametrize("method", [*tiltvp.CALIBRATION_METHODS, None])
def test_every_option_changes_something(method: str | None) -> None:
    drive = simulate_drive("alternating", seed=4, outliers=0.03)
    times = np.arange(len(drive.odometry), dtype=float)

    def answer(**options: Any) -> object:
        if method is not None:
            calibrator = tiltvp.SelfCalibrator(method=method, **{**START, **options})
            calibrator.follow(drive.odometry, drive.bearings)
            return calibrator.estimate
        timed = {"times_s": times} if "estimate_time_offset" in options else {}
        return tiltvp.calibrate(drive.odometry, drive.bearings, **{**START, **options, **timed})

    plain = answer()
    for field in option_fields("SelfCalibrator" if method else "calibrate", method):
        name, default = field["name"], field["default"]
        if name != "method":
            value = OTHER[name] if name in OTHER else 1.5 * START.get(name, default)
            assert answer(**{name: value}) != plain, f"{name} changes nothing"
