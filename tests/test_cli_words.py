"""The command line: words that stand for stdin and stdout, names that are no UTF-8, and outputs of one name."""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
from cyclopts import CoercionError, Token

import tiltvp
from commands import Run, verbs
from recordings import START_S, Bag
from tiltvp import _core
from tiltvp.cli.app import app
from tiltvp.streams import Wheels
from tiltvp.synth import RoomImage

pytestmark = pytest.mark.slow


@pytest.fixture
def world(tmp_path: Path, camera: tiltvp.Camera, room: RoomImage) -> Path:
    """camera.toml, and an image whose name is no UTF-8 in the folder images."""
    camera.save(tmp_path / "camera.toml")
    tiltvp.write_image(tmp_path / "a.png", room.gray)
    (tmp_path / "images").mkdir()
    os.rename(tmp_path / "a.png", os.fsencode(tmp_path / "images") + b"/a\xff.png")
    return tmp_path


@pytest.mark.skipif(sys.platform != "linux", reason="names of files that are no text")
@pytest.mark.parametrize("ending", ["csv", "json", "parquet"])
def test_names_that_are_no_text(ending: str, run: Run, world: Path) -> None:
    out = world / f"out.{ending}"
    for verb in ("tilt", "lines", "segments"):
        words = (verb, world / "images", "--camera", world / "camera.toml", "--out", out, "--overwrite")
        assert run(*words, "--overlay", world / verb).code == 0
        read = {"csv": pl.read_csv, "json": pl.read_json, "parquet": pl.read_parquet}[ending]
        assert set(read(out)["file"]) == {f"{world}/images/a\\xff.png"}
        assert os.listdir(os.fsencode(world / verb)) == [b"a\xff.png"]
    assert f"{world}/images/a\\\\xff.png" in run("tilt", *words[1:4], "--out", "-").out


@pytest.mark.parametrize("words", [("bogus", "--x", "-"), ("camera", "--x", "-"), ("tilt", "--x", "-")])
def test_a_dash_of_no_command_is_wrong_use(words: tuple[str, ...], run: Run) -> None:
    said = run(*words)
    assert (said.code, said.err.count("\n")) == (2, 1)


def test_what_is_not_given_is_said_to_be_that(run: Run) -> None:
    assert (
        run("tilt", "images").err
        == 'tiltvp: Command "tilt" parameter --camera is not given. Try `tiltvp tilt --help`.\n'
    )
    assert "--camera requires an argument." in run("tilt", "images", "--camera").err


def test_the_pages_of_commands_tell_no_option_that_is_refused(run: Run) -> None:
    told = set(re.findall(r"--empty-[\w-]+", app.generate_docs()))
    assert (told, run("camera", "new", "x.toml", "--empty-centre").code) == (set(), 2)


@pytest.mark.parametrize("words", [("--version", "-"), ("tilt", "--help", "-")])
def test_help_takes_a_dash(words: tuple[str, ...], run: Run) -> None:
    assert run(*words).code == 0


@pytest.mark.skipif(sys.platform != "linux", reason="names of files that are no text")
@pytest.mark.parametrize("before", [[], ["--overwrite"], ["--camera"], ["--filter"], ["--threads=1"]])
def test_names_come_on_stdin_wherever_the_dash_stands(
    before: list[str], run: Run, world: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = io.BytesIO(os.fsencode(world / "images") + b"/a\xff.png\n")
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=lines))
    camera = ["--camera", str(world / "camera.toml")]
    said = run(
        "tilt", *(camera if before == ["--camera"] else before), "-", *([] if before == ["--camera"] else camera)
    )
    assert (said.code, said.err) == (0, "")
    assert "1 image: lean" in said.out


@pytest.mark.parametrize(
    ("verb", "methods"),
    [
        ("tilt", _core.METHODS),
        ("lines", _core.LINE_METHODS),
        ("track", _core.LINE_METHODS),
        ("corner", _core.CORNER_METHODS),
        ("calibrate", _core.CALIBRATION_METHODS),
    ],
)
def test_help_names_every_method(run: Run, verb: str, methods: list[str]) -> None:
    told = re.findall(r"--(?:line-)?method STR(.*?)(?=--|╰)", run(verb, "--help").out, re.DOTALL)[0]
    assert [method for method in methods if method not in told] == [], told


