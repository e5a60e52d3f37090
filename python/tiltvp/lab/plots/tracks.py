"""Bearings of lines over the frames of a drive, a colour for each track (Scaramuzza et al. 2009, figure 22)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from tiltvp.overlays.lines import track_colour

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

__all__ = ["draw_tracks", "track_plot"]

_LABELS_MAX = 120
"""More numbers than these would hide the tracks: the shortest tracks go without."""


def draw_tracks(axes: Axes, table: pl.DataFrame) -> None:
    """Columns `frame`, `track`, `bearing_rad`: a dot where a line was seen, a line along its track, its number where
    it begins. Tracks break where they pass from -180 to 180 degrees, also while nobody sees them.
    """
    parts = [part for _, part in table.sort("track", "frame").group_by("track", maintain_order=True)]
    turned = _turned(parts)
    longest = sorted((part.height for part in parts), reverse=True)
    least = max(longest[min(_LABELS_MAX, len(longest)) - 1] if longest else 0, 2)
    for part in parts:
        track = int(part["track"][0])
        frames = part["frame"].to_numpy().astype(np.float64)
        bearings = np.degrees(part["bearing_rad"].to_numpy())
        blue, green, red = (0.8 * value / 255.0 for value in track_colour(track))
        colour = (red, green, blue)
        way = _broken(frames, bearings, turned[part["frame"].to_numpy()])
        axes.plot(*way, "-", color=colour, linewidth=0.8, zorder=2)
        axes.plot(frames, bearings, "o", color=colour, markersize=1.8, markeredgewidth=0.0, zorder=3)
        if part.height >= least:
            axes.annotate(
                str(track), (frames[0], bearings[0]), (0, 3), textcoords="offset points", fontsize=6, color=colour,
                clip_on=True, zorder=4,
            )  # fmt: skip
    axes.set_ylim(-180.0, 180.0)
    axes.set_yticks(range(-180, 181, 45))
    axes.set_xlabel("frame")
    axes.set_ylabel("bearing (degrees)")
    axes.grid(color="0.92", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)


def track_plot(table: pl.DataFrame) -> Figure:
    """The tracks of a table, see `draw_tracks`: wider for more frames."""
    frames = table["frame"].to_numpy()
    span = int(frames.max() - frames.min()) if frames.size else 0
    figure = Figure(figsize=(min(9.0 + span / 60.0, 24.0), 7.0), layout="constrained")
    draw_tracks(figure.subplots(), table)
    return figure


def _turned(parts: list[pl.DataFrame]) -> NDArray[np.float64]:
    """(frames,): degrees by which bearings have changed up to each frame, in the median of those that follow on."""
    steps: dict[int, list[float]] = {}
    for part in parts:
        frames, bearings = part["frame"].to_numpy().astype(int), np.degrees(part["bearing_rad"].to_numpy())
        for frame, gap, step in zip(frames[1:].tolist(), np.diff(frames), _within(np.diff(bearings)), strict=True):
            if gap == 1:
                steps.setdefault(frame, []).append(step)
    count = max((int(part["frame"].to_numpy()[-1]) for part in parts), default=-1) + 1
    return np.cumsum([np.median(steps.get(frame, [0.0])) for frame in range(count)])


def _within(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same in [-180, 180)."""
    return (angles + 180.0) % 360.0 - 180.0


def _broken(
    frames: NDArray[np.float64], bearings: NDArray[np.float64], turned: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The track with a gap where its change, that nearest to how far all `turned`, is not that of the numbers."""
    shown, told = np.diff(bearings), np.diff(turned)
    jumps = np.flatnonzero(np.abs(shown - told - _within(shown - told)) > 1.0) + 1
    return np.insert(frames, jumps, np.nan), np.insert(bearings, jumps, np.nan)
