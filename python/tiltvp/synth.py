"""Seeded rooms, drives and stereo sequences with known truth: data for demos, tests and experiments."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tiltvp import _core
from tiltvp._core import SimulatedDrive, drive_legs, simulate_drive
from tiltvp.arguments import number_from
from tiltvp.cameras import Camera
from tiltvp.images import checked_camera
from tiltvp.stereo_scenes import (
    ImuLog,
    Laboratory,
    SceneCorner,
    StereoSequence,
    StereoTruth,
    scene_corners,
    zed_cameras,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = [
    "MIRROR_BLIND_RAD",
    "OUTDOOR_KINDS",
    "ROOM_KINDS",
    "WALL_PATTERNS",
    "Drive",
    "DriveTruth",
    "ImuLog",
    "Laboratory",
    "Room",
    "RoomImage",
    "SceneCorner",
    "SimulatedDrive",
    "StereoSequence",
    "StereoTruth",
    "drive_legs",
    "mirror_camera",
    "render_room",
    "simulate_drive",
    "zed_cameras",
]

OUTDOOR_KINDS: tuple[str, ...] = ("yard",)
"""Places under the open sky: a yard between the fronts of houses and garden walls."""
ROOM_KINDS: tuple[str, ...] = tuple(kind for kind in _core.ROOM_KINDS if kind not in OUTDOOR_KINDS)
"""Rooms, with a ceiling."""
WALL_PATTERNS: tuple[str, ...] = tuple(_core.WALL_PATTERNS)

MIRROR_BLIND_RAD: float = math.radians(40.0)
"""Half angle of the cone in which `mirror_camera` sees only itself."""


def mirror_camera() -> Camera:
    """A camera below a hyperbolic mirror like that of Scaramuzza et al. 2009: 640 x 480, from 50 degrees down to 25 up.

    The middle, below 50 degrees, is where it sees itself: give drives `blind_rad=MIRROR_BLIND_RAD`.
    """
    return Camera.unified(
        width=640,
        height=480,
        xi=0.95,
        fx=136.0,
        fy=136.0,
        cx=319.5,
        cy=239.5,
        max_theta_rad=math.radians(115.0),
        mirror=True,
    )


@dataclass(frozen=True, eq=False)
class RoomImage:
    """A leaning robot's view of a room: `gray` (H, W) and `bgr` (H, W, 3), both uint8, and the true lean."""

    gray: NDArray[np.uint8]
    bgr: NDArray[np.uint8]
    alpha_rad: float
    beta_rad: float


