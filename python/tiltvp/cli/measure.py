"""`tiltvp measure`: the numbers of the methods on panoramas with known tilt, and of the self-calibration."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from tiltvp.cli.terminal import new_table, progress_bar, show

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
def calibration(odometry: Path | None = None, /, *, runs: int = 1000, out: Path | None = None) -> None:
    """Self-calibration on simulated drives, both filters, against the Cramer-Rao bound; and on real logs.

    Parameters
    ----------
    odometry
        Folder with victoria_park, brenner_lego and censi_khepera; without it only the simulated drives.
    runs
        Simulated drives of each trajectory.
    out
        Also write the table of all simulated runs as Parquet.
    """
    import polars as pl

    from tiltvp.evaluation.calibration import real_logs, simulated_drives, summarise_drives
    from tiltvp.selfcalib import consistency_band

    parts, summaries = [], []
    with progress_bar(4 * runs, "drives") as bar:
        for kind in ("paper", "alternating"):
            for method in ("default", "paper"):
                table = simulated_drives(kind, method, runs, advance=bar.advance)
                parts.append(table.with_columns(trajectory=pl.lit(kind), method=pl.lit(method)))
                summaries.append({"trajectory": kind, "method": method, **summarise_drives(table)})
    if out is not None:
        pl.concat(parts).write_parquet(out)
    low, high = consistency_band(0.95, 3, runs)
    _show(f"Simulated drives; NEES of a consistent filter: {low:.3f} to {high:.3f}", pl.DataFrame(summaries), "method")
    if odometry is not None:
        with progress_bar(6, "logs") as bar:
            _show("Real logs: error against the nominal mounting", real_logs(odometry, advance=bar.advance), "log")


def _show(title: str, table: pl.DataFrame, words: str) -> None:
    view = new_table(title, table.columns, left=[words])
    for row in table.iter_rows():
        view.add_row(*("" if cell is None else f"{cell:.3f}" if isinstance(cell, float) else str(cell) for cell in row))
    show(view)
