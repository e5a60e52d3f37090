"""`tiltvp setup` and `tiltvp mount` on a rendered turn in place: what was wrong with the robot is found."""

from __future__ import annotations

import json
import math
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from tiltvp import Camera, Robot, check_setup, check_turns, find_setup, frame_delay, tilt_error_rad
from tiltvp.cli import main
from tiltvp.errors import InvalidInputError
from tiltvp.images import read_image, write_image
from tiltvp.robot_setup import spread
from tiltvp.rotations import about_vertical, levelling
from tiltvp.setup_check import opposite_direction
from tiltvp.streams import NamedImages, Odometry, Wheels, open_frames
from tiltvp.streams.odometry import Motion
from tiltvp.synth import Room
from tiltvp.turn_errors import turn_error
from tiltvp.turning import small_camera, telling_frames, turn_axis

pytestmark = pytest.mark.slow

CAMERA = Camera.equidistant(width=240, height=240, focal_px=72.0, cx=119.5, cy=119.5, max_theta_rad=math.radians(92))
COUNT = 26
STEP = 2.0 * math.pi / 24
UP = np.array([math.sin(math.radians(1.5)), 0.0, math.cos(math.radians(1.5))])
"""Where the ceiling is by a mounting that is wrongly taken for upright."""


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """A folder of frames of a robot that turns in place, with a mounting that is 1.5 degrees off; and its odometry."""
    folder = tmp_path_factory.mktemp("drive")
    room = Room("office", 3)
    x, y, yaw = room.free_poses(1, 3)[0]
    (folder / "frames").mkdir()
    for k in range(COUNT):
        pose = (x, y, yaw + k * STEP)
        view = room.render(CAMERA, pose=pose, robot_from_camera=levelling(UP), samples=1, seed=k)
        write_image(folder / "frames" / f"{k:02d}.png", view.gray)
    rows = "\n".join(f"{STEP if k else 0.0},0.0" for k in range(COUNT))
    (folder / "odometry.csv").write_text(f"yaw_rad,distance_m\n{rows}\n")
    CAMERA.save(folder / "camera.toml")
    return folder


def run(*words: object) -> int:
    return main([str(word) for word in words])


def options(drive):
    return ["--camera", drive / "camera.toml", "--odometry", drive / "odometry.csv"]


def test_setup_writes_a_robot_that_stands_upright(drive, tmp_path, capsys):
    out = tmp_path / "robot.toml"
    code = run("setup", drive / "frames", *options(drive), "--out", out, "--picture", tmp_path / "found.png")
    told = capsys.readouterr()
    assert code == 0, told
    assert "images turn as told" in told.out
    robot = Robot.load(out)
    assert math.degrees(tilt_error_rad(robot.robot_from_camera @ UP, np.array([0.0, 0.0, 1.0]))) < 0.2
    assert robot.covariance_rad2 is not None
    assert (tmp_path / "found.png").stat().st_size > 1000
    # Other commands take it: the robot's lean is the floor's now.
    answer = tmp_path / "tilts.json"
    assert run("tilt", drive / "frames", "--camera", out, "--method", "segments", "--out", answer) == 0
    alphas = [row["alpha_rad"] for row in json.loads(answer.read_text())]
    assert math.degrees(float(np.median(alphas))) < 0.4


def test_a_picture_that_cannot_be_is_refused_before_any_work(drive, tmp_path, capsys):
    words = ("setup", drive / "frames", *options(drive), "--out", tmp_path / "robot.toml", "--picture", "found.xyz")
    assert run(*words) == 2
    told = capsys.readouterr()
    assert (told.out, "--picture found.xyz: ends in '.xyz', expected one of .png, .jpg, .jpeg" in told.err) == (
        "",
        True,
    )


