"""The command line: tables, files, pictures, and one clear line for everything that is wrong."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import polars as pl
import pytest

import tiltvp
from commands import Run, Said, verbs
from tiltvp.cli.app import app
from tiltvp.overlays.offsets import lean_chart
from tiltvp.synth import render_room

ALPHA_RAD, BETA_RAD = math.radians(4.0), math.radians(30.0)


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small camera, rooms seen by it (`images/a.png`, `images/b.png`), and files that are no images."""
    folder = tmp_path_factory.mktemp("world")
    camera = small_camera()
    camera.save(folder / "camera.toml")
    for name, seed in (("a", 1), ("b", 2)):
        room = render_room(camera, seed=seed, alpha_rad=ALPHA_RAD, beta_rad=BETA_RAD)
        tiltvp.write_image(folder / "images" / f"{name}.png", room.bgr)
    tiltvp.write_image(folder / "more" / "a.png", room.gray)
    tiltvp.write_image(folder / "small.png", np.zeros((20, 30), dtype=np.uint8))
    (folder / "broken.png").write_bytes(b"this is no image")
    (folder / "empty").mkdir()
    return folder


def small_camera() -> tiltvp.Camera:
    """185 degrees on 240 x 180 pixels."""
    limit = math.radians(92.5)
    return tiltvp.Camera.equidistant(width=240, height=180, focal_px=52.4, cx=119.5, cy=89.5, max_theta_rad=limit)


# --- the program -------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_help_is_quick_and_names_the_commands(run: Run) -> None:
    said = run("--help")
    assert said.code == 0
    for command in ("tilt", "camera", "demo"):
        assert command in said.out
    program = "import sys; from tiltvp.cli import main; main(['--help']); print(sorted(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60)
    for heavy in ("polars", "matplotlib"):
        assert f"'{heavy}'" not in done.stdout
    one = program.replace("--help", "tilt', '--help")
    done = subprocess.run([sys.executable, "-c", one], capture_output=True, text=True, check=True, timeout=60)
    others = {"tiltvp.cli.calibrate", "tiltvp.cli.corner", "tiltvp.cli.lab"}
    assert not others & set(re.findall("'([^']*)'", done.stdout.splitlines()[-1]))


@pytest.mark.slow
@pytest.mark.parametrize("words", list(verbs(app)), ids=" ".join)
def test_options_have_no_name_of_a_parameter_before_theirs(run: Run, words: tuple[str, ...]) -> None:
    said = run(*words, "--help")
    assert said.code == 0
    assert not re.findall(r"--[\w-]+\.\w+", said.out)


@pytest.mark.slow
def test_installed_program(world: Path) -> None:
    program = Path(sys.executable).with_name("tiltvp")
    for command in ([program], [sys.executable, "-m", "tiltvp"]):
        done = subprocess.run([*command, "--version"], capture_output=True, text=True, timeout=60)
        assert (done.returncode, done.stdout.strip()) == (0, tiltvp.__version__)
    done = subprocess.run(
        [program, "tilt", "broken.png", "--camera", "camera.toml"],
        cwd=world,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 1
    assert "broken.png" in Said(done.returncode, done.stdout, done.stderr).complaint


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["tilt", "x.png", "--camera", "camera.toml", "--tilt-max-dg", "3"], "--tilt-max-deg"),
        (["tilt", "x.png", "--camera", "camera.toml", "--method", "refind"], "did you mean refined?"),
        (["tilt", "x.png", "--camera", "camera.toml", "--camera-format", "opencvv"], "opencv"),
        (["tilt", "x.png", "--camera", "camera.toml", "--threshold-px", "3"], "--threshold-px: unknown"),
        (["tilt", "x.png", "--camera", "camera.toml", "--camera-name", "cam7"], "cam0"),
        (["tilt", "x.png", "--camera", "camera.toml", "--robot-from-camera", "foward"], "did you mean forward?"),
        (["tilt", "x.png", "--camera", "camera.toml", "--image-size", "big"], "640x480"),
        (["tilt", "x.png", "--camera", "camera.toml", "--out", "r.xls"], ".parquet"),
        (["tilt", "x.png", "--camera", "camera.toml", "--overlay", "o", "--level", "./o"], "two folders"),
        (["tilt", "x.png", "--camera", "camera.toml", "--elevation-min-deg", "60"], "--elevation-max-deg = 45 degrees"),
        (["tilt", "x.png", "--camera", "camera.toml", "--threads", "0"], "threads"),
        (
            ["tilt", "x.png", "--camera", "camera.toml", "--correction", "some", "--method", "vector-consensus"],
            "number",
        ),
        (["tilt", "x.png", "--camera", "camera.toml", "--mask", "small.png"], "mask"),
        (["tilt", "x.png", "--camera", "camera.toml", "--mask", "none.png"], "none.png"),
        (["tilt", "x.png", "--camera", "missing.yaml"], "missing.yaml"),
        (["tilt", "x.png"], "--camera"),
        (["tilt", "--camera", "camera.toml"], "no source, expected images"),
        (["tlt"], '"tilt"'),
        (["camera", "infos"], '"info"'),
        (["camera", "convert", "camera.toml", "out.yaml"], ".toml, or --to"),
        (["camera", "convert", "camera.toml", "out.yaml", "--to", "ocamcalib"], "tiltvp, opencv, kalibr"),
        (["camera", "convert", "camera.toml", "out.yaml", "--to", "gyroflow"], "gyroflow is not written"),
        (["camera", "convert", "camera.toml", "./camera.toml"], "another name"),
        (["camera", "info", "broken.png"], "broken.png"),
        (["demo", "--kind", "ofice"], "office"),
        (["mount", "x.png", "--camera", "camera.toml", "--out", "out.csv"], "expected .json"),
    ],
)
def test_wrong_use_is_one_line_and_code_2(
    run: Run, world: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], hint: str
) -> None:
    monkeypatch.chdir(world)
    said = run(*words)
    assert said.code == 2
    assert said.out == ""
    assert hint in said.complaint


