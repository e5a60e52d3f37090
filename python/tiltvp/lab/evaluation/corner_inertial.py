"""Corners and an inertial sensor: what estimators that are told its readings, and complementary filters, make of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import polars as pl

from tiltvp._core import ComplementaryFilter
from tiltvp.corner_images import CornerPoseEstimator
from tiltvp.errors import InvalidInputError, MissingExtraError
from tiltvp.lab.datasets.ahead import FORWARD
from tiltvp.streams import InertialSamples

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.synth import ImuLog, StereoSequence

__all__ = [
    "CONVENTIONAL",
    "IMAGE",
    "InertialLooks",
    "compare_inertial",
    "conventional_angles",
    "filter_attitudes",
    "summarise_inertial_comparison",
]

CONVENTIONAL: Final = ("complementary", "Mahony")
"""The complementary filter of angles, and the explicit one on rotations, as the `ahrs` package has them."""

IMAGE: Final = "image"
"""The attitudes that the complementary filter has as its reference: of the pair, each without the sensor."""

_TOLD: Final = ", told down and turns"
_GRAY: Final = "image, one grey camera"

_TIME_CONSTANTS_S: Final = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
"""What the conventional filters are tried with; the best one of each is compared."""

_INTEGRAL_SHARE: Final = 0.05
"""Integral gain of the explicit complementary filter, in shares of its proportional one."""

# `FORWARD` is from a camera to the board that holds it, and alike from an object's frame, y downwards, to one with z
# upwards.
_WALLS: Final = np.array(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)))
"""From such a frame along a room's walls to the world's."""

_OVER: Final = np.diag((1.0, -1.0, -1.0))
"""From a corner whose upright edge goes up to the names of one whose edge goes down."""


class InertialLooks:
    """What estimators make of a sequence of the coloured cuboid that are told down and turns frame by frame
    (`InertialSamples.known`), and of the left images alone by straight edges, told so and not.
    """

    def __init__(self, sequence: StereoSequence, *, seed: int, **known: Any) -> None:
        """`seed` is the sensor's; `known` are options of `CornerPoseEstimator`."""
        left, right = sequence.cameras
        imu = sequence.imu(seed=seed)
        self._samples = InertialSamples(imu.times_s, imu.rates_rad_s, imu.forces_m_s2)
        self._times_s = sequence.times_s.tolist()
        pair = CornerPoseEstimator(left, right, sequence.left_from_right, method="coloured", **known)
        self._estimators = {IMAGE + _TOLD: pair} | {
            name: CornerPoseEstimator(left, method="general", **known) for name in (_GRAY, _GRAY + _TOLD)
        }
        self.attitudes: dict[str, list[NDArray[np.float64] | None]] = {name: [] for name in self._estimators}
        """`camera_from_object` of each frame so far, by method."""

    def look(self, frame: int, pair: tuple[NDArray[np.uint8], NDArray[np.uint8]]) -> None:
        """The next frame."""
        known = self._samples.known(self._times_s[frame - 1] if frame else None, self._times_s[frame])
        for name, estimator in self._estimators.items():
            images = pair[:1] if name.startswith(_GRAY) else pair
            pose = estimator(*images, **(known if name.endswith(_TOLD) else {})).pose
            self.attitudes[name].append(None if pose is None else pose.camera_from_object)


def compare_inertial(
    sequence: StereoSequence, attitudes: Mapping[str, Sequence[NDArray[np.float64] | None]], *, seed: int = 0
) -> pl.DataFrame:
    """Errors of roll, pitch and yaw in degrees, with columns `method` and `time_s`.

    `attitudes` are the estimates `camera_from_object` of each frame, or None, by method, among them `IMAGE`. Methods:
    these, at the frames; `ComplementaryFilter` with `IMAGE` as its reference, and `CONVENTIONAL`, filters of
    accelerometer and gyroscope, at the readings of a simulated sensor (`StereoSequence.imu` of that seed). The latter
    know no yaw; each has the time constant that suits the truth best. The level edges of a corner without colours have
    no names, so that the yaw of one grey camera is up to quarter turns, its upright edge goes down or up, and its
    corner is the cuboid's or one along the walls: of both the nearer counts. Angles are those of the board that holds
    the cameras, x forward and z up (ROS REP 103). Raises `MissingExtraError` where the package is missing,
    `InvalidInputError` where no frame has an attitude of `IMAGE`.
    """
    imu = sequence.imu(seed=seed)
    corner = sequence.corners[sequence.corner]
    truth = _board_angles(_level(sequence.poses_at(imu.times_s), corner.world_from_object))
    by_time = {
        method: {float(t): a for t, a in zip(sequence.times_s, seen, strict=True) if a is not None}
        for method, seen in attitudes.items()
    }
    if not by_time.get(IMAGE):
        raise InvalidInputError("attitudes: none in any frame, expected some")
    tables = []
    for method, seen in by_time.items():
        if seen:
            frames = np.array(list(seen))
            objects = np.stack(list(seen.values()))
            poses = sequence.poses_at(frames)
            if method.startswith(_GRAY):
                goes_up = np.einsum("nj,nj->n", objects[:, :, 1], poses[:, 2, :3]) > 0.0
                objects[goes_up] = objects[goes_up] @ _OVER
            images = np.einsum("ij,nkj,lk->nil", FORWARD, objects, FORWARD)
            at_frames = _board_angles(_level(poses, corner.world_from_object))
            walls = _board_angles(_level(poses, _WALLS))[:, 2] if method.startswith(_GRAY) else None
            tables.append(_errors(method, frames, _board_angles(images), at_frames, walls))
    fused = filter_attitudes(imu, by_time[IMAGE])
    known = np.isfinite(fused).all(axis=(1, 2))
    level = np.einsum("ij,njk,lk->nil", FORWARD, fused[known], FORWARD)
    tables.append(_errors("gyroscope + image", imu.times_s[known], _board_angles(level), truth[known]))
    for method in CONVENTIONAL:
        every = [conventional_angles(imu, method, tau)[known] for tau in _TIME_CONSTANTS_S]
        best = min(every, key=lambda angles: float(np.sum(_wrapped(angles - truth[known])[:, :2] ** 2)))
        tables.append(_errors(f"gyroscope + accelerometer, {method}", imu.times_s[known], best, truth[known]))
    return pl.concat(tables)


