"""How well a mounting is found on rendered drives over level and sloping floors, and whether its covariance holds."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import polars as pl

from tiltvp.lab.datasets.ahead import AHEAD_CAMERAS, FORWARD
from tiltvp.lab.datasets.driving import OPEN_KINDS, drive_room
from tiltvp.lab.datasets.panoramas import paper_camera
from tiltvp.lab.datasets.recording import WHEEL_RADIUS_M, RecordedDrive
from tiltvp.lab.evaluation.extrinsics import judged_extrinsics
from tiltvp.mounting import MountingTilt, mounting_tilt
from tiltvp.robot_setup import TILT_OPTIONS, DriveTilts, drive_tilts, find_setup
from tiltvp.rotations import read_rotation
from tiltvp.streams import Wheels, frame_motions, open_frames
from tiltvp.tilt import TiltEstimator, TiltFilter
from tiltvp.turning import check_turns

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["CAMERAS", "CASES", "judge_mountings", "summarise_findings", "summarise_mountings"]

CAMERAS: Final = {
    "up": (paper_camera(), read_rotation("up")),
    "ahead": (AHEAD_CAMERAS["pinhole 80"], FORWARD),
}
CASES: Final = {"level": (0.0, 0.0), "1 degree": (1.0, 0.0), "1 degree, bumps": (1.0, 1.0)}
"""Floors by name: slope and greatest lean from bumps, degrees."""
METHODS: Final[dict[str, dict[str, Any]]] = {"segments": TILT_OPTIONS, "refined": {"method": "refined"}}
"""Options of the estimator by the name of its method: those of `find_setup`, and beside it the pixels'."""
_OFF_DEG: Final = 1.5
"""Roll and pitch of mountings are drawn up to this: as camera mounts of service robots are off (1 to 2 degrees)."""
_SAMPLES: Final = 2
"""Rays along each side of a pixel: with one, edges that are nearly upright in the image break into upright pieces, and
the roll of a camera that looks ahead errs by 0.04 to 0.07 degrees towards none. Real images do not do that."""
_QUANTILES: Final = {50: 1.386, 95: 5.991}
"""Chi-square of two degrees of freedom."""


def judge_mountings(
    drives: int, seed: int, *, advance: Callable[[], None] = lambda: None
) -> Iterator[dict[str, object]]:
    """A row for each of so many drives through rooms of all kinds, by each camera over each floor.

    Each is written as a recording and read as a user would: frames and wheels from it, the mounting by `find_setup`.
    """
    for number in range(drives):
        for looks in CAMERAS:
            for floor in CASES:
                with tempfile.TemporaryDirectory() as folder:
                    yield _judged(Path(folder) / "drive.mcap", number, seed, looks, floor)
                advance()


def _judged(path: Path, number: int, seed: int, looks: str, floor: str) -> dict[str, object]:
    camera, nominal = CAMERAS[looks]
    slope_deg, bumps_deg = CASES[floor]
    rng = np.random.default_rng((seed, number))
    roll, pitch = np.radians(rng.uniform(-_OFF_DEG, _OFF_DEG, 2))
    kind = OPEN_KINDS[number % len(OPEN_KINDS)]
    drive = RecordedDrive(
        drive_room(kind, seed + number), camera, robot_from_camera=nominal, mounting_rad=(roll, pitch),
        floor_slope_rad=(math.radians(slope_deg), rng.uniform(-math.pi, math.pi)),
        bumps_max_rad=math.radians(bumps_deg), samples=_SAMPLES, seed=seed + number,
    )  # fmt: skip
    drive.write(path)
    frames = open_frames(path)
    wheels = Wheels(wheel_base_m=drive.drive.wheel_base_m, wheel_radius_m=WHEEL_RADIUS_M)
    motions = frame_motions(frames, path, wheels=wheels).motions
    found = find_setup(frames, camera, motions)
    images = [frame.read() for frame in frames.sample(range(0, len(motions), 4))]
    headings = np.cumsum([0.0 if motion is None else motion.yaw_rad for motion in motions])[::4]
    swapped = check_turns(images, -headings, camera, nominal)
    row: dict[str, object] = {
        "room": kind, "looks": looks, "floor": floor, "direction": found.direction.given == _given(looks),
        "sure": found.sure_of_direction, "turns": bool(found.turns), "reversed told": swapped.reversed,
        "turns wrong": bool(found.turns and found.turns.reversed) or bool(swapped),
    }  # fmt: skip
    for method, options in METHODS.items():
        tilts = drive_tilts(frames, TiltEstimator(camera, **options, robot_from_camera=nominal), motions)
        mounting = mounting_tilt(tilts.estimates, tilts.motions, nominal)
        row |= _errors(f"{method} ", mounting, drive.robot_from_mounted_camera, nominal)
        row |= _leans(f"{method} ", tilts, drive, nominal)
    return row | judged_extrinsics(frames, motions, drive, found.mounting)


