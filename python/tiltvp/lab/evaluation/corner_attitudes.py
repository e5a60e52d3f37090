"""Attitudes that one camera with gravity finds at corners of facades, furniture and real buildings, image by image."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import polars as pl

from tiltvp.cameras import Camera
from tiltvp.corner_images import CornerPoseEstimator
from tiltvp.lab.datasets.ahead import AHEAD_CAMERAS, FORWARD, up_from
from tiltvp.lab.datasets.panoramas import Panorama, PanoramaViews
from tiltvp.lab.evaluation.corner_rooms import attitudes_of, named_near, rotation_vector
from tiltvp.rotations import about_vertical, levelling
from tiltvp.synth import Room

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["attitudes_in_buildings", "attitudes_in_scenes", "summarise_attitudes"]

_CAMERA: Final = Camera.pinhole(width=1280, height=720, fx=700.0, fy=700.0, cx=639.5, cy=359.5)
_HEIGHT_M: Final = 1.5
"""Of the camera above the ground."""

_GRAVITY_SIGMA_RAD: Final = math.radians(0.5)
"""Of an accelerometer at rest, and how far the gravity that is told is off."""

_ROLL_SIGMA_RAD: Final = 0.05
_PITCHES_RAD: Final = {"yard": (0.0, 0.35), "panorama": (-0.3, 0.3)}
_PITCH_RAD: Final = (-0.35, 0.1)
"""Upwards: fronts rise above the camera, furniture stands below it."""

_WRONG_DEG: Final = 2.0
_SURE: Final = 0.9
_NEES_MAX: Final = 16.3
"""The 99.9 % quantile of chi-square of 3."""

_AGREE_DEG: Final = 2.0
"""Attitudes in one building that differ by no more are of things that stand parallel."""


@dataclass(frozen=True)
class _Look:
    """What one image tells."""

    row: dict[str, Any]
    camera_from_object: NDArray[np.float64] | None
    covariance: NDArray[np.float64] | None


def attitudes_in_scenes(
    kinds: Sequence[str],
    places: int,
    views: int,
    *,
    seed: int,
    threads: int,
    advance: Callable[[], None] = lambda: None,
) -> pl.DataFrame:
    """One row for each image: so many `views` of so many `places` of each kind, rendered, `seed` and on.

    `error_deg` is to the nearest attitude of any corner of the scene, however its edges are named, `nees` its square by
    the covariance, 3 on average at best. `advance` is called after each image.
    """
    rows = []
    for kind in kinds:
        low, high = _PITCHES_RAD.get(kind, _PITCH_RAD)
        for number in range(seed, seed + places):
            room = Room(kind, number, light_spacing_m=0.4, threads=threads)
            listed = attitudes_of(room.corners)
            for place, pose in enumerate(room.free_poses(views, number)):
                rng = np.random.default_rng((number, place))
                up = up_from(rng.normal(0.0, _ROLL_SIGMA_RAD), rng.uniform(low, high))
                robot_from_camera = levelling(FORWARD @ up) @ FORWARD
                image = room.render(
                    _CAMERA, pose=pose, robot_from_camera=robot_from_camera, camera_height_m=_HEIGHT_M, samples=2,
                    seed=place, threads=threads,
                )  # fmt: skip
                look = _look(CornerPoseEstimator(_CAMERA, method="general"), image.bgr, up, rng)
                camera_from_world = robot_from_camera.T @ about_vertical(float(pose[2])).T
                truths = [camera_from_world @ attitude for attitude in listed]
                rows.append({"kind": kind, "place": f"{kind} {number}"} | _judged(look, truths))
                advance()
    return pl.DataFrame(rows)


def attitudes_in_buildings(
    panoramas: Sequence[Panorama], views: int, *, seed: int, advance: Callable[[], None] = lambda: None
) -> pl.DataFrame:
    """The same of views of panoramas all around, by a pinhole camera of 80 degrees.

    The truth has what is up from the panorama, known to 0.1 to 0.3 degrees, and turns about it as most of the
    panorama's attitudes do: what stands otherwise, as a wall may, counts as an error. `nees` is none. `advance` is
    called after each panorama.
    """
    camera = AHEAD_CAMERAS["pinhole 80"]
    low, high = _PITCHES_RAD["panorama"]
    rows = []
    for number, panorama in enumerate(panoramas):
        seen: list[tuple[_Look, NDArray[np.float64]]] = []
        projected = PanoramaViews(panorama, camera, robot_from_camera=FORWARD, samples=2)
        for place in range(views):
            rng = np.random.default_rng((seed + number, place))
            yaw = 2.0 * math.pi * (place + rng.uniform(-0.4, 0.4)) / views
            up = up_from(rng.normal(0.0, _ROLL_SIGMA_RAD), rng.uniform(low, high))
            image = projected.render(FORWARD @ up, yaw_rad=yaw, noise_sigma=2.0, seed=views * number + place)
            look = _look(CornerPoseEstimator(camera, method="general"), image, up, rng)
            upright = levelling(FORWARD @ up) @ FORWARD
            seen.append((look, (about_vertical(yaw) @ upright).T))
        truth = _of_most(seen)
        for look, camera_from_world in seen:
            judged = _judged(look, [camera_from_world @ truth]) | {"nees": None}
            rows.append({"kind": "panorama", "place": panorama.name} | judged)
        advance()
    return pl.DataFrame(rows)


def summarise_attitudes(table: pl.DataFrame) -> pl.DataFrame:
    """By kind: per cent of images with an attitude, and by a corner of two edges; errors; how many are wrong."""
    error = pl.col("error_deg")
    return table.group_by("kind", maintain_order=True).agg(
        pl.col("place").n_unique().alias("places"),
        pl.len().alias("images"),
        pl.col("found").mean().mul(100).alias("% found"),
        pl.col("edges").eq(2).fill_null(value=False).mean().mul(100).alias("% by two edges"),
        error.median().alias("median deg"),
        error.quantile(0.95).alias("95 % deg"),
        ((error > _WRONG_DEG) & (pl.col("confidence") >= _SURE)).sum().alias(f"off by > {_WRONG_DEG:g} deg and sure"),
        pl.col("nees").gt(_NEES_MAX).sum().alias("NEES > 99.9 %"),
        pl.col("ms").median().alias("ms"),
    )


def _look(
    estimator: CornerPoseEstimator, image: NDArray[np.uint8], up: NDArray[np.float64], rng: np.random.Generator
) -> _Look:
    """What the estimator makes of an image and of gravity as it is measured."""
    down = -up + np.cross(rng.normal(0.0, _GRAVITY_SIGMA_RAD, 3), -up)
    start = time.thread_time()
    estimate = estimator(image, gravity=(down / np.linalg.norm(down), _GRAVITY_SIGMA_RAD))
    row: dict[str, Any] = {"found": estimate.pose is not None, "ms": 1000.0 * (time.thread_time() - start)}
    if estimate.pose is None:
        return _Look(row | {"edges": None, "confidence": None, "reason": estimate.reason}, None, None)
    supports = estimate.features_left[estimate.chosen_left[0]].support_px
    row |= {"edges": sum(px > 0 for px in supports), "confidence": estimate.confidence, "reason": ""}
    return _Look(row, estimate.pose.camera_from_object, estimate.pose.covariance[:3, :3])


def _judged(look: _Look, truths: Sequence[NDArray[np.float64]]) -> dict[str, Any]:
    """The row with its error from the nearest of some true attitudes."""
    if look.camera_from_object is None or look.covariance is None:
        return look.row | {"error_deg": None, "nees": None}
    turn = rotation_vector(named_near(truths, look.camera_from_object) @ look.camera_from_object.T)
    nees = float(turn @ np.linalg.solve(look.covariance, turn))
    return look.row | {"error_deg": float(np.degrees(np.linalg.norm(turn))), "nees": nees}


def _of_most(seen: Sequence[tuple[_Look, NDArray[np.float64]]]) -> NDArray[np.float64]:
    """(3, 3), world_from_object: upright, turned as most of some looks, each with its true camera_from_world."""
    headings = []
    for look, camera_from_world in seen:
        if look.camera_from_object is not None:
            x = camera_from_world.T @ look.camera_from_object[:, 0]
            headings.append(math.atan2(x[1], x[0]))

    def apart(a: float, b: float) -> float:
        return abs((a - b + math.pi / 4) % (math.pi / 2) - math.pi / 4)

    def agreeing(heading: float) -> int:
        return sum(apart(heading, other) <= math.radians(_AGREE_DEG) for other in headings)

    upright = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    turned: NDArray[np.float64] = about_vertical(max(headings, key=agreeing, default=0.0)) @ upright
    return turned
