"""The pictures of a drive as a log for `tiltvp calibrate`: the lean of each, its lines, and whose they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from cyclopts import Group, Parameter

from tiltvp.cli.calibrate_inputs import Solved, other_readings
from tiltvp.cli.declared_options import Whole
from tiltvp.cli.frame_checks import tell_setup_of
from tiltvp.cli.options import CameraOptions, Switch, at_least, given_words
from tiltvp.cli.sources import KeptOptions, MotionOptions, ending_at_interrupt
from tiltvp.cli.tables import check_ending, write_table
from tiltvp.cli.terminal import progress_bar, say, status
from tiltvp.cli.track import Drive, needed_turns, tell_jumps, track_table
from tiltvp.errors import InvalidInputError, counted
from tiltvp.images import read_mask

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp import Camera, MountingTilt, Robot
    from tiltvp.cli.calibrate_inputs import DriveOptions, LogOptions, Solve
    from tiltvp.cli.line_options import DrivingLineOptions, LineOptions
    from tiltvp.line_logs import SeenFrame
    from tiltvp.streams import FrameMotions, Frames, Wheels

__all__ = ["PictureLog", "PictureOptions"]

_SAME_DEG: Final = 1e-3
"""Turns that differ by less, as by their digits in a table, are the wheels' own."""


@Parameter(name="*", group=Group("From pictures"))
@dataclass(frozen=True, kw_only=True)
class PictureOptions:
    """Logs that are the images of a drive."""

    topic: str | None = None
    """The topic of a recording's images, where it has several."""
    track_frames_min: Annotated[Whole, at_least(2)] = 3
    """A line counts if it is seen in so many images."""
    tracks: Path | None = None
    """Also write the lines of all images, as `tiltvp track` does: .csv, .json or .parquet."""
    level_floor: Switch = False
    """The floor is level within 0.05 degrees: roll and pitch need no turn."""

    def refuse(self, motion: MotionOptions, lines: DrivingLineOptions) -> None:
        """Refuses what belongs to images where all logs are tables, of which the mounting may be told all the same."""
        replace(motion, wheel_base=None).refuse("pictures")
        words = [*given_words(self), *given_words(replace(lines, robot_from_camera=None, method=None))]
        words += [] if lines.method is None else ["--line-method"]
        if words:
            raise InvalidInputError(f"{words[0]} with logs that are tables, expected pictures, which it is for")


