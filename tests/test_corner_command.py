"""`tiltvp corner`: its files, how it chooses the method, and combinations that it refuses."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import tiltvp
from commands import Run
from drawn_corners import CAMERA, COLOURS, GREYS, LEFT_FROM_RIGHT, pair, pose, turn
from recordings import START_S, Bag
from tiltvp.cli import main
from tiltvp.cli.corner_methods import advice
from tiltvp.cli.corner_pairs import pairs_of, partners_of
from tiltvp.robot import Robot
from tiltvp.stereo_rigs import StereoRig
from tiltvp.streams import open_frames
from tiltvp.synth import Room, StereoSequence, zed_cameras

pytestmark = pytest.mark.slow


def test_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    StereoRig(CAMERA, CAMERA, LEFT_FROM_RIGHT).save(tmp_path / "rig.toml")
    CAMERA.save(tmp_path / "one.toml")
    for side, image in zip(("left", "right"), pair(COLOURS), strict=True):
        tiltvp.write_image(tmp_path / side / "a.png", image)
    left, right = str(tmp_path / "left"), str(tmp_path / "right")
    out, path = tmp_path / "poses.csv", tmp_path / "poses.txt"
    words = ["corner", left, right, "--calibration", str(tmp_path / "rig.toml"), "--out", str(out)]
    words += ["--corners", str(tmp_path / "corners.csv")]
    more = ["--overlay", str(tmp_path / "over"), "--trajectory", str(path), "--plot", str(tmp_path / "plot.png")]
    assert main([*words, *more]) == 0
    assert "1 with a pose" in capsys.readouterr().out
    [row] = pl.read_csv(out).iter_rows(named=True)
    rotation, vertex = pose()
    assert row["id"] == 1
    [corner] = pl.read_csv(tmp_path / "corners.csv").iter_rows(named=True)
    assert (corner["file"], corner["id"], corner["hypothesis"]) == (row["file"], 1, 0)
    assert np.allclose([row[name] for name in ("x_m", "y_m", "z_m")], -rotation.T @ vertex, atol=0.01)
    assert len(path.read_text().splitlines()) == 2
    assert tiltvp.read_image(tmp_path / "over" / "a.png").shape == (360, 480, 3)
    assert (tmp_path / "plot.png").exists()
    assert main(["corner", left, "--calibration", str(tmp_path / "one.toml"), "--out", str(out), "--overwrite"]) == 0
    assert main(["corner", left, right, "--calibration", str(tmp_path / "one.toml")]) == 2
    for side in (left, right):
        read = Path(side, "a.png").read_bytes()
        assert main([*words, "--overlay", side, "--overwrite"]) == 2
        assert "is what is read, or holds it" in capsys.readouterr().err
        assert Path(side, "a.png").read_bytes() == read


def test_the_command_line_chooses_the_method(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    StereoRig(CAMERA, CAMERA, LEFT_FROM_RIGHT).save(tmp_path / "rig.toml")
    for faces, name in ((COLOURS, "colours"), (GREYS, "greys"), (dict.fromkeys(GREYS, (150, 150, 150)), "nothing")):
        for side, image in zip(("left", "right"), pair(faces), strict=True):
            tiltvp.write_image(tmp_path / name / side / "a.png", image)

    def run(name: str, *words: str, order: tuple[str, str] = ("left", "right")) -> str:
        sides = [str(tmp_path / name / side) for side in order]
        assert main(["corner", *sides, "--calibration", str(tmp_path / "rig.toml"), *words]) == 0
        return capsys.readouterr().out

    assert "1 with a pose (the coloured cuboid)" in run("colours")
    assert "1 with a pose (corners of straight edges)" in run("greys", "--pitch", "-28", "--right-handed")
    assert "1 with a pose (the coloured cuboid, as published)" in run("colours", "--method", "paper")
    assert "1 with a pose (corners of straight edges)" in run("colours", "--gradient-min", "50", "--right-handed")
    said = run("nothing")
    assert "0 with a pose" in said
    assert "without a pose: no corner in the left image (1)" in said
    assert "looked for the coloured cuboid, else corners of straight edges" in said
    assert "try: " in said
    assert "--method general" in run("greys", "--method", "coloured")
    # Edges near that direction are looked at alone, however rough it is said to be.
    rough = [str(x) for x in turn("x", 25.0) @ pose()[0][:, 1]]
    said = run("greys", "--down", *rough, "--down-sigma-deg", "30")
    assert "try: " in said
    assert "another --pitch or --down, or a larger --vertical-max-deg where it is rough" in said
    assert "1 with a pose" in run("greys", "--down", *rough, "--vertical-max-deg", "40")
    said = run("colours", "--pitch", "-28", order=("right", "left"))
    assert "no corner that fits (1)" in said
    assert "try: that left and right are not exchanged, of one moment" in said
    assert advice("edges contradict the calibration", ("general",), is_pair=True, given={}).startswith("that left and")
    assert "--camera-from-imu" in advice("edges contradict the gravity", ("general",), is_pair=True, given={})
    for reason in ("no corner in the left image", "no corner that fits"):
        for given, told in (({}, False), ({"down": (0.0, 1.0, 0.0)}, True)):
            tries = advice(reason, ("coloured", "general"), is_pair=False, given=given)
            assert ("another --pitch or --down" in tries) == told


def test_the_mounting_of_a_robot_says_which_way_is_down(run: Run, tmp_path: Path) -> None:
    """Nothing told which edge is the upright one, and a camera with an edge's length had no place."""
    rotation, vertex = pose()
    up = -rotation[:, 1]
    ahead = np.cross(np.cross(up, [0.0, 0.0, 1.0]), up) / np.hypot(up[0], up[1])
    Robot(CAMERA, np.array([ahead, np.cross(up, ahead), up])).save(tmp_path / "robot.toml")
    tiltvp.write_image(tmp_path / "a.png", pair(GREYS)[0])
    words = ("corner", tmp_path / "a.png", "--calibration", tmp_path / "robot.toml", "--edge-length-m", 0.3)
    assert run(*words, "--out", tmp_path / "poses.csv").code == 0
    [row] = pl.read_csv(tmp_path / "poses.csv").iter_rows(named=True)
    assert np.allclose([row[name] for name in ("x_m", "y_m", "z_m")], -rotation.T @ vertex, atol=0.01)
    # What is given counts all the same.
    assert "another --pitch or --down" in run(*words, "--pitch", 80).out


