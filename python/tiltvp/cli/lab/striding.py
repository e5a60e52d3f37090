"""`tiltvp measure striding`: what `row_stride` costs in accuracy and saves in time."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter, validators

from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.tables import check_ending, write_frame
from tiltvp.cli.terminal import progress_bar


def striding(
    directory: Path | None = None,
    /,
    *,
    every: Annotated[int, Parameter(validator=validators.Number(gte=1))] = 1,
    rooms: Annotated[int, Parameter(validator=validators.Number(gte=0))] = 6,
    out: Path | None = None,
) -> None:
    """Methods of edge pixels on every row, every second, third and fourth row of views: errors, regions, times.

    Parameters
    ----------
    directory
        Folder with the panoramas and an INDEX.csv of columns name, environment, tilt_x_deg, tilt_z_deg; without one,
        rendered rooms alone are measured.
    every
        Take one panorama in so many.
    rooms
        Rendered rooms of each kind; 0 for none.
    out
        Also write the long table, one row for each view, method and stride: .csv, .json or .parquet.
    """
    import polars as pl

    from tiltvp.lab.datasets.panoramas import paper_camera
    from tiltvp.lab.evaluation.striding import stride_views, summarise_strides
    from tiltvp.lab.evaluation.views import view_sources

    if out is not None:
        check_ending(out)
    camera, tables = paper_camera(), []
    for source in view_sources(directory, camera, every=every, rooms=rooms):
        with progress_bar(source.count, source.title) as bar:
            table = stride_views(source.views, camera, advance=bar.advance)
        tables.append(table.with_columns(source=pl.lit(source.title)))
        title = f"{source.title}: degrees (eq. 44), truths in 90 % regions, time"
        show_frame(title, summarise_strides(table), ["method"])
    if out is not None:
        write_frame(pl.concat(tables), out)
