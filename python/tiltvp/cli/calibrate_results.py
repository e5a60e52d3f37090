"""What `tiltvp calibrate` prints and writes: extrinsics for people, as JSON, pictures, transforms, a robot's file."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from cyclopts import Group, Parameter

from tiltvp.cli.option_words import typed
from tiltvp.cli.options import Switch, rotation_of
from tiltvp.cli.tables import check_file, check_plot, finite
from tiltvp.cli.terminal import complain, new_table, say, show
from tiltvp.errors import InvalidInputError
from tiltvp.files import check_output, write_whole
from tiltvp.streams.outputs.transforms import COVARIANCE_AXES, check_frames, check_transform

if TYPE_CHECKING:
    from tiltvp import Extrinsics, JoinedTilts, LogCalibration, MountingEstimate, Robot, SelfCalibrator
    from tiltvp.cli.calibrate_inputs import DriveOptions
    from tiltvp.cli.options import CameraOptions


@dataclass(frozen=True)
class Calibration:
    """Of one log: the filter after the last step, its estimate after each, and the whole log at once."""

    name: str
    calibrator: SelfCalibrator
    history: Sequence[MountingEstimate]
    whole: LogCalibration
    doubt: str = ""
    """Why the whole log's answer cannot be relied upon, beside what it says itself."""
    late_s: float = 0.0
    """What was taken from the times of frames before; the whole log's time offset is what is left of it."""
    left_out: str = ""
    """How many images were left out of the log, and why; empty: none."""

    @property
    def frames_late_s(self) -> float | None:
        """By how much frames are stamped late in all; None where that was not asked for."""
        return self.late_s - self.whole.time_offset_s if self.whole.time_offset_sigma_s > 0.0 else None

    def __bool__(self) -> bool:
        return bool(self.whole) and not self.doubt

    @property
    def reason(self) -> str:
        """Whether the whole log's answer can be relied upon, and why not, and what was left out, in a sentence."""
        return "; ".join(filter(None, (self.doubt, self.whole.reason, self.left_out)))


