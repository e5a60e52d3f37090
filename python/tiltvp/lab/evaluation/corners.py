"""How well corners are found in rendered sequences of a hand-held stereo pair (section IV of Liu et al. 2018)."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass
from threading import Event
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import polars as pl

from tiltvp.corner_images import CornerEstimate, CornerPoseEstimator
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.new import in_order
from tiltvp.lab.evaluation.corner_inertial import IMAGE, InertialLooks, compare_inertial
from tiltvp.lab.evaluation.corner_markers import MarkerLooks, MarkerPose
from tiltvp.lab.evaluation.corner_rooms import (
    attitude_near,
    lengths_off,
    own_places,
    rotation_vector,
    surface_off,
    truth_near,
)
from tiltvp.lab.evaluation.corner_scenes import CORNER_SCENES, CornerScene, down_in

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.synth import StereoSequence

    Pair = tuple[NDArray[np.uint8], NDArray[np.uint8]]

__all__ = ["CornerExperiment", "measure_corners", "summarise_corners", "summarise_rooms"]

_FLIP_DEG: Final = 20.0
"""An attitude that is farther off is another interpretation, not a noisy one."""

_NEES_MAX: Final = 22.5
_NEES_MAX_ATTITUDE: Final = 16.3
"""The 99.9 % quantiles of chi-square of 6, and of 3 for attitudes alone: what has a larger NEES is wrong and sure."""

_OFF_SIGMAS: Final = 3.3
"""That of a normal deviate: a vertex farther from every surface is wrong and sure, listed or not."""

_FOUND_IN: Final = 0.95
"""The share of a room's frames with a pose above which its corners count as found."""

_ONE_CAMERA: Final = "coloured, one camera, height known"
"""The left camera alone, each frame for itself, with its height above the vertex as somebody measures it."""

_ONE_EDGE: Final = "coloured, one camera, edge y known"
_ONE_BOX: Final = "coloured, one camera, size known"
"""The same with the length of the upright edge, and with all three sizes, as somebody measures them."""

_ONE_GREY: Final = "general, one camera"
"""The left camera alone in rooms, each frame for itself: attitudes."""

_LENGTH_SIGMA_M: Final = 0.001
"""Of a length: of a folding rule laid along an edge."""

_HEIGHT_SIGMA_M: Final = 0.005
"""Of that height: of a folding rule held upright from the lens to the floor."""

_SCHEMA: Final[dict[str, Any]] = (
    {
        "scene": pl.String,
        "method": pl.String,
        "frame": pl.UInt32,
        "time_s": pl.Float64,
        "distance_m": pl.Float64,
        "found": pl.Boolean,
    }
    | {"corner": pl.Int64}
    | dict.fromkeys(("attitude_deg", "roll_deg", "pitch_deg", "yaw_deg"), pl.Float64)
    | dict.fromkeys(("position_m", "x_m", "y_m", "z_m", "probability", "nees", "surface", "ms"), pl.Float64)
    | dict.fromkeys(("hypotheses", "lengths", "lengths_off"), pl.UInt32)
    | {"reason": pl.String}
)


@dataclass(frozen=True)
class CornerExperiment:
    """`frames` of the first scene, and their shares of the others; equal experiments give equal tables, times aside."""

    frames: int = 1000
    scenes: tuple[CornerScene, ...] = CORNER_SCENES
    seed: int = 7001
    """Of scene, motion and noise; one more for each further scene."""

    def __post_init__(self) -> None:
        if self.frames < 10:
            raise InvalidInputError(f"frames = {self.frames}, expected 10 or more")

    def lengths(self) -> list[int]:
        """Frames of each scene."""
        return [max(10, round(self.frames * scene.share)) for scene in self.scenes]


