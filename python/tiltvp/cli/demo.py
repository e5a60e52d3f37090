"""`tiltvp demo`: a room with a known tilt, estimated with every method, as a table and pictures."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from cyclopts import Parameter, validators

from tiltvp.cli.declared_options import Whole
from tiltvp.cli.options import Seed
from tiltvp.cli.results import degrees
from tiltvp.cli.tables import check_file
from tiltvp.cli.terminal import new_table, progress_bar, say, show, status
from tiltvp.cli.tilt_work import words_of
from tiltvp.errors import InvalidInputError
from tiltvp.files import check_output_folder, write_whole

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import Camera, EdgeElements, TiltEstimate
    from tiltvp.overlays.offsets import Cosine
    from tiltvp.synth import RoomImage

_RUNS: Final = 21
_PANEL_PX: Final = 420
FIELD_OF_VIEW_DEG: Final = 185.0
_FOCAL_PER_HEIGHT: Final = 139.7 / 480.0

METHODS: Final[tuple[tuple[str, dict[str, Any]], ...]] = (
    ("refined", {}),
    ("segments", {}),
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
    out: Path | None = None,
    page: Path | None = None,
    seed: Seed = 8,
    alpha_deg: Annotated[float, Parameter(validator=validators.Number(gte=0, lte=180))] = 4.0,
    beta_deg: Annotated[float, Parameter(validator=validators.Number(gte=-360, lte=360))] = 30.0,
    kind: str = "office",
    width: Annotated[Whole, Parameter(show=False)] = 640,
    height: Annotated[Whole, Parameter(show=False)] = 480,
) -> None:
    """Render a room through a 185-degree fisheye at a known tilt and estimate it with every method.

    Parameters
    ----------
    out
        Folder for input.png, overlay.png, levelled.png, plot.png and summary.png; by default out/demo.
    page
        Write this page (.html) in place of the pictures: two sliders lean the robot, and show what its camera sees, the
        edges, the estimate and the level view. It needs no network.
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

    if page is not None:
        if out is not None:
            raise InvalidInputError(f"--out {out} beside --page {page}, expected one of them")
        _write_page(page, kind, seed)
        return
    out = Path("out/demo") if out is None else out
    check_output_folder(out)
    camera = _camera(width, height)
    with status(f"rendering a room ({kind}, seed {seed})"):
        room = render_room(
            camera, kind=kind, seed=seed, alpha_rad=math.radians(alpha_deg), beta_rad=math.radians(beta_deg)
        )
    with status("estimating and drawing"):
        trials = [_trial(camera, room, method, options) for method, options in METHODS]
        pictures = _pictures(camera, room, trials)
        for name, picture in pictures.items():
            write_image(out / name, picture)
    _print_table(room, trials)
    for name in pictures:
        say(str(out / name))


def _write_page(path: Path, kind: str, seed: int) -> None:
    from tiltvp.cli.demo_page import LEANS_DEG, page

    check_file("--page", path, ".html")
    with progress_bar(len(LEANS_DEG) ** 2, "leans") as bar:
        text = page(kind, seed, advance=bar.advance)
    write_whole(path, text)
    say(str(path))


def _camera(width: int, height: int) -> Camera:
    from tiltvp import Camera

    return Camera.equidistant(
        width=width,
        height=height,
        focal_px=_FOCAL_PER_HEIGHT * height,
        cx=(width - 1) / 2.0,
        cy=(height - 1) / 2.0,
        max_theta_rad=math.radians(FIELD_OF_VIEW_DEG / 2.0),
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
    """The first trial is drawn and levels the image."""
    import numpy as np

    from tiltvp import TiltEstimator, level
    from tiltvp.overlays.chart import titled
    from tiltvp.overlays.offsets import error_chart, lean_chart, offset_chart
    from tiltvp.overlays.tilt import draw_words, tilt_overlay

    best, size = trials[0], (_PANEL_PX, _PANEL_PX)
    estimator = TiltEstimator(camera)
    overlay = tilt_overlay(room.bgr, estimator, best.estimate, best.edges)
    levelled = level(room.bgr, estimator, best.estimate) if best.estimate else room.bgr
    seen = _seen_square(camera)
    offsets = offset_chart(size, best.edges.phi_rad, best.edges.offset_px, _cosines(camera, room, trials))
    errors = [(trial.label, math.degrees(trial.error_rad)) for trial in trials]
    leans = [(trial.label, trial.estimate.alpha_rad, trial.estimate.beta_rad) for trial in trials]
    pair = [draw_words(room.bgr, "leaning"), draw_words(levelled, "made level by the estimate")]
    edges = titled(overlay[seen], size, "vertical edges of a leaning robot's view")
    plot = [
        [edges, offsets],
        [error_chart(size, errors), lean_chart(size, (room.alpha_rad, room.beta_rad), leans)],
    ]
    return {
        "input.png": room.bgr,
        "overlay.png": draw_words(overlay, words_of(best.estimate, best.label)),
        "levelled.png": np.hstack(pair),
        "plot.png": np.vstack([np.hstack(row) for row in plot]),
        "summary.png": np.hstack([edges, titled(levelled[seen], size, "made level by the estimate"), offsets]),
    }


def _seen_square(camera: Camera) -> tuple[slice, slice]:
    """Rows and columns of the part of the image that sees anything."""
    import numpy as np

    mask = camera.valid_mask()
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)


def _cosines(camera: Camera, room: RoomImage, trials: Sequence[Trial]) -> list[Cosine]:
    """Those of the truth, of the first trial, and of the first with a shift, which tells the pixels per radian."""
    from tiltvp import normal_from_alpha_beta
    from tiltvp.overlays.offsets import BLUE, ORANGE, RED, cosine_of_tilt

    true = normal_from_alpha_beta(room.alpha_rad, room.beta_rad)
    for trial in trials:
        shifted = trial.estimate
        if shifted and shifted.shift_px is not None and shifted.alpha_rad > 0.0:
            factor, best = shifted.shift_px / shifted.alpha_rad, trials[0].estimate
            return [
                cosine_of_tilt("true tilt", camera, true, factor * room.alpha_rad, colour=RED, dashed=True),
                cosine_of_tilt(trials[0].label, camera, best.normal, factor * best.alpha_rad, colour=BLUE),
                cosine_of_tilt(trial.label, camera, shifted.normal, shifted.shift_px, colour=ORANGE),
            ]
    return []
