"""`tiltvp calibrate`: what its options are taken for, and what is refused before any work is done."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tiltvp
from recordings import START_S, Bag
from tiltvp import LogCalibration, Robot
from tiltvp.cli import main
from tiltvp.cli.calibrate import _calibrated
from tiltvp.cli.calibrate_inputs import DriveOptions, LogOptions, Solved
from tiltvp.cli.calibrate_pictures import PictureLog, PictureOptions
from tiltvp.cli.calibrate_results import Calibration, ResultOptions
from tiltvp.cli.line_options import DrivingLineOptions
from tiltvp.cli.options import CameraOptions
from tiltvp.cli.showing import RerunOptions
from tiltvp.cli.sources import MotionOptions
from tiltvp.drive_logs import DriveLog
from tiltvp.errors import InvalidInputError, OutputError
from tiltvp.streams import Wheels, frame_motions, open_frames, read_odometry
from tiltvp.streams.outputs.transforms import StaticTransform
from tiltvp.synth import simulate_drive
from tiltvp.turning import FrameDelay

CAMERA = tiltvp.Camera.equidistant(width=24, height=24, focal_px=8.0, cx=11.5, cy=11.5)
FRAMES = 5
SURE = ("--start", "0.2", "0", "0", "--start-sigma", "0.1", "0.1", "0.3")
STEPS = [(0.02, 0.03), (0.01, 0.05)] * 20
"""Of the wheels, ten a second."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A drive: black images two a second, and wheels."""
    CAMERA.save(tmp_path / "camera.toml")
    for k in range(FRAMES):
        tiltvp.write_image(tmp_path / "images" / f"{k}.png", np.zeros((24, 24), np.uint8))
    rows = "".join(f"{k}.png,{0.5 * k}\n" for k in range(FRAMES))
    (tmp_path / "images" / "frames.csv").write_text("file,time_s\n" + rows)
    wheels(tmp_path / "odometry.csv", 1.0)
    return tmp_path


def wheels(path: Path, left: float) -> None:
    rows = "".join(f"{0.1 * k},{left * step[0]},{step[1]}\n" for k, step in enumerate(STEPS))
    path.write_text("time_s,left_m,right_m\n" + rows)


def opened(
    folder: Path,
    *,
    odometry: str = "odometry.csv",
    read: LogOptions | None = None,
    lines: DrivingLineOptions | None = None,
) -> PictureLog:
    return PictureLog.open(
        str(folder / "images"), PictureOptions(), MotionOptions(odometry=folder / odometry, wheel_base=0.4),
        CameraOptions(camera=folder / "camera.toml"), lines or DrivingLineOptions(), DriveOptions(wheel_base=0.4), None,
        read or LogOptions(),
    )  # fmt: skip


def test_the_record_is_mended_before_anything_is_made_of_it(folder: Path) -> None:
    wheels(folder / "negated.csv", -1.0)
    mended = opened(folder, odometry="negated.csv", read=LogOptions(read_as=("left-wheel-negated",))).moved.motions
    for ours, right in zip(mended, opened(folder).moved.motions, strict=True):
        assert (ours.yaw_rad, ours.distance_m) == pytest.approx((right.yaw_rad, right.distance_m))


def test_of_a_record_in_millimetres_turns_stay_as_they_are(tmp_path: Path) -> None:
    """Poses on a circle of a metre."""
    angles = np.arange(0.0, 3.0, 0.1).tolist()
    rows = "".join(f"{a},{1e3 * math.sin(a)},{1e3 * (1.0 - math.cos(a))},{a}\n" for a in angles)
    (tmp_path / "poses.csv").write_text("time_s,x_m,y_m,yaw_rad\n" + rows)
    read = read_odometry(tmp_path / "poses.csv", wheels=Wheels(wheel_base_m=0.4), read_as=["millimetres"])
    assert (read.distance_m[-1], read.yaw_rad[-1]) == pytest.approx((angles[-1], angles[-1]))


