"""A dataset rendered from real panoramas: sound, as lean as it says, and made in little time."""

from __future__ import annotations

import statistics
import time
from pathlib import Path

import numpy as np

import tiltvp
from tiltvp.lab.datasets.check import check_dataset
from tiltvp.lab.datasets.folder import read_dataset
from tiltvp.lab.datasets.panoramas import PanoramaViews, paper_camera
from tiltvp.lab.datasets.rendering import find_panoramas, render_panoramas

LONGEST_S = 0.12
"""Seconds of one core for a view, twice what it takes on an idle one."""


def test_panorama_dataset(data: Path, tmp_path: Path) -> None:
    chosen = find_panoramas(data / "panos", 6)
    render_panoramas(chosen, paper_camera(), tmp_path / "views", threads=2)
    assert check_dataset(tmp_path / "views") == []
    dataset = read_dataset(tmp_path / "views")
    assert len(dataset.images) == 42
    assert len({image.location for image in dataset.images}) == 6
    estimator = tiltvp.TiltEstimator(dataset.camera)
    errors_deg = []
    for image in dataset.images:
        estimate = estimator(dataset.read(image))
        true = tiltvp.normal_from_alpha_beta(image.alpha_rad, image.beta_rad)
        errors_deg.append(np.rad2deg(tiltvp.tilt_error_rad(estimate.normal, true)))
    print(f"refined: mean error {np.mean(errors_deg):.2f} degrees, 95 % {np.percentile(errors_deg, 95):.2f}")
    assert np.mean(errors_deg) < 1.2


def test_time_of_a_view(data: Path) -> None:
    (_, panorama), *_ = find_panoramas(data / "panos")
    views = PanoramaViews(panorama, paper_camera())
    normal = tiltvp.normal_from_alpha_beta(0.05, 1.0)
    times_s = []
    for seed in range(9):
        start = time.thread_time()
        views.render(normal, seed=seed)
        times_s.append(time.thread_time() - start)
    print(f"a view: {1e3 * statistics.median(times_s):.1f} ms of one core")
    assert statistics.median(times_s) < LONGEST_S
