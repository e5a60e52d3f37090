"""Where answers go: recordings, TUM and transforms that are read back by other programs' readers, and say the same."""

from __future__ import annotations

import csv
import math
import os
import re
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from rosbags.highlevel import AnyReader

import tiltvp
from tiltvp import Camera, Extrinsics, Robot
from tiltvp._core import leaning_from_upright
from tiltvp.cli import main
from tiltvp.cli.options import rotation_of as mounting_of
from tiltvp.errors import CalibrationError, InvalidInputError, MissingExtraError, OutputError, TiltvpError
from tiltvp.lab.datasets.panoramas import paper_camera
from tiltvp.rotations import about_vertical, read_rotation
from tiltvp.streams.outputs.tilts import TILT_TOPIC, YAW_VARIANCE_RAD2, attitude, write_tilts
from tiltvp.streams.outputs.transforms import TRANSFORM_ENDINGS, StaticTransform
from tiltvp.synth import render_room, simulate_drive


def messages(path: Path) -> list[tuple[str, int, Any]]:
    """Topic, stamp of the recorder and message, in the order of the recording."""
    with AnyReader([path]) as reader:
        return [(c.topic, time, reader.deserialize(raw, c.msgtype)) for c, time, raw in reader.messages()]


def rotation_of(q: Any) -> np.ndarray:
    """(3, 3) of a quaternion message, by the textbook's formula."""
    x, y, z, w = q.x, q.y, q.z, q.w
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


class Lean:
    """A tilt with the covariance of its normal."""

    def __init__(self, alpha_rad: float, beta_rad: float, covariance: Any = ((4e-6, 1e-6), (1e-6, 9e-6))) -> None:
        self.normal = tiltvp.normal_from_alpha_beta(alpha_rad, beta_rad)
        x, y, z = self.normal
        self.pitch_rad, self.roll_rad = math.asin(-x), math.atan2(y, z)
        self.covariance_rad2 = np.array(covariance)

    def __bool__(self) -> bool:
        return True


LEANS = [Lean(0.0, 0.0), Lean(0.1, 0.0), Lean(0.2, math.pi / 2), Lean(0.4, -2.5), Lean(1.2, 0.7)]

NOTHING = tiltvp.TiltEstimator(paper_camera())(np.full((480, 640), 90, np.uint8))
"""The estimate of an image without an edge."""


def test_attitudes_come_back_as_the_tilts_they_were(tmp_path: Path) -> None:
    path = tmp_path / "answer.mcap"
    times = [1_700_000_000.25, 1_700_000_000.5, 1_700_000_000.75, 1_700_000_001.0, 1_700_000_001.25]
    assert write_tilts(path, times, LEANS, frame="robot") == 5
    found = messages(path)
    assert [topic for topic, _, _ in found] == [TILT_TOPIC] * 5
    for time_s, lean, (_, recorded_ns, message) in zip(times, LEANS, found, strict=True):
        assert recorded_ns == round(1e9 * time_s)
        assert 10**9 * message.header.stamp.sec + message.header.stamp.nanosec == recorded_ns
        assert message.header.frame_id == "robot"
        world_from_robot = rotation_of(message.orientation)
        # The ground normal, seen by the robot, is the world's z axis.
        np.testing.assert_allclose(world_from_robot[2], lean.normal, atol=1e-12)
        # Of the attitude Rz(yaw) Ry(pitch) Rx(roll) the yaw is 0.
        assert math.atan2(world_from_robot[1, 0], world_from_robot[0, 0]) == pytest.approx(0.0, abs=1e-12)
        assert message.angular_velocity_covariance[0] == message.linear_acceleration_covariance[0] == -1.0
    forward, left = (rotation_of(found[k][2].orientation) for k in (1, 2))
    assert forward[2, 0] < 0.0  # nose down: the robot's front points below the horizon
    assert left[2, 1] < 0.0  # and its left side