def summarise_inertial_comparison(table: pl.DataFrame) -> pl.DataFrame:
    """Root mean square and greatest errors in degrees, by method."""
    angles = ("roll", "pitch", "yaw")
    return table.group_by("method", maintain_order=True).agg(
        pl.len().alias("readings"),
        *((pl.col(name) ** 2).mean().sqrt().alias(f"{name} rms") for name in angles),
        *(pl.col(name).abs().max().alias(f"{name} max") for name in angles),
    )


def filter_attitudes(imu: ImuLog, seen: dict[float, NDArray[np.float64]]) -> NDArray[np.float64]:
    """(M, 3, 3): `object_from_camera` at each reading, NaN before the first of the attitudes `seen`.

    `seen` has `camera_from_object` by time in seconds; an attitude is used at the first reading that is not before it.
    """
    out = np.full((len(imu.times_s), 3, 3), np.nan)
    waiting = sorted(seen.items())
    fusion: ComplementaryFilter | None = None
    before = float(imu.times_s[0])
    for k, time in enumerate(imu.times_s.tolist()):
        rate = 0.5 * (imu.rates_rad_s[max(k - 1, 0)] + imu.rates_rad_s[k])
        while waiting and waiting[0][0] <= time + 1e-9:
            moment, attitude = waiting.pop(0)
            if fusion is None:
                fusion = ComplementaryFilter(attitude.T)
            else:
                fusion.predict(rate, max(moment - before, 0.0))
                fusion.correct(attitude.T)
            before = max(moment, before)
        if fusion is not None:
            fusion.predict(rate, max(time - before, 0.0))
            out[k] = fusion.reference_from_body
        before = time
    return out


def conventional_angles(imu: ImuLog, method: str, time_constant_s: float) -> NDArray[np.float64]:
    """(M, 3): roll, pitch and yaw (NaN) in radians, from one of the filters `CONVENTIONAL` of the `ahrs` package."""
    try:
        from ahrs.filters import Complementary, Mahony  # type: ignore[import-untyped]
    except ImportError as error:
        raise MissingExtraError.of("a conventional filter", "imu", error) from error

    step_s = float(np.median(np.diff(imu.times_s)))
    rates, forces = imu.rates_rad_s @ FORWARD.T, imu.forces_m_s2 @ FORWARD.T
    if method == "complementary":
        gain = time_constant_s / (time_constant_s + step_s)
        angles = np.array(Complementary(gyr=rates, acc=forces, frequency=1.0 / step_s, gain=gain).W, dtype=np.float64)
    else:
        gain = 1.0 / time_constant_s
        filtered = Mahony(gyr=rates, acc=forces, frequency=1.0 / step_s, k_P=gain, k_I=_INTEGRAL_SHARE * gain)
        w, x, y, z = np.asarray(filtered.Q, dtype=np.float64).T
        roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
        angles = np.column_stack([roll, np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0)), roll])
    angles[:, 2] = np.nan
    return angles


def _level(poses: NDArray[np.float64], world_from_object: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3, 3): rotations of the board in the levelled object frame, from `world_from_left`."""
    camera = np.einsum("ji,njk->nik", world_from_object, poses[:, :3, :3])
    level: NDArray[np.float64] = np.einsum("ij,njk,lk->nil", FORWARD, camera, FORWARD)
    return level


def _board_angles(rotations: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3): roll, pitch, yaw of Rz(yaw) Ry(pitch) Rx(roll), radians."""
    r = rotations
    roll = np.arctan2(r[:, 2, 1], r[:, 2, 2])
    pitch = np.arctan2(-r[:, 2, 0], np.hypot(r[:, 2, 1], r[:, 2, 2]))
    return np.column_stack([roll, pitch, np.arctan2(r[:, 1, 0], r[:, 0, 0])])


def _wrapped(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    wrapped: NDArray[np.float64] = (angles + np.pi) % (2.0 * np.pi) - np.pi
    return wrapped


def _errors(
    method: str,
    times: NDArray[np.float64],
    angles: NDArray[np.float64],
    truth: NDArray[np.float64],
    walls_yaw: NDArray[np.float64] | None = None,
) -> pl.DataFrame:
    errors = np.degrees(_wrapped(angles - truth))
    if walls_yaw is not None:
        yaws = np.stack([errors[:, 2], np.degrees(angles[:, 2] - walls_yaw)], axis=1)
        yaws = (yaws + 45.0) % 90.0 - 45.0
        errors[:, 2] = np.take_along_axis(yaws, np.abs(yaws).argmin(axis=1)[:, None], axis=1)[:, 0]
    columns: dict[str, Any] = {"method": [method] * len(times), "time_s": times}
    columns |= {name: errors[:, k] for k, name in enumerate(("roll", "pitch", "yaw"))}
    return pl.DataFrame(columns).with_columns(pl.col("roll", "pitch", "yaw").fill_nan(None))