@dataclass(eq=False)
class PictureLog:
    """The images of one drive, and what the robot did between them."""

    frames: Frames
    moved: FrameMotions
    camera: Camera
    lines: LineOptions
    drive: DriveOptions
    pictures: PictureOptions
    wheels: Wheels
    topics: dict[str, str]
    sigma_rad: float | None = None
    """Median standard deviation of a bearing, once there is a log."""
    bad: int = 0
    """Images that could not be read."""
    late_s: float = 0.0
    """What was taken from the times of the frames, to bring them to the odometry's clock."""
    left_out: str = ""
    """How many images a frozen camera gave, once there is a log; empty: none."""

    @property
    def name(self) -> str:
        """What it is called."""
        return self.frames.source

    @classmethod
    def open(
        cls,
        source: str,
        pictures: PictureOptions,
        motion: MotionOptions,
        camera: CameraOptions | None,
        lines: LineOptions,
        drive: DriveOptions,
        robot: Robot | None,
        read: LogOptions,
    ) -> PictureLog:
        """Opens a drive, whose odometry is read as was told, before anything is made of it.

        Where the time offset is asked for, times are brought to the odometry's clock, by how the images turn.
        """
        if camera is None:
            raise InvalidInputError(f"{source}: pictures without --camera, expected the camera's calibration")
        if pictures.tracks is not None:
            check_ending(pictures.tracks)
        looked = KeptOptions(topic=pictures.topic).of_robot(robot, [source])
        lens = camera.load(looked.topic)
        frames = looked.open([source], lens)
        lines.extractor(lens), lines.tilts(lens)  # Refuses options before there is any work.
        motion = motion.of_robot(robot, frames)
        late_s = 0.0
        if read.estimate_time_offset:
            late_s = _bring_to_clock(frames, motion, lens, lines.mounting(lens), read.read_as)
        moved = needed_turns(motion.motions(frames, read.read_as))
        if moved is None:
            raise InvalidInputError(f"{source}: pictures without odometry, expected --odometry FILE")
        if not moved.distances_known:
            raise InvalidInputError(f"{source}: odometry without distances, expected columns that tell them too")
        if moved.times_s is not None and (falls := np.flatnonzero(np.diff(moved.times_s) < 0.0)).size and frames.names:
            before, after = frames.names[falls[0]], frames.names[falls[0] + 1]
            raise InvalidInputError(f"{after}: taken before {before}, expected frames in the order of their times")
        _tell_other_turns(source, moved, drive.wheel_base)
        named = {"images": looked.topic, "odometry": motion.odometry_topic}
        topics = {name: word for name, word in named.items() if word is not None}
        wheels = motion.wheels()
        return cls(frames, moved, lens, lines, drive, pictures, wheels, topics, late_s=late_s)

    def tilt(self) -> MountingTilt:
        """Roll and pitch of the mounting, by what stays of the images' leans when the robot turns."""
        from tiltvp.mounting import mounting_tilt
        from tiltvp.robot_setup import TILT_OPTIONS, drive_tilts, measured_count

        estimator = self.lines.mounted(self.camera, **TILT_OPTIONS)
        rotation = estimator.robot_from_camera
        tell_setup_of(self.frames, estimator)
        with progress_bar(measured_count(self.frames), f"{self.name}: leans") as bar:
            tilts = drive_tilts(self.frames, estimator, self.moved.motions, advance=bar.advance)
        return mounting_tilt(
            tilts.estimates, tilts.motions, rotation,
            level_floor=self.pictures.level_floor, half_track_m=self.wheels.half_track_m,
        )  # fmt: skip

    def solved(self, robot_from_camera: NDArray[np.float64] | None, solve: Solve) -> Solved:
        """The bearings of lines in the frame of the mounting (3, 3), or of that which was given, and what they say.

        Tracks are written where they are asked for.
        """
        from tiltvp.drive_logs import DriveLog
        from tiltvp.line_calibration import calibrate_lines
        from tiltvp.line_logs import displacements
        from tiltvp.streams import Motion

        moved = self.moved
        named, seen = self._seen(self.lines.mounting(self.camera) if robot_from_camera is None else robot_from_camera)
        sigmas = np.concatenate([one.lines.sigma_rad for one in seen])
        self.sigma_rad = float(np.median(sigmas)) if len(sigmas) else None
        motions = [one or Motion() for one in moved.motions]
        assert self.drive.wheel_base is not None  # As `settled` has it.
        odometry = displacements(motions, wheel_base_m=self.drive.wheel_base)
        try:
            with status(f"{self.name}: which line is which, and the whole log"):
                found = calibrate_lines(
                    seen, lambda bearings, **options: solve(DriveLog(odometry, bearings, moved.times_s), **options),
                    start=self.drive.start_known, frames_min=self.pictures.track_frames_min,
                )  # fmt: skip
        except InvalidInputError as error:
            raise InvalidInputError("; ".join(filter(None, (f"{self.name}: {error}", self.left_out)))) from error
        if self.pictures.tracks is not None:
            rows = zip(named, found.frames, strict=True)
            table = track_table([(one.number, name, time_s, one.tracked) for (name, time_s), one in rows])
            write_table(table, self.pictures.tracks)
        tell_jumps(self.name, [(name, one.tracked) for (name, _), one in zip(named, found.frames, strict=True)])
        lines = counted(len(np.unique(found.bearings[:, 1])), "lines")
        say(f"{self.name}: {counted(len(found.bearings), 'bearings')} of {lines}")
        doubt = "; ".join(filter(None, (moved.doubt, found.doubt)))
        # Bearings of images are not written down: only what is said of the wheels can be.
        remedies = tuple(word for word in other_readings(found.misreading) if word != "clockwise")
        return Solved(DriveLog(odometry, found.bearings, moved.times_s), found.whole, doubt, remedies, self.left_out)

    def _seen(
        self, rotation: NDArray[np.float64]
    ) -> tuple[tuple[tuple[str, float | None], ...], tuple[SeenFrame, ...]]:
        """Names and times of the frames that can be used, and their lines, without the images: a drive's together are
        more than the memory holds."""
        extractor = self.lines.extractor(self.camera, rotation=rotation)
        drive = Drive(extractor, self.lines.tilts(self.camera, rotation=rotation), self.moved)
        count, nothing, told = len(self.moved.motions), np.zeros((0, 0), np.uint8), self.frames.told
        with (
            ending_at_interrupt(self.frames) as coming,
            progress_bar(count, f"{self.name}: lines", told=told) as bar,
        ):
            seen = [((frame.name, frame.time_s), replace(one, gray=nothing)) for frame, one in drive.seen(coming, bar)]
        self.bad = drive.bad
        if drive.told():
            say(f"{self.name}: of {counted(count, 'frames')} {drive.told()}")
        if drive.repeated:
            self.left_out = f"of {counted(count, 'images')} {drive.frozen()}"
        if not seen:
            left_out = f", {drive.told()}" if drive.told() else ""
            raise InvalidInputError(f"{self.name}: no line is seen in {counted(count, 'frames')}{left_out}")
        named, lines = zip(*seen, strict=True)
        return named, lines

    def robot(self, known: Robot | None) -> Robot:
        """The robot as far as it was told: camera, mounting as it was given, mask, wheels; topics also as known."""
        from tiltvp import Robot

        mask: Any = None if self.lines.mask is None else read_mask(self.lines.mask)
        before = {} if known is None else known.topics
        topics = before | {name: topic for name, topic in self.topics.items() if topic not in before.values()}
        return Robot(self.camera, self.lines.mounting(self.camera), mask=mask, wheels=self.wheels, topics=topics)


