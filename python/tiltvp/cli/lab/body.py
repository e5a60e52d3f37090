"""`tiltvp measure body`: how well the robot's own body is found, and what of the world is taken for it."""

from __future__ import annotations

from pathlib import Path

from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.options import AtLeast0, Seed
from tiltvp.cli.terminal import progress_bar
from tiltvp.errors import InvalidInputError, counted


def body(
    directory: Path | None = None,
    /,
    *,
    rooms: AtLeast0 = 1,
    seed: Seed = 500,
) -> None:
    """The mask of `body_mask` on rendered drives with a body painted in, and the tilts without it, with it and with it
    left out.

    Parameters
    ----------
    directory
        Folder with panoramas and an INDEX.csv, of whose views sets of 24 buildings are made.
    rooms
        Rooms of each kind to drive through.
    seed
        Seed of rooms, drives and bodies.
    """
    import polars as pl

    from tiltvp.lab.datasets.panoramas import read_panorama_index
    from tiltvp.lab.evaluation.body import (
        IMAGES,
        PLACES,
        drives,
        judge_drive,
        panorama_sets,
        summarise_masks,
        summarise_tilts,
    )  # fmt: skip
    from tiltvp.lab.evaluation.mounting import CAMERAS

    found = [] if directory is None else read_panorama_index(directory)
    buildings = list({panorama.location: panorama for panorama in found}.values())
    places = [place for _ in range(rooms) for place in PLACES]
    total = len(CAMERAS) * IMAGES * (len(places) + len(buildings) // IMAGES)
    if not total:
        told = "no folder" if directory is None else f"{counted(len(buildings), 'buildings')} in {directory}"
        raise InvalidInputError(f"--rooms {rooms} and {told}, expected rooms, or panoramas of {IMAGES} buildings")
    with progress_bar(total, "images") as bar:
        sources = {"drives": drives(places, seed, advance=bar.advance)}
        if buildings:
            sources["views of different buildings"] = panorama_sets(buildings, seed, advance=bar.advance)
        judged = {
            source: [judge_drive(drive, seed + k) for k, drive in enumerate(given)] for source, given in sources.items()
        }
    for source, tables in judged.items():
        if tables:
            masks, tilts = (pl.concat(part, how="vertical_relaxed") for part in zip(*tables, strict=True))
            show_frame(f"Shares in per cent, {source}", summarise_masks(masks), ["case", "straight"])
            show_frame(
                f"Tilt in degrees (eq. 44), {source}", summarise_tilts(tilts), ["straight", "looks", "method", "way"]
            )
