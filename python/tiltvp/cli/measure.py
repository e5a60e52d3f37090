"""`tiltvp measure`: the numbers of the methods on panoramas with known tilt."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter, validators

from tiltvp.cli.terminal import new_table, progress_bar, show
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    import polars as pl

app = App(name="measure", help="Measure the methods on images of known tilt.")

_PICTURES = (".png", ".jpg", ".jpeg")


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
def planar_pose(
    *,
    pairs: Annotated[int, Parameter(validator=validators.Number(gte=1))] = 180,
    seed: Annotated[int, Parameter(validator=validators.Number(gte=0))] = 0,
    threads: Annotated[int | None, Parameter(validator=validators.Number(gte=1))] = None,
    out: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Planar-motion pose estimation (min-warping) over tilt in rendered rooms, without and with tilt correction.

    The table has the mean errors at each tilt, and the tilt beyond which a correction pays.

    Parameters
    ----------
    pairs
        Pairs of places, rounded up to whole rooms of twelve; at least two rooms.
    seed
        Seed of rooms, places, headings, leans and noise.
    threads
        Rooms worked on at once; by default one for each core.
    out
        Also write the long table, one row for each pair, lean and correction: .parquet, .csv or .json.
    plot
        Also draw the errors over tilt: .png or .jpg.
    """
    from tiltvp.cli.results import check_ending, write_frame
    from tiltvp.evaluation.planar_pose import PlanarPoseExperiment, measure_planar_pose
    from tiltvp.evaluation.planar_summary import crossings, summarise_planar_pose

    if out is not None:
        check_ending(out)
    if plot is not None:
        _check_picture(plot)
    experiment = PlanarPoseExperiment(rooms=max(2, -(-pairs // 12)), seed=seed)
    with progress_bar(experiment.steps, "places") as bar:
        table = measure_planar_pose(experiment, threads=threads, advance=bar.advance)
    if out is not None:
        write_frame(table, out)
    summary = summarise_planar_pose(table)
    pays = crossings(summary)
    if plot is not None:
        from tiltvp.images import write_image
        from tiltvp.plots.picture import figure_picture
        from tiltvp.plots.planar_pose import planar_pose as planar_pose_figure

        write_image(plot, figure_picture(planar_pose_figure(summary, pays)))
    means = summary.pivot("alpha_deg", index=["error", "correction"], values="mean_deg")
    means = means.join(pays, on=["error", "correction"], how="left", maintain_order="left")
    means = means.rename({"crossing_deg": "pays beyond"})
    pairs_found = int(summary["pairs"].to_numpy().min())
    _show(f"Mean errors of min-warping over tilt, degrees, {pairs_found} pairs", means, "error", "correction")


def _check_picture(path: Path) -> None:
    """Refuses a picture in a format that cannot be written, before any work is done."""
    if path.suffix.lower() not in _PICTURES:
        raise InvalidInputError(f"--plot {path}: ends in {path.suffix!r}, expected one of {', '.join(_PICTURES)}")


def _show(title: str, table: pl.DataFrame, *words: str) -> None:
    view = new_table(title, table.columns, left=words)
    for row in table.iter_rows():
        view.add_row(*("" if cell is None else f"{cell:.3f}" if isinstance(cell, float) else str(cell) for cell in row))
    show(view)
