"""`tiltvp report` without a browser: which files there are and what is in them, and what is refused."""

from __future__ import annotations

import html.parser
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import polars as pl
import pytest

from tiltvp.cli import main
from tiltvp.errors import OutputError, RunError
from tiltvp.lab.evaluation import curves
from tiltvp.lab.evaluation.runs import Run, read_run
from tiltvp.lab.evaluation.summary import errors
from tiltvp.lab.evaluation.variants import VARIANTS, best_of, best_rows, variant_points
from tiltvp.lab.plots.picture import figure_picture
from tiltvp.lab.plots.report import style
from tiltvp.lab.plots.report.errors import errors_by_environment
from tiltvp.lab.report.choice import choose_examples
from tiltvp.lab.report.contents import OtherRun, contents_of, scaling_of
from tiltvp.lab.report.files import PAGE, write_report
from tiltvp.lab.report.sheets import other_sheet

DPI = 72.0
PICTURES = {f"figure-{number}" for number in (10, 11, 12, 13, 14, 17, 18, 27)}
FIGURES = PICTURES | {f"figure-{number}" for number in (21, 22, 23, 24, 28)} | {"covariance", "abstaining"}
TABLES = {"table-3", "table-4", "table-3-others", "table-q"}


class Seen(html.parser.HTMLParser):
    """The elements of a page that refer to something, and the cells of its tables."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.references: list[str] = []
        self.ids: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("src", "href", "srcset", "data", "action", "poster") and value:
                self.references.append(value)
            if name == "id" and value:
                self.ids.append(value)


def test_every_figure_and_table_is_there(report: Path) -> None:
    stems = {path.stem for path in report.iterdir()} - {Path(PAGE).stem}
    assert FIGURES | TABLES <= stems <= FIGURES | TABLES | {"confidence"}
    for stem in stems:
        picture = cv2.imread(str(report / f"{stem}.png"))
        assert picture is not None, stem
        assert picture.min() < 100 < 255 == picture.max(), stem
        pdf = (report / f"{stem}.pdf").read_bytes()
        assert (pdf[:5], pdf.rstrip()[-5:]) == (b"%PDF-", b"%%EOF"), stem
    assert pl.read_csv(report / "table-3.csv")["mean_deg"].is_not_null().all()


def test_page_needs_nothing_else(report: Path) -> None:
    page = Seen((report / PAGE).read_text(encoding="utf-8"))
    assert all(reference.startswith(("data:", "#")) for reference in page.references)
    assert set(page.ids) >= FIGURES | TABLES


def test_tables_are_in_the_order_of_the_paper(report: Path) -> None:
    for name in ("table-3", "table-4"):
        table = pl.read_csv(report / f"{name}.csv")
        assert table["variant"].to_list() == [variant.name for variant in VARIANTS]
    methods = list(dict.fromkeys(pl.read_csv(report / "table-3-others.csv")["method"]))
    order = ["image-space-ransac", "image-space-reject-refit", "vector-consensus", "refined"]
    assert methods == [method for method in order if method in methods]
    assert tuple(variant.name for variant in VARIANTS) == style.KNOWN


def test_a_run_of_another_version_is_refused(run: Path, tmp_path: Path) -> None:
    """As those were whose covariances had no unit in their names."""
    (tmp_path / "manifest.json").write_bytes((run / "manifest.json").read_bytes())
    table = pl.read_parquet(run / "estimates.parquet").rename({"covariance_xx_rad2": "covariance_xx"})
    table.write_parquet(tmp_path / "estimates.parquet")
    with pytest.raises(RunError, match="no columns covariance_xx_rad2, expected a run of this version"):
        read_run(tmp_path)


def test_a_method_without_a_name_for_people_is_in_the_table(run: Path) -> None:
    """As a new one, or that of another version: its rows were left out."""
    summary = errors(read_run(run).table).with_columns(pl.col("method").replace("refined", "another"))
    assert "another" in other_sheet(summary).cells["method"].to_list()


def test_same_run_gives_the_same_bytes(run: Path, report: Path, tmp_path: Path) -> None:
    again = tmp_path / "again"
    write_report(contents_of(read_run(run)), again, dpi=DPI)
    names = sorted(path.name for path in report.iterdir())
    assert names == sorted(path.name for path in again.iterdir())
    assert [name for name in names if (report / name).read_bytes() != (again / name).read_bytes()] == []


def test_run_without_its_dataset_makes_a_page(run: Path, tmp_path: Path) -> None:
    whole = read_run(run)
    dataset = whole.manifest["dataset"] | {"path": str(tmp_path / "gone")}
    stems = _stems(Run(whole.manifest | {"dataset": dataset}, whole.table))
    assert not stems & PICTURES
    assert stems >= FIGURES - PICTURES
    words = " ".join(
        section.words for section in contents_of(Run(whole.manifest | {"dataset": dataset}, whole.table)).sections
    )
    assert "gone" in words
    assert "figures 10 to 14" in words.lower()


def test_changed_dataset_is_not_shown(run: Path) -> None:
    whole = read_run(run)
    dataset = whole.manifest["dataset"] | {"digest": "0" * 64}
    assert not _stems(Run(whole.manifest | {"dataset": dataset}, whole.table)) & PICTURES


@pytest.mark.parametrize("method", ["refined", "image-space-ransac", "vector-consensus"])
def test_run_of_one_method_makes_a_page(run: Path, method: str) -> None:
    whole = read_run(run)
    stems = _stems(Run(whole.manifest, whole.table.filter(pl.col("method") == method)))
    assert {"figure-21", "figure-22", "figure-23", "figure-24", "figure-28", "table-3", "table-4"} <= stems
    assert not stems & PICTURES


def test_run_on_another_computer_is_figure_25(run: Path) -> None:
    whole = read_run(run)
    slow = Run(whole.manifest, whole.table.with_columns(pl.col("time_edges_s", "time_fit_s") * 10.0))
    contents = contents_of(whole, also=OtherRun(slow, "a slow board"))
    items = {item.stem: item for section in contents.sections for item in section.items}
    assert "figure-25" in items
    assert "a slow board" in items["figure-25"].caption
    assert "a slow board: 95 %" in items["table-4"].cells.columns
    first, second = (items["table-4"].cells[f"{name}: 50 %"].cast(float) for name in ("this computer", "a slow board"))
    assert (second / first).to_list() == pytest.approx([10.0] * 6, rel=0.1)


def test_times_of_another_dataset_are_refused(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = read_run(run)
    dataset = whole.manifest["dataset"] | {"digest": "0" * 64}
    with pytest.raises(RunError, match="different datasets"):
        contents_of(whole, also=OtherRun(Run(whole.manifest | {"dataset": dataset}, whole.table), "a slow board"))
    assert main(["report", str(run), "--out", str(tmp_path / "out"), "--label", "a slow board"]) == 2
    assert "--label a slow board without --also" in capsys.readouterr().err


def test_bad_runs_are_refused(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(tmp_path / "none"), "--out", str(tmp_path / "out")]) == 2
    assert "none" in capsys.readouterr().err
    broken = tmp_path / "broken"
    shutil.copytree(run, broken)
    pl.read_parquet(run / "estimates.parquet").drop("confidence").write_parquet(broken / "estimates.parquet")
    assert main(["report", str(broken), "--out", str(tmp_path / "out")]) == 2
    assert "confidence" in capsys.readouterr().err
    whole = read_run(run)
    with pytest.raises(RunError, match="no estimate"):
        contents_of(Run(whole.manifest, whole.table.clear()))
    assert not (tmp_path / "out").exists()


def test_other_files_are_not_lost(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    assert main(["report", str(run), "--out", str(tmp_path)]) == 2
    assert "other files" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
    (tmp_path / PAGE).write_text("earlier")
    assert main(["report", str(run), "--out", str(tmp_path)]) == 2
    assert "other files (thesis.tex)" in capsys.readouterr().err
    assert len(list(tmp_path.iterdir())) == 2


def test_failing_leaves_the_earlier_report(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / PAGE).write_text("earlier")

    def fail(*_: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tiltvp.lab.report.files.page_of", fail)
    contents = contents_of(read_run(run))
    contents = replace(contents, sections=contents.sections[:1])
    with pytest.raises(OutputError, match="No space"):
        write_report(contents, out, dpi=20.0)
    assert (out / PAGE).read_text() == "earlier"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_page_is_safe_from_names(run: Path) -> None:
    """Names of files and places come from others."""
    from tiltvp.lab.report.page import page_of

    whole = read_run(run)
    evil = "</script><script>alert(1)</script>"
    table = whole.table.filter(pl.col("method") == "refined").with_columns(environment=pl.lit(evil), label=pl.lit(evil))
    contents = contents_of(Run(whole.manifest, table))
    page = page_of(contents, {item.stem: b"" for section in contents.sections for item in section.items})
    assert evil not in page


def test_names_are_no_mathematics(run: Path, tmp_path: Path) -> None:
    """Between two dollars they were set as such, or were none that could be, and there was no report."""
    whole = read_run(run)
    name = r"$\frac{1$"
    table = whole.table.filter(pl.col("method") == "refined").with_columns(environment=pl.lit(name))
    odd = Run(whole.manifest, table)
    contents = contents_of(odd, also=OtherRun(odd, name))
    assert write_report(contents, tmp_path / "out", dpi=20.0).is_file()
    many = pl.DataFrame({"variant": "one", "environment": [f"{k} {name}" for k in range(20)], "mean_deg": 1.0})
    figure_picture(errors_by_environment(many, pl.DataFrame({"variant": ["one"], "mean_deg": [1.0]})))


def test_examples_follow_their_rule(run: Path) -> None:
    whole = read_run(run)
    rows = best_rows(whole.table, errors(whole.table)).filter(pl.col("variant") == "image space, reject-refit")
    examples = choose_examples(rows)
    assert examples is not None
    assert examples.upright.location == examples.leaning.location
    assert examples.upright.alpha_true_rad == 0.0
    own = rows.filter(pl.col("location") == examples.leaning.location)
    forward = (own["alpha_true_rad"] * own["beta_true_rad"].cos()).max()
    assert examples.leaning.alpha_true_rad * np.cos(examples.leaning.beta_true_rad) == forward
    assert rows.sort("error_rad")["file"][-1] == examples.worst.file
    means = rows.drop_nulls("error_rad").group_by("location").agg(pl.col("error_rad").mean()).sort("error_rad")
    assert examples.leaning.location == means["location"][(len(means) - 1) // 2]
    assert len(examples.by_location) == len(means)
    assert choose_examples(rows.with_columns(error_rad=pl.lit(None, pl.Float64))) is None


def test_best_of_each_variant_has_the_least_mean(run: Path) -> None:
    summary = errors(read_run(run).table)
    points = variant_points(summary)
    best = best_of(summary)
    assert points["best"].sum() == best.height == len(VARIANTS)
    least = points.group_by("variant", maintain_order=True).agg(pl.col("mean_deg").min())
    assert least["mean_deg"].to_list() == best["mean_deg"].to_list()
    counts = dict(points.group_by("variant").len().iter_rows())
    assert [counts[variant.name] for variant in VARIANTS] == [36, 30, 60, 60, 1, 1]


def _rows(error_rad: np.ndarray, confidence: np.ndarray | None = None, **columns: object) -> pl.DataFrame:
    n = len(error_rad)
    plain = {
        "yaw_rad": np.zeros(n),
        "covariance_xx_rad2": np.ones(n),
        "covariance_xy_rad2": np.zeros(n),
        "covariance_yy_rad2": np.ones(n),
    }
    known = {"variant": ["one"] * n, "image": np.arange(n), "error_rad": error_rad}
    known |= {"confidence": np.ones(n) if confidence is None else confidence}
    return pl.DataFrame(known | plain | columns)


def test_regions_of_a_true_covariance_hold_what_they_promise() -> None:
    """Turned errors with the covariance they were drawn with: at 4000 draws, within 2.5 points in all but 1 in 1000."""
    generator = np.random.default_rng(1)
    covariance = np.array([[4e-4, 1e-4], [1e-4, 1e-4]])
    drawn = generator.multivariate_normal([0.0, 0.0], covariance, 4000)
    yaw = generator.uniform(-np.pi, np.pi, 4000)
    x = np.cos(yaw) * drawn[:, 0] - np.sin(yaw) * drawn[:, 1]
    y = np.sin(yaw) * drawn[:, 0] + np.cos(yaw) * drawn[:, 1]
    entries = {
        "covariance_xx_rad2": np.full(4000, 4e-4),
        "covariance_xy_rad2": np.full(4000, 1e-4),
        "covariance_yy_rad2": np.full(4000, 1e-4),
    }
    rows = _rows(np.hypot(x, y), offset_x_rad=x, offset_y_rad=y, yaw_rad=yaw, **entries)
    shares = curves.region_shares(rows, np.array([0.5, 0.9, 0.95]))["share"].to_numpy()
    assert shares == pytest.approx([0.5, 0.9, 0.95], abs=0.025)


@pytest.mark.parametrize(
    ("confidence", "area"), [([0.9, 0.8, 0.2, 0.1], 1.0), ([0.1, 0.2, 0.8, 0.9], 0.0), ([0.5] * 4, 0.5)]
)
def test_area_tells_how_well_confidence_finds_failures(confidence: list[float], area: float) -> None:
    rows = _rows(np.array([0.001, 0.002, 0.1, 0.2]), np.array(confidence))
    found = curves.alarm_curves(rows)
    assert found["found"][-1] == found["false_alarms"][-1] == 1.0
    assert curves.alarm_areas(found)["area"].to_list() == [pytest.approx(area)]
    assert curves.alarm_curves(rows.with_columns(error_rad=pl.lit(0.001))).is_empty()


def test_rejecting_the_least_confident_lowers_the_error() -> None:
    error = np.linspace(0.0, 0.1, 50)
    table = curves.rejection_curves(_rows(error, 1.0 - error))
    assert table["mean_deg"].is_sorted(descending=True)
    assert table["mean_deg"][50] == pytest.approx(np.degrees(error[:25].mean()))


@pytest.mark.parametrize("count", [5, 400])
def test_tilts_come_in_few_classes(count: int) -> None:
    tilts = np.linspace(0.0, 0.1, count)
    rows = _rows(tilts, alpha_true_rad=tilts)
    table = curves.errors_by_tilt(rows)
    assert table.height == (5 if count == 5 else 12)
    assert table["images"].sum() == count
    assert table["mean_deg"].to_list() == pytest.approx(table["alpha_true_deg"].to_list(), abs=0.01)
    # The mean is that of as many images as are told.
    unknown = rows.with_columns(pl.when(pl.col("image") > 1).then(pl.col("error_rad")))
    assert curves.errors_by_tilt(unknown)["images"].sum() == count - 2


def test_cost_is_on_the_page_if_the_run_has_it(run: Path, tmp_path: Path) -> None:
    whole = read_run(run)
    assert not {"cost"} & _stems(whole)
    table = pl.DataFrame(
        {"over": ["images", "images", "pixels", "pixels"], "images": [7, 14, 7, 7],
         "megapixels": [0.3, 0.3, 0.3, 0.6], "seconds": [1.0, 2.0, 1.0, 1.9]}
    )  # fmt: skip
    items = {item.stem: item for section in contents_of(whole, scaling=table).sections for item in section.items}
    assert [len(axes.lines) for axes in items["cost"].figure.axes] == [2, 2]
    copy = tmp_path / "run"
    shutil.copytree(run, copy)
    for name, write in (("scaling.csv", table.write_csv), ("scaling.parquet", table.write_parquet)):
        write(copy / name)
        found = scaling_of(copy)
        assert found is not None
        assert found.equals(table)
        (copy / name).unlink()
    (copy / "scaling.csv").write_text("over,images\nimages,7\n")
    with pytest.raises(RunError, match=r"scaling\.csv.*megapixels"):
        scaling_of(copy)


@pytest.mark.parametrize("count", [3, 40])
def test_environments_are_all_named(count: int) -> None:
    rows = [(variant, f"room {i:02d}", 1.0 + 0.01 * i) for variant in style.KNOWN for i in range(count)]
    table = pl.DataFrame(rows, schema=["variant", "environment", "mean_deg"], orient="row")
    overall = table.group_by("variant", maintain_order=True).agg(pl.col("mean_deg").mean())
    (axes,) = errors_by_environment(table, overall).axes
    ticks = axes.get_xticklabels() if count == 3 else axes.get_yticklabels()
    assert [tick.get_text() for tick in ticks] == [f"room {i:02d}" for i in range(count)]


def _stems(run: Run) -> set[str]:
    return {item.stem for section in contents_of(run).sections for item in section.items}
