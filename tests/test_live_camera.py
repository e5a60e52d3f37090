"""Live cameras: their images with times, cameras that are unplugged, and an end that nobody waits for."""

from __future__ import annotations

import os
import re
import signal
import threading
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

import tiltvp
from commands import Run
from tiltvp.cli.sources import ending_at_interrupt
from tiltvp.errors import ImageFileError, InvalidInputError
from tiltvp.streams import LiveCamera
from tiltvp.synth import RoomImage


class Capture:
    """A camera that gives three images."""

    def __init__(self, number: int) -> None:
        self.left = 3 if number == 0 else 0

    def isOpened(self) -> bool:  # noqa: N802
        return self.left > 0

    def get(self, _: int) -> float:
        return 0.0

    def read(self) -> tuple[bool, np.ndarray | None]:
        self.left -= 1
        return (True, np.full((48, 64, 3), self.left, np.uint8)) if self.left >= 0 else (False, None)

    def release(self) -> None:
        self.left = -1


def test_a_live_camera(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "VideoCapture", Capture)
    frames = LiveCamera(0, patience_s=0.0)
    *seen, gone = list(frames)
    assert (len(seen), frames.count, frames.rate_hz) == (3, None, 25.0)
    assert seen[0].time_s <= seen[1].time_s <= seen[2].time_s <= gone.time_s
    assert re.fullmatch(
        r"camera 0#000003: the camera gave no image for 0\.0 s, it is waited for no longer", str(gone.image)
    )
    with pytest.raises(InvalidInputError, match="read only once"):
        next(frames.sample([0]))
    with pytest.raises(ImageFileError, match="camera 5: cannot be opened"):
        LiveCamera(5)


@pytest.mark.parametrize("number", [-1, 100, 10**12, "0"])
def test_what_is_no_number_of_a_camera_is_refused(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "VideoCapture", Capture)  # At -1 the real one ends the process.
    with pytest.raises(InvalidInputError, match=r"number = .*, expected the number of a camera, from 0 to 99"):
        LiveCamera(number)


def test_a_camera_that_is_not_there_is_told_by_one_sentence(capfd: pytest.CaptureFixture[str]) -> None:
    """OpenCV printed two lines of its own, and while a camera was waited for ten a second."""
    before = cv2.utils.logging.getLogLevel()
    with pytest.raises(ImageFileError, match="camera 97: cannot be opened"):
        LiveCamera(97)
    assert capfd.readouterr() == ("", "")
    assert cv2.utils.logging.getLogLevel() == before


def test_a_camera_unplugged_and_plugged_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tiltvp.streams.live._AGAIN_S", 0.01)
    opened: list[int] = []

    def plugged(number: int) -> Capture:
        # Three times in five there is no camera.
        opened.append(number)
        return Capture(0 if len(opened) % 5 in (1, 0) else 1)

    monkeypatch.setattr(cv2, "VideoCapture", plugged)
    frames = LiveCamera(4)
    seen = []
    for frame in frames:
        seen.append(frame)
        if len(seen) == 9:
            frames.end()
    # Three images, the gap, three images of the camera that was opened again, and so on.
    assert [isinstance(frame.image, ImageFileError) for frame in seen] == [k % 4 == 3 for k in range(9)]
    assert [frame.name for frame in seen] == [f"camera 4#{k:06d}" for k in range(9)]
    assert "s, it was opened again" in str(seen[3].image)
    assert set(opened) == {4}


def test_an_image_that_was_read_when_the_interrupt_came_is_a_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tiltvp.streams.live._AGAIN_S", 0.01)
    opened: list[int] = []

    class Interrupted(Capture):
        def read(self) -> tuple[bool, np.ndarray | None]:
            if len(opened) == 2 and self.left == 3:
                os.kill(os.getpid(), signal.SIGINT)
            return super().read()

    def plugged(number: int) -> Capture:
        opened.append(number)
        return Interrupted(number)

    monkeypatch.setattr(cv2, "VideoCapture", plugged)
    with ending_at_interrupt(LiveCamera(0)) as frames:
        seen = [frame.image for frame in frames]
    # Three images, the gap, and the image that ended it.
    assert [isinstance(image, ImageFileError) for image in seen] == [False, False, False, True, False]


def test_nobody_waits_for_a_camera_after_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "VideoCapture", lambda _: Capture(0 if not opened else 1))
    opened: list[int] = []
    frames = LiveCamera(0)
    opened.append(1)
    threading.Timer(0.3, frames.end).start()
    start_s = time.monotonic()
    seen = list(frames)
    assert time.monotonic() - start_s < 5.0
    assert str(seen[3].image).endswith("nobody waits for it")
    assert len(seen) == 4


def test_the_window_is_closed_while_a_camera_that_has_gone_is_waited_for(
    run: Run, camera: tiltvp.Camera, room: RoomImage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was frozen for a minute."""

    class Gone:
        def __init__(self, _: int) -> None:
            self.left = 0 if asked else 2

        def isOpened(self) -> bool:  # noqa: N802
            return self.left > 0

        def get(self, _: int) -> float:
            return 0.0

        def read(self) -> tuple[bool, np.ndarray | None]:
            self.left -= 1
            return (True, room.bgr) if self.left >= 0 else (False, None)

        def release(self) -> None:
            asked.append(0)

    class Window:
        is_open = True

        def attend(self) -> bool:
            asked.append(1)
            self.is_open = sum(asked) < 3
            return self.is_open

        __init__ = close = show = lambda self, *_: None

    asked: list[int] = []
    camera.save(tmp_path / "camera.toml")
    monkeypatch.setattr(cv2, "VideoCapture", Gone)
    monkeypatch.setattr("tiltvp.cli.window.Window", Window)
    start_s = time.monotonic()
    code, said, complaints = run("tilt", "--live", "0", "--camera", tmp_path / "camera.toml", "--show")
    assert time.monotonic() - start_s < 30.0
    assert (code, said.splitlines()[0][:9], sum(asked)) == (1, "3 images:", 3)
    assert "nobody waits for it" in complaints
