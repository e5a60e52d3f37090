"""The box of tea by ViSP's model-based tracker and by our corners, on the same pairs of images.

ViSP (Debian's libvisp-mbt-dev; the recipe `measure-visp` compiles `visp_tracker.cpp`) knows the box: its edges are
those of the model that comes with the images. It begins with our first pose of which all three edges are seen, and
follows by moving edges in both images. We know nothing of the box. Nobody knows the truth: printed are how far both
move between neighbouring pairs, how far they are apart after one constant turn and shift for each of our corners, and
the median time of the processor for a pair, ours with the decoding of its images.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from tiltvp.corner import CornerEstimate
from tiltvp.images import gray_from
from tiltvp.lab.evaluation.corners_real import TEA_BOX_MM, TeaBox, steps, tea_box, tea_box_rig
from tiltvp.streams import open_frames

Matrix = NDArray[np.float64]
LONG_M = 1e-3 * TEA_BOX_MM["long"]


def model_pose(estimate: CornerEstimate) -> Matrix | None:
    """(4, 4): the model in the left camera. Its corner has its long side along x, its depth along y, and hangs down."""
    if estimate.pose is None or estimate.pose.vertex_m is None or not np.isfinite(estimate.edge_ends_m).all():
        return None
    vertex = estimate.pose.vertex_m
    x, upright, z = estimate.edge_ends_m - vertex
    long, depth = sorted([x, z], key=lambda edge: -float(np.linalg.norm(edge)))
    # A box looks the same from its other long side, so that right-handed axes are always to be had.
    axes = np.stack([long, depth, -upright], axis=1)
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
        vertex = vertex + LONG_M * long / np.linalg.norm(long)
    pose = np.eye(4)
    pose[:3, :3] = nearest_rotation(axes / np.linalg.norm(axes, axis=0))
    pose[:3, 3] = vertex
    return pose


def nearest_rotation(matrix: Matrix) -> Matrix:
    """Of a sum or a product of rotations that are nearly the same."""
    u, _, v = np.linalg.svd(matrix)
    turn: Matrix = u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v
    return turn


def turn_deg(a: Matrix, b: Matrix) -> float:
    """Between two rotations."""
    return float(np.degrees(2.0 * np.arcsin(min(1.0, float(np.linalg.norm(a - b)) / np.sqrt(8.0)))))


def followed(tracker: Path, folder: Path, start: Matrix, first: int) -> tuple[Matrix, Matrix]:
    """ViSP's poses (N, 4, 4) of the model in the left camera, from the first pair on, and the milliseconds of each."""
    with tempfile.TemporaryDirectory() as scratch:
        names = []
        for side in ("left", "right"):
            names.append([])
            for number, frame in enumerate(open_frames(folder / f"teabox_{side}.mp4")):
                names[-1].append(f"{scratch}/{side}{number:04}.pgm")
                cv2.imwrite(names[-1][-1], gray_from(frame.read()))
        pairs, begin, rig, out = (Path(scratch, name) for name in ("pairs.txt", "start.txt", "rig.txt", "out.txt"))
        pairs.write_text("".join(f"{left} {right}\n" for left, right in list(zip(*names, strict=True))[first:]))
        np.savetxt(begin, start, fmt="%.17g")
        # As in ViSP's file, whose rotation has ten digits.
        np.savetxt(rig, np.linalg.inv(tea_box_rig(folder).left_from_right), fmt="%.17g")
        models = (folder / f"teabox_left.{ending}" for ending in ("cao", "xml"))
        command = [tracker, *models, folder / "teabox_right.xml", rig, begin, pairs, out]
        # It prints its settings.
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        rows = np.loadtxt(out, ndmin=2)
    return rows[:, :16].reshape(-1, 4, 4), rows[:, 16]


def apart(ours: TeaBox, theirs: Matrix, first: int) -> tuple[Matrix, Matrix]:
    """Millimetres and degrees between both in each pair, after what is constant for each of our corners."""
    mm, degrees = [], []
    for name in np.unique(ours.objects):
        chosen = (ours.objects == name) & (ours.places >= first) & (ours.places < first + len(theirs))
        poses = theirs[ours.places[chosen] - first]
        # The vertex in the model, and the turn from our edges to the model's.
        vertices = np.einsum("nji,nj->ni", poses[:, :3, :3], ours.vertex_m[chosen] - poses[:, :3, 3])
        turns = np.einsum("nji,njk->nik", poses[:, :3, :3], ours.attitudes[chosen])
        mean = nearest_rotation(turns.sum(axis=0))
        mm += (1e3 * np.linalg.norm(vertices - np.median(vertices, axis=0), axis=1)).tolist()
        degrees += [turn_deg(turn, mean) for turn in turns]
    return np.array(mm), np.array(degrees)


def main() -> None:
    """Prints what both make of the box."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="ViSP's images of the box, visp_teabox_stereo")
    parser.add_argument("tracker", type=Path, help="the program that visp_tracker.cpp becomes")
    given = parser.parse_args()
    starts, times = [], [time.process_time()]

    def look(place: int, _: NDArray[np.uint8], estimate: CornerEstimate) -> None:
        pose = model_pose(estimate)
        starts.extend([] if pose is None else [(place, pose)])

    ours = tea_box(given.folder, show=look, advance=lambda: times.append(time.process_time()))
    first, start = starts[0]
    poses, took = followed(given.tracker, given.folder, start, first)
    # ViSP's pose as that of a corner: its origin, in the pairs in which ours have a pose of the same corner.
    chosen = (ours.places >= first) & (ours.places < first + len(poses))
    at = poses[ours.places[chosen] - first]
    theirs = TeaBox(
        ours.frames, ours.places[chosen], ours.objects[chosen], at[:, :3, 3], at[:, :3, :3],
        ours.angles_deg[chosen], {},
    )  # fmt: skip
    print(f"{ours.frames} pairs of {tea_box_rig(given.folder).left.width} columns; ViSP from pair {first} on")
    print(f"{'median, 95 %':28}{'pairs':>8}{'mm':>14}{'degrees':>14}{'ms':>8}")
    rows = [
        ("corners, from pair to pair", len(ours.places), *steps(ours), 1e3 * np.diff(times)),
        ("ViSP, in the same pairs", int(chosen.sum()), *steps(theirs), took),
        ("both apart", int(chosen.sum()), *apart(ours, poses, first), None),
    ]
    for name, count, mm, degrees, ms in rows:
        both = [f"{np.median(each):.2f}, {np.percentile(each, 95):.2f}" for each in (mm, degrees)]
        print(f"{name:28}{count:8}{both[0]:>14}{both[1]:>14}" + ("" if ms is None else f"{np.median(ms):8.1f}"))


if __name__ == "__main__":
    main()
