"""Laws that hold for any input: no exception but ours, and symmetries of the estimate."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import tiltvp
from tiltvp import _core
from tiltvp.errors import TiltvpError
from tiltvp.images import gray_from
from tiltvp.synth import RoomImage

MANY = settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
FEW = settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])

numbers = st.one_of(st.floats(), st.floats(-10.0, 10.0), st.floats(1.0, 500.0), st.integers(-5, 5))
angles = st.floats(-math.pi, math.pi)


def about_z(angle_rad: float) -> np.ndarray:
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def check_sentence(error: Exception) -> None:
    """A refusal is one line that says what was expected."""
    assert "\n" not in str(error)
    assert "expected" in str(error)


# --- any input ---------------------------------------------------------------------------------------------------


@MANY
@given(
    hnp.arrays(
        st.one_of(hnp.scalar_dtypes(), hnp.unicode_string_dtypes()),
        hnp.array_shapes(min_dims=0, max_dims=4, min_side=0),
    )
)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_any_array_is_an_image_or_refused(array: np.ndarray) -> None:
    before = array.tobytes()
    try:
        gray = gray_from(array)
    except TiltvpError:
        pass
    else:
        assert gray.dtype == np.uint8
        assert gray.shape == array.shape[:2]
    assert array.tobytes() == before


@MANY
@given(hnp.arrays(np.uint8, (72, 80)), st.sampled_from(tiltvp.METHODS))
def test_any_pixels_have_an_estimate(image: np.ndarray, method: str) -> None:
    camera = tiltvp.Camera.equidistant(width=80, height=72, focal_px=30.0, cx=39.5, cy=35.5)
    estimate, edges = tiltvp.TiltEstimator(camera, method=method).with_edges(image)
    assert len(edges) == estimate.edge_pixels >= estimate.prefiltered_pixels >= estimate.inlier_pixels
    assert bool(estimate) == bool(np.isfinite(estimate.normal).all())
    assert 0.0 <= estimate.confidence <= 1.0
    if not estimate:
        assert estimate.confidence == 0.0
    assert tiltvp.TiltEstimate.from_dict(estimate.to_dict()) == estimate


@MANY
@given(st.data())
@pytest.mark.parametrize("model", _core.CAMERA_MODELS)
def test_any_numbers_make_a_camera_or_are_refused(model: str, data: st.DataObject) -> None:
    parameters: dict[str, Any] = {
        one["name"]: data.draw(st.lists(numbers, max_size=6) if one["is_list"] else numbers, one["name"])
        for one in _core.lens_schema(model)["parameters"]
    }
    width, height = data.draw(st.tuples(*[st.integers(-1, 60)] * 2))
    mirror, limit = data.draw(st.booleans()), data.draw(st.none() | numbers)
    try:
        camera = tiltvp.Camera(model, width=width, height=height, max_theta_rad=limit, mirror=mirror, **parameters)
    except TiltvpError as error:
        check_sentence(error)
        return
    bearings = camera.unproject(data.draw(hnp.arrays(np.float64, (5, 2))))
    camera.project(data.draw(hnp.arrays(np.float64, (5, 3))))
    lengths = np.linalg.norm(bearings[np.isfinite(bearings).all(axis=1)], axis=1)
    assert lengths == pytest.approx(1.0, abs=1e-9)
    try:
        estimate = tiltvp.TiltEstimator(camera)(np.zeros((height, width), np.uint8))
    except TiltvpError:
        return
    assert not estimate


OPTIONS = [
    "gradient_min", "smoothing_px", "elevation_min_rad", "elevation_max_rad", "margin_px", "tilt_max_rad", "row_stride",
    "seed", "keep_fraction", "scale_rad", "tolerance_rad", "max_iterations", "threshold_px", "offset_max_px",
    "threshold_rad", "normal", "correction", "other",
]  # fmt: skip


@MANY
@given(st.dictionaries(st.sampled_from(OPTIONS), st.one_of(numbers, st.none(), st.text(max_size=3)), max_size=3))
@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_any_options_work_or_are_refused(method: str, options: dict[str, Any]) -> None:
    camera = tiltvp.Camera.equidistant(width=80, height=72, focal_px=30.0, cx=39.5, cy=35.5)
    image = np.random.default_rng(0).integers(0, 256, (72, 80), np.uint8)
    try:
        estimator = tiltvp.TiltEstimator(camera, method=method, **options)
    except TiltvpError as error:
        check_sentence(error)
        return
    assert isinstance(estimator(image), tiltvp.TiltEstimate)


# --- symmetries --------------------------------------------------------------------------------------------------


@FEW
@given(angles)
def test_turning_the_mounting_turns_the_direction(camera: tiltvp.Camera, room: RoomImage, turn: float) -> None:
    plain = _converged(camera)(room.gray)
    turned = _converged(camera, turn)(room.gray)
    assert turned.alpha_rad == pytest.approx(plain.alpha_rad, abs=1e-4)
    assert math.remainder(turned.beta_rad - plain.beta_rad - turn, math.tau) == pytest.approx(0.0, abs=2e-3)


def _converged(camera: tiltvp.Camera, turn_rad: float = 0.0) -> tiltvp.TiltEstimator:
    """The refined fit to its end: laws hold for what it converges to, wherever it starts."""
    mounting = about_z(turn_rad)
    return tiltvp.TiltEstimator(camera, robot_from_camera=mounting, tolerance_rad=1e-8, max_iterations=200)


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_turning_the_image_turns_the_direction(camera: tiltvp.Camera, room: RoomImage, quarters: int) -> None:
    """The camera is square and symmetric: a turned image is what a turned camera would have seen."""
    plain = _converged(camera)(room.gray)
    turned = _converged(camera)(np.rot90(room.gray, quarters))
    assert turned.edge_pixels == plain.edge_pixels
    expected = about_z(-quarters * math.pi / 2) @ plain.normal
    assert turned.normal == pytest.approx(expected, abs=1e-4)


def test_mirroring_the_image_mirrors_the_normal(camera: tiltvp.Camera, room: RoomImage) -> None:
    plain = _converged(camera)(room.gray)
    assert _converged(camera)(room.gray[:, ::-1]).normal == pytest.approx(plain.normal * [-1, 1, 1], abs=1e-4)
    assert _converged(camera)(room.gray[::-1]).normal == pytest.approx(plain.normal * [1, -1, 1], abs=1e-4)


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_a_negative_has_the_same_lean(camera: tiltvp.Camera, room: RoomImage, method: str) -> None:
    estimator = tiltvp.TiltEstimator(camera, method=method)
    # Which of two equal gradients is an edge decides where straight edges are cut.
    close = 1e-3 if method == "segments" else 1e-4
    assert estimator(255 - room.gray).normal == pytest.approx(estimator(room.gray).normal, abs=close)


@MANY
@given(st.floats(0.0, math.pi), angles, st.floats(0.0, math.pi), angles)
def test_errors_are_a_distance(a: float, b: float, c: float, d: float) -> None:
    one, other = tiltvp.normal_from_alpha_beta(a, b), tiltvp.normal_from_alpha_beta(c, d)
    assert np.linalg.norm(one) == pytest.approx(1.0)
    assert tiltvp.tilt_error_rad(one, one) == 0.0
    assert tiltvp.tilt_error_rad(one, other) == tiltvp.tilt_error_rad(other, one)
    assert 0.0 <= tiltvp.tilt_error_rad(one, other) <= math.pi
    assert tiltvp.tilt_error_rad(one, [0.0, 0.0, 5.0]) == pytest.approx(a, abs=1e-7)
    assert math.cos(tiltvp.tilt_error_rad(one, other)) == pytest.approx(float(one @ other), abs=1e-9)
