"""What `tiltvp tilt` does with each image: estimating, and the pictures that are asked for."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from tiltvp.cli.filtering import FilterOptions
from tiltvp.cli.results import Outcome, degrees
from tiltvp.errors import OutputError, TiltvpError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import EdgeElements, Leveller, TiltEstimate, TiltEstimator
    from tiltvp.streams import Frame

    Picture = NDArray[np.uint8]

__all__ = ["Work", "words_of"]

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
        return f"{name}: no tilt, {estimate.reason}"
    angles = f"alpha {degrees(estimate.alpha_rad)} deg, beta {degrees(estimate.beta_rad, 1)} deg"
    return f"{name}: {angles}, confidence {estimate.confidence:.3f}, {estimate.inlier_pixels} inliers"


def _timed(work: Callable[[], T]) -> tuple[T, float]:
    start = time.perf_counter()
    result = work()
    return result, time.perf_counter() - start
