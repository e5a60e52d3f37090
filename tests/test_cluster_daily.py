"""`--cluster` of the daily verbs on two worker processes: the same table, with a worker killed, and gone on with."""

from __future__ import annotations

import json
import os
import shutil
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from dask.distributed import LocalCluster
from polars.testing import assert_frame_equal

import tiltvp
from commands import Run
from tiltvp.cli import cluster as module
from tiltvp.lab import cluster as on_dask
from tiltvp.synth import RoomImage

pytestmark = pytest.mark.slow

COUNT = 17


@pytest.fixture(scope="module")
def workers() -> Iterator[Any]:
    """Two worker processes of one thread each, on a scheduler in this process."""
    quiet = {"dashboard_address": ":0", "silence_logs": "CRITICAL"}
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, **quiet) as local:
        yield local


@pytest.fixture
def run(run: Run, monkeypatch: pytest.MonkeyPatch, world: Path) -> Run:
    """Runs `tiltvp` in the folder of the images: exit code, stdout, stderr."""
    monkeypatch.chdir(world)
    monkeypatch.setattr(module, "_CHUNK", 2)
    return run


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory, camera: tiltvp.Camera, room: RoomImage) -> Path:
    """Images of a turning robot, one that is broken, one of another size, one that is black."""
    folder = tmp_path_factory.mktemp("many")
    camera.save(folder / "camera.toml")
    for number in range(COUNT):
        tiltvp.write_image(folder / "images" / f"{number:02d}.png", np.ascontiguousarray(np.rot90(room.bgr, number)))
    tiltvp.write_image(folder / "images" / "05.png", room.gray[:100])
    tiltvp.write_image(folder / "images" / "06.png", np.zeros_like(room.gray))
    (folder / "images" / "11.png").write_bytes(b"no image")
    return folder


def table_of(folder: Path) -> pl.DataFrame:
    return pl.read_parquet(sorted(folder.glob("part-*.parquet"))).drop("time_s")


