"""Real fisheye and mirror photographs with their own calibrations: an estimate, or an honest reason for none."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import pytest

import tiltvp
from tiltvp.field_of_view import field_of_view, looks_like_a_mirror


class Case(NamedTuple):
    """A photograph and its calibration; `up` where the optical axis is vertical, `mirror` where it meets a mirror."""

    image: str
    calibration: str
    up: bool = False
    mirror: bool = False


LAB = "jingdongZhang_Improved_Feature_Descriptor"

CASES = [
    Case("riyueshi_ocamcalib-plus/VMRImage0.jpg", "riyueshi_ocamcalib-plus/calib_results_catadioptric.txt", True, True),
    Case("riyueshi_ocamcalib-plus/VMRImage4.jpg", "riyueshi_ocamcalib-plus/calib_results_catadioptric.txt", True, True),
    Case("riyueshi_ocamcalib-plus/VMRImage8.jpg", "riyueshi_ocamcalib-plus/calib_results_catadioptric.txt", True, True),
    Case("tasptz_py-omnicalib/KaidanOmni1.jpg", "tasptz_py-omnicalib/calibration.yml", True, True),
    Case("matsuren_ocamcalib_undistort/img0.jpg", "matsuren_ocamcalib_undistort/calib_results_0.txt"),
    Case("panyu2000_fisheye/fisheye_camera_000.jpg", "panyu2000_fisheye/camera_intrinsics.yaml"),
    Case("lessthanoptimal_BoofCV-Data/front_table.jpg", "lessthanoptimal_BoofCV-Data/front.yaml"),
    Case(f"{LAB}/m1.jpg", f"{LAB}/calib_results.txt"),
    Case("eowjd0512_fisheye-calib-adapter/kalibr_image.png", "eowjd0512_fisheye-calib-adapter/kalibr_DS.yml"),
    Case("valeoai_WoodScape/front.jpg", "valeoai_WoodScape/front.json"),
]

FORWARD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""R of a camera that looks ahead: its z is the robot's x, its x the robot's -y, its y the robot's -z."""


def load(data: Path, case: Case) -> tuple[tiltvp.Camera, np.ndarray]:
    image = tiltvp.read_image(data / "omni" / case.image)
    height, width = image.shape[:2]
    path = data / "omni" / case.calibration
    if case.calibration.endswith("calibration.yml"):
        camera = tiltvp.Camera.load(path, image_size=(width, height), mirror=case.mirror)
    else:
        camera = tiltvp.Camera.load(path, mirror=case.mirror)
    if (camera.width, camera.height) != (width, height):
        image = cv2.resize(image, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    return camera, np.asarray(image)


@pytest.mark.parametrize("case", CASES, ids=[case.image for case in CASES])
@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_a_finite_answer_or_a_reason(data: Path, case: Case, method: str) -> None:
    camera, image = load(data, case)
    # A camera below a mirror looks up at it and sees the world below itself and around.
    options: dict[str, float] = {"elevation_min_rad": -math.radians(30), "elevation_max_rad": math.radians(30)}
    rotation = np.eye(3) if case.up else FORWARD
    if method.startswith("image-space") and not case.up:
        # They take a lean for a shift of the image about the vertical, from which a camera that looks ahead is far.
        with pytest.raises(tiltvp.errors.InvalidInputError, match="within 45 degrees of the vertical"):
            tiltvp.TiltEstimator(camera, method=method, robot_from_camera=rotation, **options)
        return
    estimator = tiltvp.TiltEstimator(camera, method=method, robot_from_camera=rotation, **options)
    estimate, edges = estimator.with_edges(image)
    print(f"{case.image}: {method}: {estimate!r}")
    assert estimate.edge_pixels == len(edges) > 500
    assert edges.u.max() < camera.width
    assert edges.v.max() < camera.height
    assert estimate.reason
    if not estimate:
        assert estimate.confidence == 0.0
        assert np.isnan(estimate.normal).all()
        return
    assert np.isfinite(estimate.normal).all()
    assert 0.0 <= estimate.confidence <= 1.0
    assert estimate.alpha_rad < math.pi / 2
    assert np.isfinite(estimate.covariance_rad2).all()
    again = estimator(tiltvp.level(image, estimator, estimate))
    if estimate.confidence >= 0.9:
        # Sure of its lean, it finds next to none in the image that was made level by it.
        assert again
        assert again.alpha_rad < max(math.radians(1.0), 0.5 * estimate.alpha_rad)


@pytest.mark.parametrize("case", CASES, ids=[case.image for case in CASES])
def test_calibrations_of_mirrors_are_named_and_reflect(data: Path, case: Case) -> None:
    """A mirror turns z over, which no rotation does: the handedness of three bearings changes."""
    camera, _ = load(data, case)
    plain = camera.mirrored() if camera.mirror else camera
    assert looks_like_a_mirror(plain, field_of_view(plain)) == case.mirror
    assert not looks_like_a_mirror(plain.mirrored(), field_of_view(plain.mirrored()))
    assert camera.mirror == case.mirror
    about = np.array(field_of_view(plain).axis_px) + [[40.0, 0.0], [0.0, 40.0], [-30.0, -30.0]]
    seen, mirrored = plain.unproject(about), plain.mirrored().unproject(about)
    assert np.linalg.det(seen) * np.linalg.det(mirrored) < 0.0


@pytest.mark.parametrize("case", [case for case in CASES if case.mirror], ids=lambda case: case.image)
def test_the_calibration_of_a_mirror_sees_all_round(data: Path, case: Case) -> None:
    """Its bearings go round the axis once, and down past the horizon."""
    camera, _ = load(data, case)
    seen = camera.valid_mask()
    v, u = np.nonzero(seen)
    bearings = camera.unproject(np.column_stack([u, v]))
    azimuths = np.unique(np.round(np.degrees(np.arctan2(bearings[:, 1], bearings[:, 0])) / 10))
    assert len(azimuths) == 37
    assert bearings[:, 2].min() < 0.2 < bearings[:, 2].max()
