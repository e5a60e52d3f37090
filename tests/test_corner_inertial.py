"""What an inertial sensor tells of a camera from frame to frame, and what estimators of corners make of it."""

from __future__ import annotations

import re
import tracemalloc
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

import tiltvp
from drawn_corners import CAMERA, GREYS, LEFT_FROM_RIGHT, drawn, off_deg, pair, pose, turn
from recordings import START_S, Bag
from tiltvp import Robot
from tiltvp.cli import main
from tiltvp.cli.corner_inertial import Inertial
from tiltvp.corner import CornerPoseEstimator
from tiltvp.errors import CalibrationError, InvalidInputError
from tiltvp.rotations import ROTATION_WORDS, quaternion, rotation_from_quaternion
from tiltvp.streams import InertialSamples
from tiltvp.synth import Laboratory, StereoSequence, zed_cameras


@pytest.fixture(scope="module")
def sequence() -> StereoSequence:
    left, right = zed_cameras()
    return StereoSequence(Laboratory(5), left=left, right=right, frames=60, seed=5, samples=1)


def samples_of(sequence: StereoSequence, seed: int) -> InertialSamples:
    imu = sequence.imu(seed=seed)
    return InertialSamples(imu.times_s, imu.rates_rad_s, imu.forces_m_s2)


def test_a_frame_of_a_long_record_takes_no_longer_than_one_of_a_short() -> None:
    """Of half an hour at 200 Hz nothing as long as the record is made for a frame."""
    times_s = 0.005 * np.arange(400_000)
    samples = InertialSamples(times_s, np.zeros((len(times_s), 3)), np.tile([0.0, 0.0, 9.81], (len(times_s), 1)))
    samples.known(999.9, 1000.0)
    tracemalloc.start()
    known = samples.known(1000.0, 1000.1)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert known["gyro"] is not None
    assert known["gravity"] is not None
    assert peak < len(times_s)


@pytest.mark.slow
def test_turns_have_covariances_that_hold() -> None:
    """Of ten sensors, each with its own bias: mean squared errors by their covariances, of 3 numbers."""
    left, right = zed_cameras()
    turns = []
    sequence = StereoSequence(Laboratory(5), left=left, right=right, frames=60, seed=8, samples=1)
    poses = sequence.poses[:, :3, :3]
    for seed in range(10):
        samples = samples_of(sequence, seed)
        for k in range(1, len(poses)):
            turn, covariance = samples.known(sequence.times_s[k - 1], sequence.times_s[k])["gyro"]
            off = turn.T @ poses[k - 1].T @ poses[k]
            error = 0.5 * np.array([off[2, 1] - off[1, 2], off[0, 2] - off[2, 0], off[1, 0] - off[0, 1]])
            turns.append(error @ np.linalg.solve(covariance, error))
    assert 0.3 < np.mean(turns) < 4.5
    assert np.quantile(turns, 0.99) < 16


@pytest.mark.slow
def test_down_is_as_good_as_it_says_however_short_the_record() -> None:
    """Of hands that sway slower than the record is long, and of those that sway faster, from its beginning on."""
    left, right = zed_cameras()
    expected = {0.7: (4.0, 0.6), 2.0: (2.5, 0.8), 20.0: (1.0, 1.0)}
    off_deg: dict[float, list[float]] = {record_s: [] for record_s in expected}
    sigmas: dict[float, list[float]] = {record_s: [] for record_s in expected}
    for period_s, seed in ((15.0, 0), (15.0, 1), (40.0, 2)):
        sequence = StereoSequence(Laboratory(5), left=left, right=right, frames=600, seed=seed, period_s=period_s)
        imu = sequence.imu(seed=seed)
        for record_s in expected:
            for begin_s in np.arange(0.0, 19.9 - min(record_s, 19.0), 3.0):
                of = (imu.times_s >= begin_s) & (imu.times_s <= begin_s + record_s)
                samples = InertialSamples(imu.times_s[of], imu.rates_rad_s[of], imu.forces_m_s2[of])
                for now_s in begin_s + record_s * np.array([0.0, 0.3, 0.5, 0.9]):
                    known = samples.known(None, now_s)["gravity"]
                    if known is None:
                        sigmas[record_s].append(np.nan)
                        continue
                    down = -sequence.poses_at([now_s])[0, 2, :3]
                    off_deg[record_s].append(np.degrees(np.linalg.norm(np.cross(known[0], down))))
                    sigmas[record_s].append(off_deg[record_s][-1] / np.degrees(known[1]))
    for record_s, (rms_deg, told) in expected.items():
        assert np.mean(np.isfinite(sigmas[record_s])) >= told, record_s
        assert np.sqrt(np.mean(np.square(off_deg[record_s]))) < rms_deg, record_s
        # Half of what directions make that are off as they say is 1.2; 99.9 % are within 3.7.
        assert 0.3 < np.nanmedian(sigmas[record_s]) < 1.2, record_s
        assert np.nanmax(sigmas[record_s]) < 3.7, record_s


