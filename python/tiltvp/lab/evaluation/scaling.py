"""What an evaluation costs: seconds over the number of images and over their pixels, and the exponents of both."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.folder import TiltDataset, read_dataset
from tiltvp.lab.datasets.new import new_dataset
from tiltvp.lab.datasets.panoramas import TABLE_1_TILTS_DEG
from tiltvp.lab.evaluation.combinations import Combination
from tiltvp.lab.evaluation.experiment import open_experiment
from tiltvp.synth import ROOM_KINDS, Room, RoomImage

if TYPE_CHECKING:
    from tiltvp.cameras import Camera

__all__ = ["exponents", "measure_scaling"]

_SCHEMA = {
    "over": pl.String,
    "images": pl.UInt32,
    "width": pl.UInt32,
    "height": pl.UInt32,
    "megapixels": pl.Float64,
    "edge_pixels": pl.Float64,
    "seconds": pl.Float64,
    "seconds_start": pl.Float64,
    "seconds_images": pl.Float64,
    "seconds_corrections": pl.Float64,
}


def measure_scaling(
    camera: Camera,
    combinations: Sequence[Combination],
    *,
    images: Sequence[int],
    scales: Sequence[float],
    threads: int = 1,
    advance: Callable[[], None] = lambda: None,
) -> pl.DataFrame:
    """Seconds of whole evaluations of rendered rooms, from dataset to table.

    One row for each number of images with the camera as it is (`over` is "images"), and one for each scale of its
    pixels with the smallest of these numbers (`over` is "pixels"); `edge_pixels` is the mean of the estimates. The
    seconds are in all, until the first image (digests, tables), for the images, and for the corrections.
    Raises `InvalidInputError` for numbers that are not above 0.
    """
    if not (len(images) and min(images) >= 1 and all(0.0 < scale < math.inf for scale in scales)):
        raise InvalidInputError(f"images {images} and scales {scales}, expected numbers above 0")
    rows: list[dict[str, object]] = []
    jobs = [("images", count, camera) for count in images]
    jobs += [("pixels", min(images), camera.scaled(math.sqrt(scale))) for scale in scales]
    rendered: dict[Camera, list[RoomImage]] = {}
    for over, count, scaled in jobs:
        if scaled not in rendered:
            rendered[scaled] = _views(scaled, max(images) if scaled == camera else count)
        with _rooms(rendered[scaled], scaled, count) as (dataset, run):
            clock = [time.perf_counter()]
            with open_experiment(dataset, combinations, run) as experiment:
                clock.append(time.perf_counter())
                experiment.estimate(threads=threads)
                clock.append(time.perf_counter())
                table = experiment.conclude(threads=threads).table
                clock.append(time.perf_counter())
        size = {"width": scaled.width, "height": scaled.height, "megapixels": 1e-6 * scaled.width * scaled.height}
        counts = {"images": count, "edge_pixels": table["edge_pixels"].mean()}
        parts = dict(zip(list(_SCHEMA)[-3:], np.diff(clock).tolist(), strict=True))
        rows.append({"over": over, "seconds": clock[-1] - clock[0]} | parts | counts | size)
        advance()
    return pl.DataFrame(rows, schema=_SCHEMA)


def exponents(table: pl.DataFrame) -> pl.DataFrame:
    """The slopes of the logarithms of seconds and of edge pixels over those of images and of pixels; 1 is linear.

    Of a table of `measure_scaling`; what was measured at one size alone has no row. Columns: over, seconds (in all),
    seconds_images, edge_pixels.
    """
    measures = ("seconds", "seconds_images", "edge_pixels")
    rows = []
    for (over,), part in table.group_by("over", maintain_order=True):
        size = np.log((part["images"] * part["megapixels"]).to_numpy())
        if np.ptp(size) > 0.0:
            slopes = {name: float(np.polyfit(size, np.log(part[name].to_numpy()), 1)[0]) for name in measures}
            rows.append({"over": over} | slopes)
    return pl.DataFrame(rows, schema={"over": pl.String} | dict.fromkeys(measures, pl.Float64))


@contextmanager
def _rooms(views: Sequence[RoomImage], camera: Camera, count: int) -> Iterator[tuple[TiltDataset, Path]]:
    """A dataset of so many images, the views over and over, as many at a location, and a place for a run."""
    with tempfile.TemporaryDirectory() as folder:
        directory = Path(folder) / "dataset"
        with new_dataset(directory, camera) as new:
            for number in range(count):
                view, location = views[number % len(views)], f"{number // len(views):04d}"
                lean = {"alpha_rad": view.alpha_rad, "beta_rad": view.beta_rad}
                image = new.write(f"{number:06d}", view.gray, location=location, environment="rooms", **lean)
                new.images.append(image)
        yield read_dataset(directory), Path(folder) / "run"


@lru_cache(maxsize=len(TABLE_1_TILTS_DEG))
def _room(number: int) -> Room:
    """The rooms take turns in kind."""
    return Room(ROOM_KINDS[number % len(ROOM_KINDS)], number)


def _views(camera: Camera, count: int) -> list[RoomImage]:
    """A room for each lean of table 1, as far as they are needed."""
    views = []
    for number, (alpha, beta) in enumerate(np.deg2rad(TABLE_1_TILTS_DEG[:count]).tolist()):
        pose = _room(number).free_poses(1, number)[0]
        views.append(_room(number).render(camera, pose=pose, alpha_rad=alpha, beta_rad=beta, samples=2))
    return views
