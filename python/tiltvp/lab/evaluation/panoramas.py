"""The methods on views of upright panoramas, rendered as they are needed: an evaluation without files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from tiltvp.lab.datasets.panoramas import TABLE_1_TILTS_DEG, Panorama, PanoramaViews
from tiltvp.lab.evaluation.combinations import Combination
from tiltvp.lab.evaluation.crossval import cross_validated
from tiltvp.lab.evaluation.runner import ImageRunner, View
from tiltvp.tilt import normal_from_alpha_beta

if TYPE_CHECKING:
    from tiltvp.cameras import Camera

__all__ = ["evaluate_views"]


def evaluate_views(
    panoramas: Iterable[Panorama],
    camera: Camera,
    combinations: Sequence[Combination],
    *,
    samples: int = 2,
    noise_sigma: float = 2.0,
    turn: bool = False,
    upright: bool = True,
    tilts_deg: Sequence[tuple[float, float]] = TABLE_1_TILTS_DEG,
    advance: Callable[[], None] = lambda: None,
) -> pl.DataFrame:
    """The long table of an evaluation (`tiltvp.lab.evaluation.schema`) of views of panoramas; a location is a panorama.

    With `turn` each view also has a heading of its own, drawn with a fixed seed. `advance` is called per panorama.
    """
    runner = ImageRunner(camera, combinations)
    tables = []
    for number, panorama in enumerate(panoramas):
        views = PanoramaViews(panorama, camera, samples=samples, upright=upright)
        count = len(tilts_deg)
        headings = np.random.default_rng(number).uniform(-np.pi, np.pi, count) if turn else np.zeros(count)
        for place, ((alpha, beta), yaw) in enumerate(zip(np.deg2rad(tilts_deg).tolist(), headings, strict=True)):
            seed = 1000 * number + place
            normal = normal_from_alpha_beta(alpha, beta)
            image = views.render(normal, yaw_rad=float(yaw), noise_sigma=noise_sigma, seed=seed)
            view = View(seed, panorama.path.name, panorama.name, panorama.location, alpha, beta, float(yaw))
            tables.append(runner(image, view))
        advance()
    return cross_validated(pl.concat(tables))
