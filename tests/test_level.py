"""Levelling: the image of a leaning robot, as the upright one would have seen it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import tiltvp
from tiltvp.errors import InvalidInputError
from tiltvp.synth import RoomImage


def inner_disc(camera: tiltvp.Camera, theta_deg: float = 80.0) -> np.ndarray:
    """The pixels within an angle of the zenith, which both views see."""
    v, u = np.indices((camera.height, camera.width))
    bearings = camera.unproject(np.column_stack([u.ravel(), v.ravel()]))
    return (bearings[:, 2] > math.cos(math.radians(theta_deg))).reshape(camera.height, camera.width)


@pytest.mark.slow
def test_a_levelled_room_is_the_room_seen_upright(
    camera: tiltvp.Camera, render: Callable[..., RoomImage], upright_room: RoomImage
) -> None:
    leaning = render(kind="living-room", seed=1, alpha_rad=0.06, beta_rad=0.8, noise_sigma=0.0)
    disc = inner_disc(camera)
    levelled = tiltvp.level(leaning.gray, camera, (0.06, 0.8), np.eye(3))
    before = np.abs(leaning.gray.astype(float) - upright_room.gray)[disc].mean()
    after = np.abs(levelled.astype(float) - upright_room.gray)[disc].mean()
    assert after < 4.0
    assert after < 0.25 * before
    wrong = tiltvp.level(leaning.gray, camera, (0.06, 0.8 + math.pi), np.eye(3))
    assert np.abs(wrong.astype(float) - upright_room.gray)[disc].mean() > before


def test_levelling_by_the_estimate_leaves_little_lean(camera: tiltvp.Camera, room: RoomImage) -> None:
    estimator = tiltvp.TiltEstimator(camera)
    estimate = estimator(room.gray)
    again = estimator(tiltvp.level(room.gray, estimator, estimate))
    assert math.degrees(again.alpha_rad) < 0.5


def test_no_lean_leaves_the_image_as_it_is(camera: tiltvp.Camera, room: RoomImage) -> None:
    seen = camera.valid_mask()
    levelled = tiltvp.level(room.gray, camera, (0.0, 0.0), np.eye(3))
    assert np.array_equal(levelled[seen], room.gray[seen])
    assert not levelled[~seen].any()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
@pytest.mark.parametrize("channels", [None, 1, 3, 4])
def test_keeps_shape_and_dtype(camera: tiltvp.Camera, dtype: type, channels: int | None) -> None:
    shape = (256, 256) if channels is None else (256, 256, channels)
    image = np.ones(shape, dtype)
    levelled = tiltvp.level(image[::-1], camera, (0.1, 1.0), np.eye(3))
    assert levelled.shape == shape
    assert levelled.dtype == dtype
    assert image.all()


def test_the_map_goes_with_the_mounting(camera: tiltvp.Camera) -> None:
    """The lean's direction is the robot's: a camera turned by a quarter sees it turned by a quarter."""
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    normal = tiltvp.normal_from_alpha_beta(0.1, 0.3)
    turned = tiltvp.Leveller(camera, quarter).map(normal)
    straight = tiltvp.Leveller(camera).map(quarter.T @ normal)
    assert turned.shape == (256, 256, 2)
    assert turned.dtype == np.float32
    assert np.array_equal(np.isnan(turned), np.isnan(straight))
    assert np.nanmax(np.abs(turned - straight)) < 2.0 * 0.05


def test_wrong_questions_are_refused(camera: tiltvp.Camera, room: RoomImage) -> None:
    none = tiltvp.TiltEstimator(camera)(np.zeros((256, 256), np.uint8))
    with pytest.raises(InvalidInputError, match="too few"):
        tiltvp.level(room.gray, camera, none, np.eye(3))
    for image in (room.gray[:-1], room.gray[None], np.zeros(3)):
        with pytest.raises(InvalidInputError, match="shape"):
            tiltvp.level(image, camera, (0.1, 0.0), np.eye(3))
    with pytest.raises(InvalidInputError, match="finite"):
        tiltvp.level(room.gray, camera, (math.nan, 0.0), np.eye(3))
    with pytest.raises(InvalidInputError, match="robot_from_camera"):
        tiltvp.level(room.gray, camera, (0.1, 0.0), robot_from_camera=np.eye(2))
    with pytest.raises(InvalidInputError, match="robot_from_camera"):
        tiltvp.level(room.gray, camera, (0.1, 0.0), robot_from_camera=2.0 * np.eye(3))
    for dtype in (np.int64, bool, complex, object):
        with pytest.raises(InvalidInputError, match="dtype"):
            tiltvp.level(np.ones((256, 256), dtype), camera, (0.1, 0.0), np.eye(3))


def test_the_mounting_of_the_estimate_is_not_forgotten(camera: tiltvp.Camera) -> None:
    """The estimator levels as its camera with its mounting does, and neither goes without."""
    tipped = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    estimator = tiltvp.TiltEstimator(camera, robot_from_camera=tipped, elevation_min_rad=-0.8)
    image = np.random.default_rng(0).integers(0, 255, (256, 256), dtype=np.uint8)
    by_estimator = tiltvp.level(image, estimator, (0.1, 0.7))
    assert np.array_equal(by_estimator, tiltvp.level(image, camera, (0.1, 0.7), tipped))
    assert not np.array_equal(by_estimator, tiltvp.level(image, camera, (0.1, 0.7), np.eye(3)))
    with pytest.raises(InvalidInputError, match="expected the mounting"):
        tiltvp.level(image, camera, (0.1, 0.7))
    with pytest.raises(InvalidInputError, match="another one than that of the estimator"):
        tiltvp.level(image, estimator, (0.1, 0.7), np.eye(3))
