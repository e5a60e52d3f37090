"""What a lean costs a method that takes motion to be planar, and what tilt correction saves: figure 26's question.

Min-warping estimates the pose of a leaning robot's view relative to an upright one's in rendered rooms, from panoramas
that are corrected by nothing, by the paper's method, by the refined method, or by the true tilt.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass, field
from threading import Event
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.driving import OPEN_KINDS
from tiltvp.lab.datasets.new import in_order
from tiltvp.lab.datasets.panoramas import paper_camera
from tiltvp.lab.evaluation.planar.panorama import PanoramaGrid
from tiltvp.lab.evaluation.planar.warping import MinWarping, bearing_and_orientation
from tiltvp.levelling import Unwrapper
from tiltvp.synth import Room
from tiltvp.tilt import TiltEstimator, normal_from_alpha_beta, tilt_error_rad

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.cameras import Camera

__all__ = ["CORRECTIONS", "PlanarPoseExperiment", "measure_planar_pose"]

CORRECTIONS: tuple[str, ...] = ("none", "reject-refit, trained a", "reject-refit, closed form", "refined", "true tilt")
"""By what panoramas are made level: the paper's image-space method is there with the factor of eqs. 30 and 31,
trained on all other rooms, and with the closed-form gain. An image without an estimate is left as it is."""

_PAPER = "image-space-reject-refit"
_UPRIGHT = np.array([0.0, 0.0, 1.0])
_CANDIDATES = 256
"""Free poses of a room among which a group of near places is looked for."""
_TRAINING_TILT_MIN_DEG = 1.38
"""The least lean that the factor is trained with, as in table 1; smaller ones drown in the errors of their shifts."""
_SCHEMA: dict[str, Any] = {
    "kind": pl.String,
    "room_seed": pl.UInt64,
    "first": pl.UInt8,
    "second": pl.UInt8,
    "distance_m": pl.Float64,
    "alpha_rad": pl.Float64,
    "beta_rad": pl.Float64,
    "correction": pl.String,
    "factor": pl.Float64,
    "first_tilt_error_rad": pl.Float64,
    "second_tilt_error_rad": pl.Float64,
    "bearing_true_rad": pl.Float64,
    "orientation_true_rad": pl.Float64,
    "bearing_rad": pl.Float64,
    "orientation_rad": pl.Float64,
    "bearing_error_rad": pl.Float64,
    "orientation_error_rad": pl.Float64,
}


@dataclass(frozen=True)
class PlanarPoseExperiment:
    """The rooms, places and leans of an experiment; equal experiments give equal tables.

    Each of `rooms` rooms, of `kinds` in turn, has a group of `places` free places, 0.2 to 1 m from each other, with
    random headings. Every ordered pair of a group is a pair: upright at the first place, and at the second leaning by
    each of `tilts_deg` in a random direction. `samples` and `noise_sigma` are those of `tiltvp.synth.Room.render`.
    """

    rooms: int = 15
    seed: int = 0
    kinds: tuple[str, ...] = OPEN_KINDS
    places: int = 4
    tilts_deg: tuple[float, ...] = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0)
    distances_m: tuple[float, float] = (0.2, 1.0)
    samples: int = 2
    noise_sigma: float = 2.0
    camera: Camera = field(default_factory=paper_camera)
    grid: PanoramaGrid = field(default_factory=PanoramaGrid)

    def __post_init__(self) -> None:
        """Raises `tiltvp.errors.InvalidInputError`."""
        if self.rooms < 2 or self.places < 2 or self.seed < 0 or not self.kinds:
            what = f"rooms = {self.rooms}, places = {self.places}, seed = {self.seed}, kinds = {self.kinds}"
            raise InvalidInputError(f"{what}, expected 2 or more rooms and places, no negative seed, 1 or more kinds")
        if not any(tilt >= _TRAINING_TILT_MIN_DEG for tilt in self.tilts_deg) or min(self.tilts_deg) < 0.0:
            expected = f"no negative one, and one of {_TRAINING_TILT_MIN_DEG} or more to train the paper's factor with"
            raise InvalidInputError(f"tilts_deg = {self.tilts_deg}, expected {expected}")

    @property
    def pairs(self) -> int:
        """Pairs of places, if every room has a full group."""
        return self.rooms * self.places * (self.places - 1)

    @property
    def steps(self) -> int:
        """How often `measure_planar_pose` calls `advance`, if every room has a full group."""
        return 2 * self.rooms * self.places


def measure_planar_pose(
    experiment: PlanarPoseExperiment, *, threads: int | None = None, advance: Callable[[], None] = lambda: None
) -> pl.DataFrame:
    """A long table, one row for each pair, lean and correction; angles in radians, `factor` the a of eq. 30.

    Errors are the angles between true and estimated directions. `threads` (None: one per core) share the rooms; the
    table does not depend on them. All images are in memory at once, 0.3 MB each at the default size.
    """
    stop, rooms, at_once = Event(), range(experiment.rooms), threads or os.cpu_count() or 1

    def listen() -> None:
        if stop.is_set():
            raise CancelledError

    with in_order(lambda number: _look_around(experiment, number, advance), rooms, at_once, stop) as seen:
        groups = list(seen)
    stop.clear()
    matcher = _Matcher(experiment)
    factors = [_trained_factor(groups, number) for number in rooms]

    def match(number: int) -> list[dict[str, object]]:
        return matcher.rows(groups[number], factors[number], listen, advance)

    with in_order(match, rooms, at_once, stop) as rows:
        parts = list(rows)
    return pl.DataFrame(list(itertools.chain(*parts)), schema=_SCHEMA)


@dataclass(frozen=True)
class _View:
    """What a robot sees at one place, and how it leans."""

    image: NDArray[np.uint8]
    alpha_rad: float
    beta_rad: float


@dataclass(frozen=True)
class _Group:
    """Near places of one room: poses (places, 3), views by place and lean in degrees, and l / alpha of eq. 31."""

    kind: str
    room_seed: int
    poses: NDArray[np.float64]
    views: list[dict[float, _View]]
    ratios: list[float]


def _look_around(experiment: PlanarPoseExperiment, number: int, advance: Callable[[], None]) -> _Group:
    """Builds a room, finds its group of places and renders every view."""
    rng = np.random.default_rng([experiment.seed, number])
    kind, room_seed = experiment.kinds[number % len(experiment.kinds)], int(rng.integers(2**32))
    room = Room(kind, room_seed, threads=1)
    poses = _near_places(room.free_poses(_CANDIDATES, room_seed), experiment.places, experiment.distances_m)
    poses[:, 2] = rng.uniform(-np.pi, np.pi, len(poses))
    estimator = TiltEstimator(experiment.camera, method=_PAPER, correction=None)
    views: list[dict[float, _View]] = []
    ratios = []
    for pose in poses:
        views.append({})
        for alpha_deg in dict.fromkeys((0.0, *experiment.tilts_deg)):
            alpha, beta = float(np.deg2rad(alpha_deg)), float(rng.uniform(-np.pi, np.pi))
            image = room.render(
                experiment.camera,
                pose=pose,
                alpha_rad=alpha,
                beta_rad=beta,
                noise_sigma=experiment.noise_sigma,
                samples=experiment.samples,
                seed=int(rng.integers(2**32)),
                threads=1,
            ).gray
            views[-1][alpha_deg] = _View(image, alpha, beta)
            if alpha_deg >= _TRAINING_TILT_MIN_DEG and (estimate := estimator(image)):
                ratios.append(float(estimate.shift_px or 0.0) / alpha)
        advance()
    return _Group(kind, room_seed, poses, views, ratios)


def _trained_factor(groups: Sequence[_Group], number: int) -> float:
    """a of eq. 31 for one room, in pixels per radian: the mean over the leaning views of all other rooms."""
    others = [ratio for place, group in enumerate(groups) if place != number for ratio in group.ratios]
    return float(np.mean(others))


@dataclass(frozen=True)
class _Look:
    """A view's panorama after each of `CORRECTIONS`, and what is left of its lean."""

    panoramas: tuple[NDArray[np.float32], ...]
    errors_rad: tuple[float, ...]


