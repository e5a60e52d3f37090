"""The tilt over time: the filter in Python, odometry files, the command line, and the picture of a drive."""

from __future__ import annotations

import copy
import math
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

import tiltvp
from recordings import motions_of
from tiltvp.cli import main
from tiltvp.cli.filtering import FilterOptions
from tiltvp.cli.results import Outcome
from tiltvp.errors import InvalidInputError
from tiltvp.lab.plots.filtering import filtered_tilt
from tiltvp.lab.plots.picture import figure_picture
from tiltvp.streams import FrameMotions, Frames, Motion
from tiltvp.synth import RoomImage

Array = np.ndarray
SIGMA_RAD = math.radians(0.5)
COVARIANCE = np.eye(2) * SIGMA_RAD**2
UP = np.array([0.0, 0.0, 1.0])


def lean(alpha_deg: float, beta_rad: float = 0.0) -> Array:
    return tiltvp.normal_from_alpha_beta(math.radians(alpha_deg), beta_rad)


def roll_pitch_of(normal: Array) -> tuple[float, float]:
    return math.atan2(normal[1], normal[2]), math.atan2(-normal[0], math.hypot(normal[1], normal[2]))


def drive(images: int = 160, seed: int = 1) -> pl.DataFrame:
    """A drive over a floor that tilts, with a turn, a threshold, three bad images and a stretch of white noise.

    The table of the figure: estimates, what the filter makes of them, and the truth.
    """
    rng = np.random.default_rng(seed)
    filter_ = tiltvp.TiltFilter()
    floor, scene = lean(1.5, 0.4), rng.normal(scale=SIGMA_RAD * math.sqrt(0.9), size=2)
    rows: list[dict[str, Any]] = []
    for i in range(images):
        yaw, distance = (0.1 if 30 <= i < 62 else 0.0), 0.05
        if i == 100:
            floor = lean(4.0, -1.0)
        turn = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
        floor = np.append(turn @ floor[:2] + rng.normal(scale=0.01 * math.sqrt(distance), size=2), 1.0)
        floor /= np.linalg.norm(floor)
        keep = math.exp(-distance / 2.0)
        scene = keep * turn @ scene + rng.normal(scale=SIGMA_RAD * math.sqrt(0.9 * (1.0 - keep**2)), size=2)
        error = scene + rng.normal(scale=SIGMA_RAD * math.sqrt(0.1), size=2)
        seen = floor + np.append(error, 0.0) if i not in (20, 70, 71) else lean(6.0, float(i))
        covariance = COVARIANCE if not 80 <= i < 90 else np.eye(2) * math.radians(6.0) ** 2
        if 80 <= i < 90:
            seen = lean(rng.uniform(0.0, 12.0), rng.uniform(-3.0, 3.0))
        step = filter_.step((seen, covariance), yaw_rad=yaw, distance_m=distance)
        now = filter_.estimate
        row: dict[str, Any] = {"accepted": step.accepted, "verdict": step.verdict, "nis": step.nis}
        row |= {f"normal_{axis}": value for axis, value in zip("xyz", floor.tolist(), strict=True)}
        row |= dict(zip(("roll_rad", "pitch_rad"), roll_pitch_of(seen), strict=True))
        row |= dict(zip(("roll_true_rad", "pitch_true_rad"), roll_pitch_of(floor), strict=True))
        row |= {"sigma_rad": math.sqrt(covariance[0, 0]), "filtered_sigma_rad": now.sigma_rad}
        row |= {"filtered_roll_rad": now.roll_rad, "filtered_pitch_rad": now.pitch_rad}
        row["error_rad"] = tiltvp.tilt_error_rad(now.normal, floor) if now else None
        row["image_error_rad"] = tiltvp.tilt_error_rad(seen, floor)
        rows.append(row)
    return pl.DataFrame(rows, infer_schema_length=None)


@pytest.fixture(scope="module")
def driven() -> pl.DataFrame:
    return drive()