def _errors(
    prefix: str, found: MountingTilt, true: NDArray[np.float64], nominal: NDArray[np.float64]
) -> dict[str, object]:
    # What a robot that stands upright seems to lean by the nominal mounting.
    normal = nominal @ true.T @ np.array([0.0, 0.0, 1.0])
    if not found:
        return {f"{prefix}error_deg": None, f"{prefix}nees": None, f"{prefix}sigma_deg": None}
    # The turn about the robot's axes from the one to the other.
    off = np.array([[0.0, 1.0], [-1.0, 0.0]]) @ (found.lean.normal - normal)[:2]
    return {
        f"{prefix}error_deg": math.degrees(float(np.linalg.norm(off))),
        f"{prefix}nees": float(off @ np.linalg.solve(found.covariance_rad2, off)),
        f"{prefix}sigma_deg": math.degrees(found.sigma_rad),
    }


def _leans(prefix: str, tilts: DriveTilts, drive: RecordedDrive, nominal: NDArray[np.float64]) -> dict[str, object]:
    """Rms errors of the tilts of single images and of the filter, at the instants at which both answer."""
    # What the robot seems to lean by the nominal mounting.
    true = drive.tilts @ (nominal @ drive.robot_from_mounted_camera.T).T
    filtered, errors = TiltFilter(estimate_mounting=True), []
    for estimate, motion, normal in zip(tilts.estimates, tilts.motions, true, strict=True):
        if motion is not None:
            filtered.predict(motion.yaw_rad, motion.distance_m)
        if estimate is None:
            continue
        filtered.update(estimate)
        found = filtered.estimate
        if estimate and found:
            errors.append([float(np.sum((np.asarray(each.normal) - normal) ** 2)) for each in (estimate, found)])
    single, fused = np.degrees(np.sqrt(np.mean(errors, axis=0))).tolist() if errors else (None, None)
    return {f"{prefix}single_deg": single, f"{prefix}fused_deg": fused}


def _given(looks: str) -> str:
    return {"up": "+z", "ahead": "-y"}[looks]


def summarise_mountings(rows: pl.DataFrame) -> pl.DataFrame:
    """For each camera, floor and method: errors in degrees, regions that hold, answers; and in the median of the drives
    the rms errors of the tilt of a single image and of the filter."""
    tables = []
    for method in METHODS:
        error, nees = pl.col(f"{method} error_deg"), pl.col(f"{method} nees")
        tables.append(
            rows.group_by("looks", "floor", maintain_order=True).agg(
                pl.lit(method).first().alias("method"),
                pl.len().alias("drives"),
                (100.0 * error.is_not_null().mean()).alias("answered"),
                error.median().alias("median"),
                error.max().alias("worst"),
                (100.0 * (error < 0.1).mean()).alias("below 0.1"),
                *((100.0 * (nees < limit).mean()).alias(f"in {share} %") for share, limit in _QUANTILES.items()),
                pl.col(f"{method} sigma_deg").median().alias("1-sigma"),
                *(pl.col(f"{method} {tilts}_deg").median().alias(f"{tilts} rms") for tilts in ("single", "fused")),
            )
        )
    return pl.concat(tables)


def summarise_findings(rows: pl.DataFrame) -> pl.DataFrame:
    """For each camera: shares in per cent of drives whose direction was right and sure, and whose turns were told."""
    return rows.group_by("looks", maintain_order=True).agg(
        pl.len().alias("drives"),
        *((100.0 * pl.col(name).mean()).alias(name) for name in ("direction", "sure", "turns", "reversed told")),
        (100.0 * pl.col("turns wrong").mean()).alias("turns wrong"),
    )
