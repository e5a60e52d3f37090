"""Poses of a coloured cube before a pair of cameras, against those of a marker cube by `cv2.aruco` and `cv2.solvePnP`.

Two cubes of one size at the same places, rendered the same way (pinhole, 1280 x 720, f = 702 px, 4 x 4 rays a pixel,
blur, noise): one with a red, a green and a blue face, one with an ArUco marker on each face. Here the pose knows only
that the edges are at right angles; there it knows the markers' sizes and places, and comes from the left image, as
`solvePnP` has it, or from both, by Gauss-Newton steps over all corners. One process, one thread. Prints errors and
times; `--out DIR` writes an image of each kind.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from timing import times_s

from tiltvp import Camera, corner
from tiltvp.corner import CornerDetector

SIZE_PX = (1280, 720)
FOCAL_PX = 702.0
BASELINE_M = 0.12
CUBE_M = 0.3
RAYS = 4
BLUR_PX = 0.6
NOISE = 2.0
CELLS = 8
"""Cells of a face: a marker of 6 with a margin of 1."""
LIGHT = (1.0, 0.85, 0.7)
"""How bright the upper, the left and the right face are."""
BACKGROUND = (150, 152, 149)
COLOURS = ((40, 40, 190), (40, 150, 40), (190, 50, 40))
"""Blue, green, red of the upper, the left and the right face."""

MATRIX = np.array([[FOCAL_PX, 0, 0.5 * (SIZE_PX[0] - 1)], [0, FOCAL_PX, 0.5 * (SIZE_PX[1] - 1)], [0, 0, 1]])
X, Y, Z = np.eye(3) * CUBE_M
FACES = ((Z, Z + X, X, np.zeros(3)), (Z, np.zeros(3), Y, Z + Y), (np.zeros(3), X, X + Y, Y))
"""Corners of the upper, left and right face, object frame: top left, top right, bottom right, bottom left as seen."""


def about(axis: int, angle: float) -> np.ndarray:
    """The rotation about one axis."""
    return cv2.Rodrigues(np.eye(3)[axis] * angle)[0]


def pose(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A cube seen from 0.8 to 2.5 metres and 15 to 50 degrees above: rotation and place of its front upper corner."""
    turn = -math.pi / 4 + rng.uniform(-0.45, 0.45)
    rotation = about(2, rng.uniform(-0.15, 0.15)) @ about(0, math.radians(rng.uniform(15, 50))) @ about(1, turn)
    distance = rng.uniform(0.8, 2.5)
    return rotation, np.array([*rng.uniform(-0.12, 0.12, 2), 1.0]) * distance


