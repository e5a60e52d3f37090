"""The tilt of single images: every method on a rendered room, options, refusals, and what the values promise."""

from __future__ import annotations

import copy
import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import tiltvp
from tiltvp.errors import InvalidInputError
from tiltvp.synth import RoomImage

LARGEST_ERROR_DEG = {
    "refined": 1.2,
    "image-space-ransac": 3.2,
    "image-space-reject-refit": 2.4,
    "vector-consensus": 4.2,
}


def error_deg(estimate: tiltvp.TiltEstimate, room: RoomImage) -> float:
    truth = tiltvp.normal_from_alpha_beta(room.alpha_rad, room.beta_rad)
    return math.degrees(tiltvp.tilt_error_rad(estimate.normal, truth))


# --- answers -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_finds_the_lean_of_a_room(camera: tiltvp.Camera, room: RoomImage, method: str) -> None:
    estimate = tiltvp.TiltEstimator(camera, method=method)(room.gray)
    assert estimate
    assert error_deg(estimate, room) < LARGEST_ERROR_DEG[method]
    assert np.linalg.norm(estimate.normal) == pytest.approx(1.0, abs=1e-12)
    assert estimate.normal == pytest.approx(tiltvp.normal_from_alpha_beta(estimate.alpha_rad, estimate.beta_rad))
    assert math.tan(estimate.roll_rad) == pytest.approx(estimate.normal[1] / estimate.normal[2])
    assert math.sin(estimate.pitch_rad) == pytest.approx(-estimate.normal[0])
    assert 0.0 < estimate.confidence <= 1.0
    assert estimate.edge_pixels > estimate.prefiltered_pixels >= estimate.inlier_pixels > 100
    assert np.array_equal(estimate.covariance_rad2, estimate.covariance_rad2.T)
    assert (np.linalg.eigvalsh(estimate.covariance_rad2) > 0.0).all()
    assert (estimate.shift_px is not None) == method.startswith("image-space")
    assert estimate.report.iterations > 0
    assert estimate.report.residual_rms > 0.0
    assert estimate.reason == estimate.report.reason


def test_the_default_is_the_first_method(camera: tiltvp.Camera) -> None:
    assert tiltvp.TiltEstimator(camera).method == tiltvp.METHODS[0] == "refined"


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_edges_belong_to_the_estimate(camera: tiltvp.Camera, room: RoomImage, method: str) -> None:
    estimator = tiltvp.TiltEstimator(camera, method=method)
    estimate, edges = estimator.with_edges(room.gray)
    assert estimate == estimator(room.gray)
    assert len(edges) == estimate.edge_pixels == len(edges.u) == len(edges.v)
    assert edges.prefiltered.sum() == estimate.prefiltered_pixels
    assert edges.inlier.sum() == estimate.inlier_pixels == edges.inlier_mask.sum()
    assert not (edges.inlier & ~edges.prefiltered).any()
    assert edges.inlier_mask.shape == room.gray.shape
    assert edges.inlier_mask[edges.v[edges.inlier], edges.u[edges.inlier]].all()
    assert ((edges.phi_rad >= 0.0) & (edges.phi_rad < math.pi)).all()
    reach = np.cos(edges.phi_rad) * (edges.u - 127.5) + np.sin(edges.phi_rad) * (edges.v - 127.5)
    assert edges.offset_px == pytest.approx(reach, abs=1e-3)
    assert edges == estimator.with_edges(room.gray)[1]


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_edges_tell_their_normals(camera: tiltvp.Camera, room: RoomImage, method: str) -> None:
    estimate, edges = tiltvp.TiltEstimator(camera, method=method).with_edges(room.gray)
    normals = edges.normal
    assert normals.shape == (len(edges), 3)
    if method.startswith("image-space"):
        assert np.isnan(normals).all()
        return
    assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(len(edges)), abs=1e-6)
    bearings = camera.unproject(np.stack([edges.u, edges.v], axis=1).astype(float))
    assert np.einsum("ni,ni->n", normals, bearings) == pytest.approx(np.zeros(len(edges)), abs=5e-3)
    away = np.arcsin(np.abs(normals @ estimate.normal))
    # Inliers are within the threshold, of the random sample's direction where there is one.
    assert away[edges.inlier].max() < math.radians(4.1 if method == "refined" else 10.0)


