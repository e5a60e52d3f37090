"""Whether names of corners last: in rendered rooms, with a corner covered for some frames, or the whole camera."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from threading import Event
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import polars as pl

from tiltvp.corner_images import CornerEstimate, CornerPoseEstimator
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.new import in_order

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp._core import Camera
    from tiltvp.synth import StereoSequence

    Pair = tuple[NDArray[np.uint8], NDArray[np.uint8]]

__all__ = ["COVERS", "name_sightings", "names_seen", "summarise_names"]

COVERS: Final = ("nothing", "corner", "all")
"""What is hidden: nothing, the corner that is followed when that begins, or both images."""

_HIDDEN: Final = 12
"""Frames: more than those after which the last pose is forgotten (`forget_after`, 10)."""

_DISC: Final = 0.08
"""Radius of what covers the corner, as a share of the image's width: its vertex and its rays next to it."""

_GREY: Final = 110
"""The grey of what covers, unlike walls and furniture."""

_OTHER: Final = 0.04
"""A sighting is of another corner if it is farther from where its name is, as a share of its distance: twice what the
estimator allows."""

_SAME_EDGE: Final = 0.7
"""Cosine of 45 degrees. A corner with an edge to another side is another one, as where a floor board ends there."""

_SCHEMA: Final[dict[str, Any]] = {
    "frame": pl.UInt32, "part": pl.String, "id": pl.Int64, "x_m": pl.Float64, "y_m": pl.Float64, "z_m": pl.Float64,
    "distance_m": pl.Float64, "u": pl.Float64, "v": pl.Float64, "edges": pl.Array(pl.Float64, (3, 3)),
}  # fmt: skip