def render(
    textures: list[np.ndarray], rotation: np.ndarray, vertex: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """(H, W, 3) uint8: the cube before a plain wall, its faces textured."""
    width, height = SIZE_PX
    fine = np.empty((height * RAYS, width * RAYS, 3), np.uint8)
    fine[:] = BACKGROUND
    for texture, corners in zip(textures, FACES, strict=True):
        seen = (rotation @ np.array(corners).T).T + vertex
        pixels = (seen @ MATRIX.T)[:, :2] / seen[:, 2:]
        n = len(texture) - 0.5
        own = np.array([[-0.5, -0.5], [n, -0.5], [n, n], [-0.5, n]], np.float32)
        place = cv2.getPerspectiveTransform(own, (pixels * RAYS + 0.5 * (RAYS - 1)).astype(np.float32))
        mask = cv2.warpPerspective(
            np.full(texture.shape[:2], 255, np.uint8), place, fine.shape[1::-1], flags=cv2.INTER_NEAREST
        )
        drawn = cv2.warpPerspective(
            texture, place, fine.shape[1::-1], flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        fine[mask > 0] = drawn[mask > 0]
    image = cv2.resize(fine, SIZE_PX, interpolation=cv2.INTER_AREA).astype(np.float64)
    image = cv2.GaussianBlur(image, (0, 0), BLUR_PX) + rng.normal(0, NOISE, image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def coloured() -> list[np.ndarray]:
    """The plain faces."""
    return [np.full((64, 64, 3), np.multiply(c, light), np.uint8) for c, light in zip(COLOURS, LIGHT, strict=True)]


def marked(dictionary: cv2.aruco.Dictionary) -> list[np.ndarray]:
    """Faces with the markers 0, 1 and 2."""
    out = []
    for number, light in enumerate(LIGHT):
        face = np.full((CELLS * 64, CELLS * 64), 235, np.uint8)
        face[64:-64, 64:-64] = np.maximum(cv2.aruco.generateImageMarker(dictionary, number, (CELLS - 2) * 64), 20)
        out.append(cv2.cvtColor((face * light).astype(np.uint8), cv2.COLOR_GRAY2BGR))
    return out


def marker_points() -> np.ndarray:
    """(3, 4, 3): the corners of the markers, object frame, in the order in which they are detected."""
    share = 1.0 / CELLS
    out = []
    for a, b, c, d in FACES:
        at = [(share, share), (1 - share, share), (1 - share, 1 - share), (share, 1 - share)]
        out.append([(1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d for u, v in at])
    return np.array(out)


class Markers:
    """`cv2.aruco` and `cv2.solvePnP` on all corners of all markers."""

    def __init__(self, refinement: int) -> None:
        self.dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = refinement
        self.detector = cv2.aruco.ArucoDetector(self.dictionary, parameters)
        self.points = marker_points()

    def corners(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """(N, 3) points of the object and (N, 2) pixels."""
        found, numbers, _ = self.detector.detectMarkers(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))
        if numbers is None:
            return None
        known = [i for i, number in enumerate(numbers.ravel()) if number < len(self.points)]
        if not known:
            return None
        pixels = np.concatenate([found[i].reshape(4, 2) for i in known])
        points = np.concatenate([self.points[numbers.ravel()[i]] for i in known])
        return points, pixels.astype(np.float64)

    def __call__(self, left: np.ndarray, right: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray] | None:
        """Rotation and translation, left camera from object."""
        seen = [self.corners(image) for image in (left, right) if image is not None]
        if any(corners is None for corners in seen):
            return None
        points, pixels = seen[0]
        done, turn, place = cv2.solvePnP(points, pixels, MATRIX, None, flags=cv2.SOLVEPNP_SQPNP)
        turn, place = cv2.solvePnPRefineLM(points, pixels, MATRIX, None, turn, place)
        for _ in range(5 if right is not None else 0):
            rows, misses = [], []
            for (points, pixels), shift in zip(seen, (0.0, BASELINE_M), strict=True):
                expected, by = cv2.projectPoints(points, turn, place - [[shift], [0], [0]], MATRIX, None)
                rows.append(by[:, :6])
                misses.append((expected.reshape(-1, 2) - pixels).ravel())
            step = np.linalg.lstsq(np.concatenate(rows), np.concatenate(misses), rcond=None)[0][:, None]
            turn, place = turn - step[:3], place - step[3:]
        return (cv2.Rodrigues(turn)[0], place.ravel()) if done else None


class Coloured:
    """This library: the coloured front end in both images, then the pose."""

    def __init__(self) -> None:
        width, height = SIZE_PX
        camera = Camera.pinhole(
            width=width, height=height, fx=FOCAL_PX, fy=FOCAL_PX, cx=MATRIX[0, 2], cy=MATRIX[1, 2]
        )  # fmt: skip
        self.detector = CornerDetector(camera, method="coloured")
        self.left_from_right = np.eye(4)
        self.left_from_right[0, 3] = BASELINE_M

    def __call__(self, left: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Rotation and translation, left camera from object."""
        features = [self.detector(image) for image in (left, right)]
        if not all(features):
            return None
        found = corner.poses(features[0][0], features[1][0], self.left_from_right)
        return (found[0].camera_from_object, found[0].vertex_m) if found else None


def seconds(work: Callable[[], object], rounds: int) -> float:
    """Median time of a call."""
    return float(np.median(times_s(work, rounds)))


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=60)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--out", type=Path, help="folder for one image of each kind")
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    rng = np.random.default_rng(0)
    ours = Coloured()
    peers = {
        "aruco": Markers(cv2.aruco.CORNER_REFINE_NONE),
        "aruco, subpixel": Markers(cv2.aruco.CORNER_REFINE_SUBPIX),
        "aruco, contour": Markers(cv2.aruco.CORNER_REFINE_CONTOUR),
    }
    plain, markers = coloured(), marked(next(iter(peers.values())).dictionary)
    rows: dict[str, list[tuple[float, float, float]]] = {
        name: [] for name in ["tiltvp, pair", *peers, *(f"{name}, pair" for name in peers)]
    }
    for i in range(arguments.poses):
        rotation, vertex = pose(rng)
        left, right = (render(plain, rotation, vertex - [x, 0, 0], rng) for x in (0.0, BASELINE_M))
        single, other = (render(markers, rotation, vertex - [x, 0, 0], rng) for x in (0.0, BASELINE_M))
        if i == 0 and arguments.out:
            arguments.out.mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(arguments.out / "coloured.png"), left)
            cv2.imwrite(str(arguments.out / "markers.png"), single)
        works: dict[str, Callable[[], tuple[np.ndarray, np.ndarray] | None]]
        works = {"tiltvp, pair": lambda left=left, right=right: ours(left, right)}
        works |= {name: lambda peer=peer, single=single: peer(single) for name, peer in peers.items()}
        works |= {
            f"{name}, pair": lambda peer=peer, single=single, other=other: peer(single, other)
            for name, peer in peers.items()
        }
        for name, work in works.items():
            found = work()
            if found is not None:
                off = float(np.linalg.norm(cv2.Rodrigues(found[0] @ rotation.T)[0]))
                rows[name].append((off, float(np.linalg.norm(found[1] - vertex)), seconds(work, arguments.rounds)))
    print(f"{arguments.poses} poses of a cube of {CUBE_M} m, 0.8 to 2.5 m away")
    print(f"{'':22}{'found':>8}{'attitude rms':>15}{'median':>9}{'position rms':>15}{'median':>9}{'time':>10}")
    for name, values in rows.items():
        if not values:
            print(f"{name:22}{0:8}")
            continue
        off, away, taken = np.array(values).T
        rms = [math.degrees(np.sqrt(np.mean(off**2))), math.degrees(np.median(off))]
        place = [1e3 * np.sqrt(np.mean(away**2)), 1e3 * np.median(away)]
        print(
            f"{name:22}{len(values):8}{rms[0]:11.3f} deg{rms[1]:9.3f}{place[0]:12.2f} mm{place[1]:9.2f}"
            f"{1e3 * np.median(taken):7.2f} ms"
        )


if __name__ == "__main__":
    main()
