"""Min-warping as a consumer of the tilt: its laws on ideal panoramas, and the experiment in rendered rooms."""

from __future__ import annotations

import math
import subprocess
import sys
import threading
from itertools import pairwise
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from numpy.typing import NDArray

import tiltvp
from tiltvp._core import leaning_from_upright
from tiltvp.cli import main
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.new import in_order
from tiltvp.lab.evaluation.planar.panorama import PanoramaGrid
from tiltvp.lab.evaluation.planar.warping import MinWarping, bearing_and_orientation
from tiltvp.lab.evaluation.planar_pose import CORRECTIONS, PlanarPoseExperiment, measure_planar_pose
from tiltvp.lab.evaluation.planar_summary import crossings, summarise_planar_pose
from tiltvp.lab.plots.picture import figure_picture
from tiltvp.lab.plots.planar_pose import planar_pose
from tiltvp.synth import Room

GRID = PanoramaGrid()
WARPING = MinWarping(GRID)
UPRIGHT = (0.0, 0.0, 1.0)
POSES = [(1.2, 0.9, 0.3), (1.9, 1.1, -2.0), (2.4, 2.6, 1.1), (1.7, 2.2, 2.9), (3.6, 1.0, -0.7), (3.1, 1.8, 0.0)]
PAIRS = list(pairwise(POSES))

Pose = tuple[float, float, float]
Panorama = NDArray[np.float32]


def panorama(pose: Pose, normal: object = UPRIGHT) -> Panorama:
    """What a leaning robot sees in a room of 5 by 4 metres with walls of grey patches, without any camera between."""
    x, y, yaw = pose
    fine = 4
    azimuth = (np.arange(fine * GRID.columns) + 0.5 - 0.5 * fine) * GRID.step_rad / fine
    across, up = np.meshgrid(azimuth, GRID.elevations_rad)
    seen = np.stack([np.cos(up) * np.cos(across), np.cos(up) * np.sin(across), np.sin(up)], axis=-1)
    upright = seen @ leaning_from_upright(np.asarray(normal))
    direction = np.arctan2(upright[..., 1], upright[..., 0]) + yaw
    c, s = np.cos(direction), np.sin(direction)
    to_x, to_y = np.where(c > 0.0, 5.0 - x, -x) / c, np.where(s > 0.0, 4.0 - y, -y) / s
    distance = np.minimum(to_x, to_y)
    wall = np.where(to_x < to_y, np.where(c > 0.0, 0, 1), np.where(s > 0.0, 2, 3))
    along = np.where(wall < 2, (y + distance * s) / 4.0, (x + distance * c) / 5.0)
    height = distance * upright[..., 2] / np.hypot(upright[..., 0], upright[..., 1])
    patches = np.random.default_rng(0).uniform(0.0, 255.0, (4, 24, 20))
    place = np.clip((24.0 * along).astype(int), 0, 23), np.clip((height / 0.3 + 1.0).astype(int), 0, 19)
    grey = np.where(height < 2.6, patches[wall, place[0], place[1]], 120.0)
    return grey.reshape(GRID.rows, GRID.columns, fine).mean(axis=2).astype(np.float32)


def apart_deg(a: float, b: float) -> float:
    return math.degrees(abs(math.remainder(a - b, 2.0 * math.pi)))


def lean(alpha_deg: float, beta_deg: float = 40.0) -> NDArray[np.float64]:
    return tiltvp.normal_from_alpha_beta(math.radians(alpha_deg), math.radians(beta_deg))


def test_pose_is_recovered() -> None:
    for first, second in PAIRS:
        pose = WARPING(panorama(first), panorama(second))
        bearing, orientation = bearing_and_orientation(first, second)
        assert apart_deg(pose.bearing_rad, bearing) < 2.5
        assert apart_deg(pose.orientation_rad, orientation) < 1.5
        assert pose.scores.shape == (GRID.columns, GRID.columns)


def test_true_pose_of_two_poses() -> None:
    bearing, orientation = bearing_and_orientation((1.0, 1.0, math.pi / 2.0), (1.0, 3.0, -math.pi / 2.0))
    assert bearing == pytest.approx(0.0)
    assert abs(orientation) == pytest.approx(math.pi)


def test_turning_both_robots_turns_the_bearing() -> None:
    first, second = panorama(POSES[0]), panorama(POSES[1])
    here = WARPING(first, second)
    turned = WARPING(np.roll(first, 7, axis=1), np.roll(second, 7, axis=1))
    assert apart_deg(turned.bearing_rad, here.bearing_rad + 7 * GRID.step_rad) < 1e-3
    assert apart_deg(turned.orientation_rad, here.orientation_rad) < 1e-3


def test_turning_the_second_robot_turns_the_orientation() -> None:
    first, second = panorama(POSES[0]), panorama(POSES[1])
    here, turned = WARPING(first, second), WARPING(first, np.roll(second, 5, axis=1))
    assert apart_deg(turned.bearing_rad, here.bearing_rad) < 1e-3
    assert apart_deg(turned.orientation_rad, here.orientation_rad - 5 * GRID.step_rad) < 1e-3


