"""Whether frames are those of the camera and its mounting, told before the work."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from tiltvp.cli.terminal import complain, named
from tiltvp.errors import InvalidInputError, TiltvpError, counted

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp import TiltEstimator, _core
    from tiltvp.lines import LineExtractor
    from tiltvp.segments import SegmentDetector
    from tiltvp.streams import FrameMotions, Frames

    Mounted = TiltEstimator | LineExtractor

__all__ = [
    "check_panoramas",
    "check_sizes",
    "tell_lens_of",
    "tell_setup",
    "tell_setup_of",
    "tell_turns",
    "tell_unusable",
]


def check_sizes(frames: Frames, camera: _core.Camera, *, names_each: bool) -> None:
    """Looks at the headers of image files, and at the first frame of a video or recording, before any work is done.

    A line on stderr for those of another size than the camera's, which are `told` of then; and, where nothing
    `names_each` later, one for files that cannot be read, told of too. Raises `InvalidInputError` where none is left,
    unless all cannot be read and each will be named.
    """
    from tiltvp.images import size_problem

    unread, sized, sizes = dict[str, str](), dict[str, str](), dict(_sizes(frames))
    for name, size in sizes.items():
        if isinstance(size, TiltvpError):
            unread[name] = str(size)
        elif size is not None and size != (camera.width, camera.height):
            sized[name] = f"{name}: {size_problem(size, camera)}"
    lines = []
    for such, what in (({} if names_each else unread, "read"), (sized, "used for their size")):
        if such:
            of = f"{len(such)} of {len(sizes)} images cannot be {what}, first " if len(sizes) > 1 else ""
            lines.append(of + next(iter(such.values())))
    if (sized or not names_each) and 0 < len(sizes) == len(unread) + len(sized):
        raise InvalidInputError("; ".join(lines))
    for line in lines:
        complain(line)
    frames.told = sized.keys() if names_each else sized.keys() | unread.keys()


def check_panoramas(frames: Frames) -> None:
    """Raises `InvalidInputError` where no image is twice as wide as high, as 360-degree panoramas are."""
    sizes = [(name, size) for name, size in _sizes(frames) if not isinstance(size, TiltvpError)]
    for name, size in sizes[:1]:
        if size is not None and all(each is not None and each[0] != 2 * each[1] for _, each in sizes):
            found = f"{name}: {size[0]} x {size[1]} pixels, and no --camera"
            raise InvalidInputError(f"{found}, expected one, or 360-degree panoramas, twice as wide as high")


def tell_unusable(frames: Frames, problems: Mapping[str, TiltvpError]) -> None:
    """A line on stderr for images that were decoded and could not be used, unless it was told of before."""
    new = [named(name, str(problem)) for name, problem in problems.items() if name not in frames.told]
    if new:
        complain(f"{counted(len(new), 'images')} cannot be used, first {new[0]}" if len(new) > 1 else new[0])


def tell_setup(images: Sequence[NDArray[Any]], estimator: Mounted, mask: NDArray[Any] | None) -> None:
    """A line on stderr where images from different places speak against the mounting or the calibration."""
    from tiltvp import check_setup

    found = check_setup(images, estimator.camera, estimator.robot_from_camera, mask=mask)
    if not found:
        suspect = "--camera" if found.believable else "--robot-from-camera"
        complain(f"{suspect}: {found.reason}")


def tell_setup_of(frames: Frames, finder: Mounted | SegmentDetector, moved: FrameMotions | None = None) -> None:
    """`tell_setup` of a few frames, spread over a source that can be read again, and `tell_turns` of more; of the
    calibration alone where edges are looked for whichever way the camera is mounted."""
    from tiltvp.segments import SegmentDetector

    mask = finder.options["mask"]
    if isinstance(finder, SegmentDetector):
        tell_lens_of(frames, finder.camera, mask, "--camera")
    elif images := _few(frames, finder.camera):
        tell_setup(images, finder, mask)
        tell_turns(frames, finder, moved)


def tell_lens_of(frames: Frames, camera: _core.Camera, mask: NDArray[Any] | None, option: str) -> None:
    """A line on stderr where a few frames, spread over a source that can be read again, speak against the calibration
    of an option."""
    from tiltvp import check_lens

    images = _few(frames, camera)
    if images and not (found := check_lens(images, camera, mask=mask)):
        complain(f"{option}: {found.reason}")


def tell_turns(frames: Frames, estimator: Mounted, moved: FrameMotions | None) -> None:
    """A line on stderr where images turn otherwise than the odometry tells, as of another sense, clock or unit."""
    if moved is None or not moved.turns_known:
        return
    from tiltvp import check_turns
    from tiltvp.robot_setup import turning
    from tiltvp.turn_errors import turn_error

    seen = turning(frames, estimator.camera, moved.motions)
    way = check_turns(*seen, estimator.robot_from_camera)
    found = way if way.reversed else turn_error(*seen, estimator.robot_from_camera)
    if way.reversed or not found:
        complain(f"--odometry: {found.reason}")


def _few(frames: Frames, camera: _core.Camera) -> list[NDArray[Any]]:
    """Images spread over a source that can be read again; none where there are too few to tell anything."""
    from tiltvp.robot_setup import LEAST, spread

    images = [image for _, image in spread(frames, camera, LEAST)]
    return images if len(images) >= LEAST else []


def _sizes(frames: Frames) -> Iterator[tuple[str, tuple[int, int] | TiltvpError | None]]:
    """Name and (width, height) of each file, or of the first frame for all of another source; what is wrong with one
    that cannot be read; and None for what is no regular file."""
    from tiltvp.images import image_size
    from tiltvp.streams.image_files import ImageFiles

    if not isinstance(frames, ImageFiles):
        for frame in frames.sample(range(1)) if frames.count else ():
            image = frame.image
            yield frame.name, None if isinstance(image, TiltvpError) else (image.shape[1], image.shape[0])
        return
    for name, file in zip(frames.names or (), frames.files, strict=True):
        try:
            special = file.exists() and not file.is_file()
            yield name, None if special else image_size(file)
        except TiltvpError as error:
            yield name, error