def test_frames_that_overtake_each_other_are_refused_at_once(tmp_path: Path) -> None:
    CAMERA.save(tmp_path / "camera.toml")
    bag = Bag("mcap")
    for k, time_s in enumerate((0.0, 0.2, 0.1, 0.3)):
        bag.image("/image", START_S + time_s, np.zeros((24, 24), np.uint8), "mono8", late_s=0.1 * k - time_s)
        bag.odometry(START_S + 0.1 * k, 0.1 * k, 0.0, 0.0)
    recording = bag.write(tmp_path)
    (tmp_path / "images").symlink_to(recording)
    with pytest.raises(InvalidInputError, match=r"#2: taken before .*#1, expected frames in the order of their times"):
        opened(tmp_path, odometry=recording.name)


@pytest.mark.parametrize("times", [True, False])
def test_turns_without_distances_are_no_robot_that_never_drives(folder: Path, times: bool) -> None:
    rows = "".join(f"{0.5 * k},0.1\n" if times else "0.1\n" for k in range(FRAMES))
    (folder / "turns.csv").write_text(("time_s,yaw_rad\n" if times else "yaw_rad\n") + rows)
    with pytest.raises(InvalidInputError, match="odometry without distances"):
        opened(folder, odometry="turns.csv")
    # A turn in place has distances of 0.
    rows = "".join(f"{0.5 * k},0.1,0.0\n" for k in range(FRAMES))
    (folder / "turns.csv").write_text("time_s,yaw_rad,distance_m\n" + rows)
    assert opened(folder, odometry="turns.csv").moved.distances_known


def test_turns_beside_wheels_are_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for more, told in ((0.0, False), (0.01, True)):
        rows = "".join(f"0.02,0.04,{0.02 / 0.4 + more}\n" for _ in range(FRAMES))
        (folder / "both.csv").write_text("left_m,right_m,yaw_rad\n" + rows)
        opened(folder, odometry="both.csv")
        assert ("turns beside wheels, up to 0.57 degrees apart" in capsys.readouterr().out) is told


def test_the_clock_is_looked_for_where_the_robot_turns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    CAMERA.save(tmp_path / "camera.toml")
    for k in range(300):
        tiltvp.write_image(tmp_path / "images" / f"{k:03d}.png", np.zeros((24, 24), np.uint8))
    rows = "".join(f"{k:03d}.png,{0.2 * k + 0.1}\n" for k in range(300))
    (tmp_path / "images" / "frames.csv").write_text("file,time_s\n" + rows)
    turns = "".join(f"{0.1 * k},{0.05 if 500 < k < 540 else 0.0},0.01\n" for k in range(601))
    (tmp_path / "odometry.csv").write_text("time_s,yaw_rad,distance_m\n" + turns)
    looked_at = []

    def delay(images: Iterable[object], times_s: np.ndarray, *_: object) -> FrameDelay:
        looked_at.append((len(list(images)), times_s))
        return FrameDelay(0.1, 0.005, 0.9, 50)

    monkeypatch.setattr("tiltvp.turning.frame_delay", delay)
    log = opened(tmp_path, read=LogOptions(estimate_time_offset=True))
    ((count, times),) = looked_at
    assert count == len(times) == 120
    assert times[0] < 49.0
    assert times[-1] > 55.0
    np.testing.assert_allclose(log.frames.times_s, 0.2 * np.arange(300), atol=1e-9)
    assert log.late_s == 0.1


