"""Odometry over time: how far a robot had turned and driven at any instant of its record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp._core import WHEEL_BASE_MAX_M
from tiltvp.arguments import array_from, number_from, refuse_unless, shaped_from, texts_from
from tiltvp.errors import InvalidInputError, counted

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["GAP_MAX_S", "Motion", "Odometry", "Travelled", "gaps_told"]

GAP_MAX_S: Final = 0.5
"""Longest time between two samples that is interpolated. A robot that changes its speed by 1 m/s in a second is then at
most 1 * 0.5^2 / 8 = 3 cm from where the straight line between the samples has it."""
SAME_S: Final = 1e-6
"""Times closer than this are one: seconds since 1970 are told to 2.4e-7 s by a float, and clocks to less."""
_ASIDE_M: Final = 0.05
_ASIDE_SHARE: Final = 0.03
"""How far poses may move sideways, at least and as a share of the way: wheels that slip, and headings that drift by two
degrees, make less. A frame that is 5 cm off the axle moves by 31 cm in a turn."""
_FASTEST_M_S: Final = 50.0
_FASTEST_RAD_S: Final = 50.0
"""Beyond any vehicle that carries such a camera: twice a car on a motorway, eight turns a second."""
_JUMP: Final = 0.2
_JUMP_PER_S2: Final = 10.0
_JUMP_SHARE: Final = 3.0
"""Metres or radians of a step that jumps, as of a pose that was set anew, beyond so many steps as those around it
(messages may be late) and what tyres of friction 1 speed up by. A localisation corrects itself by less."""
_FRESH: Final = 1e-3
"""Metres and radians by which a driver's first message is off 0: nobody parks a robot as near to where it was."""
_LOST: Final = 3.0
"""Steps of time by so many of which two samples are apart where some between them are lost: clocks jitter by less."""


@dataclass(frozen=True)
class Motion:
    """What the robot did between two instants."""

    yaw_rad: float = 0.0
    """How far it turned, to the left positive; 0 where nobody knows."""
    distance_m: float = 0.0
    """How far the middle of its axle drove, forwards positive."""
    wheels_m: tuple[float, float] | None = None
    """How far the left and the right wheel rolled; None where that is not recorded."""


@dataclass(frozen=True, eq=False)
class Travelled:
    """How far the robot had come at each of some instants, since the record began. NaN where it does not tell."""

    distance_m: NDArray[np.float64]
    """(N,): of the middle of the axle, forwards positive."""
    yaw_rad: NDArray[np.float64] | None
    """(N,): turns, left positive, beyond pi too; None where wheels are recorded and their base is not known."""
    wheels_m: NDArray[np.float64] | None
    """(N, 2): of the left and the right wheel; None where they are not recorded."""
    outside: NDArray[np.bool_]
    """(N,): before the first or after the last sample."""
    in_gap: NDArray[np.bool_]
    """(N,): between two samples that are too far apart to be interpolated."""

    @property
    def known(self) -> NDArray[np.bool_]:
        """(N,): where there is an answer."""
        return ~(self.outside | self.in_gap)


