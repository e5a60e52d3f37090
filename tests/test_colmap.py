"""Gravity in COLMAP's databases: against truth, for every way an image is not believed, and what stays as it was."""

from __future__ import annotations

import math
import sqlite3
import struct
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pycolmap
import pytest

import tiltvp
from tiltvp.cli import main
from tiltvp.colmap import ColmapDatabase
from tiltvp.errors import InvalidInputError, MissingExtraError
from tiltvp.image_headers import orientation
from tiltvp.rotations import read_rotation
from tiltvp.synth import Room

CAMERA = tiltvp.Camera.pinhole(width=320, height=240, fx=160.0, fy=160.0, cx=159.5, cy=119.5)
FORWARD = np.array(read_rotation("forward"))
LEANS = {
    "level.png": (0.0, 0.0),
    "nose_down.png": (0.2, 0.0),
    "left_side_down.png": (0.2, math.pi / 2),
    "drawn.png": (0.15, 2.5),
}


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Views of a room that lean by `LEANS`, one of them as a portrait photograph too, and a dark image."""
    folder = tmp_path_factory.mktemp("views")
    room = Room("living-room", 5)
    pose = room.free_poses(1, 5)[0]
    for name, (alpha, beta) in LEANS.items():
        view = room.render(
            CAMERA, pose=pose, alpha_rad=alpha, beta_rad=beta, robot_from_camera=FORWARD, camera_height_m=1.3, samples=2
        )  # fmt: skip
        tiltvp.write_image(folder / name, view.bgr)
    level = tiltvp.read_image(folder / "level.png")
    tiltvp.write_image(folder / "portrait.jpg", np.ascontiguousarray(np.rot90(level)))
    with_tag(folder / "portrait.jpg", 6)
    tiltvp.write_image(folder / "mirrored.jpg", level)
    with_tag(folder / "mirrored.jpg", 5)
    tiltvp.write_image(folder / "dark.png", np.zeros((240, 320), np.uint8))
    tiltvp.write_image(folder / "small.png", level[:100])
    (folder / "broken.png").write_bytes(b"no image")
    return folder


def with_tag(path: Path, tag: int) -> None:
    """Puts an orientation tag into a JPEG file."""
    entry = b"MM\0*" + struct.pack(">IHHHIHHI", 8, 1, 0x0112, 3, 1, tag, 0, 0)
    segment = b"Exif\0\0" + entry
    data = path.read_bytes()
    path.write_bytes(data[:2] + b"\xff\xe1" + struct.pack(">H", len(segment) + 2) + segment + data[2:])


Make = Callable[..., Path]


@pytest.fixture
def database(tmp_path: Path) -> Make:
    """Makes a database of images, by their names, of one camera that is known, unless something else is said."""

    def make(*names: str, model: str = "PINHOLE", known: bool = True, turned: bool = False) -> Path:
        path = tmp_path / "database.db"
        with pycolmap.Database.open(str(path)) as opened:
            camera = pycolmap.Camera.create_from_model_name(1, model, 160.0, *(240, 320) if turned else (320, 240))
            camera.has_prior_focal_length = known
            camera_id = opened.write_camera(camera)
            rig = pycolmap.Rig(rig_id=1)
            rig.add_ref_sensor(camera.sensor_id)
            opened.write_rig(rig)
            for name in names:
                opened.write_image(pycolmap.Image(name=name, camera_id=camera_id))
        return path

    return make


def gravities(path: Path) -> dict[str, np.ndarray]:
    """The gravity of the images that have one."""
    with pycolmap.Database.open(str(path)) as opened:
        names = {image.image_id: image.name for image in opened.read_all_images()}
        priors = opened.read_all_pose_priors()
    return {names[prior.corr_data_id.id]: prior.gravity for prior in priors if prior.has_gravity()}


def run(path: Path, views: Path, *words: object) -> int:
    return main(["colmap", str(path), "--images", str(views), *map(str, words)])


def degrees_between(a: np.ndarray, b: np.ndarray) -> float:
    return math.degrees(math.acos(np.clip(np.dot(a, b), -1.0, 1.0)))


def test_gravity_is_the_truths_in_colmaps_camera_frame(
    database: Make, views: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = database(*LEANS)
    assert run(path, views) == 0
    assert "gravity of 4 of 4 images" in capsys.readouterr().out
    found = gravities(path)
    for name, (alpha, beta) in LEANS.items():
        # v_camera = R^T v_robot, and things fall along -n.
        truth = FORWARD.T @ -np.asarray(tiltvp.normal_from_alpha_beta(alpha, beta))
        assert degrees_between(found[name], truth) < 0.5, name
        assert np.linalg.norm(found[name]) == pytest.approx(1.0)
        assert pycolmap.compute_rot90_from_gravity(found[name]) == 0
    # In words: before a camera that looks down things fall away, and to the left where its left side is down.
    assert found["nose_down.png"][2] > 0.15
    assert found["left_side_down.png"][0] < -0.15


def test_a_portrait_photograph_is_held_as_its_tag_says(database: Make, views: Path) -> None:
    path = database("portrait.jpg", turned=True)
    assert run(path, views) == 0
    found = gravities(path)["portrait.jpg"]
    with pycolmap.Database.open(str(path)) as opened:
        opened.clear_pose_priors()
    # By pixels: the level view was turned to the left, so that its lower side is the right one now.
    assert degrees_between(found, np.array([1.0, 0.0, 0.0])) < 0.5
    assert pycolmap.compute_rot90_from_gravity(found) != 0


def test_images_that_are_not_believed_get_none_and_are_counted(
    database: Make, views: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = database("level.png", "dark.png", "small.png", "mirrored.jpg", "broken.png", "missing.png")
    assert run(path, views) == 1
    said = capsys.readouterr()
    assert set(gravities(path)) == {"level.png"}
    assert "gravity of 1 of 6 images" in said.out
    for words in ("no tilt: ", "another size than its camera", "tag 5 is that of a mirrored image", "cannot be read"):
        assert words in said.out
    assert "broken.png: cannot be read" in said.err
    assert "missing.png: cannot be read" in said.err
    assert run(path, views, "--confidence-min", 1.0, "--overwrite") == 1
    assert gravities(path) == {}
    assert "a confidence below 1" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("keywords", "why"),
    [({"known": False}, "focal length of its camera is a guess"), ({"model": "FOV"}, "'FOV' is not supported")],
)
def test_cameras_that_are_not_known(
    keywords: dict[str, bool], why: str, database: Make, views: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = database("level.png", **keywords)
    assert run(path, views) == 0
    assert why in capsys.readouterr().out
    assert gravities(path) == {}
    tiltvp.formats.write_cameras([CAMERA.to_spec("cam1")], tmp_path / "cameras.bin", "colmap")
    assert run(path, views, "--cameras", tmp_path / "cameras.bin") == 0
    assert set(gravities(path)) == {"level.png"}
    tiltvp.formats.write_cameras([CAMERA.to_spec("cam2")], tmp_path / "other.txt", "colmap")
    assert run(path, views, "--cameras", tmp_path / "other.txt", "--overwrite") == 2
    assert "no camera 'cam2', expected one of cam1" in capsys.readouterr().err
    tiltvp.formats.write_cameras([CAMERA.scaled(0.5).to_spec("cam1")], tmp_path / "small.bin", "colmap")
    assert run(path, views, "--cameras", tmp_path / "small.bin", "--overwrite") == 2
    assert "cam1 of 160 x 120 pixels, expected its 320 x 240" in capsys.readouterr().err
    assert set(gravities(path)) == {"level.png"}


def test_gravity_that_is_there_is_kept_and_so_are_positions(
    database: Make, views: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = database("level.png", "dark.png", "drawn.png")
    with pycolmap.Database.open(str(path)) as opened:
        ids = {image.name: image.data_id for image in opened.read_all_images()}
        for name, gravity in (("level.png", [0.0, 1.0, 0.0]), ("dark.png", [0.6, 0.8, 0.0])):
            prior = pycolmap.PosePrior(corr_data_id=ids[name], position=[1.0, 2.0, 3.0], gravity=gravity)
            opened.write_pose_prior(prior)
    assert run(path, views) == 2
    # That of the tag of an upright photograph is none that is lost.
    assert "1 image with a gravity, expected none, or --overwrite" in capsys.readouterr().err
    assert set(gravities(path)) == {"level.png", "dark.png"}
    assert run(path, views, "--overwrite") == 0
    assert set(gravities(path)) == {"level.png", "drawn.png"}
    with pycolmap.Database.open(str(path)) as opened:
        priors = opened.read_all_pose_priors()
    assert len(priors) == 3
    assert sum(prior.has_position() for prior in priors) == 2


def test_a_wrong_folder_takes_nothing_away(
    database: Make, views: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = database("level.png")
    assert run(path, views) == 0
    assert run(path, tmp_path / "nowhere", "--overwrite") == 2
    assert "none of the 1 images of" in capsys.readouterr().err
    assert set(gravities(path)) == {"level.png"}


def test_images_on_their_side_without_a_tag_are_not_believed(
    database: Make, views: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "turned"
    for number, name in enumerate([*LEANS, "level.png"]):
        turned = np.ascontiguousarray(np.rot90(tiltvp.read_image(views / name)))
        tiltvp.write_image(folder / f"{number}.png", turned)
    path = database(*(f"{number}.png" for number in range(5)), turned=True)
    assert run(path, folder) == 0
    assert "speak against the side that is up" in capsys.readouterr().out
    assert gravities(path) == {}
    sideways = tmp_path / "mounting.yaml"
    # z to the front, the image's right side down: x_camera is -z_robot, and y_camera is y_robot.
    sideways.write_text("robot_from_camera: [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]\n")
    assert run(path, folder, "--robot-from-camera", sideways, "--overwrite") == 0
    found = gravities(path)
    assert len(found) >= 4
    assert degrees_between(found["0.png"], np.array([1.0, 0.0, 0.0])) < 0.5


def test_what_is_no_database_is_refused_and_left_alone(tmp_path: Path) -> None:
    for name, content in (("text.db", b"no database, but long enough to be one, with many words"), ("empty.db", b"")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InvalidInputError, match="expected"):
            ColmapDatabase(tmp_path / name)
        assert (tmp_path / name).read_bytes() == content
    with pytest.raises(InvalidInputError, match="no such file"):
        ColmapDatabase(tmp_path / "none.db")
    assert not (tmp_path / "none.db").exists()
    opened = sqlite3.connect(tmp_path / "other.db")
    opened.execute("CREATE TABLE cameras (a)")
    opened.commit()
    opened.close()
    before = (tmp_path / "other.db").read_bytes()
    with pytest.raises(InvalidInputError, match="no tables images, two_view_geometries"):
        ColmapDatabase(tmp_path / "other.db")
    assert (tmp_path / "other.db").read_bytes() == before


def test_without_pycolmap_the_extra_is_named(database: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    path = database()
    monkeypatch.setitem(sys.modules, "pycolmap", None)
    with pytest.raises(MissingExtraError, match=r"tiltvp\[colmap\]"):
        ColmapDatabase(path)


def test_orientation_tags_of_any_bytes(views: Path) -> None:
    data = (views / "portrait.jpg").read_bytes()
    assert orientation(data) == 6
    assert orientation((views / "level.png").read_bytes()) == 1
    for length in range(60):
        assert orientation(data[:length]) in (1, 6)
    little = b"II*\0" + struct.pack("<IHHHIHHI", 8, 1, 0x0112, 3, 1, 8, 0, 0)
    assert orientation(b"\xff\xd8\xff\xe1" + struct.pack(">H", len(little) + 8) + b"Exif\0\0" + little) == 8
    endless = b"MM\0*" + struct.pack(">IH", 8, 65535)
    assert orientation(b"\xff\xd8\xff\xe1" + struct.pack(">H", len(endless) + 8) + b"Exif\0\0" + endless) == 1
