"""Views of panoramas by cameras that look anywhere: pinhole and fisheye, rolled and pitched by up to 45 degrees."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.cameras import Camera
from tiltvp.lab.datasets.panoramas import Panorama, PanoramaViews
from tiltvp.rotations import read_rotation

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["AHEAD_CAMERAS", "FORWARD", "AheadView", "ahead_views", "roll_pitch", "up_from"]

WIDTH, HEIGHT = 640, 480
LEAN_MAX_DEG: Final = 45.0
FORWARD: Final = read_rotation("forward")
"""The mounting of a camera that looks ahead, (3, 3)."""


def _pinhole(view_deg: float) -> Camera:
    focal_px = 0.5 * WIDTH / np.tan(np.deg2rad(0.5 * view_deg))
    return Camera.pinhole(width=WIDTH, height=HEIGHT, fx=focal_px, fy=focal_px, cx=319.5, cy=239.5)


def _fisheye(view_deg: float) -> Camera:
    reach = np.deg2rad(0.5 * view_deg)
    return Camera.equidistant(
        width=WIDTH, height=HEIGHT, focal_px=0.5 * (HEIGHT - 4) / reach, cx=319.5, cy=239.5, max_theta_rad=reach
    )


AHEAD_CAMERAS: Final = {
    **{f"pinhole {view}": _pinhole(view) for view in (50, 65, 80, 105)},
    **{f"fisheye {view}": _fisheye(view) for view in (120, 180)},
}
"""Four pinhole cameras by their horizontal and two fisheyes by their whole field of view in degrees, 640 x 480."""


@dataclass(frozen=True)
class AheadView:
    """One view: the camera's name, the image, and the direction that is up in the camera frame, (3,)."""

    camera: str
    image: NDArray[np.uint8]
    up: NDArray[np.float64]


def up_from(roll_rad: float, pitch_rad: float) -> NDArray[np.float64]:
    """(3,): what is up in the frame of a camera rolled clockwise and then pitched upwards; level, it is -y."""
    return np.array([-np.cos(pitch_rad) * np.sin(roll_rad), -np.cos(pitch_rad) * np.cos(roll_rad), np.sin(pitch_rad)])


def roll_pitch(up: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Roll and pitch in radians of directions (..., 3) that are up."""
    return np.arctan2(-up[..., 0], -up[..., 1]), np.arcsin(np.clip(up[..., 2], -1.0, 1.0))


def ahead_views(
    panorama: Panorama,
    number: int,
    *,
    lean_max_deg: float = LEAN_MAX_DEG,
    samples: int = 2,
    noise_sigma: float = 2.0,
) -> Iterator[AheadView]:
    """One view of a panorama by each camera; heading, roll and pitch, up to so much, by the seed `number`."""
    rng = np.random.default_rng(number)
    for place, (name, camera) in enumerate(AHEAD_CAMERAS.items()):
        yaw = float(rng.uniform(-np.pi, np.pi))
        roll, pitch = np.deg2rad(rng.uniform(-lean_max_deg, lean_max_deg, 2))
        up = up_from(roll, pitch)
        views = PanoramaViews(panorama, camera, robot_from_camera=FORWARD, samples=samples)
        seed = 1000 * number + place
        image = views.render(FORWARD @ up, yaw_rad=yaw, noise_sigma=noise_sigma, seed=seed)
        yield AheadView(name, image, up)
