"""`tiltvp measure mounting`: how well a recording tells a camera's mounting, which way is up and how it turns."""

from __future__ import annotations

from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.options import AtLeast1, Seed
from tiltvp.cli.terminal import progress_bar


def mounting(
    *,
    drives: AtLeast1 = 6,
    seed: Seed = 900,
) -> None:
    """What `tiltvp setup` and `calibrate` find on rendered recordings of drives: level and sloping floors, and bumps.

    Parameters
    ----------
    drives
        Drives by each camera over each floor, through rooms of all kinds in turn; each takes a minute.
    seed
        Seed of rooms, drives, mountings and floors.
    """
    import polars as pl

    from tiltvp.lab.evaluation.extrinsics import summarise_extrinsics
    from tiltvp.lab.evaluation.mounting import (
        CAMERAS,
        CASES,
        judge_mountings,
        summarise_findings,
        summarise_mountings,
    )

    with progress_bar(drives * len(CAMERAS) * len(CASES), "drives") as bar:
        rows = pl.DataFrame(list(judge_mountings(drives, seed, advance=bar.advance)), infer_schema_length=None)
    show_frame("Errors of the mounting in degrees", summarise_mountings(rows), ["looks", "floor", "method"])
    show_frame("Shares of drives in per cent", summarise_findings(rows), ["looks"])
    title = "Extrinsics but the height: rms errors where said to be reliable, shares of drives in per cent"
    show_frame(title, summarise_extrinsics(rows), ["looks", "floor"])