class Room(_core.Room):
    """A furnished, lit room of one of `ROOM_KINDS`, or a place of `OUTDOOR_KINDS`, built once: `Room(kind, seed)`.

    The same arguments, the same room.

    The world frame has z up and the floor at z = 0; metres. `threads` is how many build it, None for one per core; the
    room does not depend on it. None stands for what is usual: `clutter` and `daylight` from 0 to 1 are how full it is
    and how bright the day outside, `light_spacing_m` how finely light is gathered, `extent` from 1 to 4 how many times
    larger than usual the floor is, `floor_gloss` from 0 to 1 how much it shines (0), and `wall_pattern` what all walls
    have in common, one of `WALL_PATTERNS`: stripes, panels or tiles, equally spaced, or nothing (drawn; so of a yard).

    Comparable, hashable, and to be pickled. Raises `tiltvp.errors.InvalidInputError`.
    """

    __slots__ = ()

    @property
    def corners(self) -> tuple[SceneCorner, ...]:
        """Where an upright and two level edges of walls and things meet, visible or not."""
        return scene_corners(self._corners())

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
        checked_camera(camera)
        alpha_rad, beta_rad = number_from(alpha_rad, "alpha_rad"), number_from(beta_rad, "beta_rad")
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

    def straight_edges(
        self,
        camera: Camera,
        *,
        pose: ArrayLike,
        alpha_rad: float = 0.0,
        beta_rad: float = 0.0,
        robot_from_camera: ArrayLike | None = None,
        camera_height_m: float | None = None,
        contrast_min: float = 0.05,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The straight edges that are in sight in the picture that `render` makes of the same view, the longest first.

        (N, 2, 3) unit bearings of the ends in the camera frame, and (N,) contrasts |a - b| / (a + b) of the luminances
        beside the edges, at least `contrast_min` all along. Edges are the sides of flat surfaces and the upright
        edges of patterned walls, whole or the parts that nothing hides; edges of other textures and of shadows are not
        among them. Raises `tiltvp.errors.InvalidInputError`, also for a place outside the room.
        """
        return self._straight_edges(
            camera,
            contrast_min,
            pose=pose,
            alpha_rad=alpha_rad,
            beta_rad=beta_rad,
            robot_from_camera=robot_from_camera,
            camera_height_m=camera_height_m,
        )

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
            height=height,
            camera_height_m=camera_height_m,
            noise_sigma=noise_sigma,
            samples=samples,
            seed=seed,
            threads=threads,
        )
        return RoomImage(gray, np.ascontiguousarray(rgb[:, :, ::-1]), 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class DriveTruth:
    """The upright edges in sight at one frame of a drive, in the order of their numbers."""

    edges: NDArray[np.int64]
    """(M,): which rows of `Drive.edges_m`; an edge keeps its number all along the drive."""
    bearings_rad: NDArray[np.float64]
    """(M,): azimuth atan2(y, x), seen from the camera's centre, in the frame of the robot when levelled."""
    elevations_rad: NDArray[np.float64]
    """(M, 2): of the lowest and the highest point in sight, in the same frame."""
    visible_share: NDArray[np.float64]
    """(M,): share of the edge's height that is in the image with nothing before it, above 0."""
    contrast: NDArray[np.float64]
    """(M,): |a - b| / (a + b) of the luminances beside the edge, averaged over what is in sight."""


class Drive(_core.Drive):
    """A robot with a camera and wheel encoders that drives through a room: `Drive(room, camera=camera)`.

    It wanders for `frames` frames, or drives `legs` (L, 2): distance in metres and turn in radians of arcs, from a
    place with room for all of them; `drive_legs("paper")` are those of the paper's calibration.

    The same arguments give the same drive and the same bytes of every frame, in any order and for any `threads`. The
    camera sits at `mount` (x_m, y_m, yaw_rad, height_m) on the robot, whose origin is on the floor between its wheels,
    and is turned by `robot_from_camera` and then by the mount's yaw; `blind_rad` is the cone about its z axis in which
    it sees only itself. From frame to frame the robot moves at most `step_m` and turns at most `turn_max_rad`. A
    reading of an encoder has the variance `encoder_k_m` |d|; `wheel_radius_errors` is how much larger the left and the
    right wheel are, relative, than the readings assume. Bumps lean the robot, about the camera's centre, by up to
    `bumps_max_rad`. `lighting`, from 0 to 1, is how much lamps, daylight and exposure change along the way. `samples`
    is the rays per pixel and side where surfaces meet; elsewhere one ray per pixel will do. None is for the default.

    Comparable, hashable, and to be pickled. Raises `tiltvp.errors.InvalidInputError`.
    """

    __slots__ = ()

    def render(self, frame: int, *, threads: int | None = None) -> RoomImage:
        """The image of one frame, on so many threads (None: one per core)."""
        gray, rgb = self._render(frame, threads=threads)
        alpha, beta = self.tilts[int(frame)]
        return RoomImage(gray, np.ascontiguousarray(rgb[:, :, ::-1]), float(alpha), float(beta))

    def render_at(
        self, frame: int, *, pose: ArrayLike, alpha_rad: float = 0.0, beta_rad: float = 0.0, threads: int | None = None
    ) -> RoomImage:
        """What the camera sees in a frame's light where the robot is elsewhere, or leans otherwise, than on this drive.

        `pose` is (x_m, y_m, yaw_rad); any number from 0 is a `frame`, of which light and noise are taken. Raises
        `tiltvp.errors.InvalidInputError`, also for a place outside the room.
        """
        alpha_rad, beta_rad = number_from(alpha_rad, "alpha_rad"), number_from(beta_rad, "beta_rad")
        gray, rgb = self._render_at(frame, pose, _core.normal_from_alpha_beta(alpha_rad, beta_rad), threads=threads)
        return RoomImage(gray, np.ascontiguousarray(rgb[:, :, ::-1]), alpha_rad, beta_rad)

    def truth(self, frame: int, *, threads: int | None = None) -> DriveTruth:
        """The upright edges in sight at one frame, however faint; silhouettes of round things are none."""
        return DriveTruth(*self._truth(frame, threads=threads))


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
    """Renders a `Room` of a kind from a free place in it. The same arguments give the same bytes.

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