def test_views_may_be_swapped() -> None:
    for first, second in PAIRS:
        there = WARPING(panorama(first), panorama(second))
        back = WARPING(panorama(second), panorama(first))
        assert apart_deg(back.orientation_rad, -there.orientation_rad) < 1e-2
        assert apart_deg(back.bearing_rad, there.bearing_rad + math.pi - there.orientation_rad) < 1e-2


def test_error_grows_with_tilt() -> None:
    means = []
    for alpha_deg in (0.0, 2.0, 6.0):
        errors = []
        for first, second in PAIRS:
            pose = WARPING(panorama(first), panorama(second, lean(alpha_deg)))
            errors.append(apart_deg(pose.bearing_rad, bearing_and_orientation(first, second)[0]))
        means.append(float(np.mean(errors)))
    assert means[0] < 1.0
    assert means[1] > 1.5 * means[0]
    assert means[2] > 1.5 * means[1]


def test_panorama_is_made_level_by_the_tilt() -> None:
    camera = tiltvp.Camera.equidistant(
        width=640, height=480, focal_px=139.7, cx=319.5, cy=239.5, max_theta_rad=math.radians(95.0)
    )
    unwrap = tiltvp.Unwrapper(camera)
    bearings = np.nan_to_num(camera.unproject(np.stack(np.meshgrid(np.arange(640), np.arange(480)), -1).reshape(-1, 2)))

    def image(normal: NDArray[np.float64]) -> NDArray[np.uint8]:
        """A smooth pattern fixed to the room."""
        x, y, z = (bearings @ leaning_from_upright(normal)).T
        return (128.0 + 40.0 * np.sin(9.0 * x + 4.0) + 40.0 * np.cos(7.0 * y + z)).reshape(480, 640).astype(np.uint8)

    upright, leaning = unwrap(image(lean(0.0))), image(lean(3.0))
    assert upright.shape == (GRID.rows, GRID.columns)
    # The lowest rows are below the leaning lens' reach.
    assert np.abs(unwrap(leaning, lean(3.0)) - upright)[:-2].max() < 3.0
    assert np.abs(unwrap(leaning) - upright)[:-2].max() > 15.0
    forward = np.argmax(unwrap(spot(camera, (1.0, 0.0, 0.4))).max(axis=0))
    left = np.argmax(unwrap(spot(camera, (0.0, 1.0, 0.4))).max(axis=0))
    assert (forward, left) == (0, GRID.columns // 4)


def spot(camera: tiltvp.Camera, bearing: tuple[float, float, float]) -> NDArray[np.uint8]:
    image = np.zeros((camera.height, camera.width), dtype=np.uint8)
    u, v = np.round(camera.project(bearing)).astype(int)
    image[v - 2 : v + 3, u - 2 : u + 3] = 255
    return image


def test_wrong_input_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="columns"):
        PanoramaGrid(columns=71)
    with pytest.raises(InvalidInputError, match="elevation_max_rad"):
        PanoramaGrid(elevation_max_rad=2.0)
    with pytest.raises(InvalidInputError, match="scale_max"):
        MinWarping(GRID, scale_max=1.0)
    with pytest.raises(InvalidInputError, match="second: shape"):
        WARPING(panorama(POSES[0]), np.zeros((3, 4), dtype=np.float32))
    with pytest.raises(InvalidInputError, match="rooms = 1"):
        PlanarPoseExperiment(rooms=1)
    with pytest.raises(InvalidInputError, match="tilts_deg"):
        PlanarPoseExperiment(tilts_deg=(0.0, 1.0))


@pytest.fixture(scope="module")
def small() -> PlanarPoseExperiment:
    camera = tiltvp.Camera.equidistant(
        width=240, height=180, focal_px=52.4, cx=119.5, cy=89.5, max_theta_rad=math.radians(92.5)
    )
    kinds = ("living-room", "corridor")
    return PlanarPoseExperiment(rooms=2, kinds=kinds, places=2, tilts_deg=(0.0, 5.0), camera=camera)


def test_what_is_interrupted_begins_nothing_more(small: PlanarPoseExperiment) -> None:
    """Rooms that others work on went on to their end, for minutes."""
    steps = iter(range(100))

    def advance() -> None:
        if next(steps) == 0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        measure_planar_pose(small, threads=2, advance=advance)
    assert next(steps) <= 2


