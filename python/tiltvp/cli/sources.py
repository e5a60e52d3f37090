"""Where frames and odometry of a verb come from: the options that say so, and the names of what is written for them."""

from __future__ import annotations

import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Self, TypeVar

from cyclopts import Group, Parameter, validators

from tiltvp._core import WHEEL_BASE_MAX_M
from tiltvp.cli.frame_checks import check_sizes
from tiltvp.cli.options import ABOVE_0, ALL_CORES, AtLeast0, given_words
from tiltvp.cli.repeats import Repeats
from tiltvp.cli.terminal import complain
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from tiltvp import Robot, _core
    from tiltvp.streams import Frame, FrameMotions, Frames, Wheels

__all__ = [
    "STDIN",
    "KeptOptions",
    "MotionOptions",
    "SourceOptions",
    "check_apart",
    "distinct_names",
    "ending_at_interrupt",
    "in_order",
    "picture_names",
    "tell",
    "wheel_base_of",
]

STDIN: Final = "/dev/stdin"
"""What - stands for as the source of a verb."""
R = TypeVar("R")
T = TypeVar("T")
_AHEAD: Final = min(4, ALL_CORES)
"""Threads that decode, each ahead by two frames, of 36 MB at 12 megapixels. A PNG of these takes six times as long to
decode as its edges take, so that one thread would not do."""
_SOURCE = Group("Source", help="Images, a video, or a recording of ROS: docs/recordings.md.")


@Parameter(name="*", group=_SOURCE)
@dataclass(frozen=True, kw_only=True)
class KeptOptions:
    """Where frames come from that can be read again, where the words do not tell."""

    topic: str | None = None
    """The topic of a recording's images, where it has several."""

    def of_robot(self, robot: Robot | None, words: Sequence[str]) -> Self:
        """With the topic that a robot's file names, where the words name a recording and the topic is not given."""
        from tiltvp.streams import is_recording

        if robot is None or len(words) != 1 or not is_recording(words[0]):
            return self
        return replace(self, topic=self.topic or robot.topics.get("images"))

    def open(
        self,
        words: Sequence[str],
        camera: _core.Camera | None = None,
        *,
        topic_option: str = "--topic",
        names_each: bool = True,
    ) -> Frames:
        """The frames that words and options name; a line on stderr for each that is not there and for what is noted.

        `topic_option` is what chooses the topic. `check_sizes` compares the frames with a `camera`, where the verb
        `names_each` that cannot be read, or does not.
        """
        from tiltvp.streams import open_frames

        once = self._once(words, camera)
        if once is not None:
            return once
        frames = open_frames(list(words), topic=self.topic, option=topic_option)
        tell(*frames.problems, *frames.notes)
        if camera is not None:
            check_sizes(frames, camera, names_each=names_each)
        return frames

    def _once(self, words: Sequence[str], camera: _core.Camera | None) -> Frames | None:
        """Frames that come only once, where words or options name such."""
        if list(words) == [STDIN]:
            raise InvalidInputError("-: comes only once, expected images, a video or a recording")
        return None


@Parameter(name="*", group=_SOURCE)
@dataclass(frozen=True, kw_only=True)
class SourceOptions(KeptOptions):
    """Where frames come from, where the words do not tell."""

    live: AtLeast0 | None = None
    """A camera by its number, in place of files; Ctrl-C ends it."""
    raw: str | None = None
    """WIDTHxHEIGHT or WIDTHxHEIGHTxCHANNELS of images that come as bytes, BGR, on stdin (-)."""

    def _once(self, words: Sequence[str], camera: _core.Camera | None) -> Frames | None:
        from tiltvp.images import size_problem
        from tiltvp.streams import LiveCamera, NamedImages, RawImages
        from tiltvp.streams.live import raw_size

        if self.live is not None and words:
            raise InvalidInputError(f"--live {self.live} beside {words[0]}, expected one of them")
        if self.raw is not None and list(words) != [STDIN]:
            raise InvalidInputError("--raw without -, the standard input, which it is for")
        if self.live is not None:
            return LiveCamera(self.live)
        if not words:
            raise InvalidInputError("no source, expected images, a video, a recording, - or --live")
        if list(words) != [STDIN]:
            return None
        if self.raw is None:
            return NamedImages()
        shape = raw_size(self.raw)
        if camera is not None and shape[:2] != (camera.height, camera.width):
            raise InvalidInputError(f"--raw {self.raw}: {size_problem((shape[1], shape[0]), camera)}")
        return RawImages(shape)


