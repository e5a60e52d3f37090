"""Making a dataset: everything is written beside its place, and moved there when it is whole."""

from __future__ import annotations

import csv
import io
import math
import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np
import tomli_w

from tiltvp._core import LongCalls
from tiltvp.arguments import THREADS_MAX
from tiltvp.errors import CalibrationError, InvalidInputError
from tiltvp.files import refuse_file_name, whole_folder
from tiltvp.images import write_image
from tiltvp.lab.datasets.description import DESCRIPTION
from tiltvp.lab.datasets.rows import ROWS, TiltImage
from tiltvp.rotations import rotation_from

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp.cameras import Camera

__all__ = ["NewDataset", "in_order", "new_dataset", "new_folder", "refuse_taken"]

_CAMERA: Final = "camera.toml"
_IMAGES: Final = "images"
_AHEAD: Final = 16
"""Jobs that are begun for each thread, so that few threads wait while one job takes long."""
_HEARS_S: Final = 0.2
"""After which a wait looks for Ctrl-C: half of what an interrupt may take."""

Job = TypeVar("Job")
Result = TypeVar("Result")


class NewDataset:
    """A dataset that is being made. Images may be written by several threads at once."""

    def __init__(self, directory: Path) -> None:
        """In a folder that nobody else uses."""
        self.directory = directory
        """Where it is until it is whole."""
        self.images: list[TiltImage] = []
        """The rows of the table, to be put in order by who makes them."""

    def write(
        self,
        name: str,
        gray: NDArray[np.uint8],
        *,
        location: str,
        environment: str,
        alpha_rad: float,
        beta_rad: float,
        yaw_rad: float = 0.0,
    ) -> TiltImage:
        """Writes one image, (H, W) uint8 or (H, W, 3) in BGR order, as a PNG of that name; its row is the caller's."""
        file = f"{_IMAGES}/{name}.png"
        path = self.directory / file
        write_image(path, gray)
        return TiltImage(file, path, location, environment, alpha_rad, beta_rad, yaw_rad)

    def write_table(self, name: str, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
        """Writes a CSV file of that name beside the images."""
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(header)
        table.writerows(rows)
        (self.directory / name).write_text(text.getvalue(), encoding="utf-8")

    def write_toml(self, name: str, values: dict[str, Any]) -> None:
        """Writes a TOML file of that name beside the images."""
        (self.directory / name).write_text(tomli_w.dumps(values), encoding="utf-8")


@contextmanager
def new_dataset(
    directory: str | os.PathLike[str],
    camera: Camera,
    *,
    robot_from_camera: ArrayLike | None = None,
    source: dict[str, Any] | None = None,
    force: bool = False,
) -> Iterator[NewDataset]:
    """A dataset to be filled in a `with` block. It appears at its end, whole, or not at all if the block fails.

    An existing folder is refused unless `force`, which replaces an empty folder or a dataset, and nothing else. Raises
    `InvalidInputError`.
    """
    rotation = None if robot_from_camera is None else _rotation(robot_from_camera)
    with new_folder(directory, force=force) as new:
        yield new
        camera.save(new.directory / _CAMERA)
        _write_description(new.directory, rotation, source or {})
        _write_rows(new.directory, new.images)


@contextmanager
def new_folder(directory: str | os.PathLike[str], *, force: bool = False) -> Iterator[NewDataset]:
    """A folder to be filled in a `with` block, dataset.toml included; else as `new_dataset`."""
    target = Path(directory)
    refuse_taken(target, force)
    with whole_folder(target) as part:
        yield NewDataset(part)
        refuse_taken(target, force)


@contextmanager
def in_order(
    work: Callable[[Job], Result], jobs: Iterable[Job], threads: int, stop: Event
) -> Iterator[Iterator[Result]]:
    """`work(job)` of each job, in their order, on several threads. Jobs are taken a few at a time: there may be many.

    When one fails, or the caller leaves, what has not begun never does; of what has long calls are ended, and `stop` is
    set.
    """
    if not 1 <= threads <= THREADS_MAX:
        raise InvalidInputError(f"threads = {threads}, expected 1 to {THREADS_MAX}")
    pool, calls = ThreadPoolExecutor(threads), LongCalls()

    def ended_together(job: Job) -> Result:
        with calls:
            return work(job)

    begun = (pool.submit(ended_together, job) for job in jobs)
    try:
        yield _results(begun, _AHEAD * threads)
    finally:
        stop.set()
        calls.end()
        pool.shutdown(wait=True, cancel_futures=True)


def _results(begun: Iterator[Future[Result]], ahead: int) -> Iterator[Result]:
    """What comes of each, and is not kept. A wait without end hears of no Ctrl-C once Polars, whose handler has waits
    go on, is imported."""
    waiting = deque(islice(begun, ahead))
    while waiting:
        future = waiting.popleft()
        waiting.extend(islice(begun, 1))
        while not wait((future,), _HEARS_S).done:
            pass
        yield future.result()


def refuse_taken(target: Path, force: bool) -> None:
    """Refuses a place that is taken; with `force` by other than a dataset or an empty folder."""
    refuse_file_name(target)
    if not target.exists() and not target.is_symlink():
        return
    is_ours = target.is_dir() and ((target / DESCRIPTION).is_file() or not any(target.iterdir()))
    if not force:
        raise InvalidInputError(f"{target}: exists, expected a new folder, or --overwrite to replace a dataset")
    if not is_ours:
        raise InvalidInputError(f"{target}: is no dataset, expected a folder with {DESCRIPTION}, or an empty one")


def _rotation(robot_from_camera: ArrayLike) -> list[list[float]]:
    rows: list[list[float]] = np.asarray(robot_from_camera, dtype=np.float64).tolist()
    try:
        rotation_from(rows, "robot_from_camera")
    except CalibrationError as error:
        raise InvalidInputError(str(error)) from None
    return rows


def _write_description(directory: Path, rotation: list[list[float]] | None, source: dict[str, Any]) -> None:
    table: dict[str, Any] = {"camera": _CAMERA}
    if rotation is not None:
        table["robot_from_camera"] = rotation
    if source:
        table["source"] = source
    (directory / DESCRIPTION).write_text(tomli_w.dumps(table), encoding="utf-8")


def _write_rows(directory: Path, images: Iterable[TiltImage]) -> None:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(("file", "location", "environment", "alpha_deg", "beta_deg", "yaw_deg"))
    for image in images:
        angles = (_degrees(angle) for angle in (image.alpha_rad, image.beta_rad, image.yaw_rad))
        table.writerow((image.file, image.location, image.environment, *angles))
    (directory / ROWS).write_text(text.getvalue(), encoding="utf-8")


def _degrees(angle_rad: float) -> str:
    """As short as it can be with the angle to 1e-12 degrees."""
    return f"{math.degrees(angle_rad):.12f}".rstrip("0").rstrip(".")
