"""How well lines are found and followed on rendered drives, upright or not (Scaramuzza et al. 2009, section 9.1)."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from threading import Event
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
import polars as pl

from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.driving import drive_room
from tiltvp.lab.datasets.new import in_order
from tiltvp.lab.evaluation.line_truth import Identities, Judge, edge_bearings, identities
from tiltvp.lines import LineExtractor, LineTracker
from tiltvp.synth import MIRROR_BLIND_RAD, Drive, mirror_camera
from tiltvp.tilt import TiltEstimator

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.synth import DriveTruth

__all__ = ["LINE_VARIANTS", "LineExperiment", "LineVariant", "line_intervals", "measure_lines", "summarise_lines"]


@dataclass(frozen=True)
class LineVariant:
    """A way to find and follow lines."""

    name: str
    tilt: Literal["upright", "refined", "true"]
    """What the robot's lean is taken for: none, the estimate of the frame, or the truth."""
    odometry: bool
    """Whether the tracker is told what the encoders say: how far the robot has gone and turned."""
    extractor: dict[str, Any] = field(default_factory=dict)
    """Options of `LineExtractor` that are not the default."""
    tracker: dict[str, Any] = field(default_factory=dict)
    """Options of `LineTracker` that are not the default."""


_PAPER: Final[dict[str, Any]] = {"mutual": False, "ordered": False}
LINE_VARIANTS: tuple[LineVariant, ...] = (
    LineVariant("great-circle", "refined", True),
    LineVariant("great-circle, ten longest", "refined", True, {"lines_max": 10}),
    LineVariant("great-circle, true tilt", "true", True),
    LineVariant("great-circle, no odometry", "refined", False),
    LineVariant("great-circle, taken as upright", "upright", True),
    LineVariant("radial (the paper's)", "upright", False, {"method": "radial"}, _PAPER),
    LineVariant("radial, odometry", "upright", True, {"method": "radial"}),
)
"""The default, with what is known of the robot and without, and the paper's."""

_DUE_MIN_RAD: Final = math.radians(15.0)
"""In sight over how much elevation any method is asked for an edge."""
_COUNTS: Final = ("lines", "on_edges", "correct", "false_matches", "false_new", "unknown", "due", "found")
_TIMES: Final = ("extract_ms", "describe_ms", "match_ms")
_SCHEMA: Final[dict[str, Any]] = (
    {"kind": pl.String, "lean_max_deg": pl.Float64, "variant": pl.String, "frame": pl.UInt32, "lean_rad": pl.Float64}
    | dict.fromkeys(_COUNTS, pl.UInt32)
    | {"squared_error_rad2": pl.Float64}
    | dict.fromkeys(_TIMES, pl.Float64)
)


@dataclass(frozen=True)
class LineExperiment:
    """The drives of an experiment: each of `kinds`, with the same way and light for each of `leans_max_deg`.

    Frames are those of `tiltvp.synth.mirror_camera`, 640 x 480. `seed` is that of the first room and drive, and one
    more for each further kind. Equal experiments give equal tables, times aside.
    """

    frames: int = 400
    """Frames of each drive."""
    kinds: tuple[str, ...] = ("corridor", "hall")
    leans_max_deg: tuple[float, ...] = (0.0, 5.0)
    """How far bumps lean the robot."""
    seed: int = 9001
    samples: int = 2
    """Rays per pixel and side where surfaces meet."""
    resolution_scale: float = 1.0
    """Pixels per side of the camera, in multiples of 640 x 480."""

    def __post_init__(self) -> None:
        if self.frames < 2:
            raise InvalidInputError(f"frames = {self.frames}, expected 2 or more")

    @property
    def steps(self) -> int:
        """Frames in all."""
        return self.frames * len(self.kinds) * len(self.leans_max_deg)

    def drives(self, threads: int | None) -> Iterator[tuple[str, float, Drive]]:
        """Kind, greatest lean in degrees, and the drive."""
        camera = mirror_camera().scaled(self.resolution_scale)
        for k, kind in enumerate(self.kinds):
            room = drive_room(kind, self.seed + k, threads=threads)
            for lean_deg in self.leans_max_deg:
                yield (
                    kind,
                    lean_deg,
                    Drive(
                        room,
                        camera=camera,
                        blind_rad=MIRROR_BLIND_RAD,
                        frames=self.frames,
                        seed=self.seed + k,
                        bumps_max_rad=math.radians(lean_deg),
                        samples=self.samples,
                        threads=threads,
                    ),
                )


