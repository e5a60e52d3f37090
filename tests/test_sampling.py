"""The options of the sampling loop from Python, and the table that tells what they are worth."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import tiltvp
from tiltvp.errors import InvalidInputError
from tiltvp.lab.evaluation.sampling import SAMPLERS, WAYS, sample_views, summarise_sampling
from tiltvp.lab.evaluation.views import room_views
from tiltvp.synth import render_room

pytestmark = pytest.mark.slow

CAMERA = tiltvp.Camera.equidistant(width=320, height=240, focal_px=69.8, cx=159.5, cy=119.5, max_theta_rad=1.61)
METHODS = ("image-space-ransac", "vector-consensus")


@pytest.mark.parametrize("method", METHODS)
def test_every_way_is_an_option_that_can_be_read_back(method: str) -> None:
    room = render_room(CAMERA, seed=3, alpha_rad=0.05, samples=2)
    plain = tiltvp.TiltEstimator(CAMERA, method=method)
    names = ("sampling", "local_optimization", "score")
    assert [plain.options[name] for name in names] == ["uniform", False, "count"]
    edges = plain.detect(room.gray)
    answers = set()
    for way in WAYS.values():
        estimator = tiltvp.TiltEstimator(CAMERA, method=method, **way)
        assert way.items() <= estimator.options.items()
        assert tiltvp.TiltEstimator(CAMERA, method=method, **estimator.options) == estimator
        estimate = estimator(room.gray)
        assert estimate
        assert estimate == estimator(room.gray) == plain.with_options(**way).estimate_edges(edges)
        answers.add((estimate.alpha_rad, estimate.report.iterations))
    assert len(answers) >= 4


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ({"sampling": "best"}, 'sampling = \'best\', expected "uniform" or "progressive"'),
        ({"score": 3}, 'score = 3, expected "count" or "msac"'),
        ({"local_optimization": "yes"}, "local_optimization = 'yes', expected True or False"),
    ],
)
def test_wrong_words_are_refused_by_name(option: dict[str, object], words: str) -> None:
    for method in METHODS:
        with pytest.raises(InvalidInputError) as caught:
            tiltvp.TiltEstimator(CAMERA, method=method, **option)
        assert words in str(caught.value)
    with pytest.raises(InvalidInputError, match="unknown to method"):
        tiltvp.TiltEstimator(CAMERA, method="refined", **option)


def test_the_table_has_a_row_for_each_way_and_says_what_pays() -> None:
    table = sample_views(room_views(1, CAMERA, samples=1, kinds=("corridor",)), CAMERA, seeds=1)
    assert len(table) == 7 * len(SAMPLERS) * len(WAYS)
    summary = summarise_sampling(table)
    assert summary["way"].to_list() == list(WAYS) * len(SAMPLERS)
    plain = summary.filter(pl.col("way") == "plain")
    assert plain["pays"].to_list() == [""] * len(SAMPLERS)
    assert plain["fit"].to_list() == [1.0] * len(SAMPLERS)
    assert (summary["trials"] >= 1).all()
    own = table.filter((pl.col("way") == "plain") & (pl.col("method") == SAMPLERS[0].label))
    assert plain["mean"][0] == pytest.approx(np.rad2deg(own["error_rad"].mean()))


def test_views_of_a_room_have_noise_of_their_own() -> None:
    plain, noisy = (
        [view.image.astype(float) for view in room_views(1, CAMERA, samples=1, kinds=("corridor",), noise_sigma=sigma)]
        for sigma in (0.0, 6.0)
    )
    first, second = (noisy[k] - plain[k] for k in (0, 1))
    assert first.std() > 2.0
    assert abs(np.corrcoef(first.ravel(), second.ravel())[0, 1]) < 0.1


def test_what_pays_is_judged_by_standard_errors_and_times() -> None:
    rng = np.random.default_rng(1)
    rows = []
    for way, error, time in [("plain", 1.0, 1.0), ("LO", 0.8, 1.05), ("progressive", 1.0, 0.5), ("MSAC", 1.2, 0.5)]:
        for view in range(40):
            value = np.deg2rad(error + rng.normal(0.0, 0.01))
            rows.append(
                {
                    "view": view, "location": str(view // 4), "method": "m", "way": way, "seed": 0,
                    "error_x_rad": value, "error_y_rad": 0.0, "error_rad": value, "trials": 9,
                    "time_edges_s": 1.0, "time_fit_s": time,
                }
            )  # fmt: skip
    summary = summarise_sampling(pl.DataFrame(rows))
    assert dict(zip(summary["way"], summary["pays"], strict=True)) == {
        "plain": "", "LO": "error", "progressive": "time", "MSAC": "no",
    }  # fmt: skip


def test_the_command_prints_tables_and_writes_parquet(tmp_path: Path) -> None:
    out = tmp_path / "sampling.parquet"
    words = [
        "measure",
        "sampling",
        "--rooms",
        "1",
        "--kind",
        "narrow",
        "--seeds",
        "1",
        "--samples",
        "1",
        "--out",
        str(out),
    ]
    run = subprocess.run(
        [sys.executable, "-c", "from tiltvp.cli import main; raise SystemExit(main())", *words],
        capture_output=True, text=True, timeout=200, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert run.stdout.count("Pays: ") == len(SAMPLERS)
    assert set(pl.read_parquet(out)["way"]) == set(WAYS)
