"""Odometry over time: every kind of record tells the same drive, between its samples too, and never beyond."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tiltvp
from recordings import KINDS, START_S, Bag
from tiltvp.errors import InvalidInputError
from tiltvp.streams import Motion, Odometry, Wheels, frame_motions, open_frames, read_odometry

BASE_M, RADIUS_M, TURN = 0.4, 0.05, 1000.0
SPEED, RATE = 0.5, 0.8
TIMES = np.arange(0.0, 4.0, 0.05)
WHEELS = Wheels(wheel_base_m=BASE_M, wheel_radius_m=RADIUS_M, ticks_per_turn=TURN)


def rolled(times: Any) -> np.ndarray:
    """(N, 2): how far the wheels have rolled on an arc."""
    return np.stack([(SPEED - 0.5 * RATE * BASE_M) * times, (SPEED + 0.5 * RATE * BASE_M) * times], axis=1)


def columns(kind: str) -> dict[str, np.ndarray]:
    if kind == "wheels":
        steps = np.diff(rolled(TIMES), axis=0, prepend=0.0)
        return {"left_m": steps[:, 0], "right_m": steps[:, 1]}
    if kind == "deltas":
        steps = np.diff(rolled(TIMES), axis=0, prepend=0.0)
        return {"step": np.arange(len(TIMES)), "delta_left_m": steps[:, 0], "delta_right_m": steps[:, 1]}
    if kind == "ticks":
        counts = np.rint(rolled(TIMES) / (2 * math.pi * RADIUS_M) * TURN)
        return {"left_ticks": (counts[:, 0] + 64_000) % 65_536, "right_ticks": counts[:, 1] - 32_768 + 30_000}
    if kind == "velocities":
        return {"speed_mps": np.full(len(TIMES), SPEED), "yaw_rate_radps": np.full(len(TIMES), RATE)}
    if kind == "poses":
        yaw = RATE * TIMES
        x, y = SPEED / RATE * np.sin(yaw), SPEED / RATE * (1 - np.cos(yaw))
        # The world's frame is another one than that in which the drive begins.
        c, s = math.cos(3.0), math.sin(3.0)
        return {
            "x_m": c * x - s * y + 3, "y_m": s * x + c * y - 2,
            "yaw_rad": (yaw + 3 + math.pi) % (2 * math.pi) - math.pi,
        }  # fmt: skip
    steps = np.diff(TIMES, prepend=0.0)
    return {"distance_m": SPEED * steps, "yaw_deg": np.degrees(RATE * steps)}


TABLES = ("wheels", "deltas", "ticks", "velocities", "poses", "increments")


def write(path: Path, table: dict[str, np.ndarray]) -> Path:
    rows = zip(*(values.tolist() for values in table.values()), strict=True)
    path.write_text("\n".join([",".join(table), *(",".join(map(repr, row)) for row in rows)]) + "\n")
    return path


@pytest.mark.parametrize("kind", TABLES)
def test_every_table_tells_the_same_drive(kind: str, tmp_path: Path) -> None:
    path = write(tmp_path / "odometry.csv", {"time_s": START_S + TIMES} | columns(kind))
    odometry = read_odometry(path, wheels=WHEELS)
    there = odometry.at(START_S + np.array([0.0, 0.513, 1.777, 3.95]))
    step_m = 2 * math.pi * RADIUS_M / TURN if kind == "ticks" else 1e-6
    for start, end in ((0, 1), (1, 2), (0, 3)):
        elapsed = np.array([0.0, 0.513, 1.777, 3.95])[[start, end]]
        driven = SPEED * (elapsed[1] - elapsed[0])
        assert there.distance_m[end] - there.distance_m[start] == pytest.approx(driven, abs=2 * step_m)
        turned = RATE * (elapsed[1] - elapsed[0])
        assert there.yaw_rad[end] - there.yaw_rad[start] == pytest.approx(turned, abs=4 * step_m / BASE_M)
    found = odometry.between(START_S + 0.513, START_S + 1.777)
    assert found.distance_m == pytest.approx(SPEED * 1.264, abs=2 * step_m)
    assert (found.wheels_m is not None) == (kind in ("wheels", "deltas", "ticks"))


@pytest.mark.parametrize("kind", KINDS)
def test_every_topic_tells_the_same_drive(kind: str, tmp_path: Path) -> None:
    made = Bag(kind)
    poses, wheels = columns("poses"), rolled(TIMES) / RADIUS_M
    for k, elapsed in enumerate(TIMES.tolist()):
        made.odometry(START_S + elapsed, *(float(poses[name][k]) for name in ("x_m", "y_m", "yaw_rad")))
        # The joints of an arm come in messages of their own.
        made.joints(START_S + elapsed, ["elbow"], [1.0])
        made.joints(
            START_S + elapsed, ["wheel_right_joint", "elbow", "wheel_left_joint"], [wheels[k, 1], 0.0, wheels[k, 0]]
        )
        made.twist(START_S + elapsed, SPEED, RATE)
    path = made.write(tmp_path)
    plain, by_wheels = Wheels(), Wheels(wheel_base_m=BASE_M, wheel_radius_m=RADIUS_M)
    for topic, known, name in (
        (None, plain, "/odom"), (None, by_wheels, "/joint_states"), ("/cmd_vel", plain, "/cmd_vel"),
        ("/joint_states", by_wheels, "/joint_states"),
    ):  # fmt: skip
        odometry = read_odometry(path, topic=topic, wheels=known)
        assert odometry.source == f"{path} {name}"
        found = odometry.between(START_S + 1.01, START_S + 2.24)
        assert (found.distance_m, found.yaw_rad) == pytest.approx((SPEED * 1.23, RATE * 1.23), abs=1e-6)
    with pytest.raises(InvalidInputError, match="expected their radius by --wheel-radius"):
        read_odometry(path, topic="/joint_states")
    with pytest.raises(InvalidInputError, match=r"joints elbow, wheel_left_joint, .*by --wheel-joints LEFT RIGHT"):
        read_odometry(path, topic="/joint_states", wheels=Wheels(wheel_radius_m=0.1, joints=("a", "b")))


def test_velocities_that_were_commanded_are_not_taken_by_themselves(tmp_path: Path) -> None:
    made = Bag("mcap")
    for elapsed in TIMES.tolist():
        made.twist(START_S + elapsed, SPEED, RATE)
    with pytest.raises(
        InvalidInputError, match=r"no topics of .*; topics and messages: /cmd_vel \(geometry_msgs/Twist, 80\)"
    ):
        read_odometry(made.write(tmp_path))


def test_without_a_base_there_are_distances(tmp_path: Path) -> None:
    path = write(tmp_path / "odometry.csv", {"time_s": TIMES} | columns("wheels"))
    odometry = read_odometry(path)
    assert odometry.yaw_rad is None
    assert odometry.between(1.0, 2.0).distance_m == pytest.approx(SPEED)
    for k in range(3):
        tiltvp.write_image(tmp_path / "images" / f"{k}.png", np.zeros((4, 4), np.uint8))
    (tmp_path / "frames.csv").write_text("file,time_s\n0.png,0.5\n1.png,1.0\n2.png,1.5\n")
    told = frame_motions(open_frames(tmp_path), path)
    assert not told.turns_known
    assert "--wheel-base" in told.notes[0]
    assert frame_motions(open_frames(tmp_path), path, wheels=WHEELS).turns_known


RECORDED = {
    "wheels-swapped": lambda steps: steps[:, ::-1],
    "wheels-negated": lambda steps: -steps,
    "left-wheel-negated": lambda steps: steps * [-1.0, 1.0],
    "right-wheel-negated": lambda steps: steps * [1.0, -1.0],
    "millimetres": lambda steps: 1e3 * steps,
    "cumulative": lambda steps: np.cumsum(steps, axis=0),
}
"""How else the same wheels may be recorded."""


@pytest.mark.parametrize("word", RECORDED)
def test_wheels_of_other_conventions_are_mended_before_they_are_summed(word: str, tmp_path: Path) -> None:
    right = np.stack(list(columns("wheels").values()), axis=1)
    left, other = RECORDED[word](right).T
    path = write(tmp_path / "odometry.csv", {"time_s": TIMES, "left_m": left, "right_m": other})
    ours = read_odometry(path, wheels=WHEELS, read_as=[word])
    np.testing.assert_allclose(ours.wheels_m, np.cumsum(right, axis=0), atol=1e-12)
    # Frames between the rows, and frames that have a row each.
    for k in range(3):
        tiltvp.write_image(tmp_path / "images" / f"{k}.png", np.zeros((4, 4), np.uint8))
    bare = write(tmp_path / "rows.csv", {"left_m": left[:3], "right_m": other[:3]})
    frames = open_frames([str(tmp_path / "images")])
    motions = frame_motions(frames, bare, wheels=WHEELS, read_as=[word]).motions
    np.testing.assert_allclose([motion.wheels_m for motion in motions[1:]], right[1:3], atol=1e-12)
    frames.times_s = np.array([0.5, 0.73, 1.21])
    _, *motions = frame_motions(frames, path, wheels=WHEELS, read_as=[word]).motions
    for motion, elapsed in zip(motions, (0.23, 0.48), strict=True):
        assert motion.yaw_rad == pytest.approx(RATE * elapsed)
        assert motion.distance_m == pytest.approx(SPEED * elapsed)


def test_motions_without_wheels_are_read_by_those_that_they_have(tmp_path: Path) -> None:
    path = write(tmp_path / "odometry.csv", {"time_s": TIMES} | columns("poses"))
    ours = read_odometry(path, wheels=WHEELS, read_as=["wheels-swapped"]).between(0.5, 1.5)
    assert (ours.yaw_rad, ours.distance_m) == pytest.approx((-RATE, SPEED))
    for words, what in ((["clockwise"], "expected words about the wheels"), (["mirrored"], "no convention")):
        with pytest.raises(InvalidInputError, match=what):
            read_odometry(path, wheels=WHEELS, read_as=words)
    with pytest.raises(InvalidInputError, match="expected a wheel base"):
        read_odometry(path, read_as=["wheels-swapped"])


def test_gaps_and_jumps_between_the_frames_are_told(tmp_path: Path) -> None:
    """Also where no frame is in a gap, and of counters that a robot's driver has set anew."""
    for k in range(3):
        tiltvp.write_image(tmp_path / "images" / f"{k}.png", np.zeros((4, 4), np.uint8))
    (tmp_path / "frames.csv").write_text("file,time_s\n0.png,0.5\n1.png,1.5\n2.png,3.5\n")
    kept = (TIMES < 1.92) | (TIMES > 3.08)

    def notes(rows: np.ndarray, **changed: np.ndarray) -> tuple[str, ...]:
        table = {"time_s": TIMES} | columns("poses") | changed
        path = write(tmp_path / "odometry.csv", {name: values[rows] for name, values in table.items()})
        return frame_motions(open_frames(tmp_path), path).notes

    name = tmp_path / "odometry.csv"
    gap = "1 gap of over 0.5 s, the longest of 1.200 s from 1.900 s on; the way in each is taken for one arc"
    assert notes(kept) == (f"{name}: {gap}",)
    assert notes(TIMES < 3.6) == notes(np.arange(len(TIMES)) % 20 == 10) == ()
    anew = columns("poses")["x_m"] - np.where(TIMES > 2.0, 40.0, 0.0)
    assert "1 step that no robot makes, the first after 2.000 s by " in notes(TIMES >= 0.0, x_m=anew)[-1]


