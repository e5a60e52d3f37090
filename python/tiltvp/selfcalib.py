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
from tiltvp.arguments import each_from

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
    "wheel_displacements",
]


def convergence_table(estimates: Sequence[MountingEstimate]) -> dict[str, NDArray[Any]]:
    """Columns (N,) with a value for each step: phi_rad, rho_m, psi_rad, x_m, y_m, yaw_rad, alarm, and `variance_...` of
    phi, rho, psi, x, y and yaw in squares of their units.
    """
    estimates = each_from(estimates, "estimates", "phi_rad", "MountingEstimate")
    names = ("phi_rad", "rho_m", "psi_rad", "x_m", "y_m", "yaw_rad")
    columns = {name: np.array([getattr(e, name) for e in estimates], dtype=np.float64) for name in names}
    for matrix, of in (("covariance_phi_rho_psi", ("phi", "rho", "psi")), ("covariance_xy_yaw", ("x", "y", "yaw"))):
        variances = np.array([np.diag(getattr(e, matrix)) for e in estimates], dtype=np.float64).reshape(-1, 3)
        columns |= {f"variance_{name}": variances[:, i] for i, name in enumerate(of)}
    return columns | {"alarm": np.array([e.alarm for e in estimates], dtype=bool)}
