"""How good self-calibration is: on simulated drives against the bound of any estimator, and on real logs."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from tiltvp.drive_logs import read_drive_log
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.hostile_drives import BASE_M
from tiltvp.selfcalib import MountingEstimate, SelfCalibrator, calibrate
from tiltvp.synth import simulate_drive

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.synth import SimulatedDrive

__all__ = ["LOG_PARTS", "convergence", "read_logs", "real_logs", "simulated_drives", "summarise_drives"]

LOG_PARTS = 3
"""Answers for each log: the filter's, the whole log's, and that with the wheels estimated too."""
_WHOLE_DRIVE = 100_000
"""Poses that the filter keeps, so that loops close."""

_TRUE_POLAR = (-0.34, 0.23, 0.33)
_TRUE_PLANE = np.array([0.23 * math.cos(-0.34), 0.23 * math.sin(-0.34), -0.01])
"""The same mounting as x, y, yaw."""
START_ERRORS = (0.34, 0.03, 0.33)
"""Standard deviations of the errors of phi, rho, psi at the start."""
START_SIGMA = (0.2, 0.2, 0.6)
"""What the default filter is told about its start, as x, y, yaw."""
_CENSI_LANDMARKS = 10
_CENSI_EVERY = 4
"""Steps for each look: the scan matcher's noise makes a path longer than it was, and the map's scale, which the wheels
tell, too small by the share of the noise in a motion's square, 3 % over single steps."""
_DIVERGED = 10.0
"""Standard deviations of the bound beyond which a run counts as diverged."""


def simulated_drives(kind: str, method: str, runs: int, *, advance: Callable[[], None] = lambda: None) -> pl.DataFrame:
    """A row for each run: errors of x, y, yaw, phi, rho, psi, the bound's standard deviations of them, NEES, alarm.

    10 lines at unknown distances of 1 to 5 m, bearings of 0.5 degrees, K = 1e-5 m, start errors drawn with standard
    deviations of 0.34 rad, 0.03 m, 0.33 rad. Run i is that of seed i.
    """
    by_plane = _polar_by_plane(_TRUE_PLANE)
    rows = []
    for seed in range(runs):
        drive = simulate_drive(kind, seed=seed, wheel_base_m=BASE_M)
        *_, e = _estimates(drive, method, seed)
        bound = drive.cramer_rao_bound(start_sigma=START_SIGMA)
        error = np.array([e.x_m, e.y_m, e.yaw_rad]) - _TRUE_PLANE
        polar = np.array([e.phi_rad, e.rho_m, e.psi_rad]) - _TRUE_POLAR
        error[2], polar[0], polar[2] = (_wrapped(x) for x in (error[2], polar[0], polar[2]))
        limits = np.sqrt(np.concatenate([np.diag(bound), np.diag(by_plane @ bound @ by_plane.T)]))
        try:
            nees = float(error @ np.linalg.solve(e.covariance_xy_yaw, error))
        except np.linalg.LinAlgError:
            nees = math.inf
        names = ("x", "y", "yaw", "phi", "rho", "psi")
        row: dict[str, Any] = dict(zip((f"error_{n}" for n in names), np.concatenate([error, polar]), strict=True))
        row |= dict(zip((f"bound_{n}" for n in names), limits, strict=True))
        near = bool(np.all(np.abs(error) < _DIVERGED * limits[:3]))
        rows.append({"seed": seed, **row, "nees": nees, "diverged": not near, "alarm": e.alarm})
        advance()
    return pl.DataFrame(rows)


def _estimates(drive: SimulatedDrive, method: str, seed: int) -> Iterator[MountingEstimate]:
    """The mounting after each step of a drive, from a start whose errors the seed draws."""
    phi, rho, psi = np.array(_TRUE_POLAR) + np.random.default_rng(seed).normal(size=3) * START_ERRORS
    rho = max(rho, 0.05)
    start = np.array([rho * math.cos(phi), rho * math.sin(phi), phi + psi])
    sigma: Any = START_SIGMA
    if method == "paper":
        j = np.linalg.inv(_polar_by_plane(start))
        sigma = j @ np.diag(np.square(START_ERRORS)) @ j.T
    calibrator = SelfCalibrator(wheel_base_m=BASE_M, start=start, start_sigma=sigma, method=method)
    bearings = drive.bearings
    ends = np.searchsorted(bearings[:, 0], np.arange(len(drive.odometry) + 1))
    for (left, right), a, b in zip(drive.odometry, ends[:-1], ends[1:], strict=True):
        calibrator.step(left, right, bearings[a:b, 1], bearings[a:b, 2])
        yield calibrator.estimate


