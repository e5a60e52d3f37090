"""`tiltvp evaluate`: the methods on a dataset of known tilt, as a run that can be continued, and its tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.options import ALL_CORES, Seed, Threads
from tiltvp.cli.terminal import progress_bar, say
from tiltvp.files import refuse_file_name

if TYPE_CHECKING:
    import polars as pl

    from tiltvp.lab.evaluation.runs import Run


def evaluate(
    dataset: Path,
    /,
    *,
    out: Path,
    sweep: str = "paper",
    methods: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    threads: Threads = ALL_CORES,
    cluster: str | None = None,
    seed: Seed = 0,
) -> None:
    """Run the methods over a dataset, train the corrections location by location, and print the paper's tables.

    A run that is interrupted, by whatever, is continued by the same command.

    Parameters
    ----------
    dataset
        Folder with a dataset.toml and an images.csv.
    out
        Folder of the run: a manifest, and a table with a row for each image, combination and correction.
    sweep
        What is tried. paper: all combinations of table 2, and ours; table3: the best of them.
    methods
        Only these methods of the sweep.
    cluster
        Address of a Dask scheduler whose workers do the work. They see the dataset at the same path.
    seed
        Seed of the sampling methods.
    """
    from tiltvp.lab.datasets.folder import read_dataset
    from tiltvp.lab.evaluation.combinations import choose
    from tiltvp.lab.evaluation.experiment import open_experiment

    refuse_file_name(out)
    combinations = choose(sweep, methods)
    with open_experiment(read_dataset(dataset), combinations, out, sweep=sweep, seed=seed) as experiment:
        done = experiment.images - len(experiment.missing())
        if done:
            say(f"{out}: {done} of {experiment.images} images were done before")
        with progress_bar(experiment.images, "images", done=done) as bar:
            experiment.estimate(threads=threads, cluster=cluster, advance=bar.advance)
        with progress_bar(len(combinations), "corrections") as bar:
            run = experiment.conclude(threads=threads, advance=bar.advance)
    show_tables(run)


def show_tables(run: Run) -> None:
    """The tables of a run on stdout."""
    from tiltvp.lab.evaluation.summary import advantage, reading_of_q, table_3, table_4

    summary = determined_errors(run.table)
    images = run.manifest["dataset"]["images"]
    chosen = f"Table 3: errors in degrees (eq. 44) on {images} images, with the parameters of least mean error"
    for title, frame in (
        (chosen, table_3(summary)),
        ("Table 4: times in milliseconds", table_4(summary)),
        ("What Q means: reject-refit with trained a, I_min 200, degrees", reading_of_q(summary)),
        ("How many times smaller the errors of refined are", advantage(summary)),
    ):
        if len(frame):
            show_frame(title, frame, ["label", "correction", "reading"], hidden=["method", "combination", "group"])


def determined_errors(table: pl.DataFrame) -> pl.DataFrame:
    """The errors of a long table, without the corrections that its locations do not determine, of which it says so."""
    from tiltvp.lab.evaluation.summary import determined, errors

    summary = errors(table)
    shown = determined(summary)
    if left := len(summary) - len(shown):
        say(f"{left} trained corrections are left out: images of other locations, which train them, are too few")
    return shown
