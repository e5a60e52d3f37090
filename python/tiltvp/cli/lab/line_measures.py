"""`tiltvp measure lines`: vertical lines found and followed on rendered drives."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tiltvp.cli.declared_options import Whole
from tiltvp.cli.lab.measure_options import LeansDeg
from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.options import ALL_CORES, AtLeast1, Seed, Threads, at_least
from tiltvp.cli.tables import check_ending, write_frame
from tiltvp.cli.terminal import progress_bar


def lines(
    *,
    frames: Annotated[Whole, at_least(2)] = 400,
    kinds: Annotated[tuple[str, ...], Parameter(consume_multiple=True)] = ("corridor", "hall"),
    leans_deg: LeansDeg = (0.0, 5.0),
    seed: Seed = 9001,
    samples: AtLeast1 = 2,
    threads: Threads = ALL_CORES,
    out: Path | None = None,
) -> None:
    """How well vertical lines are found and followed on rendered drives below a mirror, by us and as the paper has it.

    Tables have the rates of correct matches, false matches and false new entries (table 3 of Scaramuzza et al. 2009),
    errors of bearings, the share of true edges that are found, and processor times.

    Parameters
    ----------
    frames
        Frames of each drive; there is one for each kind and lean.
    kinds
        Where to drive: corridor, hall, office, living-room, l-shaped, narrow or under-table.
    leans_deg
        Greatest leans from bumps; each kind has the same way for all.
    seed
        Seed of the first room and drive.
    samples
        Rays per pixel and side where surfaces meet.
    out
        Also write the long table, one row for each frame and variant: .csv, .json or .parquet.
    """
    from tiltvp.lab.evaluation.lines import LineExperiment, line_intervals, measure_lines, summarise_lines

    check_ending(out)
    experiment = LineExperiment(frames=frames, kinds=kinds, leans_max_deg=leans_deg, seed=seed, samples=samples)
    with progress_bar(experiment.steps, "frames") as bar:
        table = measure_lines(experiment, threads=threads, advance=bar.advance)
    if out is not None:
        write_frame(table, out)
    show_frame(f"Vertical lines on {experiment.steps} frames, angles in degrees", summarise_lines(table), ["variant"])
    show_frame("Recognition rate of the default variant", line_intervals(table), ["kind", "interval"])
