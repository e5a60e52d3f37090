"""The verbs on videos, bags, live cameras and stdin."""

from __future__ import annotations

import io
import json
import math
import sys
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import polars as pl
import pytest

import tiltvp
from commands import Run
from recordings import START_S, Bag, write_video
from tiltvp.cli.filtering import FilterOptions
from tiltvp.errors import CalibrationError
from tiltvp.robot import Robot
from tiltvp.streams import FrameMotions, Motion, Recording, open_frames, recorded_camera
from tiltvp.synth import RoomImage, render_room

pytestmark = pytest.mark.slow

FRAMES = 6
QUARTER = np.pi / 2


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory, camera: tiltvp.Camera, room: RoomImage) -> Path:
    """A robot that turns to the left, a quarter a second, as a bag and a video; its first image is a second early."""
    root = tmp_path_factory.mktemp("world")
    camera.save(root / "camera.toml")
    made = Bag("mcap")
    for k in range(FRAMES):
        made.image("/image", START_S + k - 1, np.rot90(room.gray, k - 1), "mono8")
    for k in range(10 * FRAMES):
        made.odometry(START_S + 0.1 * k, 0.0, 0.0, QUARTER * 0.1 * k)
    made.write(root)
    frames = [cv2.cvtColor(np.ascontiguousarray(np.rot90(room.gray, k)), cv2.COLOR_GRAY2BGR) for k in range(FRAMES)]
    write_video(root / "drive.mp4", frames, [0, 40, 200, 230, 500, 510])
    tiltvp.write_image(root / "images" / "a.png", room.gray)
    return root


