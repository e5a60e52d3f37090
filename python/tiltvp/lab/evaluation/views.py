"""Views of known lean, one after the other: of panoramas and of rendered rooms, at the leans of the paper's table 1."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.panoramas import TABLE_1_TILTS_DEG, Panorama, PanoramaViews, read_panorama_index
from tiltvp.synth import ROOM_KINDS, Room
from tiltvp.tilt import normal_from_alpha_beta

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.cameras import Camera

__all__ = ["Source", "View", "panorama_views", "room_views", "view_sources"]


@dataclass(frozen=True)
class View:
    """An image (H, W) uint8, the place it shows, and the true lean."""

    image: NDArray[np.uint8]
    location: str
    alpha_rad: float
    beta_rad: float


@dataclass(frozen=True)
class Source:
    """Views, how many there are, and what they are of."""

    title: str
    count: int
    views: Iterator[View]


def panorama_views(
    panoramas: Iterable[Panorama], camera: Camera, *, samples: int = 2, noise_sigma: float = 2.0
) -> Iterator[View]:
    """Upright panoramas at the seven leans of the paper's table 1."""
    for number, panorama in enumerate(panoramas):
        views = PanoramaViews(panorama, camera, samples=samples)
        for place, (alpha_deg, beta_deg) in enumerate(TABLE_1_TILTS_DEG):
            alpha, beta = float(np.deg2rad(alpha_deg)), float(np.deg2rad(beta_deg))
            normal = normal_from_alpha_beta(alpha, beta)
            image = views.render(normal, noise_sigma=noise_sigma, seed=1000 * number + place)
            yield View(image, panorama.name, alpha, beta)


def room_views(
    rooms: int, camera: Camera, *, samples: int = 2, noise_sigma: float = 2.0, kinds: Sequence[str] = ROOM_KINDS
) -> Iterator[View]:
    """Rendered rooms, so many of each kind, at the same leans."""
    for kind in kinds:
        for seed in range(rooms):
            room = Room(kind, seed)
            pose = room.free_poses(1, seed)[0]
            for place, (alpha_deg, beta_deg) in enumerate(TABLE_1_TILTS_DEG):
                alpha, beta = float(np.deg2rad(alpha_deg)), float(np.deg2rad(beta_deg))
                image = room.render(
                    camera, pose=pose, alpha_rad=alpha, beta_rad=beta, noise_sigma=noise_sigma, samples=samples,
                    seed=1000 * seed + place,
                )  # fmt: skip
                yield View(image.gray, f"{kind} {seed}", alpha, beta)


def view_sources(
    directory: str | os.PathLike[str] | None,
    camera: Camera,
    *,
    every: int = 1,
    rooms: int = 0,
    kinds: Sequence[str] = ROOM_KINDS,
    samples: int = 2,
    noise_sigma: float = 2.0,
) -> list[Source]:
    """One in `every` panoramas of a folder with an `INDEX.csv`, if there is one, and `rooms` rooms of each kind.

    Raises `InvalidInputError` where there is neither.
    """
    chosen = [] if directory is None else read_panorama_index(directory)[::every]
    places = len(kinds) * max(rooms, 0)
    sources = []
    if chosen:
        views = panorama_views(chosen, camera, samples=samples, noise_sigma=noise_sigma)
        sources.append(Source(f"{len(chosen)} panoramas", len(chosen) * len(TABLE_1_TILTS_DEG), views))
    if places:
        views = room_views(rooms, camera, samples=samples, noise_sigma=noise_sigma, kinds=kinds)
        sources.append(Source(f"{places} rooms", places * len(TABLE_1_TILTS_DEG), views))
    if not sources:
        raise InvalidInputError(f"--rooms {rooms}, expected a folder of panoramas, or rooms to render")
    return sources
