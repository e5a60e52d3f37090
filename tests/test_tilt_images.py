"""The images an estimator of the tilt takes and refuses, and what it leaves as it was."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest

import tiltvp
from tiltvp.errors import InvalidInputError
from tiltvp.synth import RoomImage


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
        (None, "NoneType"),
        ("image.png", "str"),
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


def test_a_lean_beyond_the_largest_one_is_not_sure(camera: tiltvp.Camera, render: Any) -> None:
    """Edges beyond `tilt_max_rad` are rejected, and those that are left agree on a smaller lean."""
    for degrees in (12.0, 13.0, 14.0):
        room = render(kind="living-room", seed=1, alpha_rad=math.radians(degrees), beta_rad=0.8)
        cut, wide = (tiltvp.TiltEstimator(camera, tilt_max_rad=limit)(room.gray) for limit in (None, 0.35))
        assert cut.alpha_rad < math.radians(degrees)
        assert cut.confidence <= 0.5
        assert "beyond the limit of 10.0 degrees" in cut.reason
        assert "tilt_max_rad" not in wide.reason


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_a_larger_lean_than_is_told_is_found_and_doubted(camera: tiltvp.Camera, render: Any, method: str) -> None:
    """Of the edges near the vertical alone any narrow limit would make a sure answer."""
    told, untold = (
        tiltvp.TiltEstimator(camera, method=method, tilt_max_rad=limit) for limit in (math.radians(2.0), None)
    )
    for degrees in (4.0, 6.0, 12.0, 20.0):
        room = render(kind="living-room", seed=1, alpha_rad=math.radians(degrees), beta_rad=0.8)
        doubted, other = told(room.gray), untold(room.gray)
        assert doubted.confidence <= 0.5
        assert math.degrees(tiltvp.tilt_error_rad(doubted.normal, other.normal)) < 0.2 or degrees > 6.0


def test_the_largest_lean_is_found(camera: tiltvp.Camera, render: Any) -> None:
    """Its edges stray to either side of it, and most are kept."""
    for degrees in (3.0, 6.0, 10.0):
        alpha = math.radians(degrees)
        room = render(kind="living-room", seed=1, alpha_rad=alpha, beta_rad=0.8)
        close, wide = (tiltvp.TiltEstimator(camera, tilt_max_rad=limit)(room.gray) for limit in (alpha, 0.35))
        truth = tiltvp.normal_from_alpha_beta(alpha, 0.8)
        errors = [math.degrees(tiltvp.tilt_error_rad(one.normal, truth)) for one in (close, wide)]
        assert errors[0] < errors[1] + 1.0, errors
