"""Views of known lean, one after the other: of panoramas and of rendered rooms, at the leans of the paper's table 1."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tiltvp.datasets.panoramas import TABLE_1_TILTS_DEG, Panorama, PanoramaViews
from tiltvp.synth import ROOM_KINDS, Room
from tiltvp.tilt import normal_from_alpha_beta

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.cameras import Camera

__all__ = ["View", "panorama_views", "room_views"]


@dataclass(frozen=True)
class View:
    """An image (H, W) uint8, the place it shows, and the true lean."""

    image: NDArray[np.uint8]
    location: str
    alpha_rad: float
    beta_rad: float


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
            for alpha_deg, beta_deg in TABLE_1_TILTS_DEG:
                alpha, beta = float(np.deg2rad(alpha_deg)), float(np.deg2rad(beta_deg))
                image = room.render(
                    camera, pose=pose, alpha_rad=alpha, beta_rad=beta, noise_sigma=noise_sigma, samples=samples,
                    seed=seed,
                )  # fmt: skip
                yield View(image.gray, f"{kind} {seed}", alpha, beta)
