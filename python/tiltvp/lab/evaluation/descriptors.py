"""How well the descriptor of lines works on drives of known edges (Scaramuzza et al. 2009, sections 5 and 6)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from threading import Event
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np
import polars as pl

from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.new import in_order
from tiltvp.lab.evaluation.dissimilarities import DISSIMILARITIES
from tiltvp.lab.evaluation.line_pairs import FALSE, RIGHT, FramePair, frame_pairs
from tiltvp.lab.evaluation.line_truth import identities
from tiltvp.lab.evaluation.wide_lines import wide_rows
from tiltvp.lines import LineExtractor, LineTracker, descriptor_distances, ssd_matrix, zncc_matrix

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.lab.datasets.driven import DrivenFrames
    from tiltvp.lines import Lines

__all__ = [
    "DescriptorExperiment",
    "DescriptorSetting",
    "DescriptorTables",
    "follow",
    "measure_descriptors",
    "similarity",
]

Result = TypeVar("Result")

CHARTS: Final = {"great-circle": "on the sphere", "radial": "in the image (the paper's)"}
"""Where the areas of a descriptor are circles, by the extractor's method."""


@dataclass(frozen=True)
class DescriptorSetting:
    """One point of figures 13 to 15."""

    sweep: str
    """What is varied: "clip", "noise" or "bins"."""
    value: float
    areas: str = "3"
    method: str = "great-circle"
    """Whose areas: circles on the sphere, or, "radial", in the image."""
    options: dict[str, Any] = field(default_factory=dict)
    """Options of `LineExtractor`."""
    noise_percent: float = 0.0
    """Standard deviation of Gaussian noise that is added to both images, in per cent of the grey levels."""


@dataclass(frozen=True)
class DescriptorExperiment:
    """Which frames are compared, and how described. The defaults are the paper's values, and those around them."""

    frames_apart: tuple[int, ...] = (1, 2, 5, 10, 20, 40)
    """How far apart the frames of a pair are."""
    every: int = 2
    """From the first frame of a pair to that of the next."""
    baseline_max_m: float = 2.0
    """Pairs with a longer way between them are left out."""
    clips: tuple[float, ...] = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0)
    noises_percent: tuple[float, ...] = (0.0, 1.0, 2.0, 4.0, 6.0, 8.0, 10.0)
    bins: tuple[int, ...] = (4, 8, 16, 32, 64)
    seed: int = 0
    """Seed of the noise."""

    def __post_init__(self) -> None:
        if not self.frames_apart or min(self.frames_apart) < 1:
            raise InvalidInputError(f"frames_apart = {self.frames_apart}, expected whole numbers from 1")
        if self.every < 1:
            raise InvalidInputError(f"every = {self.every}, expected 1 or more")
        if not self.baseline_max_m > 0.0:
            raise InvalidInputError(f"baseline_max_m = {self.baseline_max_m}, expected a positive length")

    @property
    def settings(self) -> tuple[DescriptorSetting, ...]:
        """What is measured."""
        made: list[DescriptorSetting] = []
        for method in CHARTS:
            made += [DescriptorSetting("clip", c, method=method, options={"descriptor_clip": c}) for c in self.clips]
            made += [DescriptorSetting("noise", n, method=method, noise_percent=n) for n in self.noises_percent]
        for areas, more in (("3", {}), ("5 overlapping", {"descriptor_areas": 5, "descriptor_overlapping": True})):
            made += [
                DescriptorSetting("bins", float(n), areas, options={"descriptor_bins": n} | more) for n in self.bins
            ]
        return tuple(made)

    @property
    def steps(self) -> int:
        """How often `measure_descriptors` says that it has advanced, for each drive."""
        return len(self.settings) + 2


@dataclass(frozen=True, eq=False)
class DescriptorTables:
    """What `measure_descriptors` has found."""

    settings: pl.DataFrame
    """sweep, chart, areas, value, queries (lines with the same edge in the other frame), correct_% of them."""
    measures: pl.DataFrame
    """measure (those of `DISSIMILARITIES`, SSD, ZNCC), frames_apart, queries, correct_%."""
    matches: pl.DataFrame
    """One row for each line and other frame: drive, frame, frames_apart, baseline_m, distance, mean_ratio,
    second_ratio, correct; with lines whose edge is not found in the other frame, whose nearest is wrong whatever it is.
    """
    wide: pl.DataFrame
    """Frames 1 to 2 m apart: matcher, pairs, possible, right, false, found_% (of the possible), precision_%."""


@dataclass(frozen=True, eq=False)
class _Frame:
    gray: NDArray[np.uint8]
    lines: Lines
    edges: tuple[frozenset[int], ...]


