"""`tiltvp measure`: the numbers of the methods on panoramas with known tilt."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from tiltvp.cli.terminal import new_table, progress_bar, say, show
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    import polars as pl

app = App(name="measure", help="Measure the methods on images of known tilt.")


@app.command
def panoramas(
    directory: Path,
    /,
    *,
    every: int = 1,
    samples: int = 2,
    noise_sigma: float = 2.0,
    turn: Annotated[bool, Parameter(negative="")] = False,
    out: Path | None = None,
) -> None:
    """Every method on views of upright panoramas through an upward fisheye, at the seven leans of the paper's table 1.

    Parameters
    ----------
    directory
        Folder with the panoramas and an INDEX.csv of columns name, environment, tilt_x_deg, tilt_z_deg.
    every
        Take every so-manieth panorama.
    samples
        Rays per pixel and side.
    noise_sigma
        Gaussian noise in grey levels.
    turn
        Give each view a heading of its own.
    out
        Also write the long table, one row for each image and method, as Parquet.
    """
    from tiltvp.datasets.panoramas import paper_camera, read_panorama_index
    from tiltvp.evaluation.panoramas import estimate_views, summarise

    chosen = read_panorama_index(directory)[::every]
    with progress_bar(len(chosen), "panoramas") as bar:
        table = estimate_views(
            chosen, paper_camera(), samples=samples, noise_sigma=noise_sigma, turn=turn, advance=bar.advance
        )
    if out is not None:
        table.write_parquet(out)
    _show(f"Errors in degrees (eq. 44), {len(chosen)} panoramas", summarise(table), "variant")


@app.command
def inertial(directory: Path, /, *, samples: int = 2) -> None:
    """The refined method on panoramas as they were taken, against the camera's own inertial sensor.

    Parameters
    ----------
    directory
        Folder with the panoramas and an INDEX.csv of columns name, environment, imu_pitch_deg, imu_roll_deg.
    samples
        Rays per pixel and side.
    """
    from tiltvp.datasets.panoramas import paper_camera
    from tiltvp.evaluation.imu import estimate_leaning, read_inertial_index, summarise_inertial

    chosen = read_inertial_index(directory)
    with progress_bar(len(chosen), "panoramas") as bar:
        table = estimate_leaning(chosen, paper_camera(), samples=samples, advance=bar.advance)
    _show("Refined lean minus sensor, degrees, constant offset removed", summarise_inertial(table), "panoramas")


@app.command
def sampling(
    directory: Path | None = None,
    /,
    *,
    every: int = 4,
    rooms: int = 4,
    kind: str | None = None,
    seeds: int = 5,
    samples: int = 2,
    noise_sigma: float = 2.0,
    out: Path | None = None,
) -> None:
    """Each option of the sampling loop, alone and together, against plain RANSAC: errors, trials, times, what pays.

    Parameters
    ----------
    directory
        Folder with the panoramas and an INDEX.csv of columns name, environment, tilt_x_deg, tilt_z_deg; without one,
        rendered rooms alone are measured.
    every
        Take every so-manieth panorama.
    rooms
        Rendered rooms of each kind; 0 for none.
    kind
        Rooms of this kind alone.
    seeds
        Seeds for each image.
    samples
        Rays per pixel and side.
    noise_sigma
        Gaussian noise in grey levels.
    out
        Also write the long table, one row for each image, method, way and seed, as Parquet.
    """
    import polars as pl

    from tiltvp.datasets.panoramas import TABLE_1_TILTS_DEG, paper_camera, read_panorama_index
    from tiltvp.evaluation.sampling import panorama_views, room_views, sample_views, summarise_sampling
    from tiltvp.synth import ROOM_KINDS

    if directory is None and rooms <= 0:
        raise InvalidInputError(f"--rooms {rooms}, expected a folder of panoramas, or rooms to render")
    chosen = [] if directory is None else read_panorama_index(directory)[::every]
    camera, kinds = paper_camera(), ROOM_KINDS if kind is None else (kind,)
    sources = {
        f"{len(chosen)} panoramas": (
            len(chosen), panorama_views(chosen, camera, samples=samples, noise_sigma=noise_sigma)
        ),
        f"{rooms * len(kinds)} rooms": (
            rooms * len(kinds), room_views(rooms, camera, samples=samples, noise_sigma=noise_sigma, kinds=kinds)
        ),
    }  # fmt: skip
    tables = []
    for title, (places, views) in sources.items():
        if places == 0:
            continue
        with progress_bar(places * len(TABLE_1_TILTS_DEG), title) as bar:
            table = sample_views(views, camera, seeds=seeds, advance=bar.advance)
        tables.append(table.with_columns(source=pl.lit(title)))
        summary = summarise_sampling(table)
        for (method,), part in summary.group_by("method", maintain_order=True):
            _show(f"{title}, {method}: degrees (eq. 44)", part.drop("method"), "way")
            paying = part.filter(~pl.col("pays").is_in(["", "no"])).select("way", "pays", "image").iter_rows()
            words = [f"{way} (in {what}, at {image:.2f} of an image's time)" for way, what, image in paying]
            say(f"Pays: {'; '.join(words) or 'none'}.")
    if out is not None and tables:
        pl.concat(tables).write_parquet(out)


def _show(title: str, table: pl.DataFrame, words: str) -> None:
    view = new_table(title, table.columns, left=[words])
    for row in table.iter_rows():
        view.add_row(*("" if cell is None else f"{cell:.3f}" if isinstance(cell, float) else str(cell) for cell in row))
    show(view)
