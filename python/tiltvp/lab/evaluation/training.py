"""What a method measures on the images of a dataset, for the training of its correction."""

from __future__ import annotations

import math
from collections.abc import Callable
from threading import Event
from typing import TYPE_CHECKING

from tiltvp.lab.datasets.new import in_order

if TYPE_CHECKING:
    from tiltvp.lab.datasets.folder import TiltDataset
    from tiltvp.lab.datasets.rows import TiltImage
    from tiltvp.tilt import TiltEstimator

__all__ = ["measured_shifts"]


def measured_shifts(
    dataset: TiltDataset, estimator: TiltEstimator, *, threads: int = 1, advance: Callable[[], None] = lambda: None
) -> list[float]:
    """The shift in pixels, or of vector consensus the raw angle in radians, of each image; NaN without an estimate.

    `estimator` has no correction. `advance` is called after each image.
    """

    def one(image: TiltImage) -> float:
        estimate = estimator(dataset.read(image))
        measured = estimate.alpha_rad if estimate.shift_px is None else estimate.shift_px
        return measured if estimate else math.nan

    found = []
    with in_order(one, dataset.images, threads, Event()) as shifts:
        for measured in shifts:
            found.append(measured)
            advance()
    return found
