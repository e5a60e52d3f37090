"""Whole logs of drives of thousands of steps: what is as told is not suspected."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import tiltvp

WHEEL_BASE_M = 0.4
ODOMETRY_K_M = 1e-5
SIGMA_RAD = np.radians(0.5)
MOUNTING = np.array([0.2168, -0.0767, -0.01])
REACH_M = 8.0
SEEN = 10


def long_log(
    ways_m: NDArray[np.float64], turns_rad: NDArray[np.float64], seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The odometry and the bearings of a robot that drives and turns so in each step, among posts along its way."""
    rng = np.random.default_rng(seed)
    headings = np.cumsum(turns_rad)
    middles = headings - 0.5 * turns_rad
    places = np.cumsum(ways_m[:, None] * np.column_stack([np.cos(middles), np.sin(middles)]), axis=0)
    posts: list[NDArray[np.float64]] = []
    for place in places[::37]:
        angle = rng.uniform(-np.pi, np.pi)
        post = place + rng.uniform(1.5, 5.0) * np.array([np.cos(angle), np.sin(angle)])
        if all(np.hypot(*(post - other)) > 1.0 for other in posts):
            posts.append(post)
    half_m = 0.5 * WHEEL_BASE_M * turns_rad
    wheels_m = np.column_stack([ways_m - half_m, ways_m + half_m])
    read_m = wheels_m + rng.normal(size=wheels_m.shape) * np.sqrt(ODOMETRY_K_M * np.abs(wheels_m))
    bearings = []
    for step, (place, heading) in enumerate(zip(places, headings, strict=True)):
        cos, sin = np.cos(heading), np.sin(heading)
        away = np.array(posts) - place - np.array([[cos, -sin], [sin, cos]]) @ MOUNTING[:2]
        distances = np.hypot(*away.T)
        seen = [post for post in np.argsort(distances)[:SEEN] if distances[post] < REACH_M]
        angles = np.arctan2(away[seen, 1], away[seen, 0]) - heading - MOUNTING[2]
        angles += rng.normal(size=len(seen)) * SIGMA_RAD
        bearings.append(np.column_stack([np.full(len(seen), step), seen, (angles + np.pi) % (2.0 * np.pi) - np.pi]))
    return read_m, np.vstack(bearings)


def arc() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Most of a circle of 60 m, which closes no loop, in slight bends to and fro."""
    steps = np.arange(8000)
    return np.full(steps.size, 0.04), 0.04 / 60.0 + 0.02 * np.sin(2.0 * np.pi * steps * 0.04 / 3.0)


def squares() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rounds along squares of 6 m, whose corners begin and end at once."""
    steps = np.arange(2000)
    corner = steps % 150 >= 150 - 31
    bends = 0.02 * np.sin(2.0 * np.pi * steps * 0.04 / 3.0)
    return np.where(corner, 0.02, 0.04), np.where(corner, 0.5 * np.pi / 31, 0.0) + bends


@pytest.mark.slow
@pytest.mark.parametrize(("way", "seed"), [(arc, 2), (squares, 1), (squares, 5), (squares, 6)])
def test_nothing_is_suspect(way: Callable[[], tuple[NDArray[np.float64], NDArray[np.float64]]], seed: int) -> None:
    # Of these seeds another image centre, and late bearings, were suspected.
    odometry, bearings = long_log(*way(), seed)
    found = tiltvp.calibrate(odometry, bearings, wheel_base_m=WHEEL_BASE_M, odometry_k_m=ODOMETRY_K_M)
    mounting = found.mounting
    assert found.converged
    assert mounting.suspect is None, found.reason
    off = np.array([mounting.x_m, mounting.y_m, mounting.yaw_rad]) - MOUNTING
    # The 99.9 % quantile of chi-square of three numbers.
    assert off @ np.linalg.solve(mounting.covariance_xy_yaw, off) < 16.27


@pytest.mark.slow
def test_the_wheel_base_is_not_longer_than_it_is() -> None:
    # Each step has noise of a tenth of its turn.
    odometry, bearings = long_log(*arc(), seed=3)
    options = {"wheel_base_m": 0.38, "odometry_k_m": ODOMETRY_K_M}
    found = tiltvp.calibrate(odometry, bearings, estimate_odometry=True, **options)
    assert abs(found.wheel_base_m - WHEEL_BASE_M) < 3.0 * found.wheel_base_sigma_m