def test_the_same_table_with_a_worker_killed(
    run: Run, world: Path, tmp_path: Path, workers: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ("tilt", "images", "--camera", "camera.toml", "--confidence-min", 0.4)
    code, _, complaints = run(*words, "--out", tmp_path / "one.parquet", "--level", tmp_path / "one")
    assert code == 1
    results, killed = on_dask.results_of, []

    def killing(*given: Any) -> Iterator[Any]:
        for count, done in enumerate(results(*given)):
            if count == 2:
                killed.append(next(iter(workers.workers.values())).pid)
                os.kill(killed[0], signal.SIGKILL)
            yield done

    monkeypatch.setattr(on_dask, "results_of", killing)
    many = ("--cluster", workers.scheduler_address, "--out", tmp_path / "many", "--level", tmp_path / "level")
    code, said, told = run(*words, *many)
    assert (code, len(killed)) == (1, 1), told
    assert said == f"{tmp_path / 'many'}: {COUNT} images; {COUNT - 3} with a tilt, 2 could not be used\n"
    assert sorted(told.splitlines()) == sorted(complaints.splitlines())
    one = pl.read_parquet(tmp_path / "one.parquet").drop("time_s")
    assert_frame_equal(table_of(tmp_path / "many"), one, check_exact=True)
    for picture in (tmp_path / "one").iterdir():
        assert (tmp_path / "level" / picture.name).read_bytes() == picture.read_bytes()


def test_gone_on_with(run: Run, world: Path, tmp_path: Path, workers: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    words = ("tilt", "images", "--camera", "camera.toml", "--cluster", workers.scheduler_address, "--out", out)
    results = on_dask.results_of

    def interrupted(*given: Any) -> Iterator[Any]:
        for count, done in enumerate(results(*given)):
            if count == 3:
                raise KeyboardInterrupt
            yield done

    monkeypatch.setattr(on_dask, "results_of", interrupted)
    assert run(*words)[0] == 130
    parts = {path: path.stat().st_mtime_ns for path in out.glob("part-*.parquet")}
    assert len(parts) == 3
    monkeypatch.setattr(on_dask, "results_of", results)
    code, said, _ = run(*words)
    before = sum(pl.read_parquet(path).height for path in parts)
    assert (code, f"{COUNT} images, {before} of them before;" in said) == (1, True)
    assert len(table_of(out)) == COUNT
    # What was there is as it was, and with all done nobody asks the workers.
    assert {path: path.stat().st_mtime_ns for path in parts} == parts
    monkeypatch.setattr(on_dask, "results_of", None)
    assert f"{COUNT} of them before" in run(*words)[1]


def test_the_answers_of_something_else_are_kept(run: Run, world: Path, tmp_path: Path, workers: Any) -> None:
    out = tmp_path / "out"
    words = ("tilt", "images/0*.png", "--camera", "camera.toml", "--cluster", workers.scheduler_address, "--out", out)
    run(*words)
    first = table_of(out)
    code, _, told = run(*words, "--gradient-min", 200)
    assert (code, "holds the answers of something else (options differ)" in told) == (2, True)
    assert_frame_equal(table_of(out), first, check_exact=True)
    run(*words, "--gradient-min", 200, "--overwrite")
    assert not table_of(out).equals(first)
    (out / "manifest.json").write_text("{")
    assert "manifest.json: cannot be read" in run(*words)[2]
    (out / "manifest.json").unlink()
    assert "holds Parquet files and no manifest.json" in run(*words)[2]


def test_level_pictures(run: Run, world: Path, tmp_path: Path, workers: Any) -> None:
    words = ("level", "images", "--camera", "camera.toml", "--out")
    code, said, complaints = run(*words, tmp_path / "one")
    many = run(*words, tmp_path / "many", "--cluster", workers.scheduler_address)
    assert (many[:2], sorted(many[2].splitlines())) == ((code, said), sorted(complaints.splitlines()))
    pictures = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert sorted(path.name for path in (tmp_path / "many").glob("*.png")) == pictures
    for name in pictures:
        assert (tmp_path / "many" / name).read_bytes() == (tmp_path / "one" / name).read_bytes()
    table = table_of(tmp_path / "many" / "tilts")
    assert table["levelled"].sum() == len(pictures)
    assert table.filter(pl.col("levelled")).select(pl.col("roll_rad", "pitch_rad").is_not_null().all()).row(0) == (
        True,
        True,
    )
    assert run(*words, tmp_path / "many", "--cluster", workers.scheduler_address)[:2] == (code, said)
    # Without --cluster the folder is one that exists.
    assert run(*words, tmp_path / "many")[0] == 2


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["tilt", "images", "--camera", "camera.toml"], "--out not given, expected a folder"),
        (["tilt", "images", "--camera", "camera.toml", "--out", "a.csv"], "--out a.csv, expected a folder"),
        (["tilt", "images", "--camera", "camera.toml", "--out", "o", "--filter"], "--filter with --cluster"),
        (["tilt", "images", "--camera", "camera.toml", "--out", "o", "--show"], "--show with --cluster"),
        (["tilt", "-", "--camera", "camera.toml", "--out", "o"], "expected images or folders of images"),
        (["level", "images", "--camera", "camera.toml", "--out", "a.mp4"], "--out a.mp4, expected a folder"),
    ],
)
def test_what_cannot_be(run: Run, words: list[str], hint: str) -> None:
    code, _, told = run(*words, "--cluster", "tcp://127.0.0.1:9")
    assert (code, hint in told) == (2, True), told


def test_nobody_answers_and_no_dask(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(on_dask, "_PATIENCE_S", 0.5)
    words = ("tilt", "images", "--camera", "camera.toml", "--out", tmp_path / "o", "--cluster", "tcp://127.0.0.1:9")
    assert "no Dask scheduler answers" in run(*words)[2]
    assert json.loads((tmp_path / "o" / "manifest.json").read_text())["images"] == COUNT
    monkeypatch.setitem(sys.modules, "dask.distributed", None)
    code, _, told = run(*words)
    needed = "a cluster needs the extra cluster (dask: not installed), expected `pip install 'tiltvp[cluster]'`"
    assert (code, told.splitlines()[-1]) == (1, f"tiltvp: {needed}")
    shutil.rmtree(tmp_path / "o")
