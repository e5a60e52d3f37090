"""`tiltvp setup`: from a recording to the file that every command reads."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tiltvp.cli.frame_checks import tell_unusable
from tiltvp.cli.mount import mounting_lines
from tiltvp.cli.options import CameraOptions, MountedOptions, Switch
from tiltvp.cli.sources import KeptOptions, MotionOptions, check_apart
from tiltvp.cli.tables import PICTURES, check_file
from tiltvp.cli.terminal import complain, files_first, progress_bar, say
from tiltvp.files import check_output
from tiltvp.images import read_mask

if TYPE_CHECKING:
    from tiltvp import Camera
    from tiltvp.robot_setup import RobotSetup
    from tiltvp.streams import Frames

_SOURCE = KeptOptions()
_MOTION = MotionOptions()


def setup(
    recording: list[str],
    /,
    *,
    camera: CameraOptions,
    out: Path,
    source: KeptOptions = _SOURCE,
    motion: MotionOptions = _MOTION,
    robot_from_camera: str | None = None,
    mask: Path | None = None,
    level_floor: Switch = False,
    picture: Path | None = None,
) -> int:
    """Find out what a robot's recording tells of its camera, and write it to a file that every command reads.

    The image circle, the robot's own body, which way the camera looks, roll and pitch of its mounting, and whether
    images turn as the odometry says. The exit code is 1 where something keeps the file from being relied upon; it is
    written all the same, without what is not known. Its turn about the vertical, and where the camera sits, are left
    to `tiltvp calibrate`. What a robot's file as --camera knows is used, and kept where nothing of it is found anew.

    Parameters
    ----------
    recording
        Images, a video or a recording of a drive with turns, best a turn in place.
    out
        File for the robot (.toml); its mask goes beside it. Give it as --camera to other commands.
    robot_from_camera
        How the camera sits on the robot, where it is known roughly: up, forward, or a file with a rotation. By default
        that of a robot's file; without one the direction that is up is found.
    mask
        Image of the camera's size, white where the world is seen. By default that of a robot's file; without one rim
        and body are looked for.
    level_floor
        The floor is level within 0.05 degrees: no turn is needed.
    picture
        Picture of what was found (.png).
    """
    from tiltvp.robot import mask_path
    from tiltvp.robot_setup import find_setup, measured_count

    check_file("--out", out, ".toml")
    check_output(mask_path(out))
    check_file("--picture", picture, *PICTURES)
    known = camera.robot()
    source = source.of_robot(known, recording)
    lens = camera.load(source.topic)
    mounted = camera.complete(MountedOptions(robot_from_camera=robot_from_camera, mask=mask))
    frames = source.open(recording, lens, names_each=False)
    check_apart(frames, out, picture, mask_path(out), beside=(motion.odometry,))
    motion = motion.of_robot(known, frames)
    moved = motion.motions(frames)
    with progress_bar(measured_count(frames), "images") as bar:
        found = find_setup(
            frames,
            lens,
            moved.motions if moved is not None and moved.turns_known else None,
            robot_from_camera=None if mounted.robot_from_camera is None else mounted.mounting(lens),
            mask=None if mounted.mask is None else read_mask(mounted.mask),
            level_floor=level_floor,
            wheels=motion.wheels(),
            topics={k: v for k, v in (("images", source.topic), ("odometry", motion.odometry_topic)) if v is not None},
            advance=bar.advance,
        )
    tell_unusable(frames, found.problems)
    if known is not None and robot_from_camera is not None:
        known = replace(known, covariance=None, covariance_rad2=None)
    robot = found.robot if known is None else found.again(known)
    with files_first():
        for line in _lines(found):
            say(line)
        robot.save(out)
        if picture is not None:
            _draw(frames, lens, found, picture)
    for reason in found.reasons:
        complain(f"{out}: not to be relied upon: {reason}")
    return 0 if found else 1


def _lines(found: RobotSetup) -> list[str]:
    """What was found, for people."""
    lines = [found.direction.direction_reason, f"lens: {found.direction.lens.reason}"]
    rim = {True: "a dark surround that the calibration does not know is left out", False: "none found"}
    lines.append(f"rim: {found.body.reason if found.rim is None else rim[found.rim]}")
    lines.append(f"body: {found.body.reason}")
    lines.append("turns: no odometry" if found.turns is None else f"turns: {found.turns_reason}")
    first, *others = mounting_lines(found.mounting)
    return [*lines, f"mounting: {first}", *others]


def _draw(frames: Frames, camera: Camera, found: RobotSetup, path: Path) -> None:
    from tiltvp import write_image
    from tiltvp.overlays.setup import setup_picture
    from tiltvp.robot_setup import TILT_OPTIONS, spread

    _, image = next(spread(frames, camera, 1))
    estimate = found.robot.estimator(**TILT_OPTIONS)(image)
    write_image(path, setup_picture(image, found.robot, estimate, found.given_robot_from_camera, found.mounting.reason))
