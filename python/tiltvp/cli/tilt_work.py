"""What `tiltvp tilt` does with each image: estimating, and the pictures that are asked for."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from tiltvp.cli.cluster import Task, on_cluster
from tiltvp.cli.filtering import FilterOptions
from tiltvp.cli.option_words import typed
from tiltvp.cli.results import Outcome, degrees, outcome_table
from tiltvp.cli.tables import Table
from tiltvp.cli.terminal import say
from tiltvp.errors import OutputError, TiltvpError, counted

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import EdgeElements, Leveller, TiltEstimate, TiltEstimator
    from tiltvp.streams import Frame
    from tiltvp.streams.image_files import ImageFiles

    Picture = NDArray[np.uint8]

__all__ = ["TiltTask", "Work", "tilts_on_cluster", "words_of"]

T = TypeVar("T")


@dataclass(frozen=True)
class Work:
    """What is done with each image."""

    estimator: TiltEstimator
    overlay: Path | None
    level: Path | None
    filtering: FilterOptions
    marks: bool = False
    """Whether the images with their edges are wanted by whoever watches."""

    @cached_property
    def leveller(self) -> Leveller:
        """Of the estimator's camera, with tables that are made once."""
        from tiltvp import Leveller

        return Leveller(self.estimator.camera, self.estimator.robot_from_camera)

    def __call__(self, frame: Frame, name: str) -> tuple[Outcome, Picture | None]:
        """Estimates, and writes the pictures asked for; any problem of this image becomes its outcome.

        Also the image with its edges, where these were asked for.

        Raises `OutputError`, which all images would have.
        """
        try:
            return self._run(frame, name)
        except OutputError:
            raise
        except TiltvpError as error:
            return Outcome(Path(frame.name), error=" ".join(str(error).split()), taken_s=frame.time_s), None

    def _run(self, frame: Frame, name: str) -> tuple[Outcome, Picture | None]:
        from tiltvp import write_image
        from tiltvp.images import gray_from

        file, image = Path(frame.name), frame.read()
        gray = gray_from(image)
        marked = None
        if self.overlay is None and not self.marks:
            estimate, time_s = _timed(lambda: self.estimator(gray))
        else:
            (estimate, edges), time_s = _timed(lambda: self.estimator.with_edges(gray))
            marked = self._overlay(gray, estimate, edges, file.name)
            if self.overlay is not None:
                write_image(self.overlay / f"{name}.png", marked)
        accepted = estimate and self.filtering.accepts(estimate.confidence)
        if self.level is not None and accepted and not self.filtering.filter:
            write_image(self.level / f"{name}.png", self.leveller(image, estimate))
        return Outcome(file, estimate, time_s, taken_s=frame.time_s), marked

    def write_level(self, frame: Frame, outcome: Outcome, name: str) -> None:
        """The image made level by what the filter held to be true after it, where it did."""
        from tiltvp import write_image

        if self.level is not None and outcome.filtered and outcome.error is None:
            write_image(self.level / f"{name}.png", self.leveller(frame.read(), outcome.filtered))

    def _overlay(
        self, gray: NDArray[np.uint8], estimate: TiltEstimate, edges: EdgeElements, title: str
    ) -> NDArray[np.uint8]:
        from tiltvp.overlays.tilt import tilt_overlay

        return tilt_overlay(gray, self.estimator, estimate, edges, words_of(estimate, title))


def words_of(estimate: TiltEstimate, title: str) -> str:
    """One line about an estimate, of the letters that pictures can show."""
    name = title.encode("ascii", "replace").decode()
    if not estimate:
        return f"{name}: no tilt, {typed(estimate.reason)}"
    angles = f"alpha {degrees(estimate.alpha_rad)} deg, beta {degrees(estimate.beta_rad, 1)} deg"
    return f"{name}: {angles}, confidence {estimate.confidence:.3f}, {estimate.inlier_pixels} inliers"


def _timed(work: Callable[[], T]) -> tuple[T, float]:
    start = time.perf_counter()
    result = work()
    return result, time.perf_counter() - start


@dataclass(frozen=True)
class TiltTask:
    """The rows of `tiltvp tilt` as the task of a worker."""

    work: Work

    def __call__(self, images: Sequence[tuple[Frame, str]]) -> Table:
        judge = self.work.filtering.judge()
        outcomes = [judge(self.work(frame, name)[0], None) for frame, name in images]
        return outcome_table(outcomes, self.work.estimator.method)


def tilts_on_cluster(address: str, frames: ImageFiles, work: Work, out: Path) -> int:
    """The tilts of images by the workers of a scheduler, as a folder of tables; the exit code."""
    import polars as pl

    whole = replace(
        work,
        overlay=None if work.overlay is None else work.overlay.absolute(),
        level=None if work.level is None else work.level.absolute(),
    )
    before, table = on_cluster(address, frames, Task("tilt", TiltTask(whole)), out)
    counts = table.select(images=pl.len(), bad=pl.col("error").count(), tilts=pl.col("alpha_rad").count())
    images, bad, tilts = counts.collect().row(0)
    done_before = f", {before} of them before" if before else ""
    say(f"{out}: {counted(images, 'images')}{done_before}; {tilts} with a tilt, {bad} could not be used")
    return 1 if bad or frames.problems else 0