def _tell_other_turns(source: str, moved: FrameMotions, wheel_base_m: float | None) -> None:
    """Says so where turns are recorded beside wheels that turn otherwise."""
    assert wheel_base_m is not None  # As `settled` has it.
    recorded = [(one.yaw_rad, *one.wheels_m) for one in moved.motions if one is not None and one.wheels_m is not None]
    turns, left, right = np.array(recorded, dtype=np.float64).reshape(-1, 3).T
    apart = np.degrees(np.abs(turns - (right - left) / wheel_base_m)).max(initial=0.0)
    if apart > _SAME_DEG:
        say(
            f"{source}: turns beside wheels, up to {apart:.2f} degrees apart between two images: lines are followed by "
            "the turns, the mounting is found by the wheels"
        )


def _bring_to_clock(
    frames: Frames,
    motion: MotionOptions,
    camera: Camera,
    rotation: NDArray[np.float64],
    read_as: Sequence[str],
) -> float:
    """Takes from the times of the frames by how much they are late, and gives that.

    Raises `InvalidInputError` where nothing tells.
    """
    from tiltvp.streams import read_odometry
    from tiltvp.turning import frame_delay, telling_frames

    record = motion.odometry or frames.recording
    if frames.times_s is None or record is None:
        raise InvalidInputError(f"--estimate-time-offset with {frames.source}, whose times are not known")
    wheels = motion.wheels()
    odometry = read_odometry(record, topic=motion.odometry_topic, wheels=wheels, read_as=read_as)
    numbers = telling_frames(frames.times_s, odometry)
    images = (frame.read() for frame in frames.sample(numbers.tolist()))
    found = frame_delay(images, frames.times_s[numbers], odometry, camera, rotation)
    if not found:
        raise InvalidInputError(f"--estimate-time-offset with {frames.source}: {found.reason}")
    say(f"{frames.source}: frames are stamped {found.delay_s:.3f} +- {found.sigma_s:.3f} s late, which is mended first")
    frames.times_s = frames.times_s - found.delay_s
    return found.delay_s
