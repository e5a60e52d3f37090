"""Recordings of drives: the same bytes, sensors that agree with the truth, and frames that show it."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

import tiltvp
from tiltvp.cli import main
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.motion import RobotMotion
from tiltvp.lab.datasets.panoramas import paper_camera
from tiltvp.lab.datasets.recording import LEGS, WHEEL_RADIUS_M, RecordedDrive
from tiltvp.synth import Drive, Room

LEGS_SHORT = ((0.2, 0.0), (0.0, 0.5))
MOUNTING = (math.radians(2.0), math.radians(-1.0))


@pytest.fixture(scope="module")
def room() -> Room:
    return Room("office", 1, light_spacing_m=0.6)


@pytest.fixture(scope="module")
def drive(room: Room) -> RecordedDrive:
    return RecordedDrive(
        room, paper_camera(), legs=LEGS_SHORT, mounting_rad=MOUNTING, floor_slope_rad=(0.02, 0.5), camera_delay_s=0.03,
        samples=1, seed=5,
    )  # fmt: skip


@pytest.fixture(scope="module")
def path(drive: RecordedDrive, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recording") / "drive.mcap"
    drive.write(path, threads=2)
    return path


@pytest.fixture(scope="module")
def topics(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """What is on each topic: stamps of the recorder, and messages."""
    found = defaultdict(list)
    with AnyReader([path]) as reader:
        for connection, time, raw in reader.messages():
            found[connection.topic].append((time, reader.deserialize(raw, connection.msgtype)))
    return found


@pytest.mark.slow
def test_the_same_arguments_give_the_same_bytes(drive: RecordedDrive, path: Path, room: Room, tmp_path: Path) -> None:
    again = RecordedDrive(
        room, paper_camera(), legs=LEGS_SHORT, mounting_rad=MOUNTING, floor_slope_rad=(0.02, 0.5), camera_delay_s=0.03,
        samples=1, seed=5,
    )  # fmt: skip
    other = tmp_path / "other_name.mcap"
    again.write(other, threads=1)
    assert other.read_bytes() == path.read_bytes()


def test_the_python_of_the_guide_runs(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(path.parent)
    guide = (Path(__file__).parents[1] / "docs/recordings.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {"tiltvp": tiltvp}
    for program in re.findall(r"^```python\n(.*?)^```$", guide, re.MULTILINE | re.DOTALL):
        exec(compile(program, "recordings.md", "exec"), names)
    assert names["odometry"].between(*names["frames"].times_s[:2]) is not None


def test_frames_are_in_step_with_the_truth(drive: RecordedDrive, topics: dict[str, list[tuple[int, Any]]]) -> None:
    images, infos, tilts = (topics[name] for name in ("/camera/image_raw", "/camera/camera_info", "/truth/tilt"))
    assert len(images) == len(infos) == len(tilts) == len(drive)
    stamps = [10**9 * image.header.stamp.sec + image.header.stamp.nanosec for _, image in images]
    assert stamps == [time for time, _ in images] == [time for time, _ in tilts] == [time for time, _ in infos]
    assert set(np.diff(stamps)) == {200_000_000}
    poses = dict(topics["/truth/pose"])
    for stamp, (_, tilt) in zip(stamps, tilts, strict=True):
        q = poses[stamp - 30_000_000].pose.orientation
        upward = (2 * (q.x * q.z - q.y * q.w), 2 * (q.y * q.z + q.x * q.w), 1 - 2 * (q.x**2 + q.y**2))
        np.testing.assert_allclose((tilt.vector.x, tilt.vector.y, tilt.vector.z), upward, atol=1e-9)
    info = infos[0][1]
    assert (info.distortion_model, info.width, info.height) == ("equidistant", 640, 480)
    assert info.k[0] == paper_camera().parameters["focal_px"]


def test_frames_show_the_lean_that_mounting_and_floor_make(
    drive: RecordedDrive, topics: dict[str, list[tuple[int, Any]]]
) -> None:
    """Another renderer shows the same from the robot's pose with the true mounting, and less of it with the nominal."""
    inside = drive.camera.valid_mask()
    for frame in (0, len(drive) - 1):
        _, message = topics["/camera/image_raw"][frame]
        shown = message.data.reshape(message.height, message.width)
        pose, (alpha, beta) = drive._stands[frame]
        np.testing.assert_allclose(tiltvp.normal_from_alpha_beta(alpha, beta), drive.tilts[frame], atol=1e-12)
        c, s = math.cos(pose[2]), math.sin(pose[2])
        x, y, _, height = drive.mount

        likeness = []
        for mounting in (drive.robot_from_mounted_camera, drive.nominal):
            seen = drive.room.render(
                drive.camera, pose=(pose[0] + c * x - s * y, pose[1] + s * x + c * y, pose[2]), alpha_rad=alpha,
                beta_rad=beta, robot_from_camera=mounting, camera_height_m=height, samples=1,
            ).gray  # fmt: skip
            likeness.append(np.corrcoef(shown[inside], seen[inside])[0, 1])
        true, nominal = likeness
        assert 1.0 - true < 0.25 * (1.0 - nominal)


