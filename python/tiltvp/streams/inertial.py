"""What an inertial sensor has measured over time, and what that tells of a camera from frame to frame."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from tiltvp.arguments import array_from, number_from, refuse_unless, texts_from
from tiltvp.csv_files import CsvFile
from tiltvp.errors import InvalidInputError, counted
from tiltvp.rotations import rotation_from
from tiltvp.streams.odometry import finite_array, gaps_told

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["INERTIAL_COLUMNS", "InertialSamples"]

_RATES: Final = tuple(f"rate_{axis}_radps" for axis in "xyz")
_FORCES: Final = tuple(f"acceleration_{axis}_mps2" for axis in "xyz")
INERTIAL_COLUMNS: Final = ("time_s", *_RATES, *_FORCES)
"""The columns of a table of readings that has all of them."""
_NOISE_RAD_S: Final = float(np.radians(0.005))
"""Noise density of rates, rad/s per square root of Hz: of an MPU-6050, as `StereoSequence.imu` has it."""
_BIAS_RAD_S: Final = float(np.radians(0.2))
"""Standard deviation of the bias of rates, alike."""
_SCALE: Final = 0.01
"""Standard deviation of scale and axes of rates together, as a share of the turn: 0.5 % each, and mountings by hand."""
GRAVITY_M_S2: Final = 9.81
_FASTEST_RAD_S: Final = 70.0
"""What the widest ranges of such sensors reach, 4000 degrees a second."""
_LEVEL_RAD: Final = float(np.radians(0.5))
"""Standard deviation of down by a sensor at rest: a bias of 5 mg is 0.3 degrees, and as much of the mounting."""
_STEADY_RAD: Final = float(np.radians(5.0))
"""Down with a larger standard deviation is not told: the sensor moves."""
_MEAN_S: Final = 4.0
"""How long before and after a frame accelerations are averaged. Where a sensor stays about its place their mean is as
small as the time is long: of a hand that sways in 15 s down is off by 3.5 degrees rms with 0.5 s, by 0.8 with 4."""
_SWAY_S: Final = 1.6
"""The mean of a sway is its acceleration times this, over the time of the mean. With it the errors of simulated hands
that sway in 15 and 40 s are, with means of 0.7 to 8 s, at most 3.1 standard deviations."""
_NODES_MAX: Final = 400
"""Samples of a mean, neighbours averaged where there are more, which bounds the time: 20 ms apart, a tenth of a
tremor's period."""
_GAP_S: Final = 0.1
"""The longest time between two samples, or a sample and a frame, over which turns and down are told: at 2 rad/s the
sensor turns by 0.2 rad unseen."""


