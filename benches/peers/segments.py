"""Our straight edges beside those of OpenCV's LSD, on rendered rooms whose straight edges are known, in one process.

For each camera (upward fisheye of 185 degrees, pinhole of 90 degrees looking ahead, panorama) a table: how much of the
true edges is found, how much of what is found lies on no true edge or where the picture without noise has no step at
all, how far normals, places and ends are off, how many of our edges (in per cent) are moved sideways and turned within
the 90 % regions of their variances, and the time. LSD's segments are taken as great circles through their ends. With
`--picture FILE` the edges of one room by both, side by side.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from timing import times_s

from tiltvp import Camera, SegmentDetector, write_image
from tiltvp.lab.datasets.panoramas import paper_camera
from tiltvp.overlays.lines import track_colour
from tiltvp.overlays.segments import draw_segments
from tiltvp.rotations import read_rotation
from tiltvp.synth import ROOM_KINDS, Room

SEEDS = tuple(range(9100, 9106))
"""Of rooms, places and noise; kinds take turns."""

CAMERAS: dict[str, tuple[Camera, np.ndarray]] = {
    "fisheye, 640 x 480": (paper_camera(), np.eye(3)),
    "pinhole, 640 x 480": (
        Camera.pinhole(width=640, height=480, fx=320.0, fy=320.0, cx=319.5, cy=239.5),
        read_rotation("forward"),
    ),
    "panorama, 1280 x 640": (Camera.equirectangular(width=1280, height=640), read_rotation("forward")),
}

NEAR_PX = 1.5
"""How far from an edge what is found may lie: twice what separates it from the next one in the pictures."""

NEAR_COS = math.cos(math.radians(6.0))
"""How far its direction may be off."""

TRUE_MIN_PX = 20.0
"""Shorter true edges are not asked for; they count as true where they are found."""

FOUND_MIN_PX = 12.0
"""Our shortest edge, and LSD's in its second row."""

LONGER_MIN_PX = 18
"""Our shortest edge in our second row: with it as much is astray as by LSD in the fisheye's rooms from seed 9100 on."""

LSD_SHIFT_PX = 0.08
"""What LSD's places lack along both axes, in the mean over steps between two pixel centres."""

STEP = 4.0
"""Least step of grey levels, twice the noise, that is a reason to find an edge."""

CHI2_90 = 2.706
"""Nine in ten squares of normal errors over their variances are less."""


@dataclass
class Arcs:
    """Arcs of great circles with samples every pixel: `arc` tells whose each sample is."""

    normal: np.ndarray
    ends: np.ndarray
    length_px: np.ndarray
    bearing: np.ndarray
    pixel: np.ndarray
    px_per_rad: np.ndarray
    arc: np.ndarray

    @classmethod
    def through(cls, camera: Camera, ends: np.ndarray, normal: np.ndarray | None = None) -> Arcs:
        """Those between (N, 2, 3) bearings."""
        if normal is None:
            normal = np.cross(ends[:, 0], ends[:, 1])
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        along = np.cross(normal, ends[:, 0])
        angle = np.arctan2(np.sum(along * ends[:, 1], axis=1), np.sum(ends[:, 0] * ends[:, 1], axis=1))
        middle = ends.sum(axis=1) / np.linalg.norm(ends.sum(axis=1), axis=1, keepdims=True)
        ahead = np.cross(normal, middle)
        a, b = camera.project(middle - 5e-4 * ahead), camera.project(middle + 5e-4 * ahead)
        length_px = 1e3 * np.linalg.norm(b - a, axis=1) * angle
        counts = np.maximum(np.nan_to_num(length_px), 2.0).round().astype(int)
        arc = np.repeat(np.arange(len(ends)), counts)
        share = np.concatenate([(np.arange(n) + 0.5) / n for n in counts]) if len(ends) else np.zeros(0)
        turn = share * angle[arc]
        bearing = np.cos(turn)[:, None] * ends[arc, 0] + np.sin(turn)[:, None] * along[arc]
        pixel = camera.project(bearing)
        px_per_rad = 1e3 * np.linalg.norm(camera.project(bearing + 1e-3 * normal[arc]) - pixel, axis=1)
        return cls(normal, ends, length_px, bearing, pixel, px_per_rad, arc)

    def under(self, other: Arcs) -> np.ndarray:
        """(samples of other, arcs): whether each sample lies on each of these arcs."""
        near = np.abs(other.bearing @ self.normal.T) * other.px_per_rad[:, None] < NEAR_PX
        along = np.cross(self.normal, self.ends[:, 0]), np.cross(self.normal, self.ends[:, 1])
        slack = NEAR_PX / other.px_per_rad[:, None]
        near &= (other.bearing @ along[0].T > -slack) & (other.bearing @ along[1].T < slack)
        return near & (np.abs(other.normal[other.arc] @ self.normal.T) > NEAR_COS)


