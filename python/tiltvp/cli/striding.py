"""`tiltvp measure striding`: what `row_stride` costs in accuracy and saves in time."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter, validators

from tiltvp.cli.results import check_ending, show_frame, write_frame
from tiltvp.cli.terminal import progress_bar
from tiltvp.errors import InvalidInputError


def striding(
    directory: Path | None = None,
    /,
    *,
    every: Annotated[int, Parameter(validator=validators.Number(gte=1))] = 1,
    rooms: Annotated[int, Parameter(validator=validators.Number(gte=0))] = 6,
    out: Path | None = None,
) -> None:
    """Each method on every row, every second, third and fourth row of the same views: errors, regions, times.

    Parameters
    ----------
    directory
        Folder with the panoramas and an INDEX.csv of columns name, environment, tilt_x_deg, tilt_z_deg; without one,
        rendered rooms alone are measured.
    every
        Take every so-manieth panorama.
    rooms
        Rendered rooms of each kind; 0 for none.
    out
        Also write the long table, one row for each view, method and stride: .csv, .json or .parquet.
    """
    import polars as pl

    from tiltvp.datasets.panoramas import TABLE_1_TILTS_DEG, paper_camera, read_panorama_index
    from tiltvp.evaluation.striding import stride_views, summarise_strides
    from tiltvp.evaluation.views import panorama_views, room_views
    from tiltvp.synth import ROOM_KINDS

    if out is not None:
        check_ending(out)
    chosen = [] if directory is None else read_panorama_index(directory)[::every]
    sources = {
        f"{len(chosen)} panoramas": (len(chosen), panorama_views(chosen, paper_camera())),
        f"{rooms * len(ROOM_KINDS)} rooms": (rooms * len(ROOM_KINDS), room_views(rooms, paper_camera())),
    }
    tables = []
    for title, (places, views) in sources.items():
        if places == 0:
            continue
        with progress_bar(places * len(TABLE_1_TILTS_DEG), title) as bar:
            table = stride_views(views, paper_camera(), advance=bar.advance)
        tables.append(table.with_columns(source=pl.lit(title)))
        show_frame(f"{title}: degrees (eq. 44), truths in 90 % regions, time", summarise_strides(table), ["method"])
    if not tables:
        raise InvalidInputError(f"--rooms {rooms}, expected a folder of panoramas, or rooms to render")
    if out is not None:
        write_frame(pl.concat(tables), out)
