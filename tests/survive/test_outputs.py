"""Every output on a full disk, on a read-only one, and where something else is in its place: one sentence."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

import tiltvp
from command_inputs import write_drive_log, write_pair, write_rooms
from drawn_corners import COLOURS, pair
from tiltvp.cli import main

COMMANDS: dict[str, tuple[str, ...]] = {
    "camera convert": ("camera", "convert", "camera.toml", "OUT.toml"),
    "tilt csv": ("tilt", "images", "--camera", "camera.toml", "--out", "OUT.csv"),
    "tilt json": ("tilt", "images", "--camera", "camera.toml", "--out", "OUT.json"),
    "tilt parquet": ("tilt", "images", "--camera", "camera.toml", "--out", "OUT.parquet"),
    "tilt mcap": ("tilt", "images", "--camera", "camera.toml", "--out", "OUT.mcap"),
    "tilt overlay": ("tilt", "images", "--camera", "camera.toml", "--overlay", "OUT"),
    "tilt level": ("tilt", "images", "--camera", "camera.toml", "--threads", "2", "--level", "OUT"),
    "lines": ("lines", "images", "--camera", "camera.toml", "--out", "OUT.csv"),
    "lines overlay": ("lines", "images", "--camera", "camera.toml", "--overlay", "OUT"),
    "track": ("track", "images", "--camera", "camera.toml", "--out", "OUT.parquet"),
    "track video": ("track", "images", "--camera", "camera.toml", "--out", "../tracks.csv", "--video", "OUT.mp4"),
    "calibrate": ("calibrate", "wheels.csv", "bearings.csv", "--wheel-base", "0.4", "--out", "OUT.json"),
    "calibrate plot": ("calibrate", "wheels.csv", "bearings.csv", "--wheel-base", "0.4", "--plot", "OUT.png"),
    "calibrate transform": (
        "calibrate", "wheels.csv", "bearings.csv", "--wheel-base", "0.4", "--transform", "OUT.urdf",
    ),
    "corner": ("corner", "left", "right", "--calibration", "rig.toml", "--out", "OUT.csv"),
    "corner trajectory": ("corner", "left", "right", "--calibration", "rig.toml", "--trajectory", "OUT.txt"),
    "corner overlay": ("corner", "left", "right", "--calibration", "rig.toml", "--overlay", "OUT"),
    "corner plot": ("corner", "left", "right", "--calibration", "rig.toml", "--plot", "OUT.png"),
    "demo": ("demo", "--width", "160", "--height", "120", "--out", "OUT"),
    "dataset render": (
        "dataset", "render", "--panoramas", "panos", "--camera", "camera.toml", "--tilts-deg", "0,0", "2,90",
        "--out", "OUT",
    ),
    "evaluate": ("evaluate", "data", "--methods", "refined", "--out", "OUT"),
}  # fmt: skip
"""Command lines in the folder of the inputs, in which OUT stands for what is written."""


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Inputs of all commands."""
    folder = tmp_path_factory.mktemp("world")
    write_rooms(folder, 3)
    write_drive_log(folder)
    write_pair(folder, dict(zip(("left", "right"), pair(COLOURS), strict=True)))
    noise = np.random.default_rng(1).integers(0, 256, (64, 128), dtype=np.uint8)
    tiltvp.write_image(folder / "panos" / "hall.jpg", cv2.resize(noise, (512, 256), interpolation=cv2.INTER_CUBIC))
    (folder / "panos" / "INDEX.csv").write_text("name,environment,tilt_x_deg,tilt_z_deg\nhall,house,0,0\n")
    words = ("--panoramas", "panos", "--camera", "camera.toml", "--tilts-deg", "0,0", "2,90")
    before = os.getcwd()
    os.chdir(folder)
    try:
        assert main(["dataset", "render", *words, "--out", "data"]) == 0
    finally:
        os.chdir(before)
    return folder


@pytest.fixture
def run(world: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Callable[..., object]:
    """Runs a command of the table: its exit code and what it complains about."""
    monkeypatch.chdir(world)
    # What `track video` writes beside its video, in a test before.
    (world.parent / "tracks.csv").unlink(missing_ok=True)

    def run_main(command: str, out: Path, *more: str) -> tuple[int, str]:
        code = main([word.replace("OUT", str(out)) for word in COMMANDS[command]] + list(more))
        return code, capfd.readouterr().err

    return run_main


def mounted(folder: Path, options: str) -> bool:
    """Whether a file system in memory could be put there."""
    done = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)], capture_output=True, check=False
    )
    return done.returncode == 0


@pytest.fixture(params=["full", "read-only"])
def disk(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Path]:
    """A folder that nothing can be written to."""
    folder = tmp_path / "disk"
    folder.mkdir()
    options = "size=64k,nr_inodes=1000" if request.param == "full" else "ro"
    if not mounted(folder, options):
        # Without the right to mount, a folder of another's; root, who may write there, may mount.
        folder.chmod(0o500)
        assert os.getuid() != 0, "root without the right to mount"
        yield folder
        folder.chmod(0o700)
        return
    try:
        if request.param == "full":
            with open(folder / "filler", "wb", buffering=0) as filler:
                try:
                    while True:
                        filler.write(bytes(4096))
                except OSError:
                    pass
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_disk_that_takes_nothing(command: str, run: Callable[..., tuple[int, str]], disk: Path) -> None:
    before = sorted(disk.rglob("*"))
    code, complaint = run(command, disk / "out")
    assert code == 1, complaint
    assert len(complaint.splitlines()) == 1
    assert "cannot be written" in complaint
    # On a full disk there may be a folder, which takes no space, or an empty one of a command that makes several.
    left = [path for path in disk.rglob("*") if path not in before and not path.is_dir()]
    assert not left


@pytest.mark.parametrize("command", COMMANDS)
def test_something_in_the_way(command: str, run: Callable[..., tuple[int, str]], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    code, complaint = run(command, tmp_path / "file" / "out")
    assert code == 1, complaint
    assert len(complaint.splitlines()) == 1
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("file", "kept")]


@pytest.mark.parametrize("command", COMMANDS)
def test_what_exists_is_kept(command: str, run: Callable[..., tuple[int, str]], tmp_path: Path) -> None:
    ending = Path(COMMANDS[command][-1]).suffix
    out = tmp_path / f"out{ending}"
    if ending:
        out.write_text("kept")
        kept = out
    else:
        out.mkdir()
        kept = out / "kept"
        kept.write_text("kept")
    code, complaint = run(command, tmp_path / "out")
    assert code == 2, complaint
    assert kept.read_text() == "kept"
    if ending:
        assert "--overwrite" in complaint
        code, complaint = run(command, tmp_path / "out", "--overwrite")
        assert code in (0, 1), complaint
        assert out.read_bytes() != b"kept"
        assert json.dumps([path.name for path in tmp_path.iterdir()]).count(".part") == 0