def test_a_calibration_that_straight_edges_speak_against_is_told(run: Run, tmp_path: Path) -> None:
    """Nothing told of one camera that its focal length is off."""
    left, right = zed_cameras()
    sequence = StereoSequence(Room("office", 3), left=left, right=right, frames=5, seed=3)
    for frame in range(5):
        for side, image in zip(("left", "right"), sequence.render(frame), strict=True):
            tiltvp.write_image(tmp_path / side / f"{frame}.png", image)
    narrow = {name: 0.9 * left.parameters[name] for name in ("fx", "fy")}
    off = tiltvp.Camera("pinhole", width=left.width, height=left.height, **{**left.parameters, **narrow})
    for name, lenses in (("told", (left, right)), ("off", (off, right))):
        StereoRig(*lenses, sequence.left_from_right).save(tmp_path / f"{name}.toml")
        lenses[0].save(tmp_path / f"one-{name}.toml")
    words = ("corner", tmp_path / "left")
    assert "bent" not in run(*words, "--calibration", tmp_path / "one-told.toml").err
    said = run(*words, "--calibration", tmp_path / "one-off.toml").err
    assert re.search(r"--calibration: \d+ straight edges are bent, .*: its focal length 1\.1\d\d", said)
    words += (tmp_path / "right", "--calibration")
    assert "bent" not in run(*words, tmp_path / "told.toml").err
    said = run(*words, tmp_path / "off.toml").err
    assert "--calibration, left camera: " in said
    assert "right camera" not in said


