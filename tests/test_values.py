"""Every frozen value keeps the same promises: repr, equality with NaN, hash, copies, pickle, dicts, and refusals."""

from __future__ import annotations

import copy
import dataclasses
import importlib
import json
import math
import pickle
import pkgutil
from typing import Any
from unittest.mock import ANY

import numpy as np
import pytest

import tiltvp
from tiltvp import _core, corner
from tiltvp import lines as tl
from tiltvp.cli.tables import finite
from tiltvp.errors import InvalidInputError
from tiltvp.synth import RoomImage, simulate_drive

# Classes with `to_dict` that are made again from their constructor's arguments, and are tested with their own room.
REMADE = {"Camera"}
NAN_NORMALS = np.zeros((0, 3))


def corners() -> list[Any]:
    """Values of a corner of right angles that is seen by a pair of cameras, and of an empty pair of images."""
    edges = np.linalg.qr(np.array([[1.0, 0.2, 0.3], [0.1, 1.0, -0.4], [-0.5, 0.2, 1.0]]))[0]
    features = []
    for shift_m in (0.0, 0.12):
        points = [np.array([0.2 - shift_m, -0.1, 2.0]) + np.linspace(0.02, 0.4, 30)[:, None] * edge for edge in edges]
        arcs = [row / np.linalg.norm(row, axis=1, keepdims=True) for row in points]
        features.append(corner.fit(*arcs, sigma_rad=1e-4))
    left_from_right = np.eye(4)
    left_from_right[0, 3] = 0.12
    camera = tiltvp.Camera.pinhole(width=64, height=48, fx=50.0, fy=50.0, cx=31.5, cy=23.5)
    estimator = corner.CornerPoseEstimator(corner.CornerDetector(camera, method="general"))
    many = corner.solve_many([[0, 0, 1]], [[1, 0, 1]], [[-0.5, 0.8, 1]], [[-0.5, -0.8, 1]], math.pi / 2)
    return [
        features[0],
        corner.attitudes(features[0], math.pi / 2)[0],
        corner.poses(*features, left_from_right, math.pi / 2)[0],
        corner.resolve(features, math.pi / 2)[0],
        many,
        estimator(np.zeros((48, 64), np.uint8)),
    ]


@pytest.fixture(scope="module", name="values")
def fixture_values(camera: tiltvp.Camera, room: RoomImage) -> dict[str, list[Any]]:
    """Values by the name of their class, NaN among them where a class has it."""
    estimator = tiltvp.TiltEstimator(camera)
    estimate, edges = estimator.with_edges(room.gray)
    nothing, _ = estimator.with_edges(np.zeros_like(room.gray))
    filter_ = tiltvp.TiltFilter()
    extractor = tl.LineExtractor(camera)
    lines = extractor(room.gray)
    drive = simulate_drive("paper", seed=1)
    calibrator = tiltvp.SelfCalibrator(wheel_base_m=0.4, start=(0.2, 0.0, 0.0), start_sigma=(0.2, 0.2, 0.6))
    leans = np.linspace(0.01, 0.3, 40)
    values = [
        *(estimate, nothing, edges, estimate.report, nothing.report),
        *(filter_.estimate, filter_.step(estimate), filter_.estimate, filter_.step(nothing)),
        *(tiltvp.common_direction(np.eye(3)[:2]), tiltvp.common_direction(NAN_NORMALS)),
        *(tiltvp.train_affine(100 * leans, leans), tiltvp.train_posterior(100 * leans, leans)),
        *(lines, tl.LineTracker().update(lines, extractor.describe(room.gray, lines))),
        *(calibrator.step(0.1, 0.1, [1], [0.3]), calibrator.estimate),
        tiltvp.calibrate(drive.odometry, drive.bearings, wheel_base_m=0.4, start=(0.2, 0.0, 0.0)),
        *tiltvp.TiltEstimator(camera, method="segments", tilt_max_rad=0.8)(room.gray).alternatives,
        *(tiltvp.SegmentDetector(camera)(image) for image in (room.gray, np.zeros_like(room.gray))),
        *corners(),
    ]
    values += values[-1].hypotheses or [_core.CornerHypothesis.from_dict(hypothesis())]
    values.append(_core.BelievedCorner.from_dict(believed()))
    by_name: dict[str, list[Any]] = {}
    for value in values:
        by_name.setdefault(type(value).__name__, []).append(value)
    return by_name


def believed() -> dict[str, Any]:
    """A corner of which each edge tells something else."""
    return {
        "id": 3,
        "hypotheses": [hypothesis()],
        "left": 2,
        "right": None,
        "edge_lengths_m": [0.4, 0.3, None],
        "edge_length_sigmas_m": [0.002, 0.001, None],
        "edge_ends_m": [[0.4, 0.0, 2.0], None, None],
        "edge_angles_rad": [1.5, None, 1.6],
        "edge_angle_sigmas_rad": [0.05, None, 0.02],
    }


def hypothesis() -> dict[str, Any]:
    """A hypothesis from one image, which has no place."""
    return {
        "camera_from_object": np.eye(3).tolist(),
        "edges": np.eye(3).tolist(),
        "vertex_m": None,
        "covariance": (1e-6 * np.eye(6)).tolist(),
        "probability": 0.75,
        "right_handed": True,
        "misfit": math.nan,
    }


