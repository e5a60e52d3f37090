"""What is said of plausible mistakes, in one line and by the names that are typed."""

from __future__ import annotations

import io
import itertools
import re
import subprocess
import sys
from pathlib import Path
from threading import Event
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from cyclopts.validators import Number

import tiltvp
from command_inputs import write_drive_log
from commands import Run, verbs
from tiltvp.cli.app import app
from tiltvp.lab.datasets.new import in_order


@pytest.fixture
def folder(camera: tiltvp.Camera, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """camera.toml, and the log of a drive, in the working folder."""
    camera.save(tmp_path / "camera.toml")
    write_drive_log(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("tilt x.png --camera camera.toml --margin-px 500",
         "--elevation-min-deg, --elevation-max-deg = 0, 45 degrees, expected a band that some "
         "pixel of the camera sees: check --robot-from-camera, the mask and the margin"),
        ("tilt x.png --camera camera.toml --image-size 640x480",
         "camera.toml: the image is 256x256, expected the 640x480 of --image-size, at camera[0]"),
        ("tilt x.png --camera camera.toml --robot-from-camera down",
         "--robot-from-camera 'down' is no file and no word, expected a file with a rotation, or one of up, forward"),
        ("tilt x.png --camera camera.toml --camera-format kalibr",
         "camera.toml: no keys to read (a str at the top), expected named values, at the top (read as kalibr, and it "
         "is of tiltvp)"),
        ("corner x.png --calibration camera.toml --gamma 1.57",
         "--gamma = 1.57 degrees, expected an angle from 5.73 to 171.9 degrees"),
        ("corner x.png --calibration camera.toml --faces red,green",
         "--faces = 'red,green', expected the letters r, g and b, each once, in any order"),
        ("camera scale camera.toml out.toml --to 0x0", "--to '0x0', expected WIDTHxHEIGHT in pixels, such as 640x480"),
        ("calibrate bearings.csv wheels.csv --wheel-base 0.4",
         "bearings.csv, line 1: no column 'delta_left_m', expected step, time_s, delta_left_m, delta_right_m"),
        ("calibrate wheels.csv bearings.csv --wheel-base 0.4 --start 0 0 90",
         "--start: a yaw of 90 radians, expected at most pi; 90 degrees are 1.571"),
        ("calibrate wheels.csv bearings.csv --wheel-base 0.4 --start-sigma 0.3 0.3 30",
         "--start-sigma: a yaw of 30 radians, expected at most pi; 30 degrees are 0.5236"),
        ("calibrate wheels.csv bearings.csv --wheel-base 0.4 --read-as degree",
         "--read-as 'degree' (did you mean degrees?), expected one of wheels-swapped, wheels-negated, "
         "left-wheel-negated, right-wheel-negated, clockwise, degrees, millimetres, cumulative"),
        ("dataset drive --out d --legs 2.3", "--legs '2.3', expected METRES,DEGREES"),
        ("demo --alpha-deg 400", 'Invalid value "400.0" for --alpha-deg. Must be <= 180. Try `tiltvp demo --help`.'),
        ("tilt x.png --camera camera.toml --local-optimization word",
         'Invalid value "word" for --local-optimization. Expected --local-optimization alone. Try `tiltvp tilt '
         "--help`."),
        ("track x.png --camera camera.toml --out t.csv --rerun camera.toml",
         '"camera.toml": nothing takes it, expected no further argument. Try `tiltvp track --help`.'),
        ("track x.png --camera camera.toml --out t.csv --video v.mp4 --frame-rate 1e9",
         'Invalid value "1000000000.0" for --frame-rate. Must be <= 1000. Try `tiltvp track --help`.'),
        ("track - --raw 640x481 --camera camera.toml --out t.csv",
         "--raw 640x481: got 481 x 640 pixels, expected 256 x 256 (rows x columns), as the camera's images: they "
         "show more than the calibration does, expected that of the whole image"),
        ("tilt x.png --camera camera.toml --local-optimization=word",
         'Invalid value "word" for --local-optimization. Must be true or false. Try `tiltvp tilt --help`.'),
        ("tilt x.png --camera camera.toml --seed 1.5",
         'Invalid value "1.5" for --seed. Must be a whole number. Try `tiltvp tilt --help`.'),
        ("tilt x.png --camera camera.toml --margin-px wide",
         'Invalid value "wide" for --margin-px. Must be a number. Try `tiltvp tilt --help`.'),
        ("camera info camera.toml more words",
         '"more" and 1 more: nothing takes it, expected no further argument. Try `tiltvp camera info --help`.'),
        ("dataset synth --out d --resolution-scale 1e9",
         "--resolution-scale: got 1000000000, expected a positive factor that leaves from 1 to 100000 pixels a side"),
        ("camera scale camera.toml out.toml --factor 1e300",
         "--factor: got 1e300, expected a positive factor that leaves from 1 to 100000 pixels a side"),
        ("dataset drive --out d --bumps-deg 90", "--bumps-deg = 90 degrees, expected in [0, 28.65] degrees"),
        ("calibrate wheels.csv bearings.csv --wheel-base 0.4 --start 0 0 3.2",
         "--start: a yaw of 3.2 radians, expected at most pi; 3.2 degrees are 0.05585"),
        ("dataset panoramas --out d --height 0", "--height: got 0, expected pixels in [1, 8192]"),
        ("lab drive --out d.mcap --floor-slope-deg -1 0",
         'Invalid value "(-1.0, 0.0)" for --floor-slope-deg. Must be a slope from 0 to 28 and a finite direction. Try '
         "`tiltvp lab drive --help`."),
        ("measure scaling --scales 1e9",
         'Invalid value "(1000000000.0,)" for --scales. Must be <= 100. Try `tiltvp measure scaling --help`.'),
        ("measure colmap --kinds --seed 3", "--kinds: no word follows, expected one or more"),
        ("calibrate wheels.csv bearings.csv --wheel-base 0.4 --read-as",
         "--read-as: no word follows, expected one or more"),
        ("measure sampling --every 3", "--every 3 without a folder of panoramas, expected both"),
        ("measure striding --every 3", "--every 3 without a folder of panoramas, expected both"),
        ("measure corner-attitudes --every 3", "--every 3 without a folder of panoramas, expected both"),
        ("measure sampling . --rooms 0 --kind office", "--kind office with --rooms 0, expected rooms"),
        ("measure calibration-images --leans-deg nan",
         'Invalid value "(nan,)" for --leans-deg. Must be <= 28. Try `tiltvp measure calibration-images --help`.'),
        ("measure views . --prior-deg nan",
         'Invalid value "nan" for --prior-deg. Must be <= 180. Try `tiltvp measure views --help`.'),
        ("dataset synth --out d --rooms 99999999999999999999",
         'Invalid value "99999999999999999999" for --rooms. Must be <= 1000000. Try `tiltvp dataset synth --help`.'),
        ("measure corners --poses 0 --frames 0 --noisy-poses 9223372036854775808",
         'Invalid value "9223372036854775808" for --noisy-poses. Must be <= 1000000. Try `tiltvp measure corners '
         "--help`."),
        ("demo --seed 18446744073709551616",
         'Invalid value "18446744073709551616" for --seed. Must be <= 18446744073709551615. Try `tiltvp demo --help`.'),
        ("tilt x.png --camera camera.toml --threads 1000000",
         'Invalid value "1000000" for --threads. Must be <= 1024. Try `tiltvp tilt --help`.'),
        ("demo --page p.html --out d", "--out d beside --page p.html, expected one of them"),
    ],
)  # fmt: skip
def test_it_is_told(run: Run, folder: Path, words: str, told: str) -> None:
    before = set(folder.iterdir())
    said = run(*words.split())
    assert (said.code, said.out) == (2, "")
    assert said.complaint == f"tiltvp: {told}\n"
    assert set(folder.iterdir()) == before


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("dataset drive --out .", ".: exists, expected a new folder, or --overwrite to replace a dataset"),
        ("dataset drive --out d --frames 0", "--frames = 0, expected a number in [1, 100000]"),
        ("dataset drive --out d --frames 9 --legs 1,0",
         "--frames beside --legs, which have as many as they need, expected one of them"),
        ("dataset drive --out d --legs round",
         '--legs: got "round", expected one of paper, alternating, straight, rotation, arcs'),
        ("dataset drive --out d --camera no.toml", "no.toml: no such file, expected a calibration file, at this path"),
        ("dataset stereo --out .", ".: exists, expected a new folder, or --overwrite to replace a dataset"),
        ("dataset stereo --out d --samples 99", "--samples = 99, expected rays per pixel side in [1, 8]"),
        ("dataset stereo --out d --distance 3 1",
         "--distance = 3, expected least and greatest metres, ascending, in [0.3, 20]"),
        ("lab drive --out d.mcap --encoder-k-m -1", "--encoder-k-m = -1, expected metres in [0, 0.1]"),
        ("lab drive --out d.mcap --mount 0 0 90 9", "--mount = 9, expected a height_m of metres in [0.05, 2.2]"),
    ],
)  # fmt: skip
def test_it_is_told_before_a_room_is_built(
    run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch, words: str, told: str
) -> None:
    """Which takes seconds."""
    for name in ("tiltvp.synth.Laboratory", "tiltvp.synth.Room", "tiltvp.lab.datasets.driving.Room"):
        monkeypatch.setattr(name, lambda *_, **__: pytest.fail("a room is built"))
    before = set(folder.iterdir())
    said = run(*words.split())
    assert (said.code, said.complaint) == (2, f"tiltvp: {told}\n")
    assert set(folder.iterdir()) == before


