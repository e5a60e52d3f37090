"""Evaluations: what is tried, the rows of an image, cross-validation, runs that are killed and continued, summaries."""

from __future__ import annotations

import json
import math
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import tiltvp
from evaluations import evaluated, same_bytes
from tiltvp.errors import InvalidInputError, RunError
from tiltvp.lab.datasets.folder import TiltDataset, read_dataset
from tiltvp.lab.datasets.new import new_dataset
from tiltvp.lab.datasets.panoramas import Panorama
from tiltvp.lab.evaluation import runs
from tiltvp.lab.evaluation.combinations import PIXEL_METHODS, SWEEPS, TABLE_3, Combination, choose, paper_sweep
from tiltvp.lab.evaluation.crossval import TRAINED, cross_validated
from tiltvp.lab.evaluation.experiment import open_experiment
from tiltvp.lab.evaluation.metrics import offset_rad, relative_errors_rad, turned
from tiltvp.lab.evaluation.panoramas import evaluate_views
from tiltvp.lab.evaluation.runner import ImageRunner, View
from tiltvp.lab.evaluation.runs import Run, read_run
from tiltvp.lab.evaluation.scaling import exponents, measure_scaling
from tiltvp.lab.evaluation.schema import COLUMNS
from tiltvp.lab.evaluation.summary import advantage, errors, reading_of_q, table_3, table_4, variants
from tiltvp.synth import Room, RoomImage

VIEW = View(7, "images/a.png", "a", "flat", 0.06, 0.8, 0.5)


def test_the_paper_has_126_combinations() -> None:
    sweep = paper_sweep()
    paper = [each for each in sweep if each.group == "paper"]
    counts = {method: sum(each.method == method for each in paper) for method in tiltvp.METHODS}
    assert counts == {
        "refined": 0, "image-space-ransac": 36, "image-space-reject-refit": 30, "vector-consensus": 60, "segments": 0,
    }  # fmt: skip
    assert all(each in paper for each in TABLE_3)
    assert len({each.label for each in sweep}) == len(sweep)
    literal = {each.options["keep_fraction"] for each in sweep if each.group == "literal"}
    assert literal == {0.4, 0.3, 0.2, 0.1}
    assert sum(each.method == "refined" for each in sweep) == 1


@pytest.mark.parametrize(
    ("sweep", "methods", "meant"),
    [("papr", None, "did you mean paper"), ("paper", ["refind"], "did you mean refined"), ("x", None, "one of paper")],
)
def test_unknown_sweeps_and_methods_are_named(sweep: str, methods: list[str] | None, meant: str) -> None:
    with pytest.raises(InvalidInputError, match=meant):
        choose(sweep, methods)


def test_methods_narrow_a_sweep() -> None:
    for sweep in SWEEPS:
        assert [each.label for each in choose(sweep, ["refined"])] == ["refined"]


def test_rows_of_an_image_are_the_estimators_own_answers(camera: tiltvp.Camera, room: RoomImage) -> None:
    combinations = choose("table3")
    rows = ImageRunner(camera, combinations)(room.gray, VIEW)
    assert rows.schema == pl.Schema(COLUMNS)
    assert rows["combination"].to_list() == list(range(len(combinations)))
    true = tiltvp.normal_from_alpha_beta(VIEW.alpha_true_rad, VIEW.beta_true_rad)
    for row, combination in zip(rows.iter_rows(named=True), combinations, strict=True):
        estimator = tiltvp.TiltEstimator(camera, method=combination.method, **combination.options)
        estimate = estimator(room.gray)
        assert (row["alpha_rad"], row["beta_rad"]) == (estimate.alpha_rad, estimate.beta_rad)
        assert row["alpha_raw_rad"] == row["alpha_rad"]
        assert (row["shift_px"], row["confidence"]) == (estimate.shift_px, estimate.confidence)
        assert row["covariance_xy_rad2"] == estimate.covariance_rad2[0, 1]
        assert row["error_rad"] == pytest.approx(tiltvp.tilt_error_rad(estimate.normal, true), abs=1e-12)
        assert (row["edge_pixels"], row["iterations"]) == (estimate.edge_pixels, estimate.report.iterations)
        assert row["gradient_min"] == estimator.options["gradient_min"]
        closed = combination.options.get("correction") == "closed-form"
        assert row["correction"] == ("closed-form" if closed else "none")
        assert (row["time_edges_s"] > 0.0) == (combination.method in PIXEL_METHODS)
        assert row["time_fit_s"] > 0.0


