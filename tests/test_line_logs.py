"""From the images of a drive to the log that self-calibration takes, in the library and on the command line."""

from __future__ import annotations

import collections
import json
import re
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

import tiltvp
from recordings import motions_of
from tiltvp import Camera, Robot
from tiltvp.cli import main
from tiltvp.errors import ImageFileError, InvalidInputError, UnknownLeanError
from tiltvp.lab.datasets.driving import write_drive
from tiltvp.line_logs import FollowedFrame, bearing_log, displacements, follow_lines
from tiltvp.lines import LineExtractor, LineTracker
from tiltvp.selfcalib import wheel_displacements
from tiltvp.streams import Motion
from tiltvp.synth import MIRROR_BLIND_RAD, Drive, Room, drive_legs, mirror_camera

if TYPE_CHECKING:
    from numpy.typing import NDArray

LEGS = [(0.25, 0.0), (0.0, 0.4)]


@pytest.fixture(scope="module")
def drive() -> Drive:
    room = Room("corridor", 2, light_spacing_m=0.6)
    camera = mirror_camera().scaled(0.6)
    return Drive(room, camera=camera, blind_rad=MIRROR_BLIND_RAD, legs=LEGS, seed=3, samples=2, mount=(0.1, 0, 0, 0.4))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, drive: Drive) -> Path:
    out = tmp_path_factory.mktemp("drives") / "drive"
    write_drive(drive, out)
    return out


def test_a_log_has_the_tracks_that_are_seen_longest() -> None:
    def frame(number: int, count: int) -> Any:
        seen = SimpleNamespace(track=np.arange(count), lines=SimpleNamespace(bearing_rad=np.zeros(count)))
        return SimpleNamespace(number=number, tracked=seen)

    log = bearing_log([frame(0, 400), frame(1, 300), frame(2, 200)])
    assert set(log[:, 1].tolist()) == set(range(150))
    # Hours have more tracks than a whole log may have landmarks.
    log = bearing_log([frame(0, 6000), frame(1, 5000), *(frame(2 + k, 0) for k in range(7000))])
    assert set(log[:, 1].tolist()) == set(range(4000))


def test_the_legs_are_what_is_driven(drive: Drive) -> None:
    assert len(drive) == 1 + 5 + 5
    np.testing.assert_allclose(np.diff(drive.poses[5:, 2]), 0.08, atol=1e-12)
    np.testing.assert_allclose(np.hypot(*(drive.poses[5, :2] - drive.poses[0, :2])), 0.25, atol=1e-12)
    assert drive_legs("paper").shape == (2, 2)
    with pytest.raises(InvalidInputError, match="frames and legs"):
        Drive(drive.room, camera=drive.camera, legs=LEGS, frames=3)
    with pytest.raises(InvalidInputError, match="expected legs that a robot has room for"):
        Drive(drive.room, camera=drive.camera, legs=[(80.0, 0.0)])


def test_frames_that_cannot_be_used_are_told_and_their_motion_kept(drive: Drive) -> None:
    images = [drive.render(k).gray for k in range(4)]
    motions = [Motion(yaw, distance) for distance, yaw in drive.motions[:4].tolist()]
    bad, unknown = ImageFileError("cannot be decoded"), UnknownLeanError("lean not known")

    def leaning(gray: NDArray[np.uint8]) -> None:
        if gray is images[2]:
            raise unknown

    extractor = LineExtractor(drive.camera)
    followed = list(follow_lines([*images[:2], bad, images[3]], extractor, LineTracker(), motions=motions))
    assert followed[2] is bad
    left_out = list(follow_lines(images, extractor, LineTracker(), motions=motions, tilt=leaning))
    assert left_out[2] is unknown
    assert [one.tracked for one in left_out if isinstance(one, FollowedFrame)] == [
        one.tracked for one in followed if isinstance(one, FollowedFrame)
    ]
    frames = [frame for frame in followed if isinstance(frame, FollowedFrame)]
    assert [frame.number for frame in frames] == [0, 1, 3]
    log = bearing_log(frames)
    assert set(log[:, 0].tolist()) <= {0.0, 1.0, 3.0}
    assert np.unique(log[:, 1], return_counts=True)[1].min() >= 2
    assert bearing_log([]).shape == (0, 3)
    with pytest.raises(InvalidInputError, match="expected one for each image"):
        list(follow_lines(images, LineExtractor(drive.camera), LineTracker(), motions=motions[:2]))


def test_the_loop_of_the_guide_runs_and_loses_no_motion(drive: Drive, capsys: pytest.CaptureFixture[str]) -> None:
    guide = (Path(__file__).parents[1] / "docs/live.md").read_text(encoding="utf-8")
    (loop,) = re.findall(r"^```python\n(.*?)^```$", guide, re.MULTILINE | re.DOTALL)
    images: list[Any] = [drive.render(k).gray for k in range(len(drive))]
    images[4], images[7] = None, images[7][1:]
    steps = drive.odometry.tolist()
    robot = [(image, *step) for image, step in zip(images, steps, strict=True)]
    names: dict[str, Any] = {"tiltvp": tiltvp, "np": np, "collections": collections}
    names |= {"camera": drive.camera, "rotation": np.eye(3), "robot": robot}
    exec(loop, names)
    said = capsys.readouterr().out.splitlines()
    assert len(said) == 3
    assert "image: NoneType" in said[0]
    assert "as the camera's images" in said[1]
    assert said[2] == names["calibrator"].estimate.reason
    assert names["tracker"].next_frame == len(drive) - 2
    assert names["calibrator"].landmarks > 5
    assert names["tilts"].estimate