def test_by_how_much_frames_are_late_in_all_is_told(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Not only what is left once their times were brought to the odometry's clock."""
    drive = simulate_drive("alternating", seed=4)
    whole = tiltvp.calibrate(
        drive.odometry, drive.bearings, wheel_base_m=0.4, start=(0.2, 0.0, 0.0), estimate_time_offset=True,
        times_s=0.2 * np.arange(len(drive.odometry)),
    )  # fmt: skip
    found = Calibration("log", tiltvp.SelfCalibrator(wheel_base_m=0.4), [], whole, late_s=0.1)
    ResultOptions(out=tmp_path / "out.json").tell([found], None, None, DriveOptions(wheel_base=0.4))
    late_s = json.loads((tmp_path / "out.json").read_text())["logs"][0]["frames_late_s"]
    assert late_s == pytest.approx(0.1 - whole.time_offset_s)
    told = capsys.readouterr().out
    assert f"frames are stamped {late_s:.4f} +- {whole.time_offset_sigma_s:.4f} s late in all" in told


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of a simulated drive, and a robot of which roll, pitch and height are known."""
    folder, drive = tmp_path_factory.mktemp("tables"), simulate_drive("alternating", seed=4)
    steps = "".join(f"{k},{left!r},{right!r}\n" for k, (left, right) in enumerate(drive.odometry.tolist()))
    (folder / "wheels.csv").write_text("step,delta_left_m,delta_right_m\n" + steps)
    seen = "".join(f"{int(step)},{int(landmark)},{angle!r}\n" for step, landmark, angle in drive.bearings.tolist())
    (folder / "bearings.csv").write_text("step,landmark,bearing_rad\n" + seen)
    measured = Robot(
        CAMERA,
        np.eye(3),
        covariance_rad2=1e-6 * np.eye(2),
        place_m=(0.2, 0.0),
        height_m=0.4,
        wheels=Wheels(wheel_base_m=0.4),
    )
    measured.save(folder / "robot.toml")
    return folder


def calibrate(folder: Path, *words: object) -> int:
    logs = (folder / "wheels.csv", folder / "bearings.csv")
    return main([str(word) for word in ("calibrate", *logs, "--wheel-base", 0.4, *SURE, *words)])


def test_the_height_of_a_robots_file_is_kept(tables: Path, tmp_path: Path) -> None:
    robot, again = tables / "robot.toml", tmp_path / "again.toml"
    for given, height in (((), 0.4), (("--height", "0.7"), 0.7)):
        assert calibrate(tables, "--camera", robot, "--robot-out", again, "--overwrite", *given) == 0
        assert Robot.load(again).height_m == height


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (("--child-frame", "camera-optical"), "--child-frame = 'camera-optical', expected the name of a frame"),
        (("--child-frame", "base_link"), "--child-frame = 'base_link', expected another name than that of the parent"),
        (("--parent-frame", "camera_optical"), "--child-frame = 'camera_optical', expected another name"),
        (("--height", "nan"), "--height = nan, expected finite metres"),
        (("--robot-out", "masked.toml"), "masked-mask.png: exists"),
        (("--method", "other"), "method = 'other', expected"),
        (("--gate-probability", "2"), "--gate-probability = 2, expected"),
    ],
)
def test_what_cannot_be_written_is_refused_before_any_work(
    tables: Path, words: tuple[str, ...], hint: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tables)
    Robot(CAMERA, np.eye(3), mask=np.ones((24, 24), np.bool_)).save("told.toml")
    tiltvp.write_image("masked-mask.png", np.zeros((24, 24), np.uint8))
    monkeypatch.setattr(tiltvp, "calibrate", lambda *_, **__: pytest.fail("there was work"))
    assert calibrate(tables, "--camera", "told.toml", *words) == 2
    assert hint in capsys.readouterr().err


def test_what_was_found_is_kept_where_the_transform_cannot_be_written(
    tables: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object) -> None:
        raise OutputError("disk full")

    monkeypatch.setattr(StaticTransform, "write", full)
    assert calibrate(tables, "--out", tmp_path / "found.json", "--transform", tmp_path / "camera.urdf") != 0
    assert "disk full" in capsys.readouterr().err
    assert json.loads((tmp_path / "found.json").read_text())["extrinsics"]["known"] is True


@pytest.mark.skipif(sys.platform != "linux", reason="/dev/full")
def test_what_was_found_is_kept_where_nobody_reads_what_is_printed(tables: Path, tmp_path: Path) -> None:
    outputs = {"--out": "found.json", "--transform": "camera.urdf", "--robot-out": "robot.toml"}
    words = ["calibrate", "wheels.csv", "bearings.csv", "--camera", "robot.toml", *SURE]
    for option, name in outputs.items():
        words += [option, str(tmp_path / name)]
    script = "import sys\nfrom tiltvp.cli import main\nsys.exit(main())"
    with open("/dev/full", "w") as full:
        done = subprocess.run([sys.executable, "-c", script, *words], cwd=tables, stdout=full, stderr=subprocess.PIPE)
    assert (done.returncode, done.stderr) == (1, b"tiltvp: the output: No space left on device\n")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(outputs.values())


@pytest.mark.parametrize(
    "words",
    [
        ("--tilt", "refined"), ("--gradient-min", "3"), ("--level-floor",), ("--track-frames-min", "7"),
        ("--lines-max", "5"), ("--mask", "nosuch.png"), ("--line-method", "radial"), ("--tracks", "t.csv"),
        ("--topic", "/image"), ("--wheel-radius", "0.1"),
    ],
)  # fmt: skip
def test_options_of_pictures_are_refused_with_tables(
    tables: Path, words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert calibrate(tables, *words) == 2
    assert f"tiltvp: {words[0]} with" in capsys.readouterr().err


@pytest.mark.parametrize("words", [("--robot-from-camera", "forward"), ("--level-floor",)])
def test_what_a_robots_file_was_measured_to_be_is_not_told_again(
    folder: Path, tables: Path, words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    given = ("calibrate", folder / "images", "--camera", tables / "robot.toml", "--wheel-base", 0.4, *words)
    assert main([str(word) for word in given]) == 2
    assert f"tiltvp: {words[0]} with {tables / 'robot.toml'}, expected no file" in capsys.readouterr().err


def test_a_wheel_base_of_nothing_is_none(tables: Path, capsys: pytest.CaptureFixture[str]) -> None:
    logs = (tables / "wheels.csv", tables / "bearings.csv")
    given = ("calibrate", *logs, "--camera", tables / "robot.toml", *SURE, "--wheel-base", 0)
    assert main([str(word) for word in given]) == 2
    assert "--wheel-base" in capsys.readouterr().err


def test_a_robots_file_has_the_wheels_that_its_mounting_was_found_by(
    folder: Path, tables: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Not those of the file that was given, where others were told."""
    Robot(
        CAMERA, np.eye(3), covariance_rad2=1e-6 * np.eye(2), wheels=Wheels(wheel_base_m=0.5, ticks_per_turn=7.0),
        topics={"odometry": "/odom", "joints": "/joints"},
    ).save(tmp_path / "robot.toml")  # fmt: skip
    told = ("--camera", tmp_path / "robot.toml", "--robot-out", tmp_path / "again.toml", "--estimate-odometry")
    assert calibrate(tables, *told) == 0
    assert Robot.load(tmp_path / "again.toml").wheels == Wheels(wheel_base_m=0.4, ticks_per_turn=7.0)
    assert "its wheel base is as told, 0.4 m, not as estimated" in capsys.readouterr().out
    log = opened(folder)
    log.topics.update(images="/image", odometry="/joints")
    again = log.robot(Robot.load(tmp_path / "robot.toml"))
    assert again.wheels.wheel_base_m == 0.4
    assert again.topics == {"odometry": "/odom", "joints": "/joints", "images": "/image"}


def test_parts_that_are_told_are_left_out_of_pictures_too(monkeypatch: pytest.MonkeyPatch) -> None:
    drive = simulate_drive("alternating", seed=4)
    log = DriveLog(drive.odometry, drive.bearings, None)

    class Pictures:
        name, sigma_rad, late_s = "pictures", None, 0.0

        def solved(self, _: object, solve: Callable[..., LogCalibration]) -> Solved:
            return Solved(log, solve(log, jackknife_parts=8))

    taken = []
    solve = tiltvp.calibrate
    monkeypatch.setattr(tiltvp, "calibrate", lambda *a, **k: taken.append(k["jackknife_parts"]) or solve(*a, **k))
    for told, parts in ((None, 8), (2, 2), (0, 0)):
        options = DriveOptions(wheel_base=0.4, jackknife_parts=told)
        _calibrated(Pictures(), None, options, LogOptions(), "default", RerunOptions())
        assert taken.pop() == parts


@pytest.mark.parametrize(
    ("options", "hint"),
    [
        ({"tilt": "other"}, "--tilt 'other', expected"),
        ({"method": "other"}, "--line-method 'other', expected"),
        ({"length_min_deg": -5.0}, "length_min_rad = -0.08"),
        ({"tilt": "upright", "tilt_confidence_min": 0.9}, "--tilt-confidence-min with --tilt upright"),
    ],
)
def test_options_of_lines_are_refused_before_leans_are_looked_at(
    folder: Path, options: dict[str, Any], hint: str
) -> None:
    with pytest.raises(InvalidInputError, match=hint):
        opened(folder, lines=DrivingLineOptions(**options))


def test_a_confidence_without_leans_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for words in (("lines",), ("track", "--out", folder / "tracks.csv")):
        given = (*words, folder / "images", "--camera", folder / "camera.toml", "--tilt-confidence-min", 0.9)
        assert main([str(word) for word in given]) == 2
        assert "--tilt-confidence-min with --tilt upright" in capsys.readouterr().err


def test_a_log_that_is_named_twice_is_no_second_one(tables: Path, capsys: pytest.CaptureFixture[str]) -> None:
    again = tables / ".." / tables.name / "bearings.csv"
    logs = (tables / "wheels.csv", tables / "bearings.csv", tables / "wheels.csv", again)
    assert main([str(word) for word in ("calibrate", *logs, "--wheel-base", 0.4, *SURE)]) == 2
    assert f"{again}: given twice, expected logs of different drives" in capsys.readouterr().err


def test_pictures_that_there_are_not_are_told_to_be_none(tables: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "no-such-drive", "--camera", str(tables / "robot.toml")]) == 2
    assert "no-such-drive: no such file or folder, expected" in capsys.readouterr().err