@pytest.mark.slow
def test_axes_of_the_sensor_are_taken_to_those_of_the_camera(sequence: StereoSequence) -> None:
    samples, turn = samples_of(sequence, 1), np.array(ROTATION_WORDS["forward"])
    assert samples.accelerations_m_s2 is not None
    other = InertialSamples(samples.times_s, samples.rates_rad_s @ turn.T, samples.accelerations_m_s2 @ turn.T)
    own, same = samples.known(0.0, 0.08), other.known(0.0, 0.08, turn.T)
    assert np.allclose(own["gyro"][0], same["gyro"][0])
    assert np.allclose(own["gravity"][0], same["gravity"][0])


@pytest.mark.slow
def test_what_samples_do_not_cover_is_not_told(sequence: StereoSequence) -> None:
    samples = samples_of(sequence, 1)
    assert samples.known(None, 0.05)["gyro"] is None
    assert samples.known(0.0, samples.times_s[-1] + 1.0)["gyro"] is None
    keep = (samples.times_s < 0.02) | (samples.times_s > 0.15)
    gap = InertialSamples(samples.times_s[keep], samples.rates_rad_s[keep], None)
    assert gap.known(0.0, 0.16) == {"gravity": None, "gyro": None}
    shaken = InertialSamples(samples.times_s, samples.rates_rad_s, np.zeros((len(samples.times_s), 3)))
    assert shaken.known(0.0, 0.05)["gravity"] is None


def test_readings_that_cannot_be_are_refused() -> None:
    times, rates = np.array([0.0, 0.01, 0.02]), np.ones((3, 3))
    for wrong in (
        (times[::-1], rates, None), (times, rates[:2], None), (times, rates, rates[:, :2]),
        (times, rates * np.nan, None), (times, rates, None, rates),
    ):  # fmt: skip
        with pytest.raises(InvalidInputError, match=r"inertial sensor: .*expected"):
            InertialSamples(*wrong)


def test_nothing_is_told_across_a_gap() -> None:
    """A sensor that stands, then turns by 0.4 rad while its samples are lost: down of before is not down of now."""
    times = np.arange(0.0, 4.0, 0.01)
    lean, rates = np.clip(times - 1.0, 0.0, 0.4), np.zeros((len(times), 3))
    rates[:, 0] = (times >= 1.0) & (times < 1.4)
    forces = 9.81 * np.stack([np.zeros(len(times)), -np.cos(lean), np.sin(lean)], axis=1)
    for keep, gap in ((times < 0.995, None), ((times < 0.995) | (times > 1.895), "0.910 s from 0.990 s on")):
        samples = InertialSamples(times[keep], rates[keep], forces[keep])
        assert samples.known(None, 0.95)["gravity"] is not None
        assert [samples.known(None, now)["gravity"] for now in (1.15, 1.3, 1.4)] == [None] * 3
        assert samples.gaps == (None if gap is None else f"1 gap of over 0.1 s, the longest of {gap}")
    assert InertialSamples(times, rates, forces).gaps is None
    # At the frame, not at the sample next to it.
    times = np.arange(0.0, 2.0, 0.05)
    forces = 9.81 * np.stack([np.zeros(len(times)), -np.cos(times), np.sin(times)], axis=1)
    down, _ = InertialSamples(times, np.tile([1.0, 0.0, 0.0], (len(times), 1)), forces).known(None, 1.02)["gravity"]
    assert down == pytest.approx([0.0, np.cos(1.02), -np.sin(1.02)], abs=1e-3)


