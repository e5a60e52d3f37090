"""The calibration readers on any bytes: sound cameras or an error of ours, and never a hang."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from calibration_texts import SAMPLES, Sample
from tiltvp.errors import (
    CalibrationError,
    TiltvpError,
)
from tiltvp.formats import FORMATS, CameraSpec, read_cameras

pytestmark = pytest.mark.slow


def attempt(raw: bytes, format: str | None, image_size: tuple[int, int] | None) -> None:
    """Either sound cameras or an error of ours, in one line."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "calibration"
        path.write_bytes(raw)
        cameras: list[CameraSpec] = []
        refusal: TiltvpError | None = None
        try:
            cameras = read_cameras(path, format, image_size)
        except TiltvpError as error:
            refusal = error
        if refusal is not None:
            assert isinstance(refusal, CalibrationError)
            assert str(refusal).startswith(f"{path}: ")
            return
        assert cameras
        for camera in cameras:
            flat = [v for value in camera.parameters.values() for v in (value if isinstance(value, list) else [value])]
            assert all(isinstance(v, float) and math.isfinite(v) for v in flat)
            camera.check()


any_format = st.none() | st.sampled_from([one.name for one in FORMATS])
any_size = st.none() | st.just((640, 480))


@settings(max_examples=400, deadline=None)
@given(st.binary(max_size=300) | st.text(max_size=300).map(str.encode), any_format, any_size)
def test_any_bytes(raw: bytes, format: str | None, size: tuple[int, int] | None) -> None:
    attempt(raw, format, size)


@settings(max_examples=1500, deadline=None)
@given(st.data(), st.sampled_from(sorted(SAMPLES)), any_format, any_size)
def test_any_damage_to_a_file(data: st.DataObject, key: str, format: str | None, size: tuple[int, int] | None) -> None:
    raw = bytearray(SAMPLES[key].text.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(raw)))
        stop = data.draw(st.integers(start, min(start + 20, len(raw))))
        piece = st.binary(max_size=6) | st.sampled_from(
            [
                b"nan",
                b"{",
                b"[",
                b"[[[[[[",
                b"]",
                b":",
                b"- ",
                b"&a ",
                b"*a",
                b"\n",
                b"#",
                b"1e999",
                b'"',
                b"<",
                b"!!int ",
            ]
        )
        raw[start:stop] = data.draw(piece)
    attempt(bytes(raw), format, size)


@pytest.mark.parametrize("nest", ["[", "{", '{"a":', "<a>", "- ", "a: [", "[[camera]]\na="])
def test_deep_nesting(nest: str) -> None:
    for format in (None, "opencv", "tiltvp", "libper"):
        attempt((nest * 20_000).encode(), format, None)


def test_alias_bombs() -> None:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 12)]
    lines += ["K: *a11", "D: *a3", "image_width: 64", "image_height: 48"]
    attempt("\n".join(lines).encode(), None, None)
    attempt(b"K: &a [*a]\nimage_width: &b {c: *b}\n", None, None)


@pytest.mark.parametrize("key", SAMPLES)
def test_a_file_cut_anywhere(key: str, tmp_path: Path) -> None:
    sample: Sample = SAMPLES[key]
    raw = sample.text.encode()
    path = tmp_path / "cut"
    for end in range(len(raw)):
        path.write_bytes(raw[:end])
        try:
            cameras = read_cameras(path, None, sample.image_size)
        except CalibrationError:
            continue
        for camera in cameras:
            camera.check()