@pytest.mark.parametrize("lean", LEANS)
def test_covariance_is_that_of_the_attitude(lean: Lean) -> None:
    """Of normals that are drawn in the tangent plane, the smallest turn to each, in the world's axes, has it."""
    world_from_robot, covariance = attitude(lean)
    assert covariance[2, 2] == YAW_VARIANCE_RAD2
    np.testing.assert_array_equal(covariance[2, :2], 0.0)
    draws = np.random.default_rng(5).multivariate_normal((0.0, 0.0), lean.covariance_rad2, 20_000)
    steps = np.column_stack([draws, np.zeros(len(draws))]) @ leaning_from_upright(lean.normal).T
    turns = np.cross(steps, lean.normal) @ world_from_robot.T
    # 20,000 draws: four standard deviations of a variance are 4 %.
    np.testing.assert_allclose(np.cov(turns.T)[:2, :2], covariance[:2, :2], atol=4e-7)
    np.testing.assert_allclose(turns[:, 2], 0.0, atol=1e-12)
    # And the turned robot sees the drawn normal.
    turn, step = turns[0], steps[0]
    seen = (world_from_robot + np.cross(np.eye(3), turn) @ world_from_robot)[2]
    np.testing.assert_allclose(seen, lean.normal + step, atol=1e-7)


def test_frames_without_a_tilt_have_no_message(tmp_path: Path) -> None:
    path = tmp_path / "a.tum"
    assert write_tilts(path, [0.0, 0.5, 1.0], [LEANS[1], None, NOTHING]) == 1
    comment, line = path.read_text().splitlines()
    assert comment.startswith("# time_s")
    assert "orientation alone" in comment
    np.testing.assert_allclose(
        [float(word) for word in line.split()], [0, 0, 0, 0, 0, math.sin(0.05), 0, math.cos(0.05)], atol=1e-9
    )
    empty = tmp_path / "empty.mcap"
    assert write_tilts(empty, [0.0], [None]) == 0
    assert messages(empty) == []


def test_what_cannot_be_written_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InvalidInputError, match=r"expected \.mcap or \.tum"):
        write_tilts(tmp_path / "a.bag", [0.0], [LEANS[0]])
    with pytest.raises(InvalidInputError, match=r"times_s\[1\] = -1.0"):
        write_tilts(tmp_path / "a.mcap", [0.0, -1.0], LEANS[:2])
    with pytest.raises(InvalidInputError, match="one for each tilt"):
        write_tilts(tmp_path / "a.mcap", [0.0], LEANS[:2])
    (tmp_path / "folder.mcap").mkdir()
    with pytest.raises(OutputError, match="is a folder"):
        write_tilts(tmp_path / "folder.mcap", [0.0], [LEANS[0]])
    monkeypatch.setitem(__import__("sys").modules, "rosbags.rosbag2", None)
    with pytest.raises(MissingExtraError, match=r"tiltvp\[bags\]"):
        write_tilts(tmp_path / "a.mcap", [0.0], [LEANS[0]])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder.mcap"]


def test_nothing_is_left_where_writing_fails(tmp_path: Path) -> None:
    class Odd(Lean):
        @property
        def roll_rad(self) -> float:  # type: ignore[override]
            raise RuntimeError("late")

        @roll_rad.setter
        def roll_rad(self, _: float) -> None: ...

    path = tmp_path / "a.mcap"
    write_tilts(path, [0.0], [LEANS[0]])
    before = path.read_bytes()
    with pytest.raises(RuntimeError, match="late"):
        write_tilts(path, [0.0, 1.0], [LEANS[0], Odd(0.1, 0.0)])
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


TURN = read_rotation("forward")
CAMERA = Camera.equidistant(width=64, height=48, focal_px=20.0, cx=31.5, cy=23.5)


