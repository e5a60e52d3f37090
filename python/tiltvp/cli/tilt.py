"""`tiltvp tilt`: the tilt of each of many images."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Generator, Iterable, Iterator
from contextlib import closing
from itertools import repeat
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tiltvp.cli.answers import check_answers, check_stamps, write_answers
from tiltvp.cli.cluster import check_cluster, files_of, is_begun
from tiltvp.cli.filtering import FilterOptions
from tiltvp.cli.frame_checks import tell_setup, tell_turns
from tiltvp.cli.options import CameraOptions, FrameRate, MethodOptions, ThreadCount
from tiltvp.cli.results import Outcome, mounting_words, outcome_table, people_table, summary_words
from tiltvp.cli.showing import ShowOptions
from tiltvp.cli.sources import (
    MotionOptions,
    SourceOptions,
    check_apart,
    ending_at_interrupt,
    in_order,
    picture_names,
    wheel_base_of,
)
from tiltvp.cli.tables import STDOUT, Out, json_lines
from tiltvp.cli.terminal import complain, progress_bar, say, show, width
from tiltvp.cli.tilt_work import Work, tilts_on_cluster
from tiltvp.errors import InvalidInputError, counted
from tiltvp.files import check_output_folder
from tiltvp.streams.outputs.tilts import TILT_ENDINGS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import TiltEstimator
    from tiltvp.streams import Frame, FrameMotions, Frames

    Picture = NDArray[np.uint8]
    Named = tuple[Frame, str, Outcome, Picture | None]

_LAST: Final = 1_000
"""Of the frames of a stream, of which a table is shown at its end: what a terminal lets one scroll back to."""
_METHOD_DEFAULTS = MethodOptions()
_FILTER_DEFAULTS = FilterOptions()
_SOURCE, _MOTION, _SHOWING = SourceOptions(), MotionOptions(), ShowOptions()


def tilt(
    images: list[str] | None = None,
    /,
    *,
    camera: CameraOptions,
    source: SourceOptions = _SOURCE,
    method: MethodOptions = _METHOD_DEFAULTS,
    filtering: FilterOptions = _FILTER_DEFAULTS,
    motion: MotionOptions = _MOTION,
    out: Out | None = None,
    overlay: Path | None = None,
    level: Path | None = None,
    frame_rate: FrameRate = None,
    threads: ThreadCount = 1,
    showing: ShowOptions = _SHOWING,
    cluster: str | None = None,
) -> int:
    """Estimate the tilt of each image, of files, a video, a recording of ROS or a live camera.

    Frames that cannot be read are named on stderr, the others are done, and the exit code is 1.

    Parameters
    ----------
    images
        Image files, folders of images and glob patterns; or one video or recording of ROS; or -, for names of files
        on stdin.
    out
        File for the results in radians: .csv, .json or .parquet; for attitudes with yaw 0: .mcap (sensor_msgs/Imu of
        ROS 2) or .tum; - for a line of JSON on stdout as each image is done.
    overlay
        Folder for the images with inlier edges in colour, horizon and vanishing points.
    level
        Folder for the images made level: each by its own tilt, with --filter by the filtered one.
    frame_rate
        Frames per second, for attitudes: by default the times that frames tell, and 25 where they tell none.
    threads
        How many images are worked on at the same time.
    cluster
        Address of a Dask scheduler: its workers, which must see the same files, do the work. --out is then a folder of
        Parquet files, written as they are done; the same command goes on with it.
    """
    from tiltvp.streams import Motion

    _check_outputs(out, overlay, level, cluster, frame_rate)
    if cluster is not None:
        check_cluster(out, filter=filtering.filter, show=showing.show, rerun=showing.rerun, frame_rate=frame_rate)
    filtering.check()
    showing.check()
    if not filtering.filter:
        motion.refuse("--filter")
    robot = camera.robot()
    source = source.of_robot(robot, images or [])
    estimator = camera.complete(method.of_topic(source.topic)).estimator(camera.load(source.topic))
    frames = source.open(images or [], estimator.camera)
    check_apart(
        frames, overlay, level, out, filtering.filter_plot, beside=(motion.odometry, method.mask, camera.camera)
    )
    check_stamps(out, frames, frame_rate)
    moved = motion.motions_of(robot, frames) if filtering.filter else None
    filtering = filtering.following(frames, moved, wheel_base_of(robot, motion.wheel_base))
    motions: Iterable[Motion | None] = repeat(Motion()) if moved is None else moved.motions
    work, judge = Work(_checked(estimator, frames, moved), overlay, level, filtering, showing.asked), filtering.judge()
    if cluster is not None and out is not None:
        return tilts_on_cluster(cluster, files_of(frames), work, out)
    answers = Answers(frames.count is not None, estimator.method, out, filtering, frame_rate)
    with (
        showing.watch(frames, lambda: work.leveller) as watch,
        ending_at_interrupt(frames, ahead=threads == 1) as coming,
        closing(_done(work, coming, frames, threads)) as done,
    ):
        for (frame, name, found, marked), driven in zip(done, motions, strict=False):
            outcome = judge(found, driven)
            answers.add(outcome)
            if filtering.filter:
                work.write_level(frame, outcome, name)
            if watch is not None and not watch(frame, outcome, marked):
                break
    judge.plot()
    answers.conclude(frames.source)
    return 1 if frames.problems or answers.bad else 0


def _check_outputs(
    out: Path | None, overlay: Path | None, level: Path | None, cluster: str | None, frame_rate: float | None
) -> None:
    """Refuses outputs that cannot be written, before any work is done."""
    if out is not None and out != STDOUT and cluster is None:
        check_answers(out)
    if frame_rate is not None and cluster is None and (out is None or out.suffix.lower() not in TILT_ENDINGS):
        raise InvalidInputError(f"--frame-rate {frame_rate:g}, expected --out that ends in {' or '.join(TILT_ENDINGS)}")
    if overlay is not None and level is not None and os.path.realpath(overlay) == os.path.realpath(level):
        raise InvalidInputError(f"--overlay and --level are both {overlay}, expected two folders")
    for folder in (overlay, level):
        # What is gone on with has pictures already.
        if folder is not None and (cluster is None or out is None or not is_begun(out)):
            check_output_folder(folder)


class Answers:
    """What is told of the outcomes, at once or at the end."""

    def __init__(
        self, ends: bool, method: str, out: Path | None, filtering: FilterOptions, frame_rate: float | None
    ) -> None:
        """`ends` is whether the source is known to have an end."""
        self._method, self._out, self._filtering, self._frame_rate = method, out, filtering, frame_rate
        self._rows_only = out == STDOUT
        # So that a stream may go on for ever in the same memory.
        most = 0 if self._rows_only else _LAST if out is None and not ends else None
        self._kept: deque[Outcome] = deque(maxlen=most)
        self.count = 0
        """How many there were."""
        self.bad = 0
        """How many of them could not be used."""

    def add(self, outcome: Outcome) -> None:
        """The next one."""
        self._kept.append(outcome)
        self.count += 1
        self.bad += outcome.error is not None
        if self._rows_only:
            say(json_lines(outcome_table([outcome], self._method)))

    def conclude(self, source: str) -> None:
        """The answers as files, and then what people read on stdout, of which nobody may take all."""
        outcomes = list(self._kept)
        written = None
        if self._out is not None and not self._rows_only:
            written = write_answers(outcomes, self._method, self._out, self._frame_rate)
        if self.bad and len(outcomes) < self.count:
            complain(f"{source}: {self.bad} of {counted(self.count, 'frames')} could not be used")
        if not self._rows_only:
            if len(outcomes) < self.count:
                say(f"{source}: {counted(self.count, 'frames')}, of which the last {len(outcomes)} are shown")
            if outcomes:
                say(summary_words(outcomes))
            show(people_table(outcomes, width()))
            if self._filtering.estimate_mounting:
                say(mounting_words(outcomes))
            if written is not None:
                say(written)


def _checked(estimator: TiltEstimator, frames: Frames, moved: FrameMotions | None) -> TiltEstimator:
    """The estimator without the dark surround and the body of the robot that the frames have, if no mask is given; a
    line on stderr says so of each, and one if they speak against the mounting or the odometry. Of frames that come only
    once nothing is looked at first.
    """
    import numpy as np

    from tiltvp.robot_setup import LEAST, joined_mask, rim_and_body, spread

    camera = estimator.camera
    images = [image for _, image in spread(frames, camera, LEAST)]
    if len(images) < LEAST:
        return estimator
    mask = estimator.options["mask"]
    if mask is None:
        rim, body = rim_and_body(frames, camera)
        if rim is not None:
            share = 100.0 * float(np.mean(rim))
            complain(f"--mask: none, and the images have a dark surround: {share:.0f} % within its rim are looked at")
        if body:
            complain(f"--mask: none, and in {body.reason}: they are the robot's own, and left out")
        elif body.mask is None:
            complain(f"--mask: none, and images do not tell whether they show the robot itself: {body.reason}")
        mask = joined_mask(rim, body)
        if mask is not None:
            estimator = estimator.with_options(mask=mask)
    tell_setup(images, estimator, mask)
    tell_turns(frames, estimator, moved)
    return estimator


def _done(work: Work, coming: Iterator[Frame], frames: Frames, threads: int) -> Generator[Named, None, None]:
    """The frames with names, outcomes and marked images, in their order, each as soon as it is there."""
    named_frames = zip(coming, picture_names(frames), strict=False)

    def one(named_frame: tuple[Frame, str]) -> Named:
        return *named_frame, *work(*named_frame)

    # Of a live camera each frame is answered before the next comes.
    with progress_bar(frames.count or 0, "images", told=frames.told) as bar:
        done = map(one, named_frames) if threads == 1 else in_order(one, named_frames, threads)
        for frame, name, outcome, picture in done:
            if outcome.error is not None:
                bar.blame(outcome.file, outcome.error)
            bar.advance()
            yield frame, name, outcome, picture