def measure_corners(
    experiment: CornerExperiment, *, threads: int = 1, advance: Callable[[], None] = lambda: None
) -> tuple[pl.DataFrame, pl.DataFrame]:
    """One row for each frame and method, and the comparison of `compare_inertial` on the first scene with a cuboid.

    Angles are components of the error's rotation vector in the left camera: pitch about x, yaw about y, roll about z.
    x_m, y_m, z_m are errors of the left camera's place in the corner's frame. `nees` is the squared error of attitude
    and vertex by its covariance, 6 on average at best. In rooms the truth is that of the listed corner near the
    estimate, in whichever of eight ways its axes are named. Where none is near, as the list has none of what
    leans or runs into something else, `corner` is -1, the attitude is compared with that of the
    walls and of corners beside it, and the place, without `nees`, with the object's own median in the world. `surface`
    is how far the vertex is from what is seen there (`surface_off`); `lengths` are those of edges that all corners of a
    room tell, `lengths_off` those that are wrong (`lengths_off`). Poses by markers have neither. `ms` is the
    processor time of one pair. `advance` is called after each frame.
    """
    rows: list[dict[str, Any]] = []
    inertial: list[pl.DataFrame] = []
    for k, (scene, frames) in enumerate(zip(experiment.scenes, experiment.lengths(), strict=True)):
        sequence = scene.sequence(frames, experiment.seed + k, threads)
        seen: dict[str, list[tuple[CornerEstimate, float]]] = {}
        told, markers = None, None
        if scene.marker_m:
            markers = MarkerLooks(sequence, scene.marker_m)
        if scene.kind == "laboratory" and not inertial:
            told = InertialLooks(sequence, seed=experiment.seed, **scene.angle, **scene.known)
        for looks in _estimates(scene, sequence, threads, told, markers):
            for method, look in looks.items():
                seen.setdefault(method, []).append(look)
            advance()
        for method, looked in seen.items():
            estimates = [estimate for estimate, _ in looked]
            places = own_places(sequence, estimates)
            for frame, (estimate, ms) in enumerate(looked):
                judged = _judged(scene, sequence, frame, estimate, places)
                rows.append({"scene": scene.name, "method": method, "ms": ms} | judged)
        for method, poses in ({} if markers is None else markers.poses).items():
            for frame, (marker, ms) in enumerate(poses):
                rows.append({"scene": scene.name, "method": method, "ms": ms} | _by_markers(sequence, frame, marker))
        attitudes = [None if one.pose is None else one.pose.camera_from_object for one, _ in seen[scene.methods[0]]]
        if told is not None and any(a is not None for a in attitudes):
            inertial.append(compare_inertial(sequence, {IMAGE: attitudes} | told.attitudes, seed=experiment.seed))
    return pl.DataFrame(rows, schema=_SCHEMA), pl.concat(inertial) if inertial else pl.DataFrame()


def summarise_corners(table: pl.DataFrame) -> pl.DataFrame:
    """Found rate, root mean square errors and flips of each scene and method that tells places.

    Places are those of listed corners: others are beside their own median, which tells how steady they are.
    """
    table = table.filter(pl.col("method") != _ONE_GREY)
    attitude, position = pl.col("attitude_deg"), pl.col("position_m").filter(pl.col("corner") >= 0)
    shares = (pl.col("position_m") / pl.col("distance_m")).filter(pl.col("corner") >= 0)
    return table.group_by("scene", "method", maintain_order=True).agg(
        pl.len().alias("frames"),
        pl.col("found").mean().alias("found"),
        pl.col("corner").filter(pl.col("found")).ge(0).mean().alias("listed corner"),
        (attitude**2).mean().sqrt().alias("attitude rms deg"),
        attitude.quantile(0.99).alias("99 % deg"),
        (position**2).mean().sqrt().mul(1000).alias("position rms mm"),
        position.quantile(0.99).mul(1000).alias("99 % mm"),
        (attitude > _FLIP_DEG).sum().alias("flips"),
        pl.col("nees").mean().alias("NEES of 6"),
        pl.col("nees").gt(_NEES_MAX).mean().mul(100).alias("% NEES > 22.5"),
        pl.col("surface").gt(_OFF_SIGMAS).mean().mul(100).alias("% off surface"),
        (shares**2).mean().sqrt().mul(100).alias("% of distance"),
        pl.col("distance_m").min().alias("from m"),
        pl.col("distance_m").max().alias("to m"),
        pl.col("ms").median().alias("ms"),
    )


