"""Self-calibration: simulated drives are recovered, what is not determined is said, and bad input is refused."""

from __future__ import annotations

import copy
import csv
import json
import math
import pickle
from pathlib import Path

import numpy as np
import pytest

import tiltvp
from tiltvp.cli import main
from tiltvp.drive_logs import read_drive_log
from tiltvp.errors import InvalidInputError
from tiltvp.lab.plots.calibration import convergence
from tiltvp.selfcalib import consistency_band, convergence_table
from tiltvp.streams import Wheels
from tiltvp.synth import SimulatedDrive, simulate_drive

TRUE = np.array([0.23 * math.cos(-0.34), 0.23 * math.sin(-0.34), -0.01])
START = {"wheel_base_m": 0.4, "start": (0.2, 0.0, 0.0), "start_sigma": (0.2, 0.2, 0.6)}


def error(e: tiltvp.MountingEstimate) -> np.ndarray:
    return np.array([e.x_m, e.y_m, e.yaw_rad]) - TRUE


def followed(drive: SimulatedDrive, **options: object) -> tiltvp.SelfCalibrator:
    calibrator = tiltvp.SelfCalibrator(**{**START, **options})  # type: ignore[arg-type]
    calibrator.follow(drive.odometry, drive.bearings)
    return calibrator


@pytest.mark.parametrize("kind", ["paper", "alternating"])
def test_drives_are_recovered_and_errors_are_as_claimed(kind: str) -> None:
    """NEES of 20 runs in the band that a consistent filter misses once in 1,000 times; the seeds are fixed."""
    nees, squares, bounds = [], [], []
    for seed in range(20):
        drive = simulate_drive(kind, seed=seed)
        e = followed(drive).estimate
        assert e, e.reason
        assert e.determined == ["phi", "rho", "psi", "yaw"]
        nees.append(error(e) @ np.linalg.solve(e.covariance_xy_yaw, error(e)))
        squares.append(error(e) ** 2)
        bounds.append(np.diag(drive.cramer_rao_bound(start_sigma=(0.2, 0.2, 0.6))))
    low, high = consistency_band(0.999, 3, 20)
    assert low < np.mean(nees) < high
    assert np.all(np.sqrt(np.mean(squares, axis=0) / np.mean(bounds, axis=0)) < 1.6)


@pytest.mark.slow
def test_whole_logs_agree_with_the_filter_and_shrug_at_outliers() -> None:
    drive = simulate_drive("alternating", seed=4, outliers=0.03)
    whole = tiltvp.calibrate(drive.odometry, drive.bearings, **START)
    assert whole
    assert 30 < whole.outliers < 120
    assert np.all(np.abs(error(whole.mounting)) < 4.0 * np.sqrt(np.diag(whole.mounting.covariance_xy_yaw)))
    filtered = followed(drive).estimate
    assert np.all(np.abs(error(filtered)) < 5.0 * np.sqrt(np.diag(filtered.covariance_xy_yaw)))


def test_landmarks_that_are_no_points_do_not_pull() -> None:
    """Two of ten landmarks slide by up to two degrees, slowly, as the edges of round things do."""
    drive = simulate_drive("alternating", seed=3)
    bearings = drive.bearings.copy()
    for landmark in (0, 1):
        slides = bearings[:, 1] == landmark
        bearings[slides, 2] += math.radians(2.0) * np.sin(np.arange(np.count_nonzero(slides)) / 15.0)
    whole = tiltvp.calibrate(drive.odometry, bearings, **START).mounting
    calibrator = tiltvp.SelfCalibrator(**START)  # type: ignore[arg-type]
    calibrator.follow(drive.odometry, bearings)
    for e in (whole, calibrator.estimate):
        assert np.all(np.abs(error(e)) < 4.0 * np.sqrt(np.diag(e.covariance_xy_yaw)))


def test_wheels_and_time_offset() -> None:
    """Bearings that were taken a step after the odometry that they are said to belong to."""
    drive = simulate_drive("alternating", seed=1, odometry_k_m=1e-7)
    odometry = drive.odometry * [1.01, 0.99]
    times = 0.1 * np.arange(len(odometry))
    late = drive.bearings[drive.bearings[:, 0] >= 1] - [1.0, 0.0, 0.0]
    whole = tiltvp.calibrate(
        odometry, late, **{**START, "wheel_base_m": 0.42}, odometry_k_m=1e-6,
        estimate_odometry=True, estimate_time_offset=True, times_s=times,
    )  # fmt: skip
    assert whole.wheel_base_m == pytest.approx(0.4, abs=0.004)
    assert whole.right_over_left == pytest.approx(1.01 / 0.99, abs=0.004)
    assert whole.time_offset_s == pytest.approx(0.1, abs=0.01)


