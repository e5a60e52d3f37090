"""What misleads tilt estimates: the images, their truths, and the table of who was wrong and sure."""

from __future__ import annotations

import math
import pickle
import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import tiltvp
from tiltvp import METHODS, TiltEstimator
from tiltvp.cli import main
from tiltvp.lab.datasets.ahead import AHEAD_CAMERAS
from tiltvp.lab.datasets.degrading import beneath, turned, unfocused
from tiltvp.lab.datasets.hostile import AHEAD, CASES, FORWARD, UNHARMED, UPWARD, hostile_images
from tiltvp.lab.datasets.panoramas import Panorama, read_panorama_index
from tiltvp.lab.evaluation.hostile import SURE, judge_images, summarise_cases
from tiltvp.rotations import read_rotation
from tiltvp.synth import render_room
from tiltvp.tilt import normal_from_alpha_beta


@pytest.fixture(scope="module")
def stripes(tmp_path_factory: pytest.TempPathFactory) -> Panorama:
    """A panorama of upright stripes of drawn widths and levels, light above."""
    folder = tmp_path_factory.mktemp("stripes")
    rng = np.random.default_rng(3)
    columns = np.repeat(rng.uniform(40.0, 200.0, 64), 16)[None, :]
    rows = np.linspace(1.0, 0.4, 512)[:, None]
    tiltvp.write_image(folder / "stripes.jpg", np.asarray(columns * rows, dtype=np.uint8))
    (folder / "INDEX.csv").write_text("name,environment,tilt_x_deg,tilt_z_deg\nstripes,hall,0,0\n")
    return read_panorama_index(folder)[0]


def test_truths_are_those_of_the_mounting_as_told(stripes: Panorama) -> None:
    images = {item.case: item for item in hostile_images([stripes], count=1)}
    assert list(images) == list(CASES)
    lean = images["upward"].normal
    assert lean is not None
    assert math.degrees(math.acos(lean[2])) <= 8.0
    for case, item in images.items():
        assert item.image.shape == (item.camera.height, item.camera.width)
        if item.normal is None:
            continue
        off = math.degrees(math.acos(np.clip(item.normal[2], -1.0, 1.0)))
        if case in ("downward read as upward", "upward read as downward", "fisheye upside down read as upright"):
            assert off > 170.0
        elif "read as" in case:
            assert 80.0 < off < 100.0
        elif "lean" in case:
            assert 20.0 <= off <= 40.0
        else:
            assert np.allclose(item.normal, lean)
    assert images["12 bits in 16"].image.max() > 255
    # What is told differs from what the image was made with, or the image itself does.
    upward = images["upward"]
    for case in ("focal length off by 10 %", "centre off by 10 px"):
        assert images[case].camera != upward.camera
        assert np.array_equal(images[case].image, upward.image)


@pytest.mark.slow
def test_unharmed_views_are_answered_rightly_and_a_wrong_camera_is_counted(stripes: Panorama) -> None:
    cases = ("upward", "panorama", "centre off by 10 px")
    table = judge_images(hostile_images([stripes], count=2, cases=cases))
    assert len(table) == 2 * 3 * len(METHODS)
    table = table.filter(pl.col("method").is_in(["refined", "segments"]))
    unharmed = table.filter(pl.col("case").is_in(UNHARMED))
    assert unharmed["error_deg"].max() < 1.0
    # The dark rim of the image circle is not where the calibration says.
    off = table.filter(case="centre off by 10 px")
    assert off["error_deg"].min() > 2.0
    assert off["confidence"].max() < 0.6
    assert all("the image circle is beside the calibration's" in reason for reason in off["reason"])


@pytest.mark.slow
def test_no_method_is_sure_of_noise(stripes: Panorama) -> None:
    table = judge_images(hostile_images([stripes], count=18, cases=("texture", "noise alone")))
    assert set(table["method"]) == set(METHODS)
    assert table["confidence"].max() < SURE
    reasons = table.filter(method="refined")["reason"]
    assert reasons.str.contains("% of the pixels are edges, by noise or texture").mean() > 0.8


@pytest.mark.slow
def test_edges_of_the_pixel_grid_are_no_verticals(stripes: Panorama) -> None:
    cases = ("ahead", "ahead, boxes drawn", "ahead, last row repeated")
    table = judge_images(hostile_images([stripes], count=12, cases=cases))
    counts = summarise_cases(table).filter(
        pl.col("case").is_in(cases) & pl.col("method").is_in(["refined", "segments"])
    )
    assert counts["wrong_and_sure"].max() == 0.0
    right = counts.filter(method="segments")["right"].to_list()
    assert right == pytest.approx([100.0, 100.0, 100.0], abs=20.0)


