"""The self-calibration filter of Scaramuzza 2009: it is there, worse than the default, and says where it is lost."""

from __future__ import annotations

import numpy as np

import tiltvp
from test_calibration import START, error, followed
from tiltvp.synth import simulate_drive


def test_the_paper_filter_is_there_and_worse() -> None:
    errors = {"default": [], "paper": []}
    for seed in range(15):
        drive = simulate_drive("alternating", seed=seed)
        for method, found in errors.items():
            found.append(np.abs(error(followed(drive, method=method, start_sigma=(0.05, 0.08, 0.5)).estimate)).max())
    assert np.median(errors["default"]) < np.median(errors["paper"])


def test_it_is_alarmed_where_it_ends_far_from_the_truth() -> None:
    ends = [followed(simulate_drive("alternating", seed=seed), method="paper").estimate for seed in range(20)]
    far = [e for e in ends if np.abs(error(e)).max() > 0.1]
    assert far
    assert all(e.alarm and not e for e in far)


def test_it_is_alarmed_by_bearings_of_another_sense() -> None:
    drive = simulate_drive("alternating", seed=0)
    calibrator = tiltvp.SelfCalibrator(**START, method="paper")  # type: ignore[arg-type]
    calibrator.follow(drive.odometry, drive.bearings * [1.0, 1.0, -1.0])
    assert calibrator.estimate.alarm
    assert not calibrator.estimate