# --- tilt --------------------------------------------------------------------------------------------------------


def test_tilt_writes_the_same_numbers_as_the_library(run: Run, world: Path, tmp_path: Path) -> None:
    out = tmp_path / "deep" / "results.csv"
    said = run("tilt", world / "images", "--camera", world / "camera.toml", "--out", out)
    assert said.code == 0
    assert said.err == ""
    assert "alpha deg" in said.out
    table = pl.read_csv(out)
    assert [Path(file).name for file in table["file"]] == ["a.png", "b.png"]
    estimator = tiltvp.TiltEstimator(small_camera())
    for row in table.iter_rows(named=True):
        expected = estimator(tiltvp.read_image(row["file"]))
        assert row["alpha_rad"] == expected.alpha_rad
        assert row["covariance_xy_rad2"] == expected.covariance_rad2[0, 1]
        assert row["normal_z"] == expected.normal[2]
        assert row["inlier_pixels"] == expected.inlier_pixels
        assert (row["method"], row["reason"], row["error"]) == ("refined", expected.report.reason, None)
        told = expected.to_dict()
        several = ["normal", "covariance_rad2"]
        assert [name for name in told if name not in row] == several, "a field without a column in cli/results.py"
        assert {name: row[name] for name in told if name not in several} == {
            name: value for name, value in told.items() if name not in several
        }
        unfilled = [name for name, value in row.items() if value is None]
        assert unfilled == ["shift_px", "error"], "a column of cli/results.py that no field fills"
        true = tiltvp.normal_from_alpha_beta(ALPHA_RAD, BETA_RAD)
        assert tiltvp.tilt_error_rad(expected.normal, true) < math.radians(2.0)
    assert f"{math.degrees(table['alpha_rad'][0]):.2f}" in said.out
    assert sorted(file.name for file in out.parent.iterdir()) == ["results.csv"]


def test_out_formats_hold_the_same(run: Run, world: Path, tmp_path: Path) -> None:
    frames = []
    for name in ("r.csv", "r.json", "r.parquet"):
        assert (
            run("tilt", world / "images/a.png", "--camera", world / "camera.toml", "--out", tmp_path / name).code == 0
        )
        read = {".csv": pl.read_csv, ".json": pl.read_json, ".parquet": pl.read_parquet}[Path(name).suffix]
        frames.append(read(tmp_path / name).drop("time_s").to_dicts())
    assert frames[0] == frames[1] == frames[2]


