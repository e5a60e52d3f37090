"""Files that commands read: a small camera, rooms seen by it, the log of a drive, pictures of a pair of cameras."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

import tiltvp
from drawn_corners import CAMERA, LEFT_FROM_RIGHT
from tiltvp.stereo_rigs import StereoRig
from tiltvp.synth import Room, simulate_drive


def write_rooms(folder: Path, count: int) -> None:
    """camera.toml (185 degrees on 240 x 180 pixels), and images/0.png and so on of an office, each leaning its way."""
    limit = math.radians(92.5)
    camera = tiltvp.Camera.equidistant(width=240, height=180, focal_px=52.4, cx=119.5, cy=89.5, max_theta_rad=limit)
    camera.save(folder / "camera.toml")
    room = Room("office", 3)
    [pose] = room.free_poses(1, 3)
    for number in range(count):
        image = room.render(camera, pose=pose, alpha_rad=0.03, beta_rad=0.02 * number, seed=3)
        tiltvp.write_image(folder / "images" / f"{number}.png", image.bgr)


def write_drive_log(folder: Path) -> None:
    """wheels.csv and bearings.csv of a drive of the paper, without times."""
    drive = simulate_drive("paper", seed=1)
    for name, header, rows in (
        ("wheels.csv", "step,delta_left_m,delta_right_m", [(i, *row) for i, row in enumerate(drive.odometry.tolist())]),
        ("bearings.csv", "step,landmark,bearing_rad", [(int(a), int(b), c) for a, b, c in drive.bearings.tolist()]),
    ):
        (folder / name).write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n")


def write_pair(folder: Path, pictures: Mapping[str, np.ndarray]) -> None:
    """rig.toml of the pair of cameras that drawn corners are seen by, and each picture as a.png of its folder."""
    StereoRig(CAMERA, CAMERA, LEFT_FROM_RIGHT).save(folder / "rig.toml")
    for side, image in pictures.items():
        tiltvp.write_image(folder / side / "a.png", image)
