"""The images of a dataset, one by one through an evaluation: here or in a worker of a cluster."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import TYPE_CHECKING

from tiltvp.lab.evaluation.combinations import Combination
from tiltvp.lab.evaluation.runner import ImageRunner, View

if TYPE_CHECKING:
    import polars as pl

    from tiltvp.lab.datasets.folder import TiltDataset

__all__ = ["evaluate_images", "runner_of"]


def runner_of(dataset: TiltDataset, combinations: Sequence[Combination], seed: int) -> ImageRunner:
    """The estimators for the camera of a dataset."""
    return ImageRunner(
        dataset.camera, combinations, robot_from_camera=dataset.robot_from_camera, mask=dataset.mask, seed=seed
    )


def _view_of(dataset: TiltDataset, number: int) -> View:
    """What a dataset knows of one of its images."""
    image = dataset.images[number]
    return View(number, image.file, image.location, image.environment, image.alpha_rad, image.beta_rad, image.yaw_rad)


def evaluate_images(
    dataset: TiltDataset, runner: ImageRunner, numbers: Sequence[int], threads: int = 1
) -> Iterator[tuple[int, pl.DataFrame]]:
    """The rows of these images as they come, with their numbers; the fits of `threads` images run at the same time."""

    def one(number: int) -> tuple[int, pl.DataFrame]:
        return number, runner(dataset.read(dataset.images[number]), _view_of(dataset, number))

    if threads == 1:
        yield from map(one, numbers)
        return
    pool = ThreadPoolExecutor(threads)
    try:
        for future in as_completed([pool.submit(one, number) for number in numbers]):
            yield future.result()
    finally:
        pool.shutdown(cancel_futures=True)
