"""Estimates and estimators of the tilt as values: frozen, copied, pickled, compared, made from dicts."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import numpy as np
import pytest

import tiltvp
from tiltvp.errors import InvalidInputError
from tiltvp.synth import RoomImage


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
    for key in ("edge_pixels", "inlier_pixels", "iterations", "residual_rms"):
        assert tiltvp.TiltEstimate.from_dict({**values, key: values[key] + 1}) != estimate
    assert tiltvp.TiltEstimate.from_dict({**values, "confidence": 0.5 * values["confidence"]}) != estimate
    for key in ("stop", "reason"):
        assert tiltvp.TiltEstimate.from_dict({**values, key: "other"}) != estimate


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"confidence": "high"}, "confidence"),
        ({"confidence": 7.0}, "confidence.*from 0 to 1"),
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
    half = np.indices((256, 256))[1] < 128
    given: dict[str, Any] = {"mask": half, "gradient_min": 170.0, "robot_from_camera": np.diag([-1.0, -1.0, 1.0])}
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


def test_copies_show_the_same_options(camera: tiltvp.Camera) -> None:
    """What pickle had made again showed all options, as if each had been given."""
    estimator = tiltvp.TiltEstimator(camera, method="segments", tilt_max_rad=0.2)
    assert repr(estimator).endswith(', method="segments", tilt_max_rad=0.2)')
    assert repr(pickle.loads(pickle.dumps(estimator))) == repr(estimator)
    assert repr(estimator.with_options(tilt_max_rad=None)) == repr(tiltvp.TiltEstimator(camera, method="segments"))
