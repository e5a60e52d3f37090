"""How well the robot's own body is found in images, what of the world is taken for it, and what that does to tilts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np
import polars as pl

from tiltvp.body import body_mask
from tiltvp.cameras import Camera
from tiltvp.lab.datasets.body import PaintedBody
from tiltvp.lab.datasets.driving import drive_room
from tiltvp.lab.datasets.panoramas import Panorama, PanoramaViews
from tiltvp.lab.evaluation.mounting import CAMERAS
from tiltvp.robot_setup import LOOKED_AT
from tiltvp.synth import Drive
from tiltvp.tilt import TiltEstimate, TiltEstimator, normal_from_alpha_beta, tilt_error_rad

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["PLACES", "DriveImages", "drives", "judge_drive", "panorama_sets", "summarise_masks", "summarise_tilts"]

IMAGES: Final = LOOKED_AT
FEWER: Final = (5, 12, 24)
"""Images that are looked at, spread over the drive."""
FRAMES: Final = 400
"""Frames of a drive, of which `IMAGES` are rendered."""
BUMPS_RAD: Final = 0.04
PLACES: Final = ("corridor", "office", "living-room", "corridor, straight on")
"""Where drives go: they wander, but for the last, which goes on by five metres without a turn or a bump."""
METHODS: Final = ("refined", "segments")
_GRADIENT: Final = 150.0
"""Least magnitude of the edges that are counted, for the Scharr kernel (3, 10, 3): that of the methods."""
_NEAR_PX: Final = 2
"""Within which of the body an edge is the body's; beyond three times as far it is the world's."""


@dataclass(frozen=True)
class DriveImages:
    """Images of a place by one camera, without a body, and the true ground normals."""

    place: str
    looks: str
    images: list[NDArray[np.uint8]]
    normals: list[NDArray[np.float64]]


def drives(places: Sequence[str], seed: int, *, advance: Callable[[], None] = lambda: None) -> Iterator[DriveImages]:
    """Rendered drives through each place, by each camera; `advance` is called after each image."""
    for number, place in enumerate(places):
        kind, _, straight = place.partition(", ")
        room = drive_room(kind, seed + number)
        for looks, (camera, mounting) in CAMERAS.items():
            drive = Drive(
                room,
                camera=camera,
                robot_from_camera=mounting,
                frames=None if straight else FRAMES,
                legs=[(5.0, 0.0)] if straight else None,
                bumps_max_rad=0.0 if straight else BUMPS_RAD,
                samples=1,
                seed=seed + number,
            )
            images, normals = [], []
            for frame in _spread(len(drive), IMAGES):
                view = drive.render(frame)
                images.append(view.gray)
                normals.append(normal_from_alpha_beta(view.alpha_rad, view.beta_rad))
                advance()
            yield DriveImages(place, looks, images, normals)


def panorama_sets(
    panoramas: Sequence[Panorama], seed: int, *, advance: Callable[[], None] = lambda: None
) -> Iterator[DriveImages]:
    """Views of panoramas of different buildings, by each camera, with headings and leans of their own."""
    rng = np.random.default_rng(seed)
    for start in range(0, len(panoramas) - IMAGES + 1, IMAGES):
        for looks, (camera, mounting) in CAMERAS.items():
            images, normals = [], []
            for number, panorama in enumerate(panoramas[start : start + IMAGES]):
                normal = normal_from_alpha_beta(rng.uniform(0.0, BUMPS_RAD), rng.uniform(-np.pi, np.pi))
                views = PanoramaViews(panorama, camera, robot_from_camera=mounting)
                images.append(views.render(normal, yaw_rad=rng.uniform(-np.pi, np.pi), seed=start + number))
                normals.append(normal)
                advance()
            yield DriveImages("panoramas", looks, images, normals)


def judge_drive(drive: DriveImages, seed: int) -> tuple[pl.DataFrame, pl.DataFrame]:
    """What is masked, a row for each case, and the errors of tilts in degrees, one for each image, method and mask."""
    camera, mounting = CAMERAS[drive.looks]
    body = PaintedBody(camera, seed)
    painted = [body.paint(image, seed + k) for k, image in enumerate(drive.images)]
    rng = np.random.default_rng(seed)
    still = [_lit(painted[0], rng) for _ in range(IMAGES)]
    masks = []
    found = None
    for count in FEWER:
        chosen = _spread(IMAGES, count)
        found = body_mask((painted[k] for k in chosen), camera)
        masks.append(_row(drive, f"body, {count} images", found.mask, camera, body, painted))
        without = body_mask((drive.images[k] for k in chosen), camera)
        masks.append(_row(drive, f"no body, {count} images", without.mask, camera, None, drive.images))
    masks.append(_row(drive, "body, standing", body_mask(still, camera).mask, camera, body, still))
    masks.append(_row(drive, "body, 2 images", body_mask(painted[::20], camera).mask, camera, body, painted))
    half = still[: IMAGES // 2] + painted[IMAGES // 2 :]
    masks.append(_row(drive, "body, half standing", body_mask(half, camera).mask, camera, body, half))
    ways: dict[str, tuple[list[NDArray[np.uint8]], NDArray[np.bool_] | None]]
    ways = {"no body": (drive.images, None), "body in view": (painted, None)}
    if found is not None and found.mask is not None:
        ways["body left out"] = (painted, found.mask)
    tilts = [
        {"straight": "straight" in drive.place, "looks": drive.looks, "method": method, "way": way}
        | _tilt(estimator(image), normal)
        for method in METHODS
        for way, (images, mask) in ways.items()
        for estimator in [TiltEstimator(camera, robot_from_camera=mounting, method=method, mask=mask)]
        for image, normal in zip(images, drive.normals, strict=True)
    ]
    return pl.DataFrame(masks, infer_schema_length=None), pl.DataFrame(tilts, infer_schema_length=None)


def summarise_masks(table: pl.DataFrame) -> pl.DataFrame:
    """Shares in per cent for each case: sets of which an answer was given, and means over these."""
    return table.group_by("case", "straight", maintain_order=True).agg(
        pl.len().alias("sets"),
        (100.0 * pl.col("known").mean()).alias("answered"),
        (100.0 * pl.col("body").mean()).alias("body's edges left out"),
        (100.0 * pl.col("overlap").mean()).alias("overlap"),
        (100.0 * pl.col("world").mean()).alias("world left out"),
        (100.0 * pl.col("world").max()).alias("at most"),
    )


def summarise_tilts(table: pl.DataFrame) -> pl.DataFrame:
    """Errors in degrees of the answers of each method, with and without the body and its mask."""
    return table.group_by("straight", "looks", "method", "way", maintain_order=True).agg(
        (100.0 * pl.col("error_deg").is_not_null().mean()).alias("answered"),
        pl.col("error_deg").mean().alias("mean"),
        pl.col("error_deg").median().alias("median"),
        pl.col("error_deg").quantile(0.95, "linear").alias("95 %"),
        (100.0 * (pl.col("sure") & (pl.col("error_deg") > 2.0)).mean()).alias("wrong and sure"),
    )


def _spread(length: int, count: int) -> list[int]:
    return [k * (length - 1) // (count - 1) for k in range(count)]


def _lit(image: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """The same view in another light, with other noise."""
    levels = image * rng.uniform(0.8, 1.1) + rng.normal(0.0, 2.0, image.shape)
    return np.asarray(np.clip(np.rint(levels), 0, 255), dtype=np.uint8)


def _row(
    drive: DriveImages,
    case: str,
    mask: NDArray[np.bool_] | None,
    camera: Camera,
    body: PaintedBody | None,
    images: Sequence[NDArray[np.uint8]],
) -> dict[str, object]:
    """Shares of the body's edge pixels and of the world's pixels that are left out, and overlap over union of what is
    left out with the edges that the body shows in half of the images.
    """
    row: dict[str, object] = {"place": drive.place, "looks": drive.looks, "case": case}
    row |= {"straight": "straight" in drive.place, "known": mask is not None}
    row |= dict.fromkeys(("body", "overlap", "world"), None)
    if mask is None:
        return row
    seen, out = camera.valid_mask(), ~mask
    covered = np.zeros(seen.shape, np.uint8) if body is None else np.asarray(body.cover > 0.0, dtype=np.uint8)
    near, far = _wider(covered, _NEAR_PX), ~_wider(covered, 3 * _NEAR_PX) & seen
    row["world"] = float(np.mean(out[far]))
    if body is not None:
        edges = np.mean([_edges(image) for image in images], axis=0) * (near & seen)
        truth = _wider(np.asarray(edges >= 0.5, dtype=np.uint8), _NEAR_PX) & seen
        row["body"] = float(edges[out].sum() / edges.sum())
        row["overlap"] = float(np.sum(out & truth) / np.sum((out & seen) | truth))
    return row


def _edges(image: NDArray[np.uint8]) -> NDArray[np.bool_]:
    x, y = cv2.Scharr(image, cv2.CV_32F, 1, 0), cv2.Scharr(image, cv2.CV_32F, 0, 1)
    return np.asarray(np.hypot(x, y) >= _GRADIENT)


def _wider(shape: NDArray[np.uint8], reach_px: int) -> NDArray[np.bool_]:
    return np.asarray(cv2.dilate(shape, np.ones((2 * reach_px + 1, 2 * reach_px + 1), np.uint8)) > 0)


def _tilt(estimate: TiltEstimate, normal: NDArray[np.float64]) -> dict[str, object]:
    error = float(np.rad2deg(tilt_error_rad(estimate.normal, normal))) if estimate else None
    return {"error_deg": error, "sure": bool(estimate) and estimate.confidence >= 0.9}
