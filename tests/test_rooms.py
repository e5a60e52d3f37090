"""`Room`: built once, looked at often; equal arguments, equal bytes, for any number of threads."""

from __future__ import annotations

import copy
import math
import pickle

import numpy as np
import pytest

import tiltvp
from tiltvp.errors import InvalidInputError
from tiltvp.synth import ROOM_KINDS, Room, render_room

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def small() -> tiltvp.Camera:
    return tiltvp.Camera.equidistant(width=60, height=50, focal_px=17.0, cx=29.5, cy=24.5)


@pytest.fixture(scope="module")
def office() -> Room:
    return Room("office", 4)


def test_render_room_is_a_view_of_a_room(small: tiltvp.Camera, office: Room) -> None:
    keywords = {"alpha_rad": 0.05, "beta_rad": 0.4, "samples": 1}
    pose = office.free_poses(1, 4)[0]
    view = office.render(small, pose=pose, seed=4, **keywords)
    room = render_room(small, kind="office", seed=4, **keywords)
    assert np.array_equal(view.gray, room.gray)
    assert np.array_equal(view.bgr, room.bgr)
    assert (view.alpha_rad, view.beta_rad) == (0.05, 0.4)


def test_threads_do_not_matter(small: tiltvp.Camera, office: Room) -> None:
    pose = office.free_poses(3, 1)[2]
    one, same = (office.render(small, pose=pose, seed=9, threads=threads) for threads in (1, None))
    assert np.array_equal(one.bgr, same.bgr)
    again = Room("office", 4, threads=1).render(small, pose=pose, seed=9)
    assert np.array_equal(one.bgr, again.bgr)
    other = office.render(small, pose=pose, seed=10)
    assert not np.array_equal(one.bgr, other.bgr)


@pytest.mark.parametrize("kind", ROOM_KINDS)
def test_every_kind_has_places_and_edges(kind: str) -> None:
    room = Room(kind, 3)
    poses = room.free_poses(20, 0)
    assert poses.shape == (20, 3)
    assert all(room.is_free(x, y) for x, y, _ in poses)
    assert (np.abs(poses[:, 2]) <= math.pi).all()
    edges = room.vertical_edges_m
    assert edges.shape[1:] == (2, 3)
    assert len(edges) > 10
    assert (edges[:, 0, 2] < edges[:, 1, 2]).all()
    assert 2.4 < room.height_m < 3.1
    outline = room.floor_outline_m
    assert (poses[:, :2] > outline.min(axis=0)).all()
    assert (poses[:, :2] < outline.max(axis=0)).all()


def test_a_room_is_a_value(office: Room) -> None:
    assert repr(office) == 'Room("office", 4)'
    same = pickle.loads(pickle.dumps(office))
    assert same == office == copy.copy(office)
    assert hash(same) == hash(office)
    assert type(same) is Room
    assert Room("office", 5) != office
    assert np.array_equal(same.free_poses(2, 7), office.free_poses(2, 7))


def test_panorama(office: Room) -> None:
    pose = office.free_poses(1, 0)[0]
    panorama = office.render_panorama(pose=pose, height=40, samples=1)
    assert panorama.gray.shape == (40, 80)
    assert panorama.bgr.shape == (40, 80, 3)
    assert panorama.gray.min() > 0


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"pose": (1e3, 0.0, 0.0)}, "a place in the room"),
        ({"pose": (1.0, 2.0)}, r"pose = \[1.0, 2.0\], expected 3 numbers"),
        ({"alpha_rad": math.nan}, "alpha_rad"),
        ({"alpha_rad": None}, "alpha_rad = None, expected a number"),
        ({"beta_rad": 10**400}, "beta_rad = .*, expected a number"),
        ({"camera": "camera.toml"}, r"camera: str, expected a tiltvp\.Camera"),
        ({"samples": 0}, "samples"),
        ({"seed": -1}, "seed = -1"),
        ({"threads": 0}, "threads = 0"),
        ({"camera_height_m": 0.0}, "camera_height_m"),
        ({"camera_height_m": 9.0}, "a place in the room"),
        ({"noise_sigma": math.nan}, "noise_sigma"),
        ({"robot_from_camera": np.diag([1.0, 1.0, -1.0])}, "rotation"),
    ],
)
def test_wrong_views(small: tiltvp.Camera, office: Room, keywords: dict[str, object], words: str) -> None:
    with pytest.raises(InvalidInputError, match=words):
        office.render(**{"camera": small, "pose": office.free_poses(1, 0)[0], **keywords})  # type: ignore[arg-type]


def test_wrong_rooms() -> None:
    with pytest.raises(InvalidInputError, match="narrow, under-table"):
        Room("garage", 0)
    with pytest.raises(InvalidInputError, match="seed = 'a'"):
        Room("office", "a")  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="count"):
        Room("narrow", 0).free_poses(-1, 0)
