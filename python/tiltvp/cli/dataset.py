"""`tiltvp dataset`: folders of images with known lean, checked and made."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import App, Parameter

from tiltvp.cli.options import Switch
from tiltvp.cli.terminal import new_table, progress_bar, say, show
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp import Camera

app = App(name="dataset", help="Folders of images with known lean: check them, or make them.")

Tilts = Annotated[list[str] | None, Parameter(consume_multiple=True, negative="")]
Mount = tuple[float, float, float, float]
Words = Annotated[list[str] | None, Parameter(consume_multiple=True, negative="")]


@app.command
def check(directory: Path, /) -> int:
    """Say everything that is wrong with a dataset, and where.

    The exit code is 1 if there is an error; warnings are of what hinders some uses only.

    Parameters
    ----------
    directory
        Folder with dataset.toml, images.csv, a calibration file and images.
    """
    from tiltvp.datasets.check import check_dataset
    from tiltvp.datasets.findings import Findings
    from tiltvp.datasets.folder import find_dataset

    dataset = find_dataset(directory, Findings())
    with progress_bar(len(dataset.images) if dataset is not None else 0, "images") as bar:
        findings = check_dataset(directory, bar.advance)
    if findings:
        columns = ("severity", "file", "line", "what is wrong", "expected")
        table = new_table(str(directory), columns, left=set(columns) - {"line"})
        for finding in findings:
            line = "" if finding.line is None else str(finding.line)
            file = os.path.relpath(finding.file, directory)
            table.add_row(finding.severity, file, line, finding.what, finding.expected)
        show(table)
    errors = sum(finding.severity == "error" for finding in findings)
    if dataset is not None and not errors:
        locations = {image.location for image in dataset.images}
        environments = {image.environment for image in dataset.images}
        counts = f"{len(dataset.images)} images, {len(locations)} locations, {len(environments)} environments"
        say(f"{directory}: {counts}, {len(findings)} warnings")
    return 1 if errors else 0


@app.command
def render(
    *,
    panoramas: Path,
    out: Path,
    camera: Path | None = None,
    camera_name: str | None = None,
    resolution_scale: float = 1.0,
    robot_from_camera: str | None = None,
    tilts_deg: Tilts = None,
    noise_sigma: float = 2.0,
    samples: int = 2,
    turn: Switch = False,
    limit: int | None = None,
    seed: int = 0,
    threads: int | None = None,
    force: Switch = False,
) -> None:
    """Make a dataset of views of upright panoramas. A location is a panorama.

    Parameters
    ----------
    panoramas
        Folder with an INDEX.csv of columns name, environment, tilt_x_deg, tilt_z_deg; without it, of level
        equirectangular images.
    out
        Folder to make. It appears when it is whole.
    camera
        Calibration file; default is a 640 x 480 upward fisheye of 185 degrees like the paper's.
    camera_name
        Name or number of the camera in a file of several; the first is 0.
    resolution_scale
        Take a camera with so many times the pixels per side.
    robot_from_camera
        How the camera sits on the robot: up (the default), forward, or a file with a rotation.
    tilts_deg
        Leans as ALPHA,BETA ALPHA,BETA ... or a CSV file of columns alpha_deg, beta_deg; default is the paper's seven.
    noise_sigma
        Gaussian noise in grey levels.
    samples
        Rays per pixel and side.
    turn
        Give each view a heading of its own.
    limit
        Take only so many panoramas, evenly spread.
    seed
        Seed of noise and headings.
    threads
        How many threads; default is one per core.
    force
        Replace a dataset that is there.
    """
    from tiltvp.datasets.rendering import find_panoramas, render_panoramas

    chosen = find_panoramas(panoramas, limit)
    lens = _camera(camera, camera_name, resolution_scale)
    with progress_bar(len(chosen), "panoramas") as bar:
        render_panoramas(
            chosen,
            lens,
            out,
            tilts_deg=_tilts(tilts_deg),
            robot_from_camera=_rotation(robot_from_camera),
            samples=samples,
            noise_sigma=noise_sigma,
            turn=turn,
            seed=seed,
            threads=_threads(threads),
            source=_made_by("render") | {"panoramas": panoramas.absolute().name} | _camera_source(camera),
            force=force,
            advance=bar.advance,
        )
    _say_made(out)


@app.command
def synth(
    *,
    out: Path,
    kinds: Words = None,
    rooms: int = 6,
    locations_per_room: int = 4,
    camera: Path | None = None,
    camera_name: str | None = None,
    resolution_scale: float = 1.0,
    robot_from_camera: str | None = None,
    camera_height_m: float | None = None,
    tilts_deg: Tilts = None,
    noise_sigma: float = 2.0,
    samples: int | None = None,
    seed: int = 0,
    threads: int | None = None,
    force: Switch = False,
) -> None:
    """Make a dataset of views of rendered rooms. A location is a place in a room, an environment a kind of room.

    Parameters
    ----------
    out
        Folder to make. It appears when it is whole.
    kinds
        Kinds of rooms, which take turns: office, living-room, corridor, l-shaped, narrow, under-table; default is all.
    rooms
        How many rooms.
    locations_per_room
        How many places in each.
    camera
        Calibration file; default is a 640 x 480 upward fisheye of 185 degrees like the paper's.
    camera_name
        Name or number of the camera in a file of several; the first is 0.
    resolution_scale
        Take a camera with so many times the pixels per side.
    robot_from_camera
        How the camera sits on the robot: up (the default), forward, or a file with a rotation.
    camera_height_m
        Height of the camera above the floor; default 0.3 metres.
    tilts_deg
        Leans as ALPHA,BETA ALPHA,BETA ... or a CSV file of columns alpha_deg, beta_deg; default is the paper's seven.
    noise_sigma
        Gaussian noise in grey levels.
    samples
        Rays per pixel and side; default 3.
    seed
        Seed of rooms, places and noise.
    threads
        How many threads; default is one per core.
    force
        Replace a dataset that is there.
    """
    from tiltvp.datasets.rendering import render_rooms
    from tiltvp.synth import ROOM_KINDS

    lens = _camera(camera, camera_name, resolution_scale)
    with progress_bar(rooms, "rooms") as bar:
        render_rooms(
            lens,
            out,
            kinds=kinds or ROOM_KINDS,
            rooms=rooms,
            locations_per_room=locations_per_room,
            tilts_deg=_tilts(tilts_deg),
            robot_from_camera=_rotation(robot_from_camera),
            camera_height_m=camera_height_m,
            samples=samples,
            noise_sigma=noise_sigma,
            seed=seed,
            threads=_threads(threads),
            source=_made_by("synth") | _camera_source(camera),
            force=force,
            advance=bar.advance,
        )
    _say_made(out)


@app.command
def drive(
    *,
    out: Path,
    kind: str = "corridor",
    frames: int | None = None,
    legs: Words = None,
    camera: str = "mirror",
    camera_name: str | None = None,
    resolution_scale: float = 1.0,
    robot_from_camera: str | None = None,
    mount: Mount | None = None,
    bumps_deg: float = 0.0,
    lighting: float | None = None,
    floor_gloss: float | None = None,
    wall_pattern: str | None = None,
    extent: float | None = None,
    noise_sigma: float | None = None,
    samples: int | None = None,
    encoder_k_m: float | None = None,
    seed: int = 0,
    threads: int | None = None,
    force: Switch = False,
) -> None:
    """Make a dataset of a robot's drive through a room: frames, odometry, and the identity of every upright edge.

    Parameters
    ----------
    out
        Folder to make. It appears when it is whole.
    kind
        Where to drive: corridor, hall, office, living-room, l-shaped, narrow or under-table.
    frames
        How many frames of wandering; default 1500.
    legs
        Instead of wandering, the legs of a way, METRES,DEGREES each (2.3,0 0,180); or paper, alternating or straight.
    camera
        mirror (a camera below a hyperbolic mirror), fisheye (like the tilt paper's), or a calibration file.
    camera_name
        Name or number of the camera in a file of several; the first is 0.
    resolution_scale
        Take a camera with so many times the pixels per side; 0.75 makes 480 x 360.
    robot_from_camera
        How the camera sits in its mounting: up (the default), forward, or a file with a rotation.
    mount
        Where the camera is on the robot: metres to the front and to the left, degrees turned to the left, metres up;
        default 0 0 0 0.4.
    bumps_deg
        Greatest lean from bumps.
    lighting
        How much the light changes along the way, from 0 to 1; default 0.5.
    floor_gloss
        How much the floor shines, from 0 to 1; default 0.4.
    wall_pattern
        What all walls have in common: drawn (nothing, the default), stripes, panels or tiles.
    extent
        How many times larger than usual the floor is, from 1 to 4; default is 2 for corridor and hall, 1 otherwise.
    noise_sigma
        Gaussian noise in grey levels; default 2.
    samples
        Rays per pixel and side where surfaces meet; default 3.
    encoder_k_m
        Variance of an encoder's reading per metre; default 1e-5.
    seed
        Seed of room, way, encoders, bumps, light and noise.
    threads
        How many threads; default is one per core.
    force
        Replace a dataset that is there.
    """
    from tiltvp.datasets.driving import drive_room, write_drive
    from tiltvp.datasets.panoramas import paper_camera
    from tiltvp.synth import MIRROR_BLIND_RAD, Drive, mirror_camera

    if seed < 0:
        raise InvalidInputError(f"seed = {seed}, expected 0 or more")
    known = {"mirror": mirror_camera, "fisheye": paper_camera}
    if camera in known:
        lens = known[camera]()
        lens = lens if resolution_scale == 1.0 else lens.scaled(resolution_scale)
    else:
        lens = _camera(Path(camera), camera_name, resolution_scale)
    count = _threads(threads)
    room = drive_room(kind, seed, extent=extent, floor_gloss=floor_gloss, wall_pattern=wall_pattern, threads=count)
    made = Drive(
        room,
        camera=lens,
        robot_from_camera=_rotation(robot_from_camera),
        mount=None if mount is None else (mount[0], mount[1], math.radians(mount[2]), mount[3]),
        blind_rad=MIRROR_BLIND_RAD if camera == "mirror" else None,
        frames=frames,
        legs=None if legs is None else _legs(legs),
        seed=seed,
        encoder_k_m=encoder_k_m,
        bumps_max_rad=math.radians(bumps_deg),
        lighting=lighting,
        samples=samples,
        noise_sigma=noise_sigma,
        threads=count,
    )
    with progress_bar(len(made), "frames") as bar:
        source = _made_by("drive") | {"camera": Path(camera).name}
        write_drive(made, out, threads=count, source=source, force=force, advance=bar.advance)
    say(f"{out}: {len(made)} frames of a drive of {made.motions[:, 0].sum():.1f} m")


@app.command
def stereo(
    *,
    out: Path,
    kind: str = "laboratory",
    frames: int | None = None,
    width: int = 1280,
    distance: tuple[float, float] | None = None,
    gamma_deg: float = 90.0,
    corner: int | None = None,
    clutter: float | None = None,
    exposure_ms: float = 0.0,
    blur_sigma: float | None = None,
    noise_sigma: float | None = None,
    samples: int | None = None,
    seed: int = 0,
    threads: int | None = None,
    force: Switch = False,
) -> None:
    """Make a sequence of a hand-held stereo pair that looks at a corner: images, calibration, poses, inertial data.

    Parameters
    ----------
    out
        Folder to make. It appears when it is whole.
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
    noise_sigma
        Gaussian noise in grey levels; default 2.
    samples
        Rays per pixel and side where surfaces meet; default 3.
    seed
        Seed of scene, motion and noise.
    threads
        How many threads; default is one per core.
    force
        Replace a dataset that is there.
    """
    from tiltvp.datasets.stereo import write_stereo
    from tiltvp.synth import Laboratory, Room, StereoSequence, zed_cameras

    if seed < 0:
        raise InvalidInputError(f"seed = {seed}, expected 0 or more")
    count = _threads(threads)
    left, right = zed_cameras(width)
    if kind != "laboratory" and gamma_deg != 90.0:
        raise InvalidInputError(f"--gamma-deg {gamma_deg}, expected it with --kind laboratory alone")
    scene = (
        Laboratory(seed, gamma_rad=math.radians(gamma_deg), clutter=clutter, threads=count)
        if kind == "laboratory"
        else Room(kind, seed, clutter=clutter, threads=count)
    )
    sequence = StereoSequence(
        scene,
        left=left,
        right=right,
        frames=frames,
        seed=seed,
        corner=corner,
        distance_m=distance,
        samples=samples,
        noise_sigma=noise_sigma,
        blur_sigma_px=blur_sigma,
        exposure_s=exposure_ms / 1000.0,
        threads=count,
    )
    with progress_bar(len(sequence), "frames") as bar:
        write_stereo(sequence, out, threads=count, source=_made_by("stereo"), force=force, advance=bar.advance)
    say(f"{out}: {len(sequence)} pairs of images")


@app.command
def degrade(
    directory: Path,
    /,
    *,
    out: Path,
    seed: int = 0,
    threads: int | None = None,
    force: Switch = False,
) -> None:
    """Make a harder dataset of one that is there: each image half hidden, blurred or darkened, its truth the same.

    Parameters
    ----------
    directory
        The dataset.
    out
        Folder to make. It appears when it is whole.
    seed
        Seed of what befalls each image.
    threads
        How many threads; default is one per core.
    force
        Replace a dataset that is there.
    """
    from tiltvp.datasets.degrading import degrade_dataset
    from tiltvp.datasets.folder import read_dataset

    dataset = read_dataset(directory)
    with progress_bar(len(dataset.images), "images") as bar:
        degrade_dataset(
            dataset,
            out,
            seed=seed,
            threads=_threads(threads),
            source=_made_by("degrade"),
            force=force,
            advance=bar.advance,
        )
    _say_made(out)


def _camera(path: Path | None, name: str | None, scale: float) -> Camera:
    from tiltvp import Camera
    from tiltvp.datasets.panoramas import paper_camera

    if path is None:
        lens = paper_camera()
    else:
        name = name or "0"
        lens = Camera.load(path, camera=int(name) if name.isdecimal() else name)
    return lens if scale == 1.0 else lens.scaled(scale)


def _rotation(word: str | None) -> NDArray[np.float64] | None:
    from tiltvp.rotations import read_rotation

    return None if word is None else read_rotation(word)


def _legs(words: Sequence[str]) -> NDArray[np.float64]:
    """(L, 2) metres and radians, from pairs or the name of a trajectory."""
    from tiltvp.synth import drive_legs

    if len(words) == 1 and "," not in words[0]:
        return drive_legs(words[0])
    return np.array([_pair(word.split(","), f"--legs {word!r}", "METRES,DEGREES") for word in words]) * (
        1.0,
        np.pi / 180.0,
    )


def _threads(count: int | None) -> int:
    return (os.cpu_count() or 1) if count is None else count


def _tilts(words: list[str] | None) -> list[tuple[float, float]]:
    """(alpha, beta) in degrees, from pairs or a CSV file."""
    from tiltvp.datasets.panoramas import TABLE_1_TILTS_DEG

    if not words:
        return list(TABLE_1_TILTS_DEG)
    if len(words) == 1 and "," not in words[0]:
        return _tilts_of_file(Path(words[0]))
    return [_pair(word.split(","), f"--tilts-deg {word!r}") for word in words]


def _tilts_of_file(file: Path) -> list[tuple[float, float]]:
    columns = ["alpha_deg", "beta_deg"]
    try:
        lines = list(csv.reader(file.read_text(encoding="utf-8-sig").splitlines()))
    except OSError as error:
        problem = error.strerror or error
        raise InvalidInputError(f"{file}: {problem}, expected ALPHA,BETA in degrees, or a CSV file") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InvalidInputError(
            f"{file}: is not CSV in UTF-8 ({error}), expected the columns alpha_deg, beta_deg"
        ) from error
    rows = [(number, [cell.strip() for cell in row]) for number, row in enumerate(lines, 1) if row]
    if not rows or rows[0][1] != columns:
        raise InvalidInputError(f"{file}: expected the columns {', '.join(columns)}")
    return [_pair(row, f"{file}, line {number}: {','.join(row)!r}") for number, row in rows[1:]]


def _pair(cells: list[str], where: str, expected: str = "ALPHA,BETA in degrees") -> tuple[float, float]:
    try:
        first, second = (float(cell) for cell in cells)
    except ValueError:
        raise InvalidInputError(f"{where}, expected {expected}") from None
    return first, second


def _made_by(command: str) -> dict[str, str]:
    from tiltvp import __version__

    return {"made_by": f"tiltvp dataset {command}", "version": __version__}


def _camera_source(path: Path | None) -> dict[str, str]:
    return {"camera": "like the paper's" if path is None else path.name}


def _say_made(out: Path) -> None:
    from tiltvp.datasets.folder import read_dataset

    images = read_dataset(out).images
    say(f"{out}: {len(images)} images of {len({image.location for image in images})} locations")
