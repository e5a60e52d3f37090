"""`tiltvp demo`: a room with a known tilt, estimated with every method, as a table and pictures."""

from __future__ import annotations

import math
import statistics
import sys
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from cyclopts import Parameter

from tiltvp.cli.results import degrees
from tiltvp.cli.terminal import new_table, say, show
from tiltvp.cli.tilt import words_of

if TYPE_CHECKING:
    import numpy as np
    import polars as pl
    from numpy.typing import NDArray

    from tiltvp import Camera, EdgeElements, TiltEstimate
    from tiltvp.plots.demo import DemoData
    from tiltvp.plots.offsets import Cosine
    from tiltvp.synth import RoomImage

_RUNS: Final = 21
_FIELD_OF_VIEW_DEG: Final = 185.0
_FOCAL_PER_HEIGHT: Final = 139.7 / 480.0

METHODS: Final[tuple[tuple[str, dict[str, Any]], ...]] = (
    ("refined", {}),
    ("image-space-ransac", {}),
    ("image-space-reject-refit", {}),
    ("vector-consensus", {"normal": "tangent"}),
    ("vector-consensus", {}),
    ("image-space-ransac", {"correction": None}),
    ("image-space-reject-refit", {"correction": None}),
)
"""Every method, and the variants that show what the correction and the true normals are worth."""


@dataclass(frozen=True)
class Trial:
    """One method on the room: its name for people, its estimate, edges and median time."""

    label: str
    estimate: TiltEstimate
    edges: EdgeElements
    error_rad: float
    time_s: float


def demo(
    *,
    out: Path = Path("out/demo"),
    seed: int = 8,
    alpha_deg: float = 4.0,
    beta_deg: float = 30.0,
    kind: str = "office",
    width: Annotated[int, Parameter(show=False)] = 640,
    height: Annotated[int, Parameter(show=False)] = 480,
) -> None:
    """Render a room through a 185-degree fisheye at a known tilt and estimate it with every method.

    Parameters
    ----------
    out
        Folder for input.png, overlay.png, levelled.png, plot.png and summary.png.
    seed
        Which room.
    alpha_deg
        True tilt angle.
    beta_deg
        True tilt direction: 0 is forward, 90 to the left.
    kind
        office, living-room, corridor, l-shaped, narrow or under-table.
    width
        Columns of the image.
    height
        Rows of the image.
    """
    from tiltvp import write_image
    from tiltvp.synth import render_room

    camera = _camera(width, height)
    with _status(f"rendering a room ({kind}, seed {seed})"):
        room = render_room(
            camera, kind=kind, seed=seed, alpha_rad=math.radians(alpha_deg), beta_rad=math.radians(beta_deg)
        )
    with _status("estimating and drawing"):
        trials = [_trial(camera, room, method, options) for method, options in METHODS]
        pictures = _pictures(camera, room, trials)
        for name, picture in pictures.items():
            write_image(out / name, picture)
    _print_table(room, trials)
    for name in pictures:
        say(str(out / name))


def _camera(width: int, height: int) -> Camera:
    from tiltvp import Camera

    return Camera.equidistant(
        width=width,
        height=height,
        focal_px=_FOCAL_PER_HEIGHT * height,
        cx=(width - 1) / 2.0,
        cy=(height - 1) / 2.0,
        max_theta_rad=math.radians(_FIELD_OF_VIEW_DEG / 2.0),
    )


def _trial(camera: Camera, room: RoomImage, method: str, options: dict[str, Any]) -> Trial:
    from tiltvp import TiltEstimator, normal_from_alpha_beta, tilt_error_rad
    from tiltvp.images import gray_from

    estimator = TiltEstimator(camera, method=method, **options)
    gray = gray_from(room.bgr)
    estimate, edges = estimator.with_edges(gray)
    times = []
    for _ in range(_RUNS):
        start = time.perf_counter()
        estimator(gray)
        times.append(time.perf_counter() - start)
    true = normal_from_alpha_beta(room.alpha_rad, room.beta_rad)
    error = tilt_error_rad(estimate.normal, true) if estimate else math.nan
    label = ", ".join([method, *(_option_words(name, value) for name, value in options.items())])
    return Trial(label, estimate, edges, error, statistics.median(times))


def _option_words(name: str, value: object) -> str:
    return f"no {name}" if value is None else f"{value} {name}s"


