"""Frames in their order, from a folder, a pattern or a video."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tiltvp.cli.inputs import find_images
from tiltvp.cli.terminal import complain
from tiltvp.errors import ImageFileError, InvalidInputError, TiltvpError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Frames:
    """Where frames come from. Iterating gives each frame's image, or what is wrong with it."""

    files: list[Path]
    """What each frame is called; for videos the file and the number of the frame."""
    rate_hz: float
    video: Any = None
    """The reader of a video; None for image files."""

    def __iter__(self) -> Iterator[NDArray[np.uint8] | TiltvpError]:
        from tiltvp.images import read_image

        if self.video is None:
            for file in self.files:
                try:
                    yield read_image(file)
                except TiltvpError as error:
                    yield error
            return
        count = 0
        for _, image in zip(self.files, self.video, strict=False):
            yield image
            count += 1
        for _ in self.files[count:]:
            yield ImageFileError("cannot be decoded")


def open_frames(source: str) -> Frames:
    """The frames of a folder, a pattern or a video. Raises `TiltvpError` where there are none."""
    from tiltvp.videos import VIDEO_ENDINGS, VideoReader

    path = Path(source)
    if path.suffix.lower() in VIDEO_ENDINGS and not path.is_dir():
        reader = VideoReader(path)
        if reader.count == 0:
            raise ImageFileError(f"{path}: a video without frames")
        digits = len(str(reader.count - 1))
        return Frames([Path(f"{path}#{k:0{digits}d}") for k in range(reader.count)], reader.rate_hz, reader)
    files, problems = find_images([source])
    for problem in problems:
        complain(problem)
    if not files:
        raise InvalidInputError(f"{source}: no frames, expected a folder of images, a pattern or a video")
    return Frames(files, 25.0)
