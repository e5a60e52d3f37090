"""Logs that mislead a calibration: misreadings are named, noise is found, and the command obeys."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import tiltvp
from tiltvp.cli import main
from tiltvp.drive_logs import READINGS, DriveLog, doubled_rows
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.hostile_drives import UNDISTURBED, HostileDrive, hostile_drives
from tiltvp.lab.evaluation.hostile_drives import judge_drives, summarise_drive_cases
from tiltvp.streams import Wheels, read_odometry
from tiltvp.synth import simulate_drive


def one(case: str, seed: int = 1) -> HostileDrive:
    return next(hostile_drives(case, range(seed, seed + 1)))


def whole(case: str, seed: int = 1) -> tiltvp.LogCalibration:
    drive = one(case, seed)
    return tiltvp.calibrate(drive.odometry, drive.bearings, **drive.options)


def write(folder: Path, drive: HostileDrive) -> list[str]:
    names = [folder / "odometry.csv", folder / "bearings.csv"]
    columns = ("step,delta_left_m,delta_right_m", "step,landmark,bearing_rad")
    rows = ([[i, *row] for i, row in enumerate(drive.odometry)], [[int(a), int(b), c] for a, b, c in drive.bearings])
    for name, header, table in zip(names, columns, rows, strict=True):
        with name.open("w", newline="") as file:
            csv.writer(file).writerows([header.split(","), *table])
    return ["calibrate", *map(str, names), "--wheel-base", "0.4"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "misreading", "remedies"),
    [
        ("bearings clockwise", "reflected", ["wheels-swapped", "wheels-negated", "clockwise"]),
        ("left wheel negated", "left wheel negated", ["left-wheel-negated"]),
        ("lengths in millimetres", "millimetres", ["millimetres"]),
        ("cumulative", "cumulative", ["cumulative"]),
    ],
)
def test_a_misread_log_is_refused_and_named(
    case: str, misreading: str, remedies: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = whole(case)
    assert not found
    assert found.misreading == misreading
    words = write(tmp_path, one(case))
    out = tmp_path / "found.json"
    assert main([*words, "--out", str(out)]) == 1
    printed = capsys.readouterr().out
    assert all(f"try --read-as {word}" in printed for word in remedies)
    assert "static_transform_publisher" not in printed
    assert "urdf_joint" not in json.loads(out.read_text())
    assert main([*words, "--read-as", remedies[-1]]) == 0
    assert "static_transform_publisher" in capsys.readouterr().out


def test_a_camera_that_creeps_is_named() -> None:
    for seed in (2, 3):
        drive = one("camera creeps by 3 degrees", seed)
        found = tiltvp.calibrate(drive.odometry, drive.bearings, **drive.options)
        assert found.mounting.suspect == "creep"
        assert "works loose" in found.reason
        turned = drive.truth[2] - one(UNDISTURBED, seed).truth[2]
        assert found.mounting.suspect_value == pytest.approx(turned, abs=math.radians(2.0))


@pytest.mark.slow
def test_two_landmarks_under_one_name_are_taken_apart() -> None:
    """Of drives that were wrong and sure: x, y or yaw was off by 5.2 to 6.8 standard deviations of the bound."""
    for seed in (410039, 410050, 410053):
        drive = one("two landmarks merged", seed)
        found = tiltvp.calibrate(drive.odometry, drive.bearings, **drive.options)
        assert found.merged_landmarks == [0]
        assert found.reason.endswith("two landmarks under one name, taken apart: 0")
        error = np.array([found.mounting.x_m, found.mounting.y_m, found.mounting.yaw_rad]) - drive.truth
        assert np.max(np.abs(error) / np.sqrt(np.diag(drive.bound))) < 4.0
    # Bearings that are mixed up agree on no other place.
    assert whole("a tenth of the names wrong").merged_landmarks == []


def test_readings_are_undone() -> None:
    drive = simulate_drive("paper", seed=4)
    log = DriveLog(drive.odometry, drive.bearings, None)
    for names in (["wheels-swapped"] * 2, ["clockwise"] * 2, ["wheels-swapped", "wheels-negated"] * 2):
        again = log.read_as(*names)
        np.testing.assert_array_equal(again.odometry, log.odometry)
        np.testing.assert_array_equal(again.bearings, log.bearings)
    summed = DriveLog(np.cumsum(log.odometry, axis=0), log.bearings, None).read_as("cumulative")
    np.testing.assert_allclose(summed.odometry, log.odometry, atol=1e-12)
    assert log.read_as("degrees").bearings[0, 2] == math.radians(log.bearings[0, 2])
    with pytest.raises(InvalidInputError, match="mirrored"):
        log.read_as("mirrored")
    assert len(READINGS) == 8


@pytest.mark.parametrize("base_m", [None, 0.4])
def test_turns_beside_wheels_stay_as_they_are_told(base_m: float | None, tmp_path: Path) -> None:
    steps, told = simulate_drive("paper", seed=4).odometry, 0.02
    others = {
        "wheels-swapped": steps[:, ::-1], "wheels-negated": -steps, "left-wheel-negated": steps * [-1.0, 1.0],
        "right-wheel-negated": steps * [1.0, -1.0], "millimetres": 1e3 * steps,
        "cumulative": np.cumsum(steps, axis=0),
    }  # fmt: skip
    for word, wheels in others.items():
        rows = enumerate(wheels.tolist(), start=1)
        table = [
            f"{0.1 * k},{left!r},{right!r},{k * told if word == 'cumulative' else told}" for k, (left, right) in rows
        ]
        (tmp_path / "odometry.csv").write_text("\n".join(["time_s,left_m,right_m,yaw_rad", *table]))
        ours = read_odometry(tmp_path / "odometry.csv", wheels=Wheels(wheel_base_m=base_m), read_as=[word])
        # A gyroscope knows nothing of which wheel is which, and its turns are none of these wheels'.
        np.testing.assert_allclose(ours.wheels_m, np.cumsum(steps, axis=0), atol=1e-9)
        np.testing.assert_allclose(ours.distance_m, np.cumsum(steps.mean(axis=1)), atol=1e-9)
        np.testing.assert_allclose(ours.yaw_rad, told * np.arange(1, len(steps) + 1), atol=1e-9)


@pytest.mark.slow
def test_motions_that_are_written_down_twice_are_doubted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drive, rng = one(UNDISTURBED, seed=5), np.random.default_rng(5)
    noise = np.sqrt(1e-5 * np.abs(drive.odometry)) * rng.standard_normal(drive.odometry.shape)
    times = np.where(rng.random(len(noise)) < 0.02, 2, 1)
    steps = np.cumsum(times)[drive.bearings[:, 0].astype(int)] - 1.0
    bearings = np.column_stack([steps, drive.bearings[:, 1:]])
    odometry = np.repeat(drive.odometry + noise, times, axis=0)
    assert tiltvp.calibrate(odometry, bearings, **drive.options)
    assert main(write(tmp_path, replace(drive, odometry=odometry, bearings=bearings))) == 1
    assert f"whole log: {(times == 2).sum()} of {len(odometry)} motions repeat" in capsys.readouterr().out
    table = tmp_path / "wheels.csv"
    rows = [f"{0.02 * k},{left!r},{right!r}" for k, (left, right) in enumerate(odometry.tolist())]
    table.write_text("time_s,left_m,right_m\n" + "\n".join(rows))
    assert "written down twice" in " ".join(read_odometry(table).notes)
    # Of counters that are read one after the other a message that comes twice is no motion.
    assert read_odometry(table, read_as=["cumulative"]).notes == ()


@pytest.mark.parametrize(("resolution_m", "rate_hz"), [(1.5e-4, 50.0), (1e-3, 10.0), (1e-5, 100.0)])
def test_wheels_that_run_evenly_are_not_doubted(resolution_m: float, rate_hz: float) -> None:
    times_s = np.arange(0.0, 60.0, 1.0 / rate_hz)
    speed, turn = 0.3 * np.clip(2.0 * np.sin(times_s / 4.0), 0.0, 1.0), 0.1 * np.sin(times_s / 3.0)
    counts = np.rint(np.cumsum(np.stack([speed - turn, speed + turn], axis=1), axis=0) / rate_hz / resolution_m)
    assert doubled_rows(np.diff(counts, axis=0) * resolution_m) == ""
    assert doubled_rows(np.tile([0.01, 0.02], (100, 1))) == doubled_rows(np.zeros((0, 2))) == ""


def test_motions_that_repeat_one_of_their_time_are_doubted() -> None:
    """Of coarse counters many motions are equal; those of one time as well were driven once."""
    rng = np.random.default_rng(5)
    rows = 2e-3 * rng.integers(4, 8, (300, 2))
    times_s = np.cumsum(rng.uniform(0.09, 0.11, 300))
    again = np.sort(np.concatenate([np.arange(300), rng.choice(300, 8, replace=False)]))
    assert doubled_rows(rows[again]) == doubled_rows(rows, times_s) == ""
    assert doubled_rows(rows[again], times_s[again]).startswith("8 of 308 motions repeat the one before and its time")
    # A clock of whole seconds, a robot that stands, and one that drives evenly tell nothing.
    assert doubled_rows(rows[again], np.floor(times_s[again])) == ""
    assert doubled_rows(np.zeros((10, 2)), np.zeros(10)) == ""
    assert doubled_rows(np.full((300, 2), 0.01), np.floor(times_s)) == ""


@pytest.mark.slow
def test_the_command_knows_motions_of_one_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drive, rng = one(UNDISTURBED, seed=5), np.random.default_rng(6)
    ticks = 2e-3 * np.diff(np.rint(np.cumsum(drive.odometry, axis=0) / 2e-3), axis=0, prepend=0.0)
    times = np.where(rng.random(len(ticks)) < 0.06, 2, 1)
    steps = np.cumsum(times)[drive.bearings[:, 0].astype(int)] - 1.0
    bearings = np.column_stack([steps, drive.bearings[:, 1:]])
    words = write(tmp_path, replace(drive, odometry=np.repeat(ticks, times, axis=0), bearings=bearings))
    table = tmp_path / "odometry.csv"
    taken = ["time_s", *(str(0.1 * step) for step in np.repeat(np.arange(len(ticks)), times).tolist())]
    table.write_text("\n".join(",".join(cells) for cells in zip(table.read_text().split(), taken, strict=True)))
    assert main(words) == 1
    assert "motions repeat the one before and its time" in capsys.readouterr().out


@pytest.mark.slow
def test_every_answer_counts_what_is_contradicted() -> None:
    drive = simulate_drive("alternating", seed=3)
    start = {"wheel_base_m": 0.4, "start": (0.2, 0.0, 0.0), "start_sigma": (0.2, 0.2, 0.6)}
    odometry = drive.odometry.copy()
    odometry[len(odometry) // 2] += [0.15, -0.1]
    e = tiltvp.calibrate(odometry, drive.bearings, **start).mounting
    assert e.contradicted_motions >= 1
    assert f"{e.contradicted_motions} of {e.motions} motions" in e.reason
    calibrator = tiltvp.SelfCalibrator(**start)  # type: ignore[arg-type]
    calibrator.follow(drive.odometry * [1.0, -1.0], drive.bearings)
    assert 2 * calibrator.estimate.contradicted_turns > calibrator.estimate.turns
    assert calibrator.estimate.suspect == "turns"
    assert not calibrator.estimate


@pytest.mark.slow
def test_noise_is_estimated_where_it_is_another_than_told() -> None:
    loud = whole("sigma told 5 times too small")
    assert math.degrees(loud.bearing_sigma_rad) == pytest.approx(2.5, rel=0.2)
    right = whole(UNDISTURBED)
    assert right.bearing_sigma_rad == math.radians(0.5)
    assert right.odometry_k_m == 1e-5


def test_a_wrong_wheel_base_is_named() -> None:
    e = whole("wheel base +30 %").mounting
    assert not e
    assert e.suspect == "wheel_base_m"
    assert e.suspect_value == pytest.approx(0.4, abs=0.05)
    assert type(e).from_dict(e.to_dict()) == e
    with pytest.raises(InvalidInputError, match="suspect"):
        type(e).from_dict(e.to_dict() | {"suspect": "moon"})


def turning_in_place(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Straight on, half a turn in place, and straight on, past a dozen landmarks, with the camera 0.2 m ahead."""
    rng = np.random.default_rng(seed)
    motions = [(0.05, 0.0)] * 60 + [(0.0, math.pi / 40)] * 40 + [(0.05, 0.0)] * 60
    wheels = tiltvp.wheel_displacements(*np.array(motions).T, wheel_base_m=0.4)
    places, bearings, (x, y, heading) = rng.uniform(-4.0, 4.0, (12, 2)), [], (0.0, 0.0, 0.0)
    for step, (distance, turn) in enumerate(motions):
        x, y, heading = x + distance * math.cos(heading), y + distance * math.sin(heading), heading + turn
        camera = np.array([x + 0.2 * math.cos(heading), y + 0.2 * math.sin(heading)])
        for landmark, (ahead, aside) in enumerate(places - camera):
            if 0.3 < math.hypot(ahead, aside) < 5.0:
                error = rng.normal(scale=0.005)
                bearings.append([step, landmark, math.remainder(math.atan2(aside, ahead) - heading + error, math.tau)])
    return wheels + rng.normal(size=wheels.shape) * np.sqrt(1e-5 * np.abs(wheels)), np.array(bearings)