@dataclass(frozen=True, eq=False)
class InertialSamples:
    """Samples of an inertial sensor in its own axes. N is their number."""

    times_s: NDArray[np.float64]
    """(N,): rising."""
    rates_rad_s: NDArray[np.float64]
    """(N, 3): of rotation."""
    accelerations_m_s2: NDArray[np.float64] | None
    """(N, 3): what a body at rest feels upwards is positive (specific force, as ROS has it); None of rates alone."""
    orientations: NDArray[np.float64] | None = None
    """(N, 4): quaternions x y z w that take the sensor's axes to the world's; None where the sensor tells none."""
    frame: str = ""
    """The frame of the sensor, by the name that the recording has for it."""
    source: str = "inertial sensor"
    """What messages call it."""
    notes: tuple[str, ...] = ()
    """Sentences about it that whoever uses it should know."""

    def __post_init__(self) -> None:
        """Raises `InvalidInputError` for arrays that do not fit, values that are not finite, and times that fall."""
        for name in ("frame", "source"):
            refuse_unless(getattr(self, name), str, name, "a text")
        object.__setattr__(self, "notes", texts_from(self.notes, "notes"))
        n = array_from(self.times_s, f"{self.source}: times_s").size
        for name, shape in (
            ("times_s", (n,)),
            ("rates_rad_s", (n, 3)),
            ("accelerations_m_s2", (n, 3)),
            ("orientations", (n, 4)),
        ):
            if name in ("times_s", "rates_rad_s") or getattr(self, name) is not None:
                finite_array(self, name, shape)
        if n < 2 or (np.diff(self.times_s) <= 0.0).any():
            raise InvalidInputError(f"{self.source}: {counted(n, 'samples')}, expected two or more of rising times")
        fastest = float(np.abs(self.rates_rad_s).max())
        told = f"{self.source}: turns of up to {fastest:.3g} rad/s, which no such sensor tells: are they in degrees?"
        if fastest > _FASTEST_RAD_S and told not in self.notes:
            object.__setattr__(self, "notes", (*self.notes, told))

    @property
    def gaps(self) -> str | None:
        """A sentence about times without samples, over which nothing is told; None where there are none."""
        return gaps_told(self.times_s, _GAP_S)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Self:
        """Reads a CSV file with columns time_s, rate_x_radps, rate_y_radps, rate_z_radps, and alike
        acceleration_x_mps2 where there are any.

        Raises `InvalidInputError` that names file and line.
        """
        table = CsvFile.asked(path, "readings of an inertial sensor as CSV")
        wanted = ("time_s", *_RATES)
        has_forces = any(name in table.header for name in _FORCES)
        wanted += _FORCES if has_forces else ()
        missing = [name for name in wanted if name not in table.header]
        if missing:
            raise InvalidInputError(f"{table.name}: no column {missing[0]}, expected {', '.join(wanted)}")
        places = [table.header.index(name) for name in wanted]
        numbers, before = [], -np.inf
        for line, row in table.rows():
            values = [table.number(line, name, row[place]) for name, place in zip(wanted, places, strict=True)]
            if values[0] <= before:
                raise InvalidInputError(f"{table.where(line)}: time_s = {values[0]}, expected one after {before}")
            before = values[0]
            numbers.append(values)
        if len(numbers) < 2:
            raise InvalidInputError(f"{table.name}: {counted(len(numbers), 'rows')}, expected two or more")
        columns = np.array(numbers, dtype=np.float64)
        forces = columns[:, 4:7] if has_forces else None
        return cls(columns[:, 0], columns[:, 1:4], forces, source=table.name)

    def known(
        self, before_s: float | None, now_s: float, camera_from_sensor: NDArray[np.float64] | None = None
    ) -> dict[str, Any]:
        """What is known of a frame: the keywords `gravity` and `gyro` of `CornerPoseEstimator`.

        `before_s` is the time of the frame before, None where there is none. `camera_from_sensor` (3, 3) takes vectors
        of the sensor's axes to the camera's; None where these are the same. `gyro` is the product of the rotations by
        the rates, each held half-way to its neighbours, with the covariance of noise, bias and scale; None where
        samples do not cover the time. `gravity` is the mean acceleration within 4 s, carried to the
        frame by the rates; its standard deviation has the sensors' biases, the scatter of accelerations over the time
        that there is, and how far their mean's length is from gravity's. It holds for a sensor that stays about its
        place. None where that is above 5 degrees, as of a sensor that is moved, and
        where no sample is near the frame: those beyond a gap of 0.1 s tell nothing of it.

        Raises `InvalidInputError` for what is no number, `CalibrationError` for what is no rotation.
        """
        turn = np.eye(3)
        if camera_from_sensor is not None:
            turn = rotation_from(array_from(camera_from_sensor, "camera_from_sensor").tolist(), "camera_from_sensor")
        now_s = number_from(now_s, "now_s")
        before_s = None if before_s is None else number_from(before_s, "before_s")
        gyro = None if before_s is None else self._turned(before_s, now_s, turn)
        return {"gravity": self._down(now_s, turn), "gyro": gyro}

    def _about(self, first_s: float, last_s: float) -> slice:
        """The samples between two times and those beside them: looking through all for each frame takes the square of
        a drive's length."""
        first, last = np.searchsorted(self.times_s, [first_s, last_s]).tolist()
        return slice(max(first - 1, 0), last + 1)

    def _turned(
        self, before_s: float, now_s: float, camera_from_sensor: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        import cv2

        covered = self.times_s[0] - _GAP_S <= before_s and now_s <= self.times_s[-1] + _GAP_S
        # Frames nearer to each other than samples are covered by those about them.
        about = self._about(before_s, now_s)
        times_s = self.times_s[about]
        if not covered or now_s <= before_s or (len(times_s) > 1 and float(np.diff(times_s).max()) > _GAP_S):
            return None
        nodes = np.concatenate([[before_s], times_s[(times_s > before_s) & (times_s < now_s)], [now_s]])
        rates = np.column_stack([np.interp(nodes, times_s, rate) for rate in self.rates_rad_s[about].T])
        steps_s = np.diff(nodes)
        before_from_now = np.eye(3)
        for vector in 0.5 * (rates[1:] + rates[:-1]) @ camera_from_sensor.T * steps_s[:, None]:
            before_from_now = before_from_now @ cv2.Rodrigues(vector)[0]
        time_s = now_s - before_s
        angle = float(np.linalg.norm(cv2.Rodrigues(before_from_now)[0]))
        variance = _NOISE_RAD_S**2 * time_s + (_BIAS_RAD_S * time_s) ** 2 + (_SCALE * angle) ** 2
        return before_from_now, np.eye(3) * variance

    def _down(self, now_s: float, camera_from_sensor: NDArray[np.float64]) -> tuple[NDArray[np.float64], float] | None:
        import cv2

        if self.accelerations_m_s2 is None:
            return None
        about = self._about(now_s - _MEAN_S, now_s + _MEAN_S)
        times_s = self.times_s[about]
        nearest = int(np.argmin(np.abs(times_s - now_s)))
        # Turns are known since the last gap and up to the next one.
        unbroken = np.cumsum(np.diff(times_s, prepend=times_s[:1]) > _GAP_S)
        near = np.flatnonzero((np.abs(times_s - now_s) <= _MEAN_S) & (unbroken == unbroken[nearest]))
        if len(near) < 2 or abs(times_s[nearest] - now_s) > _GAP_S:
            return None
        times_s, rates, forces = (
            _thinned(values[about][near]) for values in (self.times_s, self.rates_rad_s, self.accelerations_m_s2)
        )
        turns = [np.eye(3)]
        for vector in 0.5 * (rates[1:] + rates[:-1]) * np.diff(times_s)[:, None]:
            turns.append(turns[-1] @ cv2.Rodrigues(vector)[0])
        nearest = int(np.argmin(np.abs(times_s - now_s)))
        now = turns[nearest] @ cv2.Rodrigues(rates[nearest] * (now_s - times_s[nearest]))[0]
        # All in the axes at the frame.
        forces = np.einsum("ji,njk,nk->ni", now, np.stack(turns), forces)
        mean = forces.mean(axis=0)
        length = float(np.linalg.norm(mean))
        scatter = float(np.sqrt(((forces - mean) ** 2).sum(axis=1).mean() / 3.0)) / GRAVITY_M_S2
        # Of two directions across.
        sway_rad = np.sqrt(2.0) * scatter * _SWAY_S / float(times_s[-1] - times_s[0])
        drift_rad = _BIAS_RAD_S * float(np.mean(times_s) - now_s)
        sigma_rad = float(np.sqrt(_LEVEL_RAD**2 + sway_rad**2 + drift_rad**2 + (length / GRAVITY_M_S2 - 1.0) ** 2))
        if sigma_rad > _STEADY_RAD:
            return None
        return -(camera_from_sensor @ mean) / length, sigma_rad


def _thinned(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """At most `_NODES_MAX` of them, (K,) or (K, 3): means of neighbours."""
    together = -(-len(values) // _NODES_MAX)
    firsts = np.arange(0, len(values), together)
    counts = np.diff(firsts, append=len(values))
    thinned: NDArray[np.float64] = (np.add.reduceat(values, firsts).T / counts).T
    return thinned