def test_a_drive_is_followed(driven: pl.DataFrame) -> None:
    verdicts = driven["verdict"].to_list()
    assert [i for i, verdict in enumerate(verdicts) if verdict == "outside-gate"] == [20, 70, 71, 100, 101]
    assert [i for i, verdict in enumerate(verdicts) if verdict == "low-confidence"] == list(range(80, 90))
    assert [i for i, verdict in enumerate(verdicts) if verdict == "jumped"] == [102]
    settled = driven.with_row_index("i").filter(~pl.col("i").is_in([100, 101]))
    assert settled["error_rad"].null_count() == 0
    assert np.degrees(settled["error_rad"].max()) < 1.6
    fused = settled.filter("accepted")
    assert fused["error_rad"].mean() < fused["image_error_rad"].mean()


def test_the_picture_of_a_drive(driven: pl.DataFrame) -> None:
    figure = filtered_tilt(driven)
    upper, lower = figure.axes
    assert upper.get_ylabel() == "roll (degrees)"
    assert lower.get_ylabel() == "pitch (degrees)"
    words = {text.get_text() for text in figure.legends[0].get_texts()}
    assert words == {"image, 2 sigma", "image left out", "filtered, 2 sigma", "true"}
    left_out = next(line for line in upper.get_lines() if line.get_label() == "image left out")
    assert len(left_out.get_xdata()) == (~driven["accepted"]).sum()
    picture = figure_picture(figure, dpi=60.0)
    assert picture.std() > 10.0
    bare = filtered_tilt(driven.drop("roll_true_rad", "pitch_true_rad").head(1))
    assert figure_picture(bare, dpi=40.0).size
    blue = next(each for each in bare.axes[0].containers if each[0].get_color() == "tab:blue")
    assert blue[0].get_ydata() == pytest.approx(np.degrees(driven["filtered_roll_rad"].to_numpy()[:1]))
    assert all(float(tick).is_integer() for tick in bare.axes[1].get_xticks())


def test_values_may_be_kept_compared_and_pickled() -> None:
    filter_ = tiltvp.TiltFilter(estimate_mounting=True, jump_after=4)
    abstaining = filter_.estimate
    for yaw in (0.0, 0.3, 0.7):
        step = filter_.step((lean(1.0), COVARIANCE), yaw_rad=yaw, distance_m=0.2)
    refused = filter_.update((lean(9.0), COVARIANCE))
    assert refused.verdict == "outside-gate"
    assert not refused
    for value in (filter_.estimate, abstaining, filter_.mounting, step, refused):
        assert pickle.loads(pickle.dumps(value)) == value == copy.copy(value) == copy.deepcopy(value)
        assert type(value).from_dict(value.to_dict()) == value
        assert hash(pickle.loads(pickle.dumps(value))) == hash(value)
    assert step != refused
    assert abstaining != filter_.estimate
    with pytest.raises(InvalidInputError, match="alpha_rad"):
        tiltvp.FilteredTilt.from_dict(filter_.estimate.to_dict() | {"alpha_rad": 1.0})
    twins = [pickle.loads(pickle.dumps(filter_)), copy.copy(filter_), copy.deepcopy(filter_)]
    for twin in twins:
        assert twin == filter_
        assert twin.rejected == 1
        twin.predict(0.1, 0.1)
        assert twin != filter_
    assert tiltvp.TiltFilter(**filter_.options).options == filter_.options
    assert "jump_after=4" in repr(filter_)
    filter_.reset()
    assert filter_ == tiltvp.TiltFilter(estimate_mounting=True, jump_after=4)


def test_abstaining_is_an_answer() -> None:
    filter_ = tiltvp.TiltFilter()
    before = filter_.estimate
    assert not before
    assert np.isnan([before.alpha_rad, before.beta_rad, before.roll_rad, before.pitch_rad]).all()
    assert np.isnan(before.normal).all()
    assert np.isfinite(before.covariance_rad2).all()
    assert "beyond the limit" in before.reason
    assert filter_.mounting is None
    assert filter_.update((5.0 * lean(2.0, 0.3), COVARIANCE))
    after = filter_.estimate
    assert after
    assert after.alpha_rad == pytest.approx(math.radians(2.0), rel=0.01)
    assert after.normal == pytest.approx(filter_.floor.normal)
    assert after.confidence > 0.95
    assert after.sigma_rad == pytest.approx(math.sqrt(np.trace(after.covariance_rad2) / 2.0))
    assert not tiltvp.TiltFilter(sigma_max_rad=1e-6).estimate