def test_a_robots_file_is_set_up_again_and_loses_nothing(drive, tmp_path, capsys):
    wheels = tmp_path / "wheels.csv"
    rows = "\n".join(f"{-0.175 * step},{0.175 * step}" for step in [0.0] + [STEP] * (COUNT - 1))
    wheels.write_text(f"left_m,right_m\n{rows}\n")
    covariance = np.diag([1e-6, 2e-6, 3e-2, 4e-2, 5e-6])
    covariance[0, 4] = covariance[4, 0] = 1e-7
    mask = np.ones((240, 240), np.bool_)
    mask[:9, :9] = False
    before = Robot(
        CAMERA, about_vertical(0.4), covariance=covariance, mask=mask, place_m=(0.1, -0.2), height_m=0.5,
        wheels=Wheels(wheel_base_m=0.35, wheel_radius_m=0.05), topics={"images": "/image", "inertial": "/imu"},
    )  # fmt: skip
    out = tmp_path / "robot.toml"
    before.save(out)
    words = ("setup", drive / "frames", "--camera", out, "--odometry", wheels, "--out", out, "--overwrite")
    assert run(*words) == 0, capsys.readouterr()
    after = Robot.load(out)
    assert (after.place_m, after.height_m, after.topics) == (before.place_m, before.height_m, before.topics)
    assert (after.wheels, after.mask.tolist()) == (before.wheels, mask.tolist())
    up = after.robot_from_camera @ UP
    assert math.degrees(tilt_error_rad(up, np.array([0.0, 0.0, 1.0]))) < 0.2
    # The yaw stays, with its errors; roll and pitch are known anew.
    turned = after.robot_from_camera[:, 1]
    assert math.atan2(-turned[0], turned[1]) == pytest.approx(0.4, abs=0.01)
    assert after.covariance[0, 4] == 1e-7
    assert 0.0 < after.covariance[2, 2] < 1e-4
    capsys.readouterr()
    assert run(*words, "--robot-from-camera", "up") == 0
    assert "rim: a mask was given\nbody: a mask was given\n" in capsys.readouterr().out
    assert (Robot.load(out).covariance, Robot.load(out).place_m) == (None, before.place_m)


def test_what_a_drive_does_not_tell_of_a_robot_stays(drive, tmp_path):
    out, lean = tmp_path / "robot.toml", np.diag([1e-5, 2e-5])
    Robot(CAMERA, levelling(UP), covariance_rad2=lean).save(out)
    assert run("setup", drive / "frames", "--camera", out, "--out", out, "--overwrite") == 1
    after = Robot.load(out)
    np.testing.assert_array_equal(after.covariance_rad2, lean)
    np.testing.assert_allclose(after.robot_from_camera, levelling(UP), atol=1e-12)


def test_setup_finds_that_images_are_mirrored(drive, tmp_path, capsys):
    mirrored = tmp_path / "frames"
    mirrored.mkdir()
    for file in (drive / "frames").iterdir():
        write_image(mirrored / file.name, np.ascontiguousarray(read_image(file)[:, ::-1]))
    code = run("setup", mirrored, *options(drive), "--out", tmp_path / "robot.toml")
    assert code == 1
    assert "the image is mirrored, or left and right" in capsys.readouterr().err


@pytest.mark.parametrize("up", ["+z", "-z"])
def test_turns_tell_which_way_is_up_where_looks_mislead(drive, monkeypatch, up):
    frames = open_frames(str(drive / "frames"))
    sense = 1.0 if up == "+z" else -1.0
    motions = [Motion(sense * STEP if k else 0.0, 0.0) for k in range(COUNT)]
    axis = turn_axis([frame.read() for frame in frames], [sense * STEP * k for k in range(COUNT)], CAMERA)
    assert axis
    assert axis.best == up
    assert axis.check(up)
    assert axis.check(opposite_direction(up)).reversed
    looks = check_setup([frame.read() for frame in open_frames(str(drive / "frames"))][::5], CAMERA)
    shares = {**dict.fromkeys(looks.probabilities, 0.02), opposite_direction(up): 0.6, up: 0.3, "+x": 0.06}
    monkeypatch.setattr("tiltvp.robot_setup.check_setup", lambda *_, **__: replace(looks, probabilities=shares))
    found = find_setup(frames, CAMERA, motions)
    assert found.direction.best == up
    assert found.direction.turns_about == up
    assert found.direction.probabilities[up] == pytest.approx(0.3 * 0.95 / (0.3 * 0.95 + 0.6 * 0.05), abs=1e-3)
    assert found.turns
    told = found.direction.direction_reason
    assert f"turn about the camera's {up}: up is" in told
    assert f"or {opposite_direction(up)} (it looks" in told
    assert told.endswith("if the image is mirrored, or left and right of the odometry are swapped")


def test_images_whose_heading_nobody_knows_tell_nothing(drive):
    """As in a gap of the odometry: the last heading that is known is not that of the image."""
    gap = range(5, 20)
    motions = [None if k in gap else Motion(STEP * (len(gap) + 1 if k == gap[-1] + 1 else 1)) for k in range(COUNT)]
    frames = open_frames(str(drive / "frames"))
    found = find_setup(frames, CAMERA, motions, robot_from_camera=np.eye(3))
    assert found.mounting.used <= COUNT - len(gap)
    assert (
        found.turns.pairs < find_setup(frames, CAMERA, [Motion(STEP)] * COUNT, robot_from_camera=np.eye(3)).turns.pairs
    )
    assert found.turns.as_told > 0.7