def test_driving_straight_on_determines_yaw_only_and_says_so() -> None:
    e = followed(simulate_drive("straight", seed=3)).estimate
    assert not e
    assert e.determined == ["yaw"]
    assert "rotate in place near a feature" in e.reason
    assert abs(e.yaw_rad - TRUE[2]) < 3.0 * math.sqrt(e.covariance_xy_yaw[2, 2])
    assert np.all(e.sigma_of_drive[[0, 2]] > 0.05)


def test_a_camera_on_the_axle_has_no_phi_but_x_y_and_yaw() -> None:
    drive = simulate_drive("alternating", seed=2, mounting=(0.0, 0.0, 0.5))
    e = followed(drive).estimate
    assert e.rho_near_zero
    assert e.determined == ["rho", "yaw"]
    assert e
    assert "use x, y and yaw" in e.reason
    assert abs(e.x_m) < 0.01
    assert abs(e.yaw_rad - 0.5) < 0.02


def test_a_bump_raises_the_alarm_and_an_undisturbed_drive_does_not() -> None:
    drive = simulate_drive("alternating", seed=5)
    assert not followed(drive).estimate.alarm
    bumped = drive.bearings
    bumped[bumped[:, 0] > 150, 2] -= 0.06
    calibrator = tiltvp.SelfCalibrator(**START)
    calibrator.follow(drive.odometry, bumped)
    assert calibrator.estimate.alarm
    assert not calibrator.estimate
    assert "alarm" in calibrator.estimate.reason
    calibrator.reset()
    assert not calibrator.estimate.alarm


def test_the_same_drive_gives_the_same_answer_by_steps_by_log_and_by_copy() -> None:
    drive = simulate_drive("paper", seed=7)
    stepped = tiltvp.SelfCalibrator(**START)
    for step, (left, right) in enumerate(drive.odometry):
        if step == 50:
            stepped = copy.deepcopy(stepped)
        seen = drive.bearings[drive.bearings[:, 0] == step]
        done = stepped.step(left, right, seen[:, 1].astype(int), seen[:, 2])
        assert done.used + done.rejected + done.started == len(seen)
    stepped.examine()
    assert stepped.estimate == followed(drive).estimate
    assert stepped.landmarks == 10


def test_motion_from_anything_else() -> None:
    wheels = tiltvp.wheel_displacements([0.3, 0.0], [0.0, 0.5], wheel_base_m=0.4)
    np.testing.assert_allclose(wheels, [[0.3, 0.3], [-0.1, 0.1]])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"wheel_base_m": 0.0}, "wheel_base_m"),
        ({"bearing_sigma_rad": -1.0}, "bearing_sigma_rad"),
        ({"start_sigma": (0.1, 0.0, 0.1)}, "start_sigma"),
        ({"start": (0.0, np.nan, 0.0)}, "start"),
        ({"method": "papers"}, "method"),
        ({"method": "paper", "start": (0.0, 0.0, 0.0)}, "start"),
        ({"method": "paper", "keyframes_max": 20}, "keyframes_max"),
        ({"odometry_inflation": 2.0}, "odometry_inflation"),
        ({"keyframes_max": 2}, "keyframes_max"),
        ({"gate_probability": 1.0}, "gate_probability"),
    ],
)
def test_bad_options_are_refused(options: dict[str, object], words: str) -> None:
    with pytest.raises(InvalidInputError, match=words):
        tiltvp.SelfCalibrator(**{"wheel_base_m": 0.4, **options})  # type: ignore[arg-type]


