"""By how much the turns that images show are off those that the odometry tells, as of another clock or unit."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.rotations import mounting_from
from tiltvp.turning import LEAST_PAIRS, Pictures, pairs_of, peak

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from tiltvp._core import Camera

__all__ = ["TurnError", "turn_error"]

_PAIRS: Final = 40
"""Pairs of images, spread over all, whose median is told."""
_TRIED_RAD: Final = np.radians(np.arange(-60.0, 61.0, 4.0))
"""Turns beyond those that are told: as far as pairs turn, and as fine as a parabola tells what is between."""
_OFF_RAD: Final = math.radians(6.0)
_AHEAD: Final = 0.13
"""By how much turns are off, and pairs more alike by those that they show, where turns are not as told. Thirteen
rendered drives, seen up and ahead, have at most 3.6 degrees and 0.10; five with frames that are 0.2 s late at least 8.1
and 0.16, with 0.8 or 1.5 times the right wheel base 4.4 to 9.7 degrees."""


@dataclass(frozen=True)
class TurnError:
    """How far turns that images show are off those that are told. False where that is too far."""

    pairs: int
    """Pairs of images that were compared."""
    off_rad: float
    """By how much the turns of pairs are off, in the median."""
    as_told: float
    """Mean correlation of pairs turned back as the odometry tells."""
    as_seen: float
    """The same by the turns at which pairs are most alike."""

    def __bool__(self) -> bool:
        return self.pairs < LEAST_PAIRS or self.off_rad < _OFF_RAD or self.as_seen < self.as_told + _AHEAD

    @property
    def reason(self) -> str:
        """What was found, in a sentence."""
        told = (
            f"{self.pairs} pairs of images turn otherwise than the odometry tells by {math.degrees(self.off_rad):.0f}"
        )
        alike = f"degrees in the median (they correlate by {self.as_seen:.2f} then, by {self.as_told:.2f} as told)"
        return f"{told} {alike}: expected times of one clock, turns in the right unit, and the right wheel base"


def turn_error(
    images: Iterable[ArrayLike], yaw_rad: ArrayLike, camera: Camera, robot_from_camera: ArrayLike
) -> TurnError:
    """By how much images (N of them, taken one after the other) turn otherwise than headings (N,) say, left positive.

    Of pairs of images the turn is looked for by which they are most alike. The mounting (3, 3) has to be right about
    which way is up. Raises `InvalidInputError` for sizes that do not fit.
    """
    pictures, up = Pictures(images, camera), np.asarray(mounting_from(robot_from_camera)[2])
    headings = pictures.headings(yaw_rad)
    pairs = pairs_of(headings)
    off, told, seen = [], [], []
    for k, other in pairs[:: -(-len(pairs) // _PAIRS) or 1]:
        turn = float(headings[k] - headings[other])
        alike = np.array([pictures.likeness(k, other, up * (turn + more)) for more in _TRIED_RAD])
        known = np.isfinite(alike)
        as_told = alike[len(alike) // 2]
        if known.sum() < 3 or not np.isfinite(as_told):
            continue
        by_rad, most = peak(_TRIED_RAD[known], alike[None, known])
        off.append(abs(by_rad))
        told.append(as_told)
        seen.append(most)
    if not off:
        return TurnError(0, 0.0, 0.0, 0.0)
    return TurnError(len(off), float(np.median(off)), float(np.mean(told)), float(np.mean(seen)))
