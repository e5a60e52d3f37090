"""Commands that are killed at any moment: the same command again gives the same as without, and no litter."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from pathlib import Path

import pytest

from command_inputs import write_drive_log, write_rooms

KILLS = 3
COMMANDS: dict[str, tuple[str, ...]] = {
    "camera convert": ("camera", "convert", "camera.toml", "OUT/camera.toml"),
    "tilt": ("tilt", "images", "--camera", "camera.toml", "--overlay", "OUT/seen"),
    "calibrate": ("calibrate", "wheels.csv", "bearings.csv", "--wheel-base", "0.4", "--out", "OUT/mounting.json"),
    "drive": (
        "dataset", "drive", "--kind", "corridor", "--frames", "3", "--samples", "1", "--resolution-scale", "0.3",
        "--force", "--seed", "1", "--out", "OUT/drive",
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Inputs of all commands."""
    folder = tmp_path_factory.mktemp("world")
    write_rooms(folder, 12)
    write_drive_log(folder)
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    """All files below a folder, hidden ones too."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_killed_command_can_be_run_again(command: str, world: Path, tmp_path: Path) -> None:
    rng = random.Random(command)
    words = [sys.executable, "-m", "tiltvp", *COMMANDS[command], "--overwrite"]

    def started(out: str) -> subprocess.Popen[bytes]:
        (tmp_path / out).mkdir(exist_ok=True)
        line = [word.replace("OUT", str(tmp_path / out)) for word in words]
        return subprocess.Popen(line, cwd=world, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    begin = time.monotonic()
    assert started("right").wait() == 0
    took = time.monotonic() - begin
    for _ in range(KILLS):
        process = started("killed")
        time.sleep(took * rng.uniform(0.3, 1.0))
        process.kill()
        process.wait()
    assert started("killed").wait() == 0
    assert contents(tmp_path / "killed") == contents(tmp_path / "right")
