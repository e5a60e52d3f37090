"""`tiltvp tilt`: the tilt of each of many images."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

from cyclopts import Parameter, validators

from tiltvp.cli.filtering import FilterOptions
from tiltvp.cli.inputs import distinct_names, find_images
from tiltvp.cli.options import CameraOptions, MethodOptions
from tiltvp.cli.results import Outcome, degrees, mounting_words, outcome_table, people_table, summary_words
from tiltvp.cli.tables import STDOUT, check_ending, json_lines, write_table
from tiltvp.cli.terminal import ProgressBar, complain, named, progress_bar, say, show, width
from tiltvp.errors import InvalidInputError, OutputError, TiltvpError
from tiltvp.files import check_output_folder

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import EdgeElements, Leveller, TiltEstimate, TiltEstimator
    from tiltvp._core import Camera

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
    out: Annotated[Path | None, Parameter(allow_leading_hyphen=True)] = None,
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
        File for the results in radians: .csv, .json or .parquet; - for a line of JSON on stdout as each image is done.
    overlay
        Folder for the images with inlier edges in colour, horizon and vanishing points.
    level
        Folder for the images made level: each by its own tilt, with --filter by the filtered one.
    threads
        How many images are worked on at the same time.
    """
    rows_only = out == STDOUT
    if out is not None and not rows_only:
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
    estimator = _checked(estimator, files)
    names = distinct_names(files)
    work = Work(estimator, overlay, level, filtering)
    outcomes: list[Outcome] = []
    with closing(_done(work, files, names, threads)) as done:
        for outcome, name in zip(filtering.judged(done, motions), names, strict=True):
            outcomes.append(outcome)
            if filtering.filter:
                work.write_level(outcome, name)
            if rows_only:
                say(json_lines(outcome_table([outcome], estimator.method)))
    if not rows_only:
        _show(outcomes, estimator.method, filtering, out)
    if filtering.filter_plot is not None:
        _write_plot(outcomes, estimator.method, filtering.filter_plot)
    return 1 if problems or any(outcome.error for outcome in outcomes) else 0


def _show(outcomes: Sequence[Outcome], method: str, filtering: FilterOptions, out: Path | None) -> None:
    """What people read on stdout, and the table as a file."""
    if outcomes:
        say(summary_words(outcomes))
    show(people_table(outcomes, width()))
    if filtering.estimate_mounting:
        say(mounting_words(outcomes))
    if out is not None:
        write_table(outcome_table(outcomes, method), out)


_FEW, _MANY, _TRIES = 5, 24, 3
"""Images, spread over the input, by which mounting and rim are checked, and those in which the body is looked for: what
they have in common is of the camera, not of the place. Of each part of the input so many files are tried.
"""


def _checked(estimator: TiltEstimator, files: Sequence[Path]) -> TiltEstimator:
    """The estimator without the dark surround and the body of the robot that the images have, if no mask is given; a
    line on stderr says so of each, and one if they speak against the mounting.
    """
    import numpy as np

    from tiltvp import body_mask, check_setup, surround_mask

    camera = estimator.camera
    images = list(_spread(files, _FEW, camera))
    if len(images) < _FEW:
        return estimator
    mask = estimator.options["mask"]
    if mask is None:
        if (mask := surround_mask(images, camera)) is not None:
            share = 100.0 * float(np.mean(mask))
            complain(f"--mask: none, and the images have a dark surround: {share:.0f} % within its rim are looked at")
        body = body_mask(_spread(files, _MANY, camera), camera, mask=mask)
        if body:
            complain(f"--mask: none, and in {body.reason}: they are the robot's own, and left out")
            mask = body.mask if mask is None else mask & body.mask
        elif body.mask is None:
            complain(f"--mask: none, and images do not tell whether they show the robot itself: {body.reason}")
        if mask is not None:
            estimator = estimator.with_options(mask=mask)
    found = check_setup(images, camera, estimator.robot_from_camera, mask=mask)
    if not found:
        complain(f"--robot-from-camera: {found.reason}")
    return estimator


def _spread(files: Sequence[Path], count: int, camera: Camera) -> Iterator[NDArray[np.uint8]]:
    """An image of each of so many parts of the input: of the first files in it, one that can be used."""
    from tiltvp import read_image

    for part in range(count):
        start, end = (k * len(files) // count for k in (part, part + 1))
        for file in files[start : min(end, start + _TRIES)]:
            try:
                image = read_image(file)
            except TiltvpError:
                continue  # It is named when its turn comes.
            if image.shape[:2] == (camera.height, camera.width):
                yield image
                break


def _write_plot(outcomes: Sequence[Outcome], method: str, path: Path) -> None:
    from tiltvp import write_image
    from tiltvp.lab.plots.filtering import filtered_tilt
    from tiltvp.lab.plots.picture import figure_picture

    write_image(path, figure_picture(filtered_tilt(outcome_table(outcomes, method).frame())))


def _done(work: Work, files: Sequence[Path], names: Sequence[str], threads: int) -> Generator[Outcome, None, None]:
    """The outcomes in the order of the files, each as soon as it is there."""
    with progress_bar(len(files), "images") as bar:
        if threads == 1:
            for file, name in zip(files, names, strict=True):
                yield _noted(work(file, name), bar)
            return
        pool = ThreadPoolExecutor(threads)
        try:
            for outcome in pool.map(work, files, names):
                yield _noted(outcome, bar)
        finally:
            pool.shutdown(cancel_futures=True)


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

    @cached_property
    def leveller(self) -> Leveller:
        """Of the estimator's camera, with tables that are made once."""
        from tiltvp import Leveller

        return Leveller(self.estimator.camera, self.estimator.robot_from_camera)

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
        from tiltvp import read_image, write_image
        from tiltvp.images import gray_from

        image = read_image(file)
        gray = gray_from(image)
        if self.overlay is None:
            estimate, time_s = _timed(lambda: self.estimator(gray))
        else:
            (estimate, edges), time_s = _timed(lambda: self.estimator.with_edges(gray))
            write_image(self.overlay / f"{name}.png", self._overlay(gray, estimate, edges, file.name))
        accepted = estimate and self.filtering.accepts(estimate.confidence)
        if self.level is not None and accepted and not self.filtering.filter:
            write_image(self.level / f"{name}.png", self.leveller(image, estimate))
        return Outcome(file, estimate, time_s)

    def write_level(self, outcome: Outcome, name: str) -> None:
        """The image made level by what the filter held to be true after it, where it did."""
        from tiltvp import read_image, write_image

        if self.level is not None and outcome.filtered and outcome.error is None:
            image = read_image(outcome.file)
            write_image(self.level / f"{name}.png", self.leveller(image, outcome.filtered))

    def _overlay(
        self, gray: NDArray[np.uint8], estimate: TiltEstimate, edges: EdgeElements, title: str
    ) -> NDArray[np.uint8]:
        from tiltvp.overlays.tilt import tilt_overlay

        return tilt_overlay(gray, self.estimator, estimate, edges, words_of(estimate, title))


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