def test_trimming_can_stop_early(camera: tiltvp.Camera, room: RoomImage) -> None:
    runs = [
        tiltvp.TiltEstimator(camera, method="image-space-reject-refit", max_iterations=most).with_edges(room.gray)
        for most in (0, 1, 2, 15)
    ]
    plain, edges = runs[0]
    assert plain.report.stop == "iteration-limit"
    assert (edges.inlier == edges.prefiltered).all()
    least_squares = np.linalg.lstsq(
        np.stack([np.cos(edges.phi_rad), np.sin(edges.phi_rad)], axis=1)[edges.prefiltered],
        edges.offset_px[edges.prefiltered],
    )[0]
    raw = tiltvp.TiltEstimator(camera, method="image-space-reject-refit", max_iterations=0, correction=None)
    assert raw(room.gray).shift_px == pytest.approx(np.hypot(*least_squares), rel=1e-4)
    kept = [run[1].inlier.sum() for run in runs]
    assert kept == sorted(kept, reverse=True)
    assert kept[0] > kept[1] > kept[2]


def test_too_few_edges_are_an_answer(camera: tiltvp.Camera) -> None:
    for method in tiltvp.METHODS:
        estimate, edges = tiltvp.TiltEstimator(camera, method=method).with_edges(np.zeros((256, 256), np.uint8))
        assert not estimate
        assert len(edges) == estimate.edge_pixels == estimate.inlier_pixels == 0
        assert estimate.confidence == 0.0
        assert np.isnan([estimate.alpha_rad, estimate.beta_rad, estimate.roll_rad, estimate.pitch_rad]).all()
        assert np.isnan(estimate.normal).all()
        assert np.isinf(np.diag(estimate.covariance_rad2)).all()
        assert estimate.report.stop == "too-few"
        assert "too few" in estimate.reason
        assert math.isnan(estimate.report.residual_rms)
        assert "no tilt" in repr(estimate)


def test_a_mirror_is_served_by_its_antipodal_vanishing_point(
    camera: tiltvp.Camera, room: RoomImage, upright_room: RoomImage
) -> None:
    """The same picture in a mirror that hangs above the camera: directions and band are upside down."""
    mirror = camera.mirrored()
    down = np.diag([1.0, -1.0, -1.0])
    for image in (room.gray, upright_room.gray):
        plain = tiltvp.TiltEstimator(camera)(image)
        band = {"elevation_min_rad": -math.pi / 4, "elevation_max_rad": 0.0}
        seen = tiltvp.TiltEstimator(mirror, **band)(image)
        assert seen.edge_pixels == plain.edge_pixels
        assert seen.normal == pytest.approx(plain.normal * [-1.0, -1.0, 1.0], abs=1e-6)
        turned = tiltvp.TiltEstimator(mirror, robot_from_camera=down)(image)
        assert turned.normal == pytest.approx(plain.normal * [1.0, -1.0, 1.0], abs=1e-6)


# --- images of every kind ----------------------------------------------------------------------------------------


def test_every_usual_kind_of_image_has_the_same_answer(camera: tiltvp.Camera, room: RoomImage) -> None:
    estimator, gray = tiltvp.TiltEstimator(camera), room.gray
    expected = estimator(gray)
    wide = np.zeros((256, 512), np.uint8)
    wide[:, ::2] = gray
    kinds = {
        "fortran": np.asfortranarray(gray),
        "strided": wide[:, ::2],
        "negative strides": np.ascontiguousarray(gray[::-1, ::-1])[::-1, ::-1],
        "uint16": gray.astype(np.uint16) * np.uint16(257),
        "float64": gray / 255.0,
        "float32": (gray / 255.0).astype(np.float32),
        "one channel": gray[:, :, None],
        "bgr": np.dstack([gray] * 3),
        "bgra": np.dstack([gray] * 4),
        "nested lists": gray.astype(np.float64).__truediv__(255.0).tolist(),
    }
    for name, image in kinds.items():
        assert estimator(image) == expected, name
    assert estimator.estimate_many(kinds.values()) == [expected] * len(kinds)


