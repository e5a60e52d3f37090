"""Video files, written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tiltvp.arguments import path_from
from tiltvp.errors import InvalidInputError, OutputError
from tiltvp.files import scratch_folder, whole_file
from tiltvp.video_sound import add_sound

if TYPE_CHECKING:
    import cv2
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["VideoWriter", "video_writer"]

CODECS: Final = {".mp4": "mp4v", ".avi": "MJPG"}
"""Of videos that are written, by their endings."""


class VideoWriter:
    """Takes the frames of a video that is being written, all of the size of the first."""

    def __init__(self, path: Path, rate_hz: float, name: Path) -> None:
        """Nothing is written before the first frame. `name` is what messages call it."""
        self._path, self._rate_hz, self._name = path, rate_hz, name
        self._writer: cv2.VideoWriter | None = None
        self._shape: tuple[int, ...] = ()
        self.count = 0
        """How many frames it was given."""
        self.times_s: list[float | None] = []
        """When they were taken, None where nobody said."""
        self.note: str | None = None
        """What of times and sound was not kept, after the block."""

    def add(self, image: NDArray[np.uint8], time_s: float | None = None) -> None:
        """The next frame, (H, W, 3) BGR uint8; `time_s`, if known, by the clock of the video that the sound is of."""
        import cv2

        if self._writer is None:
            self._shape = image.shape
            code = cv2.VideoWriter.fourcc(*CODECS[self._path.suffix.lower()])
            self._writer = cv2.VideoWriter(str(self._path), code, self._rate_hz, (image.shape[1], image.shape[0]))
            if not self._writer.isOpened():
                raise OutputError(f"{self._name}: cannot be written (OpenCV opens no such video there)")
        if image.shape != self._shape:
            raise InvalidInputError(f"video frame: shape {image.shape}, expected {self._shape}")
        self._writer.write(image)
        self.count += 1
        self.times_s.append(time_s)

    def close(self) -> None:
        """Writes what is left."""
        if self._writer is not None:
            self._writer.release()


@contextmanager
def video_writer(
    path: str | os.PathLike[str], rate_hz: float = 25.0, *, sound_of: str | os.PathLike[str] | None = None
) -> Iterator[VideoWriter]:
    """A video (.mp4 or .avi) that appears when the block ends, unless an exception leaves it or it has no frames.

    An .mp4 keeps the times of its frames where they are known, else there are `rate_hz` a second. `sound_of` is a video
    whose sound is copied. Both want `pip install 'tiltvp[video]'`; `VideoWriter.note` says what is not kept.
    Raises `InvalidInputError` for other endings, `OutputError` where it cannot be written.
    """
    file = path_from(path)
    if file.suffix.lower() not in CODECS:
        raise InvalidInputError(f"{file}: ends in {file.suffix!r}, expected {' or '.join(CODECS)}")
    with whole_file(file) as part:
        writer = VideoWriter(part, rate_hz, file)
        try:
            yield writer
        finally:
            writer.close()
        if writer.count == 0:
            part.unlink()
        elif _frames_in(part) < writer.count:
            # OpenCV does not say that it could not write.
            raise OutputError(
                f"{file}: cannot be written (not all of {writer.count} frames), expected a place that can"
            )
        else:
            with scratch_folder(file) as folder:
                writer.note = add_sound(part, writer.times_s, rate_hz, sound_of, folder)


def _frames_in(path: Path) -> int:
    import cv2

    capture = cv2.VideoCapture(str(path))
    try:
        return int(capture.get(cv2.CAP_PROP_FRAME_COUNT)) if capture.isOpened() else 0
    finally:
        capture.release()