def test_a_trajectory_without_any_place_says_why_and_what_to_try(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    StereoRig(CAMERA, CAMERA, LEFT_FROM_RIGHT).save(tmp_path / "rig.toml")
    for side in ("left", "right"):
        tiltvp.write_image(tmp_path / side / "a.png", np.full((360, 480, 3), 128, np.uint8))
    sides = [str(tmp_path / side) for side in ("left", "right")]
    files = {name: tmp_path / name for name in ("poses.csv", "plot.png", "path.txt")}
    words = ["--out", str(files["poses.csv"]), "--plot", str(files["plot.png"]), "--trajectory", str(files["path.txt"])]
    assert main(["corner", *sides, "--calibration", str(tmp_path / "rig.toml"), *words]) == 2
    said = capsys.readouterr()
    assert "without a pose: no corner in the left image (1)" in said.out
    assert "try: " in said.out
    assert said.err == f"tiltvp: {files['path.txt']}: no frame has a pose with a place, expected one at least\n"
    assert [file.exists() for file in files.values()] == [True, True, False]


def test_a_trajectory_before_several_corners_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With --independent corners without colours have new names in each frame, the coloured one keeps its."""
    StereoRig(CAMERA, CAMERA, LEFT_FROM_RIGHT).save(tmp_path / "rig.toml")
    for faces, told in ((GREYS, True), (COLOURS, False)):
        for name in ("a", "b", "c"):
            for side, image in zip(("left", "right"), pair(faces), strict=True):
                tiltvp.write_image(tmp_path / side / f"{name}.png", image)
        words = ["corner", str(tmp_path / "left"), str(tmp_path / "right"), "--calibration", str(tmp_path / "rig.toml")]
        words += ["--overwrite", "--trajectory", str(tmp_path / "path.txt")]
        assert main([*words, "--independent"]) == 0
        assert ("from 2 frames on its origin is another corner" in capsys.readouterr().out) == told
        assert main(words) == 0
        assert "its origin" not in capsys.readouterr().out


def test_grey_frames_after_the_coloured_cuboid_are_skipped(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    StereoRig(CAMERA, CAMERA, LEFT_FROM_RIGHT).save(tmp_path / "rig.toml")
    CAMERA.save(tmp_path / "one.toml")
    for name in ("a", "b", "c"):
        for side, image in zip(("left", "right"), pair(COLOURS), strict=True):
            is_grey = name == "b" and side == "right"
            tiltvp.write_image(tmp_path / side / f"{name}.png", image[..., 1] if is_grey else image)
    left, right = str(tmp_path / "left"), str(tmp_path / "right")
    for sides, rig in (([right], "one.toml"), ([left, right], "rig.toml")):
        said = {}
        for method in ("auto", "coloured"):
            assert main(["corner", *sides, "--calibration", str(tmp_path / rig), "--method", method]) == 1
            said[method] = capsys.readouterr()
        assert said["auto"] == said["coloured"]
        assert "2 frames, 1 skipped, 2 with a pose" in said["auto"].out
        assert "b.png" in said["auto"].err


def test_the_file_that_is_wrong_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A pair's file for one camera, and right images that cannot be used."""
    StereoRig(CAMERA, CAMERA, LEFT_FROM_RIGHT).save(tmp_path / "rig.toml")
    good, right = pair(COLOURS)
    for name, image in (("a", right[..., 1]), ("b", right[:, ::2])):
        tiltvp.write_image(tmp_path / "left" / f"{name}.png", good)
        tiltvp.write_image(tmp_path / "right" / f"{name}.png", image)
    (tmp_path / "right" / "c.png").write_bytes(b"nothing")
    tiltvp.write_image(tmp_path / "left" / "c.png", good)
    sides = [str(tmp_path / side) for side in ("left", "right")]
    rig = ["--calibration", str(tmp_path / "rig.toml"), "--method", "coloured"]
    assert main(["corner", *sides, *rig]) == 2
    small, grey, broken, *_ = capsys.readouterr().err.splitlines()
    assert f"first {tmp_path / 'right' / 'b.png'}: got 360 x 240 pixels" in small
    both = f"{tmp_path / 'left' / 'a.png'} and {tmp_path / 'right' / 'a.png'}"
    assert grey.startswith(f"tiltvp: {both}: right: shape (360, 480), expected (H, W, 3")
    assert broken.startswith(f"tiltvp: {tmp_path / 'right' / 'c.png'}: not an image")
    assert main(["corner", sides[0], *rig]) == 2
    assert "rig.toml: is a pair of cameras, expected one camera" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--method", "colour"], "--method 'colour', expected auto, coloured, general or paper"),
        (
            ["--gradient-min", "50", "--faces", "rgb"],
            "--method auto with --faces (of coloured and paper), --gradient-min (of general)",
        ),
        (["--method", "coloured", "--mask", "mask.png"], "--method coloured with --mask (of general)"),
        (["--pitch", "3", "--down", "0", "1", "0"], "--pitch and --down"),
        (["--topic-right", "/right"], "--topic-right"),
        (["--down-sigma-deg", "5"], "--down-sigma-deg without --pitch or --down, expected both"),
        (
            ["--camera-height-sigma-m", "0.1", "--edge-length-m", "1"],
            "--camera-height-sigma-m without --camera-height-m",
        ),
        (["--length-sigma-m", "0.1"], "--length-sigma-m without --edge-length-m or --box-size-m, expected both"),
        (["--known-edge", "x"], "--known-edge without --edge-length-m, expected both"),
        (["--known-edge", "y", "--box-size-m", "1", "1", "1"], "--known-edge without --edge-length-m"),
        (["--trajectory", "t.txt"], "--camera-height-m"),
        (["--frame-rate", "inf"], '"inf" for --frame-rate'),
    ],
)
def test_impossible_combinations_are_refused_at_once(
    words: list[str],
    complaint: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    CAMERA.save("one.toml")
    tiltvp.write_image(tmp_path / "mask.png", np.full((360, 480), 255, np.uint8))
    # There is no such image: what is wrong with the words is said before it is looked for.
    assert main(["corner", "none.png", "--calibration", "one.toml", *words]) == 2
    assert complaint in capsys.readouterr().err


@pytest.mark.parametrize(
    ("lefts", "rights", "told"),
    [
        ([0.1, 0.2], [0.0, 0.1], r"right .*#0: taken 0\.100 s before the left .*#0 \(2 such pairs\)"),
        ([0.0, 0.1], [0.04, 0.14, 0.24], "0 pairs of 2 left and 3 right frames are at most 0.025 s apart"),
        ([0.0, 0.1], [0.04, 0.06], None),
    ],
)
def test_frames_of_two_moments_are_no_pair(
    lefts: list[float], rights: list[float], told: str | None, tmp_path: Path, run: Run
) -> None:
    StereoRig(CAMERA, CAMERA, LEFT_FROM_RIGHT).save(tmp_path / "rig.toml")
    bag = Bag("mcap")
    for topic, times_s in (("/left", lefts), ("/right", rights)):
        for time_s in times_s:
            bag.image(topic, START_S + time_s, np.zeros((360, 480), np.uint8), "mono8")
    recording = bag.write(tmp_path)
    words = ["corner", recording, recording, "--topic", "/left", "--calibration", tmp_path / "rig.toml"]
    said = run(*words, "--topic-right", "/right")
    if told is None:
        assert said.code == 0
    else:
        assert said.code == 2
        assert re.search(told, said.complaint)
    # Who says how fast frames follow each other does not mean their times.
    assert run(*words, "--topic-right", "/right", "--frame-rate", "10").code == (2 if len(lefts) != len(rights) else 0)
    assert "expected one, by --topic-right" in run(*words).complaint


@pytest.mark.parametrize(
    ("lefts", "rights", "pairs"),
    [
        ([0, 1, 2, 3, 5], [0, 2, 3, 4, 5, 6], [(0, 0), (2, 1), (3, 2), (4, 4)]),
        ([0, 1, 2], [0, 1, 3], [(0, 0), (1, 1)]),
    ],
)
def test_frames_that_one_side_lost_are_left_out(
    lefts: list[int], rights: list[int], pairs: list[tuple[int, int]], tmp_path: Path, run: Run
) -> None:
    """Frames are as bright as they are late; the right ones come 10 ms after the left."""
    StereoRig(CAMERA, CAMERA, LEFT_FROM_RIGHT).save(tmp_path / "rig.toml")
    bag = Bag("mcap")
    for topic, times, late_s in (("/left", lefts, 0.0), ("/right", rights, 0.01)):
        for k in times:
            bag.image(topic, START_S + 0.1 * k + late_s, np.full((360, 480), 20 * k, np.uint8), "mono8")
    recording = bag.write(tmp_path)
    words = ("--topic", "/left", "--topic-right", "/right", "--calibration", tmp_path / "rig.toml")
    said = run("corner", recording, recording, *words, "--out", tmp_path / "out.csv")
    assert said.code == 0
    counts = f"{len(pairs)} pairs of {len(lefts)} left and {len(rights)} right frames"
    assert f"{counts} are at most 0.025 s apart; the others are left out" in said.err
    assert pl.read_csv(tmp_path / "out.csv")["file"].to_list() == [f"{recording}#{left}" for left, _ in pairs]
    sides = [open_frames(recording, topic=topic) for topic in ("/left", "/right")]
    partners = partners_of(*sides, timed=True)
    assert [(k, partner) for k, partner in enumerate(partners) if partner is not None] == pairs
    for left, right in pairs_of(*sides, partners):
        assert left.read()[0, 0] == right.read()[0, 0]


@pytest.mark.parametrize(
    ("lefts", "rights", "told"),
    [
        (("a", "b"), ("b", "c"), "b.png: beside"),
        (("l0", "l1"), ("r0", "r1"), None),
        (("a", "b"), ("a", "b"), None),
    ],
)
def test_files_of_equal_names_are_pairs(
    lefts: tuple[str, ...], rights: tuple[str, ...], told: str | None, tmp_path: Path, run: Run
) -> None:
    StereoRig(CAMERA, CAMERA, LEFT_FROM_RIGHT).save(tmp_path / "rig.toml")
    for side, names in (("left", lefts), ("right", rights)):
        for gray, name in enumerate(names):
            tiltvp.write_image(tmp_path / side / f"{name}.png", np.full((360, 480), gray, np.uint8))
    said = run("corner", tmp_path / "left", tmp_path / "right", "--calibration", tmp_path / "rig.toml")
    if told is None:
        assert (said.code, said.err) == (0, "")
    else:
        assert said.code == 2
        assert told in said.complaint
    said = run("corner", "-", tmp_path / "right", "--calibration", tmp_path / "rig.toml")
    assert said.code == 2
    assert "whose frames can be counted" in said.complaint
