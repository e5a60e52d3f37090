"""What counters of wheels and their angles mean in metres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp._core import WHEEL_BASE_MAX_M
from tiltvp.arguments import number_from
from tiltvp.errors import InvalidInputError
from tiltvp.streams.odometry import GAP_MAX_S

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Wheels", "cumulative_m"]

_WRAPS: Final = (2**16, 2**32)
"""Counts after which counters of two and four bytes begin anew."""
_EDGE: Final = 1e-6
"""Share of a range by which angles go beyond its ends: those of floats of 32 bits beyond pi."""

_LONGEST_M: Final = {"wheel_base_m": WHEEL_BASE_MAX_M, "wheel_radius_m": 10.0}
"""The radius is thrice that of the largest tyres: what is beyond is millimetres."""


@dataclass(frozen=True, kw_only=True)
class Wheels:
    """What a record does not say of the wheels that made it. None: not known."""

    wheel_base_m: float | None = None
    """Distance between the wheels, metres: without it turns are not known."""
    wheel_radius_m: float | None = None
    """Radius of the wheels, metres: for ticks and angles."""
    ticks_per_turn: float | None = None
    """What the counter of a wheel counts in one turn."""
    joints: tuple[str, str] | None = None
    """Names of the joints of the left and the right wheel; None: those that are called so."""
    gap_max_s: float = GAP_MAX_S
    """Longest time between two samples that is interpolated, seconds."""

    def __post_init__(self) -> None:
        """Raises `InvalidInputError` for what is no length or count above 0, and for other than two joints."""
        for name in ("wheel_base_m", "wheel_radius_m", "ticks_per_turn", "gap_max_s"):
            if (value := getattr(self, name)) is None:
                continue
            object.__setattr__(self, name, number_from(value, name))
            if not 0.0 < getattr(self, name) < np.inf:
                raise InvalidInputError(f"{name} = {value}, expected a number above 0")
            if getattr(self, name) > (most := _LONGEST_M.get(name, np.inf)):
                raise InvalidInputError(f"{name} = {value}, expected metres, at most {most:g}")
        joints = self.joints
        if joints is not None and not (
            isinstance(joints, tuple | list)
            and len(joints) == 2
            and all(isinstance(joint, str) for joint in joints)
            and joints[0] != joints[1]
        ):
            raise InvalidInputError(f"joints = {self.joints!r}, expected names of two, the left and the right wheel's")

    @property
    def half_track_m(self) -> float | None:
        """Half the distance between the wheels, metres, as `TiltFilter` takes it."""
        return None if self.wheel_base_m is None else 0.5 * self.wheel_base_m


def cumulative_m(
    counts: NDArray[np.float64], per_turn: float, wheel_radius_m: float, source: str
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """(N, 2): how far both wheels had rolled, from counters (N, 2) of so many counts a turn; and what was noticed.

    Whole counts of two or four bytes that fall or rise by more than half their range have begun anew; and so have
    those that never leave one turn, where each step is below a quarter of it or above three quarters.
    """
    steps = np.diff(counts, axis=0, prepend=counts[:1])
    notes: list[str] = []
    whole = bool((counts == np.rint(counts)).all())
    for k, side in enumerate(("left", "right")):
        values, far = counts[:, k], np.abs(steps[:, k])
        within_turn = not ((far > 0.25 * per_turn) & (far < 0.75 * per_turn)).any()
        for wrap in (*((per_turn,) if within_turn else ()), *(_WRAPS if whole else ())):
            low = -0.5 * wrap if values.min() < 0.0 else 0.0
            jumps = far > 0.5 * wrap
            slack = _EDGE * wrap
            if low - slack <= values.min() and values.max() <= low + wrap + slack and jumps.any():
                steps[jumps, k] -= np.sign(steps[jumps, k]) * wrap
                notes.append(
                    f"{source}: the counter of the {side} wheel begins anew {jumps.sum()} times, at {wrap:.10g}"
                )
                break
        else:
            if np.ptp(values) <= per_turn and (far > 0.5 * per_turn).any():
                told = "never leaves one turn and jumps by over half of it: does it begin anew with each?"
                notes.append(f"{source}: the counter of the {side} wheel {told}")
    metres = 2.0 * np.pi * wheel_radius_m / per_turn
    return np.cumsum(steps, axis=0) * metres, tuple(notes)