@pytest.mark.parametrize("method", ["refined", "segments"])
def test_what_is_drawn_of_whole_pixels_alone_is_not_believed(method: str) -> None:
    columns = np.array([235, 210, 170, 145, 106, 81, 41, 16], dtype=np.uint8)[np.arange(640) // 80]
    estimator = TiltEstimator(AHEAD_CAMERAS["pinhole 80"], method=method, robot_from_camera=read_rotation("forward"))
    estimate = estimator(np.repeat(columns[None], 480, axis=0))
    assert estimate
    assert estimate.confidence <= 0.5
    assert re.search("(99|100) % of the edge pixels that agree are steps of the pixel grid", estimate.reason)


def test_a_room_drawn_without_noise_keeps_its_answer() -> None:
    """All its verticals are steps of the pixel grid, and what is left tells another vertical, and is not sure."""
    image = render_room(AHEAD, kind="office", seed=1, robot_from_camera=FORWARD, samples=3, noise_sigma=0.0).gray
    estimate = TiltEstimator(AHEAD, method="segments", robot_from_camera=FORWARD)(image)
    assert estimate.alpha_rad < np.radians(0.1)
    assert estimate.confidence <= 0.5
    assert "steps of the pixel grid" in estimate.reason


def test_a_room_out_of_focus_or_turned_while_exposed_is_not_believed() -> None:
    """Nor by its edge pixels, which are told of it."""
    rng, estimator = np.random.default_rng(1), TiltEstimator(UPWARD, method="refined")
    image = render_room(UPWARD, kind="office", seed=1, alpha_rad=0.05, samples=2).gray
    assert estimator(image).confidence > 0.9
    harmed = [unfocused(image, rng), turned(image, rng)]
    estimates = [estimator(image) for image in harmed]
    assert all(estimate.confidence < 0.5 for estimate in estimates)
    assert "the image is blurred" in estimates[0].reason
    kept = [pickle.loads(pickle.dumps(estimator.detect(image))) for image in harmed]
    assert [estimator.estimate_edges(edges) for edges in kept] == estimates


@pytest.mark.parametrize("widest_deg", [None, 12.0])
def test_the_edge_of_a_table_or_beam_overhead_draws_no_tilt_aside(widest_deg: float | None) -> None:
    estimator = TiltEstimator(UPWARD, method="refined")
    image = render_room(UPWARD, kind="office", seed=1, alpha_rad=0.05, samples=2).gray
    normal = normal_from_alpha_beta(0.05, 0.0)
    images = [beneath(image, UPWARD, normal, np.random.default_rng(seed), widest_deg) for seed in range(8)]
    estimates = [estimator(image) for image in images]
    errors = [math.degrees(math.acos(min(1.0, float(own.normal @ normal)))) for own in estimates]
    assert max(errors) < 1.3
    kept = [pickle.loads(pickle.dumps(estimator.detect(image))) for image in images]
    assert [estimator.estimate_edges(edges) for edges in kept] == estimates


def test_the_table_counts_who_was_wrong_and_sure() -> None:
    rows = [
        ("sky", "refined", math.nan, 0.95, "converged"),
        ("sky", "refined", None, 0.0, "too few observations"),
        ("sky", "refined", math.nan, 0.2, "converged"),
        ("dark", "refined", 1.0, 0.95, "converged"),
        ("dark", "refined", 3.0, 0.91, "converged"),
        ("dark", "refined", 1.5, 0.5, "converged; 3 edge pixels are few: little contrast, dark"),
        ("upward", "refined", 5.0, 0.99, "converged"),
        ("lean of 20 to 40 degrees", "refined", None, 0.0, "nothing within tilt_max_rad"),
    ]
    table = pl.DataFrame(rows, schema=["case", "method", "error_deg", "confidence", "reason"], orient="row")
    table = summarise_cases(table.with_columns(pl.col("error_deg").cast(pl.Float64)))
    sky, dark = (table.filter(case=case).row(0, named=True) for case in ("sky", "dark"))
    assert (sky["images"], sky["answers"], sky["abstained"]) == pytest.approx((3, 200 / 3, 100 / 3))
    assert sky["wrong_and_sure"] == pytest.approx(100 / 3)
    assert sky["sure_of_right"] is None
    assert dark["wrong_and_sure"] == pytest.approx(100 / 3)
    assert dark["sure_of_right"] == pytest.approx(50.0)
    assert dark["cause_named"] == pytest.approx(100.0)
    assert table.filter(case="lean of 20 to 40 degrees")["cause_named"].item() == pytest.approx(100.0)
    # A sky has no cause that could be named, and does not count among those that are.
    assert sky["cause_named"] is None
    # Unharmed views do not count as misleading.
    assert table.filter(case="all that mislead")["wrong_and_sure"].item() == pytest.approx(100 * 2 / 7)


@pytest.mark.slow
def test_the_command(stripes: Panorama, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "trust.csv"
    assert main(["measure", "trust", str(stripes.path.parent), "--count", "1", "--out", str(out)]) == 0
    assert "upward read as ahead" in capsys.readouterr().out
    assert len(pl.read_csv(out)) == len(METHODS) * len(CASES)
