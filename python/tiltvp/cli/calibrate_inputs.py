"""Where `tiltvp calibrate` has its log from: two tables, or the images of a drive and its odometry."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from cyclopts import Group, Parameter, validators

from tiltvp._core import CALIBRATION_METHODS, option_fields
from tiltvp.cli.declared_options import LibraryOptions, from_library
from tiltvp.cli.line_options import LineOptions
from tiltvp.cli.options import CameraOptions
from tiltvp.cli.sources import MotionOptions, SourceOptions
from tiltvp.cli.tables import check_ending, write_table
from tiltvp.cli.terminal import progress_bar, say
from tiltvp.cli.track import Drive, needed_turns, track_table
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp import Camera
    from tiltvp.drive_logs import DriveLog
    from tiltvp.streams import Frames

__all__ = ["DriveOptions", "PictureOptions", "log_of_images", "log_of_tables", "other_readings"]

_REMEDIES = {
    "reflected": ("wheels-swapped", "wheels-negated", "clockwise"),
    "left wheel negated": ("left-wheel-negated",),
    "right wheel negated": ("right-wheel-negated",),
}
"""What may mend a log that was misread, where it has another name."""

_FORMS = "ODOMETRY.csv BEARINGS.csv, or --images FOLDER --camera FILE --odometry ODOMETRY.csv"


@Parameter(name="*", group=Group("Drive"))
@dataclass(frozen=True, kw_only=True)
@from_library(
    {"SelfCalibrator": CALIBRATION_METHODS, "calibrate": ()},
    words={"odometry_k_m": "--odometry-k", "step_sigma_m": "--step-sigma", "start_distance_m": "--start-distance"},
    but=("wheel_base_m", "method", "estimate_odometry", "estimate_time_offset"),
)
class DriveOptions(LibraryOptions):
    """The robot, the mounting as it is thought to be, and how sure measurements are."""

    wheel_base: float
    """Distance between the wheels, metres."""
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """x and y in metres and yaw in radians of the mounting as it is thought to be."""
    start_sigma: tuple[float, float, float] | None = None
    """Their standard deviations."""
    bearing_sigma_deg: float | None = None
    """Standard deviation of a bearing; for images by default the median of what the lines' own are."""

    def of_filter(self) -> dict[str, Any]:
        """What `SelfCalibrator` takes."""
        return {name: value for name, value in self.given().items() if name != "max_iterations"} | self._wheels()

    def of_whole_log(self) -> dict[str, Any]:
        """What `calibrate` takes."""
        known = {field["name"] for field in option_fields("calibrate")}
        return {name: value for name, value in self.given().items() if name in known} | self._wheels()

    def _wheels(self) -> dict[str, float]:
        return {"wheel_base_m": self.wheel_base}


@Parameter(name="*", group=Group("From pictures"))
@dataclass(frozen=True, kw_only=True)
class PictureOptions:
    """The images of a drive, in place of a log of bearings."""

    images: str | None = None
    """Folder of images in the order of their names, glob pattern, video, or recording of ROS."""
    topic: str | None = None
    """The topic of a recording's images, where it has several."""
    track_frames_min: Annotated[int, Parameter(validator=validators.Number(gte=2))] = 3
    """A line counts if it is seen in so many images."""
    tracks: Path | None = None
    """Also write the lines of all images, as `tiltvp track` does: .csv, .json or .parquet."""

    def refuse(self, camera: CameraOptions | None, motion: MotionOptions) -> None:
        """Refuses what belongs to images where there are none."""
        motion.refuse("--images")
        for name, value in (("--camera", camera), ("--tracks", self.tracks), ("--topic", self.topic)):
            if value is not None:
                raise InvalidInputError(f"{name} without --images, which it is for")


def other_readings(misreading: str | None) -> tuple[str, ...]:
    """The words of `--read-as` to try for a log that fits in another reading only."""
    return () if misreading is None else _REMEDIES.get(misreading, (misreading,))


def log_of_tables(odometry: Path | None, bearings: Path | None, *, with_times: bool) -> DriveLog:
    """The log of a table of displacements and one of bearings."""
    from tiltvp.drive_logs import read_drive_log

    if odometry is None or bearings is None:
        raise InvalidInputError(f"calibrate: no log of bearings, expected {_FORMS}")
    log = read_drive_log(odometry, bearings)
    if with_times and log.times_s is None:
        raise InvalidInputError(f"{odometry}: no column time_s, expected one with --estimate-time-offset")
    return log


