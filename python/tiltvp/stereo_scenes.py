"""Pairs of cameras that move through rendered scenes, and the corners that they see, for `tiltvp.synth`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from tiltvp import _core
from tiltvp.arguments import number_from
from tiltvp.cameras import Camera
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["ImuLog", "Laboratory", "SceneCorner", "StereoSequence", "StereoTruth", "zed_cameras"]


def zed_cameras(width: int = 1280) -> tuple[Camera, Camera]:
    """Left and right camera of a pair like the ZED of Liu et al. 2018, before rectification: Brown-Conrady distortion.

    The focal length is about 702 pixels for a `width` of 1280 (x 720), 1049 for 1920 (x 1080); other widths are refused
    by `tiltvp.errors.InvalidInputError`.
    """
    sizes = {1280: (720, 702.0), 1920: (1080, 1049.0)}
    if number_from(width, "width") not in sizes:
        raise InvalidInputError(f"width = {width}, expected 1280 or 1920")
    height, focal_px = sizes[width]
    grown = focal_px / 702.0
    cx, cy = 0.5 * (width - 1), 0.5 * (height - 1)
    left = Camera.pinhole(
        width=width, height=height, fx=focal_px, fy=1.0006 * focal_px, cx=cx + 6.4 * grown, cy=cy - 4.1 * grown,
        k1=-0.172, k2=0.0264, p1=0.0002, p2=-0.0004,
    )  # fmt: skip
    right = Camera.pinhole(
        width=width, height=height, fx=1.0011 * focal_px, fy=1.0018 * focal_px, cx=cx - 3.2 * grown,
        cy=cy + 5.7 * grown, k1=-0.169, k2=0.0249, p1=-0.0003, p2=0.0002,
    )  # fmt: skip
    return left, right


class Laboratory(_core.Laboratory):
    """A plain room with a cuboid on its floor and a lamp beside it: `Laboratory(seed)`.

    The same arguments give the same room. Seen from the front, the cuboid's upper face is red, its left one green, its
    right one blue; the other faces are grey. `size_m` is how long its edges x (above the blue face), y (upright) and z
    (above the green face) are, `gamma_rad` the angle between x and z. `marker_m` is the side of ArUco markers in the
    middle of the blue, the green and the red face (numbers 0, 1 and 2 of OpenCV's `DICT_4X4_50`), on cards that are a
    third larger and 1 mm before the face; 0 for none. `clutter`, from 0 to 1, is how full the walls are with furniture,
    and `side_light`, from 0 to 1, the power of the lamp beside it. `light_spacing_m` is how finely light is gathered,
    on `threads` threads (None: one per core), which do not matter. None is for the default.

    Comparable, hashable, and to be pickled. Raises `tiltvp.errors.InvalidInputError`.
    """

    __slots__ = ()


@dataclass(frozen=True, eq=False)
class SceneCorner:
    """A vertex of a scene where one upright and two level edges meet."""

    position_m: NDArray[np.float64]
    """(3,): the vertex in the world."""
    edges: NDArray[np.float64]
    """(3, 3): rows are unit directions, away from the vertex and in the world, of the edges x, y, z; y is the upright
    one, and z on the side of x cross y."""
    lengths_m: NDArray[np.float64]
    """(3,): how long the edges are."""
    kind: str
    """`"solid"` for the corner of a box, `"hollow"` for that of a room seen from inside, `"jutting"` for walls that jut
    into the room."""

    @property
    def gamma_rad(self) -> float:
        """The angle between the level edges x and z."""
        return float(np.arctan2(np.linalg.norm(np.cross(self.edges[0], self.edges[2])), self.edges[0] @ self.edges[2]))

    @property
    def world_from_object(self) -> NDArray[np.float64]:
        """(3, 3): the object's frame has y along the upright edge, x along the edge x, z = x cross y."""
        x, y, _ = self.edges
        return np.column_stack([x, y, np.cross(x, y)])


def scene_corners(
    parts: Iterable[tuple[list[float], list[list[float]], list[float], str]],
) -> tuple[SceneCorner, ...]:
    """Corners of what the core tells of them."""
    return tuple(
        SceneCorner(np.array(position), np.array(edges), np.array(lengths), kind)
        for position, edges, lengths, kind in parts
    )


@dataclass(frozen=True, eq=False)
class StereoTruth:
    """The M corners whose vertex is in sight in both images of a frame, in the order of their numbers."""

    corners: NDArray[np.int64]
    """(M,): which of `StereoSequence.corners`."""
    vertices_px: NDArray[np.float64]
    """(M, 2, 2): (u, v) of the vertex in the left and in the right image."""
    edges_px: NDArray[np.float64]
    """(M, 2, 3): in either image, how long the edges x, y, z are from the vertex on to where they are hidden or end."""


@dataclass(frozen=True, eq=False)
class ImuLog:
    """What an inertial sensor reads along a motion, at the left camera's centre and in its axes (x right, y down)."""

    times_s: NDArray[np.float64]
    """(M,): when."""
    rates_rad_s: NDArray[np.float64]
    """(M, 3): rates of turn."""
    forces_m_s2: NDArray[np.float64]
    """(M, 3): specific forces; at rest they point upwards, against gravity."""
    rate_biases_rad_s: NDArray[np.float64]
    """(M, 3): the true bias of the rates, which no sensor tells."""


class StereoSequence(_core.StereoSequence):
    """A pair of cameras, held by hand, that looks at a corner of a scene: `StereoSequence(scene, left=..., right=...)`.

    `scene` is a `Laboratory` or a `Room`; `corner` is the number of the corner that is looked at (None: a laboratory's
    cuboid, or a corner of the room or of a piece of furniture that can be approached). The same arguments give the same
    motion and the same bytes of every frame, in any order and for any `threads`. The pair moves smoothly in all six
    degrees of freedom, `distance_m` (least and greatest) away from the corner, rolling by up to `roll_max_rad`, with
    slow sways of about `period_s` and the tremor of hands. `left_from_right` is the right camera's pose in the left
    one's frame; None is 0.12 m to the right, turned by less than half a degree. The exposure is fixed by `gain`;
    `exposure_s` is how long the shutter is open, for motion blur; `blur_sigma_px` is what lens and sensor do to a
    point, `noise_sigma` in grey levels; `samples` the rays per pixel and side where surfaces meet. None is for the
    default.

    `times_s` (N,), `poses` (N, 4, 4, `world_from_left`) and `poses_at(times_s)` are the truth of the motion, with z up
    in the world. Comparable, hashable, and to be pickled. Raises `tiltvp.errors.InvalidInputError`.
    """

    @cached_property
    def corners(self) -> tuple[SceneCorner, ...]:
        """The corners of the scene, visible or not; `corner` is the number of the one that is looked at."""
        return scene_corners(self._corners())

    def render(self, frame: int, *, threads: int | None = None) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """The left and the right image of a frame, (H, W, 3) in BGR order as everywhere, on so many threads."""
        return self._render(frame, threads=threads)

    def truth(self, frame: int, *, threads: int | None = None) -> StereoTruth:
        """The corners in sight at one frame, however faint."""
        return StereoTruth(*self._truth(frame, threads=threads))

    def imu(
        self,
        *,
        rate_hz: float | None = None,
        seed: int = 0,
        gyroscope: tuple[float, float, float, float, float] | None = None,
        accelerometer: tuple[float, float, float, float, float] | None = None,
    ) -> ImuLog:
        """Readings of an inertial sensor along the motion, `rate_hz` a second (None: 200), of the grade of an MPU6050.

        `gyroscope` and `accelerometer` are noise density (unit / sqrt(Hz)), standard deviation of the bias, its walk
        (unit / sqrt(s)), standard deviation of scale and misalignment, and range (which 16 bits divide) in rad/s and
        m/s^2. None: 0.005 deg/s/sqrt(Hz), 0.2 deg/s and +-250 deg/s; 400 ug/sqrt(Hz), 5 mg and +-2 g; scales to 0.5 %.
        """
        return ImuLog(*self._imu(rate_hz=rate_hz, seed=seed, gyroscope=gyroscope, accelerometer=accelerometer))

    def left_from_object(self, frame: int, corner: int | None = None) -> NDArray[np.float64]:
        """(4, 4): the pose in the left camera of a corner's object frame (None: of the corner that is looked at)."""
        number = self.corner if corner is None else corner
        for name, value, count in (("frame", frame, len(self)), ("corner", number, len(self.corners))):
            if not isinstance(value, int | np.integer) or not 0 <= value < count:
                raise InvalidInputError(f"{name} = {value!r}, expected a whole number below {count}")
        chosen = self.corners[number]
        world_from_left = self.poses_at([self.times_s[frame]])[0]
        pose = np.eye(4)
        pose[:3, :3] = world_from_left[:3, :3].T @ chosen.world_from_object
        pose[:3, 3] = world_from_left[:3, :3].T @ (chosen.position_m - world_from_left[:3, 3])
        return pose
