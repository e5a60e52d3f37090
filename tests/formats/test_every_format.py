"""What all calibration readers have in common: models, numbers, sizes, paths and names of formats."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from calibration_reading import Read, message
from calibration_texts import AFFINE, RADTAN, SAMPLES
from tiltvp.errors import (
    CalibrationError,
    CalibrationNotFoundError,
    InvalidInputError,
    TiltvpError,
    UnsupportedFormatError,
)
from tiltvp.formats import FORMATS, CameraSpec, read_cameras


def test_every_format_has_a_sample() -> None:
    known = {sample.format for sample in SAMPLES.values()} | {"opencv-pinhole", "opencv-fisheye"}  # Never recognised.
    assert [one.name for one in FORMATS if one.name not in known] == [], "no file of it in calibration_texts.py"


@pytest.mark.parametrize("key", SAMPLES)
@pytest.mark.parametrize("explicit", [False, True])
def test_reads_model_and_numbers(read: Read, key: str, explicit: bool) -> None:
    sample = SAMPLES[key]
    cameras = read(sample.text, sample.format if explicit else None, sample.image_size)
    first = cameras[0]
    assert len(cameras) == sample.cameras
    assert first.format == sample.format
    assert (first.model, (first.width, first.height), first.name) == (sample.model, sample.size, sample.name)
    assert first.parameters == sample.parameters
    assert not first.mirror
    for camera in cameras:
        camera.check()


@pytest.mark.parametrize("key", SAMPLES)
@pytest.mark.parametrize("change", ["crlf", "bom", "trailing"])
def test_line_ends_and_marks_do_not_matter(read: Read, key: str, change: str) -> None:
    sample = SAMPLES[key]
    text = {
        "crlf": sample.text.replace("\n", "\r\n"),
        "bom": "\ufeff" + sample.text,
        "trailing": sample.text + "\n\n",
    }[change]
    assert read(text, image_size=sample.image_size)[0].parameters == sample.parameters


def test_second_cameras(read: Read) -> None:
    assert read(SAMPLES["kalibr"].text)[1] == CameraSpec(
        "unified", 640, 480, {"xi": 1.375, **AFFINE, **RADTAN}, name="cam1"
    )
    unified = read(SAMPLES["basalt"].text)[1]
    assert unified.parameters == {"xi": 1.0, "fx": 421.0, "fy": 422.5, "cx": 318.5, "cy": 241.75}
    radial = read(SAMPLES["colmap"].text)[1]
    assert radial.parameters == {"fx": 210.5, "fy": 210.5, "cx": 319.5, "cy": 239.5, "k1": -0.25}


@pytest.mark.parametrize("key", [key for key, sample in SAMPLES.items() if sample.image_size])
def test_missing_image_size_is_asked_for(read: Read, key: str) -> None:
    assert "carries no image size, expected image_size=(width, height)" in message(read, SAMPLES[key].text)


@pytest.mark.parametrize("key", [key for key, sample in SAMPLES.items() if not sample.image_size])
def test_image_size_may_not_contradict(read: Read, key: str) -> None:
    assert read(SAMPLES[key].text, image_size=(640, 480))
    assert "640x480, expected the 641x480" in message(read, SAMPLES[key].text, image_size=(641, 480))


def test_paths(tmp_path: Path) -> None:
    with pytest.raises(CalibrationNotFoundError, match="no such file") as missing:
        read_cameras(tmp_path / "none.yaml")
    assert isinstance(missing.value, FileNotFoundError | CalibrationError)
    assert isinstance(missing.value, FileNotFoundError)
    with pytest.raises(CalibrationError, match="is a folder"):
        read_cameras(tmp_path)
    with pytest.raises(CalibrationError, match="cannot be read"):
        read_cameras("a\0b")
    for raw, words in (
        (b"\xff\xfe\x00\x01", "is not text, expected UTF-8, at byte 0"),
        (b"a" * (5 << 20), "larger than"),
        (b"\x89PNG\r\n\x1a\n" + bytes(9), "raw: is an image, expected a calibration file, at this path"),
        (b"\xff\xd8\xff" + bytes(5 << 20), "raw: is an image, expected a calibration file, at this path"),
    ):
        (tmp_path / "raw").write_bytes(raw)
        with pytest.raises(CalibrationError, match=words):
            read_cameras(str(tmp_path / "raw"))


def test_toml_of_something_else_is_not_told_what_json_and_yaml_say_of_it(tmp_path: Path) -> None:
    for text in ("[camera]\nwidth = 640\n", 'format = "tiltvp-camara"\n'):
        (tmp_path / "dataset.toml").write_text(text)
        with pytest.raises(CalibrationError, match=r"no .* \(TOML without format = \"tiltvp-camera\"\), expected"):
            read_cameras(tmp_path / "dataset.toml")


def test_format_names(read: Read) -> None:
    text = SAMPLES["kalibr"].text
    assert read(text, "Kalibr")[0].format == "kalibr"
    assert read(SAMPLES["stella"].text, "stella_vslam")[0].format == "stella-vslam"
    sentence = message(read, text, format="kalbir")
    assert "unknown format 'kalbir', expected near it: kalibr" in sentence
    assert "woodscape" in sentence
    assert "one of" in message(read, text, format="%")
    assert len({one.name for one in FORMATS}) == len(FORMATS)


@pytest.mark.parametrize("one", [one.name for one in FORMATS])
@pytest.mark.parametrize("key", SAMPLES)
def test_a_wrong_format_is_refused(read: Read, one: str, key: str) -> None:
    if one.split("-")[0] == SAMPLES[key].format.split("-")[0]:
        return
    try:
        cameras = read(SAMPLES[key].text, one, SAMPLES[key].image_size)
    except CalibrationError:
        return
    assert (one, key) in {("opencv", "ros"), ("opencv-fisheye", "ros")}
    assert cameras[0].parameters == SAMPLES[key].parameters


@pytest.mark.parametrize("size", [(0, 480), (640,), (640.5, 480), "ab", (640, -1), (math.inf, 1), 3])
def test_image_size_is_checked(read: Read, size: object) -> None:
    with pytest.raises(InvalidInputError, match="image_size = "):
        read(SAMPLES["libper"].text, image_size=size)


def test_unsupported_is_its_own_error(read: Read) -> None:
    with pytest.raises(UnsupportedFormatError):
        read("1 FOV 64 48 50 51 32 24 0.9\n")
    with pytest.raises(UnsupportedFormatError):
        read("hello: world\n")
    assert issubclass(UnsupportedFormatError, CalibrationError)
    assert issubclass(CalibrationError, TiltvpError)
    assert issubclass(CalibrationError, ValueError)