@Parameter(name="*", group=Group("Odometry"))
@dataclass(frozen=True, kw_only=True)
class MotionOptions:
    """What the robot did between the frames."""

    odometry: Path | None = None
    """Table, or recording of ROS, with what the robot did (docs/recordings.md). By default that of the recording that
    the frames are from, if there is one."""
    odometry_topic: str | None = None
    """Its topic in a recording, where that has several: Odometry, JointState or Twist."""
    wheel_base: Annotated[float | None, Parameter(validator=validators.Number(gt=0, lte=WHEEL_BASE_MAX_M))] = None
    """Distance between the wheels, metres, for odometry of wheels, and for how much the floor may change in a turn; by
    default that of a robot's file."""
    wheel_radius: Annotated[float | None, Parameter(validator=validators.Number(gt=0, lte=10))] = None
    """Radius of the wheels, metres, for ticks and the angles of a JointState."""
    ticks_per_turn: Annotated[float | None, ABOVE_0] = None
    """What the counter of a wheel counts in one turn."""
    wheel_joints: tuple[str, str] | None = None
    """Names of the joints of the left and the right wheel, where these do not tell."""
    odometry_gap: Annotated[float, ABOVE_0] = 0.5
    """Longest time between two samples that is interpolated, seconds."""

    def refuse(self, needed: str) -> None:
        """Refuses options of odometry where the option that needs it is not given."""
        if given := given_words(self):
            raise InvalidInputError(f"{given[0]} without {needed}, expected both")

    def of_robot(self, robot: Robot | None, frames: Frames) -> Self:
        """With what a robot's file knows of wheels and topics, where these are not given."""
        if robot is None:
            return self
        from tiltvp.streams import is_recording

        known, record, topic = robot.wheels, self.odometry or frames.recording, self.odometry_topic
        radius = self.wheel_radius or known.wheel_radius_m
        if topic is None and record is not None and is_recording(record):
            # As without topics, angles of wheels are the choice where their radius is known.
            kinds = ("joints", "odometry") if radius is not None else ("odometry", "joints")
            topic = next((robot.topics[kind] for kind in kinds if kind in robot.topics), None)
        return replace(
            self,
            odometry_topic=topic,
            wheel_base=wheel_base_of(robot, self.wheel_base),
            wheel_radius=radius,
            ticks_per_turn=self.ticks_per_turn or known.ticks_per_turn,
            wheel_joints=self.wheel_joints or known.joints,
        )

    def motions_of(self, robot: Robot | None, frames: Frames) -> FrameMotions | None:
        """The same as `motions`, with what a robot's file knows where it is not given; options need an odometry."""
        found = self.of_robot(robot, frames).motions(frames)
        if found is None and frames.recording is None:
            self.refuse("--odometry")
        return found

    def motions(self, frames: Frames, read_as: Sequence[str] = ()) -> FrameMotions | None:
        """What the robot did up to each frame, None without odometry; a line on stderr for what is noted."""
        from tiltvp.streams import frame_motions, is_recording

        wheels, record = self.wheels(), self.odometry or frames.recording
        if self.odometry_topic is not None and record is not None and not is_recording(record):
            raise InvalidInputError(f"--odometry-topic {self.odometry_topic} of {record}: expected a recording")
        if self.odometry is None:
            return self._of_recording(frames, wheels, read_as)
        found = frame_motions(frames, self.odometry, topic=self.odometry_topic, wheels=wheels, read_as=read_as)
        tell(*found.notes)
        return found

    def wheels(self) -> Wheels:
        """What was said of the wheels."""
        from tiltvp.streams import Wheels

        return Wheels(
            wheel_base_m=self.wheel_base, wheel_radius_m=self.wheel_radius, ticks_per_turn=self.ticks_per_turn,
            joints=self.wheel_joints, gap_max_s=self.odometry_gap,
        )  # fmt: skip

    def _of_recording(self, frames: Frames, wheels: Wheels, read_as: Sequence[str]) -> FrameMotions | None:
        """What the recording of the frames tells; None where it tells nothing and nobody asked."""
        from tiltvp.streams import frame_motions

        if frames.recording is None:
            if self.odometry_topic is not None:
                raise InvalidInputError(f"--odometry-topic {self.odometry_topic}: no recording, expected --odometry")
            return None
        try:
            found = frame_motions(frames, frames.recording, topic=self.odometry_topic, wheels=wheels, read_as=read_as)
        except InvalidInputError as error:
            if self.odometry_topic is not None or read_as:
                raise
            tell(f"no odometry: {error}")
            return None
        tell(f"--odometry: not given, that of {frames.recording} is taken", *found.notes)
        return found


def wheel_base_of(robot: Robot | None, given_m: float | None) -> float | None:
    """The distance between the wheels that was given, or else that of a robot's file."""
    return given_m if robot is None or given_m is not None else robot.wheels.wheel_base_m


