"""Roll and pitch joined with x, y and yaw: the covariance, several logs of one robot, and when it abstains."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

import tiltvp
from tiltvp import Camera, Extrinsics, Robot, join_logs, join_tilts
from tiltvp.errors import InvalidInputError
from tiltvp.rotations import about_vertical, levelling, read_rotation
from tiltvp.selfcalib import consistency_band
from tiltvp.streams import Motion
from tiltvp.synth import simulate_drive

CAMERA = Camera.equidistant(width=64, height=48, focal_px=20.0, cx=31.5, cy=23.5)
LEAN = np.diag([4e-6, 1e-6])
TRUE = (0.23 * math.cos(-0.34), 0.23 * math.sin(-0.34), -0.01)
"""The mounting of simulated drives, the paper's."""
PLANE = np.array([[4e-6, 1e-6, 0.0], [1e-6, 2e-6, 1e-7], [0.0, 1e-7, 1e-6]])


@dataclass
class Place:
    """x, y and yaw of a log, as far as they are looked at."""

    x_m: float
    y_m: float
    yaw_rad: float
    covariance_xy_yaw: np.ndarray

    @property
    def mounting(self) -> Place:
        return self

    reason = "a log"


@dataclass
class Tilt:
    """Roll and pitch of a drive, likewise."""

    robot_from_camera: np.ndarray
    covariance_rad2: np.ndarray
    shared_rad2: np.ndarray
    known: bool = True
    reason = "a drive"

    def __bool__(self) -> bool:
        return self.known