def test_bad_steps_are_refused_and_change_nothing() -> None:
    calibrator = tiltvp.SelfCalibrator(wheel_base_m=0.4)
    before = calibrator.estimate
    for arguments in [
        (math.nan, 0.1, [1], [0.5]), (0.1, 0.1, [1, 2], [0.5]), (0.1, 0.1, [1], [math.inf]),
        (0.1, 0.1, [3, 3], [0.1, 0.2]), (0.1, 0.1, [1.5], [0.5]),
    ]:  # fmt: skip
        with pytest.raises(InvalidInputError):
            calibrator.step(*arguments)
    assert calibrator.estimate == before
    for bearings in ([[5, 0, 0.1]], [[-1, 0, 0.1]], [[0, 0, math.nan]], np.empty((0, 3))):
        with pytest.raises(InvalidInputError):
            tiltvp.calibrate([[0.1, 0.1]] * 3, bearings, wheel_base_m=0.4)
    with pytest.raises(InvalidInputError, match="times_s"):
        tiltvp.calibrate([[0.1, 0.1]] * 3, [[0, 0, 0.1], [2, 0, 0.1]], wheel_base_m=0.4, estimate_time_offset=True)


def test_options_are_good_as_keywords_and_each_matters() -> None:
    drive = simulate_drive("paper", seed=11)
    for method, others in [
        ("default", {"start_distance_log_sigma": 0.3, "gate_probability": 0.3, "keyframes_max": 30}),
        ("paper", {"start_distance_sigma_m": 0.5, "odometry_inflation": 1.0}),
    ]:
        one = followed(drive, method=method, start_sigma=(0.05, 0.08, 0.5))
        assert followed(drive, **one.options).estimate == one.estimate
        common = {"bearing_sigma_rad": 0.02, "odometry_k_m": 1e-4, "start_distance_m": 1.5}
        for name, value in {**common, **others}.items():
            other = followed(drive, **{**one.options, name: value})
            assert other.options[name] == value
            assert other.estimate != one.estimate, name


def test_snippets_and_convergence() -> None:
    drive = simulate_drive("paper", seed=1)
    history = tiltvp.SelfCalibrator(**START).follow(drive.odometry, drive.bearings)
    table = convergence_table(history)
    assert len(table["alarm"]) == len(drive.odometry)
    assert table["variance_psi"][-1] < 1e-3 < table["variance_psi"][5]
    figure = convergence({"a drive": table, "_$x$": table}, {"a drive": history[-1]})
    assert figure.axes[0].get_legend().get_texts()[1].get_text() == "_$x$"
    assert [axes.get_ylabel() for axes in figure.axes[::2]] == ["x (m)", "y (m)", "yaw (deg)"]
    for axes in figure.axes[1::2]:
        low, high = axes.get_ylim()
        assert high / low < 10.0**6


def write_log(folder: Path, drive: SimulatedDrive) -> tuple[Path, Path]:
    odometry, bearings = folder / "odometry.csv", folder / "bearings.csv"
    with odometry.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["step", "time_s", "delta_left_m", "delta_right_m"])
        rows.writerows([i, 0.1 * i, left, right] for i, (left, right) in enumerate(drive.odometry))
    with bearings.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["step", "landmark", "bearing_rad"])
        rows.writerows([int(step), int(landmark), bearing] for step, landmark, bearing in drive.bearings)
    return odometry, bearings


@pytest.mark.slow
def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    odometry, bearings = write_log(tmp_path, simulate_drive("paper", seed=1))
    out, plot = tmp_path / "calib.json", tmp_path / "conv.png"
    words = ["calibrate", str(odometry), str(bearings), "--wheel-base", "0.4", "--step-sigma", "1e-4"]
    words += ["--step-sigma-deg", "0.01", "--out", str(out), "--plot", str(plot)]
    assert main(words) == 0
    printed = capsys.readouterr().out
    assert "static_transform_publisher" in printed
    found = json.loads(out.read_text())
    (log,) = found["logs"]
    assert log["whole_log"]["mounting"]["rho_m"] == pytest.approx(0.23, abs=0.02)
    assert log["options"]["step_sigma_m"] == 1e-4
    assert log["options"]["step_sigma_rad"] == pytest.approx(math.radians(0.01))
    assert found["extrinsics"]["not_known"] == ["z", "roll", "pitch"]
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert {path.name for path in tmp_path.iterdir()} == {"odometry.csv", "bearings.csv", "calib.json", "conv.png"}
    straight = simulate_drive("straight", seed=1)
    odometry, bearings = write_log(tmp_path, straight)
    assert main(["calibrate", str(odometry), str(bearings), "--wheel-base", "0.4"]) == 1
    printed = capsys.readouterr().out
    assert "rotate in place" in printed
    assert "static_transform_publisher" not in printed
    assert main(["calibrate", str(odometry), str(bearings), "--wheel-base", "0.4", "--anyway"]) == 1
    assert "static_transform_publisher" in capsys.readouterr().out
    assert main([*words[:-1], str(tmp_path / "conv.jpg")]) == 2
    capsys.readouterr()
    assert main([*words[:5], "--jackknife-parts", "1"]) == 2
    assert "0, or a whole number from 2 to 1000" in capsys.readouterr().err
    assert main([*words[:5], "--method", "paper"]) == 2
    assert "from the axle" in capsys.readouterr().err