def convergence(
    kind: str, lines: int, runs: int, *, advance: Callable[[], None] = lambda: None
) -> dict[str, float | int | str]:
    """How far the robot drives until the default filter is right, by how many vertical lines it sees.

    After `position_m` of the path the error of x and y stays below 10 mm, after `yaw_m` that of the yaw below 0.5
    degrees, both rms over the runs; infinite where they do not. The last errors, in mm and degrees, are at the path's
    end. Starts and noise are those of `simulated_drives`.
    """
    errors, path = [], np.zeros(0)
    for seed in range(runs):
        drive = simulate_drive(kind, seed=seed, landmarks=lines, wheel_base_m=BASE_M)
        found = np.array([[e.x_m, e.y_m, e.yaw_rad] for e in _estimates(drive, "default", seed)])
        errors.append(found - _TRUE_PLANE)
        path = np.cumsum(np.abs(drive.odometry.mean(axis=1)))
        advance()
    square = np.mean(np.square(errors), axis=0)
    position_mm, yaw_deg = 1e3 * np.sqrt(square[:, 0] + square[:, 1]), np.degrees(np.sqrt(square[:, 2]))

    def after(error: NDArray[np.float64], limit: float) -> float:
        above = np.nonzero(error > limit)[0]
        return float(np.append(path, math.inf)[above[-1] + 1 if len(above) else 0])

    return {
        "trajectory": kind, "lines": lines, "runs": runs, "path m": float(path[-1]),
        "position_m": after(position_mm, 10.0), "yaw_m": after(yaw_deg, 0.5),
        "last mm": float(position_mm[-1]), "last deg": float(yaw_deg[-1]),
    }  # fmt: skip


def summarise_drives(table: pl.DataFrame) -> dict[str, float | int]:
    """Counts of all runs; mean NEES, and rms error over the bound's, of those that did not diverge."""
    good = table.filter(~pl.col("diverged"))
    ratio = {
        f"rms / bound {n}": math.sqrt(
            float(np.mean(np.square(good[f"error_{n}"].to_numpy())) / np.mean(np.square(good[f"bound_{n}"].to_numpy())))
        )
        if good.height
        else math.nan
        for n in ("x", "y", "yaw", "phi", "rho", "psi")
    }
    nees = float(np.mean(good["nees"].to_numpy())) if good.height else math.nan
    silent = table.filter((pl.col("nees") > 16.27) & ~pl.col("alarm")).height
    return {
        "runs": table.height,
        "diverged": table.height - good.height,
        "alarms": int(table["alarm"].sum()),
        "NEES (3)": nees,
        "beyond 99.9 % unalarmed": silent,
        **ratio,
    }


