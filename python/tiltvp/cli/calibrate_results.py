"""What `tiltvp calibrate` prints and writes: the mounting for people, as JSON, as a picture, for ROS and for URDF."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from cyclopts import Group, Parameter

from tiltvp.cli.options import Switch
from tiltvp.cli.tables import check_plot, finite
from tiltvp.cli.terminal import new_table, say, show
from tiltvp.errors import InvalidInputError
from tiltvp.files import check_output, write_whole
from tiltvp.streams.outputs.transforms import check_transform

if TYPE_CHECKING:
    from tiltvp import LogCalibration, MountingEstimate, SelfCalibrator
    from tiltvp.streams.outputs.transforms import StaticTransform


@dataclass(frozen=True)
class Calibration:
    """The filter after the last step, its estimate after each, and the whole log at once."""

    calibrator: SelfCalibrator
    history: Sequence[MountingEstimate]
    whole: LogCalibration


@Parameter(name="*", group=Group("Results"))
@dataclass(frozen=True, kw_only=True)
class ResultOptions:
    """Where results go, and how frames are called."""

    parent_frame: str = "base_link"
    """Name of the robot's frame, for the ROS transform."""
    child_frame: str | None = None
    """Name of the camera's frame, for the ROS transform; default is camera_optical with --robot-from-camera, of which
    roll and pitch are taken, and without it camera_mount, whose roll and pitch are not known."""
    height: float | None = None
    """Height of the camera in the robot's frame, metres, for the ROS transform."""
    transform: Path | None = None
    """File for the transform: .urdf (link and joint), .yaml, or .mcap (/tf_static of ROS 2)."""
    out: Path | None = None
    """File for everything that was found (.json)."""
    anyway: Switch = False
    """Print and write the transform even if the whole log says that it cannot be relied upon."""
    plot: Path | None = None
    """Picture of the filter's convergence, as figure 25 of Scaramuzza, Siegwart and Martinelli 2009 (.png)."""

    def check(self) -> None:
        """Refuses files that cannot be written, before any work is done."""
        if self.out is not None and self.out.suffix.lower() != ".json":
            raise InvalidInputError(f"--out {self.out}: ends in {self.out.suffix!r}, expected .json")
        if self.out is not None:
            check_output(self.out)
        if self.transform is not None:
            check_transform(self.transform)
        check_plot("--plot", self.plot)

    def tell(self, calibration: Calibration, robot_from_camera: str | None) -> None:
        """Prints and writes everything that was found, with a camera that was taken to sit so."""
        filtered, whole = calibration.calibrator.estimate, calibration.whole
        _show(filtered, whole)
        found_transforms = {}
        if whole or self.anyway:
            transform = self._transform(whole.mounting, robot_from_camera)
            found_transforms = {
                "ros_static_transform": transform.ros_command(), "urdf_joint": transform.urdf_joint(),
                "transform_not_known": list(transform.missing),
            }  # fmt: skip
            for text in filter(None, (transform.ros_command(), transform.urdf_joint(), transform.note)):
                say(text)
            if self.transform is not None:
                transform.write(self.transform)
        else:
            say("no transform, since the whole log cannot be relied upon: --anyway prints it")
        if self.plot is not None:
            _write_plot(calibration.history, self.plot)
        if self.out is not None:
            options = calibration.calibrator.options
            found = {
                "whole_log": whole.to_dict(),
                "filter": filtered.to_dict(),
                "options": {name: _plain(value) for name, value in options.items()},
            } | found_transforms
            text = json.dumps(finite(found), indent=1, allow_nan=False) + "\n"
            write_whole(self.out, text)

    def _transform(self, mounting: MountingEstimate, robot_from_camera: str | None) -> StaticTransform:
        from tiltvp.rotations import read_rotation
        from tiltvp.selfcalib import static_transform

        return static_transform(
            mounting, parent=self.parent_frame, child=self.child_frame, z_m=self.height,
            robot_from_camera=None if robot_from_camera is None else read_rotation(robot_from_camera),
        )  # fmt: skip


def _write_plot(history: Sequence[MountingEstimate], path: Path) -> None:
    from tiltvp import write_image
    from tiltvp.lab.plots.calibration import convergence
    from tiltvp.lab.plots.picture import figure_picture
    from tiltvp.selfcalib import convergence_table

    write_image(path, figure_picture(convergence(convergence_table(history)), dpi=110.0))


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _show(filtered: MountingEstimate, whole: LogCalibration) -> None:
    table = new_table(
        "The camera on the robot, with one standard deviation",
        ["", "x mm", "y mm", "yaw deg", "phi deg", "rho mm", "psi deg"],
        left=[""],
    )
    for name, e in (("filter", filtered), ("whole log", whole.mounting)):
        plane, polar = (np.sqrt(np.diag(c)) for c in (e.covariance_xy_yaw, e.covariance_phi_rho_psi))
        cells = [
            _cell(1e3 * e.x_m, 1e3 * plane[0]), _cell(1e3 * e.y_m, 1e3 * plane[1]), _degrees(e.yaw_rad, plane[2]),
            _degrees(e.phi_rad, polar[0]), _cell(1e3 * e.rho_m, 1e3 * polar[1]), _degrees(e.psi_rad, polar[2]),
        ]  # fmt: skip
        table.add_row(name, *cells)
    show(table)
    for name, reason in (("filter", filtered.reason), ("whole log", whole.reason)):
        say(f"{name}: {reason}")
    e = whole.mounting
    say(
        f"whole log: {whole.bearings} bearings, {whole.outliers} outliers, residual {whole.residual_rms:.2f} sigma, "
        f"{e.contradicted_motions} of {e.motions} motions and {e.contradicted_turns} of {e.turns} turns contradicted"
    )
    say(f"noise: bearings {np.degrees(whole.bearing_sigma_rad):.3g} deg, odometry K {whole.odometry_k_m:.2g} m")
    if whole.wheel_base_sigma_m > 0.0:
        say(
            f"wheels: base {1e3 * whole.wheel_base_m:.2f} +- {1e3 * whole.wheel_base_sigma_m:.2f} mm, "
            f"right / left {whole.right_over_left:.5f} +- {whole.right_over_left_sigma:.5f}"
        )
    if whole.time_offset_sigma_s > 0.0:
        say(f"bearings are later by {whole.time_offset_s:.4f} +- {whole.time_offset_sigma_s:.4f} s")


def _cell(value: float, sigma: float) -> str:
    return f"{value:.2f} +- {sigma:.2f}"


def _degrees(value: float, sigma: float) -> str:
    return _cell(float(np.degrees(value)), float(np.degrees(sigma)))