@pytest.mark.slow
def test_several_logs_of_one_robot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tables: list[str] = []
    for seed in (1, 2):
        folder = tmp_path / f"{seed}"
        folder.mkdir()
        tables += map(str, write_log(folder, simulate_drive("alternating", seed=seed)))
    camera = tiltvp.Camera.equidistant(width=64, height=48, focal_px=20.0, cx=31.5, cy=23.5)
    robot, found = tmp_path / "robot.toml", tmp_path / "found.toml"
    wheels = Wheels(wheel_base_m=0.4)
    tiltvp.Robot(camera, np.eye(3), covariance_rad2=np.diag([1e-6, 1e-6]), wheels=wheels).save(robot)
    words = [*tables, "--camera", str(robot), "--robot-out", str(found), "--start", "0.2", "0", "0"]
    assert main(["calibrate", *words, "--height", "0.3"]) == 0
    printed = capsys.readouterr().out
    assert "x, y and yaw of 2 logs" in printed
    assert "they agree" in printed
    read = tiltvp.Robot.load(found)
    assert read.height_m == 0.3
    assert read.place_m == pytest.approx((0.2168, -0.0767), abs=0.003)
    assert read.covariance is not None
    assert read.covariance[0, 0] > 0.0
    assert read.wheels == wheels
    # Nothing is written of logs that contradict one another: the camera was turned between them.
    log = tmp_path / "2" / "bearings.csv"
    lines = [line.split(",") for line in log.read_text().splitlines()]
    turned = [lines[0], *([step, landmark, repr(float(bearing) + 0.05)] for step, landmark, bearing in lines[1:])]
    log.write_text("".join(",".join(row) + "\n" for row in turned))
    found.unlink()
    assert main(["calibrate", *words]) == 1
    printed = capsys.readouterr()
    assert "contradict one another" in printed.out
    assert "not written" in printed.err
    assert not found.exists()
    assert main(["calibrate", *words, "--anyway"]) == 1
    assert tiltvp.Robot.load(found).covariance is None
    # A robot's file of which roll and pitch are not known is not complete.
    tiltvp.Robot(camera, np.eye(3), wheels=wheels).save(tmp_path / "bare.toml")
    words[words.index(str(robot))] = str(tmp_path / "bare.toml")
    words[words.index(str(found))] = str(tmp_path / "more.toml")
    assert main(["calibrate", *tables[:2], *words[4:]]) == 0
    assert "roll and pitch were not measured" in capsys.readouterr().err
    assert not (tmp_path / "more.toml").exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("step,delta_left_m\n0,1\n", "line 1"),
        ("step,delta_left_m,delta_right_m\n0,1,x\n", "line 2"),
        ("step,delta_left_m,delta_right_m\n1,0,0\n1,0,0\n", "line 3"),
        ("step,delta_left_m,delta_right_m\n0,0\n", "2 cells"),
        ("step,delta_left_m,delta_right_m\n", "no rows"),
        (
            "step,delta_left_m,delta_right_m,time_s\n0,0,0,1.5\n1,0,0,1.5\n2,0,0,1.25\n",
            "line 4: time_s = 1.25 after 1.5",
        ),
    ],
)
def test_bad_logs_are_refused_with_the_line(tmp_path: Path, text: str, words: str) -> None:
    odometry, bearings = write_log(tmp_path, simulate_drive("paper", seed=1))
    log = read_drive_log(odometry, bearings)
    assert log.times_s is not None
    assert log.odometry.shape == (len(log.times_s), 2)
    odometry.write_text(text)
    with pytest.raises(InvalidInputError, match=words):
        read_drive_log(odometry, bearings)


