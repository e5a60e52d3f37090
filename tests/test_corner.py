"""Corners from Python: the closed form, noisy features, what is told apart and what is not."""

from __future__ import annotations

import copy
import json
import math
import pickle
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tiltvp import corner
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

RNG_SEED = 5
LEFT_FROM_RIGHT = np.array([[1.0, 0, 0, 0.12], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def rotations(rng: np.random.Generator, count: int) -> Array:
    q = rng.normal(size=(count, 4))
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def edges_of(rotation: Array, gamma: float, side: float = 1.0) -> Array:
    """The edges x, y, z of an attitude as rows."""
    return np.array([rotation[:, 0], rotation[:, 1], rotation @ [math.cos(gamma), 0.0, side * math.sin(gamma)]])


def arcs(rotation: Array, vertex: Array, gamma: float, rng: np.random.Generator | None, sigma: float) -> list[Array]:
    """Bearings along the rays of a corner, off them at random."""
    out = []
    for edge in edges_of(rotation, gamma):
        points = vertex + np.linspace(0.02, 0.4, 50)[:, None] * edge
        bearings = points / np.linalg.norm(points, axis=1, keepdims=True)
        normal = np.cross(vertex, edge) / np.linalg.norm(np.cross(vertex, edge))
        if rng is not None:
            bearings = bearings + sigma * rng.normal(size=(50, 1)) * normal
            bearings /= np.linalg.norm(bearings, axis=1, keepdims=True)
        out.append(bearings)
    return out


def angle(a: Array, b: Array) -> float:
    return float(2 * np.arcsin(min(1.0, np.linalg.norm(a - b) / math.sqrt(8))))


@pytest.fixture(name="pose")
def fixture_pose() -> tuple[Array, Array, float]:
    """An attitude, a vertex in metres, and an angle."""
    return rotations(np.random.default_rng(RNG_SEED), 1)[0], np.array([0.2, -0.1, 2.0]), 1.9


def feature_of(pose: tuple[Array, Array, float], sigma: float = 1e-4, shift_m: float = 0.0) -> corner.CornerFeature:
    rotation, vertex, gamma = pose
    rng = np.random.default_rng(RNG_SEED + 1)
    return corner.fit(*arcs(rotation, vertex - [shift_m, 0, 0], gamma, rng, sigma), sigma_rad=sigma)


def test_truth_is_among_the_solutions_of_many() -> None:
    rng = np.random.default_rng(RNG_SEED)
    count = 2000
    truth, gamma = rotations(rng, count), np.radians(rng.uniform(17, 160, count))
    vertex = rng.normal(size=(count, 3))
    edges = np.array([edges_of(r, g, s) for r, g, s in zip(truth, gamma, rng.choice([-1, 1], count), strict=True)])
    rays = [vertex + 0.5 * edges[:, i] for i in range(3)]
    found = corner.solve_many(vertex, *rays, gamma)
    assert found.corners == count
    assert len(found) >= 2 * count
    off = np.array([angle(a, truth[i]) for a, i in zip(found.camera_from_object, found.corner, strict=True)])
    limit = 1e-12 + 1e-14 * found.sensitivity
    best = np.full(count, np.inf)
    np.minimum.at(best, found.corner, off / limit)
    assert best.max() < 1
    assert corner.solve_many(vertex[:1], *(ray[:1] for ray in rays), gamma[:1]).of(0) == found.of(0)
    one = corner.solve(vertex[7], *(ray[7] for ray in rays), gamma[7])
    assert one == found.of(7)
    assert found.edges.shape == (len(found), 3, 3)
    assert set(found.case) <= {"all-away", "one-perpendicular", "one-toward"}
    assert (found.mirrored.sum(), found.right_handed.dtype) == (len(found) // 2, np.dtype(bool))


def test_right_angle_is_the_default_and_none_is_a_list() -> None:
    vertex = [0.0, 0.0, 1.0]
    three = [[1.0, 0, 1], [-0.5, 0.8, 1], [-0.5, -0.8, 1]]
    assert corner.solve(vertex, *three) == corner.solve(vertex, *three, math.pi / 2)
    # Three rays within a right angle are no corner of a box.
    assert corner.solve(vertex, [1, 0, 1], [1, 0.3, 1], [1, -0.3, 1]) == []
    none = corner.solve_many(np.empty((0, 3)), *[np.empty((0, 3))] * 3)
    assert (len(none), none.camera_from_object.shape, none.alpha_rad.shape) == (0, (0, 3, 3), (0,))


def test_fitted_feature_gives_attitudes_with_covariance(pose: tuple[Array, Array, float]) -> None:
    rotation, _, gamma = pose
    feature = feature_of(pose)
    found = corner.attitudes(feature, gamma)
    best = min(found, key=lambda a: angle(a.camera_from_object, rotation))
    sigma = math.sqrt(np.trace(best.covariance_rad2))
    assert angle(best.camera_from_object, rotation) < 4 * sigma < 0.05
    wide = corner.attitudes(feature, gamma, gamma_sigma_rad=0.05)[0]
    assert np.trace(wide.covariance_rad2) > np.trace(found[0].covariance_rad2)
    assert corner.screen(feature, gamma) is None


def test_pair_tells_the_interpretations_apart(pose: tuple[Array, Array, float]) -> None:
    rotation, vertex, gamma = pose
    left, right = feature_of(pose), feature_of(pose, shift_m=0.12)
    found = corner.poses(left, right, LEFT_FROM_RIGHT, gamma)
    assert found[0].probability > 0.99
    assert sum(p.probability for p in found) == pytest.approx(1)
    assert angle(found[0].camera_from_object, rotation) < 0.02
    assert np.linalg.norm(found[0].vertex_m - vertex) < 0.02
    assert found[0].fused
    np.testing.assert_allclose(found[0].camera_in_object_m, -found[0].camera_from_object.T @ found[0].vertex_m)
    assert np.all(np.linalg.eigvalsh(found[0].camera_in_object_covariance_m2) > 0)
    apart = corner.poses(left, right, LEFT_FROM_RIGHT, gamma, fuse=False)[0]
    assert not apart.fused
    assert np.linalg.norm(apart.vertex_m - vertex) < 0.02
    point = corner.triangulate(
        np.array([left.vertex, right.vertex]),
        [left.vertex_covariance_rad2, right.vertex_covariance_rad2],
        [np.eye(4), LEFT_FROM_RIGHT],
    )
    assert point is not None
    np.testing.assert_allclose(point[0], apart.vertex_m)


def test_one_view_is_undecided_until_something_is_known(pose: tuple[Array, Array, float]) -> None:
    rotation, _, gamma = pose
    feature = feature_of(pose)
    undecided = corner.resolve([feature], gamma)
    assert [p.probability for p in undecided[:2]] == pytest.approx([undecided[0].probability] * 2, rel=1e-3)
    down = rotation[:, 1]
    elevation = math.asin(-down[2])
    priors: list[Any] = [
        corner.GravityPrior(tuple(down), 0.02, "down"),
        corner.GravityPrior(tuple(-down), 0.02, "either"),
        corner.KnownAttitude.of(rotation, 0.1),
    ]
    for prior in priors:
        first = corner.resolve([feature], gamma, priors=[prior])[0]
        assert angle(first.common_from_object, rotation) < 0.02, prior
        assert first.probability > 0.9, prior
    by_elevation = corner.resolve([feature], gamma, priors=[corner.ElevationPrior(elevation, 0.02, "down")])
    assert by_elevation[0].probability >= 0.5
    both = corner.resolve([feature], gamma, right_handed=True)
    assert len(both) < len(undecided)


def test_included_angle_and_screening(pose: tuple[Array, Array, float]) -> None:
    rotation, _, gamma = pose
    feature = feature_of(pose)
    found = corner.included_angle(feature, rotation[:, 1], np.eye(3) * 1e-6)
    assert found is not None
    assert abs(found[0] - gamma) < 5 * found[1] < 0.1
    sharp = corner.fit(
        *(np.array([[0, 0, 1], b]) / np.linalg.norm([[0, 0, 1], b], axis=1)[:, None]
          for b in ([1.0, 0, 1], [1, 0.3, 1], [1, -0.3, 1])), sigma_rad=1e-3,
    )  # fmt: skip
    assert corner.attitudes(sharp) == []
    assert "degrees" in (corner.screen(sharp) or "")


def test_values_travel(pose: tuple[Array, Array, float]) -> None:
    rotation, vertex, gamma = pose
    left, right = feature_of(pose), feature_of(pose, shift_m=0.12)
    values: list[Any] = [
        corner.attitudes(left, gamma)[0],
        corner.poses(left, right, LEFT_FROM_RIGHT, gamma)[0],
        corner.resolve([left, right], gamma)[0],
        corner.solve_many([vertex], *([vertex + e] for e in edges_of(rotation, gamma)), gamma),
    ]
    for value in values:
        again = pickle.loads(pickle.dumps(value))
        assert again == value == copy.deepcopy(value) == copy.copy(value)
        assert hash(again) == hash(value)
        assert type(value).from_dict(json.loads(json.dumps(value.to_dict()))) == value
        assert repr(value).startswith(type(value).__name__)
        assert value != 1
        with pytest.raises(InvalidInputError, match="unknown key"):
            type(value).from_dict(value.to_dict() | {"colour": 1})
        with pytest.raises(InvalidInputError, match="missing"):
            type(value).from_dict(dict(list(value.to_dict().items())[1:]))
    assert values[0] != corner.attitudes(left, gamma)[1]
    assert corner.GravityPrior((0, 1, 0), 0.1) == corner.GravityPrior((0, 1, 0), 0.1)


def test_bad_input_is_refused(pose: tuple[Array, Array, float]) -> None:
    vertex = [0.0, 0.0, 1.0]
    rays = ([1.0, 0, 1], [-0.5, 0.8, 1], [-0.5, -0.8, 1])
    feature = feature_of(pose)
    for gamma in (0.0, math.pi, math.nan, -1.0):
        with pytest.raises(InvalidInputError, match="gamma_rad"):
            corner.solve(vertex, *rays, gamma)
    for wrong in ([0.0, 0, 1], [0, 0, -2], [0, 0, 0], [math.nan, 0, 1]):
        with pytest.raises(InvalidInputError, match="ray"):
            corner.solve(vertex, wrong, *rays[1:])
    with pytest.raises(InvalidInputError, match="x_ray"):
        corner.solve(vertex, [1, 2], *rays[1:])
    with pytest.raises(InvalidInputError, match="rows"):
        corner.solve_many([vertex] * 2, *([r] for r in rays))
    with pytest.raises(InvalidInputError, match="row 1"):
        corner.solve_many([vertex] * 2, *([r, vertex] for r in rays))
    with pytest.raises(InvalidInputError, match="unit"):
        corner.fit([vertex, rays[0]], [vertex, rays[1]], [vertex, rays[2]], sigma_rad=1e-3)
    with pytest.raises(InvalidInputError, match="sigma_rad"):
        corner.fit([vertex, rays[0]], [vertex, rays[1]], [vertex, rays[2]], sigma_rad=0.0)
    with pytest.raises(InvalidInputError, match="left_from_right"):
        corner.poses(feature, feature, np.eye(3))
    with pytest.raises(InvalidInputError, match="left_from_right"):
        corner.poses(feature, feature, np.eye(4) * 2)
    with pytest.raises(InvalidInputError, match=r"left_from_right.*no baseline"):
        corner.poses(feature, feature, np.eye(4))
    with pytest.raises(InvalidInputError, match="sense"):
        corner.resolve([feature], priors=[corner.GravityPrior((0, 1, 0), 0.1, "sideways")])  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="priors"):
        corner.resolve([feature], priors=[1])  # type: ignore[list-item]
    with pytest.raises(InvalidInputError, match="down"):
        corner.resolve([feature], priors=[corner.GravityPrior((0, 2, 0), 0.1)])
    with pytest.raises(InvalidInputError, match="camera_from_object"):
        corner.KnownAttitude.of([[1, 2], [3, 4]], 0.1)
    with pytest.raises(InvalidInputError, match="camera_from_object: no array of numbers"):
        corner.KnownAttitude.of([[1, 2], [3]], 0.1)
    for sigma in (-0.1, math.nan, math.inf, "0.1"):
        with pytest.raises(InvalidInputError, match="sigma_rad = "):
            corner.KnownAttitude.of(np.eye(3), sigma)  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="right_handed = 'yes', expected True, False or None"):
        corner.resolve([feature], right_handed="yes")  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="rotation"):
        corner.resolve([feature], priors=[corner.KnownAttitude.of(np.eye(3) * 2, 0.1)])
    with pytest.raises(InvalidInputError, match="common_from_camera"):
        corner.resolve([feature], common_from_camera=[])
    with pytest.raises(InvalidInputError, match="alignment"):
        corner.resolve([feature], alignment="skew")  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="vertical"):
        corner.included_angle(feature, [0, 0, 2])
    with pytest.raises(InvalidInputError, match="vertical_covariance_rad2: no covariance"):
        corner.included_angle(feature, [0, 0, 1], -np.eye(3))
    with pytest.raises(InvalidInputError, match="corner = 3"):
        corner.solve_many([vertex], *([r] for r in rays)).of(3)
