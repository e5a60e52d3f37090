"""How a robot of two wheels moves over a floor in continuous time: its place, its attitude, and what an inertial sensor
on it goes through."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp._core import leaning_from_upright, normal_from_alpha_beta
from tiltvp.rotations import about_vertical

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Rows = NDArray[np.float64]

__all__ = ["GRAVITY_M_S2", "RobotMotion"]

GRAVITY_M_S2: Final = 9.80665
_SPEED_M_S, _TURN_RAD_S = 0.35, math.radians(60.0)
"""Means along a leg, as of an indoor robot with a camera; the greatest are 1.875 times as much."""
_REST_S: Final = 0.3
"""Before the first leg and after each: the robot stands while the direction of its motion changes."""
_WAVES_M: Final = (0.9, 1.3, 2.1, 3.4)
"""Wavelengths of bumps along the wheels' way, no multiples of each other: a robot whose wheels are 0.35 m apart spans
those shorter than about twice that."""
_STEP_S: Final = 1e-3
"""Of central differences: a hundredth of the shortest bump's time or less."""


@dataclass(frozen=True, eq=False)
class RobotMotion:
    """Legs (distance, turn) that are driven one after the other, each from rest to rest, over a floor with bumps."""

    start: tuple[float, float, float]
    """x_m, y_m, yaw_rad."""
    legs: Rows
    """(L, 2): metres and radians of arcs."""
    wheel_base_m: float
    bumps_max_rad: float
    floor: tuple[float, float]
    """By how much the floor falls, and where to, from the first heading to the left; radians."""
    seed: int

    @cached_property
    def duration_s(self) -> float:
        """From the first rest to the end of the last."""
        return float(self._begins[-1])

    @cached_property
    def _lasts(self) -> Rows:
        """(L,): seconds of each leg."""
        return np.maximum(np.abs(self.legs[:, 0]) / _SPEED_M_S, np.abs(self.legs[:, 1]) / _TURN_RAD_S)

    @cached_property
    def _begins(self) -> Rows:
        """(L + 1,): when each leg begins, and when all is over."""
        return _REST_S + np.concatenate([[0.0], np.cumsum(self._lasts + _REST_S)])

    def _shares(self, times_s: Rows) -> Rows:
        """(N, L): the share of each leg that is done, without jerk at its ends."""
        f = np.clip((times_s[:, None] - self._begins[:-1]) / self._lasts, 0.0, 1.0)
        return np.asarray(f**3 * (10.0 + f * (6.0 * f - 15.0)))

    def rolled_m(self, times_s: Rows) -> Rows:
        """(N, 2): how far the left and the right wheel have rolled."""
        distance, turn = (self._shares(times_s) @ self.legs).T
        half = 0.5 * self.wheel_base_m * turn
        return np.stack([distance - half, distance + half], axis=1)

    def places(self, times_s: Rows) -> Rows:
        """(N, 3): x_m, y_m, yaw_rad of the robot, the yaw not wrapped."""
        place = np.tile(np.asarray(self.start, dtype=np.float64), (len(times_s), 1))
        for (distance, turn), share in zip(self.legs, self._shares(times_s).T, strict=True):
            half = 0.5 * turn * share
            chord = distance * share * np.sinc(half / np.pi)
            place += np.stack(
                [chord * np.cos(place[:, 2] + half), chord * np.sin(place[:, 2] + half), 2.0 * half], axis=1
            )
        return place

    def world_from_robot(self, times_s: Rows) -> Rows:
        """(N, 3, 3): the attitude: of the floor, of the heading on it, and of the bumps."""
        slope, where = self.floor
        floor = leaning_from_upright(normal_from_alpha_beta(slope, self.start[2] + where)).T
        leans = zip(self.places(times_s)[:, 2], *self._bumps(times_s).T, strict=True)
        return np.array([floor @ about_vertical(yaw) @ leaning_from_upright((-x, -y, 1.0)).T for yaw, x, y in leans])

    def _bumps(self, times_s: Rows) -> Rows:
        """(N, 2): slopes of the robot to its front and left against the floor, smooth along the way."""
        distance, turn = np.abs(self.legs).T
        way = self._shares(times_s) @ np.maximum(distance, 0.5 * self.wheel_base_m * turn)
        phases = np.random.default_rng((self.seed, 0xB)).uniform(0.0, 2.0 * math.pi, (len(_WAVES_M), 2))
        waves = np.sin(2.0 * math.pi * way[:, None, None] / np.array(_WAVES_M)[:, None] + phases)
        # The mean of waves is at most 1 in either direction, and together root 2.
        return np.asarray(math.tan(self.bumps_max_rad) / math.sqrt(2.0) * waves.mean(axis=1))

    def inertia(self, times_s: Rows, offset_m: tuple[float, float]) -> tuple[Rows, Rows]:
        """(N, 3) rates of turn in rad/s and (N, 3) specific forces in m/s^2 at a point on the robot, in its axes.

        The robot leans about the points above and below it.
        """
        before, now, after = (self._at(times_s + aside, offset_m) for aside in (-_STEP_S, 0.0, _STEP_S))
        turned = np.swapaxes(before[1], 1, 2) @ after[1]
        skew = (turned - np.swapaxes(turned, 1, 2)) / (4.0 * _STEP_S)
        rates = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
        acceleration = (before[0] - 2.0 * now[0] + after[0]) / _STEP_S**2
        felt = acceleration + (0.0, 0.0, GRAVITY_M_S2)
        return rates, np.einsum("nji,nj->ni", now[1], felt)

    def _at(self, times_s: Rows, offset_m: tuple[float, float]) -> tuple[Rows, Rows]:
        """(N, 3) the point's position and (N, 3, 3) the attitude."""
        places = self.places(times_s)
        cosine, sine = np.cos(places[:, 2]), np.sin(places[:, 2])
        x, y = offset_m
        level = [places[:, 0] + cosine * x - sine * y, places[:, 1] + sine * x + cosine * y, np.zeros(len(times_s))]
        return np.stack(level, axis=1), self.world_from_robot(times_s)
