"""`tiltvp calibrate`: where a camera sits on a robot, from the log of a drive."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter, validators

from tiltvp.cli.calibrate_inputs import log_of_images, log_of_tables
from tiltvp.cli.line_options import DrivingLineOptions
from tiltvp.cli.options import CameraOptions, Switch
from tiltvp.cli.results import check_ending, write_frame
from tiltvp.cli.terminal import new_table, say, show
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from tiltvp import LogCalibration, MountingEstimate

NOT_DETERMINED = 1
_LINES = DrivingLineOptions()


def calibrate(
    odometry_log: Path | None = None,
    bearings_log: Path | None = None,
    /,
    *,
    wheel_base: float,
    images: str | None = None,
    odometry: Path | None = None,
    camera: CameraOptions | None = None,
    options: DrivingLineOptions = _LINES,
    track_frames_min: Annotated[int, Parameter(validator=validators.Number(gte=2))] = 3,
    tracks: Path | None = None,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    start_sigma: tuple[float, float, float] | None = None,
    bearing_sigma_deg: float | None = None,
    odometry_k: float | None = None,
    step_sigma: float | None = None,
    step_sigma_deg: float | None = None,
    start_distance: float | None = None,
    method: str = "default",
    estimate_odometry: Switch = False,
    estimate_time_offset: Switch = False,
    parent_frame: str = "base_link",
    child_frame: str = "camera_mount",
    height: float = 0.0,
    out: Path | None = None,
    plot: Path | None = None,
) -> int:
    """Where a camera (or any sensor of bearings) sits on a robot, from a drive past landmarks.

    From two tables, ODOMETRY.csv BEARINGS.csv; or from pictures, --images FOLDER --camera FILE --odometry CSV: the lean
    of each, its vertical lines, and which line is which from image to image. Prints what the filter found step by step,
    and what the whole log says at once; exit code 1 if the drive has not determined everything or
    images could not be read.

    Parameters
    ----------
    odometry_log
        CSV with the columns step, delta_left_m, delta_right_m, and time_s if known.
    bearings_log
        CSV with the columns step, landmark, bearing_rad.
    wheel_base
        Distance between the wheels, metres.
    images
        Folder of images in the order of their names, glob pattern, or video.
    odometry
        CSV of the motion that led to each image: yaw_rad or yaw_deg, and distance_m; file, or one row for each image;
        left_m and right_m, what the wheels rolled, where that is recorded.
    track_frames_min
        A line counts if it is seen in so many images.
    tracks
        Also write the lines of all images, as `tiltvp track` does: .csv, .json or .parquet.
    start
        x and y in metres and yaw in radians of the mounting as it is thought to be.
    start_sigma
        Their standard deviations.
    bearing_sigma_deg
        Standard deviation of a bearing; for images by default the median of what the lines' own are.
    odometry_k
        Variance of a wheel's displacement for each metre of it, metres.
    step_sigma
        Standard deviation of each step's motion in either direction, whatever its length, metres.
    step_sigma_deg
        Standard deviation of each step's turn, whatever its size.
    start_distance
        Distance at which landmarks are thought to be, metres.
    method
        The filter: default, or paper.
    estimate_odometry
        From the whole log also the wheel base and which wheel runs farther.
    estimate_time_offset
        From the whole log also by how much the bearings are later than the odometry.
    parent_frame
        Name of the robot's frame, for the ROS transform.
    child_frame
        Name of the camera's frame, for the ROS transform.
    height
        Height of the camera in the robot's frame, metres, for the ROS transform and the URDF snippet.
    out
        File for everything that was found (.json).
    plot
        Picture of the filter's convergence, as the paper's figure 25 (.png).
    """
    from tiltvp import SelfCalibrator
    from tiltvp import calibrate as calibrate_log
    from tiltvp.selfcalib import convergence_table, ros_static_transform, urdf_origin

    for name, path, suffix in (("--out", out, ".json"), ("--plot", plot, ".png")):
        if path is not None and path.suffix.lower() != suffix:
            raise InvalidInputError(f"{name} {path}: ends in {path.suffix!r}, expected {suffix}")
    bad, bearing_sigma_rad = 0, None if bearing_sigma_deg is None else float(np.radians(bearing_sigma_deg))
    if images is None:
        for name, value in (("--odometry", odometry), ("--camera", camera), ("--tracks", tracks)):
            if value is not None:
                raise InvalidInputError(f"{name} without --images, which it is for")
        log = log_of_tables(odometry_log, bearings_log, with_times=estimate_time_offset)
    else:
        if odometry_log is not None:
            raise InvalidInputError(f"{odometry_log}: a log beside --images, expected one of them")
        if estimate_time_offset:
            raise InvalidInputError("--estimate-time-offset with --images, whose times are not known")
        if tracks is not None:
            check_ending(tracks)
        log, table, bad = log_of_images(
            images,
            camera,
            options,
            odometry,
            wheel_base_m=wheel_base,
            start=start,
            track_frames_min=track_frames_min,
        )
        if tracks is not None:
            write_frame(table, tracks)
        if bearing_sigma_rad is None:
            bearing_sigma_rad = float(np.median(table["sigma_rad"].to_numpy()))
        say(f"{images}: {len(log.bearings)} bearings of {len(set(log.bearings[:, 1].tolist()))} lines")
    common: dict[str, Any] = {
        "wheel_base_m": wheel_base,
        "start": start,
        "start_sigma": start_sigma,
        "bearing_sigma_rad": bearing_sigma_rad,
        "odometry_k_m": odometry_k,
        "step_sigma_m": step_sigma,
        "step_sigma_rad": None if step_sigma_deg is None else float(np.radians(step_sigma_deg)),
        "start_distance_m": start_distance,
    }
    calibrator = SelfCalibrator(**common, method=method)
    history = calibrator.follow(log.odometry, log.bearings)
    whole = calibrate_log(
        log.odometry, log.bearings, **common, times_s=log.times_s,
        estimate_odometry=estimate_odometry, estimate_time_offset=estimate_time_offset,
    )  # fmt: skip
    filtered = calibrator.estimate
    _show(filtered, whole)
    transform = ros_static_transform(whole.mounting, parent=parent_frame, child=child_frame, z_m=height)
    origin = urdf_origin(whole.mounting, z_m=height)
    say(transform)
    say(origin)
    if plot is not None:
        from tiltvp.plots.calibration import convergence

        partial = plot.with_name(f".{plot.stem}.partial.png")
        convergence(convergence_table(history)).savefig(partial, dpi=110)
        os.replace(partial, plot)
    if out is not None:
        found = {
            "whole_log": whole.to_dict(),
            "filter": filtered.to_dict(),
            "options": {name: _plain(value) for name, value in calibrator.options.items()},
            "ros_static_transform": transform,
            "urdf_origin": origin,
        }
        partial = out.with_name(f".{out.name}.partial")
        partial.write_text(json.dumps(_jsonable(found), indent=1, allow_nan=False) + "\n", encoding="utf-8")
        os.replace(partial, out)
    return 0 if whole and not bad else NOT_DETERMINED


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _jsonable(value: Any) -> Any:
    """The value with null for numbers that are not finite, which JSON does not know."""
    if isinstance(value, dict):
        return {key: _jsonable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_jsonable(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


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
    for name, e in (("filter", filtered), ("whole log", whole.mounting)):
        say(f"{name}: {e.reason}")
    say(
        f"whole log: {whole.bearings} bearings, {whole.outliers} outliers, residual {whole.residual_rms:.2f} sigma"
        f"{'' if whole.converged else ', not converged'}"
    )
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
