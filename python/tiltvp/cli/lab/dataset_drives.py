"""`tiltvp dataset drive` and `stereo`: datasets of something that moves through a rendered room."""

from __future__ import annotations

import math
from typing import Annotated, Any

from cyclopts import Parameter, validators

from tiltvp.cli.declared_options import Whole
from tiltvp.cli.lab.dataset_options import (
    DriveLensOptions,
    MakingOptions,
    RenderingOptions,
    WayOptions,
    legs_from,
    made_by,
)
from tiltvp.cli.terminal import progress_bar, say
from tiltvp.errors import InvalidInputError, counted

_LENS, _WAY, _RENDERING = DriveLensOptions(), WayOptions(), RenderingOptions()


def drive(
    making: MakingOptions,
    lens: DriveLensOptions = _LENS,
    *,
    kind: str = "corridor",
    frames: Whole | None = None,
    way: WayOptions = _WAY,
    lighting: float | None = None,
    floor_gloss: float | None = None,
    wall_pattern: str | None = None,
    extent: float | None = None,
    rendering: RenderingOptions = _RENDERING,
) -> None:
    """Make a dataset of a robot's drive through a room: frames, odometry, and the identity of every upright edge.

    Parameters
    ----------
    kind
        Where to drive: corridor, hall, office, living-room, l-shaped, narrow or under-table.
    frames
        How many frames of wandering; default 1500.
    lighting
        How much the light changes along the way, from 0 to 1; default 0.5.
    floor_gloss
        How much the floor shines, from 0 to 1; default 0.4.
    wall_pattern
        What all walls have in common: drawn (nothing, the default), stripes, panels or tiles.
    extent
        How many times larger than usual the floor is, from 1 to 4; default is 2 for corridor and hall, 1 otherwise.
    """
    from tiltvp.lab.datasets.driving import drive_room, write_drive
    from tiltvp.synth import Drive

    making.check()
    if frames is not None and way.legs is not None:
        raise InvalidInputError("--frames beside --legs, which have as many as they need, expected one of them")
    camera = lens.load()
    options: dict[str, Any] = {
        "robot_from_camera": lens.rotation(),
        "mount": way.mount_rad,
        "blind_rad": lens.blind_rad,
        "frames": frames,
        "legs": None if way.legs is None else legs_from(way.legs),
        "seed": making.seed,
        "encoder_k_m": way.encoder_k_m,
        "bumps_max_rad": math.radians(way.bumps_deg),
        "lighting": lighting,
        "samples": rendering.samples,
        "noise_sigma": rendering.noise_sigma,
    }
    Drive.check(**options)
    room = drive_room(
        kind, making.seed, extent=extent, floor_gloss=floor_gloss, wall_pattern=wall_pattern, threads=making.threads
    )
    made = Drive(room, camera=camera, threads=making.threads, **options)
    with progress_bar(len(made), "frames") as bar:
        source = made_by("drive") | lens.source
        write_drive(made, making.out, threads=making.threads, source=source, force=making.replaces, advance=bar.advance)
    say(f"{making.out}: {counted(len(made), 'frames')} of a drive of {made.motions[:, 0].sum():.1f} m")


def stereo(
    making: MakingOptions,
    *,
    kind: str = "laboratory",
    frames: Whole | None = None,
    width: Whole = 1280,
    distance: tuple[float, float] | None = None,
    gamma_deg: float = 90.0,
    corner: Whole | None = None,
    clutter: float | None = None,
    exposure_ms: Annotated[float, Parameter(validator=validators.Number(gte=0, lte=100))] = 0.0,
    blur_sigma: float | None = None,
    rendering: RenderingOptions = _RENDERING,
) -> None:
    """Make a sequence of a hand-held stereo pair that looks at a corner: images, calibration, poses, inertial data.

    Parameters
    ----------
    kind
        What is looked at: laboratory (a coloured cuboid), or a room: office, living-room, corridor, l-shaped, narrow or
        under-table.
    frames
        How many frames, 30 a second; default 1000.
    width
        Width of the images: 1280 (x 720) or 1920 (x 1080).
    distance
        Least and greatest distance from the corner in metres; default 1 3.
    gamma_deg
        Angle between the level edges of the cuboid.
    corner
        Number of the corner that is looked at; default is the cuboid's, or one of a room that can be approached.
    clutter
        How much furniture there is, from 0 to 1.
    exposure_ms
        How long the shutter is open, for motion blur.
    blur_sigma
        What lens and sensor do to a point, in pixels; default 0.6.
    """
    from tiltvp.lab.datasets.stereo import write_stereo
    from tiltvp.synth import Laboratory, Room, StereoSequence, zed_cameras

    making.check()
    left, right = zed_cameras(width)
    options: dict[str, Any] = {
        "frames": frames,
        "seed": making.seed,
        "corner": corner,
        "distance_m": distance,
        "samples": rendering.samples,
        "noise_sigma": rendering.noise_sigma,
        "blur_sigma_px": blur_sigma,
        "exposure_s": exposure_ms / 1000.0,
    }
    StereoSequence.check(**options)
    if kind != "laboratory" and gamma_deg != 90.0:
        raise InvalidInputError(f"--gamma-deg {gamma_deg}, expected it with --kind laboratory alone")
    scene = (
        Laboratory(making.seed, gamma_rad=math.radians(gamma_deg), clutter=clutter, threads=making.threads)
        if kind == "laboratory"
        else Room(kind, making.seed, clutter=clutter, threads=making.threads)
    )
    sequence = StereoSequence(scene, left=left, right=right, threads=making.threads, **options)
    with progress_bar(len(sequence), "frames") as bar:
        write_stereo(
            sequence,
            making.out,
            threads=making.threads,
            source=made_by("stereo"),
            force=making.replaces,
            advance=bar.advance,
        )
    say(f"{making.out}: {counted(len(sequence), 'pairs')} of images")
