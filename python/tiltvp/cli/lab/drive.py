"""`tiltvp lab drive`: a recording of a robot, made by the package."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter, validators

from tiltvp.cli.lab.dataset_options import LensOptions, Mount, RenderingOptions, WayOptions, Words, legs_from
from tiltvp.cli.options import ALL_CORES, Seed, Switch, Threads
from tiltvp.cli.root import group
from tiltvp.cli.terminal import progress_bar, say

app = group("lab", "What the laboratory makes to try the package on.")

_LEAN_MAX_DEG = 28
"""Half a radian, as drives have them."""


def _check_slope(_: object, slope_deg: tuple[float, float]) -> None:
    slope, direction = slope_deg
    if not (0.0 <= slope <= _LEAN_MAX_DEG and math.isfinite(direction)):
        raise ValueError(f"Must be a slope from 0 to {_LEAN_MAX_DEG} and a finite direction.")


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RecordedWayOptions(WayOptions):
    """Where a robot drives that leans, with its camera nearly where its makers mean it."""

    legs: Words = None
    """The legs of the way, METRES,DEGREES each; default is a turn in place and most of a triangle."""
    mount: Mount | None = None
    """Where the camera is on the robot: metres to the front and to the left, degrees turned to the left, metres up;
    default 0.1 0.03 0 0.4."""
    mounting_deg: Annotated[
        tuple[float, float], Parameter(validator=validators.Number(gte=-_LEAN_MAX_DEG, lte=_LEAN_MAX_DEG))
    ] = (0.0, 0.0)
    """Roll and pitch of the camera's mounting, which nobody knows."""
    floor_slope_deg: Annotated[tuple[float, float], Parameter(validator=_check_slope)] = (0.0, 0.0)
    """By how much the floor falls, and where to: degrees to the left of the robot's first heading."""
    bumps_deg: Annotated[float, Parameter(validator=validators.Number(gte=0, lte=_LEAN_MAX_DEG))] = 2.0
    """Greatest lean from bumps."""


_LENS, _WAY, _RENDERING = LensOptions(), RecordedWayOptions(), RenderingOptions()


@app.command
def drive(
    *,
    out: Path,
    camera_out: Path | None = None,
    lens: LensOptions = _LENS,
    kind: str = "office",
    way: RecordedWayOptions = _WAY,
    camera_delay_s: Annotated[float, Parameter(validator=validators.Number(gte=0, lte=1))] = 0.0,
    compressed: Switch = False,
    rendering: RenderingOptions = _RENDERING,
    seed: Seed = 0,
    threads: Threads = ALL_CORES,
) -> None:
    """Make a recording of a robot's drive through a room, as its sensors tell of it: an MCAP file for ROS 2.

    Topics: /camera/image_raw (5 Hz), /camera/camera_info, /joint_states (wheel angles of ticks, 50 Hz), /imu/data_raw
    (100 Hz, with noise and bias), /tf_static (the nominal mounting); and the truth: /truth/pose, /truth/tilt (the
    ground normal in the robot frame, with the stamp of the frame), /truth/mounting, /truth/description. The same
    arguments give the same bytes.

    Parameters
    ----------
    out
        The recording (.mcap).
    camera_out
        File for the calibration (.toml); needed for lenses that no CameraInfo describes.
    kind
        Where to drive: corridor, hall, office, living-room, l-shaped, narrow or under-table.
    camera_delay_s
        By how much the stamps of frames are late.
    compressed
        Frames as PNG, on /camera/image_raw/compressed.
    seed
        Seed of room, way and noise.
    """
    from tiltvp.files import check_output, check_toml
    from tiltvp.lab.datasets.driving import drive_room
    from tiltvp.lab.datasets.recording import LEGS, MOUNT, RecordedDrive
    from tiltvp.lab.datasets.recording import Mount as CameraMount
    from tiltvp.streams.outputs.mcap import check_recording
    from tiltvp.synth import Drive

    check_recording(out)
    if camera_out is not None:
        check_toml(camera_out)
        check_output(camera_out)
    camera, rotation = lens.load(), lens.rotation()
    mount = MOUNT if way.mount_rad is None else CameraMount(*way.mount_rad)
    known: dict[str, Any] = {
        "legs": LEGS if way.legs is None else legs_from(way.legs),
        "noise_sigma": rendering.noise_sigma,
        "samples": rendering.samples,
        "encoder_k_m": way.encoder_k_m,
        "seed": seed,
    }
    Drive.check(mount=mount, **known)
    made = RecordedDrive(
        drive_room(kind, seed, threads=threads),
        camera,
        robot_from_camera=rotation,
        mount=mount,
        mounting_rad=_radians(way.mounting_deg),
        floor_slope_rad=_radians(way.floor_slope_deg),
        bumps_max_rad=math.radians(way.bumps_deg),
        camera_delay_s=camera_delay_s,
        compressed=compressed,
        **known,
    )
    with progress_bar(len(made), "frames") as bar:
        made.write(out, threads=threads, advance=bar.advance)
    if camera_out is not None:
        camera.save(camera_out)
    wheels = made.description()["wheels"]
    say(
        f"{out}: {made.motion.duration_s:.1f} s with {len(made)} frames; wheels of {wheels['radius_m']:g} m, "
        f"{wheels['base_m']:g} m apart"
    )


def _radians(pair_deg: tuple[float, float]) -> tuple[float, float]:
    first, second = pair_deg
    return math.radians(first), math.radians(second)