@pytest.mark.slow
def test_options_reach_the_core(run: Run, world: Path, tmp_path: Path) -> None:
    common = ("tilt", world / "images/a.png", "--camera", world / "camera.toml", "--out", tmp_path / "r.json")
    mask = np.zeros((180, 240), dtype=np.uint8)
    mask[:, :120] = 255
    tiltvp.write_image(tmp_path / "mask.png", mask)
    (tmp_path / "r.txt").write_text("0 -1 0\n1 0 0\n0 0 1\n")
    changes: list[tuple[object, ...]] = [
        (),
        ("--elevation-min-deg", "6"),
        ("--elevation-max-deg", "30"),
        ("--margin-px", "4"),
        ("--gradient-min", "300"),
        ("--smoothing-px", "1"),
        ("--tilt-max-deg", "16"),
        ("--keep-fraction", "0.6"),
        ("--scale-deg", "1"),
        ("--mask", tmp_path / "mask.png"),
        ("--robot-from-camera", tmp_path / "r.txt"),
        ("--mirror", "--elevation-min-deg", "-45", "--elevation-max-deg", "0"),
        ("--method", "image-space-ransac"),
        ("--method", "image-space-ransac", "--threshold-px", "2"),
        ("--method", "image-space-ransac", "--offset-max-px", "9"),
        ("--method", "image-space-ransac", "--seed", "5", "--threshold-px", "1"),
        ("--method", "image-space-ransac", "--correction", "none"),
        ("--method", "image-space-ransac", "--correction", "90.5"),
        ("--method", "vector-consensus"),
        ("--method", "vector-consensus", "--normal", "tangent"),
        ("--method", "vector-consensus", "--threshold-deg", "2"),
    ]
    seen: dict[tuple[object, ...], tuple[object, ...]] = {}
    for change in changes:
        said = run(*common, *change, "--overwrite")
        assert said.code == 0, said.err
        row = json.loads((tmp_path / "r.json").read_text())[0]
        answer = (row["alpha_rad"], row["beta_rad"], row["confidence"], row["edge_pixels"], row["inlier_pixels"])
        assert answer not in seen, f"{change} and {seen[answer]} give the same"
        seen[answer] = change


def test_what_cannot_be_read_is_named_and_the_others_are_done(run: Run, world: Path, tmp_path: Path) -> None:
    out, overlay = tmp_path / "r.json", tmp_path / "overlay"
    bad = (world / "broken.png", world / "small.png", world / "none.png", world / "empty", world / "no*.png")
    words = (
        "tilt",
        *bad,
        world / "images/a.png",
        "--camera",
        world / "camera.toml",
        "--out",
        out,
        "--overlay",
        overlay,
    )
    for threads in (1, 3):
        said = run(*words, "--threads", threads, *(["--overwrite"] if threads > 1 else []))
        assert said.code == 1
        lines = said.err.splitlines()
        assert len(lines) == len(bad)
        for path in bad:
            assert sum(str(path) in line for line in lines) == 1
        rows = json.loads(out.read_text())
        assert [row["error"] is None for row in rows] == [False, False, False, True]
        assert [row["alpha_rad"] is None for row in rows] == [True, True, True, False]
        assert [file.name for file in overlay.iterdir()] == ["a.png"]


def test_an_image_without_edges_is_done_without_a_tilt(run: Run, world: Path, tmp_path: Path) -> None:
    tiltvp.write_image(tmp_path / "black.png", np.zeros((180, 240), dtype=np.uint8))
    words = ("--camera", world / "camera.toml", "--out", tmp_path / "r.json", "--overlay", tmp_path / "overlay")
    said = run("tilt", tmp_path / "black.png", *words, "--level", tmp_path / "level")
    assert (said.code, said.err) == (0, "")
    row = json.loads((tmp_path / "r.json").read_text())[0]
    assert (row["alpha_rad"], row["covariance_xx_rad2"], row["confidence"]) == (None, None, 0.0)
    what, doubt = row["reason"].split("; ")  # The table folds the whole.
    assert what in said.out
    assert doubt == "0 edge pixels are few: little contrast, dark, over-exposed or blurred"
    assert (tmp_path / "overlay" / "black.png").exists()
    assert not (tmp_path / "level").exists()


def test_overlay_and_level_of_equal_names(run: Run, world: Path, tmp_path: Path) -> None:
    overlay, level = tmp_path / "overlay", tmp_path / "level"
    pattern = f"{world}/**/a.png"
    said = run("tilt", pattern, "--camera", world / "camera.toml", "--overlay", overlay, "--level", level)
    assert said.code == 0, said.err
    for folder in (overlay, level):
        assert sorted(file.name for file in folder.iterdir()) == ["images_a.png", "more_a.png"]
    image = tiltvp.read_image(world / "images/a.png")
    drawn = tiltvp.read_image(overlay / "images_a.png")
    assert drawn.shape == image.shape
    assert (drawn.max(axis=2) > drawn.min(axis=2) + 60).sum() > 100
    levelled = tiltvp.read_image(level / "images_a.png")
    estimator = tiltvp.TiltEstimator(small_camera())
    assert np.array_equal(levelled, tiltvp.level(image, estimator, estimator(image)))
    assert tiltvp.read_image(level / "more_a.png").ndim == 2


