"""`tiltvp lab demo`: from a recording to what a robot's owner wants, command by command, and against the truth."""

from __future__ import annotations

import io
import math
import shlex
from collections.abc import Sequence
from contextlib import chdir, redirect_stdout
from pathlib import Path
from typing import Annotated, Final

from cyclopts import Parameter

from tiltvp.cli.options import Seed
from tiltvp.cli.root import run
from tiltvp.cli.terminal import say

DRIVE, CAMERA, ROBOT, MOUNTED, TILTS = "drive.mcap", "camera.toml", "robot.toml", "mounted.toml", "tilts.mcap"
_LINES_MAX: Final = 30
"""Of what a command says; a table with a row for each frame is longer, and its first and last line stand for it."""


def demo(
    *,
    out: Path = Path("out/demo-drive"),
    seed: Seed = 0,
    resolution_scale: Annotated[float, Parameter(show=False)] = 1.0,
) -> None:
    """Make a recording of a drive, and from it a robot's file, a mounting, a level video and attitudes for ROS.

    Every command is printed as a person would type it, with what it says; then how far the answers are from the truth,
    which the recording carries.

    Parameters
    ----------
    out
        Folder in which the commands are run.
    seed
        Seed of room, way and noise.
    resolution_scale
        Pixels per side of the camera, of 640 x 480.
    """
    from tiltvp.files import check_output_folder
    from tiltvp.streams.outputs.mcap import check_recording

    check_output_folder(out)
    check_recording(out / DRIVE)
    out.mkdir(parents=True, exist_ok=True)
    say(f"$ cd {shlex.quote(str(out))}")
    with chdir(out):
        codes = [_typed(words) for words in asked(seed, resolution_scale)]
        # A mounting that cannot be relied upon is not written: then the robot's file is what there is.
        robot = ROBOT if codes[-1] else MOUNTED
        for words in answered(robot):
            _typed(words)
        for line in _errors(robot):
            say(line)


def asked(seed: int = 0, resolution_scale: float = 1.0) -> list[list[str]]:
    """The commands from nothing to the mounting, as words without the program's name."""
    scale = [] if resolution_scale == 1.0 else ["--resolution-scale", f"{resolution_scale:g}"]
    truth = shlex.split("--mounting-deg 1 -0.6 --floor-slope-deg 1 40 --bumps-deg 1 --samples 1")
    wheels = shlex.split("--wheel-base 0.35 --wheel-radius 0.05")
    return [
        ["lab", "drive", "--out", DRIVE, "--camera-out", CAMERA, *truth, "--seed", str(seed), *scale],
        ["setup", DRIVE, "--camera", CAMERA, *wheels, "--out", ROBOT, "--picture", "robot.png"],
        ["calibrate", DRIVE, "--camera", ROBOT, "--robot-out", MOUNTED, "--transform", "mounted.urdf"],
    ]


def answered(robot: str) -> list[list[str]]:
    """The commands that use a robot's file."""
    return [
        ["level", DRIVE, "--camera", robot, "--method", "segments", "--out", "level.mp4"],
        ["tilt", DRIVE, "--camera", robot, "--method", "segments", "--filter", "--out", TILTS],
    ]


def _typed(words: Sequence[str]) -> int:
    """Prints a command and what it says, long tables by their first and their last line; its exit code."""
    say(f"$ tiltvp {shlex.join(words)}")
    with redirect_stdout(io.StringIO()) as told:
        code = run(words)
    lines = told.getvalue().splitlines()
    for line in lines if len(lines) <= _LINES_MAX else [lines[0], "...", lines[-1]]:
        say(line)
    if code:
        say(f"(exit code {code})")
    return code


def _errors(robot: str) -> list[str]:
    """How far the robot's file and the tilts are from the truth, for people."""
    from tiltvp import Robot
    from tiltvp.lab.evaluation.recorded import RecordedTruth

    truth, found = RecordedTruth.of(DRIVE), Robot.load(robot)
    roll, pitch, yaw = (math.degrees(angle) for angle in truth.mounting_error(found))
    turned = f"roll {roll:+.2f}, pitch {pitch:+.2f}" + (f", yaw {yaw:+.2f} deg" if found.place_m else " deg")
    lines = [f"against the truth: {robot} is off by {turned}"]
    if found.place_m is not None:
        x, y = (1e3 * (known - true) for known, true in zip(found.place_m, truth.place_m, strict=True))
        lines[0] += f", x {x:+.1f}, y {y:+.1f} mm"
    tilts = truth.tilt_errors(TILTS)
    lines.append(
        f"against the truth: {TILTS} is off by {math.degrees(tilts.rms_rad):.2f} deg rms over {tilts.frames} frames, "
        f"{math.degrees(tilts.largest_rad):.2f} at most"
    )
    return lines
