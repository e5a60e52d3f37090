"""`tiltvp tilt`: the tilt of each of many images."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

from cyclopts import Parameter, validators

from tiltvp.cli.filtering import FilterOptions
from tiltvp.cli.inputs import distinct_names, find_images
from tiltvp.cli.options import CameraOptions, MethodOptions
from tiltvp.cli.results import Outcome, degrees, outcome_table, people_table
from tiltvp.cli.tables import check_ending, write_table
from tiltvp.cli.terminal import ProgressBar, complain, named, progress_bar, show, width
from tiltvp.errors import InvalidInputError, OutputError, TiltvpError
from tiltvp.files import check_output_folder

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import EdgeElements, TiltEstimate, TiltEstimator

_METHOD_DEFAULTS = MethodOptions()
_FILTER_DEFAULTS = FilterOptions()
T = TypeVar("T")


def tilt(
    images: list[str],
    /,
    *,
    camera: CameraOptions,
    method: MethodOptions = _METHOD_DEFAULTS,
    filtering: FilterOptions = _FILTER_DEFAULTS,
    out: Path | None = None,
    overlay: Path | None = None,
    level: Path | None = None,
    threads: Annotated[int, Parameter(validator=validators.Number(gte=1))] = 1,
) -> int:
    """Estimate the tilt of each image.

    Images that cannot be read are named on stderr, the others are done, and the exit code is 1.

    Parameters
    ----------
    images
        Image files, folders of images, and glob patterns.
    out
        File for the results in radians: .csv, .json or .parquet.
    overlay
        Folder for the images with inlier edges in colour, horizon and vanishing points.
    level
        Folder for the images made level, each by its own tilt.
    threads
        How many images are worked on at the same time.
    """
    if out is not None:
        check_ending(out)
    if overlay is not None and level is not None and os.path.realpath(overlay) == os.path.realpath(level):
        raise InvalidInputError(f"--overlay and --level are both {overlay}, expected two folders")
    for folder in (overlay, level):
        if folder is not None:
            check_output_folder(folder)
    filtering.check()
    estimator = method.estimator(camera.load())
    files, problems = find_images(images)
    for problem in problems:
        complain(problem)
    motions = filtering.motions(files)
    work = Work(estimator, overlay, level, filtering)
    outcomes = filtering.judged(_done(work, files, distinct_names(files), threads), motions)
    show(people_table(outcomes, width()))
    if out is not None:
        write_table(outcome_table(outcomes, estimator.method), out)
    if filtering.filter_plot is not None:
        _write_plot(outcomes, estimator.method, filtering.filter_plot)
    return 1 if problems or any(outcome.error for outcome in outcomes) else 0


def _write_plot(outcomes: Sequence[Outcome], method: str, path: Path) -> None:
    from tiltvp import write_image
    from tiltvp.lab.plots.filtering import filtered_tilt
    from tiltvp.lab.plots.picture import figure_picture

    write_image(path, figure_picture(filtered_tilt(outcome_table(outcomes, method).frame())))


def _done(work: Work, files: Sequence[Path], names: Sequence[str], threads: int) -> list[Outcome]:
    """The outcomes in the order of the files."""
    outcomes: list[Outcome] = []
    with progress_bar(len(files), "images") as bar:
        if threads == 1:
            for file, name in zip(files, names, strict=True):
                outcomes.append(_noted(work(file, name), bar))
            return outcomes
        pool = ThreadPoolExecutor(threads)
        try:
            outcomes.extend(_noted(outcome, bar) for outcome in pool.map(work, files, names))
        finally:
            pool.shutdown(cancel_futures=True)
    return outcomes


def _noted(outcome: Outcome, bar: ProgressBar) -> Outcome:
    if outcome.error is not None:
        bar.complain(named(outcome.file, outcome.error))
    bar.advance()
    return outcome


@dataclass(frozen=True)
class Work:
    """What is done with each image."""

    estimator: TiltEstimator
    overlay: Path | None
    level: Path | None
    filtering: FilterOptions

    def __call__(self, file: Path, name: str) -> Outcome:
        """Estimates, and writes the pictures asked for; any problem of this image becomes its outcome.

        Raises `OutputError`, which all images would have.
        """
        try:
            return self._run(file, name)
        except OutputError:
            raise
        except TiltvpError as error:
            return Outcome(file, error=" ".join(str(error).split()))

    def _run(self, file: Path, name: str) -> Outcome:
        from tiltvp import level, read_image, write_image
        from tiltvp.images import gray_from

        image = read_image(file)
        gray = gray_from(image)
        if self.overlay is None:
            estimate, time_s = _timed(lambda: self.estimator(gray))
        else:
            (estimate, edges), time_s = _timed(lambda: self.estimator.with_edges(gray))
            write_image(self.overlay / f"{name}.png", self._overlay(gray, estimate, edges, file.name))
        if self.level is not None and estimate and self.filtering.accepts(estimate.confidence):
            rotation = self.estimator.robot_from_camera
            write_image(self.level / f"{name}.png", level(image, self.estimator.camera, estimate, rotation))
        return Outcome(file, estimate, time_s)

    def _overlay(
        self, gray: NDArray[np.uint8], estimate: TiltEstimate, edges: EdgeElements, title: str
    ) -> NDArray[np.uint8]:
        from tiltvp.overlays.tilt import tilt_overlay

        return tilt_overlay(
            gray, self.estimator.camera, estimate, edges, self.estimator.robot_from_camera, words_of(estimate, title)
        )


def words_of(estimate: TiltEstimate, title: str) -> str:
    """One line about an estimate, of the letters that pictures can show."""
    name = title.encode("ascii", "replace").decode()
    if not estimate:
        return f"{name}: no tilt, {estimate.reason}"
    angles = f"alpha {degrees(estimate.alpha_rad)} deg, beta {degrees(estimate.beta_rad, 1)} deg"
    return f"{name}: {angles}, confidence {estimate.confidence:.3f}, {estimate.inlier_pixels} inliers"


def _timed(work: Callable[[], T]) -> tuple[T, float]:
    start = time.perf_counter()
    result = work()
    return result, time.perf_counter() - start
