"""The tilt methods against OpenCV's pair of Scharr derivatives of the same box, in one process on one thread.

Prints, for each method, the median time and the median of the ratio to the `cv2.Scharr` pair timed right before it.
Images are rendered rooms, or with `--panoramas DIR` views of upright panoramas.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import cv2
import numpy as np

from tiltvp import METHODS, TiltEstimator, normal_from_alpha_beta
from tiltvp.lab.datasets.panoramas import TABLE_1_TILTS_DEG, PanoramaViews, paper_camera, read_panorama_index
from tiltvp.synth import ROOM_KINDS, render_room

VARIANTS = [(method, {}) for method in METHODS] + [
    ("vector-consensus", {"gradient_min": 300.0, "threshold_rad": float(np.deg2rad(2.0))}),
    ("vector-consensus", {"gradient_min": 300.0, "threshold_rad": float(np.deg2rad(2.0)), "normal": "tangent"}),
    ("refined", {"smoothing_px": 0.0}),
    *((method, {"row_stride": 2}) for method in METHODS),
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


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--panoramas", help="folder with an INDEX.csv of upright panoramas")
    parser.add_argument("--images", type=int, default=12)
    parser.add_argument("--rounds", type=int, default=30)
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    camera = paper_camera()
    estimators = [(method, options, TiltEstimator(camera, method=method, **options)) for method, options in VARIANTS]
    # The box of the pixels above the horizon: 439 pixels in diameter.
    boxes = [
        (image, np.ascontiguousarray(image[20:460, 100:540])) for image in images(arguments.panoramas, arguments.images)
    ]
    ratios: dict[int, list[float]] = {i: [] for i in range(len(estimators))}
    times: dict[int, list[float]] = {i: [] for i in range(len(estimators))}
    scharr: list[float] = []
    # One method after the other, as a robot would run it: tables stay in the caches that they fit into.
    for i, (_, _, estimator) in enumerate(estimators):
        for _ in range(arguments.rounds):
            for image, box in boxes:
                pair = seconds(lambda box=box: (cv2.Scharr(box, cv2.CV_16S, 1, 0), cv2.Scharr(box, cv2.CV_16S, 0, 1)))
                own = seconds(lambda image=image, estimator=estimator: estimator(image))
                scharr.append(pair)
                times[i].append(own)
                ratios[i].append(own / pair)
    print(f"cv2.Scharr pair on 440 x 440: median {1e6 * np.median(scharr):.0f} us")
    for i, (method, options, _) in enumerate(estimators):
        words = ", ".join(
            f"{key}={value:.3g}" if isinstance(value, float) else f"{key}={value}" for key, value in options.items()
        )
        print(f"{np.median(ratios[i]):6.2f} x  {1e6 * np.median(times[i]):6.0f} us  {method} {words}")


if __name__ == "__main__":
    main()
