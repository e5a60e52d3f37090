"""What tables of `tiltvp measure` count, and what its verbs refuse."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import polars as pl
import pytest

from commands import Run
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.ahead import AheadView
from tiltvp.lab.datasets.panoramas import Panorama, read_panorama_index
from tiltvp.lab.evaluation import ahead
from tiltvp.lab.evaluation.calibration import simulated_drives, summarise_drives
from tiltvp.lab.evaluation.corners import summarise_corners


def test_diverged_runs_without_an_alarm_are_silent() -> None:
    # Those of the paper's filter that diverge have one.
    table = simulated_drives("alternating", "paper", 40).with_columns(alarm=pl.lit(value=False))
    counted = summarise_drives(table)
    beyond = table.filter((pl.col("nees") > 16.27) & ~pl.col("alarm"))
    assert beyond.filter("diverged").height > 0
    assert counted["beyond 99.9 % unalarmed"] == beyond.height


def test_places_of_corners_are_those_with_a_truth_and_flips_count() -> None:
    told = {"scene": "office", "method": "general", "found": True, "distance_m": 2.0, "surface": 0.0, "ms": 1.0}
    listed = told | {"corner": 3, "attitude_deg": 0.1, "position_m": 0.02, "nees": 4.0}
    flipped = told | {"corner": 3, "attitude_deg": 90.0, "position_m": 0.02, "nees": 100.0}
    # What the list lacks is beside its own median.
    other = told | {"corner": -1, "attitude_deg": 0.1, "position_m": 0.0001, "nees": None}
    row = summarise_corners(pl.DataFrame([listed, flipped, other, other])).row(0, named=True)
    assert row["listed corner"] == 0.5
    assert row["position rms mm"] == pytest.approx(20.0)
    assert row["% of distance"] == pytest.approx(1.0)
    assert (row["flips"], row["NEES of 6"]) == (1, 52.0)


def test_the_softwares_network_is_not_judged_by_views_that_trained_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seeds: list[int] = []

    def views(_: Panorama, number: int, **__: object) -> Iterator[AheadView]:
        seeds.append(number)
        yield AheadView("pinhole 80", np.full((480, 640), 90, np.uint8), np.array([0.0, -1.0, 0.0]))

    monkeypatch.setattr(ahead, "ahead_views", views)
    rooms = [Panorama(f"room {k}", Path("nowhere.jpg"), f"house {k}", None) for k in range(3)]
    ahead.look_ahead(rooms)
    trained = set(seeds)
    seeds.clear()
    assert ahead.prior_table(rooms, 15.0)["views"].to_list() == [3]
    assert ahead.any_lean_table(rooms)["views"].to_list() == [3, 3]
    assert len(seeds) == 6
    assert trained.isdisjoint(seeds)


def test_a_view_without_a_hypothesis_is_not_taken_for_level() -> None:
    level, rolled = np.array([0.0, -1.0, 0.0]), np.array([-1.0, 0.0, 0.0])
    features = np.array([[1.0, 0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0, 0.0]])

    def view(number: int, ups: np.ndarray) -> ahead.LearnedView:
        return ahead.LearnedView(
            ("pinhole 80", "fisheye 120")[number % 2], f"house {number}", level, ups, features, None, 0.0
        )

    views = [view(number, np.array([level, rolled])) for number in range(12)]
    views += [view(number, np.zeros((0, 3))) for number in (12, 13)]
    for row in ahead.ahead_table(views).iter_rows(named=True):
        assert row["roll 10"] == row["pitch 10"] == pytest.approx(100.0 * 6 / 7)
        assert row["above 5 deg"] == pytest.approx(100.0 / 7)


@pytest.fixture
def panoramas(tmp_path: Path) -> Path:
    """Two panoramas of one building."""
    rows = ["name,environment,tilt_x_deg,tilt_z_deg"]
    for name in ("first", "second"):
        cv2.imwrite(str(tmp_path / f"{name}.jpg"), np.full((64, 128), 90, np.uint8))
        rows.append(f"{name},house,0,0")
    (tmp_path / "INDEX.csv").write_text("\n".join(rows), encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["calibration", "--runs", "0"], "--runs"),
        (["calibration", "--only", "lines", "--runs", "1", "--out", "x.csv"], "leaves out the simulated drives"),
        (["calibration", "--only", "simulated", "--out", "x.txt"], "ends in '.txt'"),
        (["body", "--rooms", "0"], "--rooms 0 and no folder, expected rooms"),
        (["body", "PANORAMAS", "--rooms", "0"], "--rooms 0 and 1 building in"),
        (["calibration", "nowhere", "--runs", "1"], "truth.json: cannot be read"),
        (["calibration-images", "--trajectory", "arcs"], "--trajectory 'arcs'"),
        (["corners", "--poses", "0", "--noisy-poses", "0", "--frames", "0"], "expected some of them"),
        (["scaling", "--images", "0"], "Must be >= 1"),
        (["scaling", "--scales", "-1"], "Must be >= 0.01"),
        (["calibration", "nowhere", "--only", "lmov"], "lmov_results.json: cannot be read"),
        (["corners", "--poses", "0", "--noisy-poses", "0", "--frames", "0", "--out", "x"], "with --frames 0"),
        (["corners", "--frames", "0", "--scenes", "nosuch"], "--scenes 'nosuch'"),
        (["corners", "--frames", "5"], "frames = 5, expected 10 or more"),
        (["corners-real", "nowhere"], "truth_cam_poses.txt: no such file"),
        (["level", "--out", "x.csv"], "expected a folder of panoramas"),
        (["level", "nowhere"], "nowhere/INDEX.csv: cannot be read"),
        (["level", "--every", "2"], "expected a folder of panoramas or --inertial"),
        (["sampling", "--seeds", "0"], "--seeds"),
        (["views", "PANORAMAS"], "panoramas of one building"),
        (["trust", "PANORAMAS", "--unseen", "--weights"], "expected one of them"),
        (["trust", "PANORAMAS", "--weights"], "no building of the half"),
        (["panoramas", "PANORAMAS", "--noise-sigma", "-1"], "--noise-sigma = -1"),
        (["panoramas", "PANORAMAS", "--noise-sigma", "nan"], "--noise-sigma = nan"),
    ],
    ids=lambda value: " ".join(value)[:40] if isinstance(value, list) else None,
)  # fmt: skip
def test_what_cannot_be_measured_is_refused_at_once(run: Run, panoramas: Path, words: list[str], problem: str) -> None:
    said = run("measure", *(panoramas if word == "PANORAMAS" else word for word in words))
    assert said.code == 2
    assert problem in said.err.replace("\n", " ")
    assert not said.out


def test_numbers_that_are_not_nothing_are_not_shown_as_0(run: Run) -> None:
    said = run("measure", "corners", "--poses", "1000", "--noisy-poses", "0", "--frames", "0")
    heading, _, row = said.out.splitlines()[1:4]
    assert "above 1e-9 " in heading
    assert re.search(r"\d\.\de-1\d +\d\.\de-1\d +\d\.\de-\d\d +\d+ ", row), row


@pytest.mark.parametrize(
    ("row", "problem"),
    [("third,a,nan,0", "a finite number"), ("third,a,0,inf", "a finite number"), ("first,b,0,0", "'first' again")],
)
def test_rows_of_an_index_that_tell_no_panorama_are_named(panoramas: Path, row: str, problem: str) -> None:
    index = panoramas / "INDEX.csv"
    index.write_text(f"{index.read_text(encoding='utf-8')}\n{row}", encoding="utf-8")
    with pytest.raises(InvalidInputError, match=rf"INDEX.csv, line 4: .*{problem}"):
        read_panorama_index(panoramas)
