"""`tiltvp tilt --cluster` on two worker processes of this machine, of which one is killed half-way: the same table as
without, and what an image costs over their number. Run by `just measure-cluster`."""

from __future__ import annotations

import argparse
import contextlib
import os
import resource
import signal
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from dask.distributed import LocalCluster

import tiltvp
from tiltvp.cli import main
from tiltvp.lab import cluster
from tiltvp.synth import Room

DISTINCT = 200
"""Images that are rendered; the others are links to them."""


def processor_s() -> float:
    """Seconds of the processor of this process and of those that it has ended."""
    both = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(used.ru_utime + used.ru_stime for used in both)


def render(folder: Path) -> list[Path]:
    """Views of an office of 160 x 120 pixels, with leans and noise of their own."""
    camera = tiltvp.Camera.equidistant(width=160, height=120, focal_px=35.0, cx=79.5, cy=59.5, max_theta_rad=1.61)
    camera.save(folder / "camera.toml")
    random, room, files = np.random.default_rng(1), Room("office", 1), []
    for pose in room.free_poses(DISTINCT // 8, seed=7):
        lean = {"alpha_rad": random.uniform(0.0, 0.1), "beta_rad": random.uniform(-3.0, 3.0)}
        image = room.render(camera, pose=pose, samples=1, **lean).bgr
        for k in range(8):
            files.append(folder / "distinct" / f"{len(files):03d}.png")
            noisy = image + random.normal(0.0, 2.0 + k, image.shape)
            tiltvp.write_image(files[-1], np.clip(noisy, 0, 255).astype(np.uint8))
    return files


def run(folder: Path, count: int, *, kills: bool) -> None:
    """The command on two workers, and what it cost."""
    results, begin_s, begin = cluster.results_of, processor_s(), time.perf_counter()
    quiet = {"dashboard_address": ":0", "silence_logs": "CRITICAL"}
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, **quiet) as workers:

        def killing(*given: Any) -> Iterator[Any]:
            for done, made in enumerate(results(*given)):
                if kills and done == count // 200:
                    os.kill(next(iter(workers.workers.values())).pid, signal.SIGKILL)
                    print(f"a worker is killed after {done} parts of {count // 100}")
                yield made

        cluster.results_of = killing
        words = ["--cluster", workers.scheduler_address, "--out", str(folder / f"out-{count}")]
        code = main(["tilt", str(folder / f"images-{count}"), "--camera", str(folder / "camera.toml"), *words])
        cluster.results_of = results
    used_s, took_s = processor_s() - begin_s, time.perf_counter() - begin
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{count} images: exit code {code}, {used_s:.1f} s of the processor, {took_s:.1f} s; {peak:.0f} MB here")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--images", type=int, nargs="+", default=[1250, 5000, 20000])
    counts = parser.parse_args().images
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        distinct = render(root)
        for size in counts:
            (root / f"images-{size}").mkdir()
            for number in range(size):
                os.link(distinct[7 * number % DISTINCT], root / f"images-{size}" / f"{number:06d}.png")
            run(root, size, kills=size == counts[-1])
        alone = root / "alone.parquet"
        with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):
            main(
                ["tilt", str(root / f"images-{counts[-1]}"), "--camera", str(root / "camera.toml"), "--out", str(alone)]
            )
        many = pl.read_parquet(sorted((root / f"out-{counts[-1]}").glob("part-*.parquet"))).drop("time_s")
        same = many.equals(pl.read_parquet(alone).drop("time_s"), null_equal=True)
        print(f"the table of one process: {'the same' if same else 'another'}, {many.height} rows")