@pytest.mark.parametrize("short", [1, 2])
def test_columns_of_other_lengths_are_refused(short: int) -> None:
    """Of two numbers there is one step, which would stand for all."""
    times, few = 0.1 * np.arange(5), np.arange(2.0)
    columns: list[Any] = [times] * 3
    columns[short] = few
    with pytest.raises(InvalidInputError, match=r"\(2,\), expected \(5,\)"):
        Odometry.from_velocities(*columns)
    with pytest.raises(InvalidInputError, match=r"\(2,\), expected \(5,\)"):
        Odometry.from_poses(*columns, times)


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_motions_add_up(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.01, 0.4, 30))
    odometry = Odometry.from_wheels(times, np.cumsum(rng.normal(0, 0.1, (30, 2)), axis=0), wheel_base_m=0.3)
    a, c = np.sort(rng.uniform(times[0], times[-1], 2))
    b = a + share * (c - a)
    parts = odometry.between(a, b), odometry.between(b, c)
    whole = odometry.between(a, c)
    assert sum(part.distance_m for part in parts) == pytest.approx(whole.distance_m, abs=1e-9)
    assert sum(part.yaw_rad for part in parts) == pytest.approx(whole.yaw_rad, abs=1e-9)
    assert whole.yaw_rad == pytest.approx((whole.wheels_m[1] - whole.wheels_m[0]) / 0.3, abs=1e-9)


