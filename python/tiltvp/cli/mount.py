"""`tiltvp mount`: whether a camera sits upright, within a tolerance; for one robot or for all that leave a factory."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tiltvp.cli.frame_checks import tell_setup_of, tell_unusable
from tiltvp.cli.options import ABOVE_0, CameraOptions, MountedOptions, Switch
from tiltvp.cli.results import degrees
from tiltvp.cli.sources import KeptOptions, MotionOptions, check_apart
from tiltvp.cli.tables import check_file, finite
from tiltvp.cli.terminal import progress_bar, say
from tiltvp.files import write_whole

if TYPE_CHECKING:
    from tiltvp.mounting import MountingTilt

DONE, FAILED, NOT_TOLD = 0, 1, 3
_MOUNTED = MountedOptions()
_SOURCE = KeptOptions()
_MOTION = MotionOptions()


def mount(
    images: list[str],
    /,
    *,
    camera: CameraOptions,
    source: KeptOptions = _SOURCE,
    mounted: MountedOptions = _MOUNTED,
    motion: MotionOptions = _MOTION,
    level_floor: Switch = False,
    within_deg: Annotated[float | None, ABOVE_0] = None,
    out: Path | None = None,
) -> int:
    """Measure roll and pitch of a camera's mounting on a drive: what stays when the robot turns is not the floor's.

    The exit code is 0 where the mounting is known and, with a tolerance, within it at 95 %; 1 where it is beyond, 3
    where the drive does not tell. What of a constant lean is the camera's and what the robot's own cannot be told.

    Parameters
    ----------
    images
        Images, a video or a recording of a drive with turns.
    level_floor
        The floor is level within 0.05 degrees: no turn is needed.
    within_deg
        By how much the mounting may be off.
    out
        File for the result (.json).
    """
    from tiltvp.mounting import mounting_tilt
    from tiltvp.robot_setup import TILT_OPTIONS, drive_tilts, measured_count

    check_file("--out", out, ".json")
    robot = camera.robot()
    source = source.of_robot(robot, images)
    estimator = camera.complete(mounted.of_topic(source.topic)).mounted(camera.load(source.topic), **TILT_OPTIONS)
    frames = source.open(images, estimator.camera, names_each=False)
    check_apart(frames, out, beside=(motion.odometry, mounted.mask, camera.camera))
    moved = motion.motions_of(robot, frames)
    motions = moved.motions if moved is not None and moved.turns_known else None
    tell_setup_of(frames, estimator, moved)
    with progress_bar(measured_count(frames), "images") as bar:
        tilts = drive_tilts(frames, estimator, motions, advance=bar.advance)
    tell_unusable(frames, tilts.problems)
    found = mounting_tilt(
        tilts.estimates, tilts.motions, estimator.robot_from_camera,
        level_floor=level_floor, half_track_m=motion.of_robot(robot, frames).wheels().half_track_m,
    )  # fmt: skip
    verdict = None if within_deg is None else found.within(math.radians(within_deg))
    if out is not None:
        result = mounting_result(found) | {"tolerance_deg": within_deg, "within_tolerance": verdict}
        write_whole(out, json.dumps(finite(result), indent=1, allow_nan=False) + "\n")
    for line in mounting_lines(found):
        say(line)
    if within_deg is not None and found:
        words = {True: "pass: within", False: "fail: beyond", None: "not told: about"}[verdict]
        say(f"{words} {within_deg:g} degrees, at 95 %")
    if not found or (within_deg is not None and verdict is None):
        return NOT_TOLD
    return FAILED if verdict is False else DONE


def mounting_lines(found: MountingTilt) -> Sequence[str]:
    """What was found, for people."""
    if not found:
        return [found.reason]
    lean, floor = found.lean, found.floor
    lines = [
        found.reason,
        f"roll {degrees(lean.roll_rad)} deg, pitch {degrees(lean.pitch_rad)} deg: so a level robot seems to lean",
    ]
    if floor:
        lines.append(f"the floor's tilt at the end: {degrees(floor.alpha_rad)} deg, 1-sigma {degrees(floor.sigma_rad)}")
    return lines


def mounting_result(found: MountingTilt) -> dict[str, object]:
    """The same as JSON takes it, in SI units."""
    return {
        "reason": found.reason,
        "known": bool(found),
        "robot_from_camera": found.robot_from_camera.tolist(),
        "lean": found.lean.to_dict(),
        "covariance_rad2": found.covariance_rad2.tolist(),
        "floor": found.floor.to_dict(),
        "images": found.images,
        "used": found.used,
        "turned_rad": found.turned_rad,
        "level_floor": found.level_floor,
    }
