"""Where `tiltvp calibrate` has its log from: two tables, or the images of a drive and its odometry."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tiltvp.cli.frames import open_frames
from tiltvp.cli.line_options import LineOptions
from tiltvp.cli.options import CameraOptions
from tiltvp.cli.terminal import progress_bar
from tiltvp.cli.track import followed, track_table
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    import polars as pl

    from tiltvp.drive_logs import DriveLog

__all__ = ["log_of_images", "log_of_tables"]

_FORMS = "ODOMETRY.csv BEARINGS.csv, or --images FOLDER --camera FILE --odometry ODOMETRY.csv"


def log_of_tables(odometry: Path | None, bearings: Path | None, *, with_times: bool) -> DriveLog:
    """The log of a table of displacements and one of bearings."""
    from tiltvp.drive_logs import read_drive_log

    if odometry is None or bearings is None:
        raise InvalidInputError(f"calibrate: no log of bearings, expected {_FORMS}")
    log = read_drive_log(odometry, bearings)
    if with_times and log.times_s is None:
        raise InvalidInputError(f"{odometry}: no column time_s, expected one with --estimate-time-offset")
    return log


def log_of_images(
    source: str,
    camera: CameraOptions | None,
    options: LineOptions,
    odometry: Path | None,
    *,
    wheel_base_m: float,
    start: tuple[float, float, float],
    track_frames_min: int,
) -> tuple[DriveLog, pl.DataFrame, int]:
    """The log of a drive's images: the lean of each, its lines, and whose they are; the tracks; how many were bad.

    Tracks are predicted with the mounting (x_m, y_m, yaw_rad) as it is thought to be.
    """
    from tiltvp.drive_logs import DriveLog
    from tiltvp.line_logs import bearing_log, displacements
    from tiltvp.lines import LineTracker
    from tiltvp.odometry import read_odometry

    if camera is None or odometry is None:
        missing = "--camera" if camera is None else "--odometry"
        raise InvalidInputError(f"--images {source} without {missing}, expected {_FORMS}")
    lens = camera.load()
    x_m, y_m, yaw_rad = start
    extractor, tilt = options.extractor(lens, yaw_rad=yaw_rad), options.tilts(lens, yaw_rad=yaw_rad)
    tracker = LineTracker(camera_m=(x_m, y_m))
    frames = open_frames(source)
    motions = read_odometry(odometry, frames.files)
    with progress_bar(len(frames.files), "frames") as bar:
        seen = list(followed(frames, extractor, tracker, tilt, motions, bar))
    bearings = bearing_log(seen, frames_min=track_frames_min)
    if not len(bearings):
        raise InvalidInputError(f"{source}: no line is seen in {track_frames_min} of {len(frames.files)} frames")
    # From the robot's frame back to the camera's.
    bearings[:, 2] -= yaw_rad
    log = DriveLog(displacements(motions, wheel_base_m=wheel_base_m), bearings, None)
    tracks = track_table([(frame.number, str(frames.files[frame.number]), frame.tracked) for frame in seen])
    return log, tracks, len(frames.files) - len(seen)
