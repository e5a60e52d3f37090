"""What a person watches while a verb works: `--show` and `--rerun`."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from cyclopts import Group, Parameter

from tiltvp.cli.options import Switch

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import FilteredTilt, Leveller, TiltEstimate
    from tiltvp.cli.results import Outcome
    from tiltvp.cli.window import Window
    from tiltvp.streams import Frame, Frames, LiveCamera
    from tiltvp.streams.outputs.viewer import Viewer

    Picture = NDArray[np.uint8]

__all__ = ["RERUN", "RerunOptions", "ShowOptions", "TiltWatch", "rgb"]

RERUN: Final = "--rerun"
_LIVE_VIEW = Group("Live view")
_PACE_FRAMES: Final = 30
"""Of which the frame rate is the mean: a second of a usual camera, so that the number can be read."""


@Parameter(name="*", group=_LIVE_VIEW)
@dataclass(frozen=True, kw_only=True)
class RerunOptions:
    """What is watched in Rerun."""

    rerun: str | None = None
    """FILE.rrd for a recording of Rerun of what is found, frame by frame; without a file its viewer is opened."""

    def viewer(self) -> AbstractContextManager[Viewer | None]:
        """The viewer that was asked for. Raises `TiltvpError` before any work is done."""
        if self.rerun is None:
            return nullcontext()
        from tiltvp.streams.outputs.viewer import open_viewer

        return open_viewer(self.rerun)

    def check(self) -> None:
        """Refuses what cannot be, before any work is done."""
        if self.rerun is not None:
            from tiltvp.errors import TiltvpError
            from tiltvp.streams.outputs.viewer import check_viewer

            try:
                check_viewer(self.rerun)
            except TiltvpError as error:
                raise type(error)(f"{RERUN} {error}") from None


@Parameter(name="*", group=_LIVE_VIEW)
@dataclass(frozen=True, kw_only=True)
class ShowOptions(RerunOptions):
    """What is watched in a window or in Rerun."""

    show: Switch = False
    """Show each image as it is done in a window: inlier edges and horizon, the image made level, tilt over time with
    its band, frame rate. Closing the window, q and Escape end."""

    @property
    def asked(self) -> bool:
        """Whether anything is watched."""
        return self.show or self.rerun is not None

    @contextmanager
    def watch(self, frames: Frames, leveller: Callable[[], Leveller]) -> Iterator[TiltWatch | None]:
        """What shows the frames, None where nothing was asked for; the leveller is made only then.

        A window can be closed while a live camera that has gone is waited for, which ends it.
        """
        from tiltvp.streams import LiveCamera

        if not self.asked:
            yield None
            return
        with ExitStack() as stack:
            viewer = stack.enter_context(self.viewer())
            window = None
            if self.show:
                from tiltvp.cli.window import Window

                window = Window("tiltvp tilt")
                stack.callback(window.close)
                if isinstance(frames, LiveCamera):
                    frames.meanwhile = partial(_ended_with, window, frames)
            yield TiltWatch(leveller(), window, viewer)


def _ended_with(window: Window, frames: LiveCamera) -> None:
    if not window.attend():
        frames.end()


class TiltWatch:
    """Shows the tilts of frames as they come, in a window, in Rerun or in both."""

    def __init__(self, leveller: Leveller, window: Window | None, viewer: Viewer | None) -> None:
        from tiltvp.overlays.live import TiltView

        self._leveller, self._window, self._viewer = leveller, window, viewer
        self._view = TiltView()
        self._done_s: deque[float] = deque(maxlen=_PACE_FRAMES + 1)
        self._number = 0

    def __call__(self, frame: Frame, outcome: Outcome, marked: Picture | None) -> bool:
        """Shows a frame, with its edges where it could be read; whether anybody still watches."""
        tilt = outcome.filtered if outcome.filtered is not None else outcome.estimate
        level = self._leveller(frame.read(), tilt) if tilt and marked is not None else None
        self._done_s.append(time.monotonic())
        if self._viewer is not None:
            self._send(self._viewer, outcome, tilt, marked, level)
        if self._window is not None:
            from tiltvp.overlays.live import live_words

            # Sources without times are shown by when they are done.
            self._view.add(self._done_s[-1] if outcome.taken_s is None else outcome.taken_s, tilt)
            words = live_words(tilt, tilt.confidence if tilt else 0.0, self.rate_hz)
            self._window.show(self._view.picture(marked, level, words))
        self._number += 1
        return self._window is None or self._window.is_open

    @property
    def rate_hz(self) -> float:
        """Frames per second that are done; NaN before there are two."""
        steps, spent_s = len(self._done_s) - 1, self._done_s[-1] - self._done_s[0] if self._done_s else 0.0
        return steps / spent_s if spent_s > 0.0 else math.nan

    def _send(
        self, viewer: Viewer, outcome: Outcome, tilt: TiltEstimate | FilteredTilt | None,
        marked: Picture | None, level: Picture | None,
    ) -> None:  # fmt: skip
        from tiltvp.overlays.live import PITCH, ROLL, roll_and_pitch

        viewer.at(self._number, outcome.taken_s)
        for name, picture in (("image", marked), ("level", level)):
            if picture is None:
                viewer.gone(name)
            else:
                viewer.picture(name, picture)
        for name, colour, row in zip(("roll", "pitch"), (ROLL, PITCH), roll_and_pitch(tilt).tolist(), strict=True):
            pale = [(channel + 255) // 2 for channel in rgb(colour)]
            viewer.curves(
                f"tilt/{name}_deg", row, [name, f"{name}: lower end of 95 %", f"{name}: upper end of 95 %"],
                [rgb(colour), pale, pale],
            )  # fmt: skip
        viewer.curves("confidence", [tilt.confidence if tilt else 0.0], ["confidence"])
        viewer.curves("frame_rate_hz", [self.rate_hz], ["frames per second"])
        if outcome.error is not None:
            viewer.say(f"{outcome.file}: {outcome.error}", warns=True)
        elif outcome.verdict is not None and not outcome.accepted:
            viewer.say(f"{outcome.file}: {outcome.verdict}, {outcome.verdict_reason}", warns=True)


def rgb(colour: Any) -> list[int]:
    """(red, green, blue) of `#rrggbb`, or of OpenCV's (blue, green, red)."""
    return [int(colour[i : i + 2], 16) for i in (1, 3, 5)] if isinstance(colour, str) else list(colour)[::-1]