CLASSES = sorted(name for name in _core.__all__ if hasattr(getattr(_core, name), "from_dict") and name not in REMADE)


@pytest.mark.parametrize("name", CLASSES)
def test_values_keep_their_promises(values: dict[str, list[Any]], name: str) -> None:
    for value in values[name]:
        plain = value.to_dict()
        twins = [
            copy.copy(value),
            copy.deepcopy(value),
            pickle.loads(pickle.dumps(value)),
            type(value).from_dict(plain),
            type(value).from_dict(json.loads(json.dumps(plain))),
        ]
        for twin in twins:
            assert type(twin) is type(value)
            assert twin == value
            assert hash(twin) == hash(value)
            assert repr(twin) == repr(value)
            assert str(twin.to_dict()) == str(plain)
        assert twins[0] is value
        assert value != 1
        assert value == ANY
        assert repr(value).startswith(name)
        assert "\n" not in repr(value)
        with pytest.raises(AttributeError):
            setattr(value, next(iter(plain)), None)


@pytest.mark.parametrize("name", CLASSES)
def test_what_json_knows_of_a_value_is_read(values: dict[str, list[Any]], name: str) -> None:
    """The command line writes null for NaN and infinity; both are NaN afterwards."""
    for value in values[name]:
        written = finite(value.to_dict())
        read = type(value).from_dict(json.loads(json.dumps(written, allow_nan=False)))
        assert finite(read.to_dict()) == json.loads(json.dumps(written))


@pytest.mark.parametrize("name", CLASSES)
def test_other_dicts_are_refused(values: dict[str, list[Any]], name: str) -> None:
    value = values[name][0]
    plain = value.to_dict()
    with pytest.raises(InvalidInputError, match=r"unknown key .*colour.*, expected .*"):
        type(value).from_dict({**plain, "colour": 1})
    for key in plain:
        with pytest.raises(InvalidInputError, match=f'"{key}" is missing'):
            type(value).from_dict({other: plain[other] for other in plain if other != key})
        with pytest.raises(InvalidInputError, match=key):
            type(value).from_dict({**plain, key: object()})
    with pytest.raises(InvalidInputError, match="expected a dict"):
        type(value).from_dict([plain])


@pytest.mark.parametrize("name", CLASSES)
def test_every_item_tells_values_apart(values: dict[str, list[Any]], name: str) -> None:
    """A value with one number more or less is another one, but for items that follow from others."""
    value = values[name][0]
    changed = 0
    for key, item in value.to_dict().items():
        if isinstance(item, bool) or not isinstance(item, (int, float)):
            continue
        try:
            other = type(value).from_dict({**value.to_dict(), key: item + 1})
        except InvalidInputError:
            continue
        if str(other.to_dict()) != str(value.to_dict()):
            assert other != value, key
            changed += 1
    assert changed or name in {
        "CornerAttitudes",
        "CornerFeature",
        "EdgeElements",
        "FilterStep",
        "Lines",
        "CommonDirection",
        "Segments",
    }


@pytest.mark.parametrize("size_px", [(1, 1), (10**7, 10**7), (2**33, 2**33)])
def test_edges_are_of_an_image_that_can_be(values: dict[str, list[Any]], size_px: tuple[int, int]) -> None:
    edges = values["EdgeElements"][0].to_dict()
    with pytest.raises(InvalidInputError, match="size_px"):
        _core.EdgeElements.from_dict(edges | {"size_px": size_px})


def test_arrays_are_fresh(values: dict[str, list[Any]]) -> None:
    for name in CLASSES:
        for value in values[name]:
            for key in value.to_dict():
                found = getattr(value, key, None)
                if isinstance(found, np.ndarray) and found.size:
                    found[:] = 0
            assert value == type(value).from_dict(value.to_dict())
            assert value == pickle.loads(pickle.dumps(value))


def test_remade_values(camera: tiltvp.Camera) -> None:
    drive = simulate_drive("paper", seed=3, landmarks=4)
    again = pickle.loads(pickle.dumps(drive))
    assert again == drive
    assert hash(again) == hash(drive)
    assert np.array_equal(again.bearings, drive.bearings)
    assert drive != simulate_drive("paper", seed=4, landmarks=4)
    assert copy.deepcopy(drive) is drive
    rays = _core.PixelRays(camera, samples=2)
    again = pickle.loads(pickle.dumps(rays))
    assert again == rays
    assert hash(again) == hash(rays)
    assert copy.copy(rays) is rays
    assert rays != _core.PixelRays(camera, samples=1)


def test_values_with_arrays_are_compared_without_an_error() -> None:
    """Those of `dataclass` would compare arrays by ==, which has no truth."""
    compared = []
    for module in pkgutil.walk_packages(tiltvp.__path__, "tiltvp."):
        if module.name.startswith(("tiltvp.cli", "tiltvp.lab", "tiltvp.__main__")):
            continue
        for name, kind in vars(importlib.import_module(module.name)).items():
            if name.startswith("_") or not (isinstance(kind, type) and dataclasses.is_dataclass(kind)):
                continue
            has_arrays = any("NDArray" in str(field.type) for field in dataclasses.fields(kind))
            if has_arrays and kind.__eq__ is not object.__eq__:
                compared.append(name)
    assert compared == []
