"""Roll and pitch of a mounting from a drive: what turns with the robot is the floor's, what stays is the mounting's."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tiltvp import Camera, TiltEstimate, TiltEstimator, TiltFilter, join_tilts, mounting_tilt
from tiltvp.errors import InvalidInputError
from tiltvp.rotations import about_vertical, levelling
from tiltvp.streams import Motion

SIGMA = math.radians(0.3)


@pytest.fixture(scope="module")
def template():
    """An estimate, of which the tilt is replaced."""
    camera = Camera.equidistant(width=64, height=48, focal_px=20.0, cx=31.5, cy=23.5)
    return TiltEstimator(camera)(np.zeros((48, 64), np.uint8)).to_dict()


def estimate(template: dict, normal: np.ndarray) -> TiltEstimate:
    x, y, z = normal / np.linalg.norm(normal)
    told = {
        "alpha_rad": math.atan2(math.hypot(x, y), z), "beta_rad": math.atan2(-y, -x), "normal": [x, y, z],
        "covariance_rad2": [[SIGMA**2, 0.0], [0.0, SIGMA**2]], "confidence": 0.99, "inlier_pixels": 500,
        "roll_rad": math.atan2(y, z), "pitch_rad": math.atan2(-x, math.hypot(y, z)), "stop": "converged",
    }  # fmt: skip
    return TiltEstimate.from_dict(template | told)


def drive(template, lean, slope, turns, seed=0):
    """Estimates and motions of a robot whose mounting makes it lean, on a floor that slopes."""
    rng = np.random.default_rng(seed)
    estimates, motions = [], []
    for heading, step in zip(np.cumsum(turns), turns, strict=True):
        floor = about_vertical(-heading) @ slope
        seen = levelling(lean).T @ floor + rng.normal(0.0, SIGMA, 3)
        estimates.append(estimate(template, seen))
        motions.append(Motion(yaw_rad=float(step), distance_m=0.5))
    return estimates, motions


def direction(x_deg: float, y_deg: float) -> np.ndarray:
    x, y = math.radians(x_deg), math.radians(y_deg)
    return np.array([x, y, math.sqrt(1.0 - x * x - y * y)])


TURNS = np.full(60, 2.0 * math.pi / 30)


def test_turns_tell_the_mounting_from_the_floor(template):
    lean, slope = direction(1.2, -0.7), direction(0.0, 1.5)
    found = mounting_tilt(*drive(template, lean, slope, TURNS), np.eye(3))
    assert found
    assert np.linalg.norm(found.lean.normal - lean) < 3.0 * found.sigma_rad < math.radians(1.2)
    # A robot that stands upright on a level floor has the camera's up straight up.
    np.testing.assert_allclose(found.robot_from_camera @ lean, [0.0, 0.0, 1.0], atol=4.0 * found.lean.sigma_rad)
    assert found.turned_rad == pytest.approx(59 * 2.0 * math.pi / 30, abs=1e-9) or found.turned_rad == math.tau
    assert (found.images, found.used) == (60, 60)


def test_the_mounting_that_was_given_is_corrected_and_not_replaced(template):
    given = about_vertical(0.4)
    found = mounting_tilt(*drive(template, direction(1.0, 0.0), direction(0.0, 0.0), TURNS), given)
    np.testing.assert_allclose(found.robot_from_camera, levelling(found.lean.normal) @ given, atol=1e-12)


def test_without_turns_it_is_not_told(template):
    found = mounting_tilt(*drive(template, direction(1.2, 0.0), direction(0.0, 1.0), np.zeros(60)), np.eye(3))
    assert not found
    assert "not told apart" in found.reason
    np.testing.assert_array_equal(found.robot_from_camera, np.eye(3))
    assert found.within(math.radians(0.5)) is None


def test_a_drive_whose_parts_contradict_each_other_tells_nothing(template):
    """Answers with deviations of more than was known before were taken for found, and off by four degrees."""
    estimates, motions = drive(template, direction(1.2, -0.7), direction(0.0, 3.0), TURNS)
    for turned in (lambda yaw: -yaw, math.degrees):
        found = mounting_tilt(estimates, [Motion(turned(one.yaw_rad), 0.5) for one in motions], np.eye(3))
        assert not found
        assert "parts of the drive contradict each other" in found.reason
        np.testing.assert_array_equal(found.robot_from_camera, np.eye(3))
        assert found.within(math.radians(30.0)) is None


def test_a_floor_that_is_said_to_be_level_needs_no_turn(template):
    lean = direction(1.2, 0.3)
    estimates, motions = drive(template, lean, direction(0.0, 0.0), np.zeros(60))
    found = mounting_tilt(estimates, motions, np.eye(3), level_floor=True)
    assert found
    assert math.degrees(np.linalg.norm(found.lean.normal - lean)) < 0.3


def test_a_tolerance_is_passed_failed_or_not_told(template):
    found = mounting_tilt(*drive(template, direction(2.0, 0.0), direction(0.0, 0.0), TURNS), np.eye(3))
    assert [found.within(math.radians(limit)) for limit in (5.0, 0.2, 2.0)] == [True, False, None]
    for limit in (0.0, math.nan, -1.0):
        with pytest.raises(InvalidInputError, match="tolerance_rad"):
            found.within(limit)


def test_images_without_a_tilt_are_counted(template):
    estimates, motions = drive(template, direction(1.0, 0.0), direction(0.0, 0.0), TURNS)
    found = mounting_tilt([None, TiltEstimate.from_dict(template), *estimates[2:]], motions, np.eye(3))
    assert (found.images, found.used) == (60, 58)
    nothing = mounting_tilt([None] * 60, motions, np.eye(3))
    assert not nothing
    assert "no image tells a tilt" in nothing.reason


def test_images_of_which_nobody_knows_the_way_are_left_out(template):
    """As `frame_motions` tells of those in a gap of the odometry; the next motion is that since the last known."""
    estimates, motions = drive(template, direction(1.0, 0.0), direction(0.0, 1.0), TURNS)
    motions[12] = Motion(yaw_rad=3.0 * TURNS[0], distance_m=1.5)
    without = mounting_tilt(estimates[:10] + estimates[12:], motions[:10] + motions[12:], np.eye(3))
    motions[10] = motions[11] = None
    found = mounting_tilt(estimates, motions, np.eye(3))
    assert (found.images, found.used) == (60, 58)
    assert found.lean == without.lean
    nothing = mounting_tilt(estimates, [None] * 60, np.eye(3))
    assert (bool(nothing), nothing.images, nothing.driven, nothing.used) == (False, 60, 0, 0)
    assert "the odometry tells of the time of none" in nothing.reason


def test_wide_robots_roll_far_in_a_turn(template):
    """A floor changes with the way of the wheels: of half a metre beside the middle it seemed to jump in each step."""
    lean, half_track_m, step = direction(1.2, -0.7), 0.5, math.tau / 36
    walk_rad = TiltFilter().options["walk_rad_per_sqrt_m"] * math.sqrt(half_track_m * step)
    off = {None: [], half_track_m: []}
    for seed in range(20):
        rng = np.random.default_rng(seed)
        floors = np.column_stack([np.cumsum(rng.normal(0.0, walk_rad, (72, 2)), axis=0), np.ones(72)])
        turned = [about_vertical(-step * k) @ floor for k, floor in enumerate(floors)]
        seen = [levelling(lean).T @ floor + rng.normal(0.0, SIGMA, 3) for floor in turned]
        estimates, motions = [estimate(template, normal) for normal in seen], [Motion(yaw_rad=step)] * 72
        for known, errors in off.items():
            found = mounting_tilt(estimates, motions, np.eye(3), half_track_m=known)
            errors.append(np.linalg.norm(found.lean.normal - lean))
    told, untold = (math.sqrt(np.mean(np.square(errors))) for errors in (off[half_track_m], off[None]))
    assert told < 0.7 * untold, (told, untold)


def test_what_does_not_fit_is_refused(template):
    estimates, motions = drive(template, direction(1.0, 0.0), direction(0.0, 0.0), TURNS)
    with pytest.raises(InvalidInputError, match="motions: 59, expected 60"):
        mounting_tilt(estimates, motions[1:], np.eye(3))
    with pytest.raises(ValueError, match="robot_from_camera"):
        mounting_tilt(estimates, motions, np.diag([1.0, 1.0, -1.0]))


def nees(found, lean):
    """The error's square in stated variances; 2 in the mean where these are right."""
    x, y = (found.lean.normal - lean)[:2]
    off = np.array([y, -x])
    return float(off @ np.linalg.solve(found.covariance_rad2, off))


