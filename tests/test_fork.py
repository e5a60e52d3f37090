"""A process that has worked may fork: its children work too, and end."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import tiltvp
from tiltvp.synth import Room

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "fork"), reason="this system cannot fork"),
    # Forking beside other threads is what is tried here.
    pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning"),
]

LONGEST_S = 60.0


def in_a_child(work: Callable[[], bool]) -> bool:
    """Whether `work` is true in a forked child that ends in time."""
    child = os.fork()
    if child == 0:
        try:
            os._exit(0 if work() else 3)
        finally:
            os._exit(4)
    end = time.monotonic() + LONGEST_S
    while time.monotonic() < end:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            return os.waitstatus_to_exitcode(status) == 0
        time.sleep(0.01)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    pytest.fail(f"the child did not end within {LONGEST_S:.0f} s")


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_fork_after_use(camera: tiltvp.Camera, images: list[np.ndarray], method: str) -> None:
    estimator = tiltvp.TiltEstimator(camera, method=method)
    expected = estimator(images[0])
    assert in_a_child(lambda: estimator(images[0]) == expected)
    assert in_a_child(lambda: tiltvp.TiltEstimator(camera, method=method)(images[0]) == expected)


def test_fork_after_a_batch(camera: tiltvp.Camera, images: list[np.ndarray]) -> None:
    estimator = tiltvp.TiltEstimator(camera)
    expected = estimator.estimate_many(images, threads=2)
    assert in_a_child(lambda: estimator.estimate_many(images, threads=2) == expected)
    assert in_a_child(lambda: estimator.estimate_many(images, threads=1) == expected)
    assert estimator.estimate_many(images, threads=4) == expected


@pytest.mark.slow
def test_fork_after_a_room(camera: tiltvp.Camera) -> None:
    room = Room("narrow", 1)
    pose = room.free_poses(1, 0)[0]
    expected = room.render(camera, pose=pose, samples=1).gray
    assert in_a_child(lambda: np.array_equal(room.render(camera, pose=pose, samples=1).gray, expected))
    assert in_a_child(lambda: Room("narrow", 1) == room)


def test_a_pool_of_forked_workers(camera: tiltvp.Camera, images: list[np.ndarray]) -> None:
    estimator = tiltvp.TiltEstimator(camera)
    expected = estimator.estimate_many(images, threads=2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with multiprocessing.get_context("fork").Pool(2) as pool:
            assert pool.map_async(estimator, images).get(LONGEST_S) == expected
            assert pool.map_async(estimator.with_edges, images[:1]).get(LONGEST_S)[0][0] == expected[0]


@pytest.mark.skipif(sys.platform == "win32", reason="the same as the default there")
def test_a_pool_of_fresh_workers(camera: tiltvp.Camera, images: list[np.ndarray]) -> None:
    estimator = tiltvp.TiltEstimator(camera)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.map_async(estimator, images[:2]).get(LONGEST_S) == [estimator(image) for image in images[:2]]


def following() -> tuple[Callable[[], object], Callable[[], object]]:
    one = tiltvp.SelfCalibrator(wheel_base_m=0.4)
    odometry = np.full((100, 2), 0.04)
    bearings = np.array([[step, name, 0.1 * name] for step in range(100) for name in range(12)])
    return lambda: one.follow(odometry, bearings), lambda: one.step(0.04, 0.05, [1, 2], [0.1, 0.2])


def filtering() -> tuple[Callable[[], object], Callable[[], object]]:
    one, measured = tiltvp.TiltFilter(), ([0.01, 0.02, 1.0], np.diag([1e-4, 1e-4]))
    return lambda: one.step(measured), lambda: one.step(measured)


def cornering() -> tuple[Callable[[], object], Callable[[], object]]:
    noise = np.random.default_rng(7).integers(0, 255, (240, 320), dtype=np.uint8)
    lens = tiltvp.Camera.equidistant(width=320, height=240, focal_px=70.0, cx=159.5, cy=119.5)
    one = tiltvp.corner.CornerPoseEstimator(lens, method="general")
    return lambda: one(noise), lambda: one(noise)


@pytest.mark.slow
@pytest.mark.parametrize("make", [following, filtering, cornering])
def test_fork_while_another_thread_changes_the_object(make: Callable[[], Any]) -> None:
    """Locks of the thread, which is not in the child, were held there for ever: one of two children never ended."""
    change, use = make()
    done = threading.Event()

    def work() -> None:
        while not done.is_set():
            change()

    worker = threading.Thread(target=work)
    worker.start()
    try:
        for pause in range(8):
            time.sleep(0.003 * pause)
            assert in_a_child(lambda: use() is not None)
    finally:
        done.set()
        worker.join()
