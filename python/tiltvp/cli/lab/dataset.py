"""`tiltvp dataset`: folders of images with known lean, checked and made."""

from __future__ import annotations

import os
from pathlib import Path

from tiltvp.cli.declared_options import Whole
from tiltvp.cli.lab.dataset_drives import drive, stereo
from tiltvp.cli.lab.dataset_options import LensOptions, MakingOptions, Words, made_by, tilts_from
from tiltvp.cli.lab.measure_options import NoiseSigma, Samples
from tiltvp.cli.options import AtLeast1, Seed, Switch
from tiltvp.cli.root import group
from tiltvp.cli.terminal import complain, new_table, progress_bar, say, show
from tiltvp.errors import counted

app = group("dataset", "Folders of images with known lean: check them, or make them.")
app.command(drive)
app.command(stereo)
_LENS = LensOptions()


@app.command
def check(directory: Path, /) -> int:
    """Say everything that is wrong with a dataset, and where.

    The exit code is 1 if there is an error; warnings are of what hinders some uses only.

    Parameters
    ----------
    directory
        Folder with dataset.toml, images.csv, a calibration file and images, or with a stereo sequence.
    """
    from tiltvp.lab.datasets.check import check_dataset, is_stereo
    from tiltvp.lab.datasets.findings import Findings
    from tiltvp.lab.datasets.folder import find_dataset

    first = Findings()
    dataset = find_dataset(directory, first)
    if not directory.is_dir():
        first.refuse()
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
        counts = ", ".join(
            counted(len(many), what)
            for many, what in ((dataset.images, "images"), (locations, "locations"), (environments, "environments"))
        )
        say(f"{directory}: {counts}, {counted(len(findings), 'warnings')}")
    elif is_stereo(directory) and not errors:
        say(f"{directory}: a stereo sequence, in order")
    return 1 if errors else 0


@app.command
def panoramas(*, out: Path, rooms: AtLeast1 = 4, places: AtLeast1 = 2, height: Whole = 640, seed: Seed = 0) -> None:
    """Render upright panoramas of rooms, with the index that folders of panoramas have.

    Parameters
    ----------
    out
        Folder to write to.
    rooms
        Rooms of each kind.
    places
        Places in each room.
    height
        Rows of a panorama; it has twice as many columns.
    seed
        Seed of the first room of each kind; those of the others follow.
    """
    from tiltvp.lab.datasets.room_panoramas import render_room_panoramas
    from tiltvp.synth import ROOM_KINDS

    with progress_bar(rooms * places * len(ROOM_KINDS), "panoramas") as bar:
        render_room_panoramas(out, rooms=rooms, places=places, height=height, first_seed=seed, advance=bar.advance)


@app.command
def render(
    making: MakingOptions,
    lens: LensOptions = _LENS,
    *,
    panoramas: Path,
    tilts_deg: Words = None,
    noise_sigma: NoiseSigma = 2.0,
    samples: Samples = 2,
    turn: Switch = False,
    limit: Whole | None = None,
) -> None:
    """Make a dataset of views of upright panoramas. A location is a panorama.

    Parameters
    ----------
    panoramas
        Folder with an INDEX.csv of columns name, environment, tilt_x_deg, tilt_z_deg; without it, of level
        equirectangular images.
    tilts_deg
        Leans as ALPHA,BETA ALPHA,BETA ... or a CSV file of columns alpha_deg, beta_deg; default is the paper's seven.
    turn
        Give each view a heading of its own.
    limit
        Take only so many panoramas, evenly spread.
    """
    from tiltvp.lab.datasets.rendering import find_panoramas, render_panoramas

    chosen = find_panoramas(panoramas, limit)
    with progress_bar(len(chosen), "panoramas") as bar:
        render_panoramas(
            chosen,
            lens.load(),
            making.out,
            tilts_deg=tilts_from(tilts_deg),
            robot_from_camera=lens.rotation(),
            samples=samples,
            noise_sigma=noise_sigma,
            turn=turn,
            seed=making.seed,
            threads=making.threads,
            source=made_by("render") | {"panoramas": panoramas.absolute().name} | lens.source,
            force=making.replaces,
            advance=bar.advance,
        )
    _say_made(making.out)


@app.command
def synth(
    making: MakingOptions,
    lens: LensOptions = _LENS,
    *,
    kinds: Words = None,
    rooms: AtLeast1 = 6,
    locations_per_room: AtLeast1 = 4,
    camera_height_m: float | None = None,
    tilts_deg: Words = None,
    noise_sigma: NoiseSigma = 2.0,
    samples: Whole | None = None,
) -> None:
    """Make a dataset of views of rendered rooms. A location is a place in a room, an environment a kind of room.

    Parameters
    ----------
    kinds
        Kinds of rooms, which take turns: office, living-room, corridor, l-shaped, narrow, under-table; default is all.
    rooms
        How many rooms.
    locations_per_room
        How many places in each.
    camera_height_m
        Height of the camera above the floor; default 0.3 metres.
    tilts_deg
        Leans as ALPHA,BETA ALPHA,BETA ... or a CSV file of columns alpha_deg, beta_deg; default is the paper's seven.
    samples
        Rays per pixel and side; default 3.
    """
    from tiltvp.lab.datasets.rendering import render_rooms
    from tiltvp.synth import ROOM_KINDS

    with progress_bar(rooms, "rooms") as bar:
        render_rooms(
            lens.load(),
            making.out,
            kinds=kinds or ROOM_KINDS,
            rooms=rooms,
            locations_per_room=locations_per_room,
            tilts_deg=tilts_from(tilts_deg),
            robot_from_camera=lens.rotation(),
            camera_height_m=camera_height_m,
            samples=samples,
            noise_sigma=noise_sigma,
            seed=making.seed,
            threads=making.threads,
            source=made_by("synth") | lens.source,
            force=making.replaces,
            advance=bar.advance,
        )
    _say_made(making.out)


@app.command
def degrade(
    directory: Path,
    /,
    making: MakingOptions,
) -> None:
    """Make a harder dataset of one that is there: each image half hidden, blurred or darkened, its truth the same.

    Parameters
    ----------
    directory
        The dataset.
    """
    from tiltvp.lab.datasets.degrading import degrade_dataset
    from tiltvp.lab.datasets.folder import read_dataset

    dataset = read_dataset(directory)
    with progress_bar(len(dataset.images), "images") as bar:
        degrade_dataset(
            dataset,
            making.out,
            seed=making.seed,
            threads=making.threads,
            source=made_by("degrade"),
            force=making.replaces,
            advance=bar.advance,
        )
    _say_made(making.out)
    known = {*dataset.files, *(image.path for image in dataset.images)}
    if left := sorted(file.name for file in directory.iterdir() if file.is_file() and file not in known):
        complain(f"{making.out}: without {', '.join(left)} of {directory}, as its images have other names")


def _say_made(out: Path) -> None:
    from tiltvp.lab.datasets.folder import read_dataset

    images = read_dataset(out).images
    say(f"{out}: {counted(len(images), 'images')} of {counted(len({image.location for image in images}), 'locations')}")