@Parameter(name="*", group=Group("Results"))
@dataclass(frozen=True, kw_only=True)
class ResultOptions:
    """Where results go, and how frames are called."""

    parent_frame: str = "base_link"
    """Name of the robot's frame, for transforms."""
    child_frame: str | None = None
    """Name of the camera's frame, for transforms; default is camera_optical where roll and pitch are known, and
    otherwise camera_mount."""
    height: float | None = None
    """Height of the camera in the robot's frame, metres: no drive tells it; by default that of a robot's file."""
    transform: Path | None = None
    """File for the transform: .urdf (link and joint), .yaml, .kalibr.yaml, or .mcap (/tf_static of ROS 2)."""
    robot_out: Path | None = None
    """The robot's file (.toml) that every command takes as its --camera, with all that was found."""
    out: Path | None = None
    """File for everything that was found (.json)."""
    anyway: Switch = False
    """Print and write the transform and the robot's file even if they cannot be relied upon."""
    plot: Path | None = None
    """Picture of the filter's convergence (.png)."""

    def check(self, camera: CameraOptions | None, mask: Path | None) -> None:
        """Refuses what cannot be written, before any work is done; with a mask the robot's file has one beside it."""
        from tiltvp.extrinsics import CHILD_FRAMES
        from tiltvp.robot import mask_path

        for child in CHILD_FRAMES if self.child_frame is None else [self.child_frame]:
            check_frames(self.parent_frame, child)
        if self.height is not None and not math.isfinite(self.height):
            raise InvalidInputError(f"--height = {self.height}, expected finite metres")
        check_file("--out", self.out, ".json")
        check_file("--robot-out", self.robot_out, ".toml")
        if self.robot_out is not None and camera is None:
            raise InvalidInputError(f"--robot-out {self.robot_out} without --camera, expected both")
        if self.robot_out is not None and mask is not None:
            check_output(mask_path(self.robot_out))
        if self.transform is not None:
            check_transform(self.transform)
        check_plot("--plot", self.plot)

    def settled(self, robot: Robot | None) -> Self:
        """With the height that a robot's file knows, where none was given."""
        return self if robot is None or self.height is not None else replace(self, height=robot.height_m)

    def tell(
        self,
        found: Sequence[Calibration],
        tilt: JoinedTilts | Robot | None,
        robot_from_camera: str | None,
        drive: DriveOptions,
    ) -> Extrinsics | None:
        """Prints and writes what was found; the extrinsics, None where no log tells them."""
        for one in found:
            _show(one, several=len(found) > 1)
        known = self._joined(found, tilt, robot_from_camera, drive)
        written: dict[str, Any] = {"logs": [_plain_log(one) for one in found]}
        transform = None
        if known is not None:
            _show_extrinsics(known)
            written["extrinsics"] = _plain_extrinsics(known)
        if known is not None and (known or self.anyway):
            transform = known.transform(parent=self.parent_frame, child=self.child_frame)
            written |= {
                "ros_static_transform": transform.ros_command(), "urdf_joint": transform.urdf_joint(),
                "transform_not_known": list(transform.missing),
            }  # fmt: skip
            for text in filter(None, (transform.ros_command(), transform.urdf_joint(), transform.note)):
                say(text)
        else:
            reasons = ["no log can be relied upon"] if known is None else known.reasons
            say(f"no transform: {'; '.join(reasons)}: --anyway prints it")
        if self.out is not None:
            write_whole(self.out, json.dumps(finite(written), indent=1, allow_nan=False) + "\n")
        if self.transform is not None and transform is not None:
            transform.write(self.transform)
        if self.plot is not None:
            _write_plot(found, self.plot)
        return known

    def write_robot(self, known: Extrinsics, robot: Robot | None, *, estimated: bool) -> None:
        """Writes the robot's file, or says why it is not written, and so where wheels were estimated."""
        assert self.robot_out is not None  # Else nobody asks.
        assert robot is not None  # There is a camera.
        reasons = [*known.reasons, *([] if known.measured else ["roll and pitch were not measured"])]
        if reasons and not self.anyway:
            complain(f"{self.robot_out}: not written: {'; '.join(reasons)}: --anyway writes it")
            return
        known.robot(robot).save(self.robot_out)
        without = "" if not reasons else ", without covariance, since it cannot be relied upon"
        say(f"{self.robot_out}: the robot's file{without}")
        if estimated:
            say(f"{self.robot_out}: its wheel base is as told, {robot.wheels.wheel_base_m:g} m, not as estimated")

    def _joined(
        self,
        found: Sequence[Calibration],
        tilt: JoinedTilts | Robot | None,
        robot_from_camera: str | None,
        drive: DriveOptions,
    ) -> Extrinsics | None:
        """What the logs that can be relied upon say together, or with --anyway all of them."""
        from tiltvp import Extrinsics, join_logs

        given = None if robot_from_camera is None else rotation_of(robot_from_camera)
        used = [one for one in found if one or self.anyway or len(found) == 1]
        if len(found) == 1:
            place: Any = found[0].whole
        elif not used:
            return None
        else:
            for one in found:
                if not one:
                    complain(f"{one.name}: {'joined all the same' if self.anyway else 'left out'}: {one.reason}")
            begun = {} if drive.start_sigma is None else {"start_sigma": drive.start_sigma}
            place = join_logs([one.whole for one in used], start=drive.start_known, **begun)
            say(place.reason if place.odd is None else f"{place.reason} (log {place.odd + 1}: {used[place.odd].name})")
        known = Extrinsics.of(place, tilt, robot_from_camera=given, height_m=self.height)
        doubts = [one.doubt for one in used if one.doubt]
        return replace(known, reasons=(*doubts, *known.reasons))


