"""The one door to frames: from what a person names to where they come from."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from tiltvp.arguments import path_from
from tiltvp.errors import InvalidInputError
from tiltvp.streams.bags import Recording, is_recording
from tiltvp.streams.frames import Frames
from tiltvp.streams.image_files import IMAGE_ENDINGS, ImageFiles
from tiltvp.streams.video_files import VIDEO_ENDINGS, open_video

__all__ = ["open_frames"]


def open_frames(
    source: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    topic: str | None = None,
    option: str = "--topic",
) -> Frames:
    """The frames of image files, folders and glob patterns, of a video, or of a bag or MCAP of ROS.

    Several sources may be given where all are images. `topic` is that of a recording's images, by default the only one,
    and `option` what messages call it.
    What was asked for and is not there is in `Frames.problems`; raises `TiltvpError` where there are no frames at all.
    """
    given = source if isinstance(source, Iterable) and not isinstance(source, str | bytes) else [source]
    words = [os.fspath(word) for word in given if path_from(word)]
    others = [word for word in words if is_recording(word) or _is_video(word)]
    if others and len(words) > 1:
        raise InvalidInputError(f"{others[0]}: beside other sources, expected one video or recording, or any images")
    if topic is not None and not (others and is_recording(words[0])):
        raise InvalidInputError(f"topic {topic!r} of {' '.join(words)}: no recording, expected a bag or MCAP")
    frames: Frames
    if others:
        frames = _recorded(words[0], topic, option) if is_recording(words[0]) else open_video(Path(words[0]))
    else:
        frames = ImageFiles(words)
    if frames.count == 0:
        folders = [Path(word) for word in words if os.path.isdir(word)]
        bags = sorted(str(file) for folder in folders for file in folder.iterdir() if is_recording(file))
        if bags:
            raise InvalidInputError(f"{frames.source}: a folder of recordings, expected one of them: {', '.join(bags)}")
        told = "; ".join(frames.problems) or (f"{frames.source}: no frames" if frames.source else "no names of files")
        kinds = f"images ({' '.join(IMAGE_ENDINGS)}), a video or a bag"
        raise InvalidInputError(told if frames.problems else f"{told}, expected {kinds}")
    return frames


def _is_video(word: str) -> bool:
    return Path(word).suffix.lower() in VIDEO_ENDINGS and not os.path.isdir(word)


def _recorded(word: str, topic: str | None, option: str) -> Frames:
    from tiltvp.streams.bag_images import BagFrames

    return BagFrames(Recording(word), topic, option=option)