def measure_descriptors(
    drives: Sequence[DrivenFrames],
    experiment: DescriptorExperiment | None = None,
    *,
    threads: int = 1,
    advance: Callable[[], None] = lambda: None,
) -> DescriptorTables:
    """Whether the nearest descriptor of another frame is that of the same edge, by setting, rule and measure.

    Lines are found by the default method with the true lean, once for all settings; those on no true edge stay among
    the candidates. `advance` is called `experiment.steps` times for each drive.
    """
    experiment = experiment or DescriptorExperiment()
    counted: list[dict[str, Any]] = []
    measured: list[dict[str, Any]] = []
    matches: list[pl.DataFrame] = []
    wide: list[dict[str, Any]] = []
    for drive in drives:
        frames = _found(drive, threads)
        advance()
        pairs = frame_pairs(drive, [frame.edges for frame in frames], [frame.lines for frame in frames], experiment)
        for setting in experiment.settings:
            described = _described(drive, frames, setting, experiment.seed, threads)
            counts = [_count(pair, descriptor_distances(described[pair.a], described[pair.b])) for pair in pairs]
            counted.append(_setting_row(setting) | dict(zip(("correct", "queries"), _sums(counts), strict=True)))
            advance()
        plain = _described(drive, frames, DescriptorSetting("", 0.0), experiment.seed, threads)
        matches.append(_matches(drive.name, pairs, plain))
        measured += _measures(drive, frames, pairs, plain, threads)
        profile = DescriptorSetting("", 0.0, options={"descriptor_kind": "profile"})
        wide += wide_rows(
            drive,
            [frame.lines for frame in frames],
            [frame.edges for frame in frames],
            plain,
            _described(drive, frames, profile, experiment.seed, threads),
            experiment.seed,
        )
        advance()
    return DescriptorTables(
        _shares(pl.DataFrame(counted), ("sweep", "chart", "areas", "value")),
        _shares(pl.DataFrame(measured), ("measure", "frames_apart")),
        pl.concat(matches),
        _wide(wide),
    )


def _wide(rows: list[dict[str, Any]]) -> pl.DataFrame:
    """`DescriptorTables.wide` of the rows of all pairs."""
    counts = ("pairs", "possible", "right", "false")
    table = pl.DataFrame(rows, schema={"matcher": pl.String} | dict.fromkeys(counts, pl.Int64))
    right, false = pl.col("right"), pl.col("false")
    return (
        table.group_by("matcher", maintain_order=True)
        .agg(pl.col(counts).sum())
        .with_columns(
            (100.0 * right / pl.col("possible")).alias("found_%"),
            (100.0 * right / (right + false)).alias("precision_%"),
        )
    )


def similarity(drive: DrivenFrames, frame: int, *, step_deg: int = 1) -> pl.DataFrame:
    """Figures 9, 11 and 12: how unlike the directions of one frame are, every `step_deg` degrees.

    Columns first_deg, second_deg, descriptor (eq. 11), ssd (eq. 12), zncc (eq. 13, upside down: 1 minus it, so that for
    all three 0 is alike). One row for each pair of directions.
    """
    if not (0 < step_deg <= 90 and 360 % step_deg == 0):
        raise InvalidInputError(f"step_deg = {step_deg}, expected a divisor of 360 up to 90")
    extractor = _extractor(drive, {})
    directions = np.arange(-180, 180, step_deg)
    lines = extractor.lines_at(np.radians(directions.astype(np.float64)), drive.tilt(frame))
    gray = drive.gray(frame)
    described = extractor.describe(gray, lines)
    patches = extractor.patches(gray, lines).reshape(len(lines), -1)
    first, second = np.meshgrid(directions, directions, indexing="ij")
    return pl.DataFrame(
        {
            "first_deg": first.ravel().astype(np.int32),
            "second_deg": second.ravel().astype(np.int32),
            "descriptor": descriptor_distances(described, described).ravel(),
            "ssd": ssd_matrix(patches, patches).ravel(),
            "zncc": 1.0 - zncc_matrix(patches, patches).ravel(),
        }
    )


def follow(drive: DrivenFrames, frames: int) -> pl.DataFrame:
    """The tracks of the first frames of a drive, as the paper has them in figure 22: frame, track, bearing_rad.

    The tracker is not told how the robot turns.
    """
    extractor, tracker = _extractor(drive, {}), LineTracker()
    rows: list[tuple[int, int, float]] = []
    for k in range(min(frames, len(drive))):
        gray = drive.gray(k)
        lines = extractor(gray, drive.tilt(k))
        tracked = tracker.update(lines, extractor.describe(gray, lines))
        rows += [(k, *row) for row in zip(tracked.track.tolist(), lines.bearing_rad.tolist(), strict=True)]
    return pl.DataFrame(rows, schema={"frame": pl.Int64, "track": pl.Int64, "bearing_rad": pl.Float64}, orient="row")


def _extractor(drive: DrivenFrames, options: dict[str, Any], method: str = "great-circle") -> LineExtractor:
    dataset = drive.dataset
    return LineExtractor(
        dataset.camera, method=method, robot_from_camera=dataset.robot_from_camera, mask=dataset.mask, **options
    )


def _in_frames(work: Callable[[int], Result], drive: DrivenFrames, threads: int) -> Iterator[Result]:
    """`work(frame)` of all frames, in order."""
    with in_order(work, range(len(drive)), threads, Event()) as results:
        yield from results