@pytest.mark.parametrize(
    ("image", "words"),
    [
        (np.zeros((256, 255), np.uint8), "256 x 255"),
        (np.zeros((0, 256), np.uint8), "empty"),
        (np.zeros((256,), np.uint8), "shape (256,)"),
        (np.zeros((256, 256, 2), np.uint8), "shape (256, 256, 2)"),
        (np.zeros((2, 256, 256, 3), np.uint8), "shape"),
        (np.zeros((256, 256), np.int16), "int16"),
        (np.zeros((256, 256), np.int64), "int64"),
        (np.zeros((256, 256), complex), "complex"),
        (np.full((256, 256), np.nan), "NaN"),
        (np.full((256, 256), np.inf), "inf"),
        (np.full((256, 256), -0.5), "-0.5"),
        (np.full((256, 256), 255.0), "255"),
        (np.zeros((256, 256), object), "object"),
        (np.zeros((256, 256), "U1"), "U1"),
        (None, "object"),
        ("image.png", "shape ()"),
    ],
)
def test_wrong_images_are_refused(camera: tiltvp.Camera, image: Any, words: str) -> None:
    estimator = tiltvp.TiltEstimator(camera)
    for ask in (estimator, estimator.with_edges, lambda image: estimator.estimate_many([image])):
        with pytest.raises(InvalidInputError) as refusal:
            ask(image)
        if image is not None:
            assert words in str(refusal.value)


def test_the_wrong_image_of_many_is_named(camera: tiltvp.Camera, room: RoomImage) -> None:
    with pytest.raises(InvalidInputError, match=r"images\[1\]"):
        tiltvp.TiltEstimator(camera).estimate_many([room.gray, np.zeros((3, 3), np.int8)])


def test_many_of_none_is_none(camera: tiltvp.Camera) -> None:
    assert tiltvp.TiltEstimator(camera).estimate_many([]) == []
    assert tiltvp.TiltEstimator(camera).estimate_many(iter(()), threads=3) == []


def test_arguments_are_not_altered_and_results_are_fresh(camera: tiltvp.Camera, room: RoomImage) -> None:
    image, mask, rotation = room.gray.copy(), np.ones((256, 256), bool), np.eye(3)
    estimator = tiltvp.TiltEstimator(camera, mask=mask, robot_from_camera=rotation)
    estimate, edges = estimator.with_edges(image)
    assert np.array_equal(image, room.gray)
    assert mask.all()
    assert np.array_equal(rotation, np.eye(3))
    mask[:], rotation[:] = False, 0.0
    assert estimator(image) == estimate
    assert pickle.loads(pickle.dumps(estimator)) == estimator
    for array in (estimate.normal, estimate.covariance_rad2, edges.u, edges.inlier_mask, estimator.robot_from_camera):
        assert array.flags.writeable
        array[...] = 0
    estimator.options["mask"][:] = False
    assert estimator.with_edges(image) == (estimate, edges)


# --- options -----------------------------------------------------------------------------------------------------

HALF = np.zeros((256, 256), dtype=bool)
HALF[:, :128] = True

