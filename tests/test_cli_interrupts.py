"""Ctrl-C, and what was found till then."""

from __future__ import annotations

import json
import os
import signal
from collections import Counter
from pathlib import Path
from unittest.mock import Mock

import cv2
import numpy as np
import polars as pl
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


@pytest.mark.parametrize("verb", ["tilt", "lines", "segments", "track"])
def test_what_was_found_before_an_interrupt_is_written(
    run: Run, camera: tiltvp.Camera, room: RoomImage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verb: str
) -> None:
    camera.save(tmp_path / "camera.toml")
    for name in "abcd":
        tiltvp.write_image(tmp_path / "images" / f"{name}.png", room.gray)
    reads = Counter[str]()

    def read(path: Path) -> np.ndarray:
        """Somebody presses Ctrl-C during the third image, which `tilt` has looked at before."""
        reads[path.name] += 1
        if reads["c.png"] == (2 if verb == "tilt" else 1):
            raise KeyboardInterrupt
        return tiltvp.read_image(path)

    monkeypatch.setattr("tiltvp.streams.image_files.read_image", read)
    out = tmp_path / "found.csv"
    code, _, complaints = run(verb, tmp_path / "images", "--camera", tmp_path / "camera.toml", "--out", out)
    assert (code, complaints.count("\n")) == (130, 1)
    assert f"{tmp_path / 'images'}: interrupted: what is told and written is of the frames till then" in complaints
    assert [Path(name).name for name in pl.read_csv(out)["file"].unique().sort()] == ["a.png", "b.png"]
    # Nothing is left of one that has done no frame.
    out.unlink()
    monkeypatch.setattr("tiltvp.streams.image_files.read_image", Mock(side_effect=KeyboardInterrupt))
    assert run(verb, tmp_path / "images", "--camera", tmp_path / "camera.toml", "--out", out).code == 130
    assert not out.exists()
