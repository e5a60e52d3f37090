"""The common direction of great circles that a user brings."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tiltvp
from tiltvp.errors import InvalidInputError

Array = np.ndarray


def normals_about(direction: Array, n: int = 120, sigma_rad: float = 0.0, seed: int = 1) -> Array:
    """Great-circle normals orthogonal to a direction but for noise, at random lengths and signs."""
    rng = np.random.default_rng(seed)
    direction = direction / np.linalg.norm(direction)
    normals = np.cross(direction, rng.normal(size=(n, 3)))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    normals += direction * rng.normal(scale=sigma_rad, size=(n, 1)) if sigma_rad else 0.0
    return normals * rng.uniform(0.2, 5.0, (n, 1)) * rng.choice([-1.0, 1.0], (n, 1))


def angle(a: Array, b: Array) -> float:
    return tiltvp.tilt_error_rad(a, b)


TRUTH = np.array([0.05, -0.03, 1.0])


def test_finds_an_exact_direction() -> None:
    found = tiltvp.common_direction(normals_about(TRUTH))
    assert found
    assert angle(found.direction, TRUTH) < 1e-6
    assert np.linalg.norm(found.direction) == pytest.approx(1.0, abs=1e-12)
    assert found.inliers.dtype == bool
    assert found.inliers.all()
    assert found.report.residual_rms < 1e-6


def test_survives_outliers_and_noise() -> None:
    outliers = np.random.default_rng(3).normal(size=(60, 3))
    found = tiltvp.common_direction(np.vstack([normals_about(TRUTH, 120, 0.01), outliers]))
    assert angle(found.direction, TRUTH) < 0.01
    assert found.inliers[:120].mean() > 0.95
    assert found.inliers[120:].mean() < 0.4
    assert np.sqrt(np.trace(found.covariance_rad2)) < 0.01


def test_signs_and_lengths_do_not_matter() -> None:
    normals = normals_about(TRUTH, 80, 0.01)
    one, other = tiltvp.common_direction(normals), tiltvp.common_direction(-3.0 * normals)
    assert angle(one.direction, other.direction) < 1e-6
    assert np.array_equal(one.inliers, other.inliers)


def test_the_answer_is_on_the_side_of_the_prior() -> None:
    normals = normals_about(TRUTH)
    assert angle(tiltvp.common_direction(normals, prior=(0, 0, -2)).direction, -TRUTH) < 1e-6
    sideways = tiltvp.common_direction(normals_about(np.array([1.0, 0.1, 0.0])), prior=[4, 0, 0])
    assert angle(sideways.direction, np.array([1.0, 0.1, 0.0])) < 1e-6


def test_weights_count() -> None:
    other = np.array([-0.1, 0.0, 1.0])
    normals = np.vstack([normals_about(TRUTH, 60), normals_about(other, 60, seed=2)])
    weights = np.repeat([1.0, 0.0], 60)
    assert angle(tiltvp.common_direction(normals, weights=weights).direction, TRUTH) < 1e-6
    assert angle(tiltvp.common_direction(normals, weights=1.0 - weights).direction, other) < 1e-6


def test_every_option_changes_something() -> None:
    normals = np.vstack([normals_about(TRUTH, 60, 0.01), normals_about(np.array([-0.2, 0.0, 1.0]), 60, 0.01, seed=2)])
    plain = tiltvp.common_direction(normals)
    assert tiltvp.common_direction(normals, weights=np.linspace(0.0, 1.0, 120)) != plain


@pytest.mark.parametrize("scale", [1e-300, 1e-44, 1e100])
def test_weights_count_by_their_ratios(scale: float) -> None:
    """As likelihoods have them, beyond single precision too."""
    normals, weights = normals_about(TRUTH, sigma_rad=0.01), np.linspace(0.0, 2.0, 120)
    plain, scaled = (tiltvp.common_direction(normals, weights=w) for w in (weights, scale * weights))
    assert angle(plain.direction, scaled.direction) < 1e-8
    assert np.allclose(plain.covariance_rad2, scaled.covariance_rad2, rtol=1e-5, atol=0.0)
    assert tiltvp.common_direction(normals, sigma_rad=0.1) != plain
    assert tiltvp.common_direction(normals, max_angle_rad=0.1) != plain
    assert tiltvp.common_direction(normals, prior=(-0.2, 0.0, 1.0), max_angle_rad=0.1) != plain


@pytest.mark.parametrize(("n", "stop"), [(0, "too-few"), (1, "too-few"), (2, "no-model"), (50, "no-model")])
def test_says_why_there_is_none(n: int, stop: str) -> None:
    found = tiltvp.common_direction(np.tile([1.0, 0.0, 0.0], (n, 1)))
    assert not found
    assert np.isnan(found.direction).all()
    assert np.isinf(np.diag(found.covariance_rad2)).all()
    assert found.inliers.shape == (n,)
    assert not found.inliers.any()
    assert found.report.stop == stop
    assert found.report.reason in repr(found)


@pytest.mark.parametrize(
    ("normals", "options", "words"),
    [
        (np.zeros((3, 3)), {}, "normals"),
        ([[1.0, math.nan, 0.0]], {}, "normals"),
        ([[1.0, math.inf, 0.0]], {}, "normals"),
        (np.zeros((3, 2)), {}, "shape"),
        (np.zeros((2, 3, 3)), {}, "shape"),
        ("normals", {}, "normals"),
        (None, {}, "normals"),
        (np.eye(3), {"weights": [1.0]}, "weights"),
        (np.eye(3), {"weights": [1.0, -1.0, 1.0]}, "weights"),
        (np.eye(3), {"weights": [1.0, math.nan, 1.0]}, "weights"),
        (np.eye(3), {"weights": np.eye(3)}, "weights"),
        (np.eye(3), {"sigma_rad": 0.0}, "sigma_rad"),
        (np.eye(3), {"sigma_rad": 5.0}, "sigma_rad"),
        (np.eye(3), {"sigma_rad": math.nan}, "sigma_rad"),
        (np.eye(3), {"max_angle_rad": 0.0}, "max_angle_rad"),
        (np.eye(3), {"max_angle_rad": 20.0}, "max_angle_rad"),
        (np.eye(3), {"prior": (0, 0, 0)}, "prior"),
        (np.eye(3), {"prior": (0, 0)}, "prior"),
        (np.eye(3), {"prior": np.eye(3)}, "prior"),
        (np.eye(3), {"prior": (math.nan, 0, 1)}, "prior"),
    ],
)
def test_wrong_questions_are_refused(normals: Any, options: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidInputError, match=words):
        tiltvp.common_direction(normals, **options)


def test_arguments_may_be_of_any_kind_and_are_not_altered() -> None:
    normals = normals_about(TRUTH).astype(np.float32)
    normals.flags.writeable = False
    expected = tiltvp.common_direction(normals)
    for same in (
        normals.astype(np.float64),
        np.asfortranarray(normals),
        normals.tolist(),
        np.repeat(normals, 2, 0)[::2],
    ):
        assert tiltvp.common_direction(same, weights=np.ones(120, np.int8)) == expected
    expected.inliers[:] = False
    assert expected.inliers.all()


def test_values_survive_copy_pickle_and_dict() -> None:
    for value in (tiltvp.common_direction(normals_about(TRUTH, 50, 0.01)), tiltvp.common_direction(np.zeros((0, 3)))):
        twins = [
            copy.copy(value),
            copy.deepcopy(value),
            pickle.loads(pickle.dumps(value)),
            tiltvp.CommonDirection.from_dict(value.to_dict()),
        ]
        for twin in twins:
            assert twin == value
            assert hash(twin) == hash(value)
            assert repr(twin) == repr(value)
        with pytest.raises(AttributeError):
            value.report = None  # type: ignore[misc]
        with pytest.raises(InvalidInputError, match="inliers"):
            tiltvp.CommonDirection.from_dict({**value.to_dict(), "inliers": 3})
    assert value != tiltvp.common_direction(normals_about(TRUTH))


rows = st.lists(st.tuples(*[st.floats(-1e3, 1e3)] * 3), max_size=40)


@settings(max_examples=60, deadline=None)
@given(rows)
def test_any_normals_have_an_answer_or_a_refusal(values: list[tuple[float, float, float]]) -> None:
    try:
        found = tiltvp.common_direction(np.array(values).reshape(-1, 3))
    except InvalidInputError:
        assert any(not any(row) or not np.linalg.norm(row) for row in values)
    else:
        assert bool(found) == bool(np.isfinite(found.direction).all())
        assert bool(found) == bool(np.isfinite(found.covariance_rad2).all())


def test_what_has_no_finite_covariance_is_no_answer() -> None:
    """Circles that stray five times as far as told, with clutter: some of the fits end where nothing holds them."""
    truth = np.array([0.02, 0.03, 1.0]) / np.linalg.norm([0.02, 0.03, 1.0])
    refused = 0
    for seed in range(3800, 4000):
        rng = np.random.default_rng(seed)
        normals = np.cross(truth, rng.normal(size=(40, 3)))
        normals /= np.linalg.norm(normals, axis=1)[:, np.newaxis]
        normals += 0.01 * rng.normal(size=(40, 1)) * truth
        found = tiltvp.common_direction(np.vstack([normals, rng.normal(size=(10, 3))]), sigma_rad=0.002)
        assert bool(found) == bool(np.isfinite(found.covariance_rad2).all())
        if not found:
            assert "do not tell how far it may be off" in found.report.reason
            refused += 1
    assert 0 < refused < 20


@pytest.mark.parametrize("n", [3, 10, 100])
def test_normals_that_agree_by_chance_have_no_direction(n: int) -> None:
    rng = np.random.default_rng(7)
    found = [tiltvp.common_direction(rng.normal(size=(n, 3))) for _ in range(300)]
    assert sum(bool(one) for one in found) <= 3
    assert any(one.report.stop == "undetermined" for one in found)
    true = normals_about(np.array([0.05, 0.02, 1.0]), n=5)
    assert tiltvp.common_direction(np.vstack([true, rng.normal(size=(5, 3))]))
