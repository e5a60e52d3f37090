"""The same question has the same answer, to the last bit: again, in another process, after other questions."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import tiltvp
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


def test_another_process(tmp_path: Path, camera: tiltvp.Camera, room: RoomImage) -> None:
    estimators = [tiltvp.TiltEstimator(camera, method=method) for method in tiltvp.METHODS]
    question, answer = tmp_path / "question", tmp_path / "answer"
    question.write_bytes(pickle.dumps((estimators, room.gray)))
    script = (
        "import pickle, pathlib, sys\n"
        "estimators, image = pickle.loads(pathlib.Path(sys.argv[1]).read_bytes())\n"
        "pathlib.Path(sys.argv[2]).write_bytes(pickle.dumps([estimator(image) for estimator in estimators]))\n"
    )
    subprocess.run([sys.executable, "-c", script, str(question), str(answer)], check=True, timeout=120)
    assert pickle.loads(answer.read_bytes()) == [estimator(room.gray) for estimator in estimators]


@pytest.mark.slow
def test_rooms() -> None:
    small = tiltvp.Camera.equidistant(width=60, height=50, focal_px=17.0, cx=29.5, cy=24.5)
    one, same = (render_room(small, kind="office", seed=4, alpha_rad=0.05, samples=1) for _ in range(2))
    assert np.array_equal(one.gray, same.gray)
    assert np.array_equal(one.bgr, same.bgr)
