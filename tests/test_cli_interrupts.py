"""Ctrl-C."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import cv2
import numpy as np
import pytest

import tiltvp
from commands import Run
from tiltvp.synth import RoomImage

pytestmark = pytest.mark.slow


def test_a_live_camera_ends_at_an_interrupt(
    run: Run, camera: tiltvp.Camera, room: RoomImage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Capture:
        """Images without end; somebody presses Ctrl-C during the third."""

        count = 0

        def __init__(self, number: int) -> None:
            assert number == 2

        def isOpened(self) -> bool:  # noqa: N802
            return True

        def get(self, _: int) -> float:
            return 30.0

        def read(self) -> tuple[bool, np.ndarray]:
            self.count += 1
            if self.count == 3:
                os.kill(os.getpid(), signal.SIGINT)
            assert self.count < 5
            return True, room.gray

        def release(self) -> None:
            pass

    camera.save(tmp_path / "camera.toml")
    monkeypatch.setattr(cv2, "VideoCapture", Capture)
    before = signal.getsignal(signal.SIGINT)
    code, said, _ = run("tilt", "--live", "2", "--camera", tmp_path / "camera.toml", "--out", "-")
    rows = [json.loads(line) for line in said.splitlines()]
    assert (code, [row["file"] for row in rows]) == (0, [f"camera 2#{k:06d}" for k in range(3)])
    assert rows[0]["taken_s"] < rows[1]["taken_s"] < rows[2]["taken_s"]
    assert signal.getsignal(signal.SIGINT) is before