def test_mount_passes_and_fails_by_its_exit_code(drive, tmp_path, capsys):
    out = tmp_path / "mounting.json"
    assert run("mount", drive / "frames", *options(drive), "--within-deg", 3, "--out", out) == 0
    other, narrow = tmp_path / "other.json", json.loads(out.read_text())
    assert narrow["within_tolerance"] is True
    # The floor may change more under wheels that are far apart.
    assert run("mount", drive / "frames", *options(drive), "--wheel-base", 2, "--out", other) == 0
    assert json.loads(other.read_text())["floor"]["covariance_rad2"] != narrow["floor"]["covariance_rad2"]
    assert run("mount", drive / "frames", *options(drive), "--within-deg", 0.5) == 1
    assert "fail: beyond 0.5 degrees" in capsys.readouterr().out
    assert run("mount", drive / "frames", "--camera", drive / "camera.toml", "--within-deg", 3) == 3
    assert "not told apart" in capsys.readouterr().out
    level = run("mount", drive / "frames", "--camera", drive / "camera.toml", "--within-deg", 3, "--level-floor")
    assert level == 0


def test_too_few_images_are_refused(drive):
    for count, words in ((4, "4 images of"), (1, "1 image of")):
        frames = open_frames([str(drive / "frames" / f"{k:02d}.png") for k in range(count)])
        with pytest.raises(InvalidInputError, match=f"{words} the camera's size, expected 5 or more"):
            find_setup(frames, CAMERA)


def test_images_of_a_frozen_camera_count_once(drive, tmp_path):
    """Sixteen times as often as they are, edges that were a little bent told of another lens."""
    for k in range(COUNT):
        (tmp_path / f"{k:02d}.png").write_bytes((drive / "frames" / f"{min(k, 8):02d}.png").read_bytes())
    frames = open_frames(tmp_path)
    assert [number for number, _ in spread(frames, CAMERA, COUNT)] == list(range(9))
    assert find_setup(frames, CAMERA).direction.reason.startswith("9 images")
    with pytest.raises(InvalidInputError, match=r"1 image of .*, expected 5 or more of .*, each another than"):
        find_setup(open_frames(sorted(tmp_path.iterdir())[8:]), CAMERA)


def test_frames_and_motions_that_do_not_fit_are_refused(drive):
    frames = open_frames(str(drive / "frames"))
    for motions in ([Motion()] * 10, [Motion()] * (COUNT + 1)):
        with pytest.raises(InvalidInputError, match=f"motions: {len(motions)}, expected {COUNT}"):
            find_setup(frames, CAMERA, motions)
    with pytest.raises(InvalidInputError, match="frames: str, expected what"):
        find_setup(str(drive / "frames"), CAMERA)
    with pytest.raises(InvalidInputError, match="comes only once"):
        find_setup(NamedImages(), CAMERA)


@pytest.mark.parametrize("verb", ["setup", "mount", "tilt", "level", "track"])
def test_turns_by_another_angle_than_the_odometry_tells_are_told(verb, drive, tmp_path, capsys):
    """As by another wheel base, or frames of another clock: mountings were 10 degrees off, and filtered tilts 6."""
    table = tmp_path / "odometry.csv"
    for scale in (1.0, 1.5):
        rows = "\n".join(f"{scale * STEP if k else 0.0},0.0" for k in range(COUNT))
        table.write_text(f"yaw_rad,distance_m\n{rows}\n")
        more = {
            "setup": ["--out", tmp_path / "robot.toml"], "mount": [], "tilt": ["--filter"],
            "level": ["--filter", "--out", tmp_path / "level"], "track": ["--out", tmp_path / "tracks.csv"],
        }[verb]  # fmt: skip
        code = run(verb, drive / "frames", "--camera", drive / "camera.toml", "--odometry", table, *more, "--overwrite")
        said = capsys.readouterr().err
        assert ("pairs of images turn otherwise than the odometry tells by 8 degrees" in said) == (scale != 1.0)
        assert verb == "level" or code == (1 if verb == "setup" and scale != 1.0 else 0)


def test_turns_of_frames_that_show_nothing_are_not_doubted():
    noise = np.random.default_rng(0)
    bright = 200.0 - 0.5 * np.hypot(*np.mgrid[-120:120, -120:120])
    for dark in (bright, np.full_like(bright, 60.0)):
        images = [(dark + noise.normal(0.0, 4.0, dark.shape)).clip(0, 255).astype(np.uint8) for _ in range(8)]
        assert turn_error(images, STEP * np.arange(8), CAMERA, np.eye(3))


