"""Edge offsets over the gradient's direction, and what methods make of them, as charts (Fleer 2017, fig. 11)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tiltvp.overlays.chart import BLACK, PALE, Chart, text_width

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera
    from tiltvp.overlays.chart import Picture

__all__ = ["COLOURS", "Cosine", "cosine_of_tilt", "error_chart", "lean_chart", "offset_chart", "offset_counts"]

BLUE, ORANGE, RED = "#1f77b4", "#ff7f0e", "#d62728"
COLOURS = (BLUE, ORANGE, "#2ca02c", "#9467bd", "#8c564b", "#e377c2", "#bcbd22", "#17becf")
"""Those of methods, in their order."""
_STEPS_DEG = (1, 2, 5, 10, 20, 50)
"""Between the rings of leans, of which there are up to ten across."""


@dataclass(frozen=True)
class Cosine:
    """The offsets `s = shift_px cos(direction_rad - phi)` that the vertical edges of one tilt have, eq. 18."""

    label: str
    shift_px: float
    direction_rad: float
    colour: str = BLUE
    dashed: bool = False


def cosine_of_tilt(
    label: str,
    camera: Camera,
    normal: ArrayLike,
    shift_px: float,
    robot_from_camera: ArrayLike | None = None,
    *,
    colour: str = BLUE,
    dashed: bool = False,
) -> Cosine:
    """The cosine of a ground normal (3,): its direction is where the vertical vanishing point moves in the image.

    NaN, and therefore no line, where the camera sees neither zenith nor nadir.
    """
    rotation = np.eye(3) if robot_from_camera is None else np.asarray(robot_from_camera, dtype=np.float64)
    leaning, upright = rotation.T @ np.asarray(normal, dtype=np.float64), rotation.T @ np.array([0.0, 0.0, 1.0])
    for sign in (1.0, -1.0):
        moved, still = camera.project(sign * np.stack([leaning, upright]))
        if np.isfinite(moved).all() and np.isfinite(still).all():
            du, dv = moved - still
            return Cosine(label, shift_px, float(np.arctan2(dv, du)), colour, dashed)
    return Cosine(label, shift_px, float("nan"), colour, dashed)


def offset_counts(phi_rad: ArrayLike, offset_px: ArrayLike, offset_max_px: float) -> NDArray[np.float64]:
    """(90, 80): how many edge pixels have a direction and an offset, as shares of a full cell, which is 1 or more."""
    phi, offset = np.asarray(phi_rad, dtype=np.float64), np.asarray(offset_px, dtype=np.float64)
    limits = [[0.0, 180.0], [-offset_max_px, offset_max_px]]
    counts: NDArray[np.float64] = np.histogram2d(np.degrees(phi), offset, bins=(90, 80), range=limits)[0]
    full = float(np.quantile(counts[counts > 0], 0.99)) if (counts > 0).any() else 1.0
    return counts / full


def offset_chart(
    size: tuple[int, int],
    phi_rad: ArrayLike,
    offset_px: ArrayLike,
    cosines: Sequence[Cosine] = (),
    *,
    title: str = "edge offsets, and the tilt behind them",
    offset_max_px: float = 40.0,
) -> Picture:
    """The (phi, s) histogram, darker where more edge pixels are, and the cosines; (height, width, 3) BGR uint8."""
    chart = Chart(
        size, (0.0, 180.0), (-offset_max_px, offset_max_px),
        labels=(title, "gradient direction phi (degrees)", "edge offset s (pixels)"),
        ticks=((0, 45, 90, 135, 180), np.linspace(-offset_max_px, offset_max_px, 5).tolist()),
    )  # fmt: skip
    chart.cells(offset_counts(phi_rad, offset_px, offset_max_px).T[::-1])
    chart.curve(np.linspace(0.0, 180.0, 91), np.zeros(91), BLACK, dashed=True)
    grid = np.linspace(0.0, np.pi, 181)
    shown = [one for one in cosines if math.isfinite(one.shift_px) and math.isfinite(one.direction_rad)]
    for one in shown:
        offsets = one.shift_px * np.cos(one.direction_rad - grid)
        chart.curve(np.degrees(grid), offsets, one.colour, width=2, dashed=one.dashed)
    chart.legend([(one.label, one.colour) for one in shown])
    return chart.framed()


def error_chart(size: tuple[int, int], errors: Sequence[tuple[str, float]]) -> Picture:
    """A bar for each method and its error in degrees, the first on top; NaN where it found no tilt."""
    found = [error for _, error in errors if math.isfinite(error)]
    limit = max(1.25 * max(found, default=1.0), 0.1)
    chart = Chart(
        size, (0.0, limit), (-0.5, len(errors) - 0.5),
        labels=("error of every method", "angle between the normals (degrees)", ""),
        left_px=max((text_width(name) for name, _ in errors), default=0) + 12,
    )  # fmt: skip
    for i, (name, error) in enumerate(errors):
        row, length = len(errors) - 1.0 - i, error if math.isfinite(error) else 0.0
        chart.bar(length, (row - 0.3, row + 0.3), COLOURS[i % len(COLOURS)])
        chart.words(length, row, f"{error:.2f}" if math.isfinite(error) else "no tilt", across_px=5.0)
        chart.words(0.0, row, name, across_px=-6.0 - text_width(name))
    return chart.framed()


def lean_chart(size: tuple[int, int], true: tuple[float, float], leans: Sequence[tuple[str, float, float]]) -> Picture:
    """Where the robot leans to, forward up and left to the left: the truth as a cross, each estimate as a dot.

    `true` is (alpha_rad, beta_rad), `leans` are (method, alpha_rad, beta_rad). A step in the picture is the error of
    eq. 44 for small tilts.
    """
    spots = [_spot(*true), *(_spot(alpha, beta) for _, alpha, beta in leans)]
    finite = np.array([spot for spot in spots if np.isfinite(spot).all()] + [(0.0, 0.0)])
    low, high = finite.min(axis=0), finite.max(axis=0)
    reach = 0.5 * float((high - low).max()) + 0.7
    (x, y) = (low + high) / 2.0
    step = next((step for step in _STEPS_DEG if reach <= 5.0 * step), _STEPS_DEG[-1])
    chart = Chart(
        size, (x - reach, x + reach), (y - reach, y + reach),
        labels=("true and estimated lean", "lean to the right (degrees)", "lean forward (degrees)"),
        ticks=(_between(x - reach, x + reach, step), _between(y - reach, y + reach, step)),
    )  # fmt: skip
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    for radius in range(step, int(math.hypot(abs(x) + reach, abs(y) + reach)) + 1, step):
        chart.curve(radius * np.cos(turn), radius * np.sin(turn), PALE)
    for i, spot in enumerate(spots[1:]):
        if np.isfinite(spot).all():
            chart.dot(*spot, COLOURS[i % len(COLOURS)])
    chart.cross(*spots[0], RED)
    chart.words(*spots[0], "true", across_px=12.0)
    return chart.framed()


def _between(low: float, high: float, step: int) -> list[int]:
    """The multiples of a step within limits."""
    return [step * k for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _spot(alpha_rad: float, beta_rad: float) -> tuple[float, float]:
    """Degrees to the right and forward."""
    alpha = math.degrees(alpha_rad)
    return -alpha * math.sin(beta_rad), alpha * math.cos(beta_rad)
