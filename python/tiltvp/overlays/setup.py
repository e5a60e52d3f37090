"""What `tiltvp setup` found, as a picture: what is left out, horizons by both mountings, and the image made level."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiltvp.images import gray_from
from tiltvp.levelling import level
from tiltvp.overlays.tilt import ESTIMATED, UPRIGHT, draw_tilt, draw_words

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp.robot import Robot
    from tiltvp.tilt import TiltEstimate

    Picture = NDArray[np.uint8]

__all__ = ["setup_picture"]

_LEFT_OUT = (60, 60, 220)


def setup_picture(
    image: ArrayLike, robot: Robot, estimate: TiltEstimate, given_robot_from_camera: ArrayLike, words: str = ""
) -> Picture:
    """(H, 2 W, 3) BGR uint8: the image with what the mask leaves out in red, and beside it made level.

    Yellow is the horizon of the estimate by the robot's mounting, grey that of an upright robot by the mounting that
    was given.
    """
    gray = gray_from(image)
    marked = np.repeat(gray[:, :, None], 3, axis=2)
    if robot.mask is not None:
        marked[~robot.mask] = (0.5 * marked[~robot.mask] + 0.5 * np.array(_LEFT_OUT)).astype(np.uint8)
    marked = draw_tilt(marked, robot.camera, (0.0, 0.0, 1.0), given_robot_from_camera, colour=UPRIGHT)
    levelled = gray
    if estimate:
        marked = draw_tilt(marked, robot.camera, estimate.normal, robot.robot_from_camera, colour=ESTIMATED)
        levelled = level(gray, robot.camera, (estimate.alpha_rad, estimate.beta_rad), robot.robot_from_camera)
    beside = np.concatenate([marked, np.repeat(levelled[:, :, None], 3, axis=2)], axis=1)
    return draw_words(beside, words) if words else beside
