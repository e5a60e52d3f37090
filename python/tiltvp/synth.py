"""Seeded rooms with known truth, ray-cast through any camera: data for demos and tests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tiltvp import _core

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp.cameras import Camera

__all__ = ["ROOM_KINDS", "RoomImage", "render_room"]

ROOM_KINDS: tuple[str, ...] = tuple(_core.ROOM_KINDS)


@dataclass(frozen=True)
class RoomImage:
    """A leaning robot's view of a room: `gray` (H, W) and `bgr` (H, W, 3), both uint8, and the true lean."""

    gray: NDArray[np.uint8]
    bgr: NDArray[np.uint8]
    alpha_rad: float
    beta_rad: float


def render_room(
    camera: Camera,
    *,
    kind: str = "office",
    seed: int = 0,
    alpha_rad: float = 0.0,
    beta_rad: float = 0.0,
    robot_from_camera: ArrayLike | None = None,
    noise_sigma: float = 2.0,
    samples: int = 3,
) -> RoomImage:
    """Renders one of `ROOM_KINDS`. The same arguments give the same bytes.

    `noise_sigma` is in grey levels, `samples` the rays per pixel and side. Raises `tiltvp.errors.InvalidInputError`.
    """
    gray, rgb = _core.render_room(
        camera,
        kind=kind,
        seed=seed,
        alpha_rad=alpha_rad,
        beta_rad=beta_rad,
        robot_from_camera=robot_from_camera,
        noise_sigma=noise_sigma,
        samples=samples,
    )
    return RoomImage(gray, np.ascontiguousarray(rgb[:, :, ::-1]), alpha_rad, beta_rad)
