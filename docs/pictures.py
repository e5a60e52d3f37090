"""Pictures of the guides, of rooms that the package renders: `just pictures` writes them into docs/images."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np

import tiltvp
from tiltvp.corner import CornerPoseEstimator
from tiltvp.overlays.corners import draw_box, draw_corners
from tiltvp.overlays.tilt import draw_words
from tiltvp.synth import MIRROR_BLIND_RAD, Laboratory, Room, StereoSequence, mirror_camera, zed_cameras

IMAGES = Path(__file__).parent / "images"
ALPHA_RAD, BETA_RAD = math.radians(12.0), math.radians(40.0)
FISHEYE = tiltvp.Camera.equidistant(
    width=360, height=360, focal_px=110.0, cx=179.5, cy=179.5, max_theta_rad=math.radians(92.5)
)
PINHOLE = tiltvp.Camera.pinhole(width=480, height=360, fx=240.0, fy=240.0, cx=239.5, cy=179.5)
FORWARD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def main() -> None:
    room = Room("living-room", 5)
    pose = room.free_poses(1, 5)[0]
    lenses(room, pose)
    levelling(room, pose)
    corners()


def lenses(room: Room, pose: np.ndarray) -> None:
    """One place through four lenses."""
    mirror = room.render(mirror_camera(), pose=pose, camera_height_m=1.2, samples=2).bgr
    rows, columns = np.mgrid[0 : mirror.shape[0], 0 : mirror.shape[1]]
    away = mirror_camera().unproject(np.stack([columns.ravel(), rows.ravel()], axis=1).astype(float))[:, 2]
    mirror[np.reshape(np.abs(away) > math.cos(MIRROR_BLIND_RAD), rows.shape)] = 0
    pictures = {
        "pinhole": room.render(PINHOLE, pose=pose, robot_from_camera=FORWARD, camera_height_m=1.2, samples=2).bgr,
        "equidistant": room.render(FISHEYE, pose=pose, camera_height_m=1.2, samples=2).bgr,
        "unified, in a mirror": cv2.resize(mirror, (480, 360), interpolation=cv2.INTER_AREA),
        "equirectangular": room.render_panorama(pose=pose, height=360, camera_height_m=1.2, samples=2).bgr,
    }
    write("lenses.jpg", [draw_words(picture, name) for name, picture in pictures.items()])


def levelling(room: Room, pose: np.ndarray) -> None:
    """A leaning view, and what two levellers make of it."""
    estimator = tiltvp.TiltEstimator(FISHEYE, method="segments")
    image = room.render(FISHEYE, pose=pose, alpha_rad=ALPHA_RAD, beta_rad=BETA_RAD, samples=2).bgr
    estimate = estimator(image)
    assert tiltvp.tilt_error_rad(estimate.normal, tiltvp.normal_from_alpha_beta(ALPHA_RAD, BETA_RAD)) < 0.01
    panorama = tiltvp.Leveller(FISHEYE, to="panorama", size=(720, 360))
    pictures = {
        "leaning by 12 degrees": image,
        'level, to="same"': tiltvp.Leveller(FISHEYE)(image, estimate),
        'level, to="panorama"': panorama(image, estimate),
    }
    write("level.jpg", [draw_words(picture, name) for name, picture in pictures.items()])


def corners() -> None:
    """The coloured cuboid before a pair of cameras, as the left one sees it, with the rays and the imaginary box."""
    left, right = zed_cameras()
    sequence = StereoSequence(Laboratory(3), left=left, right=right, frames=6, seed=3)
    pictures = sequence.render(0)
    estimate = CornerPoseEstimator(left, right, sequence.left_from_right)(*pictures)
    assert estimate.pose is not None
    canvas = draw_corners(pictures[0], left, estimate.features_left, estimate.chosen_left)
    draw_box(canvas, left, estimate.pose.vertex_m, estimate.pose.edges)
    u, v = (round(place) for place in left.project(estimate.pose.vertex_m))
    part = (slice(max(v - 160, 0), v + 160), slice(max(u - 240, 0), u + 240))
    write("corner.jpg", [pictures[0][part], canvas[part]])


def write(name: str, pictures: list[np.ndarray]) -> None:
    """Pictures side by side."""
    IMAGES.mkdir(exist_ok=True)
    cv2.imwrite(str(IMAGES / name), np.hstack(pictures), [cv2.IMWRITE_JPEG_QUALITY, 75])


if __name__ == "__main__":
    main()
