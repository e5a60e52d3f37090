"""Many threads: the same bytes for any number of them, one estimator called by many, and the interpreter set free."""

from __future__ import annotations

import os
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import tiltvp
from tiltvp.errors import InvalidInputError
from tiltvp.synth import Room


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_any_number_of_threads_has_the_same_answers(
    camera: tiltvp.Camera, images: list[np.ndarray], method: str
) -> None:
    estimator = tiltvp.TiltEstimator(camera, method=method)
    expected = [estimator(image) for image in images]
    assert not expected[4]
    for threads in (1, 2, 4, 50):
        assert estimator.estimate_many(images, threads=threads) == expected
    assert estimator.estimate_many(iter(images), threads=2) == expected


@pytest.mark.parametrize("threads", [0, -1, 1.5, "two"])
def test_impossible_numbers_of_threads_are_refused(camera: tiltvp.Camera, threads: object) -> None:
    with pytest.raises(InvalidInputError, match="threads"):
        tiltvp.TiltEstimator(camera).estimate_many([], threads=threads)  # type: ignore[arg-type]


@pytest.mark.skipif(sys.platform != "linux", reason="/proc")
def test_threads_beyond_use_are_not_started() -> None:
    """A room on 1,000 threads of two cores took 27 s for 4, and on 10,000 it could not be interrupted."""
    making = threading.Thread(target=Room, args=("office", 1), kwargs={"extent": 2.0, "threads": 400}, daemon=True)
    before, most = len(os.listdir("/proc/self/task")), 0
    making.start()
    while making.is_alive():
        most = max(most, len(os.listdir("/proc/self/task")) - before)
    assert 0 < most < 20 + 4 * (os.cpu_count() or 1)


def test_one_estimator_serves_many_threads(camera: tiltvp.Camera, images: list[np.ndarray]) -> None:
    estimator = tiltvp.TiltEstimator(camera)
    expected = [estimator.with_edges(image) for image in images]
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(estimator.with_edges, images * 12))
    assert answers == expected * 12


def test_threads_may_start_threads(camera: tiltvp.Camera, images: list[np.ndarray]) -> None:
    estimator = tiltvp.TiltEstimator(camera, method="image-space-ransac")
    expected = [estimator(image) for image in images]
    with ThreadPoolExecutor(3) as pool:
        for answers in pool.map(lambda _: estimator.estimate_many(images, threads=2), range(6)):
            assert answers == expected


def test_the_interpreter_is_free_meanwhile(camera: tiltvp.Camera, images: list[np.ndarray]) -> None:
    """Another thread goes on counting while a batch is worked on; were the lock held, it would stand still."""
    estimator = tiltvp.TiltEstimator(camera)
    batch, done, ticks = images * 100, threading.Event(), []

    def count() -> None:
        while not done.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    counter = threading.Thread(target=count)
    counter.start()
    start = time.perf_counter()
    estimator._estimate_many([np.ascontiguousarray(image) for image in batch])
    end = time.perf_counter()
    done.set()
    counter.join()
    assert end - start > 0.02
    assert sum(start < tick < end for tick in ticks) >= 5