CHANGES: dict[str, dict[str, Any]] = {
    "refined": {
        "gradient_min": 400.0,
        "smoothing_px": 2.0,
        "elevation_min_rad": 0.2,
        "elevation_max_rad": 0.6,
        "margin_px": 9.0,
        "tilt_max_rad": 0.03,
        "mask": HALF,
        "row_stride": 2,
        "keep_fraction": 0.4,
        "scale_rad": 0.2,
        "tolerance_rad": 0.1,
        "max_iterations": 1,
    },
    "image-space-ransac": {
        "gradient_min": 400.0,
        "smoothing_px": 2.0,
        "elevation_min_rad": 0.2,
        "elevation_max_rad": 0.6,
        "margin_px": 9.0,
        "tilt_max_rad": 0.03,
        "mask": HALF,
        "row_stride": 2,
        "seed": 5,
        "threshold_px": 2.0,
        "offset_max_px": 10.0,
        "correction": 200.0,
        "sampling": "progressive",
        "local_optimization": True,
        "score": "msac",
        "verification": "sprt",
    },
    "image-space-reject-refit": {
        "gradient_min": 400.0,
        "smoothing_px": 2.0,
        "elevation_min_rad": 0.2,
        "elevation_max_rad": 0.6,
        "margin_px": 9.0,
        "tilt_max_rad": 0.03,
        "mask": HALF,
        "row_stride": 2,
        "keep_fraction": 0.4,
        "offset_max_px": 10.0,
        "correction": None,
        "max_iterations": 1,
    },
    "vector-consensus": {
        "gradient_min": 200.0,
        "smoothing_px": 2.0,
        "elevation_min_rad": 0.2,
        "elevation_max_rad": 0.6,
        "margin_px": 9.0,
        "tilt_max_rad": 0.03,
        "mask": HALF,
        "row_stride": 2,
        "seed": 5,
        "threshold_rad": 0.02,
        "normal": "tangent",
        "correction": 1.8,
        "sampling": "progressive",
        "local_optimization": True,
        "score": "msac",
        "verification": "sprt",
    },
}
DRAWS_NOTHING = {("refined", "seed"), ("image-space-reject-refit", "seed")}


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_every_option_is_listed_here(camera: tiltvp.Camera, method: str) -> None:
    listed = set(CHANGES[method]) | {name for owner, name in DRAWS_NOTHING if owner == method}
    assert set(tiltvp.TiltEstimator(camera, method=method).options) == listed


MATTERS_WITH_MANY_TRIALS = {("vector-consensus", "score"), ("vector-consensus", "verification")}


@pytest.mark.parametrize(("method", "option"), [(method, option) for method in CHANGES for option in CHANGES[method]])
def test_every_option_changes_something(
    camera: tiltvp.Camera, render: Callable[..., RoomImage], method: str, option: str
) -> None:
    # How models are scored and tested matters only where one image needs many of them.
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
        ({"mask": np.ones((256, 256), np.uint8)}, ["mask", "bool"]),
        ({"mask": np.zeros((256, 256), bool)}, ["mask"]),
        ({"mask": [[True]]}, ["mask", "bool"]),
        ({"keep_fraction": 1.0}, ["keep_fraction"]),
        ({"scale_rad": 0.0}, ["scale_rad"]),
        ({"tolerance_rad": -1.0}, ["tolerance_rad"]),
        ({"max_iterations": 0}, ["max_iterations", "at least 1"]),
        ({"max_iterations": -1}, ["max_iterations"]),
        ({"method": "image-space-reject-refit", "max_iterations": -1}, ["max_iterations", "from 0"]),
        ({"method": "image-space-ransac", "correction": "closed"}, ["closed-form"]),
        ({"method": "image-space-ransac", "correction": -3.0}, ["correction"]),
        ({"method": "image-space-ransac", "threshold_px": 0.0}, ["threshold_px"]),
        ({"method": "vector-consensus", "normal": "radial"}, ["gradient", "tangent"]),
        ({"method": "vector-consensus", "threshold_rad": 5.0}, ["threshold_rad"]),
        ({"method": "vector-consensus", "correction": 0.0}, ["correction"]),
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


# --- values ------------------------------------------------------------------------------------------------------