def test_deviations_are_those_of_what_images_scatter_by(template):
    """Not of what they state: in a bright room they err by less."""
    lean, slope = direction(1.2, -0.7), direction(0.0, 1.5)
    sigmas = []
    for stated in (SIGMA, 4.0 * SIGMA):
        covariance = [[stated**2, 0.0], [0.0, stated**2]]
        found = []
        for seed in range(40):
            estimates, motions = drive(template, lean, slope, TURNS, seed)
            estimates = [TiltEstimate.from_dict(one.to_dict() | {"covariance_rad2": covariance}) for one in estimates]
            found.append(mounting_tilt(estimates, motions, np.eye(3)))
        # Images here have nothing in common that no turn averages out, as those of real places have.
        assert 0.25 < np.mean([nees(one, lean) for one in found]) < 2.0, stated
        sigmas.append(np.median([one.sigma_rad for one in found]))
    assert sigmas[1] < 1.5 * sigmas[0]


def test_at_one_heading_scatter_tells_nothing(template):
    """Images of one view err alike, however well they agree."""
    lean = direction(1.2, 0.3)
    one, motions = drive(template, lean, direction(0.0, 0.0), np.zeros(60))
    found = mounting_tilt([one[0]] * 60, motions, np.eye(3), level_floor=True)
    assert found.sigma_rad >= SIGMA
    assert found.shared_rad2[0, 0] == pytest.approx(SIGMA**2)


