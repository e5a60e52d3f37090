"""The way of a drive and the places of its landmarks, for a picture of what a calibration made of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["landmark_places", "robot_poses"]

_SPREAD_MIN_RAD: Final = 0.02
"""By how much the rays to a landmark must differ in direction: below it, a degree, a bearing that is off by a tenth of
a degree moves the landmark by a tenth of its distance."""


def robot_poses(odometry: ArrayLike, *, wheel_base_m: float) -> NDArray[np.float64]:
    """(N, 3): x, y in metres and yaw in radians after each step of displacements (N, 2) of left and right wheel.

    Steps are arcs; the first begins at 0, 0, 0.
    """
    left, right = np.asarray(odometry, dtype=np.float64).reshape(-1, 2).T
    turn, length = (right - left) / wheel_base_m, 0.5 * (left + right)
    yaw = np.cumsum(turn)
    middle, chord = yaw - 0.5 * turn, length * np.sinc(0.5 * turn / np.pi)
    return np.stack([np.cumsum(chord * np.cos(middle)), np.cumsum(chord * np.sin(middle)), yaw], axis=1)


def landmark_places(poses: ArrayLike, bearings: ArrayLike, mounting: ArrayLike) -> dict[int, NDArray[np.float64]]:
    """The place (2,) of each landmark, metres: where the rays of its bearings pass closest.

    `poses` (N, 3) are the robot's, `bearings` (M, 3) step, landmark and bearing of the camera, `mounting` x, y and yaw
    of the camera on the robot. Landmarks whose rays hardly differ in direction, and those behind their rays, are left
    out.
    """
    poses, mounting = np.asarray(poses, dtype=np.float64), np.asarray(mounting, dtype=np.float64)
    rows = np.asarray(bearings, dtype=np.float64).reshape(-1, 3)
    x, y, yaw = poses[rows[:, 0].astype(int)].T
    cosine, sine = np.cos(yaw), np.sin(yaw)
    origins = np.stack(
        [x + cosine * mounting[0] - sine * mounting[1], y + sine * mounting[0] + cosine * mounting[1]], axis=1
    )
    angle = yaw + mounting[2] + rows[:, 2]
    along, across = np.stack([np.cos(angle), np.sin(angle)], axis=1), np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    found = {}
    for landmark in np.unique(rows[:, 1]):
        own = rows[:, 1] == landmark
        system = across[own].T @ across[own]
        # The root of its smallest eigenvalue, of one ray, is about the spread of the rays' directions.
        if np.linalg.eigvalsh(system)[0] < _SPREAD_MIN_RAD**2 * np.count_nonzero(own):
            continue
        place = np.linalg.solve(system, across[own].T @ np.sum(across[own] * origins[own], axis=1))
        if np.median(np.sum(along[own] * (place - origins[own]), axis=1)) > 0.0:
            found[int(landmark)] = place
    return found