def test_estimates_of_images_are_fused(camera: tiltvp.Camera, room: RoomImage) -> None:
    estimator = tiltvp.TiltEstimator(camera)
    estimate = estimator(room.gray)
    noise = np.random.default_rng(0).integers(0, 255, room.gray.shape, dtype=np.uint8)
    filter_ = tiltvp.TiltFilter()
    for image in (room.gray, room.gray):
        assert filter_.step(estimator(image))
    known = filter_.estimate
    assert tiltvp.tilt_error_rad(known.normal, estimate.normal) < math.radians(0.05)
    assert filter_.update(estimator(np.zeros_like(noise))).verdict == "no-tilt"
    assert filter_.estimate == known
    assert filter_.update(estimator(noise)).verdict in ("no-tilt", "low-confidence", "outside-gate")
    assert filter_.estimate == known
    level = tiltvp.level(room.gray, estimator, known)
    assert level.shape == room.gray.shape
    with pytest.raises(InvalidInputError, match="without a tilt"):
        tiltvp.level(room.gray, estimator, tiltvp.TiltFilter().estimate)


def test_turning_moves_the_floor_but_not_the_mounting() -> None:
    filter_ = tiltvp.TiltFilter(walk_rad_per_sqrt_step=0.0)
    filter_.update((lean(2.0, 0.0), COVARIANCE))
    filter_.predict(yaw_rad=math.pi / 2)
    # The slope that was ahead is to the right after a turn to the left.
    assert filter_.estimate.beta_rad == pytest.approx(-math.pi / 2)
    fixed = tiltvp.TiltFilter(estimate_mounting=True)
    for i in range(200):
        seen = lean(1.0, 0.5) + lean(2.0, -0.1 * i) - UP
        fixed.step((seen, COVARIANCE), yaw_rad=0.1, distance_m=0.1)
    assert tiltvp.tilt_error_rad(fixed.mounting.normal, lean(1.0, 0.5)) < math.radians(0.2)
    assert fixed.floor.alpha_rad == pytest.approx(math.radians(2.0), abs=math.radians(0.4))


@pytest.mark.parametrize(
    ("estimate", "words"),
    [
        (None, "expected a TiltEstimate or a tuple"),
        (UP, "expected a TiltEstimate or a tuple"),
        ((UP,), "expected a TiltEstimate or a tuple"),
        ((UP, np.eye(3)), "covariance_rad2"),
        ((UP, -COVARIANCE), "covariance_rad2"),
        ((UP, np.full((2, 2), math.inf)), "covariance_rad2"),
        ((UP, [[1.0, 0.5], [0.0, 1.0]]), "covariance_rad2"),
        (([0.0, 0.0, 0.0], COVARIANCE), "normal"),
        (([0.0, math.nan, 1.0], COVARIANCE), "normal"),
        ((np.eye(3), COVARIANCE), "normal"),
        (("up", COVARIANCE), "normal"),
    ],
)
def test_wrong_estimates_are_refused(estimate: Any, words: str) -> None:
    filter_ = tiltvp.TiltFilter()
    filter_.update((UP, COVARIANCE))
    before = copy.copy(filter_)
    with pytest.raises(InvalidInputError, match=words):
        filter_.update(estimate)
    with pytest.raises(InvalidInputError, match=words):
        filter_.step(estimate, yaw_rad=1.0, distance_m=1.0)
    assert filter_ == before


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"gate_probability": 1.0}, "gate_probability"),
        ({"confidence_min": -0.1}, "confidence_min"),
        ({"jump_after": 0}, "jump_after"),
        ({"jump_after": 2.5}, "jump_after"),
        ({"lost_after": -1}, "lost_after"),
        ({"correlated_share": 1.0}, "correlated_share"),
        ({"prior_rad": "wide"}, "prior_rad"),
        ({"sigma_max_rad": math.nan}, "sigma_max_rad"),
        ({"mounting_prior_rad": 0.1}, "estimate_mounting=True"),
        ({"estimate_mounting": True, "mounting_prior_rad": 0.0}, "mounting_prior_rad"),
    ],
)
def test_wrong_options_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidInputError, match=words):
        tiltvp.TiltFilter(**options)


