"""The robot's file: what is written is read, every command reads it, and what cannot be is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tiltvp import Camera, Robot, TiltEstimator, write_image
from tiltvp.cli.options import CameraOptions, MethodOptions
from tiltvp.cli.sources import MotionOptions
from tiltvp.errors import CalibrationError, InvalidInputError
from tiltvp.rotations import levelling, read_rotation
from tiltvp.streams import Frames, Wheels

CAMERA = Camera.equidistant(width=64, height=48, focal_px=20.0, cx=31.5, cy=23.5)


def robot(**values: object) -> Robot:
    """One with everything that a file may have."""
    mask = np.ones((48, 64), dtype=bool)
    mask[40:, :20] = False
    found = Robot(
        CAMERA,
        levelling(np.array([0.02, -0.01, math.sqrt(1.0 - 0.0005)])),
        covariance_rad2=np.diag([1e-6, 2e-6]),
        mask=mask,
        wheels=Wheels(wheel_base_m=0.35, wheel_radius_m=0.05, ticks_per_turn=2048.0, joints=("a", "b")),
        topics={"images": "/camera/image_raw"},
    )
    return replace(found, **values)


def test_what_is_written_is_read(tmp_path):
    path = tmp_path / "robot.toml"
    robot().save(path)
    read = Robot.load(path)
    assert read.camera == CAMERA
    np.testing.assert_allclose(read.robot_from_camera, robot().robot_from_camera, atol=1e-15)
    np.testing.assert_array_equal(read.covariance_rad2, np.diag([1e-6, 2e-6]))
    np.testing.assert_array_equal(read.mask, robot().mask)
    assert (read.wheels, read.topics) == (robot().wheels, {"images": "/camera/image_raw"})
    assert sorted(file.name for file in tmp_path.iterdir()) == ["robot-mask.png", "robot.toml"]
    with pytest.raises(InvalidInputError, match=r"ends in '', expected \.toml"):
        robot().save(tmp_path / "robot")


def test_arrays_that_change_later_are_not_its_own():
    mask, covariance = np.ones((48, 64), dtype=bool), np.eye(2)
    made = robot(mask=mask, covariance_rad2=covariance)
    mask[:], covariance[:] = False, 0.0
    assert made.mask.all()
    np.testing.assert_array_equal(made.covariance_rad2, np.eye(2))


def test_where_the_camera_is_comes_back_too(tmp_path):
    path = tmp_path / "robot.toml"
    covariance = np.diag([1e-6, 2e-6, 3e-6, 4e-6, 5e-6])
    robot(place_m=(0.1, 0.02), height_m=0.4, covariance_rad2=None, covariance=covariance).save(path)
    read = Robot.load(path)
    assert (read.place_m, read.height_m) == ((0.1, 0.02), 0.4)
    np.testing.assert_array_equal(read.covariance, covariance)
    np.testing.assert_array_equal(read.covariance_rad2, np.diag([3e-6, 4e-6]))
    assert "covariance_rad2" not in path.read_text()


def test_numbers_of_numpy_are_numbers(tmp_path):
    half, path = np.float32(0.5), tmp_path / "robot.toml"
    wheels = Wheels(wheel_base_m=half, ticks_per_turn=np.int64(100))
    robot(place_m=np.array([half, 0.25]), height_m=half, covariance_rad2=[[1e-6, 0], [0, 1e-6]], wheels=wheels).save(
        path
    )
    read = Robot.load(path)
    assert (read.place_m, read.height_m, read.wheels) == ((0.5, 0.25), 0.5, wheels)
    np.testing.assert_array_equal(read.covariance_rad2, np.diag([1e-6, 1e-6]))


def test_the_topic_of_the_joints_counts_where_the_wheels_radius_is_known(tmp_path):
    (tmp_path / "a.mcap").touch()
    frames = Frames()
    frames.recording = tmp_path / "a.mcap"
    topics = {"joints": "/joint_states", "odometry": "/odom"}
    for known, expected in ((Wheels(wheel_radius_m=0.05), "/joint_states"), (Wheels(), "/odom")):
        of = robot(wheels=known, topics=topics)
        assert MotionOptions().of_robot(of, frames).odometry_topic == expected
        assert MotionOptions(odometry=tmp_path / "odometry.csv").of_robot(of, frames).odometry_topic is None
    assert MotionOptions().of_robot(robot(topics={"joints": "/joint_states"}), frames).odometry_topic == "/joint_states"


def test_a_robot_of_which_little_is_known(tmp_path):
    path = tmp_path / "robot.toml"
    Robot(CAMERA, np.eye(3)).save(path)
    read = Robot.load(path)
    assert (read.mask, read.covariance_rad2, read.wheels, read.topics) == (None, None, Wheels(), {})
    assert [file.name for file in tmp_path.iterdir()] == ["robot.toml"]


def test_it_is_a_calibration_and_a_mounting_too(tmp_path):
    path = tmp_path / "robot.toml"
    robot().save(path)
    assert Camera.load(path) == CAMERA
    np.testing.assert_allclose(read_rotation(path), robot().robot_from_camera, atol=1e-15)


def test_the_mask_of_a_file_that_was_renamed_is_the_one_that_it_names(tmp_path):
    robot().save(tmp_path / "robot.toml")
    (tmp_path / "robot.toml").rename(tmp_path / "old.toml")
    write_image(tmp_path / "old-mask.png", np.zeros((48, 64), dtype=np.uint8))
    taken = CameraOptions(camera=tmp_path / "old.toml").complete(MethodOptions())
    assert taken.mask == tmp_path / "robot-mask.png"


def test_its_estimator_has_its_mounting_and_its_mask():
    made = robot().estimator(method="segments")
    assert made == TiltEstimator(
        CAMERA, method="segments", robot_from_camera=robot().robot_from_camera, mask=robot().mask
    )


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('format = "tiltvp-robot"', 'format = "tiltvp-camera"', "unknown key"),
        ("version = 1", "version = 2", "version 2"),
        ("[mounting]", "[mountings]", "unknown key 'mountings'"),
        ("wheel_base_m = 0.35", "wheel_base_m = -1.0", "wheel_base_m = -1.0"),
        ("wheel_base_m = 0.35", "wheel_bas_m = 0.35", "unknown key 'wheel_bas_m'"),
        ('mask = "robot-mask.png"', 'mask = "../robot-mask.png"', "beside this file"),
        ("[topics]\nimages", "[topics]\nimage", "unknown key 'image'"),
    ],
)
def test_what_cannot_be_is_refused(tmp_path, old, new, told):
    path = tmp_path / "robot.toml"
    robot().save(path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(CalibrationError, match=told):
        Robot.load(path)


@pytest.mark.parametrize(
    "values",
    [
        {"robot_from_camera": np.diag([1.0, 1.0, -1.0])},
        {"robot_from_camera": "up"},
        {"mask": np.ones((4, 4), dtype=bool)},
        {"mask": np.full((48, 64), 255, dtype=np.uint8)},
        {"covariance_rad2": np.diag([1.0, -1.0])},
        {"covariance_rad2": np.full((2, 2), math.nan)},
        {"topics": {"image": "/x"}},
        {"topics": {"images": 3}},
        {"place_m": (0.1, math.nan)},
        {"place_m": ("here", 0.1)},
        {"height_m": "0.4"},
        {"covariance_rad2": "none"},
        {"camera": "camera.toml"},
        {"covariance": np.eye(5)},
        {"place_m": (0.1, 0.2), "covariance": np.eye(4)},
    ],
)
def test_a_robot_that_cannot_be(values):
    with pytest.raises((InvalidInputError, CalibrationError), match=r"expected|must|without"):
        robot(**values)
