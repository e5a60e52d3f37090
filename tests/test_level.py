"""Levelling: the image of a leaning robot, as the upright one would have seen it."""

from __future__ import annotations

import copy
import math
import pickle
from collections.abc import Callable
from functools import partial

import numpy as np
import polars as pl
import pytest

import tiltvp
from tiltvp.errors import InvalidInputError
from tiltvp.lab.evaluation.imu import summarise_inertial
from tiltvp.lab.evaluation.levelling import summarise_turned
from tiltvp.levelling import VIEWS
from tiltvp.rotations import rotation_from
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


def test_levellers_show_what_they_are_asked_for(camera: tiltvp.Camera, room: RoomImage) -> None:
    tilt = (0.1, 0.7)
    same = tiltvp.Leveller(camera)
    assert np.array_equal(same(room.gray, tilt), tiltvp.level(room.gray, camera, tilt, np.eye(3)))
    colour = same(np.stack([room.gray] * 3, axis=2), tilt)
    assert np.array_equal(colour[:, :, 1], same(room.gray, tilt))
    assert np.array_equal(same(room.gray, tilt), same(room.gray, tiltvp.normal_from_alpha_beta(*tilt)))
    again = pickle.loads(pickle.dumps(same))
    assert np.array_equal(again(room.gray, tilt), same(room.gray, tilt))
    panorama = tiltvp.Leveller(camera, to="panorama")
    assert panorama.output.width == 2 * panorama.output.height
    seen = panorama(room.gray, tilt)
    middle = panorama.output.height // 2
    assert seen[: middle // 2].any(axis=1).all()
    assert not seen[-middle // 2 :].any()
    pinhole = tiltvp.Leveller(camera, to="pinhole", size=(90, 60), field_of_view_rad=1.0)
    assert pinhole(room.gray, tilt).shape == (60, 90)
    assert tiltvp.Leveller(camera, size=(128, 128))(room.gray, tilt).shape == (128, 128)
    assert tiltvp.Leveller(camera, to=pinhole.output)(room.gray, tilt).shape == (60, 90)


class OwnLeveller(tiltvp.Leveller):
    """A class of a user's."""


class OwnUnwrapper(tiltvp.Unwrapper):
    """Another one."""


@pytest.mark.parametrize("kind", [OwnLeveller, OwnUnwrapper])
def test_copies_are_of_the_same_class(camera: tiltvp.Camera, kind: type) -> None:
    one = kind(camera)
    assert [type(twin) for twin in (pickle.loads(pickle.dumps(one)), copy.deepcopy(one))] == [kind, kind]


def test_matrices_are_taken_as_they_are_when_they_are_given(camera: tiltvp.Camera, room: RoomImage) -> None:
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for make in (
        lambda matrix: tiltvp.Leveller(camera, matrix, to="pinhole", robot_from_output=matrix),
        partial(tiltvp.Unwrapper, camera),
    ):
        matrix = np.eye(3)
        one = make(matrix)
        seen = one(room.gray, (0.1, 0.7))
        matrix[:] = turned
        again = pickle.loads(pickle.dumps(one))
        assert np.array_equal(again(room.gray, (0.1, 0.7)), seen)
        if isinstance(one, tiltvp.Leveller):
            one.robot_from_output[:] = turned
            assert np.array_equal(one.robot_from_output, np.eye(3))


def test_strips_have_the_size_and_the_channels_asked_for(camera: tiltvp.Camera, room: RoomImage) -> None:
    made = tiltvp.Unwrapper(camera, size=(72.0, np.int64(40)))
    assert made.size == (72, 40)
    plain = made(room.gray)
    assert plain.shape == (40, 72)
    for channels in (1, 2, 3, 4):
        strip = made(np.stack([room.gray] * channels, axis=2))
        assert strip.shape == (40, 72, channels)
        # OpenCV rounds places otherwise for several channels.
        assert np.allclose(strip[:, :, -1], plain, atol=1.0)


def test_impossible_levellers_are_refused(camera: tiltvp.Camera) -> None:
    for words, options in (
        ("expected one of same", {"to": "sphere"}),
        ("fisheye or pinhole only", {"field_of_view_rad": 1.0}),
        ("field_of_view_rad = 3.2", {"to": "pinhole", "field_of_view_rad": 3.2}),
        ("of the shape", {"size": (100, 30)}),
        ("beside a camera", {"to": camera, "size": (10, 10)}),
    ):
        with pytest.raises(InvalidInputError, match=words):
            tiltvp.Leveller(camera, **options)
    wide = tiltvp.Camera.equirectangular(width=32_768, height=16)
    for refused in (
        lambda: tiltvp.Leveller(wide),
        lambda: tiltvp.Leveller(camera, to=wide),
        lambda: tiltvp.Unwrapper(wide),
    ):
        with pytest.raises(InvalidInputError, match="at most 32765"):
            refused()
    for size in (640, "640x480", (640,), (64.5, 64), (0, 64), (math.nan, 64)):
        for made in (tiltvp.Unwrapper, *(partial(tiltvp.Leveller, to=to) for to in VIEWS)):
            with pytest.raises(InvalidInputError, match=r"size = .*expected \(width, height\)"):
                made(camera, size=size)
    with pytest.raises(InvalidInputError, match="expected one of same, "):
        tiltvp.Leveller(camera, to=np.eye(3))  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="field_of_view_rad = '2'"):
        tiltvp.Leveller(camera, to="fisheye", field_of_view_rad="2")
    with pytest.raises(InvalidInputError, match="elevation_min_rad = None"):
        tiltvp.Unwrapper(camera, elevation_min_rad=None)
    with pytest.raises(InvalidInputError, match="8 x 4"):
        tiltvp.Unwrapper(camera, size=(4, 4))
    with pytest.raises(InvalidInputError, match="size = 1000000 x 1000000, expected at most 25000000 pixels"):
        tiltvp.Unwrapper(camera, size=(10**6, 10**6))
    for view in ("pinhole", "fisheye"):
        with pytest.raises(InvalidInputError, match="field_of_view_rad = 5e-324"):
            tiltvp.Leveller(camera, to=view, field_of_view_rad=5e-324)
    with pytest.raises(InvalidInputError, match="rising"):
        tiltvp.Unwrapper(camera, elevation_max_rad=-0.1)


@pytest.mark.slow
def test_strips_of_a_leaning_robot_are_those_of_the_upright(
    camera: tiltvp.Camera, render: Callable[..., RoomImage], upright_room: RoomImage
) -> None:
    unwrap = tiltvp.Unwrapper(camera, size=(90, 30), elevation_min_rad=0.1)
    upright = unwrap(upright_room.gray)
    assert upright.shape == (30, 90)
    leaning = render(kind="living-room", seed=1, alpha_rad=0.06, beta_rad=0.8, noise_sigma=0.0)
    level, not_level = unwrap(leaning.gray, (0.06, 0.8)), unwrap(leaning.gray)
    assert np.abs(level - upright).mean() < 0.5 * np.abs(not_level - upright).mean()
    assert np.array_equal(pickle.loads(pickle.dumps(unwrap))(leaning.gray), not_level)


@pytest.mark.parametrize("dtype", [np.uint16, np.float32])
def test_other_types_are_the_same_picture(camera: tiltvp.Camera, room: RoomImage, dtype: type) -> None:
    leveller = tiltvp.Leveller(camera)
    levelled = leveller(room.gray, (0.1, 1.0)).astype(float)
    other = leveller(room.gray.astype(dtype), (0.1, 1.0)).astype(float)
    # Levels of bytes are rounded.
    assert np.abs(levelled - other).mean() < 0.5


@pytest.mark.parametrize("channels", [1, 3])
def test_a_level_panorama_has_all_of_it_and_no_seam(channels: int) -> None:
    """Levels that go with the direction alone are as smooth at the seam and the poles as anywhere."""
    camera = tiltvp.Camera.equirectangular(width=512, height=256)
    v, u = np.indices((256, 512))
    rays = camera.unproject(np.column_stack([u.ravel(), v.ravel()]).astype(float))
    levels = (127.0 + rays @ [60.0, 50.0, -40.0]).reshape(256, 512)
    image = np.stack([levels] * channels, axis=2).astype(np.float32)
    normal = tiltvp.normal_from_alpha_beta(0.5, 1.0)
    leveller = tiltvp.Leveller(camera, rotation_from("forward", "the mounting"))
    level = leveller(image, normal)
    # The map is exact to 0.05 pixels, between which levels are parabolas: a hundredth of a level.
    places = leveller.map(normal).astype(float)
    seen = camera.unproject(np.column_stack([places[:, :, 0].ravel() % 512.0, places[:, :, 1].ravel()]))
    known = np.isfinite(seen[:, 0])
    expected = 127.0 + seen[known] @ [60.0, 50.0, -40.0]
    assert known.mean() > 0.99
    assert np.abs(level.reshape(-1, channels)[known] - expected[:, None]).max() < 0.1


def test_panoramas_look_ahead(camera: tiltvp.Camera, room: RoomImage) -> None:
    ahead = tiltvp.Leveller(camera, to="panorama", robot_from_output=rotation_from("forward", "the mounting"))
    assert np.array_equal(tiltvp.Leveller(camera, to="panorama")(room.gray, (0.1, 0.2)), ahead(room.gray, (0.1, 0.2)))


def test_differences_from_a_sensor_are_all_in_their_standard_deviation() -> None:
    forward = np.array([0.1, -0.1, 0.2, -0.2, 0.0, 0.1, -0.1, 3.0])
    table = pl.DataFrame({"forward": 10.0 + forward, "left": -forward})
    table = table.with_columns(imu_forward=pl.lit(9.0), imu_left=pl.lit(0.0))
    every, near = summarise_inertial(table).rows(named=True)
    assert every["sd forward"] == pytest.approx(forward.std(ddof=1))
    assert every["sd left"] == pytest.approx(forward.std(ddof=1))
    assert every["offset forward"] == pytest.approx(1.05)
    # None leans as little by the sensor.
    assert (near["count"], near["mean"]) == (0, None)


def test_of_panoramas_that_are_not_believed_nothing_is_told() -> None:
    rows = {"method": ["refined"] * 2, "error_deg": [math.nan, 1.0], "confidence": [0.0, 0.1], "time_ms": [1.0, 3.0]}
    row = summarise_turned(pl.DataFrame(rows)).row(0, named=True)
    assert (row["count"], row["believed"], row["median"], row["largest"], row["ms"]) == (2, 0, None, None, 2.0)


def test_what_was_made_for_a_camera_is_not_told_another(camera: tiltvp.Camera) -> None:
    """The camera could be set, and levels went on as before."""
    leveller, unwrapper = tiltvp.Leveller(camera), tiltvp.Unwrapper(camera)
    for one, name in ((leveller, "camera"), (leveller, "output"), (unwrapper, "camera"), (unwrapper, "size")):
        with pytest.raises(AttributeError, match=name):
            setattr(one, name, getattr(one, name))
