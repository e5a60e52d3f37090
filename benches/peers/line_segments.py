"""Vertical lines against OpenCV's LSD and LBD on the same frames of rendered drives, in one process on one thread.

Prints the processor time of finding and describing as a ratio to ours on the same frame, and how well the same pairs of
frames are matched: correct and false matches, and the true edges that are missed. OpenCV's segments are those of the
image as it is, or of the panorama that it is unwrapped to; those that are not vertical are dropped before they are
described. Wants the cv2 of opencv-contrib-python-headless: see the recipe `measure-line-peers`.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np

from tiltvp.lab.datasets.driven import DrivenFrames, read_drive
from tiltvp.lab.evaluation.line_pairs import FALSE, RIGHT, pair_verdicts
from tiltvp.lab.evaluation.line_truth import identities
from tiltvp.lines import LineExtractor, match

FRAMES_APART = (1, 4, 20)
LENGTH_MIN_RAD = math.radians(15.0)
PLANE_MAX_RAD = math.radians(5.0)
SEGMENT_MIN_RAD = math.radians(3.0)
RATIO = 0.8
NO_RULES = {"f1": 10.0, "f2": 1.0, "f3": 1.0}


@dataclass
class Found:
    """The lines of a frame, as `identities` takes them, their descriptors, and what they took in seconds."""

    bearing_rad: np.ndarray
    elevation_min_rad: np.ndarray
    elevation_max_rad: np.ndarray
    descriptors: np.ndarray
    seconds: float
    edges: tuple[frozenset[int], ...] = ()

    def __len__(self) -> int:
        return len(self.bearing_rad)


class Ours:
    """Our extractor, descriptor and matcher."""

    def __init__(self, drive: DrivenFrames, **options: object) -> None:
        dataset = drive.dataset
        self._extractor = LineExtractor(dataset.camera, robot_from_camera=dataset.robot_from_camera, **options)
        self._drive = drive

    def find(self, frame: int, gray: np.ndarray) -> Found:
        start = time.thread_time()
        lines = self._extractor(gray, self._drive.tilt(frame))
        descriptors = self._extractor.describe(gray, lines)
        seconds = time.thread_time() - start
        return Found(lines.bearing_rad, lines.elevation_min_rad, lines.elevation_max_rad, descriptors, seconds)

    @staticmethod
    def match(a: np.ndarray, b: np.ndarray, rules: bool) -> np.ndarray:
        return match(a, b, **({} if rules else NO_RULES))


class Segments:
    """LSD's vertical segments of the image, LBD, and the nearest in Hamming distance both ways."""

    def __init__(self, drive: DrivenFrames) -> None:
        self._camera, self._rotation = drive.dataset.camera, drive.dataset.robot_from_camera
        self._lsd = cv2.line_descriptor.LSDDetector.createLSDDetector()
        self._lbd = cv2.line_descriptor.BinaryDescriptor.createBinaryDescriptor()

    def find(self, _: int, gray: np.ndarray) -> Found:
        start = time.thread_time()
        picture = self.picture(gray)
        keylines = self._lsd.detect(picture, 2, 1)
        ends = [[k.startPointX, k.startPointY, k.endPointX, k.endPointY] for k in keylines]
        points = np.array(ends, dtype=np.float64).reshape(-1, 2, 2)
        rays = self.rays(points)
        azimuth, elevation = np.arctan2(rays[..., 1], rays[..., 0]), np.arcsin(np.clip(rays[..., 2], -1.0, 1.0))
        normal = np.cross(rays[:, 0], rays[:, 1])
        length = np.linalg.norm(normal, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            vertical = np.abs(normal[:, 2] / length) <= math.sin(PLANE_MAX_RAD)
        chosen = np.flatnonzero(vertical & (np.abs(np.diff(elevation, axis=1)[:, 0]) >= SEGMENT_MIN_RAD))
        kept = [keylines[i] for i in chosen]
        for number, keyline in enumerate(kept):
            keyline.class_id = number
        descriptors = self._lbd.compute(picture, kept)[1] if kept else np.zeros((0, 32), np.uint8)
        seconds = time.thread_time() - start
        middle = np.exp(1j * azimuth[chosen]).sum(axis=1)
        low, high = np.sort(elevation[chosen], axis=1).T
        return Found(np.angle(middle), low, high, descriptors, seconds)

    def picture(self, gray: np.ndarray) -> np.ndarray:
        """What segments are looked for in."""
        return gray

    def rays(self, points: np.ndarray) -> np.ndarray:
        """(N, 2, 3): unit bearings of the segments' ends in the robot frame; NaN where the camera sees nothing."""
        return (self._camera.unproject(points.reshape(-1, 2)) @ self._rotation.T).reshape(-1, 2, 3)

    @staticmethod
    def match(a: np.ndarray, b: np.ndarray, rules: bool) -> np.ndarray:
        if not len(a) or not len(b):
            return np.zeros((0, 2), np.int64)
        if not rules:
            return np.array([(m.queryIdx, m.trainIdx) for m in cv2.BFMatcher(cv2.NORM_HAMMING, True).match(a, b)])
        matcher = cv2.BFMatcher(cv2.NORM_HAMMING)
        back = [m.trainIdx for m in matcher.match(b, a)]
        best = [
            (near[0].queryIdx, near[0].trainIdx)
            for near in matcher.knnMatch(a, b, 2)
            if (len(near) < 2 or near[0].distance <= RATIO * near[1].distance)
            and back[near[0].trainIdx] == near[0].queryIdx
        ]
        return np.array(best, dtype=np.int64).reshape(-1, 2)


class PanoramaSegments(Segments):
    """The same of the panorama: azimuth over columns, elevation over rows, unwrapped by `cv2.remap`."""

    def __init__(self, drive: DrivenFrames, columns: int = 1024) -> None:
        super().__init__(drive)
        self._pitch = 2.0 * math.pi / columns
        self._top = math.radians(25.0)
        rows = round((self._top - math.radians(-45.0)) / self._pitch)
        azimuth, elevation = np.meshgrid(
            math.pi - (np.arange(columns) + 0.5) * self._pitch, self._top - (np.arange(rows) + 0.5) * self._pitch
        )
        rays = np.stack(
            [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=-1
        )
        pixels = self._camera.project(rays.reshape(-1, 3) @ self._rotation)
        self._map = np.nan_to_num(pixels, nan=-1.0).reshape(rows, columns, 2).astype(np.float32)

    def picture(self, gray: np.ndarray) -> np.ndarray:
        return cv2.remap(gray, self._map, None, cv2.INTER_LINEAR)

    def rays(self, points: np.ndarray) -> np.ndarray:
        azimuth = math.pi - (points[..., 0] + 0.5) * self._pitch
        elevation = self._top - (points[..., 1] + 0.5) * self._pitch
        return np.stack(
            [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=-1
        )


@dataclass
class Score:
    """Sums over pairs of frames."""

    correct: int = 0
    false: int = 0
    due: int = 0
    found: int = 0

    def add(self, pairs: np.ndarray, verdicts: np.ndarray, a: Found, b: Found, due: set[int]) -> None:
        """Matches whose first line is on a true edge, and which of the edges due in both frames have one."""
        matched: set[int] = set()
        for i, j in pairs:
            if a.edges[i]:
                self.correct += verdicts[i, j] == RIGHT
                self.false += verdicts[i, j] == FALSE
            matched |= a.edges[i] & b.edges[j]
        self.due += len(due)
        self.found += len(due & matched)


@dataclass
class Peer:
    """What one way came to."""

    lines: list[int] = field(default_factory=list)
    find_s: list[float] = field(default_factory=list)
    match_s: list[float] = field(default_factory=list)
    scores: dict[tuple[int, bool], Score] = field(default_factory=dict)


def due_edges(drive: DrivenFrames, frame: int) -> set[int]:
    """The edges that any way is asked for: clear, and in sight over the least length of our lines."""
    truth = drive.truths[frame]
    long = np.diff(truth.elevations_rad, axis=1)[:, 0] >= LENGTH_MIN_RAD
    return set(truth.edges[long & (truth.contrast >= 0.1)].tolist())


def seconds(work: Callable[[], np.ndarray]) -> tuple[float, np.ndarray]:
    start = time.thread_time()
    answer = work()
    return time.thread_time() - start, answer


def run(drive: DrivenFrames, every: int, peers: dict[str, Peer]) -> None:
    """Adds a drive to the sums."""
    ways = {
        "tiltvp": Ours(drive),
        "tiltvp, ten longest": Ours(drive, lines_max=10),
        "tiltvp, from 6 degrees": Ours(drive, length_min_rad=math.radians(6.0)),
        "LSD + LBD, image": Segments(drive),
        "LSD + LBD, panorama": PanoramaSegments(drive),
    }
    begins = range(0, len(drive) - max(FRAMES_APART), every)
    chosen = sorted({a + apart for a in begins for apart in (0, *FRAMES_APART)})
    grays = {frame: drive.gray(frame) for frame in chosen}
    seen: dict[str, dict[int, Found]] = {}
    # One way after the other, as a robot would run it: tables stay in the caches that they fit into.
    for name, way in ways.items():
        seen[name] = {frame: way.find(frame, gray) for frame, gray in grays.items()}
        peer = peers.setdefault(name, Peer())
        for frame, found in seen[name].items():
            found.edges = identities(found, drive.truths[frame], length_min_rad=0.0).edges
            peer.lines.append(len(found))
            peer.find_s.append(found.seconds)
    for a in begins:
        for apart in FRAMES_APART:
            due = due_edges(drive, a) & due_edges(drive, a + apart)
            for name, way in ways.items():
                one, other = seen[name][a], seen[name][a + apart]
                verdicts = pair_verdicts(one.edges, other.edges, other.bearing_rad, drive.truths[a + apart])
                for rules in (False, True):
                    took, pairs = seconds(
                        lambda way=way, one=one, other=other, rules=rules: way.match(
                            one.descriptors, other.descriptors, rules
                        )
                    )
                    peers[name].scores.setdefault((apart, rules), Score()).add(pairs, verdicts, one, other, due)
                    if rules:
                        peers[name].match_s.append(took)


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drives", nargs="+", help="folders that `tiltvp dataset drive` has written")
    parser.add_argument("--every", type=int, default=10, help="frames from the beginning of a pair to that of the next")
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    peers: dict[str, Peer] = {}
    for directory in arguments.drives:
        run(read_drive(directory), arguments.every, peers)
    own = np.array(peers["tiltvp, ten longest"].find_s)
    print("Finding and describing the lines of a frame (ratio to tiltvp's ten longest), and matching two frames")
    for name, peer in peers.items():
        ratio = np.median(np.array(peer.find_s) / own)
        print(
            f"{ratio:6.1f} x  {1e3 * np.median(peer.find_s):7.2f} ms + {1e3 * np.median(peer.match_s):5.2f} ms"
            f"  {np.mean(peer.lines):5.1f} lines  {name}"
        )
    print("\nMatches, per cent: correct and false of the matches, and edges due in both frames that are missed")
    for rules, title in ((False, "nearest both ways"), (True, "and the rules (F1 to F3; LBD: ratio 0.8)")):
        for apart in FRAMES_APART:
            print(f"{title}, {apart} frames apart")
            for name, peer in peers.items():
                score = peer.scores[apart, rules]
                total = max(score.correct + score.false, 1)
                correct, false = 100.0 * score.correct / total, 100.0 * score.false / total
                missed = 100.0 * (1.0 - score.found / max(score.due, 1))
                print(
                    f"  {total:6d} matches: {correct:6.2f} correct {false:6.2f} false;"
                    f"  {score.due} edges: {missed:6.2f} missed  {name}"
                )


if __name__ == "__main__":
    main()
