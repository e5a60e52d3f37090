"""What a person watches in the Rerun viewer, or a recording of it: pictures, curves, points and poses over time."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tiltvp.errors import InvalidInputError, MissingExtraError, OutputError
from tiltvp.files import check_output, whole_file

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

__all__ = ["VIEWER", "Viewer", "check_viewer", "open_viewer"]

VIEWER: Final = "viewer"
"""The word for the viewer itself, in place of a file."""
_ENDING: Final = ".rrd"
_END: Final = b"RRF2FOOT"
_END_BYTES: Final = 64
"""The mark of a recording's end, which is written last, and in how many last bytes it is."""
_PORT: Final = 9876
"""Where the viewer listens, as Rerun has it."""
_ANSWER_S: Final = 5.0
"""Seconds for its answer, as many as Rerun waits for a viewer that begins."""
_SINCE_1970_S: Final = 1e9
"""Times from here on (the year 2001) are taken for seconds since 1970, smaller ones for those of a clock of its own."""


def check_viewer(where: str) -> None:
    """Refuses what cannot be written, before any work is done: `where` is `viewer` or a file in .rrd.

    Raises `InvalidInputError`, `OutputError`, and `MissingExtraError` without the extra `rerun`.
    """
    if where != VIEWER:
        if Path(where).suffix.lower() != _ENDING:
            raise InvalidInputError(f"{where}: ends in {Path(where).suffix!r}, expected {_ENDING} or {VIEWER}")
        check_output(where)
    _rerun()


def _rerun() -> Any:
    try:
        import rerun
    except ImportError as error:
        raise MissingExtraError.of("the viewer of Rerun", "rerun", error) from None
    return rerun


@contextmanager
def open_viewer(where: str | os.PathLike[str], name: str = "tiltvp") -> Iterator[Viewer]:
    """The viewer of Rerun, which is begun if none listens, or a recording (.rrd) that appears when the block ends.

    Raises as `check_viewer` does, and `OutputError` where no viewer can be begun.
    """
    where = os.fspath(where)
    check_viewer(where)
    stream = _rerun().RecordingStream(name)
    try:
        if where == VIEWER:
            try:
                stream.spawn(port=_PORT)
                # One that finds no screen ends at once, which Rerun tells in its log alone.
                socket.create_connection(("127.0.0.1", _PORT), _ANSWER_S).close()
            except (RuntimeError, OSError) as error:
                raise OutputError(f"the viewer of Rerun cannot be begun ({error}), expected a file in .rrd") from None
            yield Viewer(stream)
        else:
            with whole_file(where) as part:
                stream.save(part)
                yield Viewer(stream)
                # What is not yet written is so before the file takes its name.
                stream.disconnect()
                _check_whole(part, where)
    finally:
        stream.disconnect()


def _check_whole(part: Path, where: str) -> None:
    """Refuses a recording without its end: Rerun tells of a full disk in its log alone. Raises `OutputError`."""
    with open(part, "rb") as written:
        written.seek(-min(_END_BYTES, part.stat().st_size), os.SEEK_END)
        if _END not in written.read():
            raise OutputError(f"{where}: cannot be written (its end is missing), expected a disk with room")


class Viewer:
    """Takes what is shown of each frame. Paths are those of Rerun's entities, `/` between their parts."""

    def __init__(self, stream: Any) -> None:
        """Use `open_viewer`."""
        self._rerun = _rerun()
        self._stream = stream
        self._named: set[str] = set()

    def at(self, number: int, time_s: float | None = None) -> None:
        """What comes next belongs to the frame or step of this number, from 0, and to its time where that is known."""
        self._stream.set_time("frame", sequence=number)
        if time_s is None:
            return
        if time_s >= _SINCE_1970_S:
            self._stream.set_time("taken", timestamp=time_s)
        else:
            self._stream.set_time("time", duration=time_s)

    def picture(self, path: str, image: NDArray[np.uint8]) -> None:
        """An image, (H, W) or (H, W, 3) BGR uint8, as a JPEG."""
        import cv2

        done, data = cv2.imencode(".jpg", image)
        if done:
            self._stream.log(path, self._rerun.EncodedImage(contents=data.tobytes(), media_type="image/jpeg"))

    def curves(
        self, path: str, values: Sequence[float], names: Sequence[str], colours: Sequence[Sequence[int]] | None = None
    ) -> None:
        """A value of each curve of a plot; NaN: there is none. Names and RGB are those of the first call."""
        if path not in self._named:
            self._named.add(path)
            style = self._rerun.SeriesLines(names=list(names), colors=colours)
            self._stream.log(path, style, static=True)
        self._stream.log(path, self._rerun.Scalars(list(values)))

    def points(
        self, path: str, places: ArrayLike, *, labels: Sequence[str] | None = None,
        colours: Sequence[Sequence[int]] | None = None, radius: float = 0.05,
    ) -> None:  # fmt: skip
        """Points (N, 3), metres, with RGB; `radius` in metres."""
        shown = self._rerun.Points3D(places, labels=labels, colors=colours, radii=radius)
        self._stream.log(path, shown)

    def path(self, path: str, places: ArrayLike) -> None:
        """A line through points (N, 3), metres."""
        self._stream.log(path, self._rerun.LineStrips3D([places]))

    def pose(self, path: str, place: ArrayLike, turn: ArrayLike, *, axes_m: float = 0.2) -> None:
        """Where a frame is in the one above it: origin (3,), axes the columns of `turn` (3, 3), drawn `axes_m` long."""
        rerun = self._rerun
        self._stream.log(path, rerun.Transform3D(translation=place, mat3x3=turn), rerun.TransformAxes3D(axes_m))

    def gone(self, path: str) -> None:
        """Nothing is there from now on; else the viewer goes on to show what came last."""
        self._stream.log(path, self._rerun.Clear(recursive=False))

    def say(self, words: str, *, warns: bool = False) -> None:
        """A line in the log."""
        level = self._rerun.TextLogLevel.WARN if warns else self._rerun.TextLogLevel.INFO
        self._stream.log("log", self._rerun.TextLog(words, level=level))