@pytest.mark.parametrize("seed", range(5))
def test_a_wrong_wheel_base_is_no_carpet_where_the_robot_turns(seed: int) -> None:
    odometry, bearings = turning_in_place(seed)
    known = {"bearing_sigma_rad": 0.005}
    assert tiltvp.calibrate(odometry, bearings, wheel_base_m=0.4, **known).mounting.suspect != "wheel_base_m"
    for wrong_m in (0.44, 0.36):
        whole = tiltvp.calibrate(odometry, bearings, wheel_base_m=wrong_m, **known)
        assert not whole
        assert whole.mounting.suspect == "wheel_base_m"
        assert whole.mounting.suspect_value == pytest.approx(0.4, abs=0.01)
        free = tiltvp.calibrate(odometry, bearings, wheel_base_m=wrong_m, estimate_odometry=True, **known)
        assert free.wheel_base_m == pytest.approx(0.4, abs=0.01)


@pytest.mark.parametrize("seed", [100002, 100003, 370003])
def test_a_bump_may_be_behind_a_jump(seed: int) -> None:
    (bumped,) = hostile_drives("camera bumped", range(seed, seed + 1))
    e = tiltvp.calibrate(bumped.odometry, bumped.bearings, **bumped.options).mounting
    assert (bool(e), e.suspect) == (False, "bump")
    assert e.suspect_value == pytest.approx(math.radians(4.0), abs=math.radians(0.5))
    calibrator = tiltvp.SelfCalibrator(**bumped.options)
    calibrator.follow(bumped.odometry, bumped.bearings)
    assert calibrator.estimate.suspect == "bump"