def names_seen(
    sequence: StereoSequence, *, threads: int = 1, advance: Callable[[], None] = lambda: None, **known: Any
) -> dict[str, pl.DataFrame]:
    """For each of `COVERS` the corners of each frame by name, with it hidden for 12 frames from a third on.

    `known` are options of `CornerPoseEstimator`, general method. Columns as `name_sightings`. `advance` is called after
    each frame. Raises `InvalidInputError` for less than 40 frames.
    """
    if len(sequence) < 40:
        raise InvalidInputError(f"sequence of {len(sequence)} frames, expected 40 or more")
    left, right = sequence.cameras
    estimators = {
        cover: CornerPoseEstimator(left, right, sequence.left_from_right, method="general", **known) for cover in COVERS
    }
    estimates: dict[str, list[CornerEstimate]] = {cover: [] for cover in COVERS}
    hidden = range(len(sequence) // 3, len(sequence) // 3 + _HIDDEN)
    stop = Event()

    def render(frame: int) -> Pair:
        if stop.is_set():
            raise CancelledError
        return sequence.render(frame, threads=1)

    place: NDArray[np.float64] | None = None
    poses = sequence.poses_at(sequence.times_s)
    with in_order(render, range(len(sequence)), threads, stop) as pairs:
        for frame, pair in enumerate(pairs):
            for cover, estimator in estimators.items():
                images = pair
                if frame in hidden and cover != "nothing":
                    images = _covered(sequence, np.linalg.inv(poses[frame]), pair, place if cover == "corner" else None)
                estimates[cover].append(estimator(*images))
            pose = estimates["nothing"][-1].pose
            if pose is not None and pose.vertex_m is not None and frame < hidden[0]:
                place = poses[frame][:3, :3] @ pose.vertex_m + poses[frame][:3, 3]
            advance()
    return {cover: name_sightings(sequence, seen, hidden) for cover, seen in estimates.items()}


def name_sightings(sequence: StereoSequence, estimates: Sequence[CornerEstimate], hidden: range) -> pl.DataFrame:
    """A row for each believed corner of each frame: its name, its place in the world by the true motion, and its edges.

    `part` says whether the frame is before the `hidden` ones, of them, or after.
    """
    rows: list[tuple[object, ...]] = []
    for frame, (world_from_left, estimate) in enumerate(
        zip(sequence.poses_at(sequence.times_s), estimates, strict=True)
    ):
        for corner in estimate.corners:
            vertex = corner.pose.vertex_m
            if vertex is not None:
                place = world_from_left[:3, :3] @ vertex + world_from_left[:3, 3]
                u, v = sequence.cameras[0].project(vertex).tolist()
                part = "before" if frame < hidden[0] else "hidden" if frame in hidden else "after"
                edges = (corner.pose.edges @ world_from_left[:3, :3].T).tolist()
                rows.append((frame, part, corner.id, *place.tolist(), float(np.linalg.norm(vertex)), u, v, edges))
    return pl.DataFrame(rows, schema=_SCHEMA, orient="row")


def summarise_names(sightings: pl.DataFrame) -> dict[str, Any]:
    """How many sightings there are, how many of them have a name, how many names, which of these are of two corners
    (`shared`), how far sightings are from their name's place, and how many of the names from before what was hidden
    are back after it (`kept`) of those at whose places a corner with edges to the same sides is seen again (`back`).
    """
    named = sightings.drop_nulls("id")
    shares, kept, back, shared = [0.0], 0, 0, 0
    places: dict[int, NDArray[np.float64]] = {}
    edges: dict[int, NDArray[np.float64]] = {}
    for (name,), part in named.partition_by("id", as_dict=True, maintain_order=True).items():
        at = part.select("x_m", "y_m", "z_m").to_numpy()
        places[int(name)] = np.median(at, axis=0)
        edges[int(name)] = part["edges"][-1].to_numpy()
        off = np.linalg.norm(at - places[int(name)], axis=1) / part["distance_m"].to_numpy()
        shares.append(float(off.max()))
        shared += bool(off.max() > _OTHER)
    before, after = _sure(named, "before"), _sure(named, "after")
    for name in before:
        same_edges = [other for other in after if ((edges[other] @ edges[name].T).max(axis=1) > _SAME_EDGE).all()]
        near = [other for other in same_edges if np.linalg.norm(places[other] - places[name]) < _OTHER * after[other]]
        back += bool(near)
        kept += name in near
    return {
        "sightings": sightings.height, "named": named.height, "names": len(places), "shared": shared,
        "farthest, % of distance": 100.0 * max(shares), "back": back, "kept": kept,
    }  # fmt: skip


def _sure(named: pl.DataFrame, part: str) -> dict[int, float]:
    """The names that three sightings of a part or more have, and how far away these are in the median."""
    counted = named.filter(part=part).group_by("id").agg(pl.len(), pl.col("distance_m").median())
    return {int(name): float(far) for name, count, far in counted.iter_rows() if count >= 3}


def _covered(
    sequence: StereoSequence,
    left_from_world: NDArray[np.float64],
    pair: Pair,
    place: NDArray[np.float64] | None,
) -> Pair:
    """Both images, or a disc of each before a place in the world, in plain grey."""
    if place is None:
        return np.full_like(pair[0], _GREY), np.full_like(pair[1], _GREY)
    in_left = left_from_world[:3, :3] @ place + left_from_world[:3, 3]
    right_from_left = np.linalg.inv(sequence.left_from_right)
    in_right = right_from_left[:3, :3] @ in_left + right_from_left[:3, 3]
    left, right = sequence.cameras
    return _disc(pair[0], left, in_left), _disc(pair[1], right, in_right)


def _disc(image: NDArray[np.uint8], camera: Camera, point: NDArray[np.float64]) -> NDArray[np.uint8]:
    u, v = camera.project(point)
    if not np.isfinite(u + v):
        return image
    rows, columns = np.ogrid[: image.shape[0], : image.shape[1]]
    canvas = image.copy()
    canvas[(rows - v) ** 2 + (columns - u) ** 2 < (_DISC * camera.width) ** 2] = _GREY
    return canvas
