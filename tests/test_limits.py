"""docs/limits.md has the limits that the code has, and what is beyond them is refused by a sentence."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tiltvp
import tiltvp.lines
from hostile import aliases, own, png
from tiltvp import _core
from tiltvp.colmap import ColmapDatabase
from tiltvp.drive_logs import read_drive_log
from tiltvp.errors import (
    LONGEST_MESSAGE,
    CalibrationError,
    ImageFileError,
    InvalidInputError,
    OutputError,
    TiltvpError,
)
from tiltvp.files import check_output, check_output_folder, keeping_existing, whole_file, write_whole
from tiltvp.formats import document, write_cameras
from tiltvp.lab.datasets.folder import read_dataset
from tiltvp.rotations import read_rotation
from tiltvp.stereo_rigs import StereoRig
from tiltvp.streams import InertialSamples, Recording, open_frames, read_odometry

ROOT = Path(__file__).resolve().parent.parent
ROW = re.compile(r"^\| .+ \| (\d+) \| `(\S+)` \|$", re.MULTILINE)


def test_the_page_has_the_limits_of_the_code() -> None:
    rows = ROW.findall((ROOT / "docs" / "limits.md").read_text(encoding="utf-8"))
    assert len(rows) == 19
    for value, place in rows:
        module, _, name = place.replace("::", ".").rpartition(".")
        home = _core if "::" in place else importlib.import_module(f"tiltvp.{module}")
        assert getattr(home, name) == int(value), place


def test_the_c_interface_takes_as_much_toml() -> None:
    source = (ROOT / "crates" / "tiltvp-capi" / "src" / "text.rs").read_text(encoding="utf-8")
    (limit,) = re.findall(r"const LARGEST_TOML_BYTES: usize = (\w+);", source)
    assert int(limit) == document.LARGEST_TOML_BYTES


@pytest.mark.parametrize(("width", "height"), [(65_535, 65_535), (20_000, 20_000), (100_000, 100_000)])
def test_a_camera_of_too_many_pixels_is_refused(width: int, height: int, tmp_path: Path) -> None:
    (tmp_path / "camera.toml").write_bytes(own(width, height))
    with pytest.raises(CalibrationError, match=rf"{width} x {height}, expected at most 200000000 pixels"):
        tiltvp.Camera.load(tmp_path / "camera.toml")


def test_a_focal_length_of_nothing_is_refused() -> None:
    for fx in (1e-308, 5e-324, 0.0, -1.0):
        with pytest.raises(CalibrationError, match="fx = "):
            tiltvp.Camera.pinhole(width=640, height=480, fx=fx, fy=500.0, cx=320.0, cy=240.0)


@pytest.mark.parametrize("count", [201, 2_000, 9_999])
def test_a_polynomial_of_too_many_numbers_is_refused(count: int) -> None:
    for name in ("polynomial", "inverse_polynomial"):
        lists = {"polynomial": [-200.0, 0.0, 1e-3], name: [-200.0] + [1e-9] * (count - 1)}
        with pytest.raises(CalibrationError, match=rf"{name} = a list of {count}, expected at most 200 numbers"):
            tiltvp.Camera.ocam(width=640, height=480, cx=319.5, cy=239.5, **lists)


def test_a_bomb_of_aliases_is_refused_and_common_aliases_are_read(tmp_path: Path) -> None:
    path = tmp_path / "camera.yaml"
    path.write_bytes(aliases())
    start = time.process_time()
    with pytest.raises(CalibrationError, match="more than 10000 keys and values"):
        tiltvp.Camera.load(path)
    assert time.process_time() - start < 2.0
    camera = "  camera_model: pinhole\n  distortion_model: radtan\n  distortion_coeffs: [0, 0, 0, 0]\n"
    path.write_text(
        f"cam0:\n{camera}  intrinsics: &k [50, 50, 31, 23]\n  resolution: &size [64, 48]\n"
        f"cam1:\n{camera}  intrinsics: *k\n  resolution: *size\n"
    )
    assert tiltvp.Camera.load(path, camera=0) == tiltvp.Camera.load(path, camera=1)


def test_a_long_table_of_odometry_takes_a_few_times_its_file(tmp_path: Path) -> None:
    path = tmp_path / "odometry.csv"
    rows = [f"{0.01 * k:.2f},{0.001 * k:.4f},{0.002 * k:.4f},0.10000\n" for k in range(10_000)]
    path.write_text("".join(["time_s,x_m,y_m,yaw_rad\n", *rows]))
    tracemalloc.start()
    read_odometry(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 12 * path.stat().st_size


@pytest.mark.slow
def test_an_image_that_says_too_many_pixels_is_not_decoded(tmp_path: Path) -> None:
    (tmp_path / "image.png").write_bytes(png(16_000, 16_000))
    with pytest.raises(ImageFileError, match="16000 x 16000 pixels, expected at most 200000000"):
        tiltvp.read_image(tmp_path / "image.png")


ONE_THREAD_MORE = """
import os, resource
import numpy as np
import tiltvp
camera = tiltvp.Camera.equidistant(width=320, height=240, focal_px=70.0, cx=159.5, cy=119.5)
image = np.random.default_rng(0).integers(0, 255, (240, 320), np.uint8)
usual = tiltvp.TiltEstimator(camera)(image)
os.setuid(65533)
threads = len(os.listdir("/proc/self/task")) + 1
resource.setrlimit(resource.RLIMIT_NPROC, (threads, threads))
print(tiltvp.TiltEstimator(camera)(image) == usual)
"""
"""The one that a long call runs on, and none for parts of its tables."""


@pytest.mark.skipif(sys.platform != "linux" or os.getuid() != 0, reason="root alone becomes a user without threads")
def test_a_system_that_starts_no_further_thread_makes_the_same_tables() -> None:
    done = subprocess.run([sys.executable, "-c", ONE_THREAD_MORE], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "True\n"), done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="pipes of POSIX")
@pytest.mark.timeout(20)
def test_pipes_and_devices_are_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/zero"):
        for read in (tiltvp.Camera.load, tiltvp.read_image, lambda path: read_drive_log(path, path)):
            with pytest.raises(TiltvpError, match="is no regular file"):
                read(path)
    (tmp_path / "drive.mcap").symlink_to("pipe")
    with pytest.raises(InvalidInputError, match="is no regular file"):
        assert Recording(tmp_path / "drive.mcap").topics


def test_names_that_are_too_long_are_errors_of_ours() -> None:
    """As of a content that is given for its file."""
    long = "1 0 0 " * 1000
    for read in (tiltvp.Camera.load, read_rotation, read_odometry, read_dataset, lambda word: Recording(word).topics):
        with pytest.raises(TiltvpError):
            read(long)
    with pytest.raises(TiltvpError):
        next(open_frames(long).sample([0])).read()


def test_names_and_numbers_that_python_refuses_are_errors_of_ours(tmp_path: Path) -> None:
    for read in (tiltvp.Camera.load, tiltvp.read_image, lambda path: read_drive_log(path, path)):
        with pytest.raises(TiltvpError):
            read("a\0b")
    with pytest.raises(OutputError):
        tiltvp.write_image(f"{tmp_path}/a\0b.png", np.zeros((2, 2), np.uint8))
    with pytest.raises(InvalidInputError):
        _core.consistency_band(0.95, 3, 2**62)
    (tmp_path / "odometry.csv").write_text("step,delta_left_m,delta_right_m\n0,0,0\n1,1,1\n")
    for landmark in ("9" * 400, str(2**53), "1" * 200_000, "3_1"):
        (tmp_path / "bearings.csv").write_text(f"step,landmark,bearing_rad\n0,{landmark},0.1\n")
        with pytest.raises(InvalidInputError):
            read_drive_log(tmp_path / "odometry.csv", tmp_path / "bearings.csv")
    with pytest.raises(InvalidInputError):
        tiltvp.SelfCalibrator(wheel_base_m=0.4).step(0.1, 0.1, [2**53], [0.1])
    (tmp_path / "camera.toml").write_bytes(own(640, 480).replace(b"640", b"0x" + b"f" * 20_000))
    with pytest.raises(CalibrationError):
        tiltvp.Camera.load(tmp_path / "camera.toml")
    camera = tiltvp.Camera.equidistant(width=64, height=48, focal_px=20.0, cx=31.5, cy=23.5)
    motion = np.eye(4)
    motion[0, 3] = 0.5
    StereoRig(camera, camera, motion).save(tmp_path / "rig.toml")
    text = (tmp_path / "rig.toml").read_text()
    (tmp_path / "rig.toml").write_text(text.replace("0.5,", f"{10**400},", 1))
    with pytest.raises(CalibrationError, match="matrix of numbers"):
        StereoRig.load(tmp_path / "rig.toml")


def test_more_landmarks_than_the_limit_are_refused() -> None:
    count = _core.MOST_LANDMARKS + 1
    with pytest.raises(InvalidInputError, match=f"{count} landmarks"):
        tiltvp.SelfCalibrator(wheel_base_m=0.4).step(0.1, 0.1, np.arange(count), np.zeros(count))
    bearings = [[step, landmark, 0.1] for step in (0, 1) for landmark in range(count)]
    with pytest.raises(InvalidInputError, match=f"{count} landmarks"):
        tiltvp.calibrate([[0.1, 0.1]] * 2, bearings, wheel_base_m=0.4)


def test_no_landmark_has_a_number_below_0(tmp_path: Path) -> None:
    """With -1 for lines that nobody knows these were one landmark, which messages called 18446744073709551615."""
    odometry, bearings = tmp_path / "odometry.csv", tmp_path / "bearings.csv"
    odometry.write_text("step,delta_left_m,delta_right_m\n7,0.1,0.1\n")
    bearings.write_text("step,landmark,bearing_rad\n7,3,0.1\n7,-1,0.2\n")
    with pytest.raises(InvalidInputError, match=r"line 3: landmark = '-1', expected a whole number from 0 to"):
        read_drive_log(odometry, bearings)
    with pytest.raises(InvalidInputError, match=r"landmark_ids: -1, expected whole numbers from 0"):
        tiltvp.SelfCalibrator(wheel_base_m=0.4).step(0.1, 0.1, [3, -1], [0.1, 0.2])
    with pytest.raises(InvalidInputError, match=r"bearings: landmark: -1, expected whole numbers from 0"):
        tiltvp.calibrate([[0.1, 0.1]] * 2, [[0, -1, 0.1], [1, -1, 0.2]], wheel_base_m=0.4)


def test_long_messages_are_shortened(tmp_path: Path) -> None:
    (tmp_path / "camera.toml").write_bytes(own(640, 480).replace(b"equidistant", b"m" * 150_000))
    with pytest.raises(CalibrationError) as refusal:
        tiltvp.Camera.load(tmp_path / "camera.toml")
    assert len(str(refusal.value)) < 2100
    assert str(refusal.value).startswith(str(tmp_path))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux")
def test_memory_that_cannot_be_had_is_an_error_of_ours() -> None:
    script = (
        "import resource, tiltvp\n"
        "pages = int(open('/proc/self/statm').read().split()[0])\n"
        "limit = pages * resource.getpagesize() + (1 << 28)\n"
        "resource.setrlimit(resource.RLIMIT_AS, (limit, limit))\n"
        "camera = tiltvp.Camera.equidistant(width=8000, height=6000, focal_px=1700, cx=4000, cy=3000)\n"
        "try:\n    tiltvp.TiltEstimator(camera)\n"
        "except tiltvp.errors.CalibrationError as error:\n    print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "for whose tables" in done.stdout


def test_outputs_are_kept_where_that_is_asked_and_parts_of_the_dead_are_swept(tmp_path: Path) -> None:
    out = tmp_path / "out.txt"
    write_whole(out, "first")
    with keeping_existing(), pytest.raises(InvalidInputError, match="--overwrite"):
        write_whole(out, "second")
    assert out.read_text() == "first"
    (tmp_path / f".out.{'0' * 16}.part.txt").write_text("half")
    with whole_file(out) as part:
        part.write_text("third")
        # Another one at the same time leaves this part alone.
        write_whole(out, "second")
        assert part.exists()
    assert out.read_text() == "third"
    for fault in (ZeroDivisionError, ValueError):
        with pytest.raises(fault, match="the block's own"), whole_file(out):
            raise fault("the block's own")
    with pytest.raises(OutputError, match="cannot be written"):
        write_whole(out, "\udcff")
    with pytest.raises(OutputError, match="cannot be written"):
        write_whole(tmp_path / "a\0b", "lost")
    assert [path.name for path in tmp_path.iterdir()] == ["out.txt"]
    with pytest.raises(OutputError, match="no regular file"):
        write_whole("/dev/null", "lost")


def test_folders_that_may_not_be_written_to_are_refused_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "access", lambda place, _: place != str(tmp_path))
    for check in (check_output, check_output_folder):
        with pytest.raises(OutputError, match=f"its folder {tmp_path} may not be written to"):
            check(tmp_path / "new" / "out")
        (tmp_path / "open").mkdir(exist_ok=True)
        check(tmp_path / "open" / "new" / "out")


@pytest.mark.parametrize("name", ["a.gif", "a.PNG", "a.mkv", "a.csv", "a.json", "a.parquet", "a.html"])
def test_the_name_of_a_file_is_no_folder_unless_it_is_there(name: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="as a file does, expected a folder"):
        check_output_folder(tmp_path / name)
    (tmp_path / name).mkdir()
    for folder in (tmp_path / name, tmp_path / "v0.2", tmp_path / "2026-05-01.run"):
        check_output_folder(folder)


@pytest.mark.parametrize(
    "value", [10**400, 10**5000, "1", [1.0], object(), np.complex64(1 + 5j), np.array(True), np.array("1")], ids=type
)
def test_arguments_that_no_float_can_hold_are_refused_by_name(value: Any) -> None:
    camera = {"width": 64, "height": 48, "focal_px": 30.0, "cx": 31.5, "cy": 23.5}
    calibrator, tracker = tiltvp.SelfCalibrator(wheel_base_m=0.4), tiltvp.lines.LineTracker()
    seen = tiltvp.lines.LineExtractor(tiltvp.Camera.equidistant(**camera))(np.zeros((48, 64), np.uint8))
    asked: dict[str, Callable[[], object]] = {
        "max_theta_rad": lambda: tiltvp.Camera.equidistant(**camera, max_theta_rad=value),
        "wheel_base_m": lambda: tiltvp.SelfCalibrator(wheel_base_m=value),
        "delta_left_m": lambda: calibrator.step(value, 0.1, [1], [0.2]),
        "distance_m": lambda: tracker.update(seen, np.zeros((0, 4), np.float32), distance_m=value),
    }
    for name, ask in asked.items():
        with pytest.raises(InvalidInputError, match=f"^{name} = .*expected a number that a float can hold") as caught:
            ask()
        assert len(str(caught.value)) <= LONGEST_MESSAGE


def test_values_that_do_not_fit_a_line_are_told_by_their_kind() -> None:
    camera = tiltvp.Camera.equidistant(width=64, height=48, focal_px=30.0, cx=31.5, cy=23.5)
    masks = {r"shape \[48, 64\] of object": np.ones((48, 64), object), "list": [[True] * 64] * 48}
    for look, mask in masks.items():
        with pytest.raises(InvalidInputError, match=f"^option mask = {look}, expected a"):
            tiltvp.TiltEstimator(camera, mask=mask)


@pytest.mark.parametrize("path", [b"a.toml", None, 3.5, ""])
def test_what_is_no_path_is_refused(path: Any) -> None:
    camera = tiltvp.Camera.equidistant(width=64, height=48, focal_px=20.0, cx=31.5, cy=23.5)
    for door in (
        tiltvp.Camera.load, camera.save, tiltvp.Robot.load, tiltvp.Robot(camera, np.eye(3)).save, StereoRig.load,
        tiltvp.read_image, lambda one: tiltvp.write_image(one, np.zeros((4, 4), np.uint8)), read_rotation,
        lambda one: write_cameras([camera.to_spec()], one), Recording, open_frames, lambda one: open_frames([one]),
        read_odometry, InertialSamples.read, ColmapDatabase, lambda one: write_whole(one, ""),
    ):  # fmt: skip
        with pytest.raises(TiltvpError, match="expected a"):
            door(path)


@pytest.mark.parametrize("name", ["a.bag", "a.png"])
def test_files_of_gigabytes_are_refused_by_what_they_begin_with(name: str, tmp_path: Path) -> None:
    """All of them was read, the bag in a minute and into 4 GB."""
    with open(tmp_path / name, "wb") as file:
        file.truncate(2**31)
    tracemalloc.start()
    try:
        with pytest.raises(TiltvpError, match=f"{name}: (not a bag that can be read|larger than)"):
            next(iter(open_frames(tmp_path / name))).read()
        assert tracemalloc.get_traced_memory()[1] < 2**26
    finally:
        tracemalloc.stop()