def test_an_image_without_edges_has_no_numbers(camera: tiltvp.Camera) -> None:
    rows = ImageRunner(camera, choose("table3"))(np.full((camera.height, camera.width), 90, dtype=np.uint8), VIEW)
    for name in ("alpha_rad", "beta_rad", "error_rad", "offset_x_rad", "covariance_xx_rad2"):
        assert rows[name].null_count() == len(rows), name
    assert rows["confidence"].to_list() == [0.0] * len(rows)
    assert set(rows["stop"]) == {"too-few"}


def test_offsets_are_turned_back_by_the_heading() -> None:
    true = tiltvp.normal_from_alpha_beta(0.05, 0.3)
    estimated = tiltvp.normal_from_alpha_beta(0.07, 0.1)
    one = offset_rad(estimated, true)
    assert np.hypot(*one) == pytest.approx(tiltvp.tilt_error_rad(estimated, true), abs=1e-14)
    for many in (offset_rad([estimated] * 3, true), offset_rad([estimated] * 3, [true] * 3)):
        np.testing.assert_allclose(many, [one] * 3, rtol=1e-14)
    np.testing.assert_allclose(offset_rad(true, true), [0.0, 0.0], atol=1e-16)
    np.testing.assert_allclose(turned(np.array([[1.0, 0.0]]), math.pi / 2), [[0.0, 1.0]], atol=1e-15)


def test_corrections_never_see_their_own_location(whole: Run) -> None:
    """Eqs. 30, 31 and 45 by hand for one image-space combination and the vector consensus."""
    for method, measured in (("image-space-reject-refit", "shift_px"), ("vector-consensus", "alpha_raw_rad")):
        rows = whole.table.filter((pl.col("method") == method) & (pl.col("group") == "paper"))
        rows = rows.filter(pl.col("combination") == rows["combination"].min())
        raw, trained = (rows.filter(pl.col("correction") == kind) for kind in ("none", "factor"))
        for row in trained.iter_rows(named=True):
            others = raw.filter((pl.col("location") != row["location"]) & (pl.col("alpha_true_rad") > 0.0))
            others = others.drop_nulls("alpha_raw_rad")
            factor = (others[measured] / others["alpha_true_rad"]).mean()
            assert row["factor"] == pytest.approx(factor, rel=1e-12)
            if row["alpha_rad"] is not None:
                assert row["alpha_rad"] == pytest.approx(row[measured] / factor, rel=1e-12)
                truth = tiltvp.normal_from_alpha_beta(row["alpha_true_rad"], row["beta_true_rad"])
                normal = tiltvp.normal_from_alpha_beta(row["alpha_rad"], row["beta_rad"])
                assert row["error_rad"] == pytest.approx(tiltvp.tilt_error_rad(normal, truth), abs=1e-12)


def test_rows_of_a_run(whole: Run, dataset: TiltDataset) -> None:
    combinations = choose("table3")
    assert whole.table.schema == pl.Schema(COLUMNS)
    trainable = sum(each.trainable for each in combinations)
    assert len(whole.table) == len(dataset.images) * (len(combinations) + 3 * trainable)
    kinds = whole.table.group_by("method", "correction").len()
    assert set(kinds.filter(pl.col("method") == "refined")["correction"]) == {"none"}
    assert set(kinds["correction"]) == {"none", "factor", "affine", "posterior", "closed-form"}
    blank = whole.table.filter(pl.col("image") == 5)
    assert blank["error_rad"].null_count() == len(blank)
    trained = whole.table.filter(pl.col("correction").is_in(["factor", "affine", "posterior"]))
    assert trained["covariance_xx_rad2"].null_count() == len(trained)
    own = trained.filter((pl.col("group") == "paper") & (pl.col("method") == "image-space-reject-refit"))
    assert own["factor"].null_count() == 0
    assert own.filter(pl.col("correction") == "affine")["offset_rad"].null_count() == 0
    assert own.filter(pl.col("correction") != "affine")["offset_rad"].null_count() == 2 * len(dataset.images)
    assert own["error_rad"].null_count() == 3


def test_a_single_location_trains_nothing(camera: tiltvp.Camera, room: RoomImage) -> None:
    table = cross_validated(ImageRunner(camera, TABLE_3)(room.gray, VIEW))
    trained = table.filter(pl.col("correction") != "none")
    assert len(trained) == 3 * len(TABLE_3)
    assert trained["alpha_rad"].null_count() == trained["factor"].null_count() == len(trained)