def check_apart(frames: Frames | None, *outputs: Path | None, beside: Sequence[Path | None]) -> None:
    """Refuses what is read, images, video, recording, or what is `beside` them, as odometry and calibration, a place
    within a bag's folder, a folder that holds images, whose place pictures would take, and the names of tables that are
    read with images."""
    from tiltvp.streams import is_recording
    from tiltvp.streams.image_files import ImageFiles

    if frames is None or frames.count is None:
        return
    places = {os.path.realpath(path) for path in (frames.source, frames.recording, *beside) if path is not None}
    bags = {place for place in places if os.path.isdir(place) and is_recording(place)}
    if isinstance(frames, ImageFiles):
        folders = {file.parent: os.path.realpath(file.parent) for file in frames.files}
        places = places | set(folders.values()) | {os.path.join(folders[one.parent], one.name) for one in frames.files}
        places |= {os.path.realpath(table) for table in frames.tables}
    for output in filter(None, outputs):
        place = Path(os.path.realpath(output))
        if not places.isdisjoint({str(place)}) or not bags.isdisjoint(map(str, place.parents)):
            raise InvalidInputError(f"{output}: is what is read, or holds it, expected another place")


def tell(*lines: str) -> None:
    """Lines on stderr."""
    for line in lines:
        complain(line)


@contextmanager
def ending_at_interrupt(frames: Frames, *, ahead: bool = True) -> Iterator[Iterator[Frame]]:
    """The frames; those of a live camera end at the first Ctrl-C, after which what is begun is finished.

    Where all are there already the next ones are decoded while one is worked on, if `ahead`. A line on stderr says how
    many images are the same as the one before. Raises `InvalidInputError` where none came, unless of a live camera.
    """
    from tiltvp.streams import LiveCamera

    repeats = Repeats(frames)
    if ahead and frames.count is not None:
        with closing(in_order(_decoded, repeats, _AHEAD)) as coming:
            yield coming
    else:
        with _interruptible(frames):
            yield iter(repeats)
    repeats.tell()
    if repeats.is_empty and not isinstance(frames, LiveCamera):
        raise InvalidInputError(f"{frames.source}: no frames came, expected one or more")


@contextmanager
def _interruptible(frames: Frames) -> Iterator[None]:
    """Within, the first Ctrl-C ends the frames of a live camera, and the second everything."""
    from tiltvp.streams import LiveCamera

    if not isinstance(frames, LiveCamera) or threading.current_thread() is not threading.main_thread():
        yield
        return
    stop = threading.Event()

    def note(*_: object) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()
        frames.end()

    before = signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _decoded(frame: Frame) -> Frame:
    from tiltvp.streams import Frame

    return Frame.of(frame.name, frame.time_s, frame.image)


def in_order(work: Callable[[T], R], items: Iterable[T], threads: int) -> Generator[R, None, None]:
    """What is made of each item, in their order, several at the same time; items are taken a few at a time: a source
    may have more frames than the memory holds."""
    pool = ThreadPoolExecutor(threads)
    waiting: deque[Future[R]] = deque()
    try:
        for item in items:
            waiting.append(pool.submit(work, item))
            if len(waiting) > 2 * threads:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        pool.shutdown(cancel_futures=True)


def picture_names(frames: Frames) -> Iterator[str]:
    """A name without ending for what is written for each frame: of files that of the file, else source and number."""
    from tiltvp.streams.image_files import ImageFiles

    if isinstance(frames, ImageFiles):
        yield from distinct_names(frames.files)
        return
    stem = "frame" if frames.source == "-" else Path(frames.source).stem.replace(" ", "_")
    number = 0
    while True:
        yield f"{stem}_{number:06d}"
        number += 1


def distinct_names(files: Sequence[Path]) -> list[str]:
    """A name without ending for each file: its stem, with folders in front and the ending behind where stems are equal.

    Names that differ only in case count as equal, as some file systems have it.
    """
    groups: dict[str, list[int]] = {}
    for i, file in enumerate(files):
        groups.setdefault(file.stem.lower(), []).append(i)
    names = [file.stem for file in files]
    for places in groups.values():
        if len(places) > 1:
            for i, name in zip(places, _told_apart([files[i] for i in places]), strict=True):
                names[i] = name
    return _numbered(names)


def _told_apart(files: Sequence[Path]) -> list[str]:
    """Names for files of one stem: as few folders as tell them apart, and the endings if one folder has several."""
    folders = [Path(os.path.abspath(file)).parent.parts[1:] for file in files]
    several = len(set(folders)) < len(folders)
    ends = [f"{file.stem}_{file.suffix.lstrip('.')}" if several else file.stem for file in files]
    for depth in range(0 if len(set(folders)) == 1 else 1, max(map(len, folders)) + 1):
        names = [
            "_".join([*parts[max(0, len(parts) - depth) :], end]) for parts, end in zip(folders, ends, strict=True)
        ]
        if len({name.lower() for name in names}) == len(names):
            return names
    return ["_".join([*parts[-1:], end]) for parts, end in zip(folders, ends, strict=True)]


def _numbered(names: list[str]) -> list[str]:
    """The names, with a number where two are still equal."""
    taken: set[str] = set()
    for i, name in enumerate(names):
        number, candidate = 2, name
        while candidate.lower() in taken:
            candidate, number = f"{name}_{number}", number + 1
        names[i] = candidate
        taken.add(candidate.lower())
    return names
