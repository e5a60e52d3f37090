"""How good self-calibration from pictures is: rendered drives along the paper's trajectory, tilt to mounting."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from threading import Event
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from tiltvp.lab.datasets.driving import drive_room
from tiltvp.lab.datasets.new import in_order
from tiltvp.lab.evaluation.calibration import START_ERRORS, START_SIGMA
from tiltvp.line_calibration import calibrate_lines
from tiltvp.line_logs import SeenFrame, see_lines
from tiltvp.lines import LineExtractor
from tiltvp.selfcalib import MountingEstimate, SelfCalibrator, calibrate
from tiltvp.streams import Motion
from tiltvp.synth import MIRROR_BLIND_RAD, Drive, drive_legs, mirror_camera
from tiltvp.tilt import TiltEstimator

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp._core import Camera

__all__ = [
    "MOUNTING", "PictureExperiment", "drive_images", "lines_of", "picture_drives", "picture_start",
    "room_drive",
]  # fmt: skip

_PHI_RAD, _RHO_M, _PSI_RAD = -0.34, 0.23, 0.33
"""The paper's mounting."""
MOUNTING = (_RHO_M * math.cos(_PHI_RAD), _RHO_M * math.sin(_PHI_RAD), _PHI_RAD + _PSI_RAD)
"""The same as x and y in metres and yaw in radians."""


@dataclass(frozen=True, kw_only=True)
class PictureExperiment:
    """Which drives are rendered: one for each kind, lean and seed."""

    kinds: tuple[str, ...] = ("hall", "corridor")
    leans_max_deg: tuple[float, ...] = (0.0, 3.0)
    drives: int = 2
    seed: int = 9101
    trajectory: str = "paper"
    samples: int = 2
    step_m: float = 0.038
    turn_max_rad: float = math.radians(3.0)

    @property
    def cases(self) -> list[tuple[str, float, int]]:
        """Kind, greatest lean in degrees, and seed of each drive."""
        seeds = range(self.seed, self.seed + self.drives)
        return [(kind, lean, seed) for kind in self.kinds for lean in self.leans_max_deg for seed in seeds]


def picture_drives(
    experiment: PictureExperiment, *, threads: int = 1, advance: Callable[[], None] = lambda: None
) -> pl.DataFrame:
    """Two rows for each drive, of the filter and the whole log: errors of phi, rho, psi, x, y, yaw, sigmas, NEES.

    Angles in degrees, lengths in mm. The mounting is the paper's with a start as far off as in the simulated drives;
    the tilt of each frame is estimated by `refined`. `advance` is called after each drive.
    """
    rows = []
    for kind, lean_deg, seed in experiment.cases:
        drive, start = room_drive(experiment, kind, lean_deg, seed, threads=threads), picture_start(seed)
        images = drive_images(drive, threads)
        seen = list(lines_of(images, drive.camera, drive.odometry, drive.wheel_base_m))
        sigma_rad = float(np.median(np.concatenate([one.lines.sigma_rad for one in seen])))
        options: dict[str, Any] = {
            "wheel_base_m": drive.wheel_base_m, "bearing_sigma_rad": sigma_rad,
            "start": start, "start_sigma": START_SIGMA,
        }  # fmt: skip
        found = calibrate_lines(seen, partial(calibrate, drive.odometry, **options), start=start)
        bearings, whole = found.bearings, found.whole
        calibrator = SelfCalibrator(**options)
        calibrator.follow(drive.odometry, bearings)
        case = {"kind": kind, "lean max": lean_deg, "seed": seed, "frames": len(drive), "bearings": len(bearings)}
        latest = calibrator.estimate
        for name, verdict, mounting in (("filter", latest, latest), ("whole log", whole, whole.mounting)):
            rows.append(case | {"by": name, "relied upon": "yes" if verdict else ""} | _errors(mounting))
        advance()
    return pl.DataFrame(rows)


def room_drive(
    experiment: PictureExperiment,
    kind: str,
    lean_max_deg: float,
    seed: int,
    *,
    threads: int,
    robot_from_camera: NDArray[np.float64] | None = None,
    legs: Any = None,
) -> Drive:
    """A drive through a room of a kind, with a camera that is turned, or other legs than the experiment's."""
    return Drive(
        drive_room(kind, seed, threads=threads),
        camera=mirror_camera(),
        mount=(*MOUNTING, 0.4),
        robot_from_camera=robot_from_camera,
        blind_rad=MIRROR_BLIND_RAD,
        legs=drive_legs(experiment.trajectory) if legs is None else legs,
        step_m=experiment.step_m,
        turn_max_rad=experiment.turn_max_rad,
        bumps_max_rad=math.radians(lean_max_deg),
        samples=experiment.samples,
        seed=seed,
        threads=threads,
    )


def drive_images(drive: Drive, threads: int) -> list[NDArray[np.uint8]]:
    """The frames (H, W) of a drive, rendered on so many threads."""
    with in_order(lambda k: drive.render(k, threads=1).gray, range(len(drive)), threads, Event()) as images:
        return list(images)


def picture_start(seed: int) -> tuple[float, float, float]:
    """Where the camera of a drive is thought to be: x and y in metres, yaw in radians."""
    phi, rho, psi = np.random.default_rng(seed).normal((_PHI_RAD, _RHO_M, _PSI_RAD), START_ERRORS)
    return max(rho, 0.05) * math.cos(phi), max(rho, 0.05) * math.sin(phi), phi + psi


def lines_of(
    grays: Iterable[NDArray[np.uint8]], camera: Camera, odometry: NDArray[np.float64], wheel_base_m: float
) -> Iterator[SeenFrame]:
    """The lines of the images (H, W) of a drive in the frame of the camera, about the vertical that each tells, with
    what the wheels say (N, 2)."""
    estimator, extractor = TiltEstimator(camera), LineExtractor(camera)
    motions = [
        Motion((right - left) / wheel_base_m, 0.5 * (left + right), (left, right)) for left, right in odometry.tolist()
    ]

    def tilt(gray: NDArray[np.uint8]) -> Any:
        estimate = estimator(gray)
        return estimate if estimate else None

    for seen in see_lines(grays, extractor, tilt=tilt, motions=motions):
        if isinstance(seen, Exception):
            raise seen
        yield seen


def _errors(e: MountingEstimate) -> dict[str, float | str]:
    x, y, yaw = MOUNTING
    plane = np.sqrt(np.diag(e.covariance_xy_yaw))
    error = np.array([e.x_m - x, e.y_m - y, math.remainder(e.yaw_rad - yaw, math.tau)])
    return {
        "phi": math.degrees(math.remainder(e.phi_rad - _PHI_RAD, math.tau)),
        "rho": 1e3 * (e.rho_m - _RHO_M),
        "psi": math.degrees(math.remainder(e.psi_rad - _PSI_RAD, math.tau)),
        "x": 1e3 * float(error[0]),
        "y": 1e3 * float(error[1]),
        "yaw": math.degrees(error[2]),
        "sigma x": 1e3 * float(plane[0]),
        "sigma y": 1e3 * float(plane[1]),
        "sigma yaw": math.degrees(float(plane[2])),
        "NEES": float(error @ np.linalg.solve(e.covariance_xy_yaw, error)),
        "alarm": "yes" if e.alarm else "",
    }
