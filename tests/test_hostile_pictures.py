"""Drives with pictures that mislead a calibration, rendered once and told in many ways."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tiltvp.cli import main
from tiltvp.lab.datasets.hostile_drives import TOO_SHORT, UNDISTURBED
from tiltvp.lab.datasets.hostile_pictures import PICTURE_CASES, PictureDrive, told_drive
from tiltvp.lab.evaluation.calibration_images import MOUNTING, PictureExperiment
from tiltvp.lab.evaluation.hostile_pictures import judge_picture_drives
from tiltvp.synth import mirror_camera

BASE_M = 0.35


@pytest.fixture
def drive() -> PictureDrive:
    """Twenty images, each of its number at the left."""
    images = [np.zeros((480, 640), np.uint8) for _ in range(20)]
    for number, image in enumerate(images):
        image[:, 0] = number
    odometry = np.column_stack([np.linspace(0.01, 0.05, 20), np.linspace(0.02, 0.03, 20)])
    return PictureDrive(images, odometry, mirror_camera(), BASE_M, np.array(MOUNTING))


@pytest.mark.parametrize("case", PICTURE_CASES)
def test_each_case_harms_what_it_names(drive: PictureDrive, case: str) -> None:
    made, told = PICTURE_CASES[case], told_drive(drive, case, 3)
    assert len(told.images) == len(told.odometry) == (TOO_SHORT if case == "too short" else 20)
    same = {
        "odometry": np.array_equal(told.odometry, drive.odometry),
        "camera": told.camera == drive.camera,
        "base": told.wheel_base_m == BASE_M,
        "images": all(np.array_equal(a, b) for a, b in zip(told.images, drive.images, strict=False)),
        "factors": not told.factors,
    }
    harmed = {name for name, is_same in same.items() if not is_same}
    expected = {
        "wheel base": {"base"}, "sigma": {"factors"}, "K told": {"factors"}, "image centre": {"camera"},
        "focal": {"camera"}, "images": {"images"}, "too short": {"odometry"},
    }  # fmt: skip
    words = next((value for word, value in expected.items() if case.startswith(word)), None)
    if made.odometry != UNDISTURBED:
        assert harmed == {"odometry"}
    elif words is not None:
        assert harmed == words
    else:  # It is driven otherwise, or not harmed at all.
        assert not harmed
        assert case == UNDISTURBED or made.legs or made.is_bumped


def test_harm_is_what_it_says(drive: PictureDrive) -> None:
    mirrored, late = told_drive(drive, "images mirrored", 3), told_drive(drive, "images 0.2 s late", 3)
    assert [int(image[0, -1]) for image in mirrored.images] == list(range(20))
    assert [int(image[0, 0]) for image in late.images] == [0, *range(19)]
    off = told_drive(drive, "image centre off by 2 px", 3).camera.to_dict()
    own = drive.camera.to_dict()
    assert math.hypot(off["cx"] - own["cx"], off["cy"] - own["cy"]) == pytest.approx(2.0)
    longer = told_drive(drive, "focal length +10 %", 3).camera.to_dict()
    assert longer["fx"] == pytest.approx(1.1 * own["fx"])


@pytest.mark.slow
def test_the_table_is_of_rendered_drives() -> None:
    experiment = PictureExperiment(
        kinds=("corridor",), leans_max_deg=(0.0,), drives=1, seed=9701, samples=1, step_m=0.15, turn_max_rad=0.2
    )
    cases, advanced = ["wheels swapped", "too short", "rotation only"], []
    table = judge_picture_drives(experiment, cases, threads=2, advance=lambda: advanced.append(1))
    assert len(advanced) == len(cases)
    assert table["case"].to_list() == [case for case in cases for _ in range(2)]
    assert table["by"].to_list() == ["filter", "whole log"] * len(cases)
    assert not table["answered"].any()
    assert table["named"].to_list()[:2] == [True, True]


def test_a_case_that_is_none_is_wrong_use() -> None:
    assert main(["measure", "trust-pictures", "--only", "no such case"]) == 2
