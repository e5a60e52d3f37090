"""Gaps of odometry: nothing is made up in them, and a driver that was started again behind one is told."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tiltvp.errors import InvalidInputError
from tiltvp.streams import Odometry


def test_nothing_is_made_up_outside_and_in_gaps() -> None:
    times = np.array([0.0, 0.1, 0.2, 2.2, 2.3])
    odometry = Odometry.from_wheels(times, np.stack([times, times], axis=1), wheel_base_m=1.0)
    there = odometry.at([-0.1, 0.0, 0.15, 0.2, 1.0, 2.2, 2.3, 2.4])
    assert there.outside.tolist() == [True, *[False] * 6, True]
    assert there.in_gap.tolist() == [False] * 4 + [True] + [False] * 3
    assert np.isnan(there.distance_m).tolist() == (~there.known).tolist()
    assert odometry.between(0.15, 2.25).distance_m == pytest.approx(2.1), "wheels have counted through the gap"
    assert odometry.between(0.15, 1.0) is None
    for start in (-5.0, 1.0, math.nan):
        assert odometry.between(start, 2.25) is None, "nobody knows where it was"
    motions = odometry.motions([-0.1, 0.0, 1.0, 2.3])
    assert [motion and motion.distance_m for motion in motions] == [None, 0.0, None, 2.3]
    assert odometry.missing([-0.1, 0.0, 1.0, 2.4], ["a", "b", "c", "d"]) == (
        "odometry: from 0.000 to 2.300 s; 2 frames outside its span (a to d) "
        "and 1 frame in gaps of over 0.5 s by --odometry-gap (c)"
    )
    assert odometry.missing([0.0, 0.2], ["a", "b"]) is None
    with pytest.raises(InvalidInputError, match=r"no velocities from 0\.200 to 2\.200 s"):
        Odometry.from_velocities(times, times, times)


@pytest.mark.parametrize("kind", ["poses", "wheels"])
def test_a_driver_that_was_started_again_behind_a_gap_is_told(kind: str) -> None:
    """Its poses and counters are 0 again, and no step of a gap is too long for a robot."""
    times = np.concatenate([0.1 * np.arange(30), 4.0 + 0.1 * np.arange(30)])

    def made(way: np.ndarray) -> Odometry:
        if kind == "poses":
            return Odometry.from_poses(times, 0.3 + way, 0.0 * way, 0.0 * way)
        return Odometry.from_wheels(times, np.stack([way, way], axis=1))

    assert made(0.2 * times).notes == ()
    assert made(0.0 * times).notes == (), "a robot that stands"
    (told,) = made(np.where(times < 4.0, 0.2 * times, 0.2 * (times - 4.0))).notes
    assert "begins anew behind 1 gap, the first at 4.000 s" in told