def test_ctrl_c_is_heard_while_others_work() -> None:
    """Polars has a wait for another thread go on after an interrupt."""
    script = (
        "import os, signal, sys, threading, time\nimport polars\nfrom tiltvp.lab.datasets.new import in_order\n"
        "stop = threading.Event()\n"
        "threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()\nbegun = time.monotonic()\n"
        "try:\n    with in_order(lambda job: stop.wait(20.0), [0], 1, stop) as done:\n        list(done)\n"
        "except KeyboardInterrupt:\n    sys.exit(time.monotonic() - begun > 10.0)\n"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0


def test_long_calls_of_others_are_ended_by_who_leaves() -> None:
    """Signals are heard on the main thread alone: a room went on being built, for seconds."""
    building, ended = threading.Event(), []

    def work(job: int) -> None:
        if job == 0:
            building.wait(10.0)
            return
        building.set()
        try:
            Room("l-shaped", job, threads=1)
        except InvalidInputError:
            ended.append(job)
            raise

    with in_order(work, (0, 1), 2, threading.Event()) as done:
        next(done)
    assert ended == [1]


@pytest.fixture(scope="module")
def table(small: PlanarPoseExperiment) -> pl.DataFrame:
    return measure_planar_pose(small, threads=1)


@pytest.mark.slow
def test_experiment_is_the_same_for_any_threads(small: PlanarPoseExperiment, table: pl.DataFrame) -> None:
    steps = []
    again = measure_planar_pose(small, threads=2, advance=lambda: steps.append(1))
    assert again.equals(table)
    assert len(steps) == small.steps
    assert len(table) == small.pairs * len(small.tilts_deg) * len(CORRECTIONS)


@pytest.mark.slow
def test_table_holds_together(small: PlanarPoseExperiment, table: pl.DataFrame) -> None:
    assert table.null_count().sum_horizontal().item() == 0
    near, far = small.distances_m
    assert table["distance_m"].is_between(near, far).all()
    assert (table["bearing_error_rad"] >= 0.0).all()
    assert (table.filter(pl.col("correction") == "true tilt")["second_tilt_error_rad"] < 1e-9).all()
    none = table.filter(pl.col("correction") == "none")
    assert np.allclose(none["second_tilt_error_rad"], none["alpha_rad"])
    refined = table.filter((pl.col("correction") == "refined") & (pl.col("alpha_rad") > 0.0))
    assert np.rad2deg(refined["second_tilt_error_rad"].mean()) < 2.0
    upright = table.filter((pl.col("alpha_rad") == 0.0) & pl.col("correction").is_in(["none", "true tilt"]))
    assert upright.n_unique(["kind", "first", "second", "bearing_rad"]) == small.pairs


@pytest.mark.slow
def test_summary_and_figure(table: pl.DataFrame) -> None:
    summary = summarise_planar_pose(table)
    assert len(summary) == 2 * len(CORRECTIONS) * 2
    assert (summary["low_deg"] <= summary["mean_deg"]).all()
    assert (summary["mean_deg"] <= summary["high_deg"]).all()
    picture = figure_picture(planar_pose(summary, crossings(summary)), dpi=40.0)
    assert picture.std() > 5.0


def test_crossing_is_where_the_gain_stays() -> None:
    tilts = [0.0, 1.0, 2.0, 3.0]
    means = {"none": [1.0, 3.0, 5.0, 7.0], "early": [2.0] * 4, "never": [9.0] * 4, "always": [0.0] * 4}
    rows = [
        {"error": "bearing", "correction": correction, "alpha_deg": tilt, "mean_deg": mean}
        for correction, line in means.items()
        for tilt, mean in zip(tilts, line, strict=True)
    ]
    found = crossings(pl.DataFrame(rows))
    assert dict(zip(found["correction"], found["crossing_deg"], strict=True)) == {
        "early": 0.5, "never": None, "always": 0.0
    }  # fmt: skip


def test_command_refuses_before_it_works(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["measure", "planar-pose", "--out", str(tmp_path / "a.txt")]) == 2
    assert main(["measure", "planar-pose", "--plot", str(tmp_path / "a.txt")]) == 2
    assert main(["measure", "planar-pose", "--pairs", "0"]) == 2
    said = capsys.readouterr().err
    assert "--out" in said
    assert "--plot" in said
    assert not list(tmp_path.iterdir())
    (tmp_path / "kept.png").touch()
    monkeypatch.setattr("tiltvp.lab.evaluation.planar_pose.measure_planar_pose", None)
    assert main(["measure", "planar-pose", "--plot", str(tmp_path / "kept.png")]) == 2


@pytest.mark.slow
def test_command_prints_writes_and_draws(
    small: PlanarPoseExperiment,
    table: pl.DataFrame,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    from tiltvp.lab.evaluation import planar_pose as module

    asked = []

    def measured(experiment: PlanarPoseExperiment, **_: object) -> pl.DataFrame:
        asked.append(experiment)
        return table

    monkeypatch.setattr(module, "measure_planar_pose", measured)
    out, plot = tmp_path / "poses.parquet", tmp_path / "poses.png"
    words = ["measure", "planar-pose", "--pairs", "25", "--seed", "3", "--out", str(out), "--plot", str(plot)]
    assert main(words) == 0
    assert (asked[0].rooms, asked[0].seed) == (3, 3)
    said = capsys.readouterr().out
    assert f"{small.pairs} pairs" in said
    for correction in CORRECTIONS:
        assert said.count(correction) == 2
    assert pl.read_parquet(out).equals(table)
    assert tiltvp.read_image(plot).std() > 5.0