def test_samples_that_are_none_are_refused() -> None:
    times, zeros = np.arange(5.0), np.zeros((5, 3))
    for bad, told in (
        ((times[::-1], zeros, None), "expected two or more of rising times"),
        ((times, zeros[:4], None), r"rates_rad_s \(4, 3\)"),
        ((times, zeros, np.full((5, 3), np.nan)), "accelerations_m_s2"),
    ):
        with pytest.raises(InvalidInputError, match=told):
            InertialSamples(*bad)
    with pytest.raises(CalibrationError, match="camera_from_sensor: no rotation"):
        InertialSamples(times, zeros, None).known(0.0, 1.0, np.ones((3, 3)))
    wrong: Any
    for wrong, words in (((0.0, 1.0, "up"), "camera_from_sensor"), ((0.0, "1"), "now_s"), (("0", 1.0), "before_s")):
        with pytest.raises(InvalidInputError, match=words):
            InertialSamples(times, zeros, None).known(*wrong)


@pytest.mark.parametrize(
    ("known", "words"),
    [
        ({"gravity": "down"}, "gravity = 'down', expected a direction"),
        ({"gravity": (0.0, 1.0, 0.0)}, "expected a direction"),
        ({"gravity": ((0.0, 1.0, 0.0), "a")}, "gravity: sigma_rad = 'a', expected a number"),
        ({"gyro": np.eye(3)}, "gyro = .*expected a rotation"),
    ],
)
def test_what_is_no_knowledge_of_a_frame_is_refused(known: dict[str, Any], words: str) -> None:
    estimator = CornerPoseEstimator(zed_cameras()[0], method="general")
    image = np.zeros((estimator.left.camera.height, estimator.left.camera.width), np.uint8)
    with pytest.raises(InvalidInputError, match=f"(?s){words}"):
        estimator(image, **known)
    estimator(image, gravity=[(0.0, 1.0, 0.0), 0.1], gyro=[np.eye(3), 1e-4 * np.eye(3)])  # type: ignore[arg-type]


def test_accelerations_in_other_units_are_told() -> None:
    times = np.arange(0.0, 1.0, 0.01)
    sensor = Inertial(InertialSamples(times, np.zeros((100, 3)), np.tile([0.0, -1.0, 0.0], (100, 1))), np.eye(3))
    known = sensor.known(0.5)
    assert known["gravity"] is None
    sensor.took(0.5, known)
    assert "down of 0 of 1 frames; its accelerations have 1 m/s^2 in the median, expected 9.81" in sensor.summary()


def test_rates_in_degrees_are_told() -> None:
    times = np.arange(0.0, 1.0, 0.01)
    rates = np.column_stack([np.sin(times), 0.0 * times, 2.0 * np.cos(times)])
    assert InertialSamples(times, rates, None).notes == ()
    told = InertialSamples(times, np.degrees(rates), None)
    assert "turns of up to 115 rad/s, which no such sensor tells: are they in degrees?" in told.notes[0]
    assert replace(told, frame="imu").notes == told.notes
    assert told.notes[0] in Inertial(told, np.eye(3)).summary()