@pytest.mark.parametrize("verb", ["lines", "segments", "track", "corner"])
def test_only_tilt_writes_on_stdout(verb: str, run: Run, world: Path) -> None:
    calibration = "--calibration" if verb == "corner" else "--camera"
    said = run(verb, world / "images", calibration, world / "camera.toml", "--out", "-")
    assert said.code == 2
    assert "--out -: only `tiltvp tilt` writes lines on stdout" in said.complaint


def test_outputs_of_one_name_are_refused_at_once(run: Run, world: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(world)
    said = run("corner", "none.png", "--calibration", "none", "--out", "x.csv", "--corners", "./x.csv")
    assert said.code == 2
    assert "--out and --corners are both x.csv, expected two files" in said.complaint
    assert "--corners x.txt: ends in" in run("corner", "n.png", "--calibration", "none", "--corners", "x.txt").complaint


def test_cameras_of_a_recording(run: Run, tmp_path: Path) -> None:
    made = Bag("mcap")
    made.camera_info(START_S, 64, 48, "plumb_bob", [0.0] * 5, [50.0, 0, 32, 0, 50, 24, 0, 0, 1])
    bag, out = made.write(tmp_path), tmp_path / "camera.toml"
    said = run("camera", "info", bag)
    assert said.code == 0
    assert "/camera_info" in said.out
    assert "64 x 48 px" in said.out
    assert run("camera", "scale", bag, out, "--factor", "0.5").code == 0
    assert tiltvp.Camera.load(out).width == 32
    missing = run("camera", "info", tmp_path / "none.mcap").complaint
    assert missing == f"tiltvp: {tmp_path}/none.mcap: no such file, expected a bag\n"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            "--tilt-max-deg 400",
            "--tilt-max-deg = 400 degrees, expected an angle above 0 and at most 180, below 90 degrees but",
        ),
        (
            "--elevation-max-deg -1",
            "= -1 degrees, expected an angle above --elevation-min-deg and at most 90 degrees",
        ),
        (
            "--method vector-consensus --correction x",
            "expected none, a number (a factor) or a file of `tiltvp lab train`",
        ),
        ("--camera-format x", ", at --format or --camera-format"),
        ("--gradient-min -1", "tiltvp: --gradient-min = -1, expected a positive gradient magnitude"),
        (
            "--gap-max 3",
            '--gap-max: unknown to method "refined" (it is one of method "segments"), expected one of --grad',
        ),
        ("--gap-max 3", "--tilt-max-deg, --mask, --row-stride, --seed, "),
        (
            "--filter --mounting-prior-deg 1",
            "--mounting-prior-deg: unknown (given without --estimate-mounting), expected",
        ),
        ("--filter --wheel-radius 50", 'Invalid value "50.0" for --wheel-radius. Must be <= 10.'),
        ("--filter --wheel-base 350", 'Invalid value "350.0" for --wheel-base. Must be <= 200.'),
    ],
)
def test_options_are_called_as_they_are_typed(run: Run, world: Path, words: str, told: str) -> None:
    said = run("tilt", world / "images", "--camera", world / "camera.toml", *words.split())
    assert said.code == 2
    assert told in said.complaint


def test_reasons_are_told_by_what_is_typed(run: Run, world: Path) -> None:
    out = world / "tilts.csv"
    said = run("tilt", world / "images", "--camera", world / "camera.toml", "--tilt-max-deg", "1", "--out", out)
    assert "beyond the limit of 1.0 degrees" in " ".join(said.out.split())
    assert "raise --tilt-max-deg" in " ".join(said.out.split())
    assert "raise tilt_max_rad" in out.read_text()


def test_help_says_what_a_word_may_be(run: Run) -> None:
    told = " ".join(run("corner", "--help").out.replace("│", " ").split())
    assert "Expected the letters r, g and b, each once, in any order. Default rgb." in told
    assert "Expected either, upright or upside-down. Default either." in told


def test_a_robot_of_millimetres_is_refused(run: Run, world: Path, camera: tiltvp.Camera) -> None:
    tiltvp.Robot(camera, np.eye(3), wheels=Wheels(wheel_base_m=0.35)).save(world / "robot.toml")
    text = (world / "robot.toml").read_text()
    (world / "robot.toml").write_text(text.replace("0.35", "350.0"))
    said = run("mount", world / "images", "--camera", world / "robot.toml")
    assert said.code == 2
    assert "wheel_base_m = 350.0, expected metres, at most 200" in said.complaint


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("--to same", "--field-of-view-deg: given with --to same, expected it with fisheye or pinhole only"),
        ("--to pinhole", "--field-of-view-deg = 400 degrees, expected an angle in (0, 180) degrees of a pinhole"),
    ],
)
def test_the_view_of_level_images_is_called_as_it_is_typed(run: Run, world: Path, words: str, told: str) -> None:
    files = (world / "images", "--camera", world / "camera.toml", "--out", world / "level")
    assert told in run("level", *files, "--field-of-view-deg", "400", *words.split()).complaint