@pytest.mark.parametrize("turns_known", [False, True])
def test_time_without_images_makes_the_tilt_unknown(turns_known: bool) -> None:
    """Where turns are: after ten seconds two images were outside the gate, and answers 6 degrees off, 0.5 stated."""
    frames, motion = Frames(), Motion()
    frames.times_s = np.array([*np.arange(50) / 25.0, 12.0])
    moved = FrameMotions([motion] * 51, turns_known=turns_known, times_s=None)
    judge = FilterOptions(filter=True).following(frames, moved, None).judge()
    for number, time_s in enumerate(frames.times_s):
        seen: Any = (lean(3.0, 0.0 if number < 50 else math.pi), COVARIANCE)
        found = judge(Outcome(Path(), seen, taken_s=float(time_s)), motion)
    assert found.filtered is not None
    assert found.accepted is not turns_known
    error = tiltvp.tilt_error_rad(found.filtered.normal, lean(3.0, 0.0 if turns_known else math.pi))
    assert error < SIGMA_RAD


def test_wrong_motions_are_refused() -> None:
    filter_ = tiltvp.TiltFilter()
    before = copy.copy(filter_)
    for motion in ({"yaw_rad": math.nan}, {"distance_m": math.inf}, {"distance_m": "far"}):
        with pytest.raises(InvalidInputError, match=next(iter(motion))):
            filter_.predict(**motion)
        with pytest.raises(InvalidInputError, match=next(iter(motion))):
            filter_.step((UP, COVARIANCE), **motion)
    assert filter_ == before


# --- odometry files ----------------------------------------------------------------------------------------------

FILES = [Path("drive/a.png"), Path("drive/b.png"), Path("other/b.png")]


def test_odometry_by_row_and_by_file(tmp_path: Path) -> None:
    path = tmp_path / "odometry.csv"
    path.write_text("yaw_deg,distance_m\n0,0\n90,0.5\n\n-90, 0.25\n")
    expected = [Motion(), Motion(math.pi / 2, 0.5), Motion(-math.pi / 2, 0.25)]
    assert motions_of(path, FILES) == expected
    path.write_text("distance_m,file,yaw_rad\n0.25,other/b.png,-1\n0,a.png,0\n0.5,drive/b.png,1\n")
    assert motions_of(path, FILES) == [Motion(), Motion(1.0, 0.5), Motion(-1.0, 0.25)]
    path.write_text("distance_m\n1\n2\n3\n")
    assert motions_of(path, FILES) == [Motion(0.0, 1.0), Motion(0.0, 2.0), Motion(0.0, 3.0)]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "line 1: no motion"),
        ("file\n", "line 1: no motion"),
        ("yaw_rad,speed\n", "line 1: unknown column 'speed'"),
        ("yaw_rad,yaw_rad\n", "line 1: column 'yaw_rad' twice"),
        ("yaw_rad,yaw_deg\n", "line 1: columns yaw_rad and yaw_deg"),
        ("yaw_rad\n1\n2\n", "2 rows, expected 3"),
        ("yaw_rad\n1\nleft\n2\n", "line 3: yaw_rad = 'left'"),
        ("yaw_rad\n1\n2\nnan\n", "line 4: yaw_rad = 'nan'"),
        ("yaw_rad,distance_m\n1,2\n1\n", "line 3: 1 cells, expected 2"),
        ("file,yaw_rad\na.png,0\nc.png,0\n", "line 3: file 'c.png' is no image given"),
        ("file,yaw_rad\nb.png,0\n", "line 2: file 'b.png' is the name of 2 images"),
        ("file,yaw_rad\na.png,0\na.png,0\n", "line 3: file 'a.png' again"),
        ("file,yaw_rad\na.png,0\n", "no row for drive/b.png"),
    ],
)
def test_wrong_odometry_is_refused(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "odometry.csv"
    path.write_text(text)
    with pytest.raises(InvalidInputError) as caught:
        motions_of(path, FILES)
    assert words in str(caught.value)
    assert str(path) in str(caught.value)


def test_odometry_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="cannot be read"):
        motions_of(tmp_path / "none.csv", FILES)
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InvalidInputError, match="not UTF-8"):
        motions_of(tmp_path / "binary.csv", FILES)