def test_tables_of_readings(tmp_path: Path) -> None:
    table = tmp_path / "imu.csv"
    table.write_text("time_s,rate_x_radps,rate_y_radps,rate_z_radps\n0,0,0,1\n0.1,0,0,1\n")
    read = InertialSamples.read(table)
    assert (read.accelerations_m_s2, read.rates_rad_s.tolist()) == (None, [[0, 0, 1], [0, 0, 1]])
    turn, _ = read.known(0.0, 0.1)["gyro"]
    assert turn[1, 0] == pytest.approx(np.sin(0.1))
    for text, problem in (
        ("time_s,rate_x_radps\n0,0\n", "no column rate_y_radps"),
        ("time_s,rate_x_radps,rate_y_radps,rate_z_radps\n1,0,0,1\n1,0,0,1\n", "after 1"),
        ("time_s,rate_x_radps,rate_y_radps,rate_z_radps\n1,0,0,1\n", "1 row"),
    ):
        table.write_text(text)
        with pytest.raises(InvalidInputError, match=problem):
            InertialSamples.read(table)


@pytest.mark.slow
def test_an_estimator_takes_what_is_known_of_a_frame(sequence: StereoSequence) -> None:
    left, right = sequence.cameras
    samples = samples_of(sequence, 1)
    # Pixels of one sample have jagged edges: one frame's misfit is 2.7.
    told = CornerPoseEstimator(left, right, sequence.left_from_right, method="coloured", misfit_max=10.0)
    plain = CornerPoseEstimator(left, right, sequence.left_from_right, method="coloured", misfit_max=10.0)
    before = None
    for frame, time_s in enumerate(sequence.times_s.tolist()):
        images = sequence.render(frame)
        found, alone = told(*images, **samples.known(before, time_s)), plain(*images)
        before = time_s
        assert found.pose is not None
        assert alone.pose is not None
        assert np.allclose(found.pose.camera_from_object, alone.pose.camera_from_object), "priors move no pose"
    with pytest.raises(InvalidInputError, match="gravity"):
        told(*images, gravity=((0, 0, 0), 0.1))
    with pytest.raises(InvalidInputError, match="before_from_now"):
        told(*images, gyro=(np.zeros((3, 3)), np.eye(3)))
    with pytest.raises(InvalidInputError, match="sigma_rad"):
        told(*images, gravity=((0, 1, 0), 0.0))


@pytest.mark.slow
def test_one_grey_camera_takes_gravity_in_place_of_a_frame_before(sequence: StereoSequence) -> None:
    """What looks alike from two sides is told apart by down alone, in every frame for itself."""
    image = sequence.render(2)[0]
    down = sequence.poses[2, :3, :3].T @ [0.0, 0.0, -1.0]
    estimator = CornerPoseEstimator(sequence.cameras[0], method="general", right_handed=True)
    found = estimator(image.mean(axis=2).astype(np.uint8), gravity=(down, 0.01))
    estimator.reset()
    turned = estimator(image.mean(axis=2).astype(np.uint8), gravity=(np.roll(down, 1), 0.01))
    if found.pose is not None:
        vertical = found.pose.camera_from_object[:, 1]
        assert abs(vertical @ down) > np.cos(np.radians(3))
    assert found.hypotheses != turned.hypotheses


@pytest.mark.slow
@pytest.mark.parametrize("cameras", [1, 2])
def test_a_pose_that_gravity_contradicts_is_none(cameras: int) -> None:
    rotation, _ = pose()
    rig = (CAMERA, CAMERA, LEFT_FROM_RIGHT)[: 2 * cameras - 1]
    for off_by_deg, sigma_rad, found in ((0.0, 0.01, True), (10.0, 0.1, True), (10.0, 0.01, False)):
        estimator = CornerPoseEstimator(*rig, method="general")
        down = turn("x", off_by_deg) @ rotation[:, 1]
        estimate = estimator(*pair(GREYS)[:cameras], gravity=(down, sigma_rad))
        assert (estimate.pose is not None) == found, (off_by_deg, sigma_rad)
        # One image of a box shows too few edges to speak of most.
        contradicted = "no corner that fits" + ", and most edges contradict the gravity that is told" * (cameras - 1)
        assert estimate.reason == ("" if found else contradicted)


