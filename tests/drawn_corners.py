"""Corners of a cuboid, drawn as a camera and a pair of cameras see them, for the tests of several files."""

from __future__ import annotations

import math

import cv2
import numpy as np

import tiltvp

CAMERA = tiltvp.Camera.pinhole(width=480, height=360, fx=400.0, fy=400.0, cx=240.0, cy=180.0)
COLOURS = {"top": (30, 40, 220), "left": (50, 190, 40), "right": (210, 60, 30)}
LIT_FROM_ABOVE = {"top": (45, 55, 255), "left": (35, 120, 28), "right": (130, 38, 20)}
GREYS = {"top": (200, 200, 200), "left": (120, 120, 120), "right": (60, 60, 60)}
LEFT_FROM_RIGHT = np.eye(4)
LEFT_FROM_RIGHT[:3, 3] = (0.12, 0.01, -0.02)


def turn(axis: str, degrees: float) -> np.ndarray:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    rows = {"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]]}
    return np.array(rows.get(axis, [[c, -s, 0], [s, c, 0], [0, 0, 1]]), dtype=np.float64)


def pose(yaw: float = 40.0, pitch: float = 28.0, roll: float = 4.0) -> tuple[np.ndarray, np.ndarray]:
    """The cuboid's frame (y down, x and z to the back) and its corner, in the camera's frame."""
    return turn("z", roll) @ turn("x", pitch) @ turn("y", -yaw), np.array([0.02, -0.03, 1.2])


def drawn(
    rotation: np.ndarray,
    vertex: np.ndarray,
    faces: dict[str, tuple[int, int, int]],
    fine: int = 8,
    *,
    noise: float = 1.0,
    beyond: bool = False,
) -> np.ndarray:
    """The cuboid in front of grey, every pixel the mean light of `fine` squared places.

    Light above 0.7 is rolled off. `beyond`: where the line of the edge x goes on behind the cuboid, things of the
    colours of its two faces meet.
    """
    x, y, z = 0.3 * rotation.T
    corners = {"top": (x, x + z, z), "left": (z, y + z, y), "right": (y, x + y, x)}
    picture = np.full((360 * fine, 480 * fine, 3), 150, np.uint8)
    for face, (a, b, c) in corners.items():
        points = np.array([vertex, vertex + a, vertex + b, vertex + c])
        pixels = points[:, :2] / points[:, 2:] * 400.0 + (240.0, 180.0)
        cv2.fillPoly(picture, [np.rint(((pixels + 0.5) * fine - 0.5) * 16).astype(np.int32)], faces[face], shift=4)
    if beyond:
        for face, side in (("top", -y), ("right", y)):
            points = np.array([vertex + 2.0 * x, vertex + 2.4 * x, vertex + 2.4 * x + side, vertex + 2.0 * x + side])
            pixels = points[:, :2] / points[:, 2:] * 400.0 + (240.0, 180.0)
            cv2.fillPoly(picture, [np.rint(((pixels + 0.5) * fine - 0.5) * 16).astype(np.int32)], faces[face], shift=4)
    return photographed(picture, noise)


def on_wall(
    rotation: np.ndarray,
    columns: tuple[int, ...],
    *,
    size_m: tuple[float, float] = (0.3, 0.3),
    right_m: float = 0.0,
    fine: int = 8,
) -> np.ndarray:
    """Dark rectangles in three rows and in columns 80 cm apart, on a wall along x and y, 2 m away."""
    picture = np.full((360 * fine, 480 * fine, 3), 150, np.uint8)
    for column in columns:
        for row in range(-1, 2):
            corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * size_m + (0.8 * column, 0.6 * row)
            places = np.column_stack([corners, np.zeros(4)]) @ rotation.T + (-right_m, 0.0, 2.0)
            pixels = places[:, :2] / places[:, 2:] * 400.0 + (240.0, 180.0)
            cv2.fillPoly(picture, [np.rint(((pixels + 0.5) * fine - 0.5) * 16).astype(np.int32)], (60, 60, 60), shift=4)
    return photographed(picture, 1.0)


def photographed(picture: np.ndarray, noise: float, seed: int = 5) -> np.ndarray:
    """What the camera makes of a fine picture: light blurred, rolled off above 0.7, and noisy."""
    light = (picture.astype(np.float32) / 255.0) ** 2.2
    light = cv2.GaussianBlur(cv2.resize(light, (480, 360), interpolation=cv2.INTER_AREA), (0, 0), 0.7)
    light = np.where(light < 0.7, light, 1.0 - 0.3 * np.exp((0.7 - light) / 0.3))
    grain = np.random.default_rng(seed).normal(0.0, noise, light.shape)
    return np.clip(np.rint(255.0 * light ** (1 / 2.2) + grain), 0, 255).astype(np.uint8)


def amid_lines(picture: np.ndarray, centre: np.ndarray, reach: float) -> np.ndarray:
    """A picture of 1920 x 1440 with 120 lines of any direction away from its `centre`, as the camera sees it."""
    rng = np.random.default_rng(2)
    for _ in range(120):
        while True:
            middle, angle = rng.uniform([0, 0], [1920, 1440]), rng.uniform(0, np.pi)
            half = 150 * np.array([np.cos(angle), np.sin(angle)])
            if min(np.hypot(*(point - centre)) for point in (middle - half, middle, middle + half)) > reach:
                break
        ends = [tuple((middle + sign * half).astype(int).tolist()) for sign in (-1, 1)]
        cv2.line(picture, ends[0], ends[1], (int(rng.integers(0, 90)),), 8)
    return photographed(np.repeat(picture[..., None], 3, 2), 1.0, 2)


def off_px(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    return 400.0 * (found / found[2] - true / true[2])[:2]


def off_deg(found: np.ndarray, true: np.ndarray) -> float:
    return math.degrees(2.0 * math.asin(min(1.0, float(np.linalg.norm(found - true)) / math.sqrt(8.0))))


def pair(faces: dict[str, tuple[int, int, int]]) -> tuple[np.ndarray, np.ndarray]:
    rotation, vertex = pose()
    return drawn(rotation, vertex, faces), drawn(rotation, vertex - LEFT_FROM_RIGHT[:3, 3], faces)
