"""`tiltvp measure planar-pose`: what a lean costs planar-motion pose estimation, and what its correction saves."""

from __future__ import annotations

from pathlib import Path

from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.options import ALL_CORES, AtLeast1, Seed, Threads
from tiltvp.cli.tables import PICTURES, check_ending, check_file, write_frame
from tiltvp.cli.terminal import progress_bar

_PAIRS_OF_A_ROOM = 12


def planar_pose(
    *,
    pairs: AtLeast1 = 180,
    seed: Seed = 0,
    threads: Threads = ALL_CORES,
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
    out
        Also write the long table, one row for each pair, lean and correction: .parquet, .csv or .json.
    plot
        Also draw the errors over tilt: .png or .jpg.
    """
    from tiltvp.lab.evaluation.planar_pose import PlanarPoseExperiment, measure_planar_pose
    from tiltvp.lab.evaluation.planar_summary import crossings, summarise_planar_pose

    check_ending(out)
    check_file("--plot", plot, *PICTURES)
    experiment = PlanarPoseExperiment(rooms=max(2, -(-pairs // _PAIRS_OF_A_ROOM)), seed=seed)
    with progress_bar(experiment.steps, "places") as bar:
        table = measure_planar_pose(experiment, threads=threads, advance=bar.advance)
    if out is not None:
        write_frame(table, out)
    summary = summarise_planar_pose(table)
    pays = crossings(summary)
    if plot is not None:
        from tiltvp.images import write_image
        from tiltvp.lab.plots.picture import figure_picture
        from tiltvp.lab.plots.planar_pose import planar_pose as planar_pose_figure

        write_image(plot, figure_picture(planar_pose_figure(summary, pays)))
    means = summary.pivot("alpha_deg", index=["error", "correction"], values="mean_deg")
    means = means.join(pays, on=["error", "correction"], how="left", maintain_order="left")
    means = means.rename({"crossing_deg": "pays beyond"})
    found = int(summary["pairs"].to_numpy().min())
    show_frame(f"Mean errors of min-warping over tilt, degrees, {found} pairs", means, ["error", "correction"])
