"""Videos made level by the tilt of the drive, frame by frame, at their own rate."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tiltvp.cli.results import Outcome
from tiltvp.cli.terminal import progress_bar
from tiltvp.errors import TiltvpError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp.cli.frames import Frames
    from tiltvp.cli.level_images import Levelling


def write_video(frames: Frames, path: Path, work: Levelling) -> tuple[int, int]:
    """Writes a level video, whole or not at all, always by the filter; how many of how many frames are level.

    Frames for which it has no tilt are black, so that time goes on, or as they are where that is asked for.
    """
    from tiltvp.videos import video_writer

    work = replace(work, filtering=replace(work.filtering, filter=True))
    # Outcomes are judged one by one, in the order of the frames: this is the frame of the one at hand.
    held: list[NDArray[np.uint8] | None] = [None]
    levelled, shape = 0, None
    motions = work.filtering.motions(frames.files)
    with progress_bar(len(frames.files), "frames") as bar, video_writer(path, frames.rate_hz) as video:
        for outcome in work.filtering.judged(_outcomes(frames, work, held), motions):
            image, tilt = held[0], work.believed(outcome)
            shown = None
            if image is not None:
                leveller = work.look(image).leveller
                shape = (leveller.output.height, leveller.output.width, 3)
                if tilt is not None:
                    shown = _bgr(leveller(image, tilt))
                    levelled += 1
                elif work.copies and image.shape[:2] == shape[:2]:
                    shown = _bgr(image)
            if tilt is None or image is None:
                done = "as it is" if shown is not None else "black" if shape is not None else "left out"
                bar.complain(f"{outcome.file}: {work.why_not(outcome)}; the frame is {done}")
            if shape is not None:
                video.add(_black(shape) if shown is None else shown)
            bar.advance()
    return levelled, len(frames.files)


def _outcomes(frames: Frames, work: Levelling, held: list[NDArray[np.uint8] | None]) -> Iterator[Outcome]:
    for file, image in zip(frames.files, frames, strict=True):
        held[0] = None
        try:
            if isinstance(image, TiltvpError):
                raise image
            estimate = work.look(image).estimate(image)
        except TiltvpError as error:
            yield Outcome(file, error=" ".join(str(error).split()))
            continue
        held[0] = image
        yield Outcome(file, estimate)


def _bgr(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    import cv2
    import numpy as np

    return image if image.ndim == 3 else np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def _black(shape: tuple[int, int, int]) -> NDArray[np.uint8]:
    import numpy as np

    return np.zeros(shape, dtype=np.uint8)