_CLOCK_FRAMES: Final = 120
"""Frames by which the delay is told: at 5 a second the first 24 seconds of a drive."""


def _bring_to_clock(
    frames: Frames, motion: MotionOptions, camera: Camera, rotation: NDArray[np.float64], wheel_base_m: float | None
) -> None:
    """Takes from the times of the frames by how much they are late. Raises `InvalidInputError` where nothing tells."""
    from tiltvp.streams import read_odometry
    from tiltvp.turning import frame_delay

    record = motion.odometry or frames.recording
    if frames.times_s is None or record is None:
        raise InvalidInputError(f"--estimate-time-offset with --images {frames.source}, whose times are not known")
    odometry = read_odometry(record, topic=motion.odometry_topic, wheels=motion.wheels(wheel_base_m))
    count = min(_CLOCK_FRAMES, len(frames.times_s))
    images = (frame.read() for frame in frames.sample(range(count)))
    found = frame_delay(images, frames.times_s[:count], odometry, camera, rotation)
    if not found:
        raise InvalidInputError(f"--estimate-time-offset with --images {frames.source}: {found.reason}")
    say(f"{frames.source}: frames are stamped {found.delay_s:.3f} +- {found.sigma_s:.3f} s late, which is mended first")
    frames.times_s = frames.times_s - found.delay_s


def log_of_images(
    pictures: PictureOptions,
    motion: MotionOptions,
    camera: CameraOptions | None,
    options: LineOptions,
    drive: DriveOptions,
    *,
    with_times: bool,
) -> tuple[DriveLog, float, int]:
    """The log of a drive's images: the lean of each, its lines, and whose they are.

    Also the median standard deviation of a bearing, radians, and how many images were bad. `with_times` asks for the
    times of the frames, which are brought to the odometry's clock first, by how the images turn. Writes the tracks
    where they are asked for. Tracks are predicted with the mounting as it is thought to be.
    """
    from tiltvp.drive_logs import DriveLog
    from tiltvp.line_logs import bearing_log, displacements
    from tiltvp.lines import LineTracker
    from tiltvp.streams import Motion

    source = str(pictures.images)
    if pictures.tracks is not None:
        check_ending(pictures.tracks)
    if camera is None:
        raise InvalidInputError(f"--images {source} without --camera, expected {_FORMS}")
    frames = SourceOptions(topic=pictures.topic).open([source])
    lens, options = camera.load(), camera.complete(options)
    if with_times:
        _bring_to_clock(frames, motion, lens, options.rotation(), drive.wheel_base)
    told = needed_turns(motion.motions(frames, drive.wheel_base))
    if told is None:
        raise InvalidInputError(f"--images {source} without --odometry, expected {_FORMS}")
    x_m, y_m, yaw_rad = drive.start
    extractor, tilt = options.extractor(lens, yaw_rad=yaw_rad), options.tilts(lens, yaw_rad=yaw_rad)
    looked = Drive(extractor, LineTracker(camera_m=(x_m, y_m)), tilt, told)
    with progress_bar(len(told.motions), "frames") as bar:
        nothing = np.zeros((0, 0), np.uint8)
        # A drive's images together are more than the memory holds.
        seen = [
            (frame.name, frame.time_s, replace(one, gray=nothing)) for frame, one in looked.followed(iter(frames), bar)
        ]
    bearings = bearing_log([one for _, _, one in seen], frames_min=pictures.track_frames_min)
    if not len(bearings):
        least = pictures.track_frames_min
        raise InvalidInputError(f"{source}: no line is seen in {least} of {len(told.motions)} frames")
    # From the robot's frame back to the camera's.
    bearings[:, 2] -= yaw_rad
    table = track_table([(one.number, name, time_s, one.tracked) for name, time_s, one in seen])
    if pictures.tracks is not None:
        write_table(table, pictures.tracks)
    say(f"{source}: {len(bearings)} bearings of {len(set(bearings[:, 1].tolist()))} lines")
    motions = [one or Motion() for one in told.motions]
    log = DriveLog(displacements(motions, wheel_base_m=drive.wheel_base), bearings, told.times_s)
    return log, float(np.median([row["sigma_rad"] for row in table.rows])), looked.bad
