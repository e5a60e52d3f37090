"""Motions that recordings tell."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from recordings import KINDS, START_S, Bag
from tiltvp.errors import InvalidInputError
from tiltvp.streams import Odometry, Wheels, frame_motions, open_frames, read_odometry


def test_headings_of_robots_that_lean_are_where_their_x_axis_points(tmp_path: Path) -> None:
    made = Bag("mcap")
    quaternions = np.array([(0.0, 0.0, 0.0, 1.0), (0.3, -0.2, 0.4, 0.8), (-0.2, 0.35, 0.5, 0.7)])
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    headings = []
    for k, (x, y, z, w) in enumerate(quaternions.tolist()):
        made.odometry(START_S + 0.1 * k, 0.0, 0.0, 0.0)
        turn = made.rows[-1][3].pose.pose.orientation
        turn.x, turn.y, turn.z, turn.w = x, y, z, w
        angle = 2 * math.atan2(math.hypot(x, y, z), w)
        axis = np.array([x, y, z]) / (math.hypot(x, y, z) or 1.0)
        ahead = cv2.Rodrigues(angle * axis)[0][:, 0]
        headings.append(math.atan2(ahead[1], ahead[0]))
    found = read_odometry(made.write(tmp_path)).yaw_rad
    assert found == pytest.approx(headings, abs=1e-9)


@pytest.mark.parametrize("about", ["z", "y"])
def test_poses_in_the_axes_of_a_camera_are_refused(about: str, tmp_path: Path) -> None:
    """As of visual odometry, whose world is its first camera: y is down there, and headings jump by half a turn."""
    made = Bag("mcap")
    for k in range(40):
        made.odometry(START_S + 0.1 * k, 0.0, 0.0, 0.1 * k)
        turn = made.rows[-1][3].pose.pose.orientation
        turn.y, turn.z = (turn.z, 0.0) if about == "y" else (0.0, turn.z)
    bag = made.write(tmp_path)
    if about == "z":
        assert read_odometry(bag).yaw_rad[-1] == pytest.approx(3.9)
        return
    with pytest.raises(
        InvalidInputError, match=r"lean by 1[78]\d degrees more .*expected those of a level frame, z up"
    ):
        read_odometry(bag)


def test_odometry_of_velocities_alone_is_no_robot_that_stands(tmp_path: Path) -> None:
    for speed_mps in (0.5, 0.01):
        made = Bag("mcap")
        for k in range(20):
            made.odometry(START_S + 0.1 * k, 0.0, 0.0, 0.0)
            made.rows[-1][3].twist.twist.linear.x = speed_mps if k > 5 else 0.0
        (tmp_path / f"{speed_mps}").mkdir()
        bag = made.write(tmp_path / f"{speed_mps}")
        if speed_mps > 0.1:
            with pytest.raises(InvalidInputError, match=r"poses that never change beside velocities of up to 0\.5 m/s"):
                read_odometry(bag)
        else:
            assert read_odometry(bag).distance_m.max() == 0.0


@pytest.mark.parametrize("anew", [(3.0, 0.0), (1.2, 0.0), (0.0, 2.0)], ids=["far", "near", "turned"])
@pytest.mark.parametrize("hz", [5.0, 20.0])
def test_poses_that_were_set_anew_are_told(hz: float, anew: tuple[float, float]) -> None:
    times = np.arange(0.0, 12.0, 1.0 / hz)
    speeds = 0.5 * np.clip(times - 1.0, 0.0, 1.0)
    ways, turns = np.cumsum(speeds) / hz, np.cumsum(np.where(times > 6.0, 0.8, 0.0)) / hz
    late = times + np.where(np.arange(len(times)) % 3 == 1, 0.5 / hz, 0.0)
    assert Odometry(late, ways, turns).jumps is None, "a robot that starts, and messages that are late"
    after = times > 8.0
    jumps = Odometry(late, ways - anew[0] * after, turns + anew[1] * after).jumps
    assert jumps is not None
    assert "1 step that no robot makes, the first after 8." in jumps


@pytest.mark.parametrize("back_s", [0.15, 2.0])
def test_images_of_a_clock_that_was_set_back_have_no_odometry(back_s: float, tmp_path: Path) -> None:
    """The robot would drive backwards where it was set back."""
    made = Bag("mcap")
    for k in range(100):
        made.odometry(START_S + 0.1 * k, 0.1 * k, 0.0, 0.0)
    for k in range(20):
        behind = back_s if k >= 12 else 0.0
        made.image("/image", START_S + 3.0 + 0.2 * k - behind, np.zeros((4, 4), np.uint8), "mono8", late_s=behind)
    bag = made.write(tmp_path)
    frames = open_frames(bag)
    if back_s < 1.0:
        assert frame_motions(frames, bag).motions[12] is not None, "messages that overtake each other"
        return
    with pytest.raises(InvalidInputError, match=r"its clock goes back from 1700000005\.200 to 1700000003\.400 s"):
        frame_motions(frames, bag)


@pytest.mark.parametrize("still", [{"left_wheel"}, {"left_wheel", "right_wheel"}], ids=["one", "both"])
def test_wheels_that_stand_beside_velocities_of_theirs_are_no_robot_that_stands(
    still: set[str], tmp_path: Path
) -> None:
    names = ["left_wheel", "right_wheel"]
    for moves in (True, False):
        made = Bag("mcap")
        for k in range(20):
            made.joints(START_S + 0.1 * k, names, [0.0 if name in still else 0.2 * k for name in names])
            made.rows[-1][3].velocity = np.array([2.0 if moves or name not in still else 0.0 for name in names])
        (tmp_path / f"{moves}").mkdir()
        bag = made.write(tmp_path / f"{moves}")
        if not moves:
            assert read_odometry(bag, wheels=Wheels(wheel_radius_m=0.1)).wheels_m is not None
            continue
        told = r"/joint_states: angles of left_wheel that never change beside velocities of up to 2 m/s or rad/s"
        with pytest.raises(InvalidInputError, match=told):
            read_odometry(bag, wheels=Wheels(wheel_radius_m=0.1))


@pytest.mark.parametrize("kind", KINDS)
def test_the_clock_of_a_simulation_begins_at_0(kind: str, tmp_path: Path) -> None:
    """Messages are written down by the clock of the wall; stamps of 0 before those of a wall's clock are none."""
    for begins_s, at_zero in ((0.0, 1), (START_S, 3)):
        made = Bag(kind)
        for k in range(50):
            stamp_s = 0.0 if k < at_zero else begins_s + 0.1 * k
            made.odometry(stamp_s, 0.01 * k, 0.0, 0.0)
            made.image("/image", stamp_s, np.zeros((4, 4), np.uint8), "mono8")
        made.rows = [(row[0], row[1], START_S + 0.1 * (k // 2), row[3]) for k, row in enumerate(made.rows)]
        folder = tmp_path / f"{begins_s:.0f}"
        folder.mkdir()
        bag = made.write(folder)
        frames = open_frames(bag)
        assert frames.times_s == pytest.approx(begins_s + 0.1 * np.arange(50))
        assert [one is None for one in frame_motions(frames, bag).motions] == [False] * 50
