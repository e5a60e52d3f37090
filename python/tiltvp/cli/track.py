"""`tiltvp track`: the vertical lines of a drive, each with the same number in every frame that shows it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter, validators

from tiltvp.cli.frames import Frames, open_frames
from tiltvp.cli.line_options import LineOptions
from tiltvp.cli.lines import line_columns, line_schema
from tiltvp.cli.options import CameraOptions
from tiltvp.cli.results import check_ending, write_frame
from tiltvp.cli.terminal import ProgressBar, named, progress_bar, say
from tiltvp.errors import InvalidInputError, TiltvpError

if TYPE_CHECKING:
    import numpy as np
    import polars as pl
    from numpy.typing import NDArray

    from tiltvp import TiltEstimate
    from tiltvp.line_logs import FollowedFrame
    from tiltvp.lines import LineExtractor, LineTracker, TrackedLines
    from tiltvp.odometry import Motion

_DEFAULTS = LineOptions()


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
    look_back: Annotated[int | None, Parameter(validator=validators.Number(gte=1))] = None,
    camera_at: tuple[float, float] | None = None,
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
    look_back
        How many frames back a line is looked for before it counts as new.
    camera_at
        Where the camera is on the robot, for what distances of the odometry do to bearings: metres to the front and to
        the left of the middle between the wheels; default 0 0.
    """
    from tiltvp.images import write_image
    from tiltvp.lines import LineTracker
    from tiltvp.odometry import read_odometry
    from tiltvp.plots.lines import draw_lines
    from tiltvp.videos import video_writer

    check_ending(out)
    if plot is not None and plot.suffix.lower() != ".png":
        raise InvalidInputError(f"--plot {plot}: ends in {plot.suffix!r}, expected .png")
    lens = camera.load()
    extractor, tilt = options.extractor(lens), options.tilts(lens)
    given: dict[str, Any] = {"look_back": look_back, "camera_m": camera_at}
    tracker = LineTracker(**{name: value for name, value in given.items() if value is not None})
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
    write_frame(table, out)
    if plot is not None:
        from tiltvp.plots.picture import figure_picture
        from tiltvp.plots.tracks import track_plot

        write_image(plot, figure_picture(track_plot(table)))
    skipped = f", {bad} skipped" if bad else ""
    say(f"{out}: {len(tracked)} frames{skipped}, {table.height} lines, {tracker.track_count} tracks")
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


def track_table(tracked: Sequence[tuple[int, str, TrackedLines]]) -> pl.DataFrame:
    """One row for each line of each frame: frame, file, track, frames_back (0: a new track), and the line's columns."""
    import polars as pl

    schema: dict[str, Any] = {"frame": pl.UInt32, "file": pl.String, "track": pl.Int64} | line_schema()
    schema |= {"frames_back": pl.Int64}
    parts = []
    for frame, file, found in tracked:
        n = len(found)
        columns = {"frame": [frame] * n, "file": [file] * n, "track": found.track, **line_columns(found.lines)}
        parts.append(pl.DataFrame(columns | {"frames_back": found.frames_back}, schema=schema))
    return pl.concat([pl.DataFrame(schema=schema), *parts])