class _Matcher:
    """Corrects views and estimates poses: what the rooms of an experiment share."""

    def __init__(self, experiment: PlanarPoseExperiment) -> None:
        self._experiment = experiment
        grid = experiment.grid
        self._unwrapper = Unwrapper(
            experiment.camera, size=(grid.columns, grid.rows), elevation_max_rad=grid.elevation_max_rad
        )
        self._warping = MinWarping(experiment.grid)
        self._closed_form = TiltEstimator(experiment.camera, method=_PAPER, correction="closed-form")
        self._refined = TiltEstimator(experiment.camera, method="refined")

    def rows(
        self, group: _Group, factor: float, listen: Callable[[], None], advance: Callable[[], None]
    ) -> list[dict[str, object]]:
        """Those of the table that come from one room, with the factor that the others have trained.

        `listen` is called before each pair, which takes a fifth of a second, and raises to end the work.
        """
        trained = TiltEstimator(self._experiment.camera, method=_PAPER, correction=factor)
        estimators = (trained, self._closed_form, self._refined)
        looks = [{tilt: self._look(view, estimators) for tilt, view in views.items()} for views in group.views]
        rows: list[dict[str, object]] = []
        for second, views in enumerate(group.views):
            for first, tilt in itertools.product(range(len(group.poses)), self._experiment.tilts_deg):
                if first == second:
                    continue
                listen()
                known = {
                    "kind": group.kind,
                    "room_seed": group.room_seed,
                    "first": first,
                    "second": second,
                    "alpha_rad": views[tilt].alpha_rad,
                    "beta_rad": views[tilt].beta_rad,
                    "factor": factor,
                }
                errors = self._pair(group.poses[first], group.poses[second], looks[first][0.0], looks[second][tilt])
                rows += [known | row for row in errors]
            advance()
        return rows

    def _look(self, view: _View, estimators: Sequence[TiltEstimator]) -> _Look:
        true = normal_from_alpha_beta(view.alpha_rad, view.beta_rad)
        estimates = [estimator(view.image) for estimator in estimators]
        normals = [_UPRIGHT, *(estimate.normal if estimate else _UPRIGHT for estimate in estimates), true]
        panoramas = tuple(self._unwrapper(view.image, normal) for normal in normals)
        return _Look(panoramas, tuple(tilt_error_rad(normal, true) for normal in normals))

    def _pair(
        self, first: NDArray[np.float64], second: NDArray[np.float64], upright: _Look, leaning: _Look
    ) -> list[dict[str, object]]:
        bearing, orientation = bearing_and_orientation(first.tolist(), second.tolist())
        rows: list[dict[str, object]] = []
        for k, correction in enumerate(CORRECTIONS):
            pose = self._warping(upright.panoramas[k], leaning.panoramas[k])
            rows.append(
                {
                    "distance_m": float(np.hypot(*(second - first)[:2])),
                    "correction": correction,
                    "first_tilt_error_rad": upright.errors_rad[k],
                    "second_tilt_error_rad": leaning.errors_rad[k],
                    "bearing_true_rad": bearing,
                    "orientation_true_rad": orientation,
                    "bearing_rad": pose.bearing_rad,
                    "orientation_rad": pose.orientation_rad,
                    "bearing_error_rad": _angle(pose.bearing_rad - bearing),
                    "orientation_error_rad": _angle(pose.orientation_rad - orientation),
                }
            )
        return rows


def _near_places(poses: NDArray[np.float64], count: int, distances_m: Sequence[float]) -> NDArray[np.float64]:
    """The first group of `count` poses that are near each other, but not too near; the largest if none is full."""
    near, far = distances_m
    best: list[int] = []
    for start in range(len(poses)):
        group = [start]
        for candidate in range(len(poses)):
            distances = np.linalg.norm(poses[group, :2] - poses[candidate, :2], axis=1)
            if len(group) < count and near <= distances.min() and distances.max() <= far:
                group.append(candidate)
        if len(group) > len(best):
            best = group
        if len(best) == count:
            break
    return poses[best]


def _angle(difference_rad: float) -> float:
    """The angle in [0, pi] between directions that differ by so much."""
    return float(abs((difference_rad + np.pi) % (2.0 * np.pi) - np.pi))
