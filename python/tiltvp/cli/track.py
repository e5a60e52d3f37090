"""`tiltvp track`: the vertical lines of a drive, each with the same number in every frame that shows it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cyclopts import Group, Parameter

from tiltvp.cli.declared_options import LibraryOptions, from_library
from tiltvp.cli.each_image import Images
from tiltvp.cli.frame_checks import tell_setup_of
from tiltvp.cli.line_options import LineOptions
from tiltvp.cli.lines import LINE_TYPES, line_columns
from tiltvp.cli.options import CameraOptions, FrameRate
from tiltvp.cli.rerun_views import send_lines
from tiltvp.cli.showing import RerunOptions
from tiltvp.cli.sources import MotionOptions, SourceOptions, check_apart, ending_at_interrupt
from tiltvp.cli.tables import Out, Table, check_ending, check_plot, write_table
from tiltvp.cli.terminal import ProgressBar, complain, progress_bar, say
from tiltvp.errors import InvalidInputError, TiltvpError, UnknownLeanError, counted
from tiltvp.files import check_output

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import Camera, TiltEstimate
    from tiltvp.line_logs import SeenFrame
    from tiltvp.lines import LineExtractor, LineTracker, TrackedLines
    from tiltvp.streams import Frame, FrameMotions, Frames
    from tiltvp.streams.outputs.viewer import Viewer
    from tiltvp.videos import VideoWriter

    Seen = tuple[int, str, float | None, TrackedLines]
    """Number, name and time of a frame, and its lines."""


@Parameter(name="*", group=Group("Tracking"))
@dataclass(frozen=True, kw_only=True)
@from_library({"LineTracker": ()}, words={"camera_m": "--camera-at"})
class TrackerOptions(LibraryOptions):
    """How lines are followed."""


_DEFAULTS, _TRACKER, _SOURCE, _MOTION = LineOptions(), TrackerOptions(), SourceOptions(), MotionOptions()
_WATCHING = RerunOptions()


def track(
    images: Images = None,
    /,
    *,
    camera: CameraOptions,
    frames_of: SourceOptions = _SOURCE,
    options: LineOptions = _DEFAULTS,
    out: Out,
    motion: MotionOptions = _MOTION,
    plot: Path | None = None,
    video: Path | None = None,
    frame_rate: FrameRate = None,
    tracking: TrackerOptions = _TRACKER,
    watching: RerunOptions = _WATCHING,
) -> int:
    """Follow vertical lines through images, those of a folder in the order of their names, or through a video.

    Frames that cannot be read are named on stderr and skipped, and the exit code is 1.

    Parameters
    ----------
    out
        File for the tracks in radians, one row for each line of each frame: .csv, .json or .parquet.
    plot
        Picture of the bearings over the frames, one colour for each track (.png).
    video
        The frames with their lines in the colours of their tracks: .mp4 or .avi.
    frame_rate
        Frames per second of that video: by default the times that frames tell, 25 for images that tell none.
    """
    from tiltvp.lines import LineTracker
    from tiltvp.videos import video_writer

    check_ending(out)
    if video is not None:
        check_output(video)
    elif frame_rate is not None:
        raise InvalidInputError("--frame-rate without --video, expected both")
    check_plot("--plot", plot)
    watching.check()
    robot, words = camera.robot(), images or []
    frames_of = frames_of.of_robot(robot, words)
    lens, options = camera.load(frames_of.topic), camera.complete(options.of_topic(frames_of.topic))
    extractor, tilt = options.extractor(lens), options.tilts(lens)
    place = {} if robot is None or robot.place_m is None else {"camera_m": robot.place_m}
    tracker = LineTracker(**place | tracking.given())
    frames = frames_of.open(words, lens)
    check_apart(frames, video, out, plot, beside=(motion.odometry, options.mask, camera.camera))
    motions = needed_turns(motion.motions_of(robot, frames))
    tell_setup_of(frames, extractor, motions)
    drive = Drive(extractor, tilt, motions)
    showing = nullcontext() if video is None else video_writer(video, frame_rate or frames.rate_hz)
    with showing as film, watching.viewer() as viewer:
        tracked = _follow(drive, tracker, frames, lens, film, viewer, timed=frame_rate is None)
    if film is not None and film.note is not None:
        complain(f"{video}: {film.note}")
    if not tracked:
        count = drive.bad + drive.leaning + drive.repeated
        which = f"{drive.told()}, and no other can be read" if drive.told() else "none of which can be read"
        raise InvalidInputError(f"{frames.source}: {counted(count, 'frames')}, {which}")
    table = track_table(tracked)
    write_table(table, out)
    if plot is not None:
        from tiltvp.images import write_image
        from tiltvp.lab.plots.picture import figure_picture
        from tiltvp.lab.plots.tracks import track_plot

        write_image(plot, figure_picture(track_plot(table.frame())))
    skipped = f"{drive.bad} skipped" if drive.bad else ""
    lines, tracks = counted(len(table.rows), "lines"), counted(tracker.track_count, "tracks")
    parts = filter(None, (counted(len(tracked), "frames"), skipped, drive.told(), lines, tracks))
    say(f"{out}: {', '.join(parts)}")
    tell_jumps(str(out), [(name, lines) for _, name, _, lines in tracked])
    return 1 if drive.bad or frames.problems else 0


def _follow(
    drive: Drive,
    tracker: LineTracker,
    frames: Frames,
    lens: Camera,
    film: VideoWriter | None,
    viewer: Viewer | None,
    *,
    timed: bool,
) -> list[Seen]:
    """The lines of all frames that can be used. Film, if `timed` at their times, and viewer get a picture of each."""
    from tiltvp.overlays.lines import draw_lines

    found: list[Seen] = []
    shown: Sequence[int] = ()
    with ending_at_interrupt(frames) as coming, progress_bar(frames.count or 0, "frames", told=frames.told) as bar:
        for frame, one in drive.seen(coming, bar):
            seen = one.followed(tracker)
            found.append((seen.number, frame.name, frame.time_s, seen.tracked))
            if film is None and viewer is None:
                continue
            tracks = seen.tracked.track.tolist()
            picture = draw_lines(seen.gray, lens, seen.tracked.lines, drive.robot_from_camera, tracks=tracks)
            if film is not None:
                film.add(picture, frame.time_s if timed else None)
            if viewer is not None:
                shown = send_lines(viewer, seen.number, frame.time_s, picture, seen.tracked, shown)
    return found


def needed_turns(motions: FrameMotions | None) -> FrameMotions | None:
    """The motions, which must tell turns: lines are looked for where these take them."""
    if motions is not None and not motions.turns_known:
        raise InvalidInputError("odometry without turns, expected --wheel-base for that of wheels, or other columns")
    return motions


def tell_jumps(source: str, tracked: Sequence[tuple[str, TrackedLines]]) -> None:
    """Says at which frames, by their names, lines turned otherwise than the odometry told, if there are any."""
    jumps = [(name, abs(math.degrees(lines.jump_rad))) for name, lines in tracked if lines.jump_rad]
    if jumps:
        name, most_deg = max(jumps, key=itemgetter(1))
        complain(
            f"{source}: at {counted(len(jumps), 'frames')} lines turn otherwise than the odometry tells, by "
            f"{most_deg:.1f} degrees at {name}: the camera was bumped, or wheels slipped"
        )


class Drive:
    """The lines of a drive, frame by frame."""

    def __init__(
        self,
        extractor: LineExtractor,
        tilt: Callable[[NDArray[np.uint8]], TiltEstimate | None],
        motions: FrameMotions | None,
    ) -> None:
        self._parts = extractor, tilt
        self._motions = motions
        self.bad = 0
        """How many frames could not be used so far."""
        self.leaning = 0
        """How many were left out so far because their lean is not known."""
        self.repeated = 0
        """How many were left out so far that are the same as the one before although the robot moved."""

    @property
    def robot_from_camera(self) -> NDArray[np.float64]:
        """(3, 3): how the camera is mounted where lines are looked for."""
        return self._parts[0].robot_from_camera

    def told(self) -> str:
        """How many frames were left out because of their lean, and as of a frozen camera; empty: none."""
        leaning = f"{self.leaning} left out whose lean is not known" if self.leaning else ""
        return ", ".join(filter(None, (leaning, self.frozen())))

    def frozen(self) -> str:
        """How many frames were left out as of a frozen camera; empty: none."""
        which = "left out as of a frozen camera (the same as the one before while the robot moved)"
        return f"{self.repeated} {which}" if self.repeated else ""

    def seen(self, frames: Iterator[Frame], bar: ProgressBar) -> Iterator[tuple[Frame, SeenFrame]]:
        """The frames that can be used, with their lines; the others are complained about.

        Frames whose lean is not known are left out and counted, and those of a frozen camera. So are those of whose
        time the odometry does not tell; a line about them has been told before.
        """
        import numpy as np

        from tiltvp.line_logs import see_lines
        from tiltvp.streams import Motion

        extractor, tilt = self._parts
        motions = None if self._motions is None else self._motions.motions
        passed: list[Frame] = []

        def images() -> Iterator[NDArray[np.uint8] | TiltvpError]:
            before, moved = None, 0.0
            for number, frame in enumerate(frames):
                passed.append(frame)
                motion = Motion() if motions is None else motions[number]
                if motion is None:
                    yield _LEFT_OUT
                    continue
                image, moved = frame.image, moved + abs(motion.distance_m) + abs(motion.yaw_rad)
                if isinstance(image, TiltvpError):
                    yield image
                    continue
                same = before is not None and np.array_equal(image, before)
                if not same:
                    before, moved = image, 0.0
                yield _REPEATED if same and moved > _STILL else image

        driven = None if motions is None else [motion or Motion() for motion in motions]
        for seen in see_lines(images(), extractor, tilt=tilt, motions=driven):
            frame = passed.pop()
            if isinstance(seen, UnknownLeanError):
                self.leaning += 1
            elif seen is _REPEATED:
                self.repeated += 1
            elif seen is not _LEFT_OUT:
                if isinstance(seen, TiltvpError):
                    bar.blame(frame.name, str(seen))
                    self.bad += 1
                else:
                    yield frame, seen
            bar.advance()


_LEFT_OUT: Final = TiltvpError("the odometry does not tell of its time")
_REPEATED: Final = TiltvpError("the same as the one before while the robot moved")
_STILL: Final = 0.01
"""Metres and radians in all by which a robot that stands seems to move, as `TiltFilter` has it of wheels."""


def track_table(tracked: Sequence[Seen]) -> Table:
    """One row for each line of each frame: frame, file, track, the line's columns, frames_back (0: a new track).

    Where frames tell their times also time_s.
    """
    types = {"frame": "UInt32", "file": "String", "track": "Int64"} | LINE_TYPES | {"frames_back": "Int64"}
    timed = any(time_s is not None for _, _, time_s, _ in tracked)
    table = Table(types | ({"time_s": "Float64"} if timed else {}))
    for number, name, time_s, found in tracked:
        n = len(found)
        columns: dict[str, list[Any]] = {"frame": [number] * n, "file": [name] * n, "track": found.track.tolist()}
        columns |= line_columns(found.lines) | {"frames_back": found.frames_back.tolist()}
        table.add(columns | {"time_s": [time_s] * n})
    return table