# --- the command -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, camera: tiltvp.Camera, room: RoomImage) -> Path:
    """Six images of turns to the left on the spot, by a quarter each: the fourth blank, the fifth no image."""
    folder = tmp_path_factory.mktemp("drive")
    camera.save(folder / "camera.toml")
    rows = ["file,yaw_deg,distance_m"]
    for i in range(6):
        gray = np.rot90(room.gray, i) if i != 3 else np.zeros_like(room.gray)
        tiltvp.write_image(folder / "images" / f"{i}.png", np.ascontiguousarray(gray))
        rows.append(f"{i}.png,{90.0 if i else 0.0},0.02")
    (folder / "images" / "4.png").write_bytes(b"no image")
    (folder / "odometry.csv").write_text("\n".join(rows))
    return folder


def run(folder: Path, *words: object) -> int:
    return main(["tilt", str(folder / "images"), "--camera", str(folder / "camera.toml"), *map(str, words)])


def test_the_command_filters(folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out, plot = tmp_path / "out.csv", tmp_path / "plots" / "plot.png"
    code = run(folder, "--filter", "--odometry", folder / "odometry.csv", "--out", out, "--filter-plot", plot)
    said = capfd.readouterr()
    assert code == 1
    assert "4.png" in said.err
    assert "filtered roll deg" in said.out
    assert "no-tilt" in said.out
    table = pl.read_csv(out)
    assert table["verdict"].to_list() == ["accepted"] * 3 + ["no-tilt", "no-image", "accepted"]
    assert table["accepted"].to_list() == [True, True, True, False, False, True]
    assert table["filtered_alpha_rad"].null_count() == 0
    assert table["nis"].null_count() == 2
    for i, row in enumerate(table.iter_rows(named=True)):
        normal = [row[f"filtered_normal_{axis}"] for axis in "xyz"]
        truth = tiltvp.normal_from_alpha_beta(0.06, 0.8 - math.pi / 2 * i)
        assert tiltvp.tilt_error_rad(normal, truth) < math.radians(1.0), i
    assert tiltvp.read_image(plot).std() > 10.0
    still = tmp_path / "still.csv"
    run(folder, "--filter", "--estimate-mounting", "--out", still)
    capfd.readouterr()
    told = pl.read_csv(still)
    own = [name for name in told.columns if name.startswith("mounting_")]
    assert [name for name in told.columns if name not in own] == table.columns
    # A robot that has not turned does not know its own lean, and says no angle.
    assert told["mounting_alpha_rad"].null_count() == len(told)
    assert told["mounting_sigma_rad"].min() > 0.0


def test_the_command_abstains(folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    plain, marked, none = (tmp_path / f"{name}.csv" for name in ("plain", "marked", "none"))
    run(folder, "--out", plain)
    run(folder, "--confidence-min", 0.01, "--out", marked)
    assert run(folder, "--confidence-min", 1.0, "--out", none, "--level", tmp_path / "level") == 1
    assert "low-confidence" in capfd.readouterr().out
    before, table = pl.read_csv(plain), pl.read_csv(marked)
    assert [name for name in table.columns if name not in before.columns] == ["accepted", "verdict", "verdict_reason"]
    assert table.drop("time_s").select(before.drop("time_s").columns).equals(before.drop("time_s"))
    assert table["accepted"].to_list() == [True, True, True, False, False, True]
    refused = pl.read_csv(none)
    assert refused["accepted"].to_list() == [False] * 6
    assert refused["alpha_rad"].null_count() == 2
    assert "at least 1.000 expected" in refused["verdict_reason"][0]
    assert not (tmp_path / "level").exists()


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["--odometry", "odometry.csv"], "--odometry without --filter"),
        (["--estimate-mounting"], "--estimate-mounting without --filter"),
        (["--filter-plot", "x.png"], "--filter-plot without --filter"),
        (["--filter", "--filter-plot", "x.txt"], ".png"),
        (["--confidence-min", "1.5"], "--confidence-min = 1.5, expected"),
        (["--filter", "--odometry", "none.csv"], "none.csv"),
    ],
)
def test_wrong_use_is_one_line(folder: Path, capfd: pytest.CaptureFixture[str], words: list[str], hint: str) -> None:
    assert run(folder, *words) == 2
    said = capfd.readouterr().err
    assert said.count("\n") == 1
    assert hint in said
