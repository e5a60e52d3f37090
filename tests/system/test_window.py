"""The window of `--show` on a real screen, that of Xvfb."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tiltvp.cli.window import Window


@pytest.fixture
def screen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A screen of 1366 x 768 pixels, and the file that it is in."""
    program = shutil.which("Xvfb")
    assert program, "no Xvfb: `just test-system` installs it"
    reading, writing = os.pipe()
    words = [program, "-displayfd", str(writing), "-screen", "0", "1366x768x24", "-fbdir", str(tmp_path)]
    server = subprocess.Popen(words, pass_fds=[writing], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        os.close(writing)
        with os.fdopen(reading) as said:
            monkeypatch.setenv("DISPLAY", f":{said.readline().strip()}")
        yield tmp_path / "Xvfb_screen0"
    finally:
        server.terminate()
        server.wait()


def pixels_of(screen: Path) -> np.ndarray:
    """(H, W, 3) BGR of a screen in the format of xwd."""
    data = screen.read_bytes()
    words = struct.unpack(">25I", data[:100])
    begin, width, height, row, colours = words[0], words[4], words[5], words[12], words[19]
    return np.frombuffer(data, np.uint8, offset=begin + 12 * colours, count=row * height).reshape(height, -1, 4)[
        :, :width, :3
    ]


def test_pictures_are_seen_until_escape(screen: Path) -> None:
    window = Window("test")
    for shade in (40, 200):
        picture = np.zeros((300, 400, 3), np.uint8)
        picture[:] = (shade, 120, 7)
        until = time.monotonic() + 20.0
        while (pixels_of(screen) == picture[0, 0]).all(axis=2).sum() != 300 * 400:
            assert time.monotonic() < until, "the picture is not on the screen"
            window.show(picture)
    assert window.attend()
    window._root.focus_force()
    window._root.update()
    window._root.event_generate("<Escape>")
    assert not window.is_open
    window.show(picture)
    assert not window.attend()
