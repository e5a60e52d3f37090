"""`tiltvp track`: the vertical lines of a drive, each with the same number in every frame that shows it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter, validators

from tiltvp.cli.declared_options import LibraryOptions, from_library
from tiltvp.cli.frames import Frames, open_frames
from tiltvp.cli.line_options import LineOptions
from tiltvp.cli.lines import LINE_TYPES, line_columns
from tiltvp.cli.options import CameraOptions
from tiltvp.cli.tables import Table, check_ending, check_plot, write_table
from tiltvp.cli.terminal import ProgressBar, named, progress_bar, say
from tiltvp.errors import InvalidInputError, TiltvpError
from tiltvp.files import check_output

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import TiltEstimate
    from tiltvp.line_logs import FollowedFrame
    from tiltvp.lines import LineExtractor, LineTracker, TrackedLines
    from tiltvp.odometry import Motion


@Parameter(name="*", group=Group("Tracking"))
@dataclass(frozen=True, kw_only=True)
@from_library({"LineTracker": ()}, words={"camera_m": "--camera-at"})
class TrackerOptions(LibraryOptions):
    """How lines are followed."""


_DEFAULTS, _TRACKER = LineOptions(), TrackerOptions()


def track(
    source: str,
    /,
    *,
    camera: CameraOptions,
    options: LineOptions = _DEFAULTS,
    out: Path,
    odometry: Path | None = None,
    plot: Path | None = None,
    video: Path | None = None,
    frame_rate: Annotated[float | None, Parameter(validator=validators.Number(gt=0))] = None,
    tracking: TrackerOptions = _TRACKER,
) -> int:
    """Follow vertical lines through the images of a folder, in the order of their names, or through a video.

    Frames that cannot be read are named on stderr and skipped, and the exit code is 1.

    Parameters
    ----------
    source
        Folder of images, glob pattern, or video.
    out
        File for the tracks in radians, one row for each line of each frame: .csv, .json or .parquet.
    odometry
        CSV of the motion that led to each frame: yaw_rad or yaw_deg; file, or one row for each frame.
    plot
        Picture of the bearings over the frames, one colour for each track (.png).
    video
        The frames with their lines in the colours of their tracks: .mp4 or .avi.
    frame_rate
        Frames per second of that video: those of the source by default, 25 for images.
    """
    from tiltvp.images import write_image
    from tiltvp.lines import LineTracker
    from tiltvp.odometry import read_odometry
    from tiltvp.overlays.lines import draw_lines
    from tiltvp.videos import video_writer

    check_ending(out)
    if video is not None:
        check_output(video)
    check_plot("--plot", plot)
    lens = camera.load()
    extractor, tilt = options.extractor(lens), options.tilts(lens)
    tracker = LineTracker(**tracking.given())
    frames = open_frames(source)
    motions = None if odometry is None else read_odometry(odometry, frames.files)
    tracked: list[tuple[int, str, TrackedLines]] = []
    showing = nullcontext() if video is None else video_writer(video, frame_rate or frames.rate_hz)
    with showing as film, progress_bar(len(frames.files), "frames") as bar:
        for frame in followed(frames, extractor, tracker, tilt, motions, bar):
            found = frame.tracked
            tracked.append((frame.number, str(frames.files[frame.number]), found))
            if film is not None:
                rotation, tracks = extractor.robot_from_camera, found.track.tolist()
                film.add(draw_lines(frame.gray, lens, found.lines, rotation, tracks=tracks))
    bad = len(frames.files) - len(tracked)
    if not tracked:
        raise InvalidInputError(f"{source}: {bad} frames, none of which can be read")
    table = track_table(tracked)
    write_table(table, out)
    if plot is not None:
        from tiltvp.lab.plots.picture import figure_picture
        from tiltvp.lab.plots.tracks import track_plot

        write_image(plot, figure_picture(track_plot(table.frame())))
    skipped = f", {bad} skipped" if bad else ""
    say(f"{out}: {len(tracked)} frames{skipped}, {len(table.rows)} lines, {tracker.track_count} tracks")
    return 1 if bad else 0


def followed(
    frames: Frames,
    extractor: LineExtractor,
    tracker: LineTracker,
    tilt: Callable[[NDArray[np.uint8]], TiltEstimate | None],
    motions: Sequence[Motion] | None,
    bar: ProgressBar,
) -> Iterator[FollowedFrame]:
    """The frames that can be used, with their lines; the others are complained about."""
    from tiltvp.line_logs import follow_lines

    for file, frame in zip(
        frames.files, follow_lines(frames, extractor, tracker, tilt=tilt, motions=motions), strict=True
    ):
        if isinstance(frame, TiltvpError):
            bar.complain(named(file, str(frame)))
        else:
            yield frame
        bar.advance()


def track_table(tracked: Sequence[tuple[int, str, TrackedLines]]) -> Table:
    """One row for each line of each frame: frame, file, track, frames_back (0: a new track), and the line's columns."""
    table = Table({"frame": "UInt32", "file": "String", "track": "Int64"} | LINE_TYPES | {"frames_back": "Int64"})
    for frame, file, found in tracked:
        n = len(found)
        columns = {"frame": [frame] * n, "file": [file] * n, "track": found.track.tolist()}
        table.add(columns | line_columns(found.lines) | {"frames_back": found.frames_back.tolist()})
    return table