@pytest.mark.parametrize("ending", [".mcap", ".urdf", ".yaml", ".kalibr.yaml"])
def test_a_mounting_comes_back_from_its_file(tmp_path: Path, ending: str) -> None:
    drive = simulate_drive("alternating", seed=4)
    whole = tiltvp.calibrate(drive.odometry, drive.bearings, wheel_base_m=0.4, start=(0.2, 0.0, 0.0))
    e, lean = whole.mounting, np.diag([4e-6, 1e-6])
    path = tmp_path / f"camera{ending}"
    robot = Robot(CAMERA, TURN, covariance_rad2=lean)
    Extrinsics.of(whole, robot, height_m=0.3).transform().write(path)
    c, s = math.cos(e.yaw_rad), math.sin(e.yaw_rad)
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ TURN
    if ending == ".yaml":
        tree = yaml.safe_load(path.read_text())
        np.testing.assert_allclose(
            np.array(tree["parent_from_child"])[:3], np.column_stack([rotation, [e.x_m, e.y_m, 0.3]]), atol=1e-6
        )
        assert tree["not_known"] == []
        assert tree["sigma"]["yaw"] == pytest.approx(math.sqrt(e.covariance_xy_yaw[2, 2]), abs=1e-6)
        covariance = np.array(tree["covariance"])
        assert tree["covariance_axes"] == ["x", "y", "roll", "pitch", "yaw"]
        np.testing.assert_allclose(covariance[:2, 4], e.covariance_xy_yaw[:2, 2], rtol=1e-5)
        np.testing.assert_allclose(np.trace(covariance[2:4, 2:4]), np.trace(lean), rtol=1e-5)
    elif ending == ".kalibr.yaml":
        camera_from_robot = np.array(yaml.safe_load(path.read_text())["cam0"]["T_cam_imu"])
        robot_from_camera = np.linalg.inv(camera_from_robot)
        np.testing.assert_allclose(robot_from_camera[:3, :3], rotation, atol=1e-8)
        np.testing.assert_allclose(robot_from_camera[:3, 3], [e.x_m, e.y_m, 0.3], atol=1e-8)
    elif ending == ".urdf":
        joint = ET.parse(path).getroot().find("joint")
        assert joint is not None
        origin, child = joint.find("origin"), joint.find("child")
        assert origin is not None
        assert child is not None
        assert child.attrib == {"link": "camera_optical"}
        assert [float(word) for word in origin.attrib["xyz"].split()] == pytest.approx([e.x_m, e.y_m, 0.3], abs=1e-6)
        roll, pitch, yaw = (float(word) for word in origin.attrib["rpy"].split())
        np.testing.assert_allclose(turned(roll, pitch, yaw), rotation, atol=2e-6)
    else:
        (_, _, static), (_, _, note) = messages(path)
        (move,) = static.transforms
        assert (move.header.frame_id, move.child_frame_id) == ("base_link", "camera_optical")
        np.testing.assert_allclose(rotation_of(move.transform.rotation), rotation, atol=1e-12)
        assert (move.transform.translation.x, move.transform.translation.z) == (e.x_m, 0.3)
        assert yaml.safe_load(note.data)["child_frame"] == "camera_optical"


def turned(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a), math.sin(a)) for a in (roll, pitch, yaw))
    return (
        np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    )


@pytest.mark.parametrize("angles", [(0.1, -0.2, 3.0), (0.0, math.pi / 2, 0.0), (0.5, -math.pi / 2, 0.3)])
def test_roll_pitch_yaw_are_those_of_urdf(angles: tuple[float, float, float]) -> None:
    rotation = turned(*angles)
    found = StaticTransform("a", "b", np.zeros(3), rotation).roll_pitch_yaw_rad
    np.testing.assert_allclose(turned(*found), rotation, atol=1e-9)


def test_what_is_no_rotation_is_no_transform() -> None:
    for place, turn, told in (
        (np.zeros(2), np.eye(3), "three finite numbers"),
        (np.zeros(3), np.ones((3, 3)), "no rotation"),
    ):
        with pytest.raises(TiltvpError, match=told):
            StaticTransform("base_link", "camera", place, turn)