def _found(drive: DrivenFrames, threads: int) -> list[_Frame]:
    """All frames, with their lines and the edges that these are on."""
    extractor = _extractor(drive, {})

    def find(k: int) -> _Frame:
        gray = drive.gray(k)
        lines = extractor(gray, drive.tilt(k))
        return _Frame(gray, lines, identities(lines, drive.truths[k], length_min_rad=0.0).edges)

    return list(_in_frames(find, drive, threads))


def _described(
    drive: DrivenFrames, frames: Sequence[_Frame], setting: DescriptorSetting, seed: int, threads: int
) -> list[NDArray[np.float32]]:
    """The descriptors of the lines of all frames."""
    extractor = _extractor(drive, setting.options, setting.method)
    sigma = 2.55 * setting.noise_percent

    def describe(k: int) -> NDArray[np.float32]:
        gray, lines = frames[k].gray, frames[k].lines
        if sigma > 0.0:
            noise = np.random.default_rng((seed, k)).normal(0.0, sigma, gray.shape)
            gray = np.clip(np.rint(gray + noise), 0.0, 255.0).astype(np.uint8)
        # The paper's areas lie along a radius of the image, for which it knows no lean.
        placed = lines if setting.method == "great-circle" else extractor.lines_at(lines.bearing_rad)
        return extractor.describe(gray, placed)

    return list(_in_frames(describe, drive, threads))


def _count(pair: FramePair, unlikeness: NDArray[np.float64]) -> tuple[int, int]:
    """Correct matches, and lines with the same edge in the other frame whose match can be judged."""
    verdicts = pair.verdicts[pair.lines, unlikeness[pair.lines].argmin(axis=1)][pair.findable]
    return int((verdicts == RIGHT).sum()), int((verdicts >= FALSE).sum())


def _sums(counts: Iterable[tuple[int, int]]) -> tuple[int, int]:
    correct, judged = np.array([(0, 0), *counts]).sum(axis=0).tolist()
    return correct, judged


def _setting_row(setting: DescriptorSetting) -> dict[str, Any]:
    return {
        "sweep": setting.sweep, "chart": CHARTS[setting.method], "areas": setting.areas, "value": setting.value
    }  # fmt: skip


def _shares(table: pl.DataFrame, keys: tuple[str, ...]) -> pl.DataFrame:
    """Counts of all drives together, and the share that is correct."""
    summed = table.group_by(keys, maintain_order=True).agg(pl.col("queries").sum(), pl.col("correct").sum())
    return summed.select(*keys, "queries", (100.0 * pl.col("correct") / pl.col("queries")).alias("correct_%"))


def _matches(name: str, pairs: Sequence[FramePair], described: Sequence[NDArray[np.float32]]) -> pl.DataFrame:
    """The columns of `DescriptorTables.matches`."""
    rows: list[tuple[Any, ...]] = []
    for pair in pairs:
        if len(described[pair.b]) < 2:
            continue
        distances = descriptor_distances(described[pair.a], described[pair.b])[pair.lines]
        ordered = np.sort(distances, axis=1)
        least, second, mean = ordered[:, 0], ordered[:, 1], distances.mean(axis=1)
        verdicts = pair.verdicts[pair.lines, distances.argmin(axis=1)]
        with np.errstate(divide="ignore", invalid="ignore"):
            columns = zip(least, least / mean, least / second, verdicts == RIGHT, strict=True)
        rows += [
            (name, pair.a, pair.b - pair.a, pair.baseline_m, *map(float, row[:3]), bool(row[3]))
            for row, verdict in zip(columns, verdicts, strict=True)
            if verdict >= FALSE and math.isfinite(row[2])
        ]
    schema: dict[str, Any] = {"drive": pl.String, "frame": pl.Int64, "frames_apart": pl.Int64, "baseline_m": pl.Float64}
    schema |= dict.fromkeys(("distance", "mean_ratio", "second_ratio"), pl.Float64) | {"correct": pl.Boolean}
    return pl.DataFrame(rows, schema=schema, orient="row")


def _measures(
    drive: DrivenFrames,
    frames: Sequence[_Frame],
    pairs: Sequence[FramePair],
    described: Sequence[NDArray[np.float32]],
    threads: int,
) -> list[dict[str, Any]]:
    """Rows of `DescriptorTables.measures` before they are summed."""
    extractor = _extractor(drive, {})

    def patches(k: int) -> NDArray[np.float32]:
        cut = extractor.patches(frames[k].gray, frames[k].lines)
        return cut.reshape(len(cut), -1) if len(cut) else cut.reshape(0, 1)

    cut = list(_in_frames(patches, drive, threads))
    rows: list[dict[str, Any]] = []
    for pair in pairs:
        a, b = pair.a, pair.b
        unlike = {name: measure(described[a], described[b]) for name, measure in DISSIMILARITIES.items()}
        unlike |= {
            "SSD": ssd_matrix(cut[a], cut[b]),
            "ZNCC": 1.0 - zncc_matrix(cut[a], cut[b]),
        }
        for measure, matrix in unlike.items():
            correct, judged = _count(pair, np.nan_to_num(matrix, nan=np.inf))
            rows.append({"measure": measure, "frames_apart": b - a, "correct": correct, "queries": judged})
    return rows
