"""Where a camera sits on a robot, from odometry and bearings of landmarks: step by step, or from a whole log."""

from __future__ import annotations

import math
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
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = [
    "CALIBRATION_METHODS",
    "CalibrationStep",
    "LogCalibration",
    "MountingEstimate",
    "SelfCalibrator",
    "calibrate",
    "consistency_band",
    "convergence_table",
    "ros_static_transform",
    "urdf_origin",
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


def ros_static_transform(
    mounting: MountingEstimate, *, parent: str = "base_link", child: str = "camera_mount", z_m: float = 0.0
) -> str:
    """The command that publishes the mounting in ROS 2: the child's frame is x, y, yaw of the parent's, z as given."""
    _frame_name("parent", parent)
    _frame_name("child", child)
    x, y, z, yaw = _finite(mounting.x_m, mounting.y_m, z_m, mounting.yaw_rad)
    return (
        f"ros2 run tf2_ros static_transform_publisher --x {x:.6f} --y {y:.6f} --z {z:.6f} "
        f"--yaw {yaw:.6f} --pitch 0 --roll 0 --frame-id {parent} --child-frame-id {child}"
    )


def urdf_origin(mounting: MountingEstimate, *, z_m: float = 0.0) -> str:
    """The `origin` element of a URDF joint from the robot's base to the camera's mount."""
    x, y, z, yaw = _finite(mounting.x_m, mounting.y_m, z_m, mounting.yaw_rad)
    return f'<origin xyz="{x:.6f} {y:.6f} {z:.6f}" rpy="0 0 {yaw:.6f}"/>'


def _finite(*numbers: float) -> tuple[float, ...]:
    if not all(math.isfinite(number) for number in numbers):
        raise InvalidInputError(f"mounting: {numbers}, expected finite numbers")
    return numbers


def _frame_name(what: str, name: str) -> None:
    if not name or not all(c.isalnum() or c in "_/" for c in name):
        raise InvalidInputError(f"{what} = {name!r}, expected the name of a frame: letters, digits, _ and /")
