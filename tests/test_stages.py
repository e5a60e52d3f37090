"""Estimates by way of edge pixels, and estimators made from one another."""

from __future__ import annotations

import copy
import itertools
import pickle
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

import tiltvp
from tiltvp.errors import InvalidInputError
from tiltvp.lab.evaluation.combinations import PAPER_METHODS, PIXEL_METHODS
from tiltvp.synth import RoomImage

LEFT = np.arange(256)[None, :] < 128
HALF = np.broadcast_to(LEFT, (256, 256)).copy()


@pytest.mark.slow
@pytest.mark.parametrize("options", [{}, {"tilt_max_rad": 0.5}, {"tilt_max_rad": 1e-3}, {"gradient_min": 40.0}])
@pytest.mark.parametrize("method", PIXEL_METHODS)
def test_stages_give_what_the_whole_gives(
    camera: tiltvp.Camera, render: Callable[..., RoomImage], images: list[np.ndarray], method: str, options: Any
) -> None:
    estimator = tiltvp.TiltEstimator(camera, method=method, **options)
    rng = np.random.default_rng(3)
    noise = [rng.integers(0, 256, (256, 256), np.uint8), rng.integers(90, 120, (256, 256), np.uint8)]
    office = render(kind="office", seed=1, alpha_rad=0.07, beta_rad=-2.0).gray
    for image in [*images, *noise, office]:
        edges = estimator.detect(image)
        assert estimator.estimate_edges(edges) == estimator(image)
        assert len(edges) == estimator(image).edge_pixels
        assert edges.gradient_min == estimator.options["gradient_min"]


def test_edges_of_every_kind_of_image(camera: tiltvp.Camera, room: RoomImage) -> None:
    estimator = tiltvp.TiltEstimator(camera)
    expected = estimator.detect(room.gray)
    assert estimator.detect(np.dstack([room.gray] * 3)) == expected
    assert estimator.detect(np.asfortranarray(room.gray)) == expected
    with pytest.raises(InvalidInputError, match="256 x 255"):
        estimator.detect(np.zeros((256, 255), np.uint8))
    with pytest.raises(InvalidInputError, match=r"ndarray, expected a tiltvp\.ImageEdges"):
        estimator.estimate_edges(room.gray)  # type: ignore[arg-type]


def test_edges_serve_every_method(camera: tiltvp.Camera, room: RoomImage) -> None:
    options = {"gradient_min": 200.0, "smoothing_px": 0.5}
    estimators = [tiltvp.TiltEstimator(camera, method=method, **options) for method in PIXEL_METHODS]
    edges = estimators[0].detect(room.gray)
    for estimator in estimators:
        assert estimator.detect(room.gray) == edges
        assert estimator.estimate_edges(edges) == estimator(room.gray)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"gradient_min": 300.0}, ["gradient_min = 300", "expected gradient_min = 150"]),
        ({"smoothing_px": 1.5}, ["smoothing_px = 1.5", "0.6"]),
        ({"elevation_min_rad": 0.1}, ["elevation_min_rad = 0.1"]),
        ({"elevation_max_rad": 0.5}, ["elevation_max_rad = 0.5"]),
        ({"margin_px": 4.0}, ["margin_px = 4"]),
        ({"row_stride": 2}, ["row_stride = 2", "expected row_stride = 1"]),
        ({"mask": HALF}, ["mask = a mask", "no mask"]),
        ({"robot_from_camera": np.diag([-1.0, -1.0, 1.0])}, ["robot_from_camera"]),
    ],
)
def test_edges_of_another_origin_are_refused(
    camera: tiltvp.Camera, room: RoomImage, change: dict[str, Any], words: list[str]
) -> None:
    edges = tiltvp.TiltEstimator(camera, **change).detect(room.gray)
    with pytest.raises(InvalidInputError) as refusal:
        tiltvp.TiltEstimator(camera).estimate_edges(edges)
    for word in words:
        assert word in str(refusal.value)


def test_edges_of_another_camera_are_refused(camera: tiltvp.Camera, room: RoomImage) -> None:
    edges = tiltvp.TiltEstimator(camera).detect(room.gray)
    other = tiltvp.Camera.equidistant(width=256, height=256, focal_px=77.0, cx=127.5, cy=127.5)
    with pytest.raises(InvalidInputError, match="edges with camera = another camera"):
        tiltvp.TiltEstimator(other).estimate_edges(edges)