@pytest.mark.parametrize("verb", ["tilt", "tilt --threads 2", "segments", "lines", "track", "level"])
@pytest.mark.parametrize("words", [(), ("--raw", "256x256")])
def test_a_stream_without_frames_is_wrong_use(
    run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch, verb: str, words: tuple[str, ...]
) -> None:
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO()))
    out = "out.avi" if verb == "level" else "out.csv"
    said = run(*verb.split(), "-", "--camera", "camera.toml", "--out", out, *words)
    assert (said.code, said.out, (folder / out).exists()) == (2, "", False)
    assert said.complaint == "tiltvp: -: no frames came, expected one or more\n"


@pytest.mark.parametrize("verb", sorted(verbs(app)), ids=" ".join)
def test_counts_have_an_end(verb: tuple[str, ...]) -> None:
    for one in app.parse_commands(verb)[1][-1].assemble_argument_collection():
        for validator in one.parameter.validator if one.parse else ():
            if "int" in re.findall(r"\w+", str(one.hint)) and isinstance(validator, Number):
                assert validator.lte is not None, one.name


def test_of_many_jobs_a_few_are_begun() -> None:
    """All were: a count of 10^9 filled the memory before the first was done."""
    begun: list[int] = []
    with in_order(begun.append, itertools.count(), 2, Event()) as done:
        list(itertools.islice(done, 10))
    assert len(begun) < 100


def test_of_damaged_images_our_lines_stand_alone(tmp_path: Path) -> None:
    """Decoders write to stderr, past Python, and without the name of the file."""
    noise = np.random.default_rng(0).integers(0, 255, (64, 64), dtype=np.uint8)
    for ending in (".png", ".tif", ".bmp", ".jp2", ".jpg"):
        data = cv2.imencode(ending, noise)[1].tobytes()
        (tmp_path / f"cut{ending}").write_bytes(data[: len(data) // 2])
    files = sorted(str(file) for file in tmp_path.iterdir())
    command = [sys.executable, "-m", "tiltvp", "camera", "rim", *files]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1
    assert [line.partition(" (")[0] for line in done.stderr.splitlines()] == [
        f"tiltvp: {file}: not an image that can be decoded" for file in files
    ]
