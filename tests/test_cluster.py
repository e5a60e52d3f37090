"""Evaluations on a Dask cluster of two worker processes: the same table, also when a worker is killed half-way."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from dask.distributed import LocalCluster
from distributed.client import FutureState

from evaluations import evaluated, same_bytes
from tiltvp.cli import main
from tiltvp.errors import MissingExtraError, RunError
from tiltvp.lab.cluster import results_of
from tiltvp.lab.datasets.folder import TiltDataset
from tiltvp.lab.evaluation import cluster as module
from tiltvp.lab.evaluation.combinations import choose
from tiltvp.lab.evaluation.experiment import open_experiment
from tiltvp.lab.evaluation.runs import Run

pytestmark = pytest.mark.slow

NOBODY = "tcp://127.0.0.1:9"


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Two worker processes of one thread each, on a scheduler in this process."""
    quiet = {"dashboard_address": ":0", "silence_logs": "CRITICAL"}
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, **quiet) as local:
        yield local


def test_the_same_table_on_a_cluster(tmp_path: Path, dataset: TiltDataset, whole: Run, cluster: Any) -> None:
    run = evaluated(dataset, tmp_path / "run", cluster=cluster.scheduler_address)
    assert same_bytes(run.table, whole.table)
    assert {path.name for path in (tmp_path / "run").iterdir()} == {"manifest.json", "estimates.parquet"}


def test_a_dataset_that_workers_do_not_see(tmp_path: Path, dataset: TiltDataset, cluster: Any) -> None:
    class Moved(TiltDataset):
        def digest(self, *_: object) -> str:
            return "other"

    fields = {name: getattr(dataset, name) for name in ("directory", "camera", "robot_from_camera", "mask", "images")}
    with pytest.raises(RunError, match="a worker sees another dataset"):
        evaluated(Moved(**fields), tmp_path / "run", cluster=cluster.scheduler_address)


def test_a_worker_killed_half_way(
    tmp_path: Path, dataset: TiltDataset, whole: Run, cluster: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_CHUNK", 1)
    done: list[int] = []

    def advance() -> None:
        done.append(len(done))
        if len(done) == 3:
            os.kill(cluster.workers[0].pid, signal.SIGKILL)

    with open_experiment(dataset, choose("table3"), tmp_path / "run", sweep="table3") as experiment:
        experiment.estimate(cluster=cluster.scheduler_address, advance=advance)
        assert same_bytes(experiment.conclude().table, whole.table)
    assert len(done) == 15


def test_nobody_answers(
    tmp_path: Path, dataset: TiltDataset, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("tiltvp.lab.cluster._PATIENCE_S", 0.5)
    words = ["evaluate", str(dataset.directory), "--sweep", "table3", "--out", str(tmp_path / "run")]
    for address, told in (
        (NOBODY, "no Dask scheduler answers"),
        ("nowhere", "no address of a Dask scheduler"),
        ("http://127.0.0.1:9", "no address of a Dask scheduler"),
    ):
        assert main([*words, "--cluster", address]) == 2
        assert f"tiltvp: {address}: {told}" in capsys.readouterr().err


SCHEDULER = """
from dask.distributed import LocalCluster
cluster = LocalCluster(n_workers=1, threads_per_worker=1, processes=False, protocol="tcp://", dashboard_address=":0")
print(cluster.scheduler_address, flush=True)
input()
cluster.scale(0)
input()
"""


@pytest.mark.parametrize(
    ("lost", "told"), [("scheduler", "the scheduler has gone"), ("workers", "without workers for 0.5 s")]
)
def test_what_is_lost_in_the_middle(
    lost: str, told: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("tiltvp.lab.cluster._WORKERS_S", 0.5)
    cancel = FutureState.cancel

    def slowly(*given: Any, **named: Any) -> None:
        """Dask cancels in its own thread what is lost, while this one takes results that are there and submits more."""
        time.sleep(1e-3)
        cancel(*given, **named)

    monkeypatch.setattr(FutureState, "cancel", slowly)
    pipe, null = subprocess.PIPE, subprocess.DEVNULL
    with subprocess.Popen(
        [sys.executable, "-c", SCHEDULER], stdin=pipe, stdout=pipe, stderr=null, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdin is not None
        made = results_of(process.stdout.readline().strip(), max, 1, ((number, 2) for number in count()))
        try:
            assert next(made)[1] == 2
            time.sleep(1.0)  # Hundreds of results are there.
            if lost == "scheduler":
                process.kill()
            else:
                print(file=process.stdin, flush=True)
            with pytest.raises(RunError, match=told):
                list(made)
        finally:
            process.kill()
    assert "Traceback" not in capfd.readouterr().err


def test_without_dask(tmp_path: Path, dataset: TiltDataset, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "dask.distributed", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'tiltvp\[cluster\]'"):
        evaluated(dataset, tmp_path / "run", cluster=NOBODY)
