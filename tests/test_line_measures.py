"""Verdicts on tracks: which edge a line is, what a right and a wrong answer are, and one small experiment."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import polars as pl
import pytest

from tiltvp.cli import main
from tiltvp.lab.evaluation.line_truth import Identities, Judge, Verdicts, edge_bearings, identities
from tiltvp.lab.evaluation.lines import LINE_VARIANTS, LineExperiment, line_intervals, measure_lines, summarise_lines
from tiltvp.synth import Drive, DriveTruth, Room, mirror_camera

WORLD_RAD = np.radians([0.0, 10.0, 20.0, 20.2])
"""Bearings of edges 0 to 3, the same in all frames."""


class Found(SimpleNamespace):
    def __len__(self) -> int:
        return len(self.bearing_rad)


def frame(
    judge: Judge, bearings_deg: list[float], edges: list[set[int]], tracks: list[int], back: list[int]
) -> Verdicts:
    known = Identities(tuple(map(frozenset, edges)), np.zeros(len(edges)), 0, 0)
    tracked: Any = SimpleNamespace(
        track=np.array(tracks), frames_back=np.array(back), lines=Found(bearing_rad=np.radians(bearings_deg))
    )
    return judge(tracked, known, WORLD_RAD)


def test_verdicts() -> None:
    judge = Judge(2)
    assert frame(judge, [0.0, 10.0, 20.0], [{0}, {1}, {2}], [0, 1, 2], [0, 0, 0]) == Verdicts()
    # One goes on, one is taken for another, one begins again although its track has ended with nobody.
    assert frame(judge, [0.0, 20.0, 10.0], [{0}, {2}, {1}], [0, 1, 3], [1, 1, 0]) == Verdicts(
        correct=1, false_matches=1
    )
    # The track of edge 2, last seen two frames ago, goes on; that of edge 0 does not.
    assert frame(judge, [0.0, 20.0], [{0}, {2}], [4, 2], [0, 2]) == Verdicts(correct=1, false_new=1)
    # Edges a pixel apart, and lines on no edge.
    assert frame(judge, [20.2, 0.5], [{3}, set()], [2, 4], [1, 1]) == Verdicts(unknown=2)
    # What stands far from the edge cannot be it.
    assert frame(judge, [5.0], [set()], [2], [1]) == Verdicts(false_matches=1)


def test_edges_are_forgotten_with_the_tracker() -> None:
    judge = Judge(2)
    frame(judge, [0.0], [{0}], [0], [0])
    frame(judge, [], [], [], [])
    frame(judge, [], [], [], [])
    assert frame(judge, [0.0], [{0}], [1], [0]) == Verdicts()


def test_identities() -> None:
    truth = DriveTruth(
        edges=np.array([5, 6, 7, 8]),
        bearings_rad=np.radians([0.0, 0.05, 179.9, 90.0]),
        elevations_rad=np.array([[-0.1, 0.3], [-0.1, 0.2], [-0.1, 0.3], [-0.9, -0.5]]),
        visible_share=np.ones(4),
        contrast=np.array([0.5, 0.5, 0.5, 0.5]),
    )
    lines: Any = Found(
        bearing_rad=np.radians([0.01, -179.9, 90.0, 45.0]),
        elevation_min_rad=np.full(4, -0.2),
        elevation_max_rad=np.full(4, 0.3),
    )
    known = identities(lines, truth, length_min_rad=0.35)
    assert known.edges == (frozenset({5, 6}), frozenset({7}), frozenset(), frozenset())
    assert np.allclose(np.degrees(known.error_rad[:2]), [0.01, 0.2])
    assert np.isnan(known.error_rad[2:]).all()
    assert (known.due, known.found) == (3, 2)


@pytest.fixture(scope="module")
def room() -> Room:
    return Room("corridor", 11, light_spacing_m=0.6)


def test_edge_bearings_are_those_of_the_truth(room: Room) -> None:
    drive = Drive(room, camera=mirror_camera().scaled(0.3), mount=(0.2, -0.1, 0.3, 0.5), frames=3, seed=1)
    truth = drive.truth(2)
    assert np.allclose(edge_bearings(drive, 2)[truth.edges], truth.bearings_rad, atol=1e-9)


@pytest.mark.slow
def test_a_small_experiment(room: Room, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tiltvp.lab.evaluation.lines.drive_room", lambda *_, **__: room)
    experiment = LineExperiment(frames=4, kinds=("corridor",), seed=11, samples=1, resolution_scale=0.6)
    done: list[None] = []
    table = measure_lines(experiment, threads=2, advance=lambda: done.append(None))
    assert len(done) == experiment.steps == 8
    assert table.height == 8 * len(LINE_VARIANTS)
    assert (table["on_edges"] <= table["lines"]).all()
    assert (table["found"] <= table["due"]).all()
    first = table.filter(pl.col("frame") == 0)
    assert first.select(pl.sum_horizontal("correct", "false_matches", "false_new", "unknown")).sum().item() == 0
    summary = summarise_lines(table)
    assert summary["variant"].to_list() == [variant.name for variant in LINE_VARIANTS] * 2
    total = summary.select(pl.sum_horizontal("correct_%", "false_matches_%", "false_new_%")).to_series()
    assert all(math.isnan(value) or value == pytest.approx(100.0) for value in total)
    assert summary.filter(pl.col("variant") == "great-circle")["correct_%"].min() > 50.0
    assert line_intervals(table)["interval"].to_list() == ["0-200"] * 2
    assert main(["measure", "lines", "--frames", "1"]) == 2
    assert "frames" in capsys.readouterr().err