@pytest.mark.parametrize("verb", sorted(verbs(app)), ids=" ".join)
def test_whole_numbers_are_not_rounded(verb: tuple[str, ...]) -> None:
    """As cyclopts would: 2 threads of 1.5, another seed than was asked for."""
    for one in app.parse_commands(verb)[1][-1].assemble_argument_collection():
        if one.parse and "int" in re.findall(r"\w+", str(one.hint)):
            for place in range(max(1, one.token_count()[0])):
                one.append(Token(keyword=one.name, value="1.5", source="cli", index=place))
            with pytest.raises(CoercionError, match=r'unable to convert "1\.5" into int'):
                one.convert()


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["", "--camera", "c.toml"], "an argument"),
        (["images", "--camera", ""], "--camera"),
        (["images", "--camera", "c.toml", "--topic="], "--topic"),
    ],
)
def test_words_of_variables_that_are_not_set_are_refused(run: Run, words: list[str], named: str) -> None:
    """They were the working folder, and options as if they were not given."""
    said = run("tilt", *words)
    assert (said.code, said.complaint.startswith(f"tiltvp: {named}: an empty word, expected one")) == (2, True)


def test_no_output_takes_the_place_of_the_calibration(run: Run, world: Path) -> None:
    calibration, mask = world / "camera.json", world / "mask.png"
    # Its content tells its format, and an answer may have such a name.
    calibration.write_bytes((world / "camera.toml").read_bytes())
    tiltvp.write_image(mask, np.full((256, 256), 255, np.uint8))
    read = calibration.read_bytes(), mask.read_bytes()
    for verb, option, out in (
        ("tilt", "--out", calibration), ("lines", "--out", calibration), ("segments", "--out", calibration),
        ("track", "--out", calibration), ("track", "--plot", mask), ("mount", "--out", calibration),
    ):  # fmt: skip
        more = ("--out", world / "t.csv") if option == "--plot" else ()
        masked = () if verb == "segments" else ("--mask", mask)
        words = (world / "images", "--camera", calibration, *masked, option, out, *more, "--overwrite")
        assert "is what is read, or holds it, expected another place" in run(verb, *words).complaint
    assert (calibration.read_bytes(), mask.read_bytes()) == read


@pytest.mark.skipif(sys.platform == "win32", reason="streams of POSIX")
@pytest.mark.parametrize("closed", ["1", "2", "0, 1, 2"])
def test_closed_streams_of_a_service_are_no_fault(world: Path, closed: str) -> None:
    out = world / "small.toml"
    words = ["camera", "scale", str(world / "camera.toml"), str(out), "--factor", "0.5"]
    script = "import sys\nfrom tiltvp.cli import main\nsys.exit(main())"
    # What starts another program with its streams closed, as `>&-` does.
    close = f"for k in ({closed},): os.close(k)"
    start = f"import os, sys\n{close}\nos.execv(sys.executable, [sys.executable, *sys.argv[1:]])"
    done = subprocess.run([sys.executable, "-c", start, "-c", script, *words], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert tiltvp.Camera.load(out).width == 128
    # And of what is wrong nothing can be said, but by the code.
    assert subprocess.run([sys.executable, "-c", start, "-c", script, *words], capture_output=True).returncode == 2


def test_images_that_are_none_of_the_camera_s_are_told_by_what_is_wrong_with_the_first(
    run: Run, camera: tiltvp.Camera, tmp_path: Path
) -> None:
    camera.save(tmp_path / "camera.toml")
    for k in range(6):
        tiltvp.write_image(
            tmp_path / "images" / f"{k}.png", np.zeros((camera.height // 2, camera.width // 2), np.uint8)
        )
    got = f"0.png: got {camera.height // 2} x {camera.width // 2} pixels, expected {camera.height} x {camera.width}"
    for words in (("mount",), ("setup", "--out", tmp_path / "robot.toml")):
        said = run(*words, tmp_path / "images", "--camera", tmp_path / "camera.toml")
        assert said.code == 2
        assert got in said.complaint
        assert "`tiltvp camera scale FILE OUT --to" in said.complaint
