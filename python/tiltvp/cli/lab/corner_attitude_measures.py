"""`tiltvp measure corner-attitudes`: attitudes by one camera with gravity, of facades, furniture and real buildings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tiltvp.cli.lab.measure_options import Every, PanoramasIfAny, refuse_every
from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.options import ALL_CORES, AtLeast1, Seed, Threads
from tiltvp.cli.tables import check_ending, write_frame
from tiltvp.cli.terminal import progress_bar
from tiltvp.errors import InvalidInputError


def corner_attitudes(
    directory: PanoramasIfAny = None,
    /,
    *,
    kinds: Annotated[tuple[str, ...], Parameter(consume_multiple=True)] = (
        "yard",
        "office",
        "living-room",
        "l-shaped",
    ),
    places: AtLeast1 = 24,
    views: AtLeast1 = 8,
    seed: Seed = 0,
    every: Every = 1,
    threads: Threads = ALL_CORES,
    out: Path | None = None,
) -> None:
    """Attitudes by one camera with gravity, each image for itself: of facades, of furniture, and of real buildings.

    Images are of 1280 x 720 pixels by a pinhole camera of 85 degrees, 1.5 m above the ground, with gravity told to 0.5
    degrees; those of panoramas of 640 x 480 by one of 80 degrees.

    Parameters
    ----------
    kinds
        Rendered places: yard (facades), office, living-room, corridor, l-shaped, narrow, under-table.
    places
        Places of each kind.
    views
        Images of each place and of each panorama.
    seed
        Seed of the first place of each kind; the others count on.
    out
        Also write the long table, one row for each image: .csv, .json or .parquet.
    """
    import polars as pl

    from tiltvp.lab.datasets.panoramas import read_panorama_index
    from tiltvp.lab.evaluation.corner_attitudes import (
        attitudes_in_buildings,
        attitudes_in_scenes,
        summarise_attitudes,
    )
    from tiltvp.synth import OUTDOOR_KINDS, ROOM_KINDS

    check_ending(out)
    refuse_every(directory, every)
    known = (*OUTDOOR_KINDS, *ROOM_KINDS)
    for kind in kinds:
        if kind not in known:
            raise InvalidInputError(f"--kinds {kind!r}, expected some of {', '.join(known)}")
    chosen = [] if directory is None else read_panorama_index(directory)[::every]
    with progress_bar(len(kinds) * places * views, "images") as bar:
        tables = [attitudes_in_scenes(kinds, places, views, seed=seed, threads=threads, advance=bar.advance)]
    if chosen:
        with progress_bar(len(chosen), "panoramas") as bar:
            tables.append(attitudes_in_buildings(chosen, views, seed=seed, advance=bar.advance))
    table = pl.concat(tables, how="vertical_relaxed")
    show_frame("Attitudes by one camera with gravity, each image for itself", summarise_attitudes(table), ["kind"])
    if out is not None:
        write_frame(table, out)