def test_what_is_not_known_is_said() -> None:
    drive = simulate_drive("paper", seed=4)
    whole = tiltvp.calibrate(drive.odometry, drive.bearings, wheel_base_m=0.4)
    transform = Extrinsics.of(whole).transform()
    assert transform.child == "camera_mount"
    for text in (transform.urdf_joint(), transform.yaml(), transform.note):
        assert "not known, and set to 0: z, roll, pitch" in text
    assert yaml.safe_load(transform.yaml())["not_known"] == ["z", "roll", "pitch"]
    assert Extrinsics.of(whole, height_m=0.2, robot_from_camera=TURN).transform().note == ""
    with pytest.raises(InvalidInputError, match="child"):
        Extrinsics.of(whole).transform(child="a; b")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three images of one lean, the last of nothing."""
    folder = tmp_path_factory.mktemp("images")
    camera = paper_camera()
    camera.save(folder / "camera.toml")
    image = render_room(camera, seed=2, alpha_rad=0.1, beta_rad=0.5, samples=2).gray
    for name, gray in (("a", image), ("b", image), ("c", np.full_like(image, 90))):
        tiltvp.images.write_image(folder / f"{name}.png", gray)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("more", [[], ["--filter", "--sigma-max-deg", "10"]], ids=["each", "filter"])
def test_the_command_writes_the_attitudes_of_its_table(
    folder: Path, tmp_path: Path, more: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    out, table = tmp_path / "answer.mcap", tmp_path / "answer.csv"
    images = [str(folder / f"{name}.png") for name in "abc"]
    words = ["tilt", *images, "--camera", str(folder / "camera.toml"), *more]
    assert main([*words, "--out", str(table)]) == 0
    capsys.readouterr()
    assert main([*words, "--out", str(out), "--frame-rate", "5"]) == 0
    said = capsys.readouterr().out.splitlines()[-1]
    which = "filtered_" if more else ""
    rows = list(csv.DictReader(table.read_text().splitlines()))[: 3 if more else 2]
    found = messages(out)
    assert [time for _, time, _ in found] == [0, 200_000_000, 400_000_000][: len(rows)]
    for row, (_, _, message) in zip(rows, found, strict=True):
        normal = [float(row[f"{which}normal_{axis}"]) for axis in "xyz"]
        np.testing.assert_allclose(rotation_of(message.orientation)[2], normal, atol=1e-12)
        trace = sum(float(row[f"{which}covariance_{axis}_rad2"]) for axis in ("xx", "yy"))
        assert message.orientation_covariance[0] + message.orientation_covariance[4] == pytest.approx(trace)
    if more:
        assert said == f"{out}: 3 filtered tilts as sensor_msgs/Imu on {TILT_TOPIC}, yaw 0, at 5 frames a second from 0"
    else:
        assert said.endswith("yaw 0, at 5 frames a second from 0; 1 frame without one left out")


PAGE = (Path(__file__).parents[1] / "docs/outputs.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_python_of_the_page_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    programs = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    for program in programs:
        exec(compile(program, "outputs.md", "exec"), {})
    assert capsys.readouterr().out.strip() == programs[-1].split(" # ")[-1].strip()
    assert len(messages(tmp_path / "answer.mcap")) == 2


def test_the_command_says_which_endings_there_are(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tilt", str(folder), "--camera", str(folder / "camera.toml"), "--out", "a.bag"]) == 2
    assert ".parquet, .mcap, .tum" in capsys.readouterr().err


def test_times_that_no_stamp_can_be_are_refused_before_any_work(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(folder, tmp_path / "drive")
    files = sorted(tmp_path.glob("drive/*.png"))
    rows = "".join(f"{file.name},{number - 1}\n" for number, file in enumerate(files))
    (tmp_path / "drive/frames.csv").write_text(f"file,time_s\n{rows}")
    words = [
        "tilt",
        str(tmp_path / "drive"),
        "--camera",
        str(folder / "camera.toml"),
        "--overlay",
        str(tmp_path / "seen"),
    ]
    assert main([*words, "--out", str(tmp_path / "a.mcap")]) == 2
    assert "a.mcap: times_s[0] = -1.0, expected seconds from 0 to 2^31, or --frame-rate\n" in capsys.readouterr().err
    assert os.listdir(tmp_path) == ["drive"]
    assert main([*words, "--out", str(tmp_path / "a.mcap"), "--frame-rate", "5"]) == 0


@pytest.mark.parametrize("ending", TRANSFORM_ENDINGS)
def test_a_transform_is_read_as_the_mounting(ending: str, tmp_path: Path) -> None:
    rotation = about_vertical(0.3) @ read_rotation("forward")
    place = np.array([0.1, 0.2, 0.3])
    known, not_known = tmp_path / f"known{ending}", tmp_path / f"not_known{ending}"
    StaticTransform("robot", "eye", place, rotation).write(known)
    assert mounting_of(str(known)) == pytest.approx(rotation, abs=1e-5)
    StaticTransform("robot", "camera_mount", place, rotation, missing=("z", "roll", "pitch")).write(not_known)
    with pytest.raises(CalibrationError, match="roll and pitch not known, expected a rotation that is known"):
        mounting_of(str(not_known))
