"""A camera that is frozen: images that repeat the one before are counted, and left out once the wheels have rolled."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import polars as pl
import pytest

import tiltvp
from commands import Run
from drawn_corners import CAMERA, LEFT_FROM_RIGHT
from tiltvp.cli.repeats import Repeats
from tiltvp.errors import ImageFileError
from tiltvp.stereo_rigs import StereoRig
from tiltvp.streams import Frame, Frames
from tiltvp.synth import RoomImage

LINE = "tiltvp: {}: {} images: the same as the one before to the last byte"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, camera: tiltvp.Camera, room: RoomImage) -> Path:
    """Six images of a quarter turn each, of which the camera gives the third again and again."""
    folder = tmp_path_factory.mktemp("drive")
    camera.save(folder / "camera.toml")
    for k in range(6):
        tiltvp.write_image(folder / "images" / f"{k}.png", np.ascontiguousarray(np.rot90(room.gray, min(k, 2))))
    for name, turn, way in (("drive", 90.0, 0.5), ("stand", 0.0, 0.0)):
        rows = "".join(f"{k}.png,{turn if k else 0},{way}\n" for k in range(6))
        (folder / f"{name}.csv").write_text(f"file,yaw_deg,distance_m\n{rows}")
    return folder


class Given(Frames):
    """Frames that are there, with or without a known number."""

    source = "given"

    def __init__(self, images: list[np.ndarray | None], *, ends: bool = True) -> None:
        self.images = images
        self.names = [str(number) for number in range(len(images))] if ends else None

    def __iter__(self) -> Iterator[Frame]:
        for number, image in enumerate(self.images):
            yield Frame.of(str(number), None, ImageFileError("torn") if image is None else image)


A, B = np.zeros((3, 4), np.uint8), np.ones((3, 4, 3), np.uint8)


@pytest.mark.parametrize(
    ("images", "order", "count", "read"),
    [
        ([A, A, A, B, B, A], [0, 1, 2, 3, 4, 5], 3, 6),
        ([A, A, A, B, B, A], [5, 2, 4, 0, 3, 1], 3, 6),
        ([A, A, A], [0, 1, 1, 2, 0, 2], 2, 3),
        ([A, B, A, B], [0, 1, 2, 3], 0, 4),
        ([A, None, A], [0, 1, 2], 0, 2),
        ([A, A, A], [0, 2], 0, 2),
    ],
)
def test_images_are_counted_in_any_order(
    images: list[np.ndarray | None], order: list[int], count: int, read: int, capfd: pytest.CaptureFixture[str]
) -> None:
    repeats = Repeats(Given(images))
    frames = list(repeats)
    for number in order:
        assert isinstance(frames[number].image, ImageFileError if images[number] is None else np.ndarray)
    assert (repeats.count, repeats.images) == (count, read)
    repeats.tell()
    repeats.tell()
    said = capfd.readouterr().err
    assert said.count("\n") == (count > 0)
    assert said.startswith(LINE.format("given", f"{count} of {read}")) == (count > 0)


def test_what_has_no_end_is_told_as_it_happens_and_ever_more_seldom(capfd: pytest.CaptureFixture[str]) -> None:
    repeats = Repeats(Given([A, B] + [A] * 2500, ends=False))
    told = []
    for number, frame in enumerate(repeats):
        frame.read()
        if capfd.readouterr().err:
            told.append(number)
    assert told == [3, 12, 102, 1002]


@pytest.mark.parametrize(
    "words",
    [
        ("tilt",),
        ("tilt", "--threads", 2),
        ("lines",),
        ("segments",),
        ("track", "--odometry", "drive.csv", "--out", "out.csv"),
        ("level", "--out", "out"),
    ],
)
def test_commands_tell_of_a_frozen_camera(
    run: Run, folder: Path, tmp_path: Path, words: tuple[object, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = tuple(folder / word if word == "drive.csv" else word for word in words)
    said = run(words[0], folder / "images", *words[1:], "--camera", folder / "camera.toml")
    [told] = [line for line in said.err.splitlines() if "last byte" in line]
    assert (said.code, told.startswith(LINE.format(folder / "images", "3 of 6"))) == (0, True)


def test_images_that_differ_are_nothing_to_tell_of(run: Run, folder: Path) -> None:
    said = run("tilt", *(folder / "images" / f"{k}.png" for k in range(3)), "--camera", folder / "camera.toml")
    assert (said.code, said.err) == (0, "")


@pytest.mark.parametrize(("odometry", "last"), [("drive", "repeated"), ("stand", "accepted")])
def test_the_filter_leaves_a_frozen_camera_out(
    run: Run, folder: Path, tmp_path: Path, odometry: str, last: str
) -> None:
    """A robot that stands may see the same; it took what was true of the third image for what is, and was sure."""
    if odometry == "stand":
        images = [folder / "images" / f"{k}.png" for k in range(2, 6)]
        rows = (folder / "stand.csv").read_text().splitlines()
        (table := tmp_path / "stand.csv").write_text("\n".join([rows[0], *rows[3:]]))
    else:
        images, table = [folder / "images"], folder / "drive.csv"
    out = tmp_path / "out.csv"
    words = ("--camera", folder / "camera.toml", "--filter", "--odometry", table, "--out", out)
    assert run("tilt", *images, *words).code == 0
    found = pl.read_csv(out)
    assert found["verdict"].to_list()[-3:] == [last] * 3
    if last == "repeated":
        assert found["verdict"].to_list()[:3] == ["accepted"] * 3
        assert "while the wheels rolled 1.500 m, at most 0.010 m expected" in found["verdict_reason"][-1]
        assert found["filtered_sigma_rad"][2:].is_sorted()


def test_the_right_side_of_a_pair_is_watched_too(run: Run, tmp_path: Path) -> None:
    StereoRig(CAMERA, CAMERA, LEFT_FROM_RIGHT).save(tmp_path / "rig.toml")
    noise = np.random.default_rng(0).integers(0, 255, (3, CAMERA.height, CAMERA.width), dtype=np.uint8)
    for k in range(3):
        tiltvp.write_image(tmp_path / "left" / f"{k}.png", noise[k])
        tiltvp.write_image(tmp_path / "right" / f"{k}.png", noise[0])
    said = run("corner", tmp_path / "left", tmp_path / "right", "--calibration", tmp_path / "rig.toml")
    assert said.complaint.startswith(LINE.format(tmp_path / "right", "2 of 3"))


def test_a_live_camera_that_is_frozen(
    run: Run, camera: tiltvp.Camera, room: RoomImage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Frozen:
        left = 4

        def __init__(self, _: int) -> None:
            pass

        def isOpened(self) -> bool:  # noqa: N802
            return self.left > 0

        def get(self, _: int) -> float:
            return 0.0

        def read(self) -> tuple[bool, np.ndarray | None]:
            Frozen.left -= 1
            return (True, room.bgr) if self.left >= 0 else (False, None)

        def release(self) -> None:
            pass

    camera.save(tmp_path / "camera.toml")
    monkeypatch.setattr(cv2, "VideoCapture", Frozen)
    monkeypatch.setattr("tiltvp.streams.live.LiveCamera._awaited", lambda *_: None)
    said = run("tilt", "--live", 0, "--camera", tmp_path / "camera.toml")
    told = [line for line in said.err.splitlines() if "last byte" in line]
    assert [line.split(" images")[0] for line in told] == [f"tiltvp: camera 0: {n}" for n in ("1 of 2", "3 of 4")]