def test_a_landmark_has_one_bearing_in_a_step(tmp_path: Path) -> None:
    odometry, bearings = write_log(tmp_path, simulate_drive("paper", seed=1))
    rows = ["7,3,0.1", "5,4,0.2", "5,3,0.3", "7,4,0.1", "5,3,0.4", "5,4,0.2"]
    bearings.write_text("\n".join(["step,landmark,bearing_rad", *rows]) + "\n")
    with pytest.raises(InvalidInputError, match=r"line 6: landmark 3 of step 5 again, expected one bearing"):
        read_drive_log(odometry, bearings)
    bearings.write_text("\n".join(["step,landmark,bearing_rad", *rows[:4]]) + "\n")
    assert len(read_drive_log(odometry, bearings).bearings) == 4


def test_answers_come_back_from_dicts_pickles_and_copies() -> None:
    drive = simulate_drive("paper", seed=2)
    calibrator = tiltvp.SelfCalibrator(**START)  # type: ignore[arg-type]
    step = calibrator.step(0.1, 0.1, [1, 2], [0.3, -0.4])
    whole = tiltvp.calibrate(drive.odometry, drive.bearings, estimate_odometry=True, **START)
    for value in (step, whole.mounting, whole):
        assert type(value).from_dict(value.to_dict()) == value
        assert pickle.loads(pickle.dumps(value)) == value
        assert copy.copy(value) == copy.deepcopy(value) == value
    values = whole.mounting.to_dict()
    for changed in ({"surplus": 1}, {"x_m": "far"}, {"determined": ["beta"]}, {"covariance_xy_yaw": [[1.0]]}):
        with pytest.raises(InvalidInputError, match=next(iter(changed))):
            tiltvp.MountingEstimate.from_dict(values | changed)


@pytest.mark.parametrize("method", ["default", "paper"])
def test_a_pickled_calibrator_goes_on_as_if_nothing_had_been(method: str) -> None:
    """With a window so short that it was marginalised, and in the middle of a drive."""
    drive = simulate_drive("alternating", seed=3)
    options = {"keyframes_max": 40} if method == "default" else {}
    whole = tiltvp.SelfCalibrator(**START, method=method, **options)
    half = len(drive.odometry) // 2
    first = drive.bearings[:, 0] < half
    whole.follow(drive.odometry[:half], drive.bearings[first])
    kept = pickle.loads(pickle.dumps(whole))
    assert kept == whole == copy.copy(whole)
    assert kept.estimate == whole.estimate
    rest = drive.bearings[~first] - (half, 0, 0)
    for calibrator in (whole, kept):
        calibrator.follow(drive.odometry[half:], rest)
    assert kept == whole != tiltvp.SelfCalibrator(**START, method=method, **options)
    with pytest.raises(InvalidInputError, match="state"):
        whole.__setstate__(b"not a state")


def test_noise_of_steps_widens_what_is_believed() -> None:
    drive = simulate_drive("paper", seed=2)
    plain, wide = (
        followed(drive, step_sigma_m=m, step_sigma_rad=rad).estimate for m, rad in ((0.0, 0.0), (2e-3, 5e-3))
    )
    assert np.all(np.diag(wide.covariance_xy_yaw) > np.diag(plain.covariance_xy_yaw))
    with pytest.raises(InvalidInputError, match="step_sigma_rad"):
        tiltvp.SelfCalibrator(wheel_base_m=0.4, step_sigma_rad=-1.0)


def test_a_slip_of_the_wheels_does_not_move_the_mounting() -> None:
    drive = simulate_drive("alternating", seed=3)
    odometry = drive.odometry.copy()
    odometry[len(odometry) // 2] += [0.15, -0.1]
    e = tiltvp.calibrate(odometry, drive.bearings, **START).mounting
    assert np.all(np.abs(error(e)) < 4.0 * np.sqrt(np.diag(e.covariance_xy_yaw)))
    calibrator = tiltvp.SelfCalibrator(**START)  # type: ignore[arg-type]
    e = calibrator.follow(odometry, drive.bearings)[-1]
    assert np.all(np.abs(error(e)) < 4.0 * np.sqrt(np.diag(e.covariance_xy_yaw)))
