"""`tiltvp measure calibration`, `calibration-images`, `trust-calibration` and `trust-pictures`: self-calibration."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tiltvp.cli.lab.measure_options import LeansDeg, Saved
from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.options import ALL_CORES, AtLeast1, Seed, Threads, check_word
from tiltvp.cli.tables import check_ending, write_frame
from tiltvp.cli.terminal import progress_bar
from tiltvp.errors import InvalidInputError

_TRAJECTORIES = ("paper", "alternating")
_LINES = (1, 2, 5, 10, 20)
"""How many vertical lines are seen, for how soon a calibration is right."""


def calibration(
    odometry: Path | None = None,
    /,
    *,
    runs: AtLeast1 = 1000,
    only: str = "",
    out: Saved = None,
) -> None:
    """Self-calibration on simulated drives, both filters, against the Cramer-Rao bound; by how many lines are seen, how
    soon it is right; and on real logs.

    Parameters
    ----------
    odometry
        Folder with victoria_park, brenner_lego and censi_khepera; without it only the simulated drives.
    runs
        Simulated drives of each trajectory.
    only
        Only the parts whose names hold this: "simulated paper default", "simulated paper paper", "simulated alternating
        default", "simulated alternating paper" (trajectory and method), "lines paper", "lines alternating",
        "victoria_park", "brenner_lego", "censi lstraight", "censi l90", "censi lmov".
    out
        Also write the table of all simulated runs: .csv, .json or .parquet.
    """
    import polars as pl

    from tiltvp.lab.evaluation.calibration import (
        LOG_PARTS,
        convergence,
        read_logs,
        real_logs,
        simulated_drives,
        summarise_drives,
    )
    from tiltvp.selfcalib import consistency_band

    check_ending(out)
    drives = [
        (kind, method)
        for kind in _TRAJECTORIES
        for method in ("default", "paper")
        if only in f"simulated {kind} {method}"
    ]
    counted = [kind for kind in _TRAJECTORIES if only in f"lines {kind}"]
    logs = [] if odometry is None else read_logs(odometry, only=only)
    if not drives and not counted and not logs:
        raise InvalidInputError(f'--only {only}: no part of that name, expected for example "simulated" or "victoria"')
    if out is not None and not drives:
        raise InvalidInputError(f"--out {out}: --only {only} leaves out the simulated drives, of which it is the table")
    parts, summaries = [], []
    if drives:
        with progress_bar(len(drives) * runs, "drives") as bar:
            for kind, method in drives:
                table = simulated_drives(kind, method, runs, advance=bar.advance)
                parts.append(table.with_columns(trajectory=pl.lit(kind), method=pl.lit(method)))
                summaries.append({"trajectory": kind, "method": method, **summarise_drives(table)})
        if out is not None:
            write_frame(pl.concat(parts), out)
        low, high = consistency_band(0.95, 3, runs)
        title = f"Simulated drives; NEES of a consistent filter: {low:.3f} to {high:.3f}"
        show_frame(title, pl.DataFrame(summaries), ["method"])
    if counted:
        # A tenth of the runs tells it well enough: differences are of several times.
        few = max(1, runs // 10)
        with progress_bar(len(counted) * len(_LINES) * few, "drives") as bar:
            rows = [convergence(kind, lines, few, advance=bar.advance) for kind in counted for lines in _LINES]
        show_frame("How far to drive until errors stay below 10 mm and 0.5 degrees", pl.DataFrame(rows), ["trajectory"])
    if logs:
        with progress_bar(LOG_PARTS * len(logs), "logs") as bar:
            table = real_logs(logs, advance=bar.advance)
        show_frame("Real logs: error against the nominal mounting", table, ["log"])


def calibration_images(
    *,
    drives: AtLeast1 = 2,
    kinds: Annotated[tuple[str, ...], Parameter(consume_multiple=True)] = ("hall", "corridor"),
    leans_deg: LeansDeg = (0.0, 3.0),
    trajectory: str = "paper",
    seed: Seed = 9101,
    threads: Threads = ALL_CORES,
    out: Saved = None,
) -> None:
    """Self-calibration from the pictures of rendered drives: tilt, lines, tracks, mounting; errors in degrees and mm.

    Parameters
    ----------
    drives
        Drives of each kind and lean.
    kinds
        Where to drive: corridor, hall, office, living-room, l-shaped, narrow or under-table.
    leans_deg
        Greatest leans from bumps.
    trajectory
        paper or alternating.
    seed
        Seed of the first room and drive.
    """
    from tiltvp.lab.evaluation.calibration_images import PictureExperiment, picture_drives

    check_ending(out)
    check_word("--trajectory", trajectory, _TRAJECTORIES)
    experiment = PictureExperiment(
        kinds=kinds, leans_max_deg=leans_deg, drives=drives, seed=seed, trajectory=trajectory
    )
    with progress_bar(len(experiment.cases), "drives") as bar:
        table = picture_drives(experiment, threads=threads, advance=bar.advance)
    if out is not None:
        write_frame(table, out)
    show_frame(f"From pictures, errors along the {trajectory} trajectory, degrees and mm", table, ["kind", "by"])


def trust_calibration(
    *,
    drives: AtLeast1 = 100,
    seed: Seed = 100_000,
    only: str = "",
    out: Path | None = None,
) -> None:
    """Self-calibration on simulated logs that mislead: answers, those wrong and sure, abstentions, causes named.

    Wrong is a NEES beyond its 99.9 % quantile, or an error beyond five standard deviations of the Cramer-Rao bound;
    sure is a verdict that the answer can be relied upon. A cause is named by the reason, whatever the verdict.

    Parameters
    ----------
    drives
        Drives of each case.
    seed
        Seed of the first drive.
    only
        Only the cases whose names hold this: "base", "wheels swapped".
    out
        Also write the long table, one row for each drive and way: .csv, .json or .parquet.
    """
    import polars as pl

    from tiltvp.lab.datasets.hostile_drives import DRIVE_CASES, hostile_drives
    from tiltvp.lab.evaluation.hostile_drives import judge_drives, summarise_drive_cases

    cases = [name for name in DRIVE_CASES if only in name]
    if not cases:
        raise InvalidInputError(f"--only {only}: no case of that name, expected one of {', '.join(DRIVE_CASES)}")
    check_ending(out)
    with progress_bar(len(cases) * drives, "drives") as bar:
        seeds = range(seed, seed + drives)
        tables = [judge_drives(hostile_drives(case, seeds), advance=bar.advance) for case in cases]
    # Where no cause is to be named, a table does not tell the type of its column.
    table = pl.concat(tables, how="vertical_relaxed")
    if out is not None:
        write_frame(table, out)
    show_frame(f"Shares in per cent, of {drives} drives of each case", summarise_drive_cases(table), ["case", "by"])


def trust_pictures(
    *,
    drives: AtLeast1 = 2,
    kinds: Annotated[tuple[str, ...], Parameter(consume_multiple=True)] = ("hall", "corridor", "office", "living-room"),
    seed: Seed = 9501,
    only: str = "",
    threads: Threads = ALL_CORES,
    out: Saved = None,
) -> None:
    """Self-calibration from pictures that mislead: answers, those wrong and sure, abstentions, causes named.

    Each drive is rendered once, in frames 0.08 m and 6 degrees apart, level and over bumps of 3 degrees, and then told
    wrongly, disturbed or cut in many ways. Wrong is a NEES beyond its 99.9 % quantile; sure and named as of
    `trust-calibration`.

    Parameters
    ----------
    drives
        Drives of each kind, level and over bumps.
    kinds
        As of `calibration-images`.
    seed
        Seed of the first room and drive.
    only
        Only the cases whose names hold this: "base", "wheels swapped".
    out
        Also write the long table, one row for each drive, case and way.
    """
    from tiltvp.lab.datasets.hostile_pictures import PICTURE_CASES
    from tiltvp.lab.evaluation.calibration_images import PictureExperiment
    from tiltvp.lab.evaluation.hostile_drives import summarise_drive_cases
    from tiltvp.lab.evaluation.hostile_pictures import judge_picture_drives

    cases = [name for name in PICTURE_CASES if only in name]
    if not cases:
        raise InvalidInputError(f"--only {only}: no case of that name, expected one of {', '.join(PICTURE_CASES)}")
    check_ending(out)
    experiment = PictureExperiment(
        kinds=kinds, drives=drives, seed=seed, samples=1, step_m=0.08, turn_max_rad=math.radians(6.0)
    )
    count = len(experiment.cases)
    with progress_bar(count * len(cases), "drives") as bar:
        table = judge_picture_drives(experiment, cases, threads=threads, advance=bar.advance)
    if out is not None:
        write_frame(table, out)
    show_frame(f"Shares in per cent, of {count} drives of each case", summarise_drive_cases(table), ["case", "by"])
