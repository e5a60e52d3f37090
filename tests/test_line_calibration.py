"""The mounting from the lines of a drive's images, with which line is which found in turns with it."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tiltvp import Camera
from tiltvp.drive_logs import DriveLog
from tiltvp.errors import InvalidInputError
from tiltvp.line_calibration import calibrate_lines, place_of_longest_tracks
from tiltvp.line_logs import SeenFrame, bearing_log, see_lines
from tiltvp.line_turns import line_turns
from tiltvp.lines import LineExtractor, LineTracker
from tiltvp.selfcalib import LogCalibration, calibrate
from tiltvp.streams import Motion
from tiltvp.synth import Drive, Room

pytestmark = pytest.mark.slow

MOUNT = (0.12, -0.07, 0.2)
LEGS = [(0.0, 2.0), (0.8, 0.0), (0.0, -2.5), (0.5, 0.6)]


@pytest.fixture(scope="module")
def drive() -> Drive:
    camera = Camera.equidistant(width=360, height=360, focal_px=105.0, cx=179.5, cy=179.5, max_theta_rad=1.6)
    room = Room("office", 31, light_spacing_m=0.6)
    return Drive(
        room, camera=camera, legs=LEGS, mount=(*MOUNT, 0.4), step_m=0.12, turn_max_rad=0.3, samples=2, seed=4
    )  # fmt: skip


@pytest.fixture(scope="module")
def seen(drive: Drive) -> list[SeenFrame]:
    motions = [Motion(turn, distance) for distance, turn in drive.motions.tolist()]
    images = (drive.render(frame).gray for frame in range(len(drive)))
    extractor = LineExtractor(drive.camera)
    return [one for one in see_lines(images, extractor, motions=motions) if isinstance(one, SeenFrame)]


@pytest.fixture(scope="module")
def solve(drive: Drive) -> partial[LogCalibration]:
    return partial(
        calibrate, drive.odometry, wheel_base_m=drive.wheel_base_m, bearing_sigma_rad=math.radians(0.05)
    )  # fmt: skip


def errors(whole: LogCalibration) -> np.ndarray:
    found = whole.mounting
    return np.array([found.x_m, found.y_m, found.yaw_rad]) - MOUNT


@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (-0.2, 0.2, 0.5)])
def test_the_mounting_is_found_from_a_start_that_is_far_off(
    seen: list[SeenFrame], solve: partial[LogCalibration], start: tuple[float, float, float]
) -> None:
    found = calibrate_lines(seen, solve, start=start)
    assert found.settled
    assert found.whole
    assert (np.abs(errors(found.whole)) < (0.004, 0.004, math.radians(0.3))).all()
    assert len(found.frames) == len(seen)


def test_tracks_from_a_wrong_place_are_short_and_lead_to_a_wrong_one(
    seen: list[SeenFrame], solve: partial[LogCalibration]
) -> None:
    """What is mended: lines that are lost where the robot turns, and a mounting that is off by more."""
    tracker = LineTracker()
    bearings = bearing_log([one.followed(tracker) for one in seen], frames_min=3)
    found = calibrate_lines(seen, solve)
    assert len(bearings) < 0.9 * len(found.bearings)
    assert np.linalg.norm(errors(solve(bearings, estimate_centre=True))[:2]) > 2.0 * np.linalg.norm(
        errors(found.whole)[:2]
    )


def test_the_place_is_told_by_motions_that_turn_and_drive(seen: list[SeenFrame]) -> None:
    x, y = place_of_longest_tracks(seen, (0.0, 0.0, MOUNT[2]))
    assert math.hypot(x - MOUNT[0], y - MOUNT[1]) < 0.05
    # The same at a hundred frames a second, most of which say nothing.
    slow = [one for frame in seen for one in (frame, *[replace(frame, turn_rad=0.0, distance_m=0.0)] * 4)]
    assert place_of_longest_tracks(slow, (0.0, 0.0, MOUNT[2])) == (x, y)
    start = (0.3, 0.1, 0.0)
    for still in ({"turn_rad": 0.0}, {"distance_m": 0.0}, {"turn_rad": None, "distance_m": None}):
        assert place_of_longest_tracks([replace(one, **still) for one in seen], start) == start[:2]
    assert place_of_longest_tracks([], start) == start[:2]


def test_what_does_not_settle_says_so(seen: list[SeenFrame], solve: partial[LogCalibration]) -> None:
    away = calibrate_lines(seen, lambda bearings, **_: moved(solve(bearings), x_m=30.0))
    assert not away.settled
    assert "does not settle" in away.doubt
    places = iter(np.linspace(0.0, 0.4, 9))
    assert not calibrate_lines(seen, lambda bearings, **_: moved(solve(bearings), x_m=float(next(places)))).settled
    with pytest.raises(InvalidInputError, match="no line is seen in 3 of 2 frames"):
        calibrate_lines(seen[:2], solve)
    with pytest.raises(InvalidInputError, match="no line is seen in 3 of 0 frames"):
        calibrate_lines([], solve)


def test_an_image_centre_that_is_off_does_not_move_the_mounting(drive: Drive, solve: partial[LogCalibration]) -> None:
    told = Camera.equidistant(width=360, height=360, focal_px=105.0, cx=181.5, cy=179.5, max_theta_rad=1.6)
    motions = [Motion(turn, distance) for distance, turn in drive.motions.tolist()]
    images = (drive.render(frame).gray for frame in range(len(drive)))
    seen = [one for one in see_lines(images, LineExtractor(told), motions=motions) if isinstance(one, SeenFrame)]
    found = calibrate_lines(seen, solve)
    plain = solve(found.bearings)
    assert found.whole
    assert np.abs(errors(found.whole)[:2]).max() < 0.004 < 0.02 < np.linalg.norm(errors(plain)[:2])
    assert plain.mounting.suspect == "centre"
    forward, left = found.whole.centre_off_rad
    assert math.hypot(forward, left) > 5.0 * math.hypot(*found.whole.centre_off_sigma_rad)


def test_lines_are_left_out_in_turn_for_the_covariance(seen: list[SeenFrame], solve: partial[LogCalibration]) -> None:
    found = calibrate_lines(seen, solve)
    plain, wide = solve(found.bearings, estimate_centre=True).mounting, found.whole.mounting
    more = wide.covariance_xy_yaw - plain.covariance_xy_yaw
    assert (wide.x_m, wide.y_m, wide.yaw_rad) == (plain.x_m, plain.y_m, plain.yaw_rad)
    assert np.linalg.eigvalsh(more).min() > -1e-15
    assert np.trace(more) > 0.0


def told(seen: list[SeenFrame], odometry: np.ndarray, base_m: float) -> list[SeenFrame]:
    """The frames with the motions of other odometry (N, 2)."""
    turns, ways = (odometry[:, 1] - odometry[:, 0]) / base_m, odometry.mean(axis=1)
    motions = zip(seen, turns.tolist(), ways.tolist(), strict=True)
    return [replace(one, turn_rad=turn, distance_m=way) for one, turn, way in motions]


@pytest.mark.parametrize(
    ("reading", "misreading"),
    [
        ("wheels-swapped", "reflected"),
        ("wheels-negated", "reflected"),
        ("left-wheel-negated", "left wheel negated"),
        ("right-wheel-negated", "right wheel negated"),
        ("millimetres", "millimetres"),
        ("cumulative", "cumulative"),
    ],
)
def test_lines_tell_how_the_odometry_was_meant(
    drive: Drive, seen: list[SeenFrame], reading: str, misreading: str
) -> None:
    as_recorded = {"millimetres": 1e3 * drive.odometry, "cumulative": np.cumsum(drive.odometry, axis=0)}
    nothing = np.zeros((0, 3))
    harmed = as_recorded.get(reading)
    if harmed is None:  # What undoes the harm does it.
        harmed = DriveLog(drive.odometry, nothing, None).read_as(reading).odometry
    turns = line_turns(told(seen, harmed, drive.wheel_base_m))
    assert turns.misreading == misreading
    assert turns.turned_rad == pytest.approx(sum(abs(turn) for _, turn in LEGS), abs=0.4)
    assert turns.missed_rad[misreading] < 0.3 * turns.turned_rad
    read = DriveLog(harmed, nothing, None).read_as(reading).odometry
    assert line_turns(told(seen, read, drive.wheel_base_m)).misreading is None


def test_turns_that_are_as_told_or_not_known_are_no_misreading(drive: Drive, seen: list[SeenFrame]) -> None:
    for base in (0.7, 1.0, 1.3):
        turns = line_turns(told(seen, drive.odometry, base * drive.wheel_base_m))
        assert (turns.misreading, turns.reason) == (None, "")
    reversed_ = [replace(one, turn_rad=-(one.turn_rad or 0.0), distance_m=None) for one in seen]
    turns = line_turns(reversed_)
    assert turns.misreading == "reflected"
    assert set(turns.missed_rad) == {"", "reflected", "millimetres", "cumulative"}
    # Of a twentieth of a turn, of frames without lines, of none, and without odometry nothing is told.
    blind = [replace(one, lines=seen[0].lines, descriptors=0.0 * seen[0].descriptors) for one in reversed_]
    unknown = [replace(one, turn_rad=None) for one in seen]
    for few in (reversed_[:3], blind, seen[:1], [], unknown):
        assert line_turns(few).misreading is None


@pytest.mark.parametrize("late", [-2, -1, 0, 1])
def test_lines_tell_how_late_images_are(seen: list[SeenFrame], late: int) -> None:
    turns = np.roll([one.turn_rad or 0.0 for one in seen], -late).tolist()
    found = line_turns([replace(one, turn_rad=turn) for one, turn in zip(seen, turns, strict=True)])
    assert (found.late_frames, found.misreading) == (late, None)
    words = {-2: "2 frames earlier than", -1: "1 frame earlier than", 0: "", 1: "1 frame later than the odometry"}
    assert words[late] in found.reason
    assert (found.reason == "") == (late == 0)


def test_wheels_that_are_swapped_are_named(drive: Drive, seen: list[SeenFrame]) -> None:
    swapped = drive.odometry[:, ::-1].copy()
    solve = partial(
        calibrate, swapped, wheel_base_m=drive.wheel_base_m, bearing_sigma_rad=math.radians(0.05)
    )  # fmt: skip
    found = calibrate_lines(told(seen, swapped, drive.wheel_base_m), solve)
    assert not found.settled
    assert found.misreading == "reflected"
    for words in ("if read otherwise", "wheels swapped", "the image mirrored"):
        assert words in found.doubt


@pytest.mark.parametrize("share", [0.7, 1.05, 1.3])
def test_lines_tell_how_far_they_turn(drive: Drive, seen: list[SeenFrame], share: float) -> None:
    """The wheel base is told wrongly: tracks are those of the right one, and the whole log says which that is."""
    base_m = share * drive.wheel_base_m
    frames = told(seen, drive.odometry, base_m)
    assert line_turns(frames).turn_factor == (pytest.approx(share, rel=0.05) if abs(share - 1.0) > 0.1 else 1.0)
    solve = partial(calibrate, drive.odometry, wheel_base_m=base_m, bearing_sigma_rad=math.radians(0.05))
    found = calibrate_lines(frames, solve)
    assert found.settled
    assert found.whole.mounting.suspect == "wheel_base_m"
    assert found.whole.mounting.suspect_value == pytest.approx(drive.wheel_base_m, rel=0.06)


def test_after_a_jump_lines_are_followed_by_the_turn_that_they_tell(drive: Drive, seen: list[SeenFrame]) -> None:
    """A wheel slips by what turns the robot by six degrees: none of the tracks would go on, and nothing tell."""
    k = len(seen) // 2
    slipped = drive.odometry.copy()
    slipped[k, 1] += math.radians(6.0) * drive.wheel_base_m
    frames = told(seen, slipped, drive.wheel_base_m)
    solve = partial(
        calibrate, slipped, wheel_base_m=drive.wheel_base_m, bearing_sigma_rad=math.radians(0.05)
    )  # fmt: skip
    tracked = [one.tracked for one in calibrate_lines(frames, solve).frames]
    jumps = {i: one.jump_rad for i, one in enumerate(tracked) if one.jump_rad}
    assert jumps == {k: pytest.approx(math.radians(-6.0), abs=math.radians(1.0))}
    before, after = (set(one.track.tolist()) for one in tracked[k - 1 : k + 1])
    assert len(before & after) > 0.5 * len(after)


def moved(whole: LogCalibration, **place: float) -> LogCalibration:
    """A mounting that is elsewhere."""
    values = whole.to_dict()
    return LogCalibration.from_dict(values | {"mounting": values["mounting"] | place})
