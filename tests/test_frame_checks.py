"""Images of another size than the calibration's, of none, and of another mounting: told once, and before the work."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

import tiltvp
from command_inputs import write_rooms
from commands import Run
from drawn_corners import LEFT_FROM_RIGHT
from tiltvp.images import image_size
from tiltvp.stereo_rigs import StereoRig
from tiltvp.streams import open_frames
from tiltvp.synth import Room

EACH = ("tilt", "segments", "lines", "track --out tracks.csv", "level --out level")
AT_ONCE = ("setup --out robot.toml", "mount")
ODOMETRY = "--odometry wheels.csv --wheel-base 0.3"
SIZED = "got 90 x 120 pixels, expected 180 x 240 (rows x columns), as the camera's images: if they were resized, "
SIZED += "`tiltvp camera scale FILE OUT --to 120x90` makes one that fits"


@pytest.fixture(scope="module")
def rooms(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rooms")
    write_rooms(folder, 8)
    return folder


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """camera.toml, images of five rooms by it, and other.toml of a lens with another centre."""
    folder = tmp_path_factory.mktemp("places")
    shape = {"width": 240, "height": 180, "focal_px": 52.4, "max_theta_rad": math.radians(92.5)}
    camera = tiltvp.Camera.equidistant(**shape, cx=119.5, cy=89.5)
    camera.save(folder / "camera.toml")
    tiltvp.Camera.equidistant(**shape, cx=129.5, cy=79.5).save(folder / "other.toml")
    for seed in range(5):
        room = Room("office", seed)
        [pose] = room.free_poses(1, seed)
        tiltvp.write_image(folder / "images" / f"{seed}.png", room.render(camera, pose=pose, seed=seed).bgr)
    return folder


@pytest.fixture
def folder(rooms: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Eight rooms as images, the working folder's."""
    shutil.copytree(rooms, tmp_path, dirs_exist_ok=True)
    (tmp_path / "wheels.csv").write_text("step,delta_left_m,delta_right_m\n" + "".join(f"{i},0,0\n" for i in range(8)))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def shrink(folder: Path, *numbers: int) -> None:
    for number in numbers:
        file = folder / "images" / f"{number}.png"
        tiltvp.write_image(file, cv2.resize(tiltvp.read_image(file), (120, 90), interpolation=cv2.INTER_AREA))


@pytest.mark.parametrize("verb", [*EACH, *AT_ONCE, f"calibrate {ODOMETRY}"])
def test_some_are_told_once_with_their_number_and_the_first(run: Run, folder: Path, verb: str) -> None:
    shrink(folder, 2, 5)
    (folder / "images" / "6.png").write_bytes(b"")
    said = run(*verb.split(), "images", "--camera", "camera.toml")
    told = said.err.splitlines()
    assert told.count(f"tiltvp: 2 of 8 images cannot be used for their size, first images/2.png: {SIZED}") == 1
    assert said.err.count("90 x 120") == 1
    broken = "images/6.png: not an image that can be decoded (0 bytes)"
    at_once = verb in AT_ONCE
    assert sum(broken in line for line in told) == 1
    # Verbs that name each image that cannot be read have no line for all of them.
    assert (told[0] == f"tiltvp: 1 of 8 images cannot be read, first {broken}") == at_once
    assert at_once or "cannot be used for their size" in told[0]


