"""The table of `tiltvp tilt` for people: a line of summary, and rows that a narrow terminal holds."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from rich.console import Console

import tiltvp
import tiltvp.cli.tilt as verb
from tiltvp.cli import main
from tiltvp.cli.results import Outcome, outcome_table, people_table, summary_words
from tiltvp.cli.tables import Table, write_frame, write_table
from tiltvp.rotations import ROTATION_WORDS

CAMERA = tiltvp.Camera.equidistant(width=160, height=120, focal_px=35.0, cx=79.5, cy=59.5)
ESTIMATOR = tiltvp.TiltEstimator(CAMERA)
ROOM = tiltvp.synth.render_room(CAMERA, kind="office", seed=1, alpha_rad=0.07, beta_rad=0.5, samples=1).gray
FOLDER = Path("/data/of a long name/drive of that day")


def outcomes(verdict: str | None = None, *, filtered: bool = False) -> list[Outcome]:
    """Two images of a room, one that is blank, and one that cannot be read."""
    held = tiltvp.TiltFilter().predict() if filtered else None
    accepted = None if verdict is None else False
    files = [FOLDER / f"a frame whose name is rather long {k:06d}.png" for k in range(4)]
    room, blank = ESTIMATOR(ROOM), ESTIMATOR(np.zeros_like(ROOM))
    return [
        Outcome(files[0], room, 0.5, accepted=accepted, verdict=verdict, filtered=held),
        Outcome(files[1], room, 0.001, accepted=accepted, verdict=verdict, filtered=held),
        Outcome(files[2], blank, 0.002, accepted=accepted, verdict=verdict, filtered=held),
        Outcome(files[3], error="not an image", accepted=accepted, verdict=verdict, filtered=held),
    ]


@pytest.mark.parametrize("width", [80, 240])
@pytest.mark.parametrize("verdict", [None, "low-confidence"])
@pytest.mark.parametrize("filtered", [False, True])
def test_a_row_is_a_line_and_names_are_told_by_their_ends(width: int, verdict: str | None, filtered: bool) -> None:
    console = Console(file=io.StringIO(), width=width)
    rows = outcomes(verdict, filtered=filtered)
    console.print(people_table(rows, width))
    lines = [line for line in console.file.getvalue().splitlines() if line.strip()]
    assert max(map(len, lines)) <= width
    if width == 80:
        assert len(lines) == 2 + len(rows)
    assert all(any(f"{k:06d}.png" in line for line in lines) for k in range(4))
    assert "drive" not in "".join(lines)
    assert lines[0].index("roll deg") < lines[0].index("pitch deg")


def test_the_summary_says_how_many_how_they_lean_and_why_not() -> None:
    alpha = np.degrees(ESTIMATOR(ROOM).alpha_rad)
    assert summary_words(outcomes()) == (
        f"4 images: lean {alpha:.2f} deg in the median, 90 % from {alpha:.2f} to {alpha:.2f}; "
        "1 without a tilt (1 too few); 1 could not be used; 2.00 ms an image"
    )
    assert "2 low-confidence" in summary_words(outcomes("low-confidence"))
    assert summary_words(outcomes()[:1]) == f"1 image: lean {alpha:.2f} deg"
    assert summary_words(outcomes()[3:]) == "1 image: no tilt; 1 could not be used"


@pytest.mark.parametrize("extra", [[], ["--filter"]])
def test_rows_come_as_lines_of_json_as_soon_as_they_are_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, extra: list[str]
) -> None:
    CAMERA.save(tmp_path / "camera.toml")
    for name in ("a.png", "c.png"):
        tiltvp.write_image(tmp_path / "images" / name, ROOM)
    (tmp_path / "images" / "b.png").write_bytes(b"no image")
    words = ["tilt", str(tmp_path / "images"), "--camera", str(tmp_path / "camera.toml"), *extra, "--out"]
    run, say, events = verb.Work.__call__, verb.say, []
    monkeypatch.setattr(verb.Work, "__call__", lambda *given: (events.append("look"), run(*given))[1])
    monkeypatch.setattr(verb, "say", lambda text: (events.append("say"), say(text))[1])
    assert main([*words, "-"]) == 1
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert events == ["look", "say"] * 3
    assert not Path("-").exists()
    assert main([*words, str(tmp_path / "rows.json")]) == 1
    kept = json.loads((tmp_path / "rows.json").read_text())
    for row in lines + kept:
        del row["time_s"]
    assert lines == kept
    assert [Path(row["file"]).name for row in lines] == ["a.png", "b.png", "c.png"]
    assert lines[1]["error"]


@pytest.mark.parametrize("ending", [".csv", ".json", ".parquet"])
def test_files_have_the_directions_that_may_be_up(ending: str, tmp_path: Path) -> None:
    forward = np.array(ROTATION_WORDS["forward"])
    options = {"method": "segments", "robot_from_camera": forward, "tilt_max_rad": np.pi}
    pinhole = tiltvp.Camera.pinhole(width=320, height=240, fx=190.0, fy=190.0, cx=159.5, cy=119.5)
    seen = tiltvp.synth.render_room(pinhole, seed=1, alpha_rad=0.07, beta_rad=0.5, robot_from_camera=forward).gray
    found = [tiltvp.TiltEstimator(pinhole, **options)(image) for image in (seen, np.zeros_like(seen))]
    assert len(found[0].alternatives) > 1
    rows = [Outcome(Path("a.png"), found[0]), Outcome(Path("b.png"), found[1]), Outcome(Path("c.png"), error="none")]
    path = tmp_path / f"rows{ending}"
    write_table(outcome_table(rows, "segments"), path)
    read = {".csv": pl.read_csv, ".json": pl.read_json, ".parquet": pl.read_parquet}[ending]
    texts = read(path)["alternatives"].to_list()
    kept = [tiltvp._core.TiltAlternative.from_dict(one) for one in json.loads(texts[0])]
    assert kept == found[0].alternatives
    assert texts[1:] == ["[]", None]
    assert "alternatives" not in outcome_table(outcomes(), "refined").types


@pytest.mark.parametrize("ending", [".csv", ".json", ".parquet"])
def test_a_covariance_that_is_not_known_is_null_as_a_whole(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"rows{ending}"
    write_table(outcome_table(outcomes(), "refined"), path)
    read = {".csv": pl.read_csv, ".json": pl.read_json, ".parquet": pl.read_parquet}[ending]
    for name in ("xx", "xy", "yy"):
        assert read(path)[f"covariance_{name}_rad2"].is_null().to_list() == [False, False, True, True]


@pytest.mark.parametrize("ending", [".csv", ".json", ".parquet"])
def test_what_is_no_number_is_null_in_every_format(ending: str, tmp_path: Path) -> None:
    read = {".csv": pl.read_csv, ".json": pl.read_json, ".parquet": pl.read_parquet}[ending]
    columns = {"frame": [0, 1, 2], "error_deg": [1.5, math.nan, None]}
    write_frame(pl.DataFrame(columns), tmp_path / f"frame{ending}")
    table = Table({"frame": "Int64", "error_deg": "Float64"})
    table.add(columns)
    write_table(table, tmp_path / f"table{ending}")
    for name in ("frame", "table"):
        assert read(tmp_path / f"{name}{ending}")["error_deg"].to_list() == [1.5, None, None]