def test_tilt_of_a_bag_with_the_odometry_of_the_same(run: Run, world: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.csv"
    bag = world / "drive_mcap"
    code, said, complaints = run("tilt", bag, "--camera", world / "camera.toml", "--filter", "--out", out)
    assert code == 0
    assert f"--odometry: not given, that of {bag} is taken" in complaints
    assert f"1 frame outside its span ({bag}#0)" in complaints
    assert "no-odometry" in said
    table = pl.read_csv(out)
    assert table["taken_s"].to_list() == pytest.approx([START_S + k - 1 for k in range(FRAMES)], abs=1e-6)
    assert table["verdict"].to_list() == ["no-odometry"] + ["accepted"] * (FRAMES - 1)
    # With turns that are known the images of one lean agree.
    assert table["nis"].drop_nulls()[1:].max() < 9.0
    assert table["file"][3] == f"{bag}#3"
    # Whoever reads lines finds the same keys in all.
    _, lines, _ = run("tilt", bag, "--camera", world / "camera.toml", "--filter", "--out", "-")
    assert {tuple(json.loads(line)) for line in lines.splitlines()} == {tuple(table.columns)}


def test_pictures_of_a_video_and_threads(run: Run, world: Path, tmp_path: Path) -> None:
    words = ("tilt", world / "drive.mp4", "--camera", world / "camera.toml")
    code, _, complaints = run(
        *words, "--overlay", tmp_path / "seen", "--level", tmp_path / "level", "--out", tmp_path / "a.csv"
    )
    assert (code, complaints) == (0, "")
    names = [f"drive_{k:06d}.png" for k in range(FRAMES)]
    assert sorted(file.name for file in (tmp_path / "seen").iterdir()) == names
    assert sorted(file.name for file in (tmp_path / "level").iterdir()) == names
    assert run(*words, "--threads", "3", "--out", tmp_path / "b.csv")[0] == 0
    one, three = (pl.read_csv(tmp_path / name).drop("time_s") for name in ("a.csv", "b.csv"))
    assert one.equals(three)
    assert one["taken_s"].to_list() == pytest.approx([0, 0.04, 0.2, 0.23, 0.5, 0.51], abs=1e-3)


def test_of_several_cameras_the_chosen_one_counts(run: Run, world: Path, tmp_path: Path, room: RoomImage) -> None:
    made = Bag("mcap")
    height, width = room.gray.shape
    for topic, frame in (("/up", "roof"), ("/ahead", "front")):
        image = (height, width, "mono8", 0, width, room.gray.ravel())
        made.add(topic, "sensor_msgs/Image", START_S, made.header(START_S, frame), *image)
    made.static("base_link", "roof", [0, 0, 0, 1.0])
    made.static("base_link", "front", [-0.5, 0.5, -0.5, 0.5])
    bag, found = made.write(tmp_path), {}
    for mounting in (bag, "up", "forward"):
        out = tmp_path / "found.csv"
        words = ("--camera", world / "camera.toml", "--robot-from-camera", mounting, "--out", out, "--overwrite")
        assert run("tilt", bag, *words, "--topic", "/up").code == 0
        found[mounting] = pl.read_csv(out)["normal_x"].to_list()
    assert found[bag] == found["up"] != found["forward"]
    assert run("lines", bag, *words[:2], "--robot-from-camera", bag, "--topic", "/up").code == 0
    # The topic of other images is none of a recording that tells the mounting.
    said = run("tilt", world / "drive_mcap", "--topic", "/image", *words[:2], "--robot-from-camera", bag)
    assert said.code == 2
    assert "/up: 1, /ahead: 1" in said.complaint or "/ahead: 1, /up: 1" in said.complaint
    Robot(tiltvp.Camera.load(world / "camera.toml"), np.eye(3), topics={"images": "/ahead"}).save(tmp_path / "r.toml")
    for verb in ("tilt", "lines", "segments"):
        assert run(verb, bag, "--camera", tmp_path / "r.toml").code == 0


@pytest.mark.parametrize("verb", ["lines", "segments"])
def test_lines_and_segments_of_a_bag(verb: str, run: Run, world: Path, tmp_path: Path) -> None:
    bag = world / "drive_mcap"
    words = (
        verb,
        bag,
        "--camera",
        world / "camera.toml",
        "--out",
        tmp_path / "found.csv",
        "--overlay",
        tmp_path / "seen",
    )
    assert run(*words)[0] == 0
    assert pl.read_csv(tmp_path / "found.csv")["file"].n_unique() == FRAMES
    assert len(list((tmp_path / "seen").iterdir())) == FRAMES
    code, _, complaints = run(*words, "--topic", "/none", "--overwrite")
    assert (code, "no topic '/none'" in complaints) == (2, True)


@pytest.mark.parametrize(("times", "walk"), [(True, 0.05), (False, 0.1)])
def test_a_floor_turns_with_a_robot_whose_turns_nobody_knows(times: bool, walk: float, world: Path) -> None:
    """So the tilt walks by what a slope turns from image to image: it was stated with 0.3 degrees and 2.5 off."""
    frames = open_frames(world / "images")
    if times:
        frames.times_s, frames.rate_hz = np.zeros(1), 2.0
    own, asked = tiltvp.TiltFilter().options["walk_rad_per_sqrt_step"], FilterOptions(filter=True)
    motions = [Motion()]
    for moved, expected in (
        (None, walk),
        (FrameMotions(motions, turns_known=False, times_s=None), walk),
        (FrameMotions(motions, turns_known=True, times_s=None), own),
    ):
        found = asked.following(frames, moved, None).make().options["walk_rad_per_sqrt_step"]
        assert found == pytest.approx(expected)
    given = FilterOptions(filter=True, walk_deg_per_sqrt_step=0.3)  # type: ignore[call-arg]
    assert given.following(frames, None, None) == given
    assert given.following(frames, None, 0.6).make().options["half_track_m"] == 0.3
    own_wheels = FilterOptions(filter=True, half_track_m=0.2)  # type: ignore[call-arg]
    assert own_wheels.following(frames, None, 0.6).make().options["half_track_m"] == 0.2


def test_a_slope_is_followed_where_turns_are_not_known(run: Run, world: Path, tmp_path: Path) -> None:
    """The robot leans to another side in each image, half a second later: none is outside the gate."""
    folder = tmp_path / "drive"
    for k in range(6):
        gray = render_room(
            tiltvp.Camera.load(world / "camera.toml"), seed=1, alpha_rad=0.06, beta_rad=-0.9 * k, samples=1
        )
        tiltvp.write_image(folder / "images" / f"{k}.png", gray.gray)
    (folder / "frames.csv").write_text("file,time_s\n" + "".join(f"{k}.png,{0.5 * k}\n" for k in range(6)))
    words = ["tilt", folder, "--camera", world / "camera.toml", "--method", "segments", "--filter", "--out", "-"]
    rows = [json.loads(line) for line in run(*words).out.splitlines()]
    for k, row in enumerate(rows):
        truth = tiltvp.normal_from_alpha_beta(0.06, -0.9 * k)
        found = [row[f"filtered_normal_{axis}"] for axis in "xyz"]
        assert tiltvp.tilt_error_rad(found, truth) < 3.0 * row["filtered_sigma_rad"], k
    words[0], words[-1] = "level", tmp_path / "level"
    assert run(*words).code == 0
    estimator = tiltvp.TiltEstimator(tiltvp.Camera.load(world / "camera.toml"), method="segments")
    left = [estimator(tiltvp.read_image(tmp_path / "level" / f"{k}.png")).alpha_rad for k in range(6)]
    assert max(left) < 0.02


def test_times_of_several_cameras_in_one_table(tmp_path: Path) -> None:
    """Files of equal names are told apart by their folders; the last row's time was taken for all."""
    for side in ("left", "right"):
        tiltvp.write_image(tmp_path / side / "0.png", np.zeros((4, 4), np.uint8))
    table = tmp_path / "left" / "frames.csv"
    table.write_text("file,time_s\nleft/0.png,1\nright/0.png,2\n")
    frames = open_frames(tmp_path / "left")
    assert frames.times_s is not None
    assert frames.times_s.tolist() == [1.0]
    for rows, told in (("a/0.png,1\nb/0.png,2\n", "2 times of "), ("0.png,1\n0.png,2\n", "line 3: file '0.png' again")):
        table.write_text("file,time_s\n" + rows)
        with pytest.raises(tiltvp.errors.InvalidInputError, match=told):
            open_frames(tmp_path / "left")


def test_images_that_are_called_rectified_are_told(run: Run, world: Path, room: RoomImage, tmp_path: Path) -> None:
    made = Bag("mcap")
    made.image("/camera/image_rect_color", START_S, room.gray, "mono8")
    said = run("tilt", made.write(tmp_path), "--camera", world / "camera.toml")
    assert (said.code, "/camera/image_rect_color is called rectified: its lens is P" in said.err) == (0, True)


def test_the_lens_of_rectified_images_is_p(tmp_path: Path) -> None:
    """It was K and D, whose lens bends where these images do not."""
    k, p = [300.0, 0, 40, 0, 300, 30, 0, 0, 1], [200.0, 0, 41, -24, 0, 210, 31, 0, 0, 0, 1, 0]
    for name in ("/left/image_rect", "/left/image_raw"):
        made = Bag("mcap")
        made.camera_info(START_S, 80, 60, "plumb_bob", [-0.3, 0.1, 0, 0, 0], k, p=p)
        made.image(name, START_S, np.zeros((60, 80), np.uint8), "mono8")
        recording = Recording(made.write(tmp_path / name[-4:]))
        rectified = recorded_camera(recording, images="/left/image_rect")
        assert rectified == tiltvp.Camera.pinhole(width=80, height=60, fx=200.0, fy=210.0, cx=41.0, cy=31.0)
        assert (recorded_camera(recording) == rectified) == (name == "/left/image_rect")
    blank = Bag("mcap")
    blank.camera_info(START_S, 80, 60, "plumb_bob", [0.0] * 5, k)
    with pytest.raises(CalibrationError, match="not calibrated"):
        recorded_camera(Recording(blank.write(tmp_path / "blank")), images="/image_rect")


def test_a_turn_of_rectified_images_is_told(tmp_path: Path) -> None:
    """Their frame is another one than the raw images', which have the same frame in their headers."""
    c, s = math.cos(math.radians(3.0)), math.sin(math.radians(3.0))
    for kind, r, told in (("mcap", (1, 0, 0, 0, c, -s, 0, s, c), True), ("ros1", (0,) * 9, False)):
        made = Bag(kind)
        made.camera_info(START_S, 80, 60, "plumb_bob", [0.0] * 5, [200.0, 0, 40, 0, 200, 30, 0, 0, 1], r=r)
        for name in ("/left/image_rect_color", "/left/image_raw"):
            made.image(name, START_S, np.zeros((60, 80), np.uint8), "mono8")
        path = made.write(tmp_path)
        words = "/left/image_rect_color is turned by 3.0 degrees against the raw images"
        assert (words in "".join(open_frames(path, topic="/left/image_rect_color").notes)) == told
        assert not open_frames(path, topic="/left/image_raw").notes


def test_stamps_that_stand_still_are_told(tmp_path: Path) -> None:
    made = Bag("mcap")
    for k in range(4):
        made.image("/image", START_S + (0.1 if k else 0.0), np.zeros((4, 4), np.uint8), "mono8", late_s=0.1 * k)
    (note,) = open_frames(made.write(tmp_path)).notes
    assert "/image has 2 images that are stamped no later than those before" in note


def test_tracks_of_a_bag_have_times(run: Run, world: Path, tmp_path: Path) -> None:
    words = (
        "track",
        world / "drive_mcap",
        "--camera",
        world / "camera.toml",
        "--out",
        tmp_path / "t.csv",
        "--tilt",
        "refined",
    )
    code, said, complaints = run(*words)
    assert code == 0
    assert "1 frame outside its span" in complaints
    assert f"{FRAMES - 1} frames, " in said
    table = pl.read_csv(tmp_path / "t.csv")
    assert table["frame"].unique().sort().to_list() == list(range(1, FRAMES))
    assert (table["time_s"] - START_S - table["frame"] + 1).abs().max() < 1e-6
    # A robot that turns in place sees the same lines again.
    assert (table.filter(pl.col("frame") > 1)["frames_back"] > 0).mean() > 0.5
    wheels = tmp_path / "wheels.csv"
    wheels.write_text(f"time_s,left_m,right_m\n{START_S - 2},0,0\n{START_S + 9},1,1\n")
    code, _, complaints = run(*words, "--odometry", wheels, "--odometry-gap", "20", "--overwrite")
    assert (code, "expected --wheel-base" in complaints) == (2, True)
    assert run(*words, "--odometry", wheels, "--odometry-gap", "20", "--wheel-base", "0.4", "--overwrite")[0] == 0


def test_stdin(run: Run, world: Path, room: RoomImage, monkeypatch: pytest.MonkeyPatch) -> None:
    image = world / "images" / "a.png"
    words = ("tilt", "-", "--camera", world / "camera.toml", "--out", "-")
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(f"{image}\nnone.png\n".encode())))
    code, said, complaints = run(*words)
    named, missing = map(json.loads, said.splitlines())
    assert (code, "none.png" in complaints, "none.png" in missing["error"]) == (1, True, True)
    height, width = room.gray.shape
    pixels = room.gray.tobytes() + bytes([room.gray[0, 0] ^ 1]) + room.gray.tobytes()[1:]
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(pixels)))
    code, said, complaints = run(*words, "--raw", f"{width}x{height}")
    first, second = map(json.loads, said.splitlines())
    assert (code, complaints, first["file"]) == (0, "", "-#000000")
    assert first["alpha_rad"] == second["alpha_rad"] == named["alpha_rad"]


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["--live", "0", "a.png"], "--live 0 beside a.png"),
        (["a.png", "--raw", "4x4"], "--raw without -"),
        (["-", "--raw", "4by4"], "expected WIDTHxHEIGHT"),
        (["-", "--raw", "99999x99999"], "expected 1 to 200000000"),
        (["a.png", "--topic", "/image"], "no recording"),
        (["none.bag"], "none.bag: no such file"),
        (["images", "--filter", "--odometry-topic", "/odom"], "no recording, expected --odometry"),
        (["drive.mp4", "--filter", "--odometry", "odo.csv", "--odometry-topic", "/a"], "odo.csv: expected a recording"),
        (["images", "--wheel-base", "0.4"], "--wheel-base without --filter"),
        (["images", "--jump-after", "0"], "--jump-after without --filter"),
        (["images", "--wheel-radius", "0.4"], "--wheel-radius without --filter"),
        (["images", "--filter", "--wheel-base", "0.4"], "--wheel-base without --odometry"),
        (["images", "--filter", "--odometry-gap", "2"], "--odometry-gap without --odometry"),
        (["images", "--frame-rate", "5"], "--frame-rate 5, expected --out that ends in .mcap or .tum"),
        (
            ["images", "--frame-rate", "5", "--out", "a.csv"],
            "--frame-rate 5, expected --out that ends in .mcap or .tum",
        ),
    ],
)
def test_wrong_use(run: Run, world: Path, words: list[str], hint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(world)
    code, said, complaints = run("tilt", *words, "--camera", "camera.toml")
    assert (code, said, complaints.count("\n")) == (2, "", 1)
    assert hint in complaints


@pytest.mark.parametrize(
    "words",
    [
        ["tilt", "images", "--overlay", "images"],
        ["tilt", "images/a.png", "--level", "../{}/images/"],
        ["lines", "images", "--overlay", "images"],
        ["segments", ".", "--overlay", "images"],
        ["level", "images", "--out", "images"],
        ["level", "drive.mp4", "--out", "drive.mp4"],
        ["level", "drive.mp4", "--out", "."],
        ["track", "drive.mp4", "--video", "drive.mp4", "--out", "tracks.csv"],
        ["track", "images", "--plot", "images/a.png", "--out", "tracks.csv"],
        ["tilt", "images", "--filter", "--filter-plot", "images/a.png"],
        ["tilt", "drive_mcap/drive_mcap.mcap", "--out", "drive_mcap/drive_mcap.mcap"],
        ["tilt", "drive_mcap", "--out", "drive_mcap/drive_mcap.mcap"],
        ["segments", "drive_mcap", "--out", "drive_mcap/edges.csv"],
        ["tilt", "images", "--out", "images/frames.csv"],
        ["lines", ".", "--out", "odometry.csv"],
        ["track", "images", "--odometry", "wheels.csv", "--out", "wheels.csv"],
    ],
)
def test_what_is_read_is_not_replaced(run: Run, world: Path, words: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(world)
    before = [(world / name).read_bytes() for name in ("drive.mp4", "images/a.png", "drive_mcap/drive_mcap.mcap")]
    said = run(*(word.format(world.name) for word in words), "--camera", "camera.toml", "--overwrite")
    assert (said.code, said.out) == (2, "")
    assert "is what is read, or holds it, expected another place" in said.err
    assert [
        (world / name).read_bytes() for name in ("drive.mp4", "images/a.png", "drive_mcap/drive_mcap.mcap")
    ] == before
    assert not (world / "tracks.csv").exists()


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["--wheel-base", "0.4"], "--wheel-base without --odometry"),
        (["--wheel-radius", "0.1"], "--wheel-radius without --odometry"),
        (["--frame-rate", "5"], "--frame-rate without --video"),
    ],
)
def test_track_refuses_options_of_what_is_not_there(run: Run, world: Path, words: list[str], hint: str) -> None:
    out = world / "refused.csv"
    said = run("track", world / "images", "--camera", world / "camera.toml", "--out", out, *words)
    assert (said.code, hint in said.complaint, out.exists()) == (2, True, False)


def test_a_recording_tells_its_camera_and_mounting(run: Run, world: Path, tmp_path: Path, room: RoomImage) -> None:
    made = Bag("mcap")
    height, width = room.gray.shape
    made.image("/image", START_S, room.gray, "mono8")
    made.camera_info(
        START_S, width, height, "equidistant", [0.0] * 4, [150.0, 0, width / 2, 0, 150.0, height / 2, 0, 0, 1]
    )
    made.static("base_link", "camera", [0, 0, 0, 1.0])
    bag = made.write(tmp_path)
    code, said, complaints = run("tilt", bag, "--camera", bag, "--robot-from-camera", bag)
    assert (code, complaints) == (0, "")
    assert "1 image" in said
