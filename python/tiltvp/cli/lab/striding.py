"""`tiltvp measure striding`: what `row_stride` costs in accuracy and saves in time."""

from __future__ import annotations

from pathlib import Path

from tiltvp.cli.lab.measure_options import Every, PanoramasIfAny, Rooms, refuse_every
from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.tables import check_ending, write_frame
from tiltvp.cli.terminal import progress_bar


def striding(
    directory: PanoramasIfAny = None,
    /,
    *,
    every: Every = 1,
    rooms: Rooms = 6,
    out: Path | None = None,
) -> None:
    """Methods of edge pixels on every row, every second, third and fourth row of views: errors, regions, times.

    Parameters
    ----------
    out
        Also write the long table, one row for each view, method and stride: .csv, .json or .parquet.
    """
    import polars as pl

    from tiltvp.lab.datasets.panoramas import paper_camera
    from tiltvp.lab.evaluation.striding import stride_views, summarise_strides
    from tiltvp.lab.evaluation.views import view_sources

    check_ending(out)
    refuse_every(directory, every)
    camera, tables = paper_camera(), []
    for source in view_sources(directory, camera, every=every, rooms=rooms):
        with progress_bar(source.count, source.title) as bar:
            table = stride_views(source.views, camera, advance=bar.advance)
        tables.append(table.with_columns(source=pl.lit(source.title)))
        title = f"{source.title}: degrees (eq. 44), truths in 90 % regions, time"
        show_frame(title, summarise_strides(table), ["method"])
    if out is not None:
        write_frame(pl.concat(tables), out)