@dataclass
class Score:
    """What one detector reached with one camera."""

    true_px: float = 0.0
    covered_px: float = 0.0
    found_px: float = 0.0
    astray_px: float = 0.0
    stepless_px: float = 0.0
    angles_deg: list[float] = field(default_factory=list)
    places_px: list[float] = field(default_factory=list)
    ends_px: list[float] = field(default_factory=list)
    squares: list[np.ndarray] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    times_s: list[float] = field(default_factory=list)


def by_lsd(camera: Camera, found: np.ndarray | None, least_px: float) -> np.ndarray:
    """(N, 2, 3) bearings of the ends of LSD's segments."""
    lines = np.zeros((0, 2, 2)) if found is None else np.asarray(found, dtype=np.float64).reshape(-1, 2, 2)
    lines = lines[np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1) >= least_px]
    ends = camera.unproject(lines.reshape(-1, 2) + LSD_SHIFT_PX).reshape(-1, 2, 3)
    known = np.isfinite(ends).all(axis=(1, 2))
    known[known] = np.linalg.norm(np.cross(ends[known, 0], ends[known, 1]), axis=1) > 1e-9
    return ends[known]


def steps(clean: np.ndarray, camera: Camera, found: Arcs) -> np.ndarray:
    """(samples,): the step of grey levels across each sample of what is found, in the picture without noise."""
    across = found.normal[found.arc] / found.px_per_rad[:, None]
    levels = []
    for side in (-2.0, -1.0, 1.0, 2.0):
        places = camera.project(found.bearing + side * across).astype(np.float32)
        # OpenCV looks up fewer than 2^15 places at once.
        parts = [
            cv2.remap(clean, *part.T, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).ravel()
            for part in np.array_split(places, 1 + len(places) // 30_000)
        ]
        levels.append(np.concatenate(parts).astype(float))
    below, above = np.minimum(levels[0], levels[1]), np.minimum(levels[2], levels[3])
    top_below, top_above = np.maximum(levels[0], levels[1]), np.maximum(levels[2], levels[3])
    return np.maximum(top_above - below, top_below - above)


def judge(
    score: Score, truth: Arcs, found: Arcs, clean: np.ndarray, camera: Camera, variances: np.ndarray | None
) -> None:
    """Adds what was found in one picture."""
    score.counts.append(len(found.normal))
    asked = (truth.length_px >= TRUE_MIN_PX)[truth.arc]
    score.true_px += asked.sum()
    score.covered_px += found.under(truth)[asked].any(axis=1).sum()
    on_true = truth.under(found)
    score.found_px += len(found.arc)
    score.astray_px += (~on_true.any(axis=1)).sum()
    score.stepless_px += (steps(clean, camera, found) < STEP).sum()
    # Each segment belongs to the true edge that most of it lies on, if that is more than half.
    votes = np.zeros((len(found.normal), len(truth.normal)))
    np.add.at(votes, found.arc, on_true)
    totals = np.bincount(found.arc, minlength=len(found.normal))
    best = votes.argmax(axis=1)
    longest: dict[int, tuple[int, int]] = {}
    for i in np.flatnonzero(votes.max(axis=1) > 0.5 * totals):
        true = truth.normal[best[i]] * np.sign(truth.normal[best[i]] @ found.normal[i])
        middle = found.ends[i].sum(axis=0) / np.linalg.norm(found.ends[i].sum(axis=0))
        along = np.cross(found.normal[i], middle)
        away = np.array([true @ middle, true @ along])
        score.angles_deg.append(math.degrees(math.hypot(*away)))
        score.places_px.append(away[0] * np.median(found.px_per_rad[found.arc == i]))
        # Of two true edges side by side it could be either.
        if variances is not None and (votes[i] > 0.5 * totals[i]).sum() == 1:
            score.squares.append(away**2 / variances[i])
        longest[best[i]] = max(longest.get(best[i], (0, 0)), (totals[i], i))
    for edge, (_, i) in longest.items():
        if truth.length_px[edge] >= TRUE_MIN_PX:
            pixels = camera.project(np.concatenate([truth.ends[edge], found.ends[i]]))
            apart = np.linalg.norm(pixels[:2, None] - pixels[None, 2:], axis=2)
            score.ends_px += list(apart.min(axis=1))


def seconds(work: Callable[[], object], rounds: int) -> float:
    """The fastest of some calls."""
    return min(times_s(work, rounds))


def scene(camera: Camera, mounting: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A picture with noise, the same without and with finer rays, and the true ends."""
    room = Room(ROOM_KINDS[seed % len(ROOM_KINDS)], seed)
    view = {
        "pose": room.free_poses(1, seed)[0],
        "alpha_rad": 0.05,
        "beta_rad": float(seed),
        "robot_from_camera": mounting,
    }
    picture = room.render(camera, **view, samples=3, seed=seed).gray
    clean = room.render(camera, **view, samples=4, seed=seed, noise_sigma=0.0).gray
    return picture, clean, room.straight_edges(camera, **view)[0]


def run(name: str, seeds: tuple[int, ...], rounds: int) -> None:
    """Prints the table of one camera."""
    camera, mounting = CAMERAS[name]
    lsd = cv2.createLineSegmentDetector()
    own = {
        "tiltvp": SegmentDetector(camera),
        f"tiltvp, {LONGER_MIN_PX} px": SegmentDetector(camera, support_min_px=LONGER_MIN_PX),
    }
    theirs = {"LSD": 0.0, f"LSD, {FOUND_MIN_PX:g} px": FOUND_MIN_PX}
    scores = {title: Score() for title in (*own, *theirs)}
    pairs: list[float] = []
    for seed in seeds:
        picture, clean, ends = scene(camera, mounting, seed)
        truth = Arcs.through(camera, ends)
        for title, detector in own.items():
            found = detector(picture)
            arcs = Arcs.through(camera, found.ends, found.normal)
            judge(scores[title], truth, arcs, clean, camera, found.variances_rad2)
            scores[title].times_s.append(seconds(partial(detector, picture), rounds))
        lines, lsd_s = lsd.detect(picture)[0], seconds(partial(lsd.detect, picture), rounds)
        for title, least_px in theirs.items():
            judge(scores[title], truth, Arcs.through(camera, by_lsd(camera, lines, least_px)), clean, camera, None)
            scores[title].times_s.append(lsd_s)
        pairs.append(
            seconds(
                lambda picture=picture: (cv2.Scharr(picture, cv2.CV_16S, 1, 0), cv2.Scharr(picture, cv2.CV_16S, 0, 1)),
                rounds,
            )
        )
    print(f"\n{name}: {len(seeds)} rooms")
    heads = (
        "found %",
        "astray %",
        "no step %",
        "normal rms deg",
        "median",
        "place rms px",
        "ends median px",
        "edges",
        "ms",
        "x LSD",
        "x Scharr",
        "moved in 90 %",
        "turned in 90 %",
    )
    print(f"{'':16}" + "".join(f"{head:>15}" for head in heads))
    lsd_s, scharr_s = np.array(scores["LSD"].times_s), np.array(pairs)
    for title, score in scores.items():
        times = np.array(score.times_s)
        numbers = (
            100 * score.covered_px / score.true_px, 100 * score.astray_px / score.found_px,
            100 * score.stepless_px / score.found_px, np.sqrt(np.mean(np.square(score.angles_deg))),
            np.median(score.angles_deg), np.sqrt(np.mean(np.square(score.places_px))), np.median(score.ends_px),
            np.mean(score.counts), 1e3 * np.median(times), np.median(times / lsd_s), np.median(times / scharr_s),
            *(100 * np.mean(np.array(score.squares) < CHI2_90, axis=0) if score.squares else (math.nan, math.nan)),
        )  # fmt: skip
        print(f"{title:16}" + "".join(f"{number:15.2f}" for number in numbers))


def draw(path: Path, seed: int) -> None:
    """LSD on the left, ours on the right, a row for each camera."""
    rows = []
    for camera, mounting in CAMERAS.values():
        picture, _, _ = scene(camera, mounting, seed)
        lines = cv2.createLineSegmentDetector().detect(picture)[0].reshape(-1, 2, 2)
        left = cv2.cvtColor((picture * 0.6).astype(np.uint8), cv2.COLOR_GRAY2BGR)
        longest = np.argsort(-np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1))
        for i, line in enumerate(lines[longest]):
            cv2.polylines(left, [np.rint(16 * line).astype(np.int32)], False, track_colour(i), 1, cv2.LINE_AA, shift=4)
        right = draw_segments(picture, camera, SegmentDetector(camera)(picture))
        both = np.hstack([left, right])
        rows.append(cv2.resize(both, (960, round(960 * both.shape[0] / both.shape[1])), interpolation=cv2.INTER_AREA))
    write_image(path, np.vstack(rows))


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rooms", type=int, default=len(SEEDS))
    parser.add_argument("--seed", type=int, default=SEEDS[0], help="of the first room")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--picture", type=Path, help="write the edges of one room by both")
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    for name in CAMERAS:
        run(name, tuple(range(arguments.seed, arguments.seed + arguments.rooms)), arguments.rounds)
    if arguments.picture is not None:
        draw(arguments.picture, SEEDS[2])


if __name__ == "__main__":
    main()
