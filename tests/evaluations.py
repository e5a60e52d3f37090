"""What the tests of evaluations share: a run of table 3's parameters, and when two of them are the same."""

from __future__ import annotations

from pathlib import Path

import polars as pl

from tiltvp.lab.datasets.folder import TiltDataset
from tiltvp.lab.evaluation.combinations import choose
from tiltvp.lab.evaluation.experiment import open_experiment
from tiltvp.lab.evaluation.runs import Run
from tiltvp.lab.evaluation.schema import without_times


def evaluated(dataset: TiltDataset, directory: Path, threads: int = 1, cluster: str | None = None) -> Run:
    """A run of table 3's parameters."""
    with open_experiment(dataset, choose("table3"), directory, sweep="table3") as experiment:
        experiment.estimate(threads=threads, cluster=cluster)
        return experiment.conclude(threads=threads)


def same_bytes(one: pl.DataFrame, other: pl.DataFrame) -> bool:
    """Equal to the last bit in everything but times."""
    return without_times(one).equals(without_times(other), null_equal=True)