def summarise_rooms(table: pl.DataFrame, rooms: Sequence[CornerScene]) -> pl.DataFrame:
    """How many rooms of each kind, and of all, have a pose in nearly all frames, and what those poses are worth.

    One camera's attitudes have rows of their own, compared with the nearest of any listed corner. NEES is of frames
    with a listed truth. Medians and the largest but a twentieth are of frames with a pose: of attitudes, and of places
    of listed corners, those of other corners being beside their own median alone.
    """
    kinds = {room.name: room.kind for room in rooms}
    table = table.filter(pl.col("scene").is_in(list(kinds)))
    alone = pl.col("method") == _ONE_GREY
    camera = pl.when(alone).then(pl.lit(", one camera")).otherwise(pl.lit(""))
    table = table.with_columns(sure=pl.col("nees") > pl.when(alone).then(_NEES_MAX_ATTITUDE).otherwise(_NEES_MAX))
    by_kind = table.with_columns(kind=pl.col("scene").replace_strict(kinds) + camera)
    place_mm = pl.col("position_m").filter(pl.col("corner") >= 0).mul(1000)
    return (
        pl.concat([by_kind, table.with_columns(kind=pl.lit("all") + camera)])
        .with_columns(good=pl.col("found").mean().over("kind", "scene") >= _FOUND_IN)
        .group_by("kind", maintain_order=True)
        .agg(
            pl.col("scene").n_unique().alias("rooms"),
            pl.col("scene").filter("good").n_unique().alias(f"rooms with >= {_FOUND_IN:.0%} found"),
            pl.len().alias("frames"),
            pl.col("found").mean().mul(100).alias("% found"),
            pl.col("nees").count().alias("listed"),
            pl.col("sure").mean().mul(100).alias("% NEES > 99.9 %"),
            pl.col("surface").gt(_OFF_SIGMAS).mean().mul(100).alias("% off surface"),
            (pl.col("attitude_deg") > _FLIP_DEG).sum().alias("flips"),
            pl.col("attitude_deg").median().alias("median deg"),
            pl.col("attitude_deg").quantile(0.95).alias("95 % deg"),
            place_mm.median().alias("listed median mm"),
            place_mm.quantile(0.95).alias("listed 95 % mm"),
            pl.col("lengths").sum(),
            (pl.col("lengths_off").sum() / pl.col("lengths").sum()).fill_nan(None).mul(100).alias("% lengths off"),
        )
    )


def _estimates(
    scene: CornerScene,
    sequence: StereoSequence,
    threads: int,
    told: InertialLooks | None,
    markers: MarkerLooks | None,
) -> Iterator[dict[str, tuple[CornerEstimate, float]]]:
    """What each method says of each frame in turn, and the processor time it took, milliseconds; `told` and `markers`
    look too.
    """
    angle = scene.angle
    known = angle | scene.known
    if scene.kind != "laboratory":
        known["down"] = down_in(sequence)
    left, right = sequence.cameras
    estimators = {
        method: CornerPoseEstimator(
            left, right, sequence.left_from_right, method=method, **(angle if method == "paper" else known)
        )
        for method in scene.methods
    }
    stop, heights = Event(), np.random.default_rng(sequence.seed)

    def render(frame: int) -> Pair:
        if stop.is_set():
            raise CancelledError
        return sequence.render(frame, threads=1)

    with in_order(render, range(len(sequence)), threads, stop) as pairs:
        for frame, pair in enumerate(pairs):
            looks = {method: _timed(estimator, *pair) for method, estimator in estimators.items()}
            if scene.kind == "laboratory":
                for method, scale in _scales(sequence, frame, heights):
                    looks[method] = _timed(CornerPoseEstimator(left, method="coloured", **known, **scale), pair[0])
            else:
                looks[_ONE_GREY] = _timed(CornerPoseEstimator(left, method="general", **known), pair[0])
            if told is not None:
                told.look(frame, pair)
            if markers is not None:
                markers.look(pair)
            yield looks


def _scales(sequence: StereoSequence, frame: int, heights: np.random.Generator) -> Iterator[tuple[str, dict[str, Any]]]:
    """What one camera may know beside the image, each as it is measured once."""
    object_from_left = np.linalg.inv(sequence.left_from_object(frame))
    height_m = abs(float(object_from_left[1, 3])) + heights.normal(0.0, _HEIGHT_SIGMA_M)
    yield _ONE_CAMERA, {"camera_height_m": height_m, "camera_height_sigma_m": _HEIGHT_SIGMA_M}
    size_m = np.asarray(sequence.corners[sequence.corner].lengths_m)
    size_m = size_m + np.random.default_rng((sequence.seed, frame)).normal(0.0, _LENGTH_SIGMA_M, 3)
    yield _ONE_EDGE, {"edge_length_m": float(size_m[1]), "length_sigma_m": _LENGTH_SIGMA_M}
    yield _ONE_BOX, {"box_size_m": size_m, "length_sigma_m": _LENGTH_SIGMA_M}