def test_the_same_for_any_number_of_threads(tmp_path: Path, dataset: TiltDataset, whole: Run) -> None:
    assert same_bytes(evaluated(dataset, tmp_path / "run", threads=2).table, whole.table)


def test_a_run_on_disk_is_the_run(tmp_path: Path, dataset: TiltDataset) -> None:
    run = evaluated(dataset, tmp_path / "run")
    assert {path.name for path in (tmp_path / "run").iterdir()} == {"manifest.json", "estimates.parquet"}
    again = read_run(tmp_path / "run")
    assert again.table.equals(run.table, null_equal=True)
    assert again.manifest == json.loads(json.dumps(run.manifest))
    assert again.manifest["dataset"]["digest"] == dataset.digest()
    assert [each["label"] for each in again.manifest["combinations"]] == [each.label for each in choose("table3")]
    assert again.manifest["combinations"][1]["options"]["keep_fraction"] == 0.8
    # A whole run is not done again.
    assert evaluated(dataset, tmp_path / "run").table.equals(run.table, null_equal=True)


def test_half_a_run_is_continued(
    tmp_path: Path, dataset: TiltDataset, whole: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every image is estimated once over the two sittings, and what was half written is gone."""
    seen: list[int] = []
    original = ImageRunner.__call__

    def counted(self: ImageRunner, image: np.ndarray, view: View) -> pl.DataFrame:
        seen.append(view.number)
        return original(self, image, view)

    monkeypatch.setattr(ImageRunner, "__call__", counted)

    class Stop(Exception):  # noqa: N818
        pass

    def stop() -> None:
        if len(seen) == 4:
            raise Stop

    with pytest.raises(Stop), open_experiment(dataset, choose("table3"), tmp_path / "run", sweep="table3") as first:
        first.estimate(advance=stop)
    (tmp_path / "run" / "parts" / ".000004.00.part.parquet").write_bytes(b"half")
    with pytest.raises(RunError, match="4 of 15 images are done"):
        read_run(tmp_path / "run")
    assert same_bytes(evaluated(dataset, tmp_path / "run").table, whole.table)
    assert sorted(seen) == list(range(15))
    assert not (tmp_path / "run" / "parts").exists()


PROGRAM = """
import sys, time
from pathlib import Path
from tiltvp.lab.datasets.folder import read_dataset
from tiltvp.lab.evaluation.combinations import choose
from tiltvp.lab.evaluation.experiment import open_experiment

with open_experiment(read_dataset(sys.argv[1]), choose("table3"), Path(sys.argv[2]), sweep="table3") as experiment:
    def advance():
        print("done", flush=True)
        time.sleep(0.05)
    experiment.estimate(threads=2, advance=advance)
    print("estimated", flush=True)
    experiment.conclude()
"""


@pytest.mark.parametrize("lines", [2, 7, 16], ids=["early", "late", "at the end"])
def test_killed_and_continued(tmp_path: Path, dataset: TiltDataset, whole: Run, lines: int) -> None:
    words = [sys.executable, "-c", PROGRAM, str(dataset.directory), str(tmp_path / "run")]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for _ in range(lines):
            assert process.stdout.readline()
        process.send_signal(signal.SIGKILL)
        assert process.wait(timeout=60) == -signal.SIGKILL
    with open_experiment(dataset, choose("table3"), tmp_path / "run", sweep="table3") as experiment:
        assert len(experiment.missing()) <= max(0, 15 - lines)
        experiment.estimate()
        assert same_bytes(experiment.conclude().table, whole.table)
    assert {path.name for path in (tmp_path / "run").iterdir()} == {"manifest.json", "estimates.parquet"}


def test_killed_between_the_table_and_the_parts(tmp_path: Path, dataset: TiltDataset, whole: Run) -> None:
    with open_experiment(dataset, choose("table3"), tmp_path / "run", sweep="table3") as experiment:
        experiment.estimate()
        parts = {path.name: path.read_bytes() for path in (tmp_path / "run" / "parts").iterdir()}
        experiment.conclude()
    (tmp_path / "run" / "parts").mkdir()
    for name in list(parts)[:5]:
        (tmp_path / "run" / "parts" / name).write_bytes(parts[name])
    assert same_bytes(evaluated(dataset, tmp_path / "run").table, whole.table)
    assert not (tmp_path / "run" / "parts").exists()


def test_another_run_is_refused_with_what_differs(
    tmp_path: Path, dataset: TiltDataset, camera: tiltvp.Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = tmp_path / "run"
    with open_experiment(dataset, TABLE_3, run):
        pass
    changed = Combination(TABLE_3[1].method, TABLE_3[1].label, "paper", TABLE_3[1].options | {"keep_fraction": 0.7})
    for combinations, seed, what in (
        (TABLE_3, 5, "seed: 0 there, 5 now"),
        (TABLE_3[:2], 0, "combinations: 4 there, 2 now"),
        ((TABLE_3[0], changed, *TABLE_3[2:]), 0, "keep_fraction of .*: 0.8 there, 0.7 now"),
        (TABLE_3[::-1], 0, "combinations: .* there, .* now"),
    ):
        with pytest.raises(RunError, match=what), open_experiment(dataset, combinations, run, seed=seed):
            pass
    monkeypatch.setattr(runs, "versions", lambda: {"tiltvp": "9"})
    with pytest.raises(RunError, match=r"version of tiltvp: .* there, 9 now"), open_experiment(dataset, TABLE_3, run):
        pass
    monkeypatch.undo()
    other = tmp_path / "other"
    with new_dataset(other, camera) as new:
        gray = np.zeros((camera.height, camera.width), dtype=np.uint8)
        new.images.append(new.write("a", gray, location="a", environment="a", alpha_rad=0.0, beta_rad=0.0))
    with pytest.raises(RunError, match=r"dataset digest: .*; dataset images: 15 there, 1 now"):  # noqa: SIM117
        with open_experiment(read_dataset(other), TABLE_3, run):
            pass


def test_one_run_has_one_process(tmp_path: Path, dataset: TiltDataset) -> None:
    with open_experiment(dataset, TABLE_3, tmp_path):  # noqa: SIM117
        with pytest.raises(RunError, match="another process"), open_experiment(dataset, TABLE_3, tmp_path):
            pass


def test_folders_that_are_no_runs(tmp_path: Path, dataset: TiltDataset) -> None:
    (tmp_path / "thesis.tex").write_text("")
    with pytest.raises(RunError, match=r"holds thesis\.tex"), open_experiment(dataset, TABLE_3, tmp_path):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
    with pytest.raises(RunError, match="expected the folder of a run"):
        read_run(tmp_path)
    (tmp_path / "manifest.json").write_text("{")
    with pytest.raises(RunError, match="manifest of a run"):
        read_run(tmp_path)
    (tmp_path / "manifest.json").write_text("[]")
    with pytest.raises(RunError, match="not the manifest"):
        read_run(tmp_path)
    with pytest.raises(InvalidInputError, match="without combinations"), open_experiment(dataset, (), tmp_path):
        pass


def test_summaries(whole: Run, dataset: TiltDataset) -> None:
    summary = errors(whole.table)
    assert len(summary) == len(whole.table) // len(dataset.images)
    for row in summary.iter_rows(named=True):
        rows = whole.table.filter(
            (pl.col("combination") == row["combination"]) & (pl.col("correction") == row["correction"])
        ).drop_nulls("error_rad")
        assert row["images"] - row["failed"] == len(rows)
        assert row["p95_deg"] == pytest.approx(math.degrees(np.percentile(rows["error_rad"].to_numpy(), 95)))
        # A location with two estimates cannot tell its reference's error from theirs.
        several = [part for _, part in rows.group_by("location") if len(part) > 2]
        relative = np.concatenate(
            [relative_errors_rad(part.select("offset_x_rad", "offset_y_rad").to_numpy()) for part in several]
        )
        assert row["relative_mean_deg"] == pytest.approx(math.degrees(relative.mean()))
    chosen = table_3(summary)
    own = chosen.filter(pl.col("group") == "paper")
    assert own["method"].n_unique() == 3
    consensus = own.filter(pl.col("method") == "vector-consensus")
    assert consensus["paper_mean_deg"].to_list() == [1.63, 1.03, None, None]
    for row in own.iter_rows(named=True):
        rivals = summary.filter(
            (pl.col("method") == row["method"]) & (pl.col("correction") == row["correction"])
            & (pl.col("group") == "paper")
        )  # fmt: skip
        assert row["mean_deg"] == rivals["mean_deg"].min()
    assert (table_4(summary)["time_mean_ms"] > table_4(summary)["time_edges_ms"]).all()
    assert reading_of_q(summary)["reading"].to_list() == ["share kept", "share rejected"]
    assert reading_of_q(summary)["q"].to_list() == [0.8, 0.8]
    assert advantage(summary)["mean_ratio"].is_between(0.1, 100.0).all()
    assert variants(summary)["variant"].n_unique() == len(summary)
    for table in (table_3, table_4, reading_of_q, advantage):
        assert len(table(summary.clear())) == 0


def test_the_command(tmp_path: Path, dataset: TiltDataset, whole: Run, capfd: pytest.CaptureFixture[str]) -> None:
    from tiltvp.cli import main

    words = ["evaluate", str(dataset.directory), "--sweep", "table3", "--threads", "2", "--out", str(tmp_path / "run")]
    assert main(words) == 0
    said = capfd.readouterr()
    assert "Table 3" in said.out
    assert "Table 4" in said.out
    assert "What Q means" in said.out
    assert same_bytes(read_run(tmp_path / "run").table, whole.table)
    assert main(words) == 0
    assert "15 of 15 images were done before" in capfd.readouterr().out
    assert main([*words, "--methods", "refined"]) == 2
    assert "combinations: 12 there, 1 now" in capfd.readouterr().err
    assert main([*words[:2], "--sweep", "table4", *words[4:]]) == 2
    assert "did you mean table3" in capfd.readouterr().err


@pytest.mark.slow
def test_cost_over_images_and_pixels(camera: tiltvp.Camera) -> None:
    small = camera.scaled(0.5)
    table = measure_scaling(small, choose("table3", ["refined"]), images=(1, 2), scales=(1.0, 4.0))
    assert table["over"].to_list() == ["images", "images", "pixels", "pixels"]
    assert table["images"].to_list() == [1, 2, 1, 1]
    assert table["width"].to_list() == [128, 128, 128, 256]
    assert (table["seconds"] > table["seconds_images"]).all()
    times = [1.0, 2.0, 4.0, 3.0, 12.0]
    sizes = {"images": [1, 2, 4, 2, 2], "megapixels": [0.3, 0.3, 0.3, 0.6, 1.2], "edge_pixels": [9.0] * 5}
    made = pl.DataFrame({"over": ["images"] * 3 + ["pixels"] * 2, "seconds": times, "seconds_images": times} | sizes)
    fitted = exponents(made)
    assert fitted["seconds"].to_list() == pytest.approx([1.0, 2.0])
    assert fitted["edge_pixels"].to_list() == pytest.approx([0.0, 0.0], abs=1e-12)
    assert exponents(pl.concat([made[:1]] * 2)).is_empty()


@pytest.mark.slow
def test_one_size_has_no_exponent(capfd: pytest.CaptureFixture[str]) -> None:
    from tiltvp.cli import main

    assert main(["measure", "scaling", "--images", "1", "1", "--scales", "1", "--sweep", "table3"]) == 0
    printed = capfd.readouterr().out
    assert "Seconds of an evaluation" in printed
    assert "Exponents" not in printed


@pytest.mark.slow
def test_views_of_panoramas_without_files(tmp_path: Path, camera: tiltvp.Camera) -> None:
    scene = Room("corridor", 3)
    tiltvp.write_image(tmp_path / "hall.png", scene.render_panorama(pose=scene.free_poses(1, 0)[0], height=200).gray)
    panorama = Panorama("hall", tmp_path / "hall.png", "house", None)
    leans = ((0.0, 0.0), (3.0, 20.0))
    table = evaluate_views([panorama], camera, choose("table3"), samples=1, turn=True, tilts_deg=leans)
    assert table.schema == pl.Schema(COLUMNS)
    assert set(table["location"]) == {"hall"}
    assert set(table["environment"]) == {"house"}
    assert table["image"].unique().to_list() == [0, 1]
    assert table["yaw_rad"].n_unique() == 2
    refined = table.filter(pl.col("method") == "refined")
    assert refined["error_rad"].max() < math.radians(5.0)


def test_what_one_location_does_not_train_is_said_and_not_shown(whole: Run, capfd: pytest.CaptureFixture[str]) -> None:
    from tiltvp.cli.lab.evaluate import show_tables

    untrained = whole.table.filter(~pl.col("correction").is_in(TRAINED), location=whole.table["location"][0])
    table = cross_validated(untrained)
    assert set(table["correction"]) == {"none", "closed-form", *TRAINED}
    show_tables(Run(whole.manifest, table))
    printed = capfd.readouterr().out
    assert "trained corrections are left out: images of other locations, which train them, are too few" in printed
    assert not re.search(r" factor +\d", printed)
