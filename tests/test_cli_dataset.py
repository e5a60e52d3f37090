"""`tiltvp dataset`: what is wrong as a table, and folders made from panoramas and rooms."""

from __future__ import annotations

import math
import os
import re
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

import tiltvp
from commands import Run
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.folder import TiltDataset, read_dataset
from tiltvp.lab.datasets.panoramas import read_panorama_index


@pytest.fixture
def run(run: Run) -> Run:
    """Runs `tiltvp dataset` in this process."""
    return lambda *words: run("dataset", *words)


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small camera and two indexed panoramas."""
    folder = tmp_path_factory.mktemp("world")
    tiltvp.Camera.equidistant(width=64, height=48, focal_px=15.0, cx=31.5, cy=23.5, max_theta_rad=1.6).save(
        folder / "camera.toml"
    )
    for name in ("hall", "attic"):
        noise = np.random.default_rng(len(name)).integers(0, 256, (16, 32), dtype=np.uint8)
        image = cv2.resize(noise, (128, 64), interpolation=cv2.INTER_CUBIC)
        tiltvp.write_image(folder / "panos" / f"{name}.jpg", image)
    rows = ["name,environment,tilt_x_deg,tilt_z_deg", "hall,house,0.1,-0.2", "attic,house,0,0"]
    (folder / "panos" / "INDEX.csv").write_text("\n".join(rows) + "\n")
    return folder


def test_render_and_check(run: Run, world: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ("render", "--panoramas", world / "panos", "--out", out, "--camera", world / "camera.toml")
    code, said, complaints = run(*words, "--tilts-deg", "0,0", "2,-90", "--resolution-scale", "0.5", "--threads", "2")
    assert (code, complaints) == (0, "")
    assert said == f"{out}: 4 images of 2 locations\n"
    dataset = read_dataset(out)
    assert (dataset.camera.width, dataset.camera.height) == (32, 24)
    assert dataset.camera.parameters["focal_px"] == pytest.approx(7.5)
    assert [image.location for image in dataset.images] == ["hall", "hall", "attic", "attic"]
    assert {image.environment for image in dataset.images} == {"house"}
    assert dataset.images[1].beta_rad == pytest.approx(-math.pi / 2)
    assert dataset.source["made_by"] == "tiltvp dataset render"
    assert dataset.source["camera"] == "camera.toml"
    assert dataset.source["tilts_deg"] == "0,0 2,-90"
    assert run("check", out) == (0, f"{out}: 4 images, 2 locations, 1 environment, 0 warnings\n", "")
    code, _, complaints = run(*words)
    assert code == 2
    assert "exists, expected a new folder, or --overwrite to replace a dataset" in complaints
    assert run(*words, "--limit", "1", "--tilts-deg", "1,0", "--overwrite")[1] == f"{out}: 1 image of 1 location\n"
    assert run(*words, "--force", "--turn", "--limit", "1")[0] == 0
    assert len(read_dataset(out).images) == 7


def test_a_panoramas_camera_is_a_word_here_too(run: Run, world: Path, tmp_path: Path) -> None:
    words = ("render", "--panoramas", world / "panos", "--limit", "1", "--tilts-deg", "2,0", "--out", tmp_path / "out")
    assert run(*words, "--camera", "equirectangular:64x32")[0] == 0
    assert read_dataset(tmp_path / "out").camera.model == "equirectangular"


def test_degrading_a_drive_says_what_is_left_out(run: Run, world: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ("render", "--panoramas", world / "panos", "--out", out, "--camera", world / "camera.toml")
    assert run(*words, "--tilts-deg", "1,0")[0] == 0
    assert run("degrade", out, "--out", tmp_path / "hard")[::2] == (0, "")
    (out / "odometry.csv").write_text("file,left_m,right_m\n")
    code, _, complaints = run("degrade", out, "--out", tmp_path / "hard", "--overwrite")
    assert (code, "hard: without odometry.csv of" in complaints) == (0, True)
    # A dataset is not replaced by what is made of it.
    code, _, complaints = run("degrade", out, "--out", out, "--overwrite")
    assert (code, "is the dataset that is read, expected another folder" in complaints) == (2, True)


def test_a_robots_file_tells_how_its_camera_is_held(run: Run, world: Path, tmp_path: Path) -> None:
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    tiltvp.Robot(tiltvp.Camera.load(world / "camera.toml"), turned).save(tmp_path / "robot.toml")
    words = ("render", "--panoramas", world / "panos", "--camera", tmp_path / "robot.toml", "--tilts-deg", "2,0")
    assert run(*words, "--out", tmp_path / "out")[0] == 0
    assert np.array_equal(read_dataset(tmp_path / "out").robot_from_camera, turned)
    assert run(*words, "--out", tmp_path / "up", "--robot-from-camera", "up")[0] == 0
    assert np.array_equal(read_dataset(tmp_path / "up").robot_from_camera, np.eye(3))


def test_tilts_of_a_file(run: Run, world: Path, tmp_path: Path) -> None:
    table = tmp_path / "tilts.csv"
    table.write_text("alpha_deg,beta_deg\n1,0\n\n2.5,-3\n")
    words = ("render", "--panoramas", world / "panos", "--camera", world / "camera.toml", "--tilts-deg", table)
    assert run(*words, "--out", tmp_path / "out")[0] == 0
    assert [round(math.degrees(i.alpha_rad), 9) for i in read_dataset(tmp_path / "out").images] == [1.0, 2.5, 1.0, 2.5]
    for text, problem in [
        ("alpha,beta\n1,2\n", "expected the columns"),
        ("alpha_deg,beta_deg\n1\n", "line 2"),
        ("alpha_deg,beta_deg\n", "no tilts"),
    ]:
        table.write_text(text)
        code, _, complaints = run(*words, "--out", tmp_path / "bad")
        assert code == 2
        assert problem in complaints
    assert not (tmp_path / "bad").exists()


@pytest.mark.slow
def test_synth(run: Run, world: Path, tmp_path: Path) -> None:
    out = tmp_path / "rooms"
    code, said, complaints = run(
        "synth", "--out", out, "--camera", world / "camera.toml", "--kinds", "narrow", "--rooms", 1,
        "--locations-per-room", 2, "--tilts-deg", "1,0", "--samples", 1, "--noise-sigma", 0, "--camera-height-m", 0.2,
    )  # fmt: skip
    assert (code, complaints) == (0, "")
    assert said == f"{out}: 2 images of 2 locations\n"
    dataset = read_dataset(out)
    assert dataset.source["camera_height_m"] == 0.2
    assert dataset.read(dataset.images[0]).max() > 100


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (("--tilts-deg", "1;2"), "no such file|No such file"),
        (("--tilts-deg", "1,2,3"), "expected ALPHA,BETA in degrees"),
        (("--tilts-deg", "95,2"), "alpha from 0 to 90"),
        (("--resolution-scale", "0"), "--resolution-scale: got 0"),
        (("--threads", "0"), "--threads. Must be >= 1"),
        (("--robot-from-camera", "upp"), "did you mean up"),
        (("--limit", "0"), "tiltvp: --limit = 0"),
        (("--samples", "99"), "tiltvp: --samples = 99"),
        (("--camera", "nowhere.yaml"), "nowhere.yaml"),
    ],
)
def test_wrong_use(run: Run, world: Path, tmp_path: Path, words: tuple[str, ...], problem: str) -> None:
    import re

    code, said, complaints = run("render", "--panoramas", world / "panos", "--out", tmp_path / "out", *words)
    assert (code, said) == (2, "")
    assert len(complaints.splitlines()) == 1
    assert re.search(problem, complaints), complaints
    assert list(tmp_path.iterdir()) == []


def test_panoramas_of_rooms_replace_nothing(run: Run, tmp_path: Path) -> None:
    for words in (("--rooms", "0"), ("--places", "0")):
        code, _, complaints = run("panoramas", "--out", tmp_path / "out", *words)
        assert (code, f"for {words[0]}. Must be >= 1." in complaints) == (2, True)
    (tmp_path / "INDEX.csv").write_text("mine")
    code, _, complaints = run("panoramas", "--out", tmp_path, "--rooms", "1", "--places", "1", "--height", "16")
    assert (code, "exists, expected a new or empty folder" in complaints) == (2, True)
    assert [path.name for path in tmp_path.iterdir()] == ["INDEX.csv"]


def test_a_camera_without_a_file_has_no_name(run: Run, tmp_path: Path) -> None:
    for words in (("synth",), ("drive", "--camera", "fisheye")):
        code, _, complaints = run(*words, "--out", tmp_path / "out", "--camera-name", "left")
        assert (code, "--camera-name left without a calibration file" in complaints) == (2, True)


def test_findings_are_a_table(run: Run, tmp_path: Path) -> None:
    (tmp_path / "dataset.toml").write_text('camera = "camera.toml"\nmirrored = true\n')
    (tmp_path / "images.csv").write_text("file,location,environment,alpha_deg,beta_deg\na.png,a,x,0,0\n")
    code, said, complaints = run("check", tmp_path)
    assert (code, complaints) == (1, "")
    for words in ("unknown key 'mirrored' (did you mean mirror?)", "no such file", "no file 'a.png'", "expected"):
        assert words in said
    missing = (
        f"tiltvp: {tmp_path}/nothing: is no folder, expected a dataset: a folder with dataset.toml and images.csv\n"
    )
    assert run("check", tmp_path / "nothing") == (2, "", missing)


@pytest.mark.timeout(60)
@pytest.mark.skipif(sys.platform == "win32", reason="pipes of POSIX")
@pytest.mark.parametrize("name", ["dataset.toml", "images.csv", "camera.toml", "a.png"])
def test_pipes_in_a_dataset_are_not_read(run: Run, camera: tiltvp.Camera, name: str, tmp_path: Path) -> None:
    camera.save(tmp_path / "camera.toml")
    (tmp_path / "dataset.toml").write_text('camera = "camera.toml"\n')
    (tmp_path / "images.csv").write_text("file,location,environment,alpha_deg,beta_deg\na.png,a,x,0,0\n")
    (tmp_path / name).unlink(missing_ok=True)
    os.mkfifo(tmp_path / name)
    code, said, _ = run("check", tmp_path)
    assert (code, "is no regular file" in said or "no file 'a.png'" in said) == (1, True)


@pytest.mark.timeout(60)
@pytest.mark.skipif(sys.platform == "win32", reason="pipes and links of POSIX")
def test_pipes_of_tilts_and_links_in_a_circle_are_refused(
    run: Run, dataset: TiltDataset, world: Path, tmp_path: Path
) -> None:
    os.mkfifo(tmp_path / "tilts.csv")
    words = ("render", "--panoramas", world / "panos", "--tilts-deg", tmp_path / "tilts.csv", "--out", tmp_path / "out")
    said = run(*words)
    assert (said.code, "is no regular file, expected ALPHA,BETA in degrees" in said.complaint) == (2, True)
    (tmp_path / "loop").symlink_to("loop")
    said = run("degrade", dataset.directory, "--out", tmp_path / "loop")
    assert (said.code, "loop: exists, expected a new folder" in said.complaint) == (2, True)
    assert os.path.islink(tmp_path / "loop")


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("name,environment,tilt_x_deg,tilt_z_deg\nhall,é,0,0\n".encode("latin1"), "not UTF-8"),
        (b"name,environment,tilt_x_deg,tilt_z_deg\nhall,house,0,0,5\n", "line 2: 5 cells, expected 4"),
        (b"name,tilt_x_deg,tilt_z_deg\nhall,0,0\n", "line 1: no column 'environment', expected name"),
        (b"name,environment,tilt_x_deg,tilt_z_deg\nhall,house,up,0\n", "line 2: tilt_x_deg = 'up', expected a finite"),
        (
            b"name,environment,tilt_x_deg,tilt_z_deg\nhall,a,0,0\nhall,b,0,0\n",
            "line 3: name 'hall' again, expected one",
        ),
        (None, "cannot be read (No such file or directory), expected an index of panoramas"),
    ],
)
def test_an_index_that_cannot_be_read_is_named(content: bytes | None, told: str, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / "INDEX.csv").write_bytes(content)
    with pytest.raises(InvalidInputError, match=re.escape(told)):
        read_panorama_index(tmp_path)


def test_an_index_of_a_spreadsheet_is_read(tmp_path: Path) -> None:
    (tmp_path / "INDEX.csv").write_bytes(b"\xef\xbb\xbfname,environment,tilt_x_deg,tilt_z_deg\r\nhall,house,0,0\r\n")
    assert [one.path.name for one in read_panorama_index(tmp_path)] == ["hall.jpg"]
