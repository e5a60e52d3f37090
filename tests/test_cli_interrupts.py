"""Ctrl-C, and frames that come one by one."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

import tiltvp
from commands import Run
from tiltvp.cli.sources import ending_at_interrupt
from tiltvp.errors import ImageFileError
from tiltvp.streams import Frame, Frames
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


def test_frames_that_are_there_are_decoded_while_one_is_worked_on_and_come_in_order(tmp_path: Path) -> None:
    class Told(Frames):
        source, names = "told", [str(number) for number in range(40)]

        def __iter__(self) -> Iterator[Frame]:
            return (Frame(str(k), None, lambda k=k: self.image(k)) for k in range(40))  # type: ignore[misc]

        def image(self, number: int) -> np.ndarray:
            begun[number].set()
            if number == 7:
                raise ImageFileError("7: broken")
            return np.full((4, 4), number, np.uint8)

    begun = [threading.Event() for _ in range(40)]
    before = threading.active_count()
    with ending_at_interrupt(Told()) as coming:
        for number, frame in enumerate(coming):
            assert frame.name == str(number)
            assert begun[min(number + 1, 39)].wait(10.0)
            # Frames of a long drive do not fill the memory.
            assert not begun[min(number + 20, 39)].is_set() or number > 19
            assert isinstance(frame.image, ImageFileError) if number == 7 else frame.image[0, 0] == number
            if number == 30:
                break
    assert threading.active_count() == before


def test_an_interrupt_before_a_command_begins_is_told_in_a_line(tmp_path: Path) -> None:
    (tmp_path / "cyclopts.py").write_text("raise KeyboardInterrupt")
    words = [sys.executable, "-m", "tiltvp", "--help"]
    path = os.pathsep.join([str(tmp_path), str(Path(tiltvp.__file__).parents[1])])
    done = subprocess.run(
        words, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "tiltvp: interrupted\n")


@pytest.mark.parametrize("words", [("-m", "tiltvp"), ("tiltvp",), ("program.py",), ("-m", "other", "tiltvp")])
def test_an_interrupt_while_the_package_is_imported(words: tuple[str, ...], tmp_path: Path) -> None:
    """The command's is told in a line; a program that uses the package hears of its own."""
    (tmp_path / "numpy").mkdir()
    interrupt = "import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(5)\n"
    (tmp_path / "numpy" / "__init__.py").write_text(interrupt)
    for name in ("tiltvp", "program.py"):
        (tmp_path / name).write_text("import sys\nfrom tiltvp.cli import main\nsys.exit(main())\n")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "__init__.py").write_text("import tiltvp\n")
    path = os.pathsep.join((str(tmp_path), str(Path(tiltvp.__file__).parents[1])))
    done = subprocess.run(
        [sys.executable, *words], cwd=tmp_path, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True
    )
    if words in {("program.py",), ("-m", "other", "tiltvp")}:
        assert "Traceback" in done.stderr
    else:
        assert (done.returncode, done.stdout, done.stderr) == (130, "", "tiltvp: interrupted\n")