def _print_table(room: RoomImage, trials: Sequence[Trial]) -> None:
    columns = ("method", "alpha deg", "beta deg", "error deg", "confidence", "edges px", "inliers px", "ms")
    table = new_table("estimated against true", columns, left=("method",))
    table.add_row("true", degrees(room.alpha_rad), degrees(room.beta_rad), *[""] * 5, style="bold")
    for trial in trials:
        e = trial.estimate
        angles = (degrees(e.alpha_rad), degrees(e.beta_rad), degrees(trial.error_rad))
        counts = (str(e.edge_pixels), str(e.inlier_pixels), f"{1e3 * trial.time_s:.2f}")
        table.add_row(trial.label, *angles, f"{e.confidence:.3f}", *counts)
    show(table)


def _pictures(camera: Camera, room: RoomImage, trials: Sequence[Trial]) -> dict[str, NDArray[np.uint8]]:
    import numpy as np

    from tiltvp.plots.demo import demo_plot, demo_summary
    from tiltvp.plots.marks import draw_words
    from tiltvp.plots.picture import figure_picture

    data, best = _demo_data(camera, room, trials), trials[0]
    pair = [draw_words(data.leaning, "leaning"), draw_words(data.levelled, "made level by the estimate")]
    seen = _seen_square(camera)
    cut = replace(data, **{name: getattr(data, name)[seen] for name in ("overlay", "leaning", "levelled")})
    return {
        "input.png": room.bgr,
        "overlay.png": draw_words(data.overlay, words_of(best.estimate, best.label)),
        "levelled.png": np.hstack(pair),
        "plot.png": figure_picture(demo_plot(cut), dpi=110.0),
        "summary.png": figure_picture(demo_summary(cut), dpi=75.0),
    }


def _seen_square(camera: Camera) -> tuple[slice, slice]:
    """Rows and columns of the part of the image that sees anything."""
    import numpy as np

    mask = camera.valid_mask()
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)


def _demo_data(camera: Camera, room: RoomImage, trials: Sequence[Trial]) -> DemoData:
    """The first trial is drawn and levels the image; the first with a shift tells the pixels per radian."""
    from tiltvp import level, normal_from_alpha_beta
    from tiltvp.plots.demo import DemoData
    from tiltvp.plots.marks import tilt_overlay
    from tiltvp.plots.offsets import cosine_of_tilt

    best = trials[0]
    true = normal_from_alpha_beta(room.alpha_rad, room.beta_rad)
    cosines: tuple[Cosine, ...] = ()
    for shifted in trials:
        estimate = shifted.estimate
        if estimate and estimate.shift_px is not None and estimate.alpha_rad > 0.0:
            factor = estimate.shift_px / estimate.alpha_rad
            cosines = (
                cosine_of_tilt("true tilt", camera, true, factor * room.alpha_rad, colour="red", dashed=True),
                _cosine(camera, best, factor, "tab:blue"),
                _cosine(camera, shifted, factor, "tab:orange"),
            )
            break
    levelled = level(room.bgr, camera, best.estimate) if best.estimate else room.bgr
    return DemoData(
        overlay=tilt_overlay(room.bgr, camera, best.estimate, best.edges),
        leaning=room.bgr,
        levelled=levelled,
        phi_rad=best.edges.phi_rad,
        offset_px=best.edges.offset_px,
        cosines=cosines,
        table=_frame(trials),
        alpha_rad=room.alpha_rad,
        beta_rad=room.beta_rad,
    )


def _cosine(camera: Camera, trial: Trial, factor: float, colour: str) -> Cosine:
    from tiltvp.plots.offsets import cosine_of_tilt

    estimate = trial.estimate
    return cosine_of_tilt(trial.label, camera, estimate.normal, factor * estimate.alpha_rad, colour=colour)


def _frame(trials: Sequence[Trial]) -> pl.DataFrame:
    import polars as pl

    def finite(value: float) -> float | None:
        return value if math.isfinite(value) else None

    rows = [
        {
            "method": trial.label,
            "alpha_rad": finite(trial.estimate.alpha_rad),
            "beta_rad": finite(trial.estimate.beta_rad),
            "error_rad": finite(trial.error_rad),
        }
        for trial in trials
    ]
    angles = dict.fromkeys(("alpha_rad", "beta_rad", "error_rad"), pl.Float64)
    return pl.DataFrame(rows, schema={"method": pl.String, **angles})


def _status(words: str) -> AbstractContextManager[object]:
    """A moving sign on stderr while something takes long, on a terminal."""
    if not sys.stderr.isatty():
        return nullcontext()
    from rich.console import Console

    return Console(stderr=True).status(words)