def measure_lines(
    experiment: LineExperiment,
    variants: tuple[LineVariant, ...] = LINE_VARIANTS,
    *,
    threads: int = 1,
    advance: Callable[[], None] = lambda: None,
) -> pl.DataFrame:
    """One row for each frame of each drive and variant: counts as in `Identities` and `Verdicts`, errors, and times.

    `squared_error_rad2` is the sum over lines on edges. Times are of one thread's processor time; `threads` render.
    """
    rows: list[dict[str, Any]] = []
    for kind, lean_deg, drive in experiment.drives(threads):
        runs = [_Run(variant, drive) for variant in variants]
        estimator = TiltEstimator(drive.camera, robot_from_camera=drive.robot_from_camera)
        stop = Event()

        def render(frame: int, drive: Drive = drive, stop: Event = stop) -> tuple[NDArray[np.uint8], DriveTruth] | None:
            return None if stop.is_set() else (drive.render(frame, threads=1).gray, drive.truth(frame, threads=1))

        with in_order(render, range(len(drive)), threads, stop) as results:
            for frame, seen in enumerate(results):
                if seen is None:
                    break
                gray, truth = seen
                alpha, beta = drive.tilts[frame].tolist()
                estimate = estimator(gray)
                tilts = {"upright": None, "refined": estimate if estimate else None, "true": (alpha, beta)}
                everywhere = edge_bearings(drive, frame)
                for run in runs:
                    row = run(gray, tilts[run.variant.tilt], truth, everywhere, drive.motions[frame].tolist())
                    place = {"kind": kind, "lean_max_deg": lean_deg, "frame": frame, "lean_rad": alpha}
                    rows.append(place | {"variant": run.variant.name} | row)
                advance()
    return pl.DataFrame(rows, schema=_SCHEMA)


class _Run:
    """One variant on one drive."""

    def __init__(self, variant: LineVariant, drive: Drive) -> None:
        self.variant = variant
        options = {"robot_from_camera": drive.robot_from_camera} | variant.extractor
        self._extractor = LineExtractor(drive.camera, **options)
        self._tracker = LineTracker(**variant.tracker)
        self._judge = Judge(int(self._tracker.options["look_back"]))

    def __call__(
        self,
        gray: NDArray[np.uint8],
        tilt: Any,
        truth: DriveTruth,
        everywhere: NDArray[np.float64],
        motion: tuple[float, float],
    ) -> dict[str, Any]:
        clock = [time.thread_time()]
        lines = self._extractor(gray, None if self.variant.extractor.get("method") == "radial" else tilt)
        clock.append(time.thread_time())
        descriptors = self._extractor.describe(gray, lines)
        clock.append(time.thread_time())
        told = dict(zip(("distance_m", "yaw_change_rad"), motion, strict=True)) if self.variant.odometry else {}
        tracked = self._tracker.update(lines, descriptors, **told)
        clock.append(time.thread_time())
        known: Identities = identities(lines, truth, length_min_rad=_DUE_MIN_RAD)
        errors = known.error_rad[np.isfinite(known.error_rad)]
        counts = {"lines": len(lines), "on_edges": len(errors), "due": known.due, "found": known.found}
        counts |= asdict(self._judge(tracked, known, everywhere))
        times = dict(zip(_TIMES, (1e3 * np.diff(clock)).tolist(), strict=True))
        return counts | times | {"squared_error_rad2": float(errors @ errors)}


def _rates() -> list[pl.Expr]:
    """Rates as in table 3: of all lines that have been followed before, those continued rightly, wrongly, and not."""
    total = pl.col("correct") + pl.col("false_matches") + pl.col("false_new")
    return [(100.0 * pl.col(name) / total).alias(f"{name}_%") for name in ("correct", "false_matches", "false_new")] + [
        (100.0 * pl.col("unknown") / (total + pl.col("unknown"))).alias("unknown_%")
    ]


def summarise_lines(table: pl.DataFrame, *, by: tuple[str, ...] = ("lean_max_deg", "variant")) -> pl.DataFrame:
    """One row for each lean and variant: rates in per cent of `matches`: lines followed before, of known truth.

    `bearing_rms_deg` is that of lines on edges, `edges_found_%` of the edges due, `on_edges_%` of the lines; times are
    medians over the frames.
    """
    summed = table.group_by(by, maintain_order=True).agg(
        pl.len().alias("frames"), pl.col(*_COUNTS, "squared_error_rad2").cast(pl.Float64).sum(),
        pl.col(*_TIMES).median(), pl.sum_horizontal(*_TIMES).median().alias("frame_ms"),
    )  # fmt: skip
    return summed.select(
        *by,
        (pl.col("lines") / pl.col("frames")).alias("lines"),
        (pl.col("correct") + pl.col("false_matches") + pl.col("false_new")).cast(pl.UInt32).alias("matches"),
        *_rates(),
        (pl.col("squared_error_rad2") / pl.col("on_edges")).sqrt().degrees().alias("bearing_rms_deg"),
        (100.0 * pl.col("on_edges") / pl.col("lines")).alias("on_edges_%"),
        (100.0 * pl.col("found") / pl.col("due")).alias("edges_found_%"),
        *_TIMES,
        "frame_ms",
    )


def line_intervals(table: pl.DataFrame, variant: str = LINE_VARIANTS[0].name, *, every: int = 200) -> pl.DataFrame:
    """Recognition rates of one variant in the layout of table 3, over so many frames at a time."""
    first = pl.col("frame") // every * every
    names = (first.cast(pl.String) + "-" + (first + every).cast(pl.String)).alias("interval")
    chosen = table.filter(pl.col("variant") == variant).with_columns(names)
    summary = summarise_lines(chosen, by=("kind", "lean_max_deg", "interval"))
    return summary.select("kind", "lean_max_deg", "interval", "matches", "correct_%", "false_matches_%", "false_new_%")
