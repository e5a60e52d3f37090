"""Our own calibration file: any camera comes back with the same bits, and nonsense is not written."""

from __future__ import annotations

import math
import os
import struct
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from calibration_reading import Read
from calibration_texts import OCAM, SAMPLES
from tiltvp import _core
from tiltvp.errors import CalibrationError, OutputError, TiltvpError
from tiltvp.formats import CameraSpec, read_cameras, write_toml

pixels = st.floats(-1e6, 1e6)
usual = st.floats(0.25, 0.75)
words = st.text(st.characters(codec="utf-8"), max_size=20)


@st.composite
def specs(draw: st.DrawFn) -> CameraSpec:
    """Any camera that the core lets through: of what is drawn it refuses a few, such as a singular affine map."""
    model = draw(st.sampled_from(_core.CAMERA_MODELS))
    parameters = {}
    for one in _core.lens_schema(model)["parameters"]:
        if one["required"] or draw(st.booleans()):
            number = pixels if one["name"] in ("cx", "cy") else usual
            parameters[one["name"]] = draw(st.lists(number, min_size=1, max_size=30) if one["is_list"] else number)
    side = st.integers(1, 100_000)
    limit = st.none() | st.floats(0.0, math.pi, exclude_min=True)
    notes = tuple(draw(st.lists(words, max_size=2)))
    spec = CameraSpec(
        model, draw(side), draw(side), parameters, draw(st.booleans()), draw(words), "x", draw(limit), notes
    )
    try:
        spec.check()
    except TiltvpError:
        reject()
    return spec


def bits(spec: CameraSpec) -> list[bytes]:
    values = (v if isinstance(v, list) else [v] for _, v in sorted(spec.parameters.items()))
    return [struct.pack(f"<{len(value)}d", *value) for value in values]


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(specs())
def test_own_file_comes_back_with_the_same_bits(spec: CameraSpec) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "camera.toml"
        write_toml(spec, path)
        back = read_cameras(path)
        assert back == [spec]
        assert bits(back[0]) == bits(spec)
        assert (back[0].format, back[0].notes) == ("tiltvp", spec.notes)
        assert os.listdir(folder) == ["camera.toml"]


@pytest.mark.parametrize("key", SAMPLES)
def test_every_format_converts_to_our_own(read: Read, tmp_path: Path, key: str) -> None:
    cameras = read(SAMPLES[key].text, image_size=SAMPLES[key].image_size)
    write_toml(cameras, tmp_path / "own.toml")
    assert read_cameras(tmp_path / "own.toml") == cameras


def test_writing_is_all_or_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = CameraSpec("equidistant", 640, 480, {"focal_px": 139.7, "cx": 319.5, "cy": 239.5})
    path = tmp_path / "camera.toml"
    write_toml(spec, path)
    before = path.read_bytes()

    def broken(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", broken)
    with pytest.raises(OutputError, match="cannot be written"):
        write_toml(CameraSpec("equirectangular", 64, 32, {}), path)
    monkeypatch.undo()
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["camera.toml"]
    with pytest.raises(OutputError, match="cannot be written"):
        write_toml(spec, path / "below_a_file.toml")
    write_toml(spec, tmp_path / "new" / "folder" / "camera.toml")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"model": "equidist"}, 'model = "equidist"'),
        ({"width": 0}, "width = 0, expected 1 to 100000 pixels"),
        ({"parameters": {"focal_px": math.nan, "cx": 1.0, "cy": 1.0}}, "focal_px = NaN"),
        ({"parameters": {"cx": 1.0, "cy": 1.0}}, "focal_px = missing"),
        ({"parameters": {"focal_px": 1.0, "cx": 1.0, "cy": 1.0, "cz": 1.0}}, 'parameter = "cz"'),
        ({"parameters": {"focal_px": [1.0], "cx": 1.0, "cy": 1.0}}, "expected one number"),
        ({"max_theta_rad": 4.0}, "max_theta_rad = 4"),
        ({"model": "ocam", "parameters": OCAM, "max_theta_rad": 4.0}, "max_theta_rad = 4"),
        ({"model": "ocam", "parameters": OCAM | {"polynomial": [0.0, 0.0]}}, "the first not zero"),
    ],
)
def test_nonsense_is_not_written(tmp_path: Path, change: dict[str, object], words: str) -> None:
    fields = {
        "model": "equidistant",
        "width": 640,
        "height": 480,
        "parameters": {"focal_px": 9.5, "cx": 1.0, "cy": 2.0},
    }
    with pytest.raises(CalibrationError, match=words):
        write_toml(CameraSpec(**(fields | change)), tmp_path / "camera.toml")
    assert not os.listdir(tmp_path)