def _timed(estimator: CornerPoseEstimator, *images: NDArray[np.uint8]) -> tuple[CornerEstimate, float]:
    """The estimate, and the processor time it took, milliseconds."""
    start = time.thread_time()
    estimate = estimator(*images)
    return estimate, 1000.0 * (time.thread_time() - start)


def _judged(
    scene: CornerScene,
    sequence: StereoSequence,
    frame: int,
    estimate: CornerEstimate,
    places: dict[int, NDArray[np.float64]],
) -> dict[str, Any]:
    pose = estimate.pose
    found = pose is not None and pose.vertex_m is not None
    row = _frame_row(sequence, frame, found=found) | {"hypotheses": len(estimate.hypotheses), "reason": estimate.reason}
    if pose is not None and pose.vertex_m is None and scene.kind != "laboratory":
        turn = rotation_vector(attitude_near(sequence, frame, pose.camera_from_object) @ pose.camera_from_object.T)
        nees = float(turn @ np.linalg.solve(pose.covariance[:3, :3], turn))
        return row | {"found": True, "attitude_deg": float(np.degrees(np.linalg.norm(turn))), "nees": nees}
    if pose is None or pose.vertex_m is None:
        return row | {"reason": estimate.place_reason or estimate.reason}
    row["probability"] = pose.probability
    if scene.kind == "laboratory":
        number, truth = sequence.corner, sequence.left_from_object(frame)
    else:
        number, truth = truth_near(sequence, frame, pose, places[estimate.object])
        row |= dict(zip(("lengths", "lengths_off"), lengths_off(sequence, frame, estimate.corners), strict=True))
    error = np.concatenate([
        rotation_vector(truth[:3, :3] @ pose.camera_from_object.T), truth[:3, 3] - pose.vertex_m
    ])  # fmt: skip
    return (
        row
        | _errors(truth, pose.camera_from_object, pose.vertex_m)
        | {
            "corner": number,
            "surface": surface_off(sequence, frame, pose),
            "nees": float(error @ np.linalg.solve(pose.covariance, error)) if number >= 0 else None,
        }
    )


def _by_markers(sequence: StereoSequence, frame: int, pose: MarkerPose | None) -> dict[str, Any]:
    row = _frame_row(sequence, frame, found=pose is not None)
    if pose is None:
        return row | {"reason": "no marker in the left image"}
    errors = _errors(sequence.left_from_object(frame), pose.camera_from_object, pose.vertex_m)
    return row | errors | {"corner": sequence.corner, "hypotheses": 1, "reason": ""}


def _frame_row(sequence: StereoSequence, frame: int, *, found: bool) -> dict[str, Any]:
    """What is told of every frame, with a pose or without."""
    return {
        "frame": frame,
        "time_s": float(sequence.times_s[frame]),
        "distance_m": float(np.linalg.norm(sequence.left_from_object(frame)[:3, 3])),
        "found": found,
        "corner": -1,
        "hypotheses": 0,
    }


def _errors(
    truth: NDArray[np.float64], rotation: NDArray[np.float64], vertex_m: NDArray[np.float64]
) -> dict[str, float]:
    """How far a pose is from the true one, (4, 4)."""
    turn = rotation_vector(truth[:3, :3] @ rotation.T)
    place = truth[:3, :3].T @ truth[:3, 3] - rotation.T @ vertex_m
    pitch, yaw, roll = np.degrees(turn).tolist()
    x, y, z = place.tolist()
    return {
        "attitude_deg": float(np.degrees(np.linalg.norm(turn))),
        "roll_deg": roll,
        "pitch_deg": pitch,
        "yaw_deg": yaw,
        "position_m": float(np.linalg.norm(place)),
        "x_m": x,
        "y_m": y,
        "z_m": z,
    }