@pytest.mark.parametrize("wrap", [2**16, 2**32])
def test_counters_that_begin_anew_are_told(wrap: int, tmp_path: Path) -> None:
    counts = np.arange(50) * (wrap // 12)
    table = {"time_s": 0.1 * np.arange(50), "left_ticks": counts % wrap, "right_ticks": (-counts) % wrap}
    odometry = read_odometry(write(tmp_path / "odometry.csv", table), wheels=WHEELS)
    metres = 2 * math.pi * RADIUS_M / TURN
    assert odometry.wheels_m[:, 0] == pytest.approx(counts * metres)
    assert odometry.wheels_m[:, 1] == pytest.approx(-counts * metres)
    assert [note.split(": ")[1] for note in odometry.notes] == [
        f"the counter of the left wheel begins anew 4 times, at {wrap}",
        f"the counter of the right wheel begins anew 5 times, at {wrap}",
    ]


@pytest.mark.parametrize("low", [-math.pi, 0.0])
def test_angles_that_begin_anew_with_each_turn_are_told(low: float, tmp_path: Path) -> None:
    """As absolute encoders have them: one turn of the wheel is all that they know."""
    made, angles = Bag("mcap"), 0.2 * np.arange(200)
    for k, angle in enumerate(angles.tolist()):
        told = [(one - low) % math.tau + low for one in (angle, -angle)]
        made.joints(START_S + 0.02 * k, ["left_wheel", "right_wheel"], told)
    odometry = read_odometry(made.write(tmp_path), wheels=WHEELS)
    assert odometry.wheels_m == pytest.approx(RADIUS_M * np.stack([angles, -angles], axis=1), abs=1e-9)
    words = ["left wheel begins anew 6 times, at 6.283185307", "right wheel begins anew 7 times, at 6.283185307"]
    assert [note.split("counter of the ")[1] for note in odometry.notes] == (
        words if low == 0.0 else [words[0]] + [words[0].replace("left", "right")]
    )
    # A wheel that rolls most of a turn from row to row has not begun anew.
    table = {"time_s": np.arange(3), "left_ticks": np.array([0, 600, 900]), "right_ticks": np.array([0, 600, 900])}
    there = read_odometry(
        write(tmp_path / "odometry.csv", table), wheels=Wheels(wheel_radius_m=1.0, ticks_per_turn=1000.0)
    )
    assert there.distance_m.tolist() == pytest.approx([0.0, 0.6 * math.tau, 0.9 * math.tau])
    assert "never leaves one turn and jumps by over half" in there.notes[0]


def test_a_clock_that_was_set_back_is_refused(tmp_path: Path) -> None:
    """Sorted by their stamps two runs of a simulation would be one; messages that overtake each other are sorted."""
    for back_s in (0.15, 5.0):
        made = Bag("mcap")
        for k in range(100):
            stamp = START_S + 0.1 * k - (back_s if k >= 60 else 0.0)
            made.odometry(stamp, 0.1 * k, 0.0, 0.0)
            made.rows[-1] = (*made.rows[-1][:2], START_S + 0.1 * k, made.rows[-1][3])
        folder = tmp_path / str(back_s)
        folder.mkdir()
        path = made.write(folder)
        if back_s < 1.0:
            assert read_odometry(path).times_s[0] == pytest.approx(START_S, abs=1e-6)
            continue
        with pytest.raises(
            InvalidInputError, match=r"/odom: its clock goes back from 1700000005\.900 to 1700000001\.000 s"
        ):
            read_odometry(path)


def test_images_of_a_folder_come_in_the_order_of_their_times(tmp_path: Path) -> None:
    """Not in that of their names."""
    for k in range(1, 12):
        tiltvp.write_image(tmp_path / "images" / f"{k}.png", np.full((4, 4), k, np.uint8))
    (tmp_path / "frames.csv").write_text("file,time_s\n" + "".join(f"{k}.png,{6.0 - 0.5 * k}\n" for k in range(1, 12)))
    frames = open_frames(tmp_path)
    assert [frame.read()[0, 0] for frame in frames] == list(range(11, 0, -1))
    assert [Path(name).stem for name in frames.names or ()] == [str(k) for k in range(11, 0, -1)]
    assert "in the order of their times" in frames.notes[0]


@pytest.mark.parametrize("ahead_m", [0.0, 0.1])
def test_poses_that_move_sideways_are_told(ahead_m: float, tmp_path: Path) -> None:
    """As those of a frame that is not at the axle, of a robot that turns in place; millimetres of noise are nothing."""
    made, rng = Bag("mcap"), np.random.default_rng(1)
    for k, yaw in enumerate(np.linspace(0.0, 6.0, 200)):
        x, y = ahead_m * np.array([math.cos(yaw), math.sin(yaw)]) + rng.normal(0.0, 1e-3, 2)
        made.odometry(START_S + 0.05 * k, x, y, yaw)
    notes = read_odometry(made.write(tmp_path)).notes
    assert [note.split("/odom: ")[1][:36] for note in notes] == (
        ["poses move sideways by 0.60 m beside"] * bool(ahead_m)
    )


def test_an_orientation_that_nobody_filled_in_is_no_heading(tmp_path: Path) -> None:
    made = Bag("mcap")
    for k in range(3):
        made.odometry(START_S + k, 1.0 * k, 0.0, 0.1 * k)
    turn = made.rows[1][3].pose.pose.orientation
    turn.z = turn.w = 0.0
    with pytest.raises(InvalidInputError, match="/odom, message 1: an orientation of length 0, expected a quaternion"):
        read_odometry(made.write(tmp_path))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time_s,left_m\n", "line 1: one of the columns left_m and right_m"),
        ("time_s,left_m,right_m,left_ticks,right_ticks\n", "line 1: columns of several kinds"),
        ("time_s,speed_mps,yaw_rate_radps,distance_m\n", "line 1: columns of several kinds"),
        ("time_s,x_m,y_m\n", "expected x_m, y_m and yaw_rad"),
        ("time_s\n1\n2\n", "line 1: no motion"),
        ("time_s,left_m,delta_left_m,right_m\n", "column 'left_m' twice"),
        ("time_s,yaw_rad\n0,0\n1,0\n1,0\n", "line 4: time_s = 1.0 after 1.0"),
        ("time_s,yaw_rad\n0,0\n", "1 sample, expected two or more"),
        ("time_s,yaw_rad\n", "0 samples, expected two or more"),
        ("time_s,yaw_rad\n0,0\nnan,0\n", "line 3: time_s = 'nan'"),
        ("time_s,left_ticks,right_ticks\n0,0,0\n1,1,1\n", "expected --wheel-radius and --ticks-per-turn"),
        ("yaw_rad\n0\n1\n", "no column time_s"),
    ],
)
def test_wrong_tables_are_refused(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "odometry.csv"
    path.write_text(text)
    with pytest.raises(InvalidInputError) as caught:
        read_odometry(path)
    assert words in str(caught.value)
    assert str(path) in str(caught.value)


def test_rows_of_images_without_times(tmp_path: Path) -> None:
    for k in range(3):
        tiltvp.write_image(tmp_path / "images" / f"{k}.png", np.zeros((4, 4), np.uint8))
    frames, path = open_frames(tmp_path), tmp_path / "odometry.csv"
    path.write_text("left_m,right_m\n0,0\n0.1,0.3\n0.2,0.2\n")
    told = frame_motions(frames, path, wheels=Wheels(wheel_base_m=0.4))
    assert [(motion.distance_m, motion.yaw_rad) for motion in told.motions] == [
        (0.0, 0.0), (pytest.approx(0.2), pytest.approx(0.5)), (0.2, 0.0),
    ]  # fmt: skip
    assert told.times_s is None
    path.write_text("time_s,file,x_m,y_m,yaw_deg\n5,2.png,2,0,0\n3,0.png,0,0,0\n4,1.png,1,0,0\n")
    told = frame_motions(frames, path)
    assert told.motions == [Motion(), Motion(0.0, 1.0), Motion(0.0, 1.0)]
    assert told.times_s.tolist() == [3.0, 4.0, 5.0]
    path.write_text("time_s,file,distance_m\n3,2.png,0\n4,0.png,1\n5,1.png,1\n")
    with pytest.raises(InvalidInputError, match=r"in the order of its images, by the times of .*: its clock goes back"):
        frame_motions(frames, path)
    path.write_text("time_s,distance_m\n0,0\n1,1\n")
    with pytest.raises(InvalidInputError, match=r"no times of the images, expected them in frames\.csv"):
        frame_motions(frames, path)
    path.write_text("speed_mps,yaw_rate_radps\n0,0\n1,1\n1,1\n")
    with pytest.raises(InvalidInputError, match="velocities without times"):
        frame_motions(frames, path)
    (tmp_path / "frames.csv").write_text("file,time_s\n0.png,100\n1.png,101\n2.png,102\n")
    path.write_text("time_s,distance_m\n0,0\n1,1\n")
    with pytest.raises(
        InvalidInputError, match=r"none is left of .*from 100\.000 to 102\.000 s; expected clocks that agree"
    ):
        frame_motions(open_frames(tmp_path), path)
    path.write_text("time_s,distance_m\n99.5,0\n102.5,1\n")
    with pytest.raises(InvalidInputError, match=r"by --odometry-gap.*expected samples at most 0\.5 s apart"):
        frame_motions(open_frames(tmp_path), path)


def test_wheels_are_lengths() -> None:
    for name in ("wheel_base_m", "wheel_radius_m", "ticks_per_turn", "gap_max_s"):
        for value in (0.0, -1.0, math.nan, math.inf):
            with pytest.raises(InvalidInputError, match=name):
                Wheels(**{name: value})
    for wrong in ({"wheel_base_m": "0.3"}, {"joints": ("left",)}, {"joints": "ab"}):
        with pytest.raises(InvalidInputError, match=next(iter(wrong))):
            Wheels(**wrong)
    with pytest.raises(InvalidInputError, match=r"expected \(N, 2\)"):
        Odometry.from_wheels([0, 1], [0, 1])
    with pytest.raises(InvalidInputError, match="wheel_base_m = 0"):
        Odometry.from_wheels([0, 1], [[0, 0], [1, 1]], wheel_base_m=0.0)
    with pytest.raises(InvalidInputError, match="finite numbers"):
        Odometry.from_velocities([0, 0.1], [math.nan, 1], [0, 0])
