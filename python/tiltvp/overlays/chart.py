"""A chart drawn with OpenCV: a frame with ticks and titles, and curves, bars, cells and words in it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Picture = NDArray[np.uint8]
    Limits = tuple[float, float]

__all__ = ["Chart", "bgr_of", "text_width", "titled"]

BLACK, GREY, PALE = "#000000", "#808080", "#d8d8d8"
_TEXT = 0.42
"""Size of the letters, as OpenCV counts it: about 9 pixels high."""
_TITLE_PX, _FOOT_PX, _EDGE_PX = 30, 46, 14
"""Room for the title, for ticks and label below, and at the right edge."""


def bgr_of(colour: str) -> tuple[int, int, int]:
    """(blue, green, red) of `#rrggbb`."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return blue, green, red


def text_width(words: str) -> int:
    """Columns of pixels that the words take."""
    import cv2

    return int(cv2.getTextSize(words, cv2.FONT_HERSHEY_SIMPLEX, _TEXT, 1)[0][0])


class Chart:
    """A white picture of `height` rows and `width` columns with a frame in it, whose corners are at the limits."""

    def __init__(
        self,
        size: tuple[int, int],
        x: Limits,
        y: Limits,
        *,
        labels: tuple[str, str, str] = ("", "", ""),
        ticks: tuple[Sequence[float], Sequence[float]] = ((), ()),
        left_px: int = 60,
    ) -> None:
        """`size` is (height, width), `labels` the title, that of x and that of y, `left_px` the room beside y."""
        height, width = size
        self.picture: Picture = np.full((height, width, 3), 255, dtype=np.uint8)
        self._low = np.array([left_px, height - _FOOT_PX], dtype=np.float64)
        self._high = np.array([width - _EDGE_PX, _TITLE_PX], dtype=np.float64)
        self._limits = np.array([x, y], dtype=np.float64)
        title, below, beside = labels
        self._say(title, (left_px + self._high[0]) / 2.0, 20.0, 0.5)
        self._say(below, (left_px + self._high[0]) / 2.0, height - 10.0, 0.5)
        if beside:
            self._say_upwards(beside)
        for value in ticks[0]:
            column = self.places([value], [y[0]])[0, 0]
            self._say(f"{value:g}", column, self._low[1] + 16.0, 0.5)
            self.curve([value, value], y, PALE)
        for value in ticks[1]:
            row = self.places([x[0]], [value])[0, 1]
            self._say(f"{value:g}", left_px - 6.0, row + 4.0, 1.0)
            self.curve(x, [value, value], PALE)

    def places(self, x: Any, y: Any) -> NDArray[np.float64]:
        """(N, 2): pixels (u, v) of values."""
        values = np.stack([np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)], axis=-1)
        low, high = self._limits[:, 0], self._limits[:, 1]
        return self._low + (values - low) / (high - low) * (self._high - self._low)

    def curve(self, x: Any, y: Any, colour: str, *, width: int = 1, dashed: bool = False) -> None:
        """A line through the values, of one a point; what lies outside of the frame is cut off."""
        import cv2

        places = np.rint(self.places(x, y)).astype(int).tolist()
        box = self._box()
        for i, (start, end) in enumerate(pairwise(places if len(places) != 1 else 2 * places)):
            seen, a, b = cv2.clipLine(box, start, end)
            if seen and not (dashed and i % 10 >= 6):
                cv2.line(self.picture, a, b, bgr_of(colour), width, cv2.LINE_AA)

    def band(self, x: Any, low: Any, high: Any, colour: str) -> None:
        """An area between two curves over the same values of x; where bands lie on each other both are seen."""
        import cv2

        left, top, width, height = self._box()
        there, back = self.places(x, low), self.places(x, high)[::-1]
        corners = np.rint(np.clip(np.concatenate([there, back]), -1e4, 1e4)).astype(np.int32)
        shade = self.picture.copy()
        cv2.fillPoly(shade, [corners.reshape(-1, 1, 2)], bgr_of(colour))
        inside = (slice(top, top + height), slice(left, left + width))
        self.picture[inside] = np.minimum(self.picture[inside], shade[inside])

    def bar(self, x: float, y: Limits, colour: str) -> None:
        """A filled bar from zero to `x`, between two values of y."""
        import cv2

        corners = np.rint(self.places([0.0, x], y)).astype(int).tolist()
        cv2.rectangle(self.picture, corners[0], corners[1], bgr_of(colour), -1)

    def dot(self, x: float, y: float, colour: str) -> None:
        """A disc at a place."""
        import cv2

        cv2.circle(self.picture, np.rint(self.places(x, y)).astype(int).tolist(), 5, bgr_of(colour), -1, cv2.LINE_AA)

    def cross(self, x: float, y: float, colour: str) -> None:
        """An upright cross at a place."""
        import cv2

        place = np.rint(self.places(x, y)).astype(int).tolist()
        cv2.drawMarker(self.picture, place, bgr_of(colour), cv2.MARKER_CROSS, 18, 2, cv2.LINE_AA)

    def cells(self, shares: NDArray[np.float64]) -> None:
        """Fills the frame with a grid (rows from the top, columns): 0 is white, 1 black."""
        import cv2

        left, top, width, height = self._box()
        grey = np.asarray(255.0 * (1.0 - np.clip(shares, 0.0, 1.0)), dtype=np.uint8)
        grown = cv2.resize(grey, (width, height), interpolation=cv2.INTER_NEAREST)
        self.picture[top : top + height, left : left + width] = grown[:, :, None]

    def words(self, x: float, y: float, text: str, *, across_px: float = 0.0) -> None:
        """Words that begin beside a place, halfway up."""
        place = self.places(x, y)
        self._say(text, place[0] + across_px, place[1] + 4.0, 0.0)

    def legend(self, entries: Sequence[tuple[str, str]]) -> None:
        """Labels and their colours in the upper right corner, on white."""
        import cv2

        if not entries:
            return
        wide = max(text_width(label) for label, _ in entries) + 44
        left, top = int(self._high[0]) - wide - 6, int(self._high[1]) + 6
        bottom = top + 18 * len(entries) + 6
        cv2.rectangle(self.picture, (left, top), (left + wide, bottom), (255, 255, 255), -1)
        cv2.rectangle(self.picture, (left, top), (left + wide, bottom), bgr_of(PALE), 1)
        for i, (label, colour) in enumerate(entries):
            row = top + 12 + 18 * i
            cv2.line(self.picture, (left + 8, row), (left + 30, row), bgr_of(colour), 2, cv2.LINE_AA)
            self._say(label, left + 36.0, row + 4.0, 0.0)

    def framed(self) -> Picture:
        """The picture with its frame."""
        import cv2

        left, top, width, height = self._box()
        cv2.rectangle(self.picture, (left, top), (left + width, top + height), bgr_of(GREY), 1)
        return self.picture

    def _box(self) -> tuple[int, int, int, int]:
        left, bottom = self._low.astype(int).tolist()
        right, top = self._high.astype(int).tolist()
        return left, top, right - left, bottom - top

    def _say(self, text: str, column: float, row: float, share: float) -> None:
        """Words of which `share` lies left of the column."""
        import cv2

        place = (round(column - share * text_width(text)), round(row))
        cv2.putText(self.picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, _TEXT, (0, 0, 0), 1, cv2.LINE_AA)

    def _say_upwards(self, text: str) -> None:
        import cv2

        strip = np.full((18, text_width(text) + 4, 3), 255, dtype=np.uint8)
        cv2.putText(strip, text, (2, 13), cv2.FONT_HERSHEY_SIMPLEX, _TEXT, (0, 0, 0), 1, cv2.LINE_AA)
        turned = np.rot90(strip)
        top = max(0, round((self._low[1] + self._high[1] - turned.shape[0]) / 2.0))
        part = self.picture[top : top + turned.shape[0], 2:20]
        part[:] = turned[: part.shape[0]]


def titled(picture: Picture, size: tuple[int, int], title: str) -> Picture:
    """A picture, as large as fits into (height, width), on white below a title."""
    import cv2

    height, width = size
    canvas = np.full((height, width, 3), 255, dtype=np.uint8)
    scale = min((height - _TITLE_PX - 4) / picture.shape[0], (width - 8) / picture.shape[1])
    way = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC
    shown = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=way)
    left = (width - shown.shape[1]) // 2
    canvas[_TITLE_PX : _TITLE_PX + shown.shape[0], left : left + shown.shape[1]] = shown
    place = (max(4, (width - text_width(title)) // 2), 20)
    cv2.putText(canvas, title, place, cv2.FONT_HERSHEY_SIMPLEX, _TEXT, (0, 0, 0), 1, cv2.LINE_AA)
    return canvas
