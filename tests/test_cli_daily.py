"""The daily verbs without the laboratory's packages, and what the laboratory's verbs say then."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import tiltvp
from command_inputs import write_drive_log, write_pair, write_rooms
from drawn_corners import CAMERA, COLOURS, GREYS, pair

pytestmark = pytest.mark.slow

BLOCKED = ("polars", "matplotlib", "plotly", "jinja2", "dask", "distributed", "scipy", "ahrs")
PROGRAM = f"""
import sys
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {BLOCKED}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Blocked())
from tiltvp.cli import main
sys.exit(main(sys.argv[1:]))
"""
SHORT = ("--support-min-px", 5, "--length-min-deg", 5)
"""Options for lines of small images."""
Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A camera with three images of a turning robot, a log of a drive, and a stereo pair before a corner."""
    folder = tmp_path_factory.mktemp("daily")
    write_rooms(folder, 3)
    (folder / "odometry.csv").write_text("yaw_rad,distance_m\n" + "0.02,0.0\n" * 3)
    write_drive_log(folder)
    write_pair(
        folder, dict(zip(("left", "right", "grey-left", "grey-right"), pair(COLOURS) + pair(GREYS), strict=True))
    )
    return folder


@pytest.fixture
def run(world: Path) -> Run:
    """Runs a command line in the world, where the laboratory's packages are not installed."""

    def started(*words: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", PROGRAM, *map(str, words)],
            cwd=world, capture_output=True, text=True, timeout=240, check=False,
        )  # fmt: skip

    return started


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_tilt(run: Run, world: Path) -> None:
    out = ("--out", "tilt.csv", "--overlay", "over", "--level", "level", "--filter", "--odometry", "odometry.csv")
    # Of small images the tilts err by more than a filter takes by default.
    done = run("tilt", "images", "--camera", "camera.toml", "--sigma-max-deg", 3, *out)
    assert (done.returncode, done.stderr) == (0, "")
    rows = rows_of(world / "tilt.csv")
    assert len(rows) == 3
    assert {row["accepted"] for row in rows} <= {"true", "false"}
    assert np.isfinite(float(rows[0]["filtered_alpha_rad"]))
    assert tiltvp.read_image(world / "level" / "0.png").shape == (180, 240, 3)
    assert run("tilt", "images", "--camera", "camera.toml", "--out", "tilt.json").returncode == 0
    assert [row["file"] for row in json.loads((world / "tilt.json").read_text())] == [row["file"] for row in rows]


def test_lines_and_track(run: Run, world: Path) -> None:
    done = run("lines", "images", "--camera", "camera.toml", "--out", "lines.csv", "--overlay", "lined", *SHORT)
    assert (done.returncode, done.stderr) == (0, "")
    assert rows_of(world / "lines.csv")[0]["line"] == "0"
    out = ("--out", "tracks.json", "--video", "tracks.avi")
    done = run("track", "images", "--camera", "camera.toml", "--odometry", "odometry.csv", *out, *SHORT)
    assert (done.returncode, done.stderr) == (0, "")
    assert {row["frame"] for row in json.loads((world / "tracks.json").read_text())} == {0, 1, 2}


def test_calibrate(run: Run, world: Path) -> None:
    words = ("--wheel-base", 0.4, "--step-sigma", 1e-4, "--step-sigma-deg", 0.01, "--out", "mounting.json")
    done = run("calibrate", "wheels.csv", "bearings.csv", *words)
    assert (done.returncode, done.stderr) == (0, "")
    assert "static_transform_publisher" in done.stdout
    assert json.loads((world / "mounting.json").read_text())["logs"][0]["whole_log"]


def test_corner(run: Run, world: Path) -> None:
    out = ("--out", "poses.csv", "--trajectory", "poses.txt", "--overlay", "boxes")
    done = run("corner", "left", "right", "--calibration", "rig.toml", *out)
    assert (done.returncode, done.stderr) == (0, "")
    [row] = rows_of(world / "poses.csv")
    assert row["found"] == "true"
    assert len((world / "poses.txt").read_text().splitlines()) == 2


