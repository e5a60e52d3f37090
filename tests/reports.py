"""The run of the paper's sweep over a small dataset of rendered rooms, and its report."""

from __future__ import annotations

from pathlib import Path

import pytest

from tiltvp.lab.datasets.folder import TiltDataset
from tiltvp.lab.evaluation.combinations import choose
from tiltvp.lab.evaluation.experiment import open_experiment
from tiltvp.lab.evaluation.runs import read_run
from tiltvp.lab.report.contents import contents_of
from tiltvp.lab.report.files import write_report


@pytest.fixture(scope="session")
def run(dataset: TiltDataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the run."""
    directory = tmp_path_factory.mktemp("report") / "run"
    with open_experiment(dataset, choose("paper"), directory, sweep="paper") as experiment:
        experiment.estimate()
        experiment.conclude()
    return directory


@pytest.fixture(scope="session")
def report(run: Path) -> Path:
    """The folder of its report; small pictures are quicker to draw."""
    out = run.parent / "out"
    write_report(contents_of(read_run(run)), out, dpi=72.0)
    return out