@pytest.mark.parametrize("ending", [".tsv", ".parquet", ".txt", ".JSON"])
def test_tables_of_other_endings_are_not_taken_for_pictures(
    ending: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / f"wheels{ending}"
    other.touch()
    assert main([str(word) for word in ("calibrate", other, "bearings.csv", "--wheel-base", 0.4)]) == 2
    assert f"{other}: a file that ends in {ending.lower()}, expected ODOMETRY.csv" in capsys.readouterr().err


def test_a_camera_that_cannot_be_read_is_no_lack_of_a_wheel_base(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (folder / "empty.toml").write_text("")
    for name, told in (("no-such.toml", "no such file"), ("empty.toml", "is empty"), ("camera.toml", "--wheel-base:")):
        assert main(["calibrate", str(folder / "images"), "--camera", str(folder / name)]) == 2
        assert told in capfd.readouterr().err


@pytest.mark.parametrize(
    ("column", "step", "told"),
    [
        ("yaw_rad", 5.0, "rad, the first to .*1.png by 5 rad: are they in degrees"),
        ("distance_m", 80.0, "in millimetres"),
    ],
)
def test_steps_that_no_robot_makes_are_told(folder: Path, column: str, step: float, told: str) -> None:
    columns = ("yaw_rad", "distance_m")
    for odd in (step, 0.5):
        rows = [",".join(str(odd if name == column and k == 1 else 0.1) for name in columns) for k in range(FRAMES)]
        (folder / "steps.csv").write_text("\n".join([",".join(columns), *rows, ""]))
        notes = frame_motions(open_frames(folder / "images"), folder / "steps.csv").notes
        assert bool(re.search(told, " ".join(notes))) is (odd == step)


def test_a_table_of_frames_without_times_is_told(folder: Path) -> None:
    for header, told in (("file,time_s", False), ("file;time_s", True), ("File,time_s", True)):
        (folder / "images" / "frames.csv").write_text(f"{header}\n" + "".join(f"{k}.png,{k}\n" for k in range(FRAMES)))
        words = " ".join(open_frames(folder / "images").notes)
        assert ("frames.csv: without the columns file and time_s" in words) is told


def test_no_output_takes_the_place_of_another_or_of_what_is_read(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, bag = tmp_path / "out.json", Bag("mcap")
    given = ("--camera", folder / "camera.toml", "--wheel-base", 0.4, "--odometry", folder / "odometry.csv")
    words = ("calibrate", folder / "images", *given, "--out", out, "--tracks", out)
    assert main([str(word) for word in words]) == 2
    assert f"--out and --tracks are both {out}, expected two files" in capsys.readouterr().err
    for k in range(3):
        bag.image("/image", 0.5 * (k + 1), np.zeros((24, 24), np.uint8), "mono8")
    (recording,) = bag.write(tmp_path).glob("*.mcap")
    words = ("calibrate", recording, *given, "--transform", recording, "--overwrite")
    assert main([str(word) for word in words]) == 2
    assert f"{recording}: is what is read" in capsys.readouterr().err