@dataclass(frozen=True, eq=False)
class Odometry:
    """What wheels or a localisation have recorded, summed up from its first sample on. N is the number of samples."""

    times_s: NDArray[np.float64]
    """(N,): rising."""
    distance_m: NDArray[np.float64]
    """(N,): how far the middle of the axle had driven, forwards positive."""
    yaw_rad: NDArray[np.float64] | None
    """(N,): how far the robot had turned, left positive, beyond pi too; None where that is not known."""
    wheels_m: NDArray[np.float64] | None = None
    """(N, 2): how far the left and the right wheel had rolled; None where that is not recorded."""
    source: str = "odometry"
    """What messages call it."""
    notes: tuple[str, ...] = ()
    """Sentences about it that whoever uses it should know."""
    gap_max_s: float = GAP_MAX_S
    """Longest time between two samples that is interpolated, seconds."""

    def __post_init__(self) -> None:
        """Raises `InvalidInputError` for arrays that do not fit, values that are not finite, and times that fall."""
        refuse_unless(self.source, str, "source", "a text")
        object.__setattr__(self, "notes", texts_from(self.notes, "notes"))
        n = array_from(self.times_s, f"{self.source}: times_s").size
        for name, shape in (("times_s", (n,)), ("distance_m", (n,)), ("yaw_rad", (n,)), ("wheels_m", (n, 2))):
            if name not in ("yaw_rad", "wheels_m") or getattr(self, name) is not None:
                finite_array(self, name, shape)
        if n < 2 or (np.diff(self.times_s) <= 0.0).any():
            raise InvalidInputError(f"{self.source}: {counted(n, 'samples')}, expected two or more of rising times")
        _gap_from(self.gap_max_s)

    @classmethod
    def from_wheels(
        cls, times_s: ArrayLike, wheels_m: ArrayLike, *, wheel_base_m: float | None = None, source: str = "odometry",
        notes: tuple[str, ...] = (), gap_max_s: float = GAP_MAX_S,
    ) -> Odometry:  # fmt: skip
        """From how far both wheels (N, 2) had rolled. Without the distance between them turns are not known."""
        wheels = shaped_from(wheels_m, "wheels_m", None, 2)
        yaw = None
        if wheel_base_m is not None:
            if not 0.0 < number_from(wheel_base_m, "wheel_base_m") <= WHEEL_BASE_MAX_M:
                raise InvalidInputError(f"wheel_base_m = {wheel_base_m}, expected metres, at most {WHEEL_BASE_MAX_M:g}")
            with np.errstate(over="ignore", invalid="ignore"):
                yaw = (wheels[:, 1] - wheels[:, 0]) / wheel_base_m
        times = array_from(times_s, "times_s")
        notes = (*texts_from(notes, "notes"), *_begins_anew(times, wheels, gap_max_s, source))
        return cls(times, wheels.mean(axis=1), yaw, wheels, source, notes, gap_max_s)

    @classmethod
    def from_velocities(
        cls, times_s: ArrayLike, speed_mps: ArrayLike, yaw_rate_radps: ArrayLike, *, source: str = "odometry",
        notes: tuple[str, ...] = (), gap_max_s: float = GAP_MAX_S,
    ) -> Odometry:  # fmt: skip
        """From speeds (N,) at instants, between which they change evenly.

        Raises `InvalidInputError` where samples are too far apart: what was driven meanwhile is not known.
        """
        times, speeds, turns = _alike(source, times_s=times_s, speed_mps=speed_mps, yaw_rate_radps=yaw_rate_radps)
        steps = np.diff(times)
        if (steps > _gap_from(gap_max_s)).any():
            k = int(np.argmax(steps > gap_max_s))
            raise InvalidInputError(
                f"{source}: no velocities from {times[k]:.3f} to {times[k + 1]:.3f} s, expected gaps of at most "
                f"{gap_max_s:g} s"
            )

        def sums(rates: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.concatenate([[0.0], np.cumsum(0.5 * (rates[1:] + rates[:-1]) * steps)])

        return cls(times, sums(speeds), sums(turns), None, source, notes, gap_max_s)

    @classmethod
    def from_poses(
        cls, times_s: ArrayLike, x_m: ArrayLike, y_m: ArrayLike, yaw_rad: ArrayLike, *, source: str = "odometry",
        notes: tuple[str, ...] = (), gap_max_s: float = GAP_MAX_S,
    ) -> Odometry:  # fmt: skip
        """From poses (N,) each, which are joined by arcs; what is driven is that along the robot's heading.

        A note says so where poses move sideways, which no axle does.
        """
        times, x, y, yaw = _alike(source, times_s=times_s, x_m=x_m, y_m=y_m, yaw_rad=yaw_rad)
        anew = _begins_anew(times, np.stack([x, y, yaw], axis=1), gap_max_s, source)
        notes, yaw = (*texts_from(notes, "notes"), *anew), np.unwrap(yaw)
        turns = np.diff(yaw)
        middle = yaw[:-1] + 0.5 * turns
        chord = np.diff(x) * np.cos(middle) + np.diff(y) * np.sin(middle)
        # An arc of angle a is a / (2 sin(a / 2)) times as long as its chord.
        driven = np.concatenate([[0.0], np.cumsum(chord / np.sinc(0.5 * turns / np.pi))])
        aside = np.cumsum(np.diff(y) * np.cos(middle) - np.diff(x) * np.sin(middle))
        apart, way = float(np.ptp(aside)) if len(aside) else 0.0, float(np.abs(np.diff(driven)).sum())
        if apart > max(_ASIDE_M, _ASIDE_SHARE * way):
            told = f"{source}: poses move sideways by {apart:.2f} m beside {way:.2f} m ahead, which is left out"
            asked = "are they of the middle of the axle, and of a robot of two wheels?"
            notes = (*notes, f"{told}: {asked}")
        return cls(times, driven, yaw - yaw[:1], None, source, notes, gap_max_s)

    def at(self, times_s: ArrayLike) -> Travelled:
        """How far it had come at these times (M,); NaN outside the record and in its gaps, where nothing is made up.

        Raises `InvalidInputError` for what are no times.
        """
        times = np.atleast_1d(array_from(times_s, "times_s"))
        if times.ndim != 1:
            raise InvalidInputError(f"times_s: shape {times.shape}, expected (M,)")
        after = np.clip(np.searchsorted(self.times_s, times), 1, len(self.times_s) - 1)
        low, high = self.times_s[after - 1], self.times_s[after]
        outside = ~((times >= self.times_s[0] - SAME_S) & (times <= self.times_s[-1] + SAME_S))
        at_sample = np.minimum(np.abs(times - low), np.abs(times - high)) <= SAME_S
        in_gap = ~outside & ~at_sample & (high - low > self.gap_max_s)
        share = (np.clip(times, low, high) - low) / (high - low)
        share[outside | in_gap] = np.nan

        def between(values: NDArray[np.float64]) -> NDArray[np.float64]:
            part = share if values.ndim == 1 else share[:, None]
            found: NDArray[np.float64] = values[after - 1] + part * (values[after] - values[after - 1])
            return found

        return Travelled(
            between(self.distance_m),
            None if self.yaw_rad is None else between(self.yaw_rad),
            None if self.wheels_m is None else between(self.wheels_m),
            outside,
            in_gap,
        )

    def between(self, start_s: float, end_s: float) -> Motion | None:
        """What the robot did from one instant to another; None where the record does not tell of one of them."""
        before, motion = self.motions([start_s, end_s])
        return None if before is None else motion

    def motions(self, times_s: ArrayLike) -> list[Motion | None]:
        """What the robot did up to each of these times since the last one before it that the record tells of.

        The first of these did nothing; None for times that it does not tell of.
        """
        there = self.at(times_s)
        found: list[Motion | None] = []
        last: int | None = None
        for k, known in enumerate(there.known.tolist()):
            if not known:
                found.append(None)
                continue
            before = k if last is None else last
            yaw = 0.0 if there.yaw_rad is None else float(there.yaw_rad[k] - there.yaw_rad[before])
            wheels = None
            if there.wheels_m is not None:
                left, right = (there.wheels_m[k] - there.wheels_m[before]).tolist()
                wheels = (left, right)
            found.append(Motion(yaw, float(there.distance_m[k] - there.distance_m[before]), wheels))
            last = k
        return found

    def missing(self, times_s: ArrayLike, names: Sequence[str]) -> str | None:
        """A sentence about those of the times that the record does not tell of, by the frames' names; None: of all."""
        there = self.at(times_s)
        parts = []
        for flags, why in (
            (there.outside, "outside its span"),
            (there.in_gap, f"in gaps of over {self.gap_max_s:g} s by --odometry-gap"),
        ):
            places = np.flatnonzero(flags)
            if len(places):
                to = f" to {names[places[-1]]}" if len(places) > 1 else ""
                parts.append(f"{counted(len(places), 'frames')} {why} ({names[places[0]]}{to})")
        if not parts:
            return None
        span = f"from {self.times_s[0]:.3f} to {self.times_s[-1]:.3f} s"
        return f"{self.source}: {span}; {' and '.join(parts)}"

    def gaps(self, times_s: ArrayLike) -> str | None:
        """A sentence about its gaps between the first and the last of the times (M,), over which frames are joined all
        the same: its counters and poses go on behind them. None where there are none.
        """
        times = array_from(times_s, "times_s")
        first, last = np.min(times, initial=np.inf), np.max(times, initial=-np.inf)
        told = gaps_told(self.times_s[(self.times_s >= first) & (self.times_s <= last)], self.gap_max_s)
        return None if told is None else f"{self.source}: {told}; the way in each is taken for one arc"

    @property
    def jumps(self) -> str | None:
        """A sentence about steps that no robot makes, as of counters and poses that were set anew; None: none."""
        steps_s = np.diff(self.times_s)
        # Messages that are written down in bursts are nearer to each other than they were sent.
        steps_s = np.maximum(steps_s, np.median(steps_s))
        speeds = np.abs(np.diff(self.distance_m)) / steps_s
        rates = np.zeros(len(steps_s)) if self.yaw_rad is None else np.abs(np.diff(self.yaw_rad)) / steps_s
        odd = (speeds > _FASTEST_M_S) | (rates > _FASTEST_RAD_S) | _jumps(speeds, steps_s) | _jumps(rates, steps_s)
        places = np.flatnonzero(odd)
        if not len(places):
            return None
        first = int(places[0])
        return (
            f"{self.source}: {counted(len(places), 'steps')} that no robot makes, the first after "
            f"{self.times_s[first]:.3f} s by {speeds[first]:.3g} m/s and {rates[first]:.3g} rad/s: "
            "was it set anew, or is it in other units?"
        )


def _begins_anew(
    times_s: NDArray[np.float64], values: NDArray[np.float64], gap_max_s: float, source: str
) -> tuple[str, ...]:
    """A sentence where poses or counters (N, D) are what they were at first, or 0, behind a gap, in which no step is
    too long for a robot: their driver was started again. `Odometry.jumps` tells of those without a gap."""
    if times_s.shape != values.shape[:1]:
        return ()
    fresh = np.minimum(np.abs(values), np.abs(values - values[:1])).max(axis=1, initial=0.0) < _FRESH
    places = 1 + np.flatnonzero((np.diff(times_s) > _gap_from(gap_max_s)) & fresh[1:] & ~fresh[:-1])
    if not len(places):
        return ()
    told = f"{source}: begins anew behind {counted(len(places), 'gaps')}, the first at {times_s[places[0]]:.3f} s"
    return (f"{told}: what the robot did from before it until then is not known, and taken for a way back to there",)


def _jumps(speeds: NDArray[np.float64], steps_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(N,): whether a step of this speed and time is far longer than the two before and the two after it let expect."""
    around = np.median(np.lib.stride_tricks.sliding_window_view(np.pad(speeds, 2, mode="reflect"), 5), axis=1)
    most = _JUMP + (_JUMP_SHARE * around + _JUMP_PER_S2 * steps_s) * steps_s
    jumps: NDArray[np.bool_] = speeds * steps_s > most
    return jumps


def _gap_from(gap_max_s: float) -> float:
    gap_max_s = number_from(gap_max_s, "gap_max_s")
    if not gap_max_s > 0.0:
        raise InvalidInputError(f"gap_max_s = {gap_max_s}, expected more than 0")
    return gap_max_s


def refuse_set_back(times_s: NDArray[np.float64], source: str) -> None:
    """Raises `InvalidInputError` where times (N,) go back by more than messages overtake each other."""
    falls = np.flatnonzero(np.diff(times_s) < -GAP_MAX_S)
    if len(falls):
        before, after = times_s[falls[0] : falls[0] + 2]
        raise InvalidInputError(
            f"{source}: its clock goes back from {before:.3f} to {after:.3f} s, expected one that does not"
        )


def finite_array(of: Any, name: str, shape: tuple[int, ...]) -> None:
    """Makes a field of a frozen record an array of finite numbers of that shape. Raises `InvalidInputError`."""
    values = array_from(getattr(of, name), f"{of.source}: {name}")
    if values.shape != shape or not np.isfinite(values).all():
        raise InvalidInputError(f"{of.source}: {name} {values.shape}, expected {shape} of finite numbers")
    object.__setattr__(of, name, values)


def _alike(source: str, **columns: ArrayLike) -> tuple[NDArray[np.float64], ...]:
    """Columns (N,) of one length. Raises `InvalidInputError` for others: shorter ones would be spread over all."""
    arrays = tuple(array_from(values, f"{source}: {name}") for name, values in columns.items())
    for name, array in zip(columns, arrays, strict=True):
        if array.ndim != 1 or len(array) != arrays[0].size:
            raise InvalidInputError(f"{source}: {name} {array.shape}, expected ({arrays[0].size},)")
    return arrays


def gaps_told(times_s: NDArray[np.float64], most_s: float) -> str | None:
    """A sentence about the gaps in rising times (N,), longer than `most_s` and than steps of time are; None: none."""
    steps = np.diff(times_s)
    gaps = steps[steps > max(most_s, _LOST * float(np.median(steps)))] if len(steps) else steps
    if not len(gaps):
        return None
    longest, begins = float(gaps.max()), float(times_s[int(np.argmax(steps))])
    return f"{counted(len(gaps), 'gaps')} of over {most_s:g} s, the longest of {longest:.3f} s from {begins:.3f} s on"