@pytest.mark.slow
def test_the_command_takes_readings(
    sequence: StereoSequence, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from tiltvp.images import write_image

    for frame in range(3):
        write_image(tmp_path / "left" / f"{frame}.png", sequence.render(frame)[0])
    calibration = tmp_path / "camera.toml"
    sequence.cameras[0].save(calibration)
    imu = sequence.imu(seed=1)
    rows = np.column_stack([imu.times_s, imu.rates_rad_s, imu.forces_m_s2])
    names = ["time_s", *(f"rate_{a}_radps" for a in "xyz"), *(f"acceleration_{a}_mps2" for a in "xyz")]
    np.savetxt(tmp_path / "imu.csv", rows, delimiter=",", header=",".join(names), comments="")
    asked = ["corner", str(tmp_path / "left"), "--calibration", str(calibration), "--frame-rate", "25"]
    assert main([*asked, "--imu", str(tmp_path / "imu.csv")]) == 0
    assert "turns of 2, down of" in capsys.readouterr().out
    # At a rate that nobody told, readings would be of other frames.
    assert main([*asked[:-2], "--imu", str(tmp_path / "imu.csv")]) == 2
    assert "0.png: tells no time, expected --frame-rate with --imu" in capsys.readouterr().err
    assert main([*asked, "--imu-topic", "/imu"]) != 0
    assert "--imu-topic without --imu" in capsys.readouterr().err


@pytest.mark.slow
def test_the_turn_over_a_frame_that_is_refused_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a camera that rolls by 30 degrees from frame to frame only the turn since the one before last tells which edge
    is upright."""
    CAMERA.save(tmp_path / "camera.toml")
    for frame in range(3):
        image = drawn(*pose(roll=4.0 + 30.0 * frame), GREYS)
        tiltvp.write_image(tmp_path / "left" / f"{frame}.png", image if frame != 1 else image[:50, :50])
    times_s = np.arange(0.0, 2.01, 0.01)
    rows = np.column_stack([times_s, np.zeros((len(times_s), 2)), np.full(len(times_s), -np.radians(30.0))])
    header = "time_s,rate_x_radps,rate_y_radps,rate_z_radps"
    np.savetxt(tmp_path / "imu.csv", rows, delimiter=",", header=header, comments="")
    words = ["corner", str(tmp_path / "left"), "--calibration", str(tmp_path / "camera.toml"), "--method", "general"]
    words += ["--pitch", "-28", "--frame-rate", "1", "--imu", str(tmp_path / "imu.csv")]
    assert main([*words, "--out", str(tmp_path / "poses.json")]) == 1
    assert "turns of 1, down of 0 of 2 frames" in capsys.readouterr().out
    turns = pl.read_json(tmp_path / "poses.json").select("qx", "qy", "qz", "qw").rows()
    for one, roll in zip(turns, (4.0, 64.0), strict=True):
        found = rotation_from_quaternion(np.array(one), "pose").T
        assert off_deg(found, pose(roll=roll)[0]) < 1.0


@pytest.fixture(scope="module", params=["ros1", "mcap"])
def turning(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[np.ndarray]]:
    """A recording of a camera on its side that turns about the vertical before a grey box, with two sensors, and its
    attitudes. Images arrive 80 ms after they were taken; "/board" has other axes than the camera.
    """
    bag, attitudes = Bag(request.param), []
    turned_deg, on_board = 2.0, np.array(ROTATION_WORDS["forward"])
    for frame in range(3):
        rotation, vertex = pose(yaw=40.0 + turned_deg * frame, roll=70.0)
        bag.image("/camera", START_S + 0.1 * frame, drawn(rotation, vertex, GREYS), "bgr8", late_s=0.08)
        attitudes.append(rotation)
    down = attitudes[0][:, 1]
    rates, forces = np.radians(turned_deg) / 0.1 * down, -9.81 * down
    for time_s in START_S + np.arange(-0.6, 0.8, 0.01):
        bag.imu(time_s, rates, forces)
        bag.imu(time_s, on_board @ rates, on_board @ forces, "/board")
    return bag.write(tmp_path_factory.mktemp("turning")), attitudes


@pytest.mark.slow
def test_the_command_takes_axes_and_topics_that_are_known(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of the sensor's axes those of /tf_static, of the topics those of a robot's file."""
    bag, on_board = Bag("mcap"), np.array(ROTATION_WORDS["forward"])
    rotation, vertex = pose(yaw=40.0, roll=70.0)
    bag.image("/left", START_S, drawn(rotation, vertex, GREYS), "bgr8")
    bag.image("/other", START_S, np.zeros((4, 4), np.uint8), "mono8")
    for time_s in START_S + np.arange(-0.6, 0.6, 0.01):
        bag.imu(time_s, np.zeros(3), on_board @ (-9.81 * rotation[:, 1]), "/board")
        bag.imu(time_s, np.zeros(3), np.zeros(3), "/broken")
    bag.static("imu", "camera", quaternion(on_board).tolist())
    recording, robot = str(bag.write(tmp_path)), tmp_path / "robot.toml"
    Robot(CAMERA, np.eye(3), topics={"images": "/left", "inertial": "/board"}).save(robot)
    words = ["corner", recording, "--calibration", str(robot), "--method", "general", "--imu", recording]
    assert main([*words, "--out", str(tmp_path / "poses.json")]) == 0
    assert f"--camera-from-imu: not given, that of {recording} /tf_static is taken" in capsys.readouterr().err
    (turn,) = pl.read_json(tmp_path / "poses.json").select("qx", "qy", "qz", "qw").rows()
    assert abs((rotation.T @ rotation_from_quaternion(np.array(turn), "pose").T)[1, 1]) > 0.9999


@pytest.mark.slow
def test_the_command_takes_the_sensor_of_a_recording(
    turning: tuple[Path, list[np.ndarray]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a camera on its side only down tells which edge is upright: a level one without, the true one with it.

    Which of the box's corners is taken, and so how its edges are called, may change from frame to frame. With a sensor
    whose axes are taken for others there is no pose.
    """
    recording, attitudes = turning
    CAMERA.save(tmp_path / "camera.toml")
    np.savetxt(tmp_path / "camera_from_board.txt", np.array(ROTATION_WORDS["forward"]).T)

    def off(*words: str) -> list[float]:
        asked = ["corner", str(recording), "--calibration", str(tmp_path / "camera.toml"), "--method", "general"]
        table = tmp_path / "poses.json"
        assert main([*asked, "--independent", "--out", str(table), "--overwrite", *words]) == 0
        turns = pl.read_json(table).select("qx", "qy", "qz", "qw").rows()
        found = [None if None in turn else rotation_from_quaternion(np.array(turn), "pose").T for turn in turns]
        cosines = [np.abs(true.T @ one) for one, true in zip(found, attitudes, strict=True) if one is not None]
        assert np.allclose(cosines, np.round(cosines), atol=0.01)
        return [float(np.degrees(np.arccos(min(1.0, one[1, 1])))) for one in cosines]

    assert np.allclose(off(), 90.0, atol=0.5)
    imu = ["--imu", str(recording)]
    assert np.allclose(off(*imu, "--imu-topic", "/imu"), [0.0] * 3, atol=0.5)
    assert "/imu: turns of 2, down of 3 of 3 frames" in capsys.readouterr().out
    board = [*imu, "--imu-topic", "/board"]
    turn = ["--camera-from-imu", str(tmp_path / "camera_from_board.txt")]
    assert np.allclose(off(*board, *turn), [0.0] * 3, atol=0.5)
    assert off(*board) == []
    # Frames that are counted from 0 have another clock than the recording.
    assert len(off(*imu, "--imu-topic", "/imu", "--frame-rate", "10")) == 3
    assert re.search(
        r"turns of 0, down of 0 of 3 frames; its times are 1699\d+\.\d* to .* 0\.000 to 0\.200 s",
        capsys.readouterr().out,
    )
