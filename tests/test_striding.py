"""What looking at fewer rows costs, as a table."""

from __future__ import annotations

import math

import pytest

import tiltvp
from tiltvp.cli import main
from tiltvp.lab.evaluation.combinations import PIXEL_METHODS
from tiltvp.lab.evaluation.striding import stride_views, summarise_strides
from tiltvp.lab.evaluation.views import room_views

CAMERA = tiltvp.Camera.equidistant(width=320, height=240, focal_px=69.8, cx=159.5, cy=119.5, max_theta_rad=1.61)


@pytest.mark.slow
def test_the_table_has_a_row_for_each_method_and_stride() -> None:
    views = list(room_views(1, CAMERA, kinds=("office",)))
    table = stride_views(views, CAMERA, strides=(1, 3), repeats=1)
    assert len(table) == len(views) * len(PIXEL_METHODS) * 2
    estimator = tiltvp.TiltEstimator(CAMERA, row_stride=3)
    estimate = estimator(views[2].image)
    truth = tiltvp.normal_from_alpha_beta(views[2].alpha_rad, views[2].beta_rad)
    row = table.filter(view=2, method="refined", row_stride=3).row(0, named=True)
    assert row["error_rad"] == pytest.approx(tiltvp.tilt_error_rad(estimate.normal, truth), abs=1e-12)
    assert row["covariance_xy_rad2"] == estimate.covariance_rad2[0, 1]
    summary = summarise_strides(table)
    assert summary["method"].to_list() == [method for method in PIXEL_METHODS for _ in range(2)]
    first = summary.filter(row_stride=1)
    assert first["time"].to_list() == [1.0] * len(PIXEL_METHODS)
    assert all(0.0 <= held <= 1.0 for held in summary["held"])
    refined = table.filter(method="refined", row_stride=1)["error_rad"].mean()
    assert summary.filter(method="refined", row_stride=1)["mean"].item() == pytest.approx(math.degrees(refined))


def test_there_must_be_something_to_look_at(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["measure", "striding", "--rooms", "0"]) == 2
    assert "--rooms 0" in capsys.readouterr().err