def test_edges_are_values(camera: tiltvp.Camera, room: RoomImage) -> None:
    estimator = tiltvp.TiltEstimator(camera, mask=HALF)
    edges = estimator.detect(room.gray)
    for twin in (copy.copy(edges), copy.deepcopy(edges), pickle.loads(pickle.dumps(edges))):
        assert twin == edges
        assert repr(twin) == repr(edges)
        assert hash(twin) == hash(edges)
        assert estimator.estimate_edges(twin) == estimator(room.gray)
    assert edges != estimator.detect(room.gray[::-1])
    assert edges != 3
    assert "gradient_min=150" in repr(edges)
    with pytest.raises(AttributeError):
        edges.gradient_min = 3.0  # type: ignore[misc]


CHANGES: dict[str, list[dict[str, Any]]] = {
    "refined": [{"scale_rad": 0.02}, {"gradient_min": 80.0}, {"mask": HALF}, {"tilt_max_rad": 0.1}],
    "image-space-ransac": [{"threshold_px": 4.0}, {"gradient_min": 300.0}, {"correction": None}, {"seed": 4}],
    "image-space-reject-refit": [{"keep_fraction": 0.6}, {"smoothing_px": 1.0}, {"correction": 200.0}],
    "vector-consensus": [{"threshold_rad": 0.02}, {"normal": "tangent"}, {"margin_px": 3.0}, {"row_stride": 3}],
}


@pytest.mark.parametrize("method", PIXEL_METHODS)
def test_changed_options_are_as_good_as_new(camera: tiltvp.Camera, room: RoomImage, method: str) -> None:
    start = tiltvp.TiltEstimator(camera, method=method, elevation_max_rad=0.7)
    chain, all_changes = start, {"elevation_max_rad": 0.7}
    for change in CHANGES[method]:
        all_changes |= change
        chain = chain.with_options(**change)
        for made, options in (
            (chain, all_changes),
            (start.with_options(**change), {"elevation_max_rad": 0.7, **change}),
        ):
            fresh = tiltvp.TiltEstimator(camera, method=method, **options)
            assert type(made) is tiltvp.TiltEstimator
            assert made == fresh
            assert repr(made) == repr(fresh)
            assert made(room.gray) == fresh(room.gray)
            assert made.estimate_edges(made.detect(room.gray)) == fresh(room.gray)
            assert pickle.loads(pickle.dumps(made)) == made
    assert start == tiltvp.TiltEstimator(camera, method=method, elevation_max_rad=0.7)
    with pytest.raises(InvalidInputError, match="did you mean gradient_min"):
        start.with_options(gradient_minimum=3.0)
    with pytest.raises(InvalidInputError, match="gradient_min = -3"):
        start.with_options(gradient_min=-3.0)
    for fixed in ({"camera": camera}, {"method": method}, {"robot_from_camera": np.eye(3)}):
        with pytest.raises(InvalidInputError, match=f"{next(iter(fixed))}: given to with_options"):
            start.with_options(**fixed)


def test_a_sweep_is_cheap() -> None:
    """126 estimators of a large camera: made one by one they would take several seconds."""
    large = tiltvp.Camera.equidistant(width=640, height=480, focal_px=139.7, cx=319.5, cy=239.5, max_theta_rad=1.61)
    image = np.random.default_rng(0).integers(0, 256, (480, 640), np.uint8)
    starts = [tiltvp.TiltEstimator(large, method=method) for method in PAPER_METHODS]
    begin = time.perf_counter()
    sweep = [
        start.with_options(**{"gradient_min": gradient_min, name: value})
        for start, (name, values) in zip(
            starts,
            [
                ("threshold_px", np.arange(2.5, 16.0, 2.5)),
                ("keep_fraction", [0.5, 0.6, 0.7, 0.8, 0.9]),
                ("threshold_rad", np.radians(np.arange(0.5, 5.1, 0.5))),
            ],
            strict=True,
        )
        for gradient_min, value in itertools.product([100.0, 150.0, 200.0, 250.0, 300.0, 600.0], values)
    ]
    assert len(sweep) == 126
    assert time.perf_counter() - begin < 0.5
    edges = sweep[0].with_options(gradient_min=600.0).detect(image)
    strong = [estimator for estimator in sweep if estimator.options["gradient_min"] == 600.0]
    with ThreadPoolExecutor(4) as pool:
        answers = list(pool.map(lambda estimator: estimator.estimate_edges(edges), strong))
    assert answers == [estimator.estimate_edges(edges) for estimator in strong]