@pytest.mark.parametrize(
    ("verb", "of"),
    [
        *((verb, of) for verb in (*EACH, *AT_ONCE) for of in ("images", "one.png", "film.avi")),
        (f"calibrate {ODOMETRY}", "images"),
    ],
)
def test_nothing_is_done_where_none_fits(run: Run, folder: Path, verb: str, of: str) -> None:
    shrink(folder, *range(8))
    (folder / "images" / "0.png").rename(folder / "one.png")
    film = cv2.VideoWriter(str(folder / "film.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (120, 90))
    for _ in range(8):
        film.write(np.zeros((90, 120, 3), np.uint8))
    film.release()
    said = run(*verb.split(), of, "--camera", "camera.toml")
    first = {"images": "7 of 7 images cannot be used for their size, first images/1.png", "film.avi": "film.avi#0"}
    assert (said.code, said.out) == (2, "")
    assert said.complaint == f"tiltvp: {first.get(of, of)}: {SIZED}\n"
    assert not any((folder / name).exists() for name in ("robot.toml", "tracks.csv", "level"))


def test_of_a_pair_each_side_has_its_camera(run: Run, folder: Path) -> None:
    shrink(folder, *range(8))
    camera = tiltvp.Camera.load(folder / "camera.toml")
    StereoRig(camera.scaled(0.5), camera, LEFT_FROM_RIGHT).save(folder / "rig.toml")
    said = run("corner", "images", "images", "--calibration", "rig.toml")
    assert said.code == 2
    assert said.complaint == f"tiltvp: 8 of 8 images cannot be used for their size, first images/0.png: {SIZED}\n"


def test_a_size_is_read_from_the_header_alone(tmp_path: Path) -> None:
    rows = np.random.default_rng(1).integers(0, 255, (180, 240, 3)).astype(np.uint8)
    for ending in (".png", ".jpg", ".bmp", ".tif", ".ppm", ".webp", ".jp2"):
        file = tmp_path / f"a{ending}"
        tiltvp.write_image(file, rows)
        assert image_size(file) == (240, 180)
    # As a TIFF's directory, which OpenCV puts behind the pixels, a JPEG's size may be far from its beginning.
    data = (tmp_path / "a.jpg").read_bytes()
    comments = b"".join(b"\xff\xfe\xff\xff" + bytes(0xFFFD) for _ in range(4))
    (tmp_path / "a.jpg").write_bytes(data[:2] + comments + data[2:])
    assert image_size(tmp_path / "a.jpg") == (240, 180)
    assert open_frames(tmp_path / "a.jpg").told == ()


@pytest.mark.parametrize("verb", AT_ONCE)
def test_what_is_no_image_at_all_is_told_once(run: Run, folder: Path, verb: str) -> None:
    said = run(*verb.split(), "wheels.csv", "--camera", "camera.toml")
    assert (said.code, said.out) == (2, "")
    assert "wheels.csv: not an image that can be decoded" in said.complaint
    # What comes only once is nothing for these verbs.
    assert "Unknown option: --live" in run(*verb.split(), "images", "--camera", "camera.toml", "--live", 0).complaint
    assert "-: comes only once" in run(*verb.split(), "-", "--camera", "camera.toml").complaint


@pytest.mark.parametrize("of", ["images", "film.avi"])
def test_images_that_are_no_panoramas_are_not_levelled_one_by_one(run: Run, folder: Path, of: str) -> None:
    film = cv2.VideoWriter(str(folder / "film.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (240, 180))
    film.write(np.zeros((180, 240, 3), np.uint8))
    film.release()
    said = run("level", of, "--out", "level")
    assert (said.code, said.out) == (2, "")
    assert "240 x 180 pixels, and no --camera, expected one, or 360-degree panoramas" in said.complaint
    assert not (folder / "level").exists()


OUT = "--overwrite --out"


@pytest.mark.parametrize(
    "verb", ["mount --level-floor", f"calibrate {ODOMETRY}", f"level {OUT} level", "lines", f"track {OUT} tracks.csv"]
)
def test_it_is_said_where_images_speak_against_the_mounting(run: Run, folder: Path, verb: str) -> None:
    words = (*verb.split(), "images", "--camera", "camera.toml")
    assert "--robot-from-camera" not in run(*words).err
    told = run(*words, "--robot-from-camera", "forward").err
    assert told.startswith("tiltvp: --robot-from-camera: 5 images: up is the camera's +z (it looks up; ")


@pytest.mark.parametrize("verb", ["segments", "lines"])
def test_it_is_said_where_edges_speak_against_the_calibration(run: Run, places: Path, verb: str) -> None:
    assert run(verb, places / "images", "--camera", places / "camera.toml").err == ""
    said = run(verb, places / "images", "--camera", places / "other.toml")
    assert (said.code, said.err.count("\n")) == (0, 1)
    assert said.err.startswith("tiltvp: --camera: ")
    assert "straight edges are bent, as by another lens: its centre" in said.err


@pytest.mark.parametrize("verb", AT_ONCE)
def test_images_whose_pixels_are_broken_are_told_too(run: Run, folder: Path, verb: str) -> None:
    for name in ("3.png", "6.png"):
        file = folder / "images" / name
        file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    said = run(*verb.split(), "images", "--camera", "camera.toml").err
    assert said.count("tiltvp: 2 images cannot be used, first images/3.png: not an image that can be decoded") == 1
