"""How often calibrations from pictures are wrong and sure, where drives mislead, and how often they name the cause."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from threading import Event
from typing import Any

import numpy as np
import polars as pl

from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.hostile_drives import HostileDrive
from tiltvp.lab.datasets.hostile_pictures import PICTURE_CASES, PictureDrive, told_drive
from tiltvp.lab.datasets.new import in_order
from tiltvp.lab.evaluation.calibration import START_SIGMA
from tiltvp.lab.evaluation.calibration_images import (
    MOUNTING,
    PictureExperiment,
    drive_images,
    lines_of,
    picture_start,
    room_drive,
)
from tiltvp.lab.evaluation.hostile_drives import judged, judged_refusal
from tiltvp.line_calibration import calibrate_lines
from tiltvp.rotations import about_vertical
from tiltvp.selfcalib import SelfCalibrator, calibrate

__all__ = ["judge_picture_drives"]

_BUMP_RAD = math.radians(4.0)


def judge_picture_drives(
    experiment: PictureExperiment,
    cases: Sequence[str],
    *,
    threads: int = 1,
    advance: Callable[[], None] = lambda: None,
) -> pl.DataFrame:
    """Two rows for each case of each drive of an experiment, as of `judge_drives`; `seed` is that of the drive.

    Images are rendered on so many threads, and cases are judged on them. No bound is known: `worst` is zero. `advance`
    is called after each case.
    """
    rows: list[dict[str, Any]] = []
    for kind, lean_deg, seed in experiment.cases:
        rendered = partial(_rendered, experiment, kind, lean_deg, seed, threads)
        driven = rendered()

        def rows_of(case: str, driven: PictureDrive = driven, rendered: Any = rendered, seed: int = seed) -> Any:
            made = PICTURE_CASES[case]
            drive = driven
            if made.legs is not None:
                drive = rendered(legs=made.legs)
            if made.is_bumped:
                drive = _bumped(driven, rendered, seed)
            return _judged(told_drive(drive, case, seed), case, seed)

        with in_order(rows_of, cases, threads, Event()) as found:
            for pair in found:
                rows += pair
                advance()
    return pl.DataFrame(rows)


def _rendered(
    experiment: PictureExperiment, kind: str, lean_deg: float, seed: int, threads: int, **other: Any
) -> PictureDrive:
    drive = room_drive(experiment, kind, lean_deg, seed, threads=threads, **other)
    return PictureDrive(
        drive_images(drive, threads), drive.odometry, drive.camera, drive.wheel_base_m, np.array(MOUNTING)
    )


def _bumped(driven: PictureDrive, rendered: Callable[..., PictureDrive], seed: int) -> PictureDrive:
    """The camera turned half-way; not moved, for a drive is planned so that the camera fits in."""
    turn = _BUMP_RAD * float(np.random.default_rng((seed, 18)).choice([-1.0, 1.0]))
    after, half = rendered(robot_from_camera=about_vertical(turn)), len(driven.images) // 2
    return replace(
        driven, images=[*driven.images[:half], *after.images[half:]], mounting=driven.mounting + [0.0, 0.0, turn]
    )


def _judged(drive: PictureDrive, case: str, seed: int) -> list[dict[str, Any]]:
    """The rows of the filter and of the whole log."""
    start = picture_start(seed)
    item = HostileDrive(
        case, seed, drive.odometry, np.zeros((0, 3)), {"wheel_base_m": drive.wheel_base_m}, drive.mounting,
        np.diag(np.full(3, np.inf)),
    )  # fmt: skip
    try:
        seen = list(lines_of(drive.images, drive.camera, drive.odometry, drive.wheel_base_m))
        sigma_rad = float(np.median(np.concatenate([one.lines.sigma_rad for one in seen])))
        options = item.options | {"start": start, "start_sigma": START_SIGMA, "bearing_sigma_rad": sigma_rad}
        usual = SelfCalibrator(**options).options
        options |= {name: factor * usual[name] for name, factor in drive.factors.items()}
        item = replace(item, options=options)
        found = calibrate_lines(seen, partial(calibrate, drive.odometry, **options), start=start)
    except InvalidInputError as error:
        return [judged_refusal(item, by, error) for by in ("filter", "whole log")]
    calibrator = SelfCalibrator(**options)
    calibrator.follow(drive.odometry, found.bearings)
    latest = calibrator.estimate
    return [
        judged(item, "filter", latest, latest, doubt=found.doubt),
        judged(item, "whole log", found.whole, found.whole.mounting, doubt=found.doubt),
    ]
