"""Drives read from their folders, pairs of frames judged by the truth, and the tables and figures of descriptors."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import polars as pl
import pytest

from tiltvp.cli import main
from tiltvp.errors import InvalidInputError
from tiltvp.images import read_image
from tiltvp.lab.datasets.driven import DrivenFrames, read_drive
from tiltvp.lab.datasets.driving import write_drive
from tiltvp.lab.evaluation.descriptor_summary import RULES, alike, rules
from tiltvp.lab.evaluation.descriptors import DescriptorExperiment, follow, measure_descriptors, similarity
from tiltvp.lab.evaluation.dissimilarities import DISSIMILARITIES
from tiltvp.lab.evaluation.line_pairs import FALSE, OPEN, RIGHT, frame_pairs, pair_verdicts
from tiltvp.lab.evaluation.wide_lines import metres_apart
from tiltvp.lab.plots.descriptors import correct_matches, rule_densities, similarity_matrices
from tiltvp.synth import MIRROR_BLIND_RAD, Drive, DriveTruth, Room, mirror_camera

pytestmark = pytest.mark.slow

FRAMES = 6
SMALL = DescriptorExperiment(frames_apart=(1, 3), every=1, clips=(0.1, 1.0), noises_percent=(0.0, 10.0), bins=(8, 32))


@pytest.fixture(scope="module")
def drive() -> Drive:
    room = Room("corridor", 2, light_spacing_m=0.6)
    camera = mirror_camera().scaled(0.6)
    # Seed 5 begins where no wall has stripes, which look alike.
    return Drive(room, camera=camera, blind_rad=MIRROR_BLIND_RAD, frames=FRAMES, seed=5, bumps_max_rad=0.03, samples=1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, drive: Drive) -> Path:
    out = tmp_path_factory.mktemp("drives") / "corridor"
    write_drive(drive, out, threads=2)
    return out


@pytest.fixture(scope="module")
def driven(folder: Path) -> DrivenFrames:
    return read_drive(folder)


def test_a_drive_is_read_as_it_was_written(driven: DrivenFrames, drive: Drive) -> None:
    assert (driven.name, len(driven)) == ("corridor", FRAMES)
    assert np.allclose(driven.poses, drive.poses, rtol=0.0, atol=1e-12)
    for k in (0, FRAMES - 1):
        assert (driven.gray(k) == drive.render(k).gray).all()
        assert np.allclose(driven.tilt(k), drive.tilts[k], rtol=0.0, atol=1e-9)
        truth, told = drive.truth(k), driven.truths[k]
        assert (told.edges == truth.edges).all()
        assert np.allclose(told.bearings_rad, truth.bearings_rad)
        assert np.allclose(told.elevations_rad, truth.elevations_rad)
        assert np.allclose(told.contrast, truth.contrast)


@pytest.mark.parametrize(
    ("file", "text", "complaint"),
    [
        ("truth.csv", None, "expected a file of a drive"),
        ("truth.csv", "frame,edge\n", "line 1: other columns, expected frame, edge, bearing_rad"),
        ("truth.csv", "{header}\n0,1,2\n", "line 2: 3 cells, expected 7"),
        ("truth.csv", "{header}\n0,one,0,0,0,0,0\n", "line 2: edge = .one., expected a finite number"),
        ("truth.csv", "{header}\n3,1,0,0,0,0,0\n1,1,0,0,0,0,0\n", "frames out of order"),
        ("truth.csv", "{header}\n77,1,0,0,0,0,0\n", "expected numbers from 0 to 5"),
        ("poses.csv", "{header}\n", "0 poses, expected 6"),
    ],
)
def test_what_is_wrong_with_a_drive_is_told(
    folder: Path, tmp_path: Path, file: str, text: str | None, complaint: str
) -> None:
    copy = tmp_path / "copy"
    copy.mkdir()
    for path in folder.iterdir():
        (copy / path.name).symlink_to(path)
    header = (copy / file).read_text().splitlines()[0]
    (copy / file).unlink()
    if text is not None:
        (copy / file).write_text(text.format(header=header))
    with pytest.raises(InvalidInputError, match=complaint):
        read_drive(copy)


def test_verdicts_on_pairs() -> None:
    truth = DriveTruth(
        edges=np.array([1, 2, 3]),
        bearings_rad=np.radians([10.0, 20.0, 20.2]),
        elevations_rad=np.zeros((3, 2)),
        visible_share=np.ones(3),
        contrast=np.ones(3),
    )
    none: frozenset[int] = frozenset()
    a = [frozenset({1}), frozenset({2}), frozenset({9}), none]
    b = [frozenset({1}), frozenset({3}), none, none]
    verdicts = pair_verdicts(a, b, np.radians([10.0, 20.2, 11.0, 40.0]), truth)
    assert verdicts.tolist() == [
        [RIGHT, FALSE, OPEN, FALSE],  # no edge a degree away: the truth does not tell
        [FALSE, OPEN, FALSE, FALSE],  # another edge within a pixel: it does not either
        [FALSE, FALSE, FALSE, FALSE],  # an edge that is not in sight
        [FALSE, FALSE, FALSE, FALSE],
    ]


def test_pairs_of_frames(driven: DrivenFrames) -> None:
    edges = [[frozenset({7})]] * FRAMES
    lines: list[Any] = [SimpleNamespace(bearing_rad=np.zeros(1))] * FRAMES
    chosen = frame_pairs(driven, edges, lines, SMALL)
    assert [(pair.a, pair.b) for pair in chosen] == [(k, k + 1) for k in range(5)] + [(k, k + 3) for k in range(3)]
    assert all(pair.findable.all() and pair.baseline_m < 0.5 for pair in chosen)
    assert not frame_pairs(driven, [[]] * FRAMES, lines, SMALL)
    fast = replace(driven, poses=np.arange(3.0 * FRAMES).reshape(FRAMES, 3))
    short = DescriptorExperiment(frames_apart=(1, 2), every=2, baseline_max_m=5.0)
    assert [(pair.a, pair.b) for pair in frame_pairs(fast, edges, lines, short)] == [(0, 1), (2, 3), (4, 5)]


@pytest.mark.parametrize("wrong", [{"frames_apart": ()}, {"frames_apart": (0,)}, {"every": 0}, {"baseline_max_m": 0.0}])
def test_experiments_that_make_no_sense(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidInputError, match=next(iter(wrong))):
        DescriptorExperiment(**wrong)


def test_tables_and_figures(driven: DrivenFrames) -> None:
    done: list[None] = []
    tables = measure_descriptors([driven], SMALL, threads=2, advance=lambda: done.append(None))
    assert len(done) == SMALL.steps
    settings = tables.settings
    assert settings.height == len(SMALL.settings) == 12
    assert settings["sweep"].unique(maintain_order=True).to_list() == ["clip", "noise", "bins"]
    shares = settings.filter(pl.col("areas") == "3", pl.col("chart") == "on the sphere")
    default = [shares.row(by_predicate=(pl.col("sweep") == s) & (pl.col("value") == v), named=True)["correct_%"]
               for s, v in (("clip", 0.1), ("noise", 0.0), ("bins", 32.0))]  # fmt: skip
    assert default[0] == default[1] == default[2] > 90.0
    assert tables.measures["measure"].unique(maintain_order=True).to_list() == [*DISSIMILARITIES, "SSD", "ZNCC"]
    assert tables.measures.height == 2 * len(DISSIMILARITIES) + 4
    matches = tables.matches
    assert (matches["mean_ratio"] <= 1.0).all()
    assert (matches["second_ratio"] <= 1.0).all()
    assert matches["frames_apart"].unique().sort().to_list() == [1, 3]
    assert tables.wide.is_empty()  # The drive is half a metre long.
    again = measure_descriptors([driven], SMALL, threads=1)
    assert again.settings.equals(settings)
    assert again.matches.equals(matches)
    assert len(correct_matches(settings).axes) == 3
    assert len(rule_densities(matches, RULES).axes) == 3
    kept = rules(matches)
    assert kept["rule"].to_list() == ["F1", "F2", "F3", "all three"]
    assert kept["false_refused_%"].max() == kept["false_refused_%"][3]
    tracks = follow(driven, 3)
    assert tracks["frame"].unique().sort().to_list() == [0, 1, 2]


def test_dissimilarities() -> None:
    rng = np.random.default_rng(5)
    rows = rng.random((4, 192)).astype(np.float32)
    empty = np.zeros((1, 192), dtype=np.float32)
    for name, measure in DISSIMILARITIES.items():
        unlike = measure(rows, rows)
        assert unlike.shape == (4, 4), name
        assert (unlike.argmin(axis=1) == np.arange(4)).all(), name
        assert unlike == pytest.approx(unlike.T, abs=1e-6), name
        assert np.isfinite(measure(empty, rows)).all(), name
    h, k = np.zeros((2, 1, 192), dtype=np.float32)
    h[0, 0] = k[0, 1] = 1.0
    apart = {name: float(measure(h, k)[0, 0]) for name, measure in DISSIMILARITIES.items()}
    # Two bins that have nothing in common; to the quadratic form they are neighbours of 32.
    assert apart == pytest.approx({
        "descriptor": math.sqrt(2.0), "descriptor, L1": 2.0, "descriptor, chi-square": 1.0,
        "descriptor, Jeffrey divergence": 2.0 * math.log(2.0), "descriptor, Bhattacharyya": 1.0,
        "descriptor, histogram intersection": 0.0, "descriptor, quadratic form": math.sqrt(2.0 / 16.0),
    }, abs=1e-5)  # fmt: skip


def test_pairs_metres_apart() -> None:
    poses = np.zeros((61, 3))
    poses[:, 0] = 0.0625 * np.arange(61)
    assert list(metres_apart(poses)) == [(0, 16), (10, 30), (20, 44), (30, 58), (40, 56)]
    assert not list(metres_apart(poses[:10]))


def test_similarity(driven: DrivenFrames) -> None:
    table = similarity(driven, 0, step_deg=2)
    assert table.height == 180 * 180
    same = table.filter(pl.col("first_deg") == pl.col("second_deg"))
    assert same.select(pl.col("descriptor", "ssd", "zncc").abs().max()).row(0) == pytest.approx((0.0,) * 3, abs=1e-5)
    summary = dict(alike(table).iter_rows())
    # What the paper shows: the descriptor tells directions apart that grey levels do not.
    assert summary["descriptor"] < summary["ssd"]
    assert len(similarity_matrices(table).axes) == 3
    with pytest.raises(InvalidInputError, match="step_deg"):
        similarity(driven, 0, step_deg=7)


def test_rules_without_false_matches() -> None:
    matches = pl.DataFrame({"distance": [0.5, 1.2], "mean_ratio": [0.4, 0.9], "second_ratio": [0.5, 0.5],
                            "correct": [True, True]})  # fmt: skip
    assert rules(matches)["correct_refused_%"].to_list() == [50.0, 50.0, 0.0, 50.0]
    assert rules(matches)["false_refused_%"].to_list() == [None] * 4
    assert len(rule_densities(matches, RULES).axes) == 3


def test_the_command(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "figures"
    assert main(["measure", "descriptors", str(folder), "--out", str(out), "--tracked", "4", "--threads", "2"]) == 0
    assert "figures 13 to 15" in capsys.readouterr().out
    for name in ("similarity", "settings", "rules", "tracks"):
        assert read_image(out / f"{name}.png").shape[2] == 3
        assert pl.read_parquet(out / f"{name if name != 'rules' else 'matches'}.parquet").height > 0
    assert main(["measure", "descriptors", str(folder), "--overwrite", "--out", str(out), "--frame", "6"]) == 2
    assert "--frame 6" in capsys.readouterr().err