def test_wheels_and_inertial_sensor_tell_of_the_motion(topics: dict[str, list[tuple[int, Any]]]) -> None:
    turned = np.array([message.position for _, message in topics["/joint_states"]])
    left, right = WHEEL_RADIUS_M * (turned[-1] - turned[0])
    # Encoders: a variance of 1e-5 m times 0.3 m of way, so 2 mm; five of these.
    assert 0.5 * (left + right) == pytest.approx(0.2, abs=0.01)
    assert (right - left) / 0.35 == pytest.approx(0.5, abs=0.05)
    imu = [message for _, message in topics["/imu/data_raw"]]
    rates = np.array([message.angular_velocity.z for message in imu])
    assert {message.orientation_covariance[0] for message in imu} == {-1.0}
    # A bias of 0.2 deg/s and scales to 0.5 %: five standard deviations over two seconds.
    assert rates.sum() / 100.0 == pytest.approx(0.5, abs=0.05)
    at_rest = np.array([[getattr(message.linear_acceleration, axis) for axis in "xyz"] for message in imu[:25]])
    tilt = topics["/truth/tilt"][0][1].vector
    # Specific force at rest points up: the ground normal times gravity, to 5 mg of bias and 0.5 % of scale.
    np.testing.assert_allclose(at_rest.mean(axis=0), 9.80665 * np.array([tilt.x, tilt.y, tilt.z]), atol=0.5)


def test_transforms_are_nominal_and_the_truth_is_not(topics: dict[str, list[tuple[int, Any]]]) -> None:
    (_, static), (_, true) = topics["/tf_static"][0], topics["/truth/mounting"][0]
    camera = static.transforms[0]
    assert (camera.header.frame_id, camera.child_frame_id) == ("base_link", "camera_optical")
    assert camera.transform.rotation.w == pytest.approx(1.0)
    q = true.transform.rotation
    assert 2.0 * math.asin(math.hypot(q.x, q.y)) == pytest.approx(math.hypot(*MOUNTING), rel=1e-3)
    assert "slope_deg = 1.1459" in topics["/truth/description"][0][1].data


def test_the_motion_is_that_of_the_legs(room: Room) -> None:
    planned = Drive(room, camera=paper_camera(), legs=LEGS, lighting=0.0)
    start = tuple(planned.poses[0].tolist())
    motion = RobotMotion(start, np.array(LEGS), 0.35, 0.03, (0.02, 1.0), 3)
    times = np.linspace(0.0, motion.duration_s, 4001)
    places = motion.places(times)
    np.testing.assert_allclose(places[-1, :2], planned.poses[-1, :2], atol=1e-9)
    assert math.remainder(places[-1, 2] - planned.poses[-1, 2], 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    attitudes = motion.world_from_robot(times)
    np.testing.assert_allclose(
        np.swapaxes(attitudes, 1, 2) @ attitudes, np.broadcast_to(np.eye(3), attitudes.shape), atol=1e-12
    )
    # Bumps lean the robot by at most 0.03 against a floor of 0.02.
    assert np.arccos(attitudes[:, 2, 2]).max() <= 0.05
    # A turn in place shows the floor from all sides.
    early = times < 5.0
    assert np.ptp(attitudes[early][:, 2, 0]) > 0.03
    rates, forces = motion.inertia(times, (0.1, 0.0))
    turned = np.sum(rates[:, 2]) * (times[1] - times[0])
    assert turned == pytest.approx(places[-1, 2] - places[0, 2], abs=0.01)
    assert np.linalg.norm(forces, axis=1).max() < 9.80665 + 3.0


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("mounting_rad", (0.6, 0.0)),
        ("floor_slope_rad", (-0.1, 0.0)),
        ("bumps_max_rad", math.nan),
        ("camera_delay_s", 2.0),
    ],
)
def test_what_cannot_be_is_refused(room: Room, name: str, value: Any) -> None:
    with pytest.raises(InvalidInputError, match=name):
        RecordedDrive(room, paper_camera(), **{name: value})


@pytest.mark.slow
def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, camera = tmp_path / "drive.mcap", tmp_path / "camera.toml"
    words = ["lab", "drive", "--out", str(out), "--legs", "0.05,0", "--samples", "1", "--compressed"]
    assert main([*words, "--camera-out", str(camera), "--mounting-deg", "1", "-0.5", "--resolution-scale", "0.25"]) == 0
    assert "frames; wheels of 0.05 m, 0.35 m apart" in capsys.readouterr().out
    assert tiltvp.Camera.load(camera).width == 160
    with AnyReader([out]) as reader:
        assert "/camera/image_raw/compressed" in reader.topics
    assert main(["lab", "drive", "--out", str(tmp_path / "drive.bag")]) == 2
    assert "ends in .mcap" in capsys.readouterr().err


def test_a_frame_from_its_own_pose_is_the_frame(room: Room) -> None:
    drive = Drive(room, camera=paper_camera(), frames=3, bumps_max_rad=0.05, samples=1)
    alpha, beta = drive.tilts[2]
    again = drive.render_at(2, pose=drive.poses[2], alpha_rad=alpha, beta_rad=beta)
    assert (again.bgr != drive.render(2).bgr).mean() < 1e-3  # The lean went through two angles.
    with pytest.raises(InvalidInputError, match="a place in the room"):
        drive.render_at(2, pose=(100.0, 0.0, 0.0))