def test_slips_between_legs_that_determine_the_mounting_are_slips() -> None:
    (slipped,) = hostile_drives("wheels slip", range(100003, 100004))
    e = tiltvp.calibrate(slipped.odometry, slipped.bearings, **slipped.options).mounting
    assert e
    assert e.contradicted_motions == 3


def test_slips_leave_stated_errors_true() -> None:
    """The mean of 20 chi-squares of 3 is above 5.5 for one set of 20 independent drives in 10,000."""
    table = judge_drives(hostile_drives("wheels slip", range(370060, 370080)))
    for by in ("filter", "whole log"):
        assert table.filter(pl.col("by") == by)["nees"].mean() < 5.5


def test_the_filter_of_the_command_is_that_of_method(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = write(tmp_path, one(UNDISTURBED))
    found = []
    for method in ("default", "paper"):
        out = tmp_path / f"{method}.json"
        main([*words, "--start", "0.1", "0", "0", "--method", method, "--out", str(out)])
        kept = json.loads(out.read_text())["logs"][0]
        assert kept["options"]["method"] == method
        found.append(kept["filter"]["x_m"])
    assert found[0] != found[1]
    capsys.readouterr()
    assert main([*words, "--method", "nonsense"]) == 2
    assert "method" in capsys.readouterr().err


def test_an_image_centre_whose_doubt_leaves_the_mounting_undetermined_is_named() -> None:
    drive = one("image centre off by 0.5 px", 410000)
    calibrator = tiltvp.SelfCalibrator(**drive.options)
    calibrator.follow(drive.odometry, drive.bearings)
    for found in (tiltvp.calibrate(drive.odometry, drive.bearings, **drive.options).mounting, calibrator.estimate):
        assert "not determined: phi, psi" in found.reason
        assert found.suspect == "centre"


def test_the_filter_of_the_command_has_the_centre_of_the_whole_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive, out = one("image centre off by 2 px"), tmp_path / "out.json"
    assert main(write(tmp_path, drive)) == 1
    assert "about another image centre or from a camera that leans: try estimate_centre" in capsys.readouterr().out
    assert main([*write(tmp_path, drive), "--estimate-centre", "--out", str(out)]) == 0
    assert "image centre: off by" in capsys.readouterr().out
    for answer in ("filter", "whole_log"):
        found = json.loads(out.read_text())["logs"][0][answer]
        found = found.get("mounting", found)
        error = np.array([found["x_m"], found["y_m"], found["yaw_rad"]]) - drive.truth
        assert float(error @ np.linalg.solve(found["covariance_xy_yaw"], error)) < 16.3


def test_rows_that_are_read_one_after_another_show_lines_at_other_times() -> None:
    """A line is where it is seen up to a tenth of a step earlier or later, and half of them are earlier."""
    told, rolled = one(UNDISTURBED).bearings, one("rows read in 30 ms").bearings
    assert np.array_equal(told[:, :2], rolled[:, :2])
    moved = np.remainder(rolled[:, 2] - told[:, 2] + math.pi, math.tau) - math.pi
    for track in np.unique(told[:, 1]):
        own = told[:, 1] == track
        steps = np.abs(np.diff(np.unwrap(told[own, 2])))
        assert np.abs(moved[own]).max() <= 0.03 / 0.1 * 150 / 480 * steps.max()
    assert np.mean(moved != 0.0) > 0.95
    assert 0.3 < np.mean(moved > 0.0) < 0.7


@pytest.mark.parametrize("seed", [460110, 460139])
def test_rows_that_are_read_one_after_another_are_suspect(seed: int) -> None:
    """Both logs were answered, by five and six standard deviations beside the truth."""
    drive = one("rows read in 30 ms", seed)
    found = tiltvp.calibrate(drive.odometry, drive.bearings, **drive.options)
    assert not found
    assert found.mounting.suspect == "rolling_shutter"
    # 300 of 480 rows lie between both sides, and a step takes 0.1 s.
    assert found.mounting.suspect_value == pytest.approx(0.03 * 300 / 480 / 0.1, rel=0.4)
    assert "rolling shutter" in found.reason
    error = np.array([found.mounting.x_m, found.mounting.y_m, found.mounting.yaw_rad]) - drive.truth
    assert error @ np.linalg.solve(found.mounting.covariance_xy_yaw, error) < 16.3
    calibrator = tiltvp.SelfCalibrator(**drive.options)
    calibrator.follow(drive.odometry, drive.bearings)
    assert calibrator.estimate.suspect == "rolling_shutter"
    found = tiltvp.calibrate(drive.odometry, drive.bearings, **drive.options, estimate_rolling_shutter=True)
    error = np.array([found.mounting.x_m, found.mounting.y_m, found.mounting.yaw_rad]) - drive.truth
    assert found
    assert float(np.max(np.abs(error) / np.sqrt(np.diag(drive.bound)))) < 5.0
    late, sigma = np.hypot(*found.rolling_shutter_s), np.hypot(*found.rolling_shutter_sigma_s)
    assert late == pytest.approx(0.5 * 0.03 * 300 / 480 / 0.1, abs=3.0 * sigma)


def test_the_command_tells_a_rolling_shutter_that_it_is_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = write(tmp_path, one("rows read in 30 ms", 460110))
    assert main(words) == 1
    assert "try estimate_rolling_shutter, or drive more slowly" in capsys.readouterr().out
    assert main([*words, "--estimate-rolling-shutter"]) == 0
    told = capsys.readouterr().out
    assert "rolling shutter: lines forward in the camera are seen" in told
    assert "steps (seconds, with times)" in told


def test_the_table_counts_as_it_says() -> None:
    table = judge_drives(hostile_drives(UNDISTURBED, range(2)))
    summary = summarise_drive_cases(table)
    assert summary["drives"].to_list() == [2, 2]
    assert summary["wrong and sure"].to_list() == [0.0, 0.0]
    assert summary["answers"].to_list() == [100.0, 100.0]
    # What has no cause to name names none, also where it cannot be solved.
    undisturbed = one(UNDISTURBED)
    refused = judge_drives([replace(undisturbed, bearings=undisturbed.bearings[:3])])
    assert refused["named"].to_list() == [None, None]
    assert refused["answered"].to_list() == [False, False]
    assert main(["measure", "trust-calibration", "--only", "no such case"]) == 2


@pytest.mark.parametrize(
    ("factor", "base", "told"),
    [
        (1e3, "0.4", "105 of 105 motions are of more than half a turn or 20 m: are displacements in millimetres"),
        (1.0, "170", "wheels 170 m apart: is the wheel base in centimetres or millimetres?"),
        (1.0, "0.4", ""),
    ],
)
def test_lengths_of_no_robot_are_doubted(factor: float, base: str, told: str, tmp_path: Path) -> None:
    """Of a drive straight on, whose scale nothing but its lengths tells."""
    drive, out = simulate_drive("straight", seed=3), tmp_path / "out.json"
    hostile = replace(one(UNDISTURBED), odometry=factor * drive.odometry, bearings=drive.bearings)
    assert main([*write(tmp_path, hostile)[:-1], base, "--out", str(out)]) == 1
    doubt = json.loads(out.read_text())["logs"][0]["doubt"]
    assert doubt.startswith(told)
    assert bool(doubt) is bool(told)
