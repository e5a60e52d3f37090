"""What a person watches while tilts are estimated: the marked image, the level image, and the tilt over time."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.overlays.chart import Chart, titled
from tiltvp.streams.outputs.tilts import attitude

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.streams.outputs.tilts import Tilt

    Picture = NDArray[np.uint8]

__all__ = ["PITCH", "ROLL", "TiltView", "live_words", "roll_and_pitch"]

ROLL, PITCH = "#c0392b", "#2463a8"
_ROLL_BAND, _PITCH_BAND = "#f0c8c0", "#c4d8f0"
_PANEL: Final = (420, 640)
"""Rows and columns of each picture: two of them and the chart fit a screen of 1,366 x 768."""
_CHART_ROWS: Final = 240
_SPAN_S: Final = 20.0
"""Seconds of the chart: a bump takes a tenth of it, and a drift of a degree a minute a third of a degree."""
_STEPS_MOST: Final = 2_000
"""Of tilts in the chart: more than its columns of pixels, in 20 s at 100 frames a second."""
BAND_SIGMAS: Final = 1.96
"""Half the width of a band that holds 95 % of a normal distribution."""
_LEVEL_MIN: Final = 1e-3
"""Cosine of the pitch at which roll has no meaning: a twentieth of a degree from nose down."""
_LIMITS_DEG: Final = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 45.0, 90.0, 180.0)


def roll_and_pitch(tilt: Tilt | None) -> NDArray[np.float64]:
    """(2, 3) degrees: roll and pitch, each with the ends of its band of 95 %; NaN where there is no tilt."""
    if not tilt:
        return np.full((2, 3), np.nan)
    _, covariance = attitude(tilt)
    # Roll is about an axis that is nose down by the pitch, of which an error about the level one is a part.
    half = BAND_SIGMAS * np.sqrt(np.diag(covariance)[:2]) / [max(math.cos(tilt.pitch_rad), _LEVEL_MIN), 1.0]
    middle = np.array([tilt.roll_rad, tilt.pitch_rad])
    return np.asarray(np.degrees(np.stack([middle, middle - half, middle + half], axis=1)), dtype=np.float64)


class TiltView:
    """One picture of the last 20 seconds, to be shown again with each frame: (660, 1280, 3) BGR uint8."""

    def __init__(self) -> None:
        self._rows: deque[tuple[float, NDArray[np.float64]]] = deque(maxlen=_STEPS_MOST)

    def add(self, time_s: float, tilt: Tilt | None) -> None:
        """The tilt of the next frame; None where there is none. After a time that goes back the chart begins anew."""
        if self._rows and time_s < self._rows[-1][0]:
            self._rows.clear()
        self._rows.append((time_s, roll_and_pitch(tilt)))
        while self._rows[0][0] < time_s - _SPAN_S:
            self._rows.popleft()

    def picture(self, seen: Picture | None, level: Picture | None, words: str) -> Picture:
        """The marked frame, beside it the level image (None: there is none of either), below them the chart."""
        import cv2

        black = np.zeros((*(_PANEL if seen is None else seen.shape[:2]), 3), np.uint8)
        shown = black if level is None else level
        if shown.ndim == 2:
            shown = np.asarray(cv2.cvtColor(shown, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
        left = titled(black, _PANEL, "no image") if seen is None else titled(seen, _PANEL, "inlier edges and horizon")
        right = titled(shown, _PANEL, "level" if level is not None else "no tilt, not level")
        return np.vstack([np.hstack([left, right]), self._chart(words)])

    def _chart(self, words: str) -> Picture:
        times = np.array([time_s for time_s, _ in self._rows])
        rows = np.array([row for _, row in self._rows]).reshape(-1, 2, 3)
        largest = float(np.nanmax(np.abs(rows))) if np.isfinite(rows).any() else 0.0
        limit = next((limit for limit in _LIMITS_DEG if limit >= largest), _LIMITS_DEG[-1])
        ago = times - times[-1] if len(times) else times
        chart = Chart(
            (_CHART_ROWS, 2 * _PANEL[1]), (-_SPAN_S, 0.0), (-limit, limit),
            labels=(words, "seconds before now, with bands of 95 %", "degrees"),
            ticks=(np.arange(-_SPAN_S, 1.0, 5.0).tolist(), (-limit, 0.0, limit)),
        )  # fmt: skip
        known = np.isfinite(rows).all(axis=(1, 2)) if len(rows) else np.zeros(0, dtype=bool)
        for run in _runs(known):
            for k, colour in enumerate((_ROLL_BAND, _PITCH_BAND)):
                chart.band(ago[run], rows[run, k, 1], rows[run, k, 2], colour)
        for run in _runs(known):
            for k, colour in enumerate((ROLL, PITCH)):
                chart.curve(ago[run], rows[run, k, 0], colour, width=2)
        chart.legend((("roll", ROLL), ("pitch", PITCH)))
        return chart.framed()


def _runs(known: NDArray[np.bool_]) -> list[slice]:
    """The stretches without a gap."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(np.int8)))
    return [slice(int(start), int(end)) for start, end in ends.reshape(-1, 2)]


def live_words(tilt: Tilt | None, sure: float, rate_hz: float) -> str:
    """A line about the last frame, of the letters that pictures can show."""
    roll, pitch = roll_and_pitch(tilt)
    pace = f"{rate_hz:.1f} frames/s" if math.isfinite(rate_hz) else "- frames/s"
    if not tilt:
        return f"no tilt; {pace}"
    told = ", ".join(
        f"{name} {row[0]:.2f} +- {row[2] - row[0]:.2f} deg" for name, row in (("roll", roll), ("pitch", pitch))
    )
    return f"{told} (95 %); confidence {sure:.2f}; {pace}"