def estimates(camera: tiltvp.Camera, room: RoomImage) -> list[tiltvp.TiltEstimate]:
    images = [room.gray, np.zeros_like(room.gray)]
    return [tiltvp.TiltEstimator(camera, method=method)(image) for method in tiltvp.METHODS for image in images]


def test_values_are_frozen(camera: tiltvp.Camera, room: RoomImage) -> None:
    estimate, edges = tiltvp.TiltEstimator(camera).with_edges(room.gray)
    for value, name in ((estimate, "alpha_rad"), (estimate, "other"), (estimate.report, "stop"), (edges, "u")):
        with pytest.raises(AttributeError):
            setattr(value, name, 1.0)
    with pytest.raises(AttributeError):
        tiltvp.TiltEstimator(camera).method = "refined"  # type: ignore[misc]
    with pytest.raises(TypeError):
        hash(edges)


def test_values_survive_copy_pickle_and_dict(camera: tiltvp.Camera, room: RoomImage) -> None:
    for estimate in estimates(camera, room):
        for value in (estimate, estimate.report):
            twins = [
                copy.copy(value),
                copy.deepcopy(value),
                pickle.loads(pickle.dumps(value)),
                type(value).from_dict(value.to_dict()),
            ]
            for twin in twins:
                assert twin == value
                assert hash(twin) == hash(value)
                assert repr(twin) == repr(value)
                assert type(twin) is type(value)
        assert estimate != estimate.report
        assert estimate != 3


def test_values_that_differ_are_unequal(camera: tiltvp.Camera, room: RoomImage) -> None:
    estimate = estimates(camera, room)[0]
    values = estimate.to_dict()
    for key in ("confidence", "edge_pixels", "inlier_pixels", "iterations", "residual_rms"):
        assert tiltvp.TiltEstimate.from_dict({**values, key: values[key] + 1}) != estimate
    for key in ("stop", "reason"):
        assert tiltvp.TiltEstimate.from_dict({**values, key: "other"}) != estimate


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"confidence": "high"}, "confidence"),
        ({"edge_pixels": -1}, "edge_pixels"),
        ({"edge_pixels": 1.5}, "edge_pixels"),
        ({"iterations": 2**40}, "iterations"),
        ({"normal": [1.0, 2.0]}, "normal"),
        ({"covariance_rad2": [1.0, 2.0]}, "covariance_rad2"),
        ({"normal_": 1.0}, "normal_"),
        ({"beta_rad": 2.5}, "beta_rad"),
        ({"alpha_rad": math.nan}, "alpha_rad"),
        ({"stop": None}, "stop"),
    ],
)
def test_wrong_dicts_are_refused(camera: tiltvp.Camera, room: RoomImage, change: dict[str, Any], words: str) -> None:
    values = tiltvp.TiltEstimator(camera)(room.gray).to_dict()
    with pytest.raises(InvalidInputError, match=words):
        tiltvp.TiltEstimate.from_dict({**values, **change})
    for key in values:
        with pytest.raises(InvalidInputError, match=key):
            tiltvp.TiltEstimate.from_dict({k: v for k, v in values.items() if k != key})


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_estimators_are_values_too(camera: tiltvp.Camera, room: RoomImage, method: str) -> None:
    given: dict[str, Any] = {"mask": HALF, "gradient_min": 170.0, "robot_from_camera": np.diag([-1.0, -1.0, 1.0])}
    estimator = tiltvp.TiltEstimator(camera, method=method, **given)
    twin = pickle.loads(pickle.dumps(estimator))
    assert type(twin) is tiltvp.TiltEstimator
    assert twin == estimator
    assert hash(twin) == hash(estimator)
    assert twin(room.gray) == estimator(room.gray)
    assert estimator != tiltvp.TiltEstimator(camera, method=method)
    assert "gradient_min=170" in repr(estimator)
    assert "\n" not in repr(estimator)
    assert estimator.camera == camera
    assert type(estimator.camera) is tiltvp.Camera
