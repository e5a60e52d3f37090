"""The times of a video's frames, and the sound of another beside them: packets are copied, nothing is encoded anew."""

from __future__ import annotations

import heapq
import os
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tiltvp.errors import MissingExtraError

if TYPE_CHECKING:
    from av.container import InputContainer

__all__ = ["add_sound"]

_TICK_S: Final = Fraction(1, 90_000)
"""Of the times of frames: MPEG's clock, which has all usual rates as whole numbers."""
_APART_S: Final = 0.1
"""By how much sound may run apart from the picture unnoticed: ITU-R BT.1359 has 0.125 s as the first that is seen."""


def add_sound(
    path: Path, times_s: Sequence[float | None], rate_hz: float, source: str | os.PathLike[str] | None, scratch: Path
) -> str | None:
    """Copies the sound of `source` into the video `path`, whose frames were taken at `times_s` by the source's clock.

    MP4 files keep the frames' times, also without sound, so that both stay together; AVI has frames at even times only,
    `rate_hz` a second. Without a source times begin with the first frame. What could not be copied, or will not stay
    together, is told as a sentence; None where there is nothing to tell. Then the video is as it was. `scratch` is a
    folder on the same disk.
    """
    known = [time_s for time_s in times_s if time_s is not None]
    own = known if _rise(known) and path.suffix.lower() != ".avi" and len(known) == len(times_s) else None
    apart = _apart(known, rate_hz, what="time")
    if source is None and apart is None:
        return None
    try:
        import av
    except ImportError as error:
        told = apart or "its sound, if it has any, is not copied"
        return f"{told}; {MissingExtraError.of('what keeps sound and times', 'video', error)}"
    if source is None and own is not None:
        own = [time_s - own[0] for time_s in own]
    joined = scratch / f"joined{path.suffix}"
    copied: list[str] = []
    try:
        # As for frames, a name with a colon is no address.
        film = nullcontext(None) if source is None else av.open(f"file:{os.fspath(source)}")
        with film as heard, av.open(str(path)) as seen:
            sounds = [] if heard is None else heard.streams.audio
            if any(stream.codec_context is None for stream in sounds):
                raise ValueError("its codec is not known")
            copied = [stream.codec_context.name for stream in sounds]
            if copied:
                apart = _apart(known, rate_hz, what="sound")
            if not copied and (own is None or apart is None):
                return apart
            with av.open(str(joined), "w") as out:
                _copy(heard, seen, own, out)
        os.replace(joined, path)
    except (av.FFmpegError, ValueError) as error:
        why = " ".join(str(getattr(error, "strerror", None) or error).split())
        return f"its sound ({', '.join(copied) or 'of unknown kind'}) is not copied into {path.suffix} ({why})"
    return None if own is not None else apart


def _copy(heard: InputContainer | None, seen: InputContainer, times_s: Sequence[float] | None, out: Any) -> None:
    """Writes the frames' packets and those of the sound, in the order of their times."""
    frames = seen.streams.video[0]
    video = out.add_stream_from_template(frames)
    if times_s is not None:
        video.time_base = _TICK_S
    streams = () if heard is None else heard.streams.audio
    sound = {stream.index: out.add_stream_from_template(stream) for stream in streams}

    def pictures() -> Iterator[Any]:
        for number, packet in enumerate(packet for packet in seen.demux(frames) if packet.size):
            if times_s is not None:
                packet.time_base = _TICK_S
                packet.pts = packet.dts = round(times_s[number] / _TICK_S)
            packet.stream = video
            yield packet

    def sounds() -> Iterator[Any]:
        # Of no streams all would be told.
        for packet in heard.demux(list(streams)) if heard is not None and sound else ():
            if packet.size and packet.dts is not None:
                packet.stream = sound[packet.stream.index]
                yield packet

    for packet in heapq.merge(pictures(), sounds(), key=lambda packet: packet.dts * packet.time_base):
        out.mux(packet)


def _apart(times_s: Sequence[float], rate_hz: float, *, what: str) -> str | None:
    """What to tell of frames that are shown at even times; `what` is what these run apart from."""
    apart = max((abs(time_s - times_s[0] - number / rate_hz) for number, time_s in enumerate(times_s)), default=0.0)
    if apart <= _APART_S:
        return None
    told = f"its frames are not even: {what} and picture are up to {apart:.2f} s apart"
    return f"{told}; .mp4 keeps them together" if _rise(times_s) else f"{told}, as their times do not rise"


def _rise(times_s: Sequence[float]) -> bool:
    return all(before < after for before, after in pairwise(times_s))