@pytest.mark.parametrize(("level", "found"), [(255, "true"), (0, "false")])
def test_corner_in_a_mask(run: Run, world: Path, level: int, found: str) -> None:
    mask = np.full((CAMERA.height, CAMERA.width), 255, dtype=np.uint8)
    mask[CAMERA.height // 8 :] = level
    tiltvp.write_image(world / "mask.png", mask)
    words = ("--calibration", "rig.toml", "--mask", "mask.png", "--out", "masked.csv", "--overwrite")
    done = run("corner", "grey-left", "grey-right", "--method", "general", *words)
    assert (done.returncode, done.stderr) == (0, "")
    assert [row["found"] for row in rows_of(world / "masked.csv")] == [found]
    refused = run("corner", "left", "right", "--method", "coloured", *words)
    assert refused.returncode == 2
    assert "mask" in refused.stderr


@pytest.mark.parametrize(("level", "found"), [(255, "true"), (0, "false")])
def test_corner_in_the_mask_of_a_robots_file(run: Run, world: Path, level: int, found: str) -> None:
    mask = np.full((CAMERA.height, CAMERA.width), 255, dtype=np.uint8)
    mask[CAMERA.height // 8 :] = level
    tiltvp.Robot(CAMERA, np.eye(3), mask=mask > 0).save(world / "robot.toml")
    words = ("--method", "general", "--pitch", "-20", "--out", "robot.csv", "--overwrite")
    done = run("corner", "grey-left", "--calibration", "robot.toml", *words)
    assert (done.returncode, done.stderr) == (0, "")
    assert [row["found"] for row in rows_of(world / "robot.csv")] == [found]


def test_camera(run: Run) -> None:
    for words in (
        ("info", "camera.toml"),
        ("check", "camera.toml"),
        ("convert", "camera.toml", "again.toml"),
        ("formats",),
    ):
        done = run("camera", *words)
        assert (done.returncode, done.stderr) == (0, ""), words


def test_demo(run: Run, world: Path) -> None:
    done = run("demo", "--out", "demo", "--width", 240, "--height", 180)
    assert (done.returncode, done.stderr) == (0, "")
    assert len(list((world / "demo").iterdir())) == 5


@pytest.mark.parametrize(
    "words",
    [
        ("dataset", "synth", "--rooms", 1, "--locations-per-room", 1, "--out", "set"),
        ("evaluate", "set", "--out", "run"),
        ("measure", "lines"),
        ("measure", "striding"),
        ("measure", "mounting"),
        ("report", "run", "--out", "report"),
        ("tilt", "images", "--camera", "camera.toml", "--out", "tilt.parquet"),
        ("tilt", "images", "--camera", "camera.toml", "--filter", "--filter-plot", "filter.png"),
        ("track", "images", "--camera", "camera.toml", "--out", "t.csv", "--plot", "t.png"),
        ("calibrate", "wheels.csv", "bearings.csv", "--wheel-base", 0.4, "--plot", "c.png"),
        ("corner", "left", "right", "--calibration", "rig.toml", "--plot", "p.png"),
    ],
)
def test_what_is_missing_is_said_in_one_line(run: Run, words: tuple[object, ...]) -> None:
    done = run(*words)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "pip install 'tiltvp[lab]'" in done.stderr
    assert done.stdout == ""


def test_what_is_broken_is_said_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "polars.py").write_text("raise ImportError('libmissing.so.1: cannot open shared object file')\n")
    done = subprocess.run(
        [sys.executable, "-c", "from tiltvp.cli import main; raise SystemExit(main())", "measure", "lines"],
        env={**os.environ, "PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, timeout=240, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == (
        "tiltvp: a package that is installed cannot be imported: libmissing.so.1: cannot open shared object file\n"
    )
