"""Hostile files, each read and used within 5 s and 1 GiB: an answer or a sentence, never the end of the process."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

import tiltvp
import tiltvp.field_of_view
import tiltvp.formats.stereo
import tiltvp.lines
import tiltvp.rotations
from hostile import calibrations, images, logs
from recordings import motions_of
from survive.conftest import survived
from tiltvp.drive_logs import read_drive_log
from tiltvp.errors import TiltvpError
from tiltvp.formats import FORMATS

CAMERA_USES: dict[str, Callable[[Path], object]] = {
    "load": tiltvp.Camera.load,
    "field of view": lambda path: tiltvp.field_of_view.field_of_view(tiltvp.Camera.load(path)),
    "estimator": lambda path: tiltvp.TiltEstimator(tiltvp.Camera.load(path)),
    "lines": lambda path: tiltvp.lines.LineExtractor(tiltvp.Camera.load(path)),
    "rotation": lambda path: tiltvp.rotations.read_rotation(str(path)),
    "pair": tiltvp.formats.stereo.read_stereo,
}
DEVICES = ("pipe", "/dev/zero", "/dev/null", "folder", "/proc/self/mem", "a\0b")
READERS: dict[str, Callable[[str], object]] = {
    "camera": tiltvp.Camera.load,
    "image": tiltvp.read_image,
    "log": lambda path: read_drive_log(path, path),
    "odometry": lambda path: motions_of(path, []),
    "rotation": tiltvp.rotations.read_rotation,
}


@pytest.mark.parametrize("use", CAMERA_USES)
def test_calibrations(use: str, tmp_path: Path) -> None:
    failures = {}
    for name, content in calibrations():
        # What only reading can tell apart is used but once.
        if use not in ("load", "rotation", "pair") and len(content) > 100_000:
            continue
        path = tmp_path / "camera.toml"
        path.write_bytes(content)
        problem = survived(lambda path=path: CAMERA_USES[use](path))
        if problem:
            failures[name] = problem
    assert not failures


def test_every_format_on_what_is_no_format(tmp_path: Path) -> None:
    path, failures = tmp_path / "camera", {}
    chosen = {"newlines-0-140000", "digits", "numbers-0-4194204", "colmap", "aliases", "blanks-0-4194204"}
    for name, content in calibrations():
        if name not in chosen:
            continue
        path.write_bytes(content)

        def each() -> None:
            for one in FORMATS:
                try:
                    tiltvp.Camera.load(path, one.name, image_size=(640, 480))
                except TiltvpError:
                    continue

        problem = survived(each)
        if problem:
            failures[name] = problem
    assert not failures


def test_images(tmp_path: Path) -> None:
    failures = {}
    for name, content in images():
        (tmp_path / name).write_bytes(content)
        problem = survived(lambda name=name: tiltvp.read_image(tmp_path / name))
        if problem:
            failures[name] = problem
    assert not failures


def test_logs(tmp_path: Path) -> None:
    failures = {}
    for name, odometry, bearings in logs():
        (tmp_path / "odometry.csv").write_bytes(odometry)
        (tmp_path / "bearings.csv").write_bytes(bearings)

        def use() -> None:
            log = read_drive_log(tmp_path / "odometry.csv", tmp_path / "bearings.csv")
            if len(log.odometry) < 20_000 and len(log.bearings) > 1000:
                tiltvp.calibrate(log.odometry, log.bearings, wheel_base_m=0.4)

        problem = survived(use)
        if problem:
            failures[name] = problem
    assert not failures


@pytest.mark.parametrize("reader", READERS)
def test_what_is_no_regular_file(reader: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    failures = {}
    for name in DEVICES:
        path = str(tmp_path / name)
        if name.startswith("/"):
            path = name

        def use(path: str = path) -> None:
            try:
                READERS[reader](path)
            except TiltvpError:
                return
            raise AssertionError("was read")

        problem = survived(use)
        if problem:
            failures[name] = problem
    assert not failures
