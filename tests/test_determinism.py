"""The same question has the same answer, to the last bit: again, elsewhere, after others, with other vectors."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import tiltvp
from tiltvp._core import SIMD_LEVELS
from tiltvp.synth import RoomImage, render_room


@pytest.mark.parametrize("method", tiltvp.METHODS)
def test_repeated_calls(camera: tiltvp.Camera, room: RoomImage, images: list[np.ndarray], method: str) -> None:
    estimator = tiltvp.TiltEstimator(camera, method=method)
    first = estimator(room.gray)
    for image in images:
        estimator(image)
    assert estimator(room.gray) == first
    assert tiltvp.TiltEstimator(camera, method=method)(room.gray) == first
    assert pickle.dumps(estimator(room.gray)) == pickle.dumps(first)


@pytest.mark.parametrize("method", ["image-space-ransac", "vector-consensus"])
def test_seeds(camera: tiltvp.Camera, room: RoomImage, method: str) -> None:
    answers = [tiltvp.TiltEstimator(camera, method=method, seed=seed)(room.gray) for seed in (0, 1, 2, 3, 0)]
    assert answers[0] == answers[4]
    assert len(set(answers)) > 1


@pytest.mark.parametrize("level", SIMD_LEVELS)
def test_another_process_with_any_vectors(tmp_path: Path, camera: tiltvp.Camera, room: RoomImage, level: str) -> None:
    askers: list[Callable[[np.ndarray], object]] = [
        *(tiltvp.TiltEstimator(camera, method=method) for method in tiltvp.METHODS),
        tiltvp.TiltEstimator(camera, method="refined", smoothing_px=0.0, gradient_min=300.0),
        tiltvp.TiltEstimator(camera, method="vector-consensus", normal="gradient", threshold_rad=0.05),
        tiltvp.SegmentDetector(camera),
    ]
    question, answer = tmp_path / "question", tmp_path / "answer"
    question.write_bytes(pickle.dumps((askers, room.gray)))
    script = (
        "import pickle, pathlib, sys, tiltvp\n"
        "askers, image = pickle.loads(pathlib.Path(sys.argv[1]).read_bytes())\n"
        "answers = tiltvp.simd_level(), [asker(image) for asker in askers]\n"
        "pathlib.Path(sys.argv[2]).write_bytes(pickle.dumps(answers))\n"
    )
    environment = {**os.environ, "TILTVP_SIMD": level}
    command = [sys.executable, "-c", script, str(question), str(answer)]
    subprocess.run(command, check=True, timeout=120, env=environment)
    used, answers = pickle.loads(answer.read_bytes())
    assert used == level
    assert answers == [asker(room.gray) for asker in askers]


def test_vectors_that_the_machine_has_not_got() -> None:
    assert tiltvp.simd_level() in SIMD_LEVELS
    assert SIMD_LEVELS[0] == "fallback"
    environment = {**os.environ, "TILTVP_SIMD": "mmx"}
    command = [sys.executable, "-c", "import tiltvp"]
    outcome = subprocess.run(command, capture_output=True, text=True, timeout=120, env=environment)
    assert outcome.returncode == 1
    expected = f'InvalidInputError: option TILTVP_SIMD = "mmx", expected one of {", ".join(SIMD_LEVELS)} (what this'
    assert expected in outcome.stderr


@pytest.mark.slow
def test_rooms() -> None:
    small = tiltvp.Camera.equidistant(width=60, height=50, focal_px=17.0, cx=29.5, cy=24.5)
    one, same = (render_room(small, kind="office", seed=4, alpha_rad=0.05, samples=1) for _ in range(2))
    assert np.array_equal(one.gray, same.gray)
    assert np.array_equal(one.bgr, same.bgr)
