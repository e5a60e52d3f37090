"""How well a camera's extrinsics but its height are found on a rendered drive, and whether their covariance holds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import polars as pl

from tiltvp.errors import InvalidInputError
from tiltvp.extrinsics import Extrinsics
from tiltvp.line_calibration import calibrate_lines
from tiltvp.line_logs import SeenFrame, believed_leans, displacements, see_lines
from tiltvp.lines import LineExtractor
from tiltvp.robot_setup import TILT_OPTIONS
from tiltvp.selfcalib import calibrate
from tiltvp.streams import Motion
from tiltvp.tilt import TiltEstimator

if TYPE_CHECKING:
    from tiltvp.lab.datasets.recording import RecordedDrive
    from tiltvp.mounting import MountingTilt
    from tiltvp.streams.frames import Frames

__all__ = ["judged_extrinsics", "summarise_extrinsics"]

_FRAMES_MIN: Final = 3
"""Images in which a line that counts is seen, as of `tiltvp calibrate`."""
_QUANTILES: Final = {50: 4.351, 95: 11.070}
"""Chi-square of five degrees of freedom."""
_ERRORS: Final = ("x mm", "y mm", "roll deg", "pitch deg", "yaw deg")
_FACTORS: Final = np.array([1e3, 1e3, *[math.degrees(1.0)] * 3])


def judged_extrinsics(
    frames: Frames, motions: Sequence[Motion | None], drive: RecordedDrive, tilt: MountingTilt
) -> dict[str, object]:
    """Errors along and about the robot's axes, their NEES, and whether the answer is said to be reliable.

    The way of `tiltvp calibrate`: lines about the vertical of each image, from the mounting that the leans tell.
    """
    nothing: dict[str, object] = dict.fromkeys((*_ERRORS, "nees", "nees of place"))
    if not tilt:
        return nothing | {"reliable": False, "converged": False}
    camera, rotation = drive.camera, tilt.robot_from_camera
    estimator = TiltEstimator(camera, **TILT_OPTIONS, robot_from_camera=rotation)
    extractor = LineExtractor(camera, robot_from_camera=rotation)
    lean = believed_leans(estimator, extractor)
    told = [motion or Motion() for motion in motions]
    images = (frame.image for frame in frames)
    seen = [one for one in see_lines(images, extractor, tilt=lean, motions=told) if isinstance(one, SeenFrame)]
    base = drive.drive.wheel_base_m
    odometry = displacements(told, wheel_base_m=base)
    try:
        sigma_rad = float(np.median(np.concatenate([one.lines.sigma_rad for one in seen])))
        lines = calibrate_lines(
            seen,
            lambda bearings, **options: calibrate(
                odometry, bearings, wheel_base_m=base, bearing_sigma_rad=sigma_rad, **options
            ),
            frames_min=_FRAMES_MIN,
        )
    except InvalidInputError:
        return nothing | {"reliable": False, "converged": False}
    whole = lines.whole
    found = Extrinsics.of(whole, tilt)
    off = drive.robot_from_mounted_camera @ found.robot_from_camera.T
    place = np.array([drive.mount.x_m, drive.mount.y_m]) - found.place_m
    error = np.array([*place, off[2, 1], off[0, 2], off[1, 0]])
    plane = np.ix_((0, 1, 4), (0, 1, 4))
    row: dict[str, object] = dict(zip(_ERRORS, (_FACTORS * error).tolist(), strict=True))
    return row | {
        "nees": float(error @ np.linalg.solve(found.covariance, error)),
        "nees of place": float(error[[0, 1, 4]] @ np.linalg.solve(found.covariance[plane], error[[0, 1, 4]])),
        "reliable": bool(found) and not lines.doubt,
        "converged": whole.converged,
    }


def summarise_extrinsics(rows: pl.DataFrame) -> pl.DataFrame:
    """For each camera and floor, of the drives that are said to be reliable: rms errors, and the regions that hold."""
    reliable = pl.col("reliable")
    nees: Any = pl.col("nees").filter(reliable)
    return rows.group_by("looks", "floor", maintain_order=True).agg(
        pl.len().alias("drives"),
        (100.0 * pl.col("converged").mean()).alias("converged"),
        (100.0 * reliable.mean()).alias("reliable"),
        *((pl.col(name).filter(reliable) ** 2).mean().sqrt().alias(name) for name in _ERRORS),
        *((100.0 * (nees < limit).mean()).alias(f"in {share} %") for share, limit in _QUANTILES.items()),
        nees.mean().alias("NEES of 5"),
        pl.col("nees of place").filter(reliable).mean().alias("of x, y, yaw, 3"),
    )