def test_wheels_are_as_recorded_or_as_the_motion_has_them(folder: Path, drive: Drive) -> None:
    files = sorted((folder / "images").iterdir())
    motions = motions_of(folder / "odometry.csv", files)
    np.testing.assert_array_equal(displacements(motions, wheel_base_m=0.5), drive.odometry)
    bare = [Motion(motion.yaw_rad, motion.distance_m) for motion in motions]
    expected = wheel_displacements(drive.motions[:, 0], drive.motions[:, 1], wheel_base_m=0.5)
    np.testing.assert_array_equal(displacements(bare, wheel_base_m=0.5), expected)


@pytest.mark.slow
def test_calibrate_from_images(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, tracks = tmp_path / "found.json", tmp_path / "tracks.csv"
    words = [
        "calibrate",
        str(folder / "images"),
        "--camera",
        str(folder / "camera.toml"),
        "--wheel-base",
        "0.35",
    ]
    odometry = ["--odometry", str(folder / "odometry.csv")]
    start = ["--start", "0.1", "0", "0", "--start-sigma", "0.05", "0.05", "0.2"]
    assert main([*words, *odometry, *start, "--out", str(out), "--tracks", str(tracks)]) in (0, 1)
    found = json.loads(out.read_text())
    table = pl.read_csv(tracks)
    (log,) = found["logs"]
    assert log["options"]["bearing_sigma_rad"] == pytest.approx(table["sigma_rad"].median())
    kept = table.filter(pl.len().over("track") >= 3)
    assert log["whole_log"]["bearings"] == kept.height > 100
    assert "bearings of" in capsys.readouterr().out
    alone = tmp_path / "images"
    alone.symlink_to(folder / "images")
    for told, wrong in (
        ("expected --odometry", [words[0], str(alone), *words[2:]]),
        ("without another one", [*words[:2], "log.csv", *words[2:], *odometry]),
        ("expected one log", [*words[:2], str(folder / "images" / "*.png"), *words[2:], *odometry]),
        ("--wheel-base", [*words[:-2], *odometry]),
        ("without --camera", [*words[:2], *words[-2:]]),
        ("expected the folder", ["calibrate", str(next((folder / "images").iterdir())), *words[2:]]),
    ):
        assert main(wrong) == 2
        assert told in capsys.readouterr().err


def test_lines_are_followed_from_where_a_robots_file_has_the_camera(folder: Path, tmp_path: Path) -> None:
    Robot(Camera.load(folder / "camera.toml"), np.eye(3), place_m=(0.1, 0.0)).save(tmp_path / "robot.toml")
    tables = []
    for number, words in enumerate(
        (
            ["--camera", str(tmp_path / "robot.toml")],
            ["--camera", str(folder / "camera.toml"), "--camera-at", "0.1", "0"],
            ["--camera", str(tmp_path / "robot.toml"), "--camera-at", "0.5", "0.5"],
        )
    ):
        out = tmp_path / f"{number}.csv"
        odometry = ["--odometry", str(folder / "odometry.csv"), "--wheel-base", "0.35"]
        assert main(["track", str(folder / "images"), *words, *odometry, "--out", str(out)]) == 0
        tables.append(out.read_text())
    assert tables[0] == tables[1] != tables[2]


def test_images_of_a_frozen_camera_are_left_out_and_named(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    images, out, tracks = tmp_path / "images", tmp_path / "found.json", tmp_path / "tracks.csv"
    shutil.copytree(folder / "images", images)
    files = sorted(images.iterdir())
    for k in (3, 4):
        shutil.copy(files[2], files[k])
    words = ["--camera", f"{folder}/camera.toml", "--odometry", f"{folder}/odometry.csv", "--wheel-base", "0.35"]
    assert main(["track", str(images), *words, "--out", str(tracks)]) == 0
    assert {3, 4}.isdisjoint(pl.read_csv(tracks)["frame"])
    told = "2 left out as of a frozen camera (the same as the one before while the robot moved)"
    assert told in capsys.readouterr().out
    main(["calibrate", str(images), *words, "--out", str(out)])
    told = f"of {len(files)} images {told}"
    (log,) = json.loads(out.read_text())["logs"]
    assert told in log["reason"]
    assert log["doubt"] == ""
    assert told in " ".join(capsys.readouterr().out.split())


def test_a_frozen_camera_of_a_robot_that_creeps_is_told(folder: Path, tmp_path: Path) -> None:
    """By some 5 mm a frame: less than what a robot that stands seems to move, until it adds up."""
    images, tracks, slow = tmp_path / "images", tmp_path / "tracks.csv", tmp_path / "odometry.csv"
    shutil.copytree(folder / "images", images)
    files = sorted(images.iterdir())
    for k in (3, 4, 5):
        shutil.copy(files[2], files[k])
    pl.read_csv(folder / "odometry.csv").with_columns(pl.exclude("file") * 0.1).write_csv(slow)
    words = ["--camera", f"{folder}/camera.toml", "--odometry", str(slow), "--wheel-base", "0.35"]
    assert main(["track", str(images), *words, "--out", str(tracks)]) == 0
    frames = set(pl.read_csv(tracks)["frame"])
    assert 3 in frames
    assert {4, 5}.isdisjoint(frames)