def turn(vector: np.ndarray) -> np.ndarray:
    """(3, 3) of a small rotation vector."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) / angle * cross + (1.0 - math.cos(angle)) / angle**2 * cross @ cross


def test_the_covariance_is_that_of_the_errors() -> None:
    rng = np.random.default_rng(5)
    nominal, yaw = read_rotation("forward"), 0.8
    known = Extrinsics.of(Place(0.1, 0.2, yaw, PLANE), Robot(CAMERA, nominal, covariance_rad2=LEAN))
    assert known
    assert known.measured
    assert (known.missing, known.height_m) == (("z",), None)
    np.testing.assert_allclose(known.robot_from_camera, about_vertical(yaw) @ nominal, atol=1e-12)
    errors = []
    for _ in range(4000):
        x, y, turned = rng.multivariate_normal([0.1, 0.2, yaw], PLANE)
        lean = rng.multivariate_normal([0.0, 0.0], LEAN)
        true = about_vertical(turned) @ turn(np.array([*lean, 0.0])) @ nominal
        off = true @ known.robot_from_camera.T
        errors.append([x - 0.1, y - 0.2, off[2, 1], off[0, 2], off[1, 0]])
    drawn, scale = np.cov(np.array(errors).T), np.sqrt(np.diag(known.covariance))
    # Of 4,000 draws the correlations err by 0.016; seven of these are allowed.
    np.testing.assert_allclose(drawn / np.outer(scale, scale), known.covariance / np.outer(scale, scale), atol=0.11)


def test_what_is_not_known_is_named() -> None:
    place = Place(0.1, 0.2, 0.3, PLANE)
    bare = Extrinsics.of(place, height_m=0.4)
    assert (bare.missing, bare.measured, bool(bare)) == (("roll", "pitch"), False, True)
    assert bare.transform().child == "camera_mount"
    given = Extrinsics.of(place, robot_from_camera=read_rotation("forward"))
    assert (given.missing, given.measured, given.transform().child) == (("z",), False, "camera_optical")
    assert given.transform().covariance is None
    assert dict(given.transform().sigmas).keys() == {"x", "y", "yaw"}
    assert given.robot(Robot(CAMERA, np.eye(3))).covariance is None


def test_logs_are_weighed_and_compared() -> None:
    places = [Place(0.1, 0.0, 3.14, PLANE), Place(0.102, 0.001, -3.14, 4.0 * PLANE)]
    joined = join_logs(places, start_sigma=(1e3, 1e3, 1e3))
    assert joined
    assert joined.xy_yaw[0] == pytest.approx(0.1 + 0.002 / 5.0, abs=1e-5)
    assert abs(joined.xy_yaw[2]) > 3.139
    np.testing.assert_allclose(joined.covariance, 0.8 * PLANE, rtol=1e-3, atol=1e-15)
    assert joined.limit == pytest.approx(16.27, abs=0.01)
    moved = [*places, Place(0.1, 0.03, 3.14, PLANE)]
    joined = join_logs(moved)
    assert not joined
    assert joined.odd == 2
    assert "contradict" in joined.reason
    assert "without log 3" in joined.reason
    found = Extrinsics.of(joined, Robot(CAMERA, np.eye(3), covariance_rad2=LEAN))
    assert not found
    assert found.robot(Robot(CAMERA, np.eye(3))).covariance is None
    one = join_logs(places[:1])
    assert one
    np.testing.assert_allclose(one.covariance, PLANE, rtol=1e-9, atol=1e-15)


def test_what_is_not_to_be_relied_upon_stays_so() -> None:
    """A log or a drive that says so of itself makes no answer that can be relied upon."""
    drive = simulate_drive("alternating", seed=4)
    seen = drive.bearings[drive.bearings[:, 0] < 20]
    whole = tiltvp.calibrate(drive.odometry, drive.bearings, wheel_base_m=0.4)
    short = tiltvp.calibrate(drive.odometry[:20], seen, wheel_base_m=0.4)
    assert whole
    assert not short
    joined = join_logs([whole, short])
    assert joined.distance < joined.limit
    assert not joined
    assert joined.reason.endswith("they agree; log 2 by itself is not to be relied upon")
    assert not Extrinsics.of(join_logs([short]))
    untold = tiltvp.mounting_tilt([None] * 3, [Motion(distance_m=0.1)] * 3, np.eye(3))
    found = Extrinsics.of(whole, untold)
    assert found.reasons == (untold.reason,)
    assert found.robot(Robot(CAMERA, np.eye(3))).covariance is None


def test_the_start_counts_once() -> None:
    start, sigma = (0.1, 0.0, 0.0), (0.01, 0.01, 0.01)
    prior = np.diag(np.square(sigma))
    data = np.diag([1e-4, 2e-4, 3e-4])
    told = np.linalg.inv(np.linalg.inv(prior) + np.linalg.inv(data))
    values = [0.5 * (np.array(start) + np.array([0.12, 0.01, 0.02])) for _ in range(3)]
    joined = join_logs([Place(*value, told) for value in values], start=start, start_sigma=sigma)
    expected = np.linalg.inv(np.linalg.inv(prior) + 3.0 * np.linalg.inv(data))
    np.testing.assert_allclose(joined.covariance, expected, rtol=1e-9, atol=1e-15)
    with pytest.raises(InvalidInputError, match="no more is known"):
        join_logs([Place(*start, prior)] * 2, start=start, start_sigma=np.array(sigma) / 2.0)


def test_a_start_beyond_half_a_turn_is_the_same_start() -> None:
    # The logs turn to 3.13 from a start of pi, which -pi is too.
    places = [Place(0.2, -0.1, 3.13, PLANE), Place(0.201, -0.1, -3.14, PLANE)]
    sigma = (0.05, 0.05, 0.03)
    told = [join_logs(places, start=(0.2, 0.0, yaw), start_sigma=sigma).xy_yaw for yaw in (-math.pi, math.pi)]
    np.testing.assert_allclose(told[0], told[1], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(told[0][:2], [0.2005, -0.1], atol=1e-3)


def test_the_start_may_have_a_covariance() -> None:
    places = [Place(0.1, 0.0, 0.1, PLANE)] * 2
    sigma = np.array([0.01, 0.02, 0.03])
    by_sigma, by_covariance = (join_logs(places, start_sigma=told) for told in (sigma, np.diag(np.square(sigma))))
    np.testing.assert_allclose(by_covariance.xy_yaw, by_sigma.xy_yaw, rtol=1e-12)
    np.testing.assert_allclose(by_covariance.covariance, by_sigma.covariance, rtol=1e-12, atol=1e-20)
    asymmetric = np.eye(3) + np.eye(3, k=1)
    for other in (
        (0.1, 0.1),
        np.eye(2),
        (0.1, 0.1, 0.0),
        (0.1, 0.1, -0.1),
        (0.1, 0.1, math.nan),
        -np.eye(3),
        asymmetric,
    ):
        with pytest.raises(InvalidInputError, match=r"start_sigma = .*, expected three positive"):
            join_logs(places, start_sigma=other)
    for start in ((0.1, 0.1), (0.1, 0.1, math.nan)):
        with pytest.raises(InvalidInputError, match=r"start = .*, expected finite"):
            join_logs(places, start=start)


def test_tilts_are_joined_but_for_what_they_share() -> None:
    def tilted(x: float, y: float, known: bool = True) -> Tilt:
        rotation = levelling(np.array([x, y, math.sqrt(1.0 - x * x - y * y)])) @ read_rotation("forward")
        return Tilt(rotation, 2.0 * LEAN, LEAN, known)

    joined = join_tilts([tilted(0.010, 0.02), tilted(0.012, 0.022)])
    assert joined
    np.testing.assert_allclose(joined.covariance_rad2, 1.5 * LEAN)
    np.testing.assert_allclose(joined.robot_from_camera, tilted(0.011, 0.021).robot_from_camera, atol=1e-4)
    assert not join_tilts([tilted(0.010, 0.02), tilted(0.06, 0.02)])
    with pytest.raises(InvalidInputError, match="a drive"):
        join_tilts([tilted(0.0, 0.0, known=False)])
    one = tilted(0.010, 0.02)
    for count in (1, 2):
        alone = join_tilts([Tilt(one.robot_from_camera, LEAN, LEAN)] * count)
        np.testing.assert_allclose(alone.covariance_rad2, LEAN)
        np.testing.assert_allclose(alone.robot_from_camera, one.robot_from_camera, atol=1e-12)
    for nothing in (join_tilts, join_logs):
        with pytest.raises(InvalidInputError, match="none, expected one or more"):
            nothing([])


def test_joined_logs_of_simulated_drives_are_consistent() -> None:
    squared, agreed, apart = [], 0, []
    for seed in range(300, 320):
        logs = []
        for again in range(2):
            drive = simulate_drive("alternating", seed=2 * seed + again)
            logs.append(tiltvp.calibrate(drive.odometry, drive.bearings, wheel_base_m=0.4, start=(0.2, 0.0, 0.0)))
        joined = join_logs(logs, start=(0.2, 0.0, 0.0))
        agreed += bool(joined)
        apart.append(joined.distance)
        off = joined.xy_yaw - TRUE
        squared.append(off @ np.linalg.solve(joined.covariance, off))
    # Each fails once in a thousand times.
    for values in (squared, apart):
        low, high = consistency_band(0.999, 3, 20)
        assert low < np.mean(values) < high
    assert agreed >= 19


def test_a_log_that_is_given_twice_is_no_second_drive() -> None:
    drive = simulate_drive("alternating", seed=3)
    once, again = (tiltvp.calibrate(drive.odometry, drive.bearings, wheel_base_m=0.4) for _ in range(2))
    with pytest.raises(
        InvalidInputError, match=r"logs\[1\]: the same as one before, expected logs of different drives"
    ):
        join_logs([once, again])


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"robot_from_camera": "forward"}, "robot_from_camera"),
        ({"robot_from_camera": np.ones((3, 3))}, "robot_from_camera: no rotation"),
        ({"height_m": "a"}, "height_m = 'a', expected a number"),
    ],
)
def test_what_is_no_mounting_or_height_is_said(values: dict[str, object], told: str) -> None:
    with pytest.raises(InvalidInputError, match=told):
        Extrinsics.of(Place(*TRUE, PLANE), **values)  # type: ignore[arg-type]
