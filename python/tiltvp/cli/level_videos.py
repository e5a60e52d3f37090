"""Videos made level by the tilt of the drive, frame by frame, at their own rate."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from tiltvp.cli.results import Outcome
from tiltvp.cli.sources import ending_at_interrupt
from tiltvp.cli.terminal import complain, progress_bar
from tiltvp.errors import TiltvpError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp.cli.level_images import Levelling
    from tiltvp.streams import Frame, Frames, Motion


def write_video(frames: Frames, motions: Iterable[Motion | None], path: Path, work: Levelling) -> tuple[int, int]:
    """Writes a level video, whole or not at all, by the filter of `work`; how many of how many frames are level.

    Frames for which it has no tilt are black, so that time goes on, or as they are where that is asked for. The sound
    of a video file is copied; what cannot be is a line on stderr.
    """
    from tiltvp.streams.video_files import VIDEO_ENDINGS
    from tiltvp.videos import video_writer

    sound_of = frames.source if Path(frames.source).suffix.lower() in VIDEO_ENDINGS else None
    judge, levelled, count, shape = work.filtering.judge(), 0, 0, None
    with (
        progress_bar(frames.count or 0, "frames") as bar,
        video_writer(path, frames.rate_hz, sound_of=sound_of) as video,
        ending_at_interrupt(frames) as coming,
    ):
        for frame, motion in zip(coming, motions, strict=False):
            count += 1
            image, outcome = _looked_at(frame, work)
            outcome = judge(outcome, motion)
            tilt, shown = work.believed(outcome), None
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
                video.add(_black(shape) if shown is None else shown, frame.time_s)
            bar.advance()
    judge.plot()
    if video.note is not None:
        complain(f"{frames.source}: {video.note}")
    return levelled, count


def _looked_at(frame: Frame, work: Levelling) -> tuple[NDArray[np.uint8] | None, Outcome]:
    """A frame's image, None where it cannot be used, and what its edges tell."""
    file = Path(frame.name)
    try:
        image = frame.read()
        return image, Outcome(file, work.look(image).estimate(image), taken_s=frame.time_s)
    except TiltvpError as error:
        return None, Outcome(file, error=" ".join(str(error).split()), taken_s=frame.time_s)


def _bgr(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    import cv2
    import numpy as np

    return image if image.ndim == 3 else np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def _black(shape: tuple[int, int, int]) -> NDArray[np.uint8]:
    import numpy as np

    return np.zeros(shape, dtype=np.uint8)