def _write_plot(found: Sequence[Calibration], path: Path) -> None:
    from tiltvp import write_image
    from tiltvp.lab.plots.calibration import convergence
    from tiltvp.lab.plots.picture import figure_picture
    from tiltvp.selfcalib import convergence_table

    tables = {one.name: convergence_table(one.history) for one in found}
    answers = {one.name: one.whole.mounting for one in found}
    write_image(path, figure_picture(convergence(tables, answers), dpi=110.0))


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _plain_log(one: Calibration) -> dict[str, object]:
    return {
        "name": one.name,
        "whole_log": one.whole.to_dict(),
        "doubt": one.doubt,
        "reason": one.reason,
        "frames_late_s": one.frames_late_s,
        "filter": one.calibrator.estimate.to_dict(),
        "options": {name: _plain(value) for name, value in one.calibrator.options.items()},
    }


def _plain_extrinsics(known: Extrinsics) -> dict[str, object]:
    return {
        "known": bool(known),
        "reasons": list(known.reasons),
        "robot_from_camera": known.robot_from_camera.tolist(),
        "place_m": known.place_m.tolist(),
        "height_m": known.height_m,
        "covariance_axes": list(COVARIANCE_AXES),
        "covariance": known.covariance.tolist(),
        "not_known": list(known.missing),
    }


def _show_extrinsics(known: Extrinsics) -> None:
    transform = known.transform()
    sigmas = dict(transform.sigmas)
    roll, pitch, yaw = np.degrees(transform.roll_pitch_yaw_rad)
    table = new_table(
        "Extrinsics, with one standard deviation along and about the robot's axes",
        ["x mm", "y mm", "z mm", "roll deg", "pitch deg", "yaw deg"],
    )
    turns = []
    for name, value in (("roll", roll), ("pitch", pitch), ("yaw", yaw)):
        if name in known.missing:
            turns.append("not known")
        else:
            turns.append(_cell(value, np.degrees(sigmas[name])) if name in sigmas else f"{value:.2f} as given")
    x, y = 1e3 * known.place_m
    z = "not known" if known.height_m is None else f"{1e3 * known.height_m:.2f} as given"
    table.add_row(_cell(x, 1e3 * sigmas["x"]), _cell(y, 1e3 * sigmas["y"]), z, *turns)
    show(table)


def _show(one: Calibration, *, several: bool) -> None:
    filtered, whole = one.calibrator.estimate, one.whole
    table = new_table(
        f"{one.name + ': the' if several else 'The'} camera on the robot, with one standard deviation",
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
    for name, reason in (("filter", filtered.reason), ("whole log", one.reason)):
        say(f"{name}: {typed(reason)}")
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
    if whole.centre_off_sigma_rad[0] > 0.0:
        both = np.degrees([whole.centre_off_rad, whole.centre_off_sigma_rad]).T
        forward, left = (f"{off:.3f} +- {sigma:.3f}" for off, sigma in both)
        say(f"image centre: off by {forward} degrees of a bearing forward in the camera, by {left} to its left")
    if whole.rolling_shutter_sigma_s[0] > 0.0:
        both = np.transpose([whole.rolling_shutter_s, whole.rolling_shutter_sigma_s])
        forward, left = (f"{late:.4f} +- {sigma:.4f}" for late, sigma in both)
        told = f"lines forward in the camera are seen {forward} late, those to its left {left}"
        say(f"rolling shutter: {told}: steps (seconds, with times)")
    if one.late_s and one.frames_late_s is not None:
        say(f"frames are stamped {one.frames_late_s:.4f} +- {whole.time_offset_sigma_s:.4f} s late in all")


def _cell(value: float, sigma: float) -> str:
    return f"{value:.2f} +- {sigma:.2f}"


def _degrees(value: float, sigma: float) -> str:
    return _cell(float(np.degrees(value)), float(np.degrees(sigma)))
