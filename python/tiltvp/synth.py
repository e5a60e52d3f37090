"""Seeded rooms and drives with known truth: data for demos, tests and experiments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tiltvp import _core
from tiltvp._core import SimulatedDrive, simulate_drive

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp.cameras import Camera

__all__ = ["ROOM_KINDS", "Room", "RoomImage", "SimulatedDrive", "render_room", "simulate_drive"]

ROOM_KINDS: tuple[str, ...] = tuple(_core.ROOM_KINDS)


@dataclass(frozen=True)
class RoomImage:
    """A leaning robot's view of a room: `gray` (H, W) and `bgr` (H, W, 3), both uint8, and the true lean."""

    gray: NDArray[np.uint8]
    bgr: NDArray[np.uint8]
    alpha_rad: float
    beta_rad: float


class Room(_core.Room):
    """A furnished, lit room of one of `ROOM_KINDS`, built once: `Room(kind, seed)`. The same arguments, the same room.

    The world frame has z up and the floor at z = 0; metres. `threads` is how many build it, None for one per core; the
    room does not depend on it. Comparable, hashable, and to be pickled. Raises `tiltvp.errors.InvalidInputError`.
    """

    __slots__ = ()

    def render(
        self,
        camera: Camera,
        *,
        pose: ArrayLike,
        alpha_rad: float = 0.0,
        beta_rad: float = 0.0,
        robot_from_camera: ArrayLike | None = None,
        camera_height_m: float | None = None,
        noise_sigma: float = 2.0,
        samples: int | None = None,
        seed: int = 0,
        threads: int | None = None,
    ) -> RoomImage:
        """What a robot sees that stands at `pose` (x_m, y_m, yaw_rad) and leans about its camera's centre.

        `camera_height_m` is above the floor (None: 0.3), `noise_sigma` in grey levels, `samples` the rays per pixel and
        side (None: 3), `seed` that of ray places and noise. The same arguments give the same bytes for any `threads`
        (None: one per core). Raises `tiltvp.errors.InvalidInputError`, also for a place outside the room.
        """
        gray, rgb = self._render(
            camera,
            pose=pose,
            alpha_rad=alpha_rad,
            beta_rad=beta_rad,
            robot_from_camera=robot_from_camera,
            camera_height_m=camera_height_m,
            noise_sigma=noise_sigma,
            samples=samples,
            seed=seed,
            threads=threads,
        )
        return RoomImage(gray, np.ascontiguousarray(rgb[:, :, ::-1]), alpha_rad, beta_rad)

    def render_panorama(
        self,
        *,
        pose: ArrayLike,
        height: int,
        camera_height_m: float | None = None,
        noise_sigma: float = 0.0,
        samples: int | None = None,
        seed: int = 0,
        threads: int | None = None,
    ) -> RoomImage:
        """The levelled equirectangular panorama of `height` rows and twice as many columns around a place.

        The zenith is in the top row, the robot's front in the middle column, its left to the left. As `render` else.
        """
        gray, rgb = self._render_panorama(
            pose=pose,
            camera_height_m=camera_height_m,
            height=height,
            noise_sigma=noise_sigma,
            samples=samples,
            seed=seed,
            threads=threads,
        )
        return RoomImage(gray, np.ascontiguousarray(rgb[:, :, ::-1]), 0.0, 0.0)


def render_room(
    camera: Camera,
    *,
    kind: str = "office",
    seed: int = 0,
    alpha_rad: float = 0.0,
    beta_rad: float = 0.0,
    robot_from_camera: ArrayLike | None = None,
    noise_sigma: float = 2.0,
    samples: int | None = None,
) -> RoomImage:
    """Renders one of `ROOM_KINDS` from a free place in it. The same arguments give the same bytes.

    `noise_sigma` is in grey levels, `samples` the rays per pixel and side (None: 3). For many views of one room, build
    a `Room`. Raises `tiltvp.errors.InvalidInputError`.
    """
    room = Room(kind, seed)
    return room.render(
        camera,
        pose=room.free_poses(1, seed)[0],
        alpha_rad=alpha_rad,
        beta_rad=beta_rad,
        robot_from_camera=robot_from_camera,
        noise_sigma=noise_sigma,
        samples=samples,
        seed=seed,
    )
