"""The options of corners: each changes something, and what tells nothing alone is refused."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from drawn_corners import CAMERA, COLOURS, GREYS, LEFT_FROM_RIGHT, LIT_FROM_ABOVE, drawn, pose, turn
from tiltvp._core import CORNER_METHODS, option_fields
from tiltvp.corner import CornerDetector, CornerPoseEstimator
from tiltvp.errors import InvalidInputError

pytestmark = pytest.mark.slow

DOWN = pose()[0][:, 1]
SHARED: dict[str, Any] = {
    "chromaticity_min": 0.8, "intensity_min": 180, "faces": "gbr", "orientation": "upside-down",
    "search_width_px": 20, "candidates_min": 2000, "line_threshold_px": 0.5, "seed": 7,
}  # fmt: skip
DETECTORS: dict[str, dict[str, Any]] = {
    "coloured": {
        **SHARED, "display_gamma": 3.0, "label_step_px": 1, "search_px": 6.0, "refine_px": 1.0, "step_min": 100.0,
        "threshold_px": 0.3, "ray_sigma_px": 0.1, "support_min_px": 60, "residual_max_px": 0.01,
    },
    "general": {
        "display_gamma": 1.0, "search_px": 4.0, "step_min": 60.0, "threshold_px": 0.3, "ray_sigma_px": 0.4,
        "support_min_px": 60, "residual_max_px": 0.01, "gradient_min": 2000.0, "gradient_start": 400.0,
        "smoothing_px": 2.0, "margin_px": 150.0, "segment_min_px": 90.0, "segment_threshold_px": 0.3,
        "gap_max_px": 0.0, "gap_max_share": 0.0, "overshoot_max_px": 0.0, "ray_angle_min_rad": 1.2, "gamma_rad": 0.5,
        "vertical_max_rad": 0.001, "support_min_share": 1.0, "corners_max": 1,
    },
    "paper": {**SHARED, "residual_max_px": 0.01, "line_sigma_px": 1.0},
}  # fmt: skip
OF_FOLLOWING = {"follow_px": 15.0, "guided_min_share": 1.0}
"""Of general, for the estimator, which looks for what it has seen."""
ESTIMATOR: dict[str, Any] = {
    "gamma_rad": 1.5, "gamma_sigma_rad": 0.02, "right_handed": False, "down": DOWN, "turn_sigma_rad": 0.01,
    "down_sigma_rad": 0.01, "forget_after": 0, "agree_max_rad": 1e-4, "parallel_max_rad": 0.0, "misfit_max": 0.01,
    "distance_min_m": 2.0, "distance_max_m": 1.0, "camera_height_m": 0.5, "camera_height_sigma_m": 0.1,
    "edge_length_m": 0.3, "known_edge": "x", "box_size_m": (0.3, 0.3, 0.3), "length_sigma_m": 0.01,
    "probability_min": 0.0,
}  # fmt: skip
ONE_CAMERA = {
    "camera_height_m": {"down": DOWN},
    "camera_height_sigma_m": {"down": DOWN, "camera_height_m": 0.5},
    "edge_length_m": {},
    "known_edge": {"edge_length_m": 0.3},
    "box_size_m": {},
    "length_sigma_m": {"edge_length_m": 0.3},
    "probability_min": {"down": (0.0, 1.0, 0.0), "method": "general"},
    "down_sigma_rad": {"down": (0.0, 1.0, 0.0), "method": "general"},
}
"""What matters for one camera, and what else is known then."""


@cache
def frames(method: str) -> list[list[np.ndarray]]:
    """Three frames of two cameras that turn by a degree each."""
    (rotation, vertex), faces = pose(), GREYS if method == "general" else COLOURS
    turned = [turn("y", -degrees) for degrees in (0.0, 1.0, 2.0)]
    sides = (np.zeros(3), LEFT_FROM_RIGHT[:3, 3])
    return [[drawn(by @ rotation, by @ vertex - side, faces, noise=3.0) for side in sides] for by in turned]


def poses(cameras: int, **options: Any) -> list[dict[str, Any]]:
    both = (CAMERA, LEFT_FROM_RIGHT) if cameras == 2 else ()
    estimator = CornerPoseEstimator(CAMERA, *both, **options)
    return [estimator(*images[:cameras]).to_dict() for images in frames(options.get("method", "coloured"))]


@pytest.mark.parametrize("method", CORNER_METHODS)
def test_every_option_of_a_detector_changes_something(method: str) -> None:
    other = DETECTORS[method]
    names = {field["name"] for field in option_fields("CornerDetector", method)} - {"method", "mask"}
    following = set(OF_FOLLOWING) if method == "general" else set()
    assert names == other.keys() | following
    faces = GREYS if method == "general" else LIT_FROM_ABOVE
    images = [frames(method)[0][0], drawn(*pose(), faces, noise=6.0)]
    vertical = DOWN if method == "general" else None

    def answer(**options: Any) -> list[list[dict[str, Any]]]:
        detector = CornerDetector(CAMERA, method=method, **options)
        return [[found.to_dict() for found in detector(image, vertical)] for image in images]

    # Gaps may be as long as the longer of two says.
    without = {"gap_max_px": {"gap_max_share": 0.0}, "gap_max_share": {"gap_max_px": 0.0}}
    for name, value in other.items():
        beside = without.get(name, {})
        assert answer(**beside, **{name: value}) != answer(**beside), f"{name} changes nothing"


@pytest.mark.parametrize("name", sorted(OF_FOLLOWING))
def test_options_of_following_change_something(name: str) -> None:
    known = {"method": "general", "down": DOWN}
    assert poses(2, **known, **{name: OF_FOLLOWING[name]}) != poses(2, **known)


def test_every_option_of_the_estimator_is_listed_here() -> None:
    assert {field["name"] for field in option_fields("CornerPoseEstimator")} == set(ESTIMATOR)


@pytest.mark.parametrize("name", ESTIMATOR)
def test_every_option_of_the_estimator_changes_something(name: str) -> None:
    cameras = 1 if name in ONE_CAMERA else 2
    known = ONE_CAMERA.get(name, {"method": "general"} | ({} if name == "down" else {"down": DOWN}))
    assert poses(cameras, **known, **{name: ESTIMATOR[name]}) != poses(cameras, **known)


@pytest.mark.parametrize(
    ("known", "complaint"),
    [
        ({"down_sigma_rad": 0.1}, r"down_sigma_rad = 0\.1 without down, expected both"),
        ({"camera_height_sigma_m": 0.1, "edge_length_m": 1.0}, r"camera_height_sigma_m = 0\.1 without camera_height_m"),
        ({"length_sigma_m": 0.1}, r"length_sigma_m = 0\.1 without edge_length_m or box_size_m"),
        ({"known_edge": "x"}, "known_edge = 'x' without edge_length_m"),
    ],
)
def test_what_tells_nothing_alone_is_refused(known: dict[str, Any], complaint: str) -> None:
    with pytest.raises(InvalidInputError, match=complaint):
        CornerPoseEstimator(CAMERA, **known)
    plain = CornerPoseEstimator(CAMERA)
    assert CornerPoseEstimator(CAMERA, **plain.options) == plain