def test_turns_are_not_told_without_turning(drive):
    images = [frame.read() for frame in open_frames(str(drive / "frames"))]
    found = check_turns(images[:6], np.zeros(6), CAMERA, np.eye(3))
    assert not found
    assert not found.reversed
    assert "not told" in found.reason
    with pytest.raises(InvalidInputError, match="yaw_rad"):
        check_turns(images[:6], np.zeros(5), CAMERA, np.eye(3))
    with pytest.raises(InvalidInputError, match="yaw_rad"):
        check_turns(images[:6], ["north"] * 6, CAMERA, np.eye(3))


def test_headings_of_a_compass_are_those_of_turns(drive):
    """From pi on they are negative: ten degrees about it were taken for nearly a whole turn."""
    images = [frame.read() for frame in open_frames(str(drive / "frames"))]
    headings = math.pi - 5.5 * STEP + np.arange(len(images)) * STEP
    of_compass = np.arctan2(np.sin(headings), np.cos(headings))
    assert check_turns(images, of_compass, CAMERA, np.eye(3)) == check_turns(images, headings, CAMERA, np.eye(3))
    few = [np.pi - 0.1, 0.1 - np.pi] * 3
    assert check_turns(images[:6], few, CAMERA, np.eye(3)).turned_rad == pytest.approx(0.2)


def test_images_are_kept_small_and_as_bytes():
    image = np.random.default_rng(1).integers(0, 255, (CAMERA.height, CAMERA.width), dtype=np.uint8)
    small, peaks = small_camera(CAMERA), []
    for count in (20, 220):
        tracemalloc.start()
        check_turns((image for _ in range(count)), np.zeros(count), CAMERA, np.eye(3))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] - peaks[0] < 2 * 200 * small.width * small.height


def odometry(steps_s: np.ndarray) -> tuple[np.ndarray, Odometry]:
    """When the images were taken, and odometry between them that is much finer."""
    times = np.concatenate([[1.0], 1.0 + np.cumsum(steps_s)])
    fine = np.arange(0.0, times[-1] + 1.0, 0.02)
    headings = np.interp(fine, times, np.arange(COUNT) * STEP)
    return times, Odometry.from_poses(fine, 0.0 * fine, 0.0 * fine, headings)


def test_frames_that_are_stamped_late_are_found_where_turns_begin_and_end(drive):
    images = [frame.read() for frame in open_frames(str(drive / "frames"))]
    times, told = odometry(np.tile([0.2, 0.2, 0.9, 0.9, 0.4], 5))
    for delay in (-0.3, 0.15):
        found = frame_delay(images, times + delay, told, CAMERA, np.eye(3))
        assert found, found.reason
        assert found.delay_s == pytest.approx(delay, abs=3.0 * found.sigma_s)
        assert found.sigma_s < 0.03


def test_frames_that_tell_a_delay_are_where_turns_begin_and_end():
    fine = np.arange(0.0, 120.0, 0.02)
    # Nothing for 90 s, then a turn of 4 s; and a steady one from the beginning on, which tells nothing.
    rates = np.where((fine > 90.0) & (fine < 94.0), 0.5, 0.0)
    for steady, per_s in ((0.0, 5.0), (0.0, 30.0), (0.3, 30.0)):
        told = Odometry.from_velocities(fine, 0.0 * fine, rates + np.where(fine < 60.0, steady, 0.0))
        # Some frames are before the record begins.
        times = np.arange(-5.0, 119.0, 1.0 / per_s)
        numbers = telling_frames(times, told)
        assert len(numbers) == 120
        seen = times[numbers]
        assert 0.5 * (seen[0] + seen[-1]) == pytest.approx(92.0, abs=1.0)
        assert seen[-1] - seen[0] == pytest.approx(119 * 0.2, abs=0.5)
    assert telling_frames(np.arange(50) / 5.0, told).tolist() == list(range(50))
    # A short drive at a high rate is not thinned out.
    assert np.diff(telling_frames(np.arange(130) / 30.0, told)).tolist() == [1] * 119


def test_a_steady_turn_tells_no_delay(drive):
    images = [frame.read() for frame in open_frames(str(drive / "frames"))]
    times, told = odometry(np.full(COUNT - 1, 0.4))
    found = frame_delay(images, times, told, CAMERA, np.eye(3))
    assert not found, found.reason
    assert "not told" in found.reason
    with pytest.raises(InvalidInputError, match="times_s"):
        frame_delay(images, times[1:], told, CAMERA, np.eye(3))