def test_a_drive_of_few_images_is_joined_as_it_is(template):
    """What its images share may be all that is known of it."""
    estimates, motions = drive(template, direction(1.2, 0.3), direction(0.0, 0.0), np.zeros(12))
    found = mounting_tilt(estimates, motions, np.eye(3), level_floor=True)
    np.testing.assert_array_equal(found.covariance_rad2, found.shared_rad2)
    for joined in (join_tilts([found]), join_tilts([found] * 3)):
        assert joined
        np.testing.assert_allclose(joined.covariance_rad2, found.covariance_rad2, rtol=1e-6)
        np.testing.assert_allclose(joined.robot_from_camera, found.robot_from_camera, atol=1e-12)


def test_deviations_are_no_less_than_the_filters_in_any_direction(template):
    """Over a level floor, told to be so, without a turn: images that tell the pitch far better than the roll."""
    estimates, motions = drive(template, direction(1.2, 0.3), direction(0.0, 0.0), np.zeros(60))
    told = [[(0.01 * SIGMA) ** 2, 0.0], [0.0, SIGMA**2]]
    estimates = [TiltEstimate.from_dict(one.to_dict() | {"covariance_rad2": told}) for one in [estimates[0]] * 60]
    found = mounting_tilt(estimates, motions, np.eye(3), level_floor=True)
    # A floor that is level to 0.05 degrees is all that tells the pitch.
    assert math.degrees(math.sqrt(found.covariance_rad2[1, 1])) >= 0.0499
    assert np.linalg.eigvalsh(found.covariance_rad2 - found.shared_rad2)[0] >= 0.0
