"""The options of an estimator of the tilt: each changes something, and impossible ones are refused."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import tiltvp
from tiltvp._core import option_fields
from tiltvp.errors import InvalidInputError
from tiltvp.synth import RoomImage

HALF = np.zeros((256, 256), dtype=bool)
HALF[:, :128] = True
EDGES: dict[str, Any] = {
    "gradient_min": 400.0,
    "smoothing_px": 2.0,
    "elevation_min_rad": 0.2,
    "elevation_max_rad": 0.6,
    "margin_px": 9.0,
    "tilt_max_rad": 0.03,
    "mask": HALF,
    "row_stride": 2,
}
SAMPLING: dict[str, Any] = {"sampling": "progressive", "local_optimization": True, "score": "msac"}
CHANGES: dict[str, dict[str, Any]] = {
    "refined": {
        **EDGES,
        "keep_fraction": 0.4,
        "scale_rad": 0.2,
        "tolerance_rad": 0.1,
        "max_iterations": 1,
    },
    "image-space-ransac": {
        **EDGES,
        "seed": 5,
        "threshold_px": 2.0,
        "offset_max_px": 10.0,
        "correction": 200.0,
        **SAMPLING,
    },
    "image-space-reject-refit": {
        **EDGES,
        "keep_fraction": 0.4,
        "offset_max_px": 10.0,
        "correction": None,
        "max_iterations": 1,
    },
    "vector-consensus": {
        **EDGES,
        "gradient_min": 200.0,
        "seed": 5,
        "threshold_rad": 0.02,
        "normal": "tangent",
        "correction": 1.8,
        **SAMPLING,
    },
    "segments": {
        **{name: value for name, value in EDGES.items() if name != "row_stride"},
        "gradient_start": 800.0,
        "stray_max_px": 0.2,
        "rms_max_px": 0.2,
        "support_min_px": 30,
        "gap_max": 0.0,
        "scatter_rad": 0.05,
        "segments_max": 4,
    },
}
DRAWS_NOTHING = {("refined", "seed"), ("image-space-reject-refit", "seed"), ("segments", "seed")}
EVERY_ROW = ("segments", "row_stride")


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_every_option_is_listed_here(camera: tiltvp.Camera, method: str) -> None:
    listed = set(CHANGES.get(method, {})) | {name for owner, name in DRAWS_NOTHING if owner == method}
    listed |= {EVERY_ROW[1]} if method == EVERY_ROW[0] else set()
    in_force = set(tiltvp.TiltEstimator(camera, method=method).options)
    assert in_force == listed, "CHANGES here needs another value of each option of each method, and of no other"


def test_the_docs_of_the_estimator_tell_of_every_method_and_option() -> None:
    words = [f'"{method}"' for method in tiltvp.METHODS]
    words += [one["name"] for method in tiltvp.METHODS for one in option_fields("TiltEstimator", method)]
    docs = tiltvp.TiltEstimator.__doc__ or ""
    assert [word for word in words if not re.search(rf"(?<!\w){word}(?!\w)", docs)] == [], "not told in tiltvp/tilt.py"


MATTERS_WITH_MANY_TRIALS = {("vector-consensus", "score")}


@pytest.mark.slow
@pytest.mark.parametrize(("method", "option"), [(method, option) for method in CHANGES for option in CHANGES[method]])
def test_every_option_changes_something(
    camera: tiltvp.Camera, render: Callable[..., RoomImage], method: str, option: str
) -> None:
    # How models are scored matters only where one image needs many of them.
    images = [render(kind="office", seed=1, alpha_rad=0.07, beta_rad=-2.0).gray]
    images += [np.random.default_rng(seed).integers(0, 90, images[0].shape, dtype=np.uint8) for seed in range(3)]
    narrow = {"threshold_rad": 0.0005} if (method, option) in MATTERS_WITH_MANY_TRIALS else {}
    value = CHANGES[method][option]
    plain = tiltvp.TiltEstimator(camera, method=method, **narrow)
    changed = tiltvp.TiltEstimator(camera, method=method, **narrow, **{option: value})
    in_force = changed.options[option]
    assert np.array_equal(in_force, value) if isinstance(value, np.ndarray) else in_force == value
    assert changed != plain
    assert any(changed(image) != plain(image) for image in images)
    assert tiltvp.TiltEstimator(camera, method=method, **changed.options) == changed


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_options_in_force_are_keywords(camera: tiltvp.Camera, method: str) -> None:
    estimator = tiltvp.TiltEstimator(camera, method=method)
    assert tiltvp.TiltEstimator(camera, method=method, **estimator.options) == estimator


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"gradient_minimum": 3.0}, ["gradient_minimum", "did you mean gradient_min"]),
        ({"treshold_px": 3.0, "method": "image-space-ransac"}, ["did you mean threshold_px", "image-space-ransac"]),
        ({"threshold_px": 3.0}, ["threshold_px", "unknown to method", "refined", "keep_fraction", "seed"]),
        ({"method": "refine"}, ["refine", "vector-consensus"]),
        ({"method": ""}, ["image-space-ransac"]),
        ({"gradient_min": 0.0}, ["gradient_min", "positive"]),
        ({"gradient_min": -3}, ["gradient_min = -3"]),
        ({"gradient_min": math.nan}, ["gradient_min = NaN"]),
        ({"gradient_min": math.inf}, ["gradient_min"]),
        ({"gradient_min": "many"}, ["gradient_min", "'many'", "number"]),
        ({"gradient_min": None}, ["gradient_min", "number"]),
        ({"smoothing_px": -1.0}, ["smoothing_px"]),
        ({"smoothing_px": 11.0}, ["smoothing_px", "10"]),
        ({"margin_px": 1e9}, ["margin_px"]),
        ({"margin_px": 900.0}, ["band"]),
        ({"elevation_min_rad": 1.0, "elevation_max_rad": 0.5}, ["elevation_max_rad"]),
        ({"elevation_max_rad": 45.0}, ["elevation_max_rad = 45", "pi/2"]),
        ({"elevation_min_rad": -1.5, "elevation_max_rad": -1.0}, ["band that some pixel of the camera sees"]),
        ({"tilt_max_rad": 0.0}, ["tilt_max_rad"]),
        ({"tilt_max_rad": 2.0}, ["tilt_max_rad"]),
        ({"seed": -1}, ["seed"]),
        ({"seed": 2**64}, ["seed"]),
        ({"seed": 1.5}, ["seed"]),
        ({"mask": np.ones((3, 3), bool)}, ["mask", "256 x 256"]),
        ({"mask": np.ones((256, 256), np.uint8)}, ["mask = numbers of shape [256, 256]", "bool"]),
        ({"mask": np.zeros((256, 256), bool)}, ["mask: got False everywhere"]),
        ({"mask": [[True]]}, ["mask", "bool"]),
        ({"keep_fraction": 1.0}, ["keep_fraction"]),
        ({"scale_rad": 0.0}, ["scale_rad"]),
        ({"tolerance_rad": -1.0}, ["tolerance_rad"]),
        ({"max_iterations": 0}, ["max_iterations = 0", "at least 1"]),
        ({"max_iterations": -1}, ["max_iterations"]),
        ({"method": "image-space-reject-refit", "max_iterations": -1}, ["max_iterations", "from 0"]),
        ({"method": "image-space-ransac", "correction": "closed"}, ["closed-form"]),
        ({"method": "image-space-ransac", "correction": -3.0}, ["correction"]),
        ({"method": "image-space-ransac", "threshold_px": 0.0}, ["threshold_px"]),
        (
            {"method": "image-space-ransac", "offset_max_px": 5.0, "tilt_max_rad": 0.1},
            ["offset_max_px = 5", "tilt_max_rad"],
        ),
        ({"method": "vector-consensus", "normal": "radial"}, ["gradient", "tangent"]),
        ({"method": "vector-consensus", "threshold_rad": 5.0}, ["threshold_rad"]),
        ({"method": "vector-consensus", "correction": 0.0}, ["correction"]),
        ({"method": "segments", "row_stride": 2}, ["row_stride = 2", "expected 1", "row to row"]),
        ({"method": "segments", "margin_px": 0.0}, ["margin_px = 0", "at least 1 pixel"]),
        ({"method": "segments", "scatter_rad": 0.0}, ["scatter_rad"]),
        ({"method": "segments", "segments_max": 1}, ["segments_max = 1", "from 2"]),
        ({"method": "segments", "support_min_px": 3}, ["support_min_px = 3", "from 4"]),
        ({"method": "segments", "gap_max": -1.0}, ["gap_max"]),
        ({"robot_from_camera": np.zeros((3, 3))}, ["robot_from_camera", "rotation"]),
        ({"robot_from_camera": np.diag([1.0, 1.0, -1.0])}, ["determinant"]),
        ({"robot_from_camera": 1.001 * np.eye(3)}, ["rotation"]),
        ({"robot_from_camera": np.full((3, 3), np.nan)}, ["not finite"]),
        ({"robot_from_camera": np.eye(4)}, ["(3, 3)"]),
        ({"robot_from_camera": "up"}, ["robot_from_camera"]),
    ],
)
def test_impossible_options_are_refused(camera: tiltvp.Camera, options: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(InvalidInputError) as refusal:
        tiltvp.TiltEstimator(camera, **options)
    for word in words:
        assert word in str(refusal.value)


def test_a_camera_is_asked_for() -> None:
    with pytest.raises(InvalidInputError, match=r"expected a tiltvp\.Camera"):
        tiltvp.TiltEstimator("camera.yaml")  # type: ignore[arg-type]


def test_masked_pixels_are_not_looked_at(camera: tiltvp.Camera, room: RoomImage) -> None:
    estimator = tiltvp.TiltEstimator(camera, mask=HALF)
    assert 0.4 < estimator.region_pixels / tiltvp.TiltEstimator(camera).region_pixels < 0.5
    _, edges = estimator.with_edges(room.gray)
    assert HALF[edges.v, edges.u].all()
    other = room.gray.copy()
    other[:, 128:] = np.random.default_rng(0).integers(0, 256, (256, 128))
    assert estimator(other) == estimator(room.gray)
    fortran = np.asfortranarray(HALF)
    assert tiltvp.TiltEstimator(camera, mask=fortran) == estimator


def test_a_small_factor_goes_with_a_largest_lean(camera: tiltvp.Camera, room: RoomImage) -> None:
    """The methods' own largest offset was taken beside the lean that was told, and refused for its own lean."""
    small = tiltvp.AffineCorrection(factor=10.0, offset_rad=0.0)
    with pytest.raises(InvalidInputError, match="option correction = 10"):
        tiltvp.TiltEstimator(camera, method="image-space-ransac", correction=small)
    told = tiltvp.TiltEstimator(camera, method="image-space-ransac", correction=small, tilt_max_rad=0.5)
    given = tiltvp.TiltEstimator(camera, method="image-space-ransac", correction=small, offset_max_px=5.0)
    assert told(room.gray).inlier_pixels == given(room.gray).inlier_pixels > 0
    with pytest.raises(InvalidInputError, match="option tilt_max_rad"):
        tiltvp.TiltEstimator(camera, method="image-space-ransac", correction=small, tilt_max_rad=1.6)
