"""Logs that mislead: simulated drives read wrongly, disturbed, noisier than told, or too poor to tell anything."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp.extrinsics import START_SIGMA
from tiltvp.synth import SimulatedDrive, simulate_drive

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Table = NDArray[np.float64]

__all__ = ["DRIVE_CASES", "TOO_SHORT", "UNDISTURBED", "HostileDrive", "harmed_odometry", "hostile_drives"]

UNDISTURBED: Final = "as told"
BASE_M: Final = 0.4
SIGMA_RAD: Final = math.radians(0.5)
K_M: Final = 1e-5
"""The robot of Scaramuzza, Siegwart and Martinelli 2009, and the noise that the defaults assume."""
RHO_M: Final = (0.05, 0.35)
YAW_SIGMA_RAD: Final = 0.3
TOO_SHORT: Final = 15
"""Steps of a drive that tells nothing."""
_STEP_S: Final = 0.1
LATE_STEPS: Final = 2
"""0.2 s at ten steps a second."""
_RADIUS_PX: Final = 150.0
"""At which lines are seen."""
_ROWS: Final = 480
"""Of the images."""


@dataclass(frozen=True)
class HostileDrive:
    """A log, what is told of the robot, the true (x, y, yaw) and the bound (3, 3) that no estimator beats."""

    case: str
    seed: int
    odometry: Table
    bearings: Table
    options: dict[str, Any]
    truth: Table
    bound: Table
    asked: dict[str, bool] = field(default_factory=dict)
    """What else the whole log is asked for."""


@dataclass
class _Log:
    """A drive that is being harmed."""

    odometry: Table
    bearings: Table
    rng: np.random.Generator
    drive: SimulatedDrive | None
    mounting: Table
    options: dict[str, Any]


@dataclass(frozen=True)
class _Case:
    harm: Callable[[_Log], None] = lambda _: None
    kinds: tuple[str, ...] = ("paper", "alternating")
    noise: dict[str, Any] = field(default_factory=dict)
    told: dict[str, float] = field(default_factory=dict)
    asked: dict[str, bool] = field(default_factory=dict)


def _wheels(left: float, right: float, *, swapped: bool = False) -> _Case:
    def harm(log: _Log) -> None:
        log.odometry = (log.odometry[:, ::-1] if swapped else log.odometry) * [left, right]

    return _Case(harm)


def _scaled_bearings(factor: float) -> _Case:
    def harm(log: _Log) -> None:
        log.bearings[:, 2] *= factor

    return _Case(harm)


def _cumulative(log: _Log) -> None:
    log.odometry = np.cumsum(log.odometry, axis=0)


def _late(log: _Log) -> None:
    log.bearings[:, 0] += LATE_STEPS
    log.bearings = log.bearings[log.bearings[:, 0] < len(log.odometry)]


def _confused(log: _Log) -> None:
    """Two of the landmarks of a step change names, so that a tenth of all bearings is wrong."""
    for step in np.unique(log.bearings[:, 0]):
        here = np.flatnonzero(log.bearings[:, 0] == step)
        if log.rng.random() < 0.05 * len(here):
            one, other = log.rng.choice(here, 2, replace=False)
            log.bearings[[one, other], 2] = log.bearings[[other, one], 2]


def _merged(log: _Log) -> None:
    """Two landmarks have one name: twenty steps the one is seen, twenty the other."""
    hidden = np.where(log.bearings[:, 0] // 20 % 2 == 0, 1.0, 0.0)
    log.bearings = log.bearings[log.bearings[:, 1] != hidden]
    log.bearings[log.bearings[:, 1] == 1.0, 1] = 0.0


def _bumped(log: _Log) -> None:
    """Half-way the camera moves by 3 cm and turns by four degrees; the truth is where it is at the end."""
    way = log.rng.uniform(-math.pi, math.pi)
    turn = math.radians(4.0) * log.rng.choice([-1.0, 1.0])
    moved = log.mounting + [0.03 * math.cos(way), 0.03 * math.sin(way), turn]
    kind, seed = repr(log.drive).split('"')[1], int(repr(log.drive).split("seed=")[1].split(",")[0])
    after = simulate_drive(kind, seed=seed, mounting=tuple(moved), wheel_base_m=BASE_M).bearings
    late = after[:, 0] >= 0.5 * len(log.odometry)
    log.bearings[late] = after[late]
    log.mounting = moved


def _creeping(turn: float) -> _Case:
    """All along the drive the camera turns on, by so many degrees; the truth is where it is at the end."""

    def harm(log: _Log) -> None:
        by = math.radians(turn) * log.rng.choice([-1.0, 1.0])
        log.bearings[:, 2] -= by * log.bearings[:, 0] / (len(log.odometry) - 1)
        log.mounting = log.mounting + [0.0, 0.0, by]

    return _Case(harm)


def _slips(log: _Log) -> None:
    """Three times a wheel runs on by up to 15 cm."""
    for step in log.rng.choice(len(log.odometry), 3, replace=False):
        log.odometry[step, log.rng.integers(2)] += log.rng.uniform(0.05, 0.15)


def _off_centre(off_px: float) -> _Case:
    """Bearings are taken about a centre that is so far off."""

    def harm(log: _Log) -> None:
        way, radii = log.rng.uniform(-math.pi, math.pi), off_px / _RADIUS_PX
        sine, cosine = np.sin(log.bearings[:, 2]), np.cos(log.bearings[:, 2])
        log.bearings[:, 2] = np.arctan2(sine - radii * math.sin(way), cosine - radii * math.cos(way))

    return _Case(harm)


def _rolling(readout_s: float, **asked: bool) -> _Case:
    """Rows of an image are read one after another, in so many seconds: a line in one is seen later than in another.
    Which way rows run is another for each drive."""

    def harm(log: _Log) -> None:
        down, steps = log.rng.uniform(-math.pi, math.pi), log.bearings[:, :2].astype(int).tolist()
        seen = dict(zip(map(tuple, steps), log.bearings[:, 2].tolist(), strict=True))
        for row, (step, landmark) in zip(log.bearings, steps, strict=True):
            late = readout_s / _STEP_S * _RADIUS_PX / _ROWS * math.sin(row[2] - down)
            if (other := seen.get((step + (1 if late > 0.0 else -1), landmark))) is not None:
                row[2] += abs(late) * math.remainder(other - row[2], math.tau)

    return _Case(harm, asked=asked)


def _carpet(log: _Log) -> None:
    """For a quarter of the drive both wheels run up to a tenth farther than the robot goes, each for itself."""
    count = len(log.odometry)
    first = log.rng.integers(0, count - count // 4)
    log.odometry[first : first + count // 4] *= 1.0 + log.rng.uniform(0.0, 0.1, (count // 4, 2))


def _cut(log: _Log) -> None:
    log.odometry = log.odometry[:TOO_SHORT]
    log.bearings = log.bearings[log.bearings[:, 0] < TOO_SHORT]


DRIVE_CASES: Final = {
    UNDISTURBED: _Case(),
    "wheels swapped": _wheels(1.0, 1.0, swapped=True),
    "both wheels negated": _wheels(-1.0, -1.0),
    "bearings clockwise": _scaled_bearings(-1.0),
    "left wheel negated": _wheels(-1.0, 1.0),
    "right wheel negated": _wheels(1.0, -1.0),
    "bearings in degrees": _scaled_bearings(180.0 / math.pi),
    "lengths in millimetres": _wheels(1e3, 1e3),
    "cumulative": _Case(_cumulative),
    "wheel base +10 %": _Case(told={"wheel_base_m": 1.1 * BASE_M}),
    "wheel base -10 %": _Case(told={"wheel_base_m": 0.9 * BASE_M}),
    "wheel base +30 %": _Case(told={"wheel_base_m": 1.3 * BASE_M}),
    "wheel base -30 %": _Case(told={"wheel_base_m": 0.7 * BASE_M}),
    "sigma told 5 times too small": _Case(noise={"bearing_sigma_rad": 5.0 * SIGMA_RAD}),
    "sigma told 5 times too large": _Case(noise={"bearing_sigma_rad": 0.2 * SIGMA_RAD}),
    "K told 5 times too small": _Case(noise={"odometry_k_m": 5.0 * K_M}),
    "K told 5 times too large": _Case(noise={"odometry_k_m": 0.2 * K_M}),
    "bearings 0.2 s late": _Case(_late),
    "a tenth of the names wrong": _Case(_confused),
    "two landmarks merged": _Case(_merged),
    "camera bumped": _Case(_bumped),
    "camera creeps by 1 degree": _creeping(1.0),
    "camera creeps by 3 degrees": _creeping(3.0),
    "image centre off by 0.5 px": _off_centre(0.5),
    "image centre off by 1 px": _off_centre(1.0),
    "image centre off by 2 px": _off_centre(2.0),
    "rows read in 30 ms": _rolling(0.03),
    "rows read in 30 ms, estimated": _rolling(0.03, estimate_rolling_shutter=True),
    "wheels slip": _Case(_slips),
    "carpet": _Case(_carpet),
    "straight on only": _Case(kinds=("straight",)),
    "rotation only": _Case(kinds=("rotation",)),
    "arcs": _Case(kinds=("arcs",)),
    "too short": _Case(_cut),
}
"""Each case by its name. Of two trajectories even seeds drive the first, odd ones the second."""


def hostile_drives(case: str, seeds: range) -> Iterator[HostileDrive]:
    """The drives of a case, one for each seed, each with a mounting of its own; the start is told to be the origin."""
    made = DRIVE_CASES[case]
    for seed in seeds:
        rng = np.random.default_rng((seed, 16))
        rho, phi = rng.uniform(*RHO_M), rng.uniform(-math.pi, math.pi)
        mounting = np.array([rho * math.cos(phi), rho * math.sin(phi), YAW_SIGMA_RAD * rng.normal()])
        kind = made.kinds[seed % len(made.kinds)]
        drive = simulate_drive(kind, seed=seed, mounting=tuple(mounting), wheel_base_m=BASE_M, **made.noise)
        log = _Log(drive.odometry.copy(), drive.bearings.copy(), rng, drive, mounting, {"wheel_base_m": BASE_M})
        made.harm(log)
        bound = drive.cramer_rao_bound(start_sigma=START_SIGMA)
        options = log.options | made.told
        yield HostileDrive(case, seed, log.odometry, log.bearings, options, log.mounting, bound, made.asked)


def harmed_odometry(case: str, odometry: Table, rng: np.random.Generator) -> Table:
    """(N, 2): the odometry of a drive as a case has it that harms nothing else."""
    log = _Log(odometry.copy(), np.zeros((0, 3)), rng, None, np.zeros(3), {})
    DRIVE_CASES[case].harm(log)
    return log.odometry