def _polar_by_plane(plane: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3): the derivatives of (phi, rho, psi) by (x, y, yaw)."""
    rho, phi = math.hypot(plane[0], plane[1]), math.atan2(plane[1], plane[0])
    c, s = math.cos(phi), math.sin(phi)
    return np.array([[-s / rho, c / rho, 0.0], [c, s, 0.0], [s / rho, -c / rho, 1.0]])


def _wrapped(angle: float) -> float:
    return math.remainder(angle, math.tau)


def real_logs(logs: Sequence[Log], *, advance: Callable[[], None] = lambda: None) -> pl.DataFrame:
    """Each log by the filter and from the whole log: errors against the nominal mounting in mm and degrees.

    `advance` is called `LOG_PARTS` times for each.
    """
    rows = []
    for name, start, odometry, bearings, truth, options in logs:
        calibrator = SelfCalibrator(**options, start=start, keyframes_max=_WHOLE_DRIVE)
        calibrator.follow(odometry, bearings)
        rows.append(_row(name, "filter", calibrator.estimate, truth))
        advance()
        whole = calibrate(odometry, bearings, **options, start=start)
        rows.append(_row(name, "whole log", whole.mounting, truth) | {"residual": whole.residual_rms})
        advance()
        wheels = calibrate(odometry, bearings, **options, start=start, estimate_odometry=True)
        rows.append(
            _row(name, "whole log, wheels too", wheels.mounting, truth)
            | {
                "residual": wheels.residual_rms,
                "base error mm": 1e3 * (wheels.wheel_base_m - options["wheel_base_m"]),
                "right / left": wheels.right_over_left,
            }
        )
        advance()
    return pl.DataFrame(rows, infer_schema_length=None)


Log = tuple[
    str, tuple[float, float, float], "NDArray[np.float64]", "NDArray[np.float64]", "NDArray[np.float64]", dict[str, Any]
]


def read_logs(folder: Path, *, only: str = "") -> list[Log]:
    """Victoria Park from two starts, the LEGO robot, and Censi's three mountings: those whose names hold `only`.

    `folder` holds victoria_park, brenner_lego and censi_khepera. Raises `InvalidInputError` for what is not there.
    """
    return list(_logs(folder, only))


def _logs(folder: Path, only: str) -> Iterator[Log]:
    for name, starts, options in (
        (
            "victoria_park",
            [(3.0, 0.0, 0.05), (2.0, -1.0, -0.1)],
            {"odometry_k_m": 1e-4, "start_sigma": (1.5, 1.5, 0.3), "start_distance_m": 15.0},
        ),
        (
            "brenner_lego",
            [(0.0, 0.0, 0.0)],
            {"odometry_k_m": 1e-3, "start_sigma": (0.1, 0.1, 0.3), "start_distance_m": 1.0},
        ),
    ):
        if only not in name:
            continue
        truth = _json(folder / name / "truth.json")
        log = read_drive_log(folder / name / "odometry.csv", folder / name / "bearings.csv")
        options |= {"wheel_base_m": truth["wheel_base_m"], "bearing_sigma_rad": truth["bearing_sigma_rad"]}
        for start in starts:
            nominal = np.array([truth["x_m"], truth["y_m"], truth["yaw_rad"]])
            yield f"{name} from {start}", start, log.odometry, log.bearings, nominal, options
    for name in ("lstraight", "l90", "lmov"):
        if only in f"censi {name}":
            yield _censi(folder / "censi_khepera", name)


def _json(path: Path) -> dict[str, Any]:
    return _records(path)[0]


def _records(path: Path) -> list[dict[str, Any]]:
    """The JSON values of a file, one after the other."""
    found: list[dict[str, Any]] = []
    at, decoder = 0, json.JSONDecoder()
    try:
        text = path.read_text(encoding="utf-8").strip()
        while at < len(text) or not found:
            value, at = decoder.raw_decode(text, at)
            while at < len(text) and text[at].isspace():
                at += 1
            found.append(value)
    except (OSError, ValueError) as error:
        raise InvalidInputError(f"{path}: cannot be read ({error}), expected JSON") from error
    return found


def _censi(folder: Path, name: str) -> Log:
    """A log of wheel rates, with bearings of invented landmarks as the sensor's recorded motions have them.

    The landmarks stand still against the sensor's recorded path, all seen from every pose; what the scan matcher got
    wrong counts as noise of the robot's steps, whose size is that of the motions' scatter about the published answer.
    """
    answer = _json(folder / f"{name}_results.json")
    steps = _records(folder / f"{name}.tuple")
    odometry = np.array(
        [[s["T"] * s["phi_l"] * answer["l_diam"] / 2.0, s["T"] * s["phi_r"] * answer["r_diam"] / 2.0] for s in steps]
    )
    pose, path = np.zeros(3), []
    for s in steps:
        dx, dy, turn = s["sm"]
        c, sn = math.cos(pose[2]), math.sin(pose[2])
        pose = pose + [c * dx - sn * dy, sn * dx + c * dy, turn]
        path.append(pose)
    poses = np.array(path)
    rng = np.random.default_rng(1)
    low, high = poses[:, :2].min(axis=0) - 0.8, poses[:, :2].max(axis=0) + 0.8
    places: list[NDArray[np.float64]] = []
    while len(places) < _CENSI_LANDMARKS:
        place = rng.uniform(low, high)
        if np.hypot(*(poses[:, :2] - place).T).min() > 0.15:
            places.append(place)
    rays = np.array(places)[None] - poses[:, None, :2]
    sigma = math.radians(0.05)
    angles = np.arctan2(rays[..., 1], rays[..., 0]) - poses[:, 2:] + sigma * rng.normal(size=rays.shape[:2])
    rows = [
        [step, landmark, math.remainder(angle, math.tau)]
        for step, row in enumerate(angles.tolist())
        if step % _CENSI_EVERY == 0
        for landmark, angle in enumerate(row)
    ]
    truth = np.array([answer["l_x"], answer["l_y"], answer["l_theta"]])
    start = (0.0, 0.0, round(answer["l_theta"] / (math.pi / 2)) * math.pi / 2)
    options = {
        "wheel_base_m": answer["axle"], "bearing_sigma_rad": sigma, "odometry_k_m": 1e-6, "step_sigma_m": 7e-4,
        "step_sigma_rad": 1.8e-3, "start_sigma": (0.05, 0.05, 0.4), "start_distance_m": 1.0,
    }  # fmt: skip
    return f"censi {name}", start, odometry, np.array(rows), truth, options


def _row(name: str, how: str, e: MountingEstimate, truth: NDArray[np.float64]) -> dict[str, Any]:
    sigma = np.sqrt(np.diag(e.covariance_xy_yaw))
    return {
        "log": name,
        "by": how,
        "x error mm": 1e3 * (e.x_m - truth[0]),
        "y error mm": 1e3 * (e.y_m - truth[1]),
        "yaw error deg": math.degrees(_wrapped(e.yaw_rad - truth[2])),
        "sigma x": 1e3 * sigma[0],
        "sigma y": 1e3 * sigma[1],
        "sigma yaw": math.degrees(sigma[2]),
        "alarm": "yes" if e.alarm else "",
        "residual": None,
        "base error mm": None,
        "right / left": None,
    }
