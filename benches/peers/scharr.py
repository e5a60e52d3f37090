"""The tilt methods against OpenCV's pair of Scharr derivatives of the same box, on one thread, by level of vectors.

Prints, for each method and each level that the machine has, the ratio to the `cv2.Scharr` pair timed right before it:
of the fastest times of each image, which other work on the machine hardly alters, and in brackets the median of all. A
level has a process of its own; OpenCV chooses its own vectors in each. Images are rendered rooms, or with
`--panoramas DIR` views of upright panoramas.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable

import cv2
import numpy as np

from tiltvp import METHODS, TiltEstimator, normal_from_alpha_beta
from tiltvp._core import SIMD_LEVELS
from tiltvp.lab.datasets.panoramas import TABLE_1_TILTS_DEG, PanoramaViews, paper_camera, read_panorama_index
from tiltvp.synth import ROOM_KINDS, render_room

VARIANTS = [(method, {}) for method in METHODS] + [
    ("vector-consensus", {"gradient_min": 300.0, "threshold_rad": float(np.deg2rad(2.0))}),
    ("vector-consensus", {"gradient_min": 300.0, "threshold_rad": float(np.deg2rad(2.0)), "normal": "tangent"}),
    ("refined", {"smoothing_px": 0.0}),
    *((method, {"row_stride": 2}) for method in METHODS if method != "segments"),
]


def seconds(work: Callable[[], object]) -> float:
    """How long one call takes."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def images(panoramas: str | None, count: int) -> list[np.ndarray]:
    """`count` images with the leans of the paper's table 1 in turn."""
    camera = paper_camera()
    tilts = np.deg2rad(TABLE_1_TILTS_DEG)
    if panoramas is None:
        return [
            render_room(
                camera, kind=ROOM_KINDS[i % len(ROOM_KINDS)], seed=i, alpha_rad=float(a), beta_rad=float(b), samples=2
            ).gray
            for i, (a, b) in zip(range(count), np.tile(tilts, (count, 1)), strict=False)
        ]
    index = read_panorama_index(panoramas)
    chosen = [index[i] for i in np.linspace(0, len(index) - 1, count).astype(int)]
    return [
        PanoramaViews(panorama, camera).render(normal_from_alpha_beta(*tilts[i % len(tilts)]), seed=i)
        for i, panorama in enumerate(chosen)
    ]


def measured(panoramas: str | None, count: int, rounds: int) -> list[list[list[float]]]:
    """Seconds of the pair and of each variant, [variant, image, round, (pair, own)], by the vectors of this process."""
    cv2.setNumThreads(1)
    camera = paper_camera()
    # The box of the pixels above the horizon: 439 pixels in diameter.
    boxes = [(image, np.ascontiguousarray(image[20:460, 100:540])) for image in images(panoramas, count)]
    out = np.empty((len(VARIANTS), len(boxes), rounds, 2))
    # One method after the other, as a robot would run it: tables stay in the caches that they fit into.
    for i, (method, options) in enumerate(VARIANTS):
        estimator = TiltEstimator(camera, method=method, **options)
        for j in range(rounds):
            for k, (image, box) in enumerate(boxes):
                pair = seconds(lambda box=box: (cv2.Scharr(box, cv2.CV_16S, 1, 0), cv2.Scharr(box, cv2.CV_16S, 0, 1)))
                out[i, k, j] = pair, seconds(lambda image=image, estimator=estimator: estimator(image))
    return out.tolist()


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--panoramas", help="folder with an INDEX.csv of upright panoramas")
    parser.add_argument("--images", type=int, default=12)
    parser.add_argument("--rounds", type=int, default=30)
    parser.add_argument("--levels", nargs="+", choices=SIMD_LEVELS, default=SIMD_LEVELS)
    parser.add_argument("--json", action="store_true", help="the times of this process alone")
    arguments = parser.parse_args()
    if arguments.json:
        print(json.dumps(measured(arguments.panoramas, arguments.images, arguments.rounds)))
        return
    times = {}
    for level in arguments.levels:
        command = [sys.executable, __file__, "--json", *sys.argv[1:]]
        environment = {**os.environ, "TILTVP_SIMD": level}
        run = subprocess.run(command, check=True, stdout=subprocess.PIPE, env=environment)
        times[level] = np.array(json.loads(run.stdout))
    pairs = np.array([times[level][..., 0].min(2).mean() for level in times])
    print(f"cv2.Scharr pair on 440 x 440: fastest {1e6 * pairs.min():.0f} us; load {os.getloadavg()[0]:.1f}")
    print("".join(f"{level:>15}" for level in times))
    for i, (method, options) in enumerate(VARIANTS):
        cells = []
        for level in times:
            pair, own = np.moveaxis(times[level][i], 2, 0)
            fastest = own.min(1).sum() / pair.min(1).sum()
            cells.append(f"{fastest:8.2f} ({np.median(own / pair):.2f})")
        words = ", ".join(
            f"{key}={value:.3g}" if isinstance(value, float) else f"{key}={value}" for key, value in options.items()
        )
        print("".join(f"{cell:>15}" for cell in cells), f" {method} {words}")


if __name__ == "__main__":
    main()
