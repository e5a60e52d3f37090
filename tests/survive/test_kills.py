"""Commands that are killed at any moment: the same command again gives the same as without, and no litter."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from pathlib import Path

import pytest

import tiltvp
from tiltvp.synth import render_room, simulate_drive

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
    camera = tiltvp.Camera.equidistant(width=240, height=180, focal_px=52.4, cx=119.5, cy=89.5, max_theta_rad=1.6)
    camera.save(folder / "camera.toml")
    image = render_room(camera, kind="office", seed=3, alpha_rad=0.03)
    for number in range(12):
        tiltvp.write_image(folder / "images" / f"{number}.png", image.bgr)
    drive = simulate_drive("paper", seed=1)
    for name, header, rows in (
        ("wheels.csv", "step,delta_left_m,delta_right_m", [(i, *row) for i, row in enumerate(drive.odometry.tolist())]),
        ("bearings.csv", "step,landmark,bearing_rad", [(int(a), int(b), c) for a, b, c in drive.bearings.tolist()]),
    ):
        (folder / name).write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n")
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
