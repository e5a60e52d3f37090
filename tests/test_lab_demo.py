"""`tiltvp lab demo`: what is printed is what was run, and its errors are those against the recording's truth."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import tiltvp
from tiltvp.cli.app import app
from tiltvp.cli.lab.demo import DRIVE, MOUNTED, ROBOT, TILTS, answered, asked
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.panoramas import paper_camera
from tiltvp.lab.datasets.recording import RecordedDrive
from tiltvp.lab.evaluation.recorded import RecordedTruth
from tiltvp.streams import open_frames
from tiltvp.streams.outputs.tilts import write_tilts
from tiltvp.synth import Room

ROOT = Path(__file__).parents[1]
ROLL, PITCH = math.radians(2.0), math.radians(-1.0)


def test_the_ten_minutes_of_the_guide_are_what_the_demo_types() -> None:
    guide = (ROOT / "docs" / "setup.md").read_text(encoding="utf-8")
    typed = [shlex.split(words) for words in re.findall(r"^\$ tiltvp (.*)$", guide, re.MULTILINE)]
    assert typed == asked() + answered(MOUNTED)
    for words in typed:
        app.parse_args(words, print_error=False, exit_on_error=False)


@pytest.fixture(scope="module")
def drive() -> RecordedDrive:
    return RecordedDrive(
        Room("office", 1, light_spacing_m=0.6), paper_camera().scaled(0.25), legs=((0.1, 0.0), (0.0, 0.3)),
        mounting_rad=(ROLL, PITCH), floor_slope_rad=(0.02, 0.5), camera_delay_s=0.03, samples=1, seed=5,
    )  # fmt: skip


@pytest.fixture(scope="module")
def path(drive: RecordedDrive, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recorded") / DRIVE
    drive.write(path)
    return path


@pytest.mark.slow
def test_the_truth_is_that_of_the_drive(drive: RecordedDrive, path: Path) -> None:
    truth = RecordedTruth.of(path)
    np.testing.assert_allclose(truth.robot_from_camera, drive.robot_from_mounted_camera, atol=1e-12)
    np.testing.assert_allclose(truth.normals, drive.tilts, atol=1e-12)
    assert truth.place_m.tolist() == pytest.approx([drive.mount.x_m, drive.mount.y_m])
    upright = truth.mounting_error(tiltvp.Robot(drive.camera, drive.nominal))
    assert upright.tolist() == pytest.approx([-ROLL, -PITCH, 0.0], abs=1e-3)


@pytest.mark.slow
def test_tilts_are_held_against_it_frame_by_frame(drive: RecordedDrive, path: Path, tmp_path: Path) -> None:
    truth, out = RecordedTruth.of(path), tmp_path / TILTS
    # A robot that is said to stand upright all the time.
    gray = Room("office", 1, light_spacing_m=0.6).render(drive.camera, pose=drive.drive.poses[0], samples=1).gray
    upright = tiltvp.TiltEstimator(drive.camera, method="segments")(gray)
    assert upright
    write_tilts(out, truth.times_s, [upright] * len(truth.times_s))
    errors = truth.tilt_errors(out)
    expected = np.array([tiltvp.tilt_error_rad(upright.normal, normal) for normal in drive.tilts])
    assert errors.frames == len(drive)
    assert errors.rms_rad == pytest.approx(math.sqrt(np.mean(expected**2)), abs=1e-9)
    assert errors.largest_rad == pytest.approx(expected.max(), abs=1e-9)
    write_tilts(out, truth.times_s + 0.01, [upright] * len(truth.times_s))
    with pytest.raises(InvalidInputError, match="expected those of the frames"):
        truth.tilt_errors(out)
    with pytest.raises(InvalidInputError, match="no topic /truth/mounting"):
        RecordedTruth.of(out)


@pytest.mark.slow
def test_every_command_is_printed_as_it_was_run(run: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    out = tmp_path / "demo"
    code, said, complaints = run("lab", "demo", "--out", out, "--resolution-scale", 0.3)
    assert code == 0
    assert "no odometry" not in complaints  # The robot's file tells of the wheels.
    printed = [shlex.split(line)[2:] for line in said.splitlines() if line.startswith("$ tiltvp ")]
    robot = MOUNTED if (out / MOUNTED).exists() else ROBOT
    assert printed == asked(0, 0.3) + answered(robot)
    assert (open_frames(str(out / "level.mp4")).count or 0) > 90
    told = re.findall(r"^against the truth: (\S+) is off by (.*)$", said, re.MULTILINE)
    assert [name for name, _ in told] == [robot, TILTS]
    truth = RecordedTruth.of(out / DRIVE)
    roll, pitch, _ = np.degrees(truth.mounting_error(tiltvp.Robot.load(out / robot)))
    assert told[0][1].startswith(f"roll {roll:+.2f}, pitch {pitch:+.2f}")
    assert math.hypot(roll, pitch) < 2.0
    assert f"{math.degrees(truth.tilt_errors(out / TILTS).rms_rad):.2f} deg rms" in told[1][1]
    # What exists is kept.
    assert run("lab", "demo", "--out", out)[0] == 2
