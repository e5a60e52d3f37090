"""How the times of an image and of making its estimator grow with pixels, and what a second thread is worth.

Images are rendered rooms, scaled to each size; the lens is scaled with them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import cv2
import numpy as np
from scharr import images
from timing import times_s

from tiltvp import METHODS, Camera, TiltEstimator

MEGAPIXELS = (0.1, 0.3, 1.0, 3.0, 6.0, 12.0)
BATCH = 301


def scaled_camera(width: int, height: int) -> Camera:
    """The paper's fisheye in an image of another size."""
    scale = width / 640
    return Camera.equidistant(
        width=width,
        height=height,
        focal_px=139.7 * scale,
        cx=320 * scale - 0.5,
        cy=240 * scale - 0.5,
        max_theta_rad=float(np.deg2rad(92.5)),
    )


def fastest(work: Callable[[], object], rounds: int) -> float:
    """The least time of several calls, the first not counted."""
    work()
    return min(times_s(work, rounds))


def size_of(megapixels: float) -> tuple[int, int]:
    """Columns and rows of an image of 4 to 3."""
    height = int(np.sqrt(megapixels * 1e6 * 3 / 4))
    return height * 4 // 3, height


def making(method: str, rounds: int) -> list[float]:
    """Seconds to make an estimator for each number of megapixels, the fastest, on all cores."""
    cameras = [scaled_camera(*size_of(megapixels)) for megapixels in MEGAPIXELS]
    return [
        fastest(lambda camera=camera: TiltEstimator(camera, method=method), max(2, rounds // 4)) for camera in cameras
    ]


def growth(pictures: list[np.ndarray], method: str, rounds: int) -> list[float]:
    """Seconds of an image for each number of megapixels: the mean of each picture's fastest."""
    seconds = []
    for megapixels in MEGAPIXELS:
        width, height = size_of(megapixels)
        estimator = TiltEstimator(scaled_camera(width, height), method=method)
        scaled = [cv2.resize(picture, (width, height), interpolation=cv2.INTER_LINEAR) for picture in pictures]
        seconds.append(
            float(
                np.mean(
                    [fastest(lambda image=image, estimator=estimator: estimator(image), rounds) for image in scaled]
                )
            )
        )
    return seconds


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--images", type=int, default=4)
    parser.add_argument("--rounds", type=int, default=20)
    arguments = parser.parse_args()
    pictures = images(None, arguments.images)
    sizes = " ".join(f"{size:8.1f}" for size in MEGAPIXELS)
    for title, of_method in (
        ("ms of an image by megapixels", lambda method: growth(pictures, method, arguments.rounds)),
        ("ms to make an estimator", lambda method: making(method, arguments.rounds)),
    ):
        print(f"{title:29}{sizes}  exponent")
        for method in METHODS:
            seconds = of_method(method)
            exponent = np.polyfit(np.log(MEGAPIXELS), np.log(seconds), 1)[0]
            print(f"{method:29}" + " ".join(f"{1e3 * value:8.3f}" for value in seconds) + f"  {exponent:8.2f}")
    batch = [pictures[i % len(pictures)] for i in range(BATCH)]
    for method in METHODS:
        estimator = TiltEstimator(scaled_camera(640, 480), method=method)
        one, two = (
            fastest(lambda n=n, estimator=estimator: estimator.estimate_many(batch, threads=n), 5) for n in (1, 2)
        )
        print(f"{method:27}{BATCH} images: {1e3 * one:.1f} ms on one thread, {one / two:.2f} times as fast on two")


if __name__ == "__main__":
    main()
