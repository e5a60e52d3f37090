"""Where a camera sits on a robot, from odometry and bearings of landmarks: step by step, or from a whole log."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tiltvp._core import (
    CALIBRATION_METHODS,
    CalibrationStep,
    LogCalibration,
    MountingEstimate,
    SelfCalibrator,
    calibrate,
    consistency_band,
    wheel_displacements,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from tiltvp.streams.outputs.transforms import StaticTransform

__all__ = [
    "CALIBRATION_METHODS",
    "CalibrationStep",
    "LogCalibration",
    "MountingEstimate",
    "SelfCalibrator",
    "calibrate",
    "consistency_band",
    "convergence_table",
    "static_transform",
    "wheel_displacements",
]


def convergence_table(estimates: Sequence[MountingEstimate]) -> dict[str, NDArray[Any]]:
    """Columns with a value for each step: phi_rad, rho_m, psi_rad, x_m, y_m, yaw_rad, `variance_...` of each, alarm."""
    names = ("phi_rad", "rho_m", "psi_rad", "x_m", "y_m", "yaw_rad")
    columns = {name: np.array([getattr(e, name) for e in estimates], dtype=np.float64) for name in names}
    for matrix, of in (("covariance_phi_rho_psi", ("phi", "rho", "psi")), ("covariance_xy_yaw", ("x", "y", "yaw"))):
        variances = np.array([np.diag(getattr(e, matrix)) for e in estimates], dtype=np.float64).reshape(-1, 3)
        columns |= {f"variance_{name}": variances[:, i] for i, name in enumerate(of)}
    return columns | {"alarm": np.array([e.alarm for e in estimates], dtype=bool)}


def static_transform(
    mounting: MountingEstimate,
    *,
    parent: str = "base_link",
    child: str | None = None,
    z_m: float | None = None,
    robot_from_camera: NDArray[np.float64] | None = None,
) -> StaticTransform:
    """The mounting as a transform for ROS, with the standard deviations of x, y and yaw.

    `robot_from_camera` (3, 3) is how the camera was taken to sit while bearings were measured; the estimated yaw turns
    it further, and the child is the camera's frame (`camera_optical`, z along the optical axis). Without one the child
    is a level frame at the camera (`camera_mount`), and roll and pitch are not known. Neither is z where `z_m` is None.
    Raises `InvalidInputError` for names that no frame can have and for a mounting that is not finite.
    """
    # They would double the time that importing the package takes.
    from tiltvp.rotations import about_vertical
    from tiltvp.streams.outputs.transforms import StaticTransform

    missing = (*(("z",) if z_m is None else ()), *(("roll", "pitch") if robot_from_camera is None else ()))
    place, turn = np.array([mounting.x_m, mounting.y_m, z_m or 0.0]), mounting.yaw_rad
    sigmas = np.sqrt(np.diag(mounting.covariance_xy_yaw)).tolist()
    return StaticTransform(
        parent,
        child or ("camera_mount" if robot_from_camera is None else "camera_optical"),
        place,
        about_vertical(turn) @ (np.eye(3) if robot_from_camera is None else np.asarray(robot_from_camera)),
        missing,
        tuple(zip(("x", "y", "yaw"), sigmas, strict=True)),
    )