def test_names_are_shown_as_they_are(run: Run, world: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # Long names are folded.
    name = Path("[red]:smile: [x].png")
    tiltvp.write_image(name, tiltvp.read_image(world / "images/a.png"))
    said = run("tilt", name, "--camera", world / "camera.toml", "--overlay", tmp_path / "overlay")
    assert said.code == 0
    assert str(name) in said.out
    assert (tmp_path / "overlay" / name.name).exists()


def test_threads_do_not_change_results(run: Run, world: Path, tmp_path: Path) -> None:
    texts = []
    for threads in (1, 4):
        out = tmp_path / f"{threads}.json"
        assert (
            run("tilt", world / "images", "--camera", world / "camera.toml", "--out", out, "--threads", threads).code
            == 0
        )
        texts.append([{**row, "time_s": 0.0} for row in json.loads(out.read_text())])
    assert texts[0] == texts[1]


def test_results_that_cannot_be_written(run: Run, world: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    out = tmp_path / "file" / "r.csv"
    said = run("tilt", world / "images/a.png", "--camera", world / "camera.toml", "--out", out)
    assert said.code == 1
    assert str(out) in said.complaint


@pytest.mark.slow
@pytest.mark.parametrize(
    ("verb", "ending"),
    [("tilt", "csv"), ("tilt", "tum"), ("lines", "csv"), ("segments", "csv"), ("mount", "json")],
)
def test_results_are_written_though_nobody_reads_what_is_printed(
    verb: str, ending: str, world: Path, tmp_path: Path
) -> None:
    read, write = os.pipe()
    os.close(read)
    out = tmp_path / f"r.{ending}"
    words = (verb, world / "images", "--camera", world / "camera.toml", "--out", out)
    try:
        code = subprocess.run([sys.executable, "-m", "tiltvp", *words], stdout=write, check=False).returncode
    finally:
        os.close(write)
    assert code == 1
    assert out.stat().st_size > 0


# --- demo --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_demo(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "demo"
    said = run("demo", "--out", out, "--width", 240, "--height", 180, "--alpha-deg", 3, "--beta-deg", -60)
    assert (said.code, said.err) == (0, "")
    names = ["input.png", "overlay.png", "levelled.png", "plot.png", "summary.png"]
    assert [line for line in said.out.splitlines() if line.endswith(".png")] == [str(out / name) for name in names]
    for method in tiltvp.METHODS:
        assert method in said.out
    pictures = {name: cv2.imread(str(out / name)) for name in names}
    assert pictures["input.png"].shape == (180, 240, 3)
    assert pictures["levelled.png"].shape == (180, 480, 3)
    assert pictures["plot.png"].std() > 20.0
    # The chart of leans says how many degrees its rings are.
    leans = lean_chart((400, 400), (0.1, 0.5), [("one", 0.1, 0.5)])
    assert (leans[40:340, 25:55].min(), leans[360:372, 70:380].min()) == (0, 0)
    row = next(line for line in said.out.splitlines() if line.split()[:1] == ["refined"])
    alpha, beta, error = (float(word) for word in row.split()[1:4])
    true = tiltvp.normal_from_alpha_beta(math.radians(3.0), math.radians(-60.0))
    found = tiltvp.normal_from_alpha_beta(math.radians(alpha), math.radians(beta))
    assert abs(math.degrees(tiltvp.tilt_error_rad(found, true)) - error) < 0.02
    assert error < 2.0


@pytest.mark.slow
@pytest.mark.parametrize(("alpha_deg", "kind"), [(0, "corridor"), (60, "under-table")])
def test_demo_where_methods_find_little(run: Run, tmp_path: Path, alpha_deg: float, kind: str) -> None:
    said = run("demo", "--out", tmp_path, "--width", 120, "--height", 90, "--alpha-deg", alpha_deg, "--kind", kind)
    assert (said.code, said.err) == (0, "")
    assert (tmp_path / "plot.png").exists()
