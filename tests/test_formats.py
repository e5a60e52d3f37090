"""The calibration readers on small texts of every format: numbers, conventions, traps, refusals, and any bytes."""

from __future__ import annotations

import math
import os
import struct
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from calibration_texts import AFFINE, KB, OCAM, RADTAN, SAMPLES, Sample
from tiltvp import formats
from tiltvp.errors import (
    CalibrationError,
    CalibrationNotFoundError,
    InvalidInputError,
    TiltvpError,
    UnsupportedFormatError,
)
from tiltvp.formats import FORMATS, MODELS, CameraSpec, read_cameras, write_toml

Read = Callable[..., list[CameraSpec]]
Array = np.ndarray


@pytest.fixture
def read(tmp_path: Path) -> Read:
    """Reads a text as a file."""

    def read_text(text: str | bytes, format: str | None = None, image_size: tuple[int, int] | None = None):
        path = tmp_path / "calibration"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return read_cameras(path, format, image_size)

    return read_text


def message(read: Read, text: str | bytes, **options: object) -> str:
    """The sentence with which a text is refused."""
    with pytest.raises(CalibrationError) as refusal:
        read(text, **options)
    return str(refusal.value)


# --- every format ------------------------------------------------------------------------------------------------


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
        assert set(MODELS[camera.model].required) <= set(camera.parameters) <= set(MODELS[camera.model].names)


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


# --- conventions: the bearing of a pixel by each tool's own formulas ---------------------------------------------


PIXELS = np.random.default_rng(5).uniform([0.0, 0.0], [639.0, 479.0], (200, 2))


def bearings(spec: CameraSpec, pixels: Array) -> Array:
    """The unit bearings of an `ocam` spec, by the definition in `CameraSpec`."""
    p = spec.parameters
    matrix = np.array([[p["c"], p["d"]], [p["e"], 1.0]])
    xy = np.linalg.solve(matrix, (pixels[:, ::-1] - [p["cy"], p["cx"]]).T).T
    f = np.polynomial.polynomial.polyval(np.hypot(*xy.T), p["polynomial"])
    return unit(np.column_stack([xy[:, 1], xy[:, 0], -f]))


def projections(spec: CameraSpec, rays: Array) -> Array:
    """The pixels of an `ocam` spec by its inverse polynomial."""
    p = spec.parameters
    across = np.hypot(rays[:, 0], rays[:, 1])
    rho = np.polynomial.polynomial.polyval(np.arctan2(-rays[:, 2], across), p["inverse_polynomial"])
    x, y = rays[:, 1] / across * rho, rays[:, 0] / across * rho
    return np.column_stack([p["e"] * x + y + p["cx"], p["c"] * x + p["d"] * y + p["cy"]])


def column_affine(pixels: Array, c: float, d: float, e: float, cx: float, cy: float, z: np.poly1d | list) -> Array:
    """unproject of MultiCol-SLAM, py-OCamCalib, fisheye-calib-adapter: [[c, d], [e, 1]] on (column, row)."""
    uv = np.linalg.solve(np.array([[c, d], [e, 1.0]]), (pixels - [cx, cy]).T).T
    return unit(np.column_stack([uv, np.polynomial.polynomial.polyval(np.hypot(*uv.T), z)]))


def unit(rays: Array) -> Array:
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


C, D, E = 0.9975, -0.0125, 0.0135
POLY = [-205.5, 0.0, 1.5e-3, -2e-6, 6.25e-9]
FORWARD = [-a for a in POLY]


def test_multicol_bearings_and_inverse(read: Read) -> None:
    text = SAMPLES["multicol"].text
    for old, new in (("c: 1.0", f"c: {C}"), ("d: 0.0", f"d: {D}"), ("e: 0.0", f"e: {E}")):
        text = text.replace(f"Camera.{old}", f"Camera.{new}")
    spec = read(text)[0]
    expected = column_affine(PIXELS, C, D, E, 321.5, 238.25, [205.5, 0.0, -0.0015])
    np.testing.assert_allclose(bearings(spec, PIXELS), expected, atol=1e-14)
    across = np.hypot(expected[:, 0], expected[:, 1])
    rho = 301.5 + 160.25 * np.arctan(-expected[:, 2] / across)
    u, v = expected[:, 0] / across * rho, expected[:, 1] / across * rho
    theirs = np.column_stack([u * C + v * D + 321.5, u * E + v + 238.25])
    np.testing.assert_allclose(projections(spec, expected), theirs, atol=1e-10)


def test_camodocal_scaramuzza_projection(read: Read) -> None:
    text = SAMPLES["camodocal_ocam"].text
    for old, new in (("ac: 1.0", f"ac: {C}"), ("ad: 0.0", f"ad: {D}"), ("ae: 0.0", f"ae: {E}")):
        text = text.replace(old, new)
    spec = read(text)[0]
    rays = column_affine(PIXELS, C, D, E, 321.5, 238.25, [205.5, 0.0, -0.0015])
    norm = np.hypot(rays[:, 0], rays[:, 1])
    rho = 301.5 + 160.25 * np.arctan2(-rays[:, 2], norm)
    u, v = rays[:, 0] / norm * rho, rays[:, 1] / norm * rho
    theirs = np.column_stack([u * C + v * D + 321.5, u * E + v + 238.25])
    np.testing.assert_allclose(projections(spec, rays), theirs, atol=1e-10)
    np.testing.assert_allclose(bearings(spec, PIXELS), rays, atol=1e-14)


def test_pyocamcalib_bearings(read: Read) -> None:
    text = SAMPLES["pyocamcalib"].text.replace("[[1.0, 0.0], [0.0, 1.0]]", f"[[{C}, {D}], [{E}, 1.0]]")
    spec = read(text, image_size=(640, 480))[0]
    expected = column_affine(PIXELS, C, D, E, 321.5, 238.25, FORWARD)
    np.testing.assert_allclose(bearings(spec, PIXELS), expected, atol=1e-14)
    assert "inverse_polynomial" not in spec.parameters


def test_adapter_ocam_bearings(read: Read) -> None:
    text = SAMPLES["adapter_ocam"].text
    for old, new in (("c: 1.0", f"c: {C}"), ("d: 0.0", f"d: {D}"), ("e: 0.0", f"e: {E}")):
        text = text.replace(f"  {old}", f"  {new}")
    expected = column_affine(PIXELS, C, D, E, 321.5, 238.25, [205.5, 0.0, -0.0015])
    np.testing.assert_allclose(bearings(read(text)[0], PIXELS), expected, atol=1e-14)


@pytest.mark.parametrize("key", ["vikit", "omni_cam"])
def test_vikit_and_omni_cam_bearings_and_inverse(read: Read, key: str) -> None:
    spec = read(SAMPLES[key].text)[0]
    c, d, e = OCAM["c"], OCAM["d"], OCAM["e"]
    matrix = np.array([[1.0, e], [d, c]])
    uv = np.linalg.solve(matrix, (PIXELS - [321.5, 238.25]).T).T
    expected = unit(np.column_stack([uv, -np.polynomial.polynomial.polyval(np.hypot(*uv.T), POLY)]))
    np.testing.assert_allclose(bearings(spec, PIXELS), expected, atol=1e-14)
    norm = np.hypot(expected[:, 0], expected[:, 1])
    inverse = [x + 0.5 for x in range(300, 312)]
    rho = np.polynomial.polynomial.polyval(np.arctan(-expected[:, 2] / norm), inverse)
    theirs = (matrix @ (expected[:, :2] / norm[:, None] * rho[:, None]).T).T + [321.5, 238.25]
    np.testing.assert_allclose(projections(spec, expected), theirs, rtol=1e-12)


def test_ocamcalib_bearings(read: Read) -> None:
    spec = read(SAMPLES["ocamcalib"].text)[0]
    row, column = PIXELS[:, 1], PIXELS[:, 0]
    c, d, e = 1.0005, -0.00025, 0.000125
    determinant = c - d * e
    x = ((row - 238.25) - d * (column - 321.5)) / determinant
    y = (-e * (row - 238.25) + c * (column - 321.5)) / determinant
    f = np.polynomial.polynomial.polyval(np.hypot(x, y), POLY)
    np.testing.assert_allclose(bearings(spec, PIXELS), unit(np.column_stack([y, x, -f])), atol=1e-14)


def test_unified_from_alpha_is_the_same_projection(read: Read) -> None:
    alpha, p = 0.625, {"fx": 210.5, "fy": 211.25, "cx": 318.5, "cy": 241.75}
    text = SAMPLES["adapter"].text.replace("alpha: 0.5", f"alpha: {alpha}").replace("  beta: 1.125\n", "")
    q = read(text)[0].parameters
    x, y, z = unit(np.random.default_rng(1).normal(size=(50, 3)) + [0.0, 0.0, 3.0]).T
    theirs = p["fx"] * x / (alpha + (1.0 - alpha) * z) + p["cx"]
    np.testing.assert_allclose(q["fx"] * x / (z + q["xi"]) + q["cx"], theirs, rtol=1e-13)
    theirs = p["fy"] * y / (alpha + (1.0 - alpha) * z) + p["cy"]
    np.testing.assert_allclose(q["fy"] * y / (z + q["xi"]) + q["cy"], theirs, rtol=1e-13)
    assert "alpha = 1.0 is not supported" in message(read, text.replace(str(alpha), "1.0"))


COLMAP_LINES = {
    "SIMPLE_PINHOLE 64 48 50 32 24": ("pinhole", {"fx": 50.0, "fy": 50.0}),
    "PINHOLE 64 48 50 51 32 24": ("pinhole", {"fx": 50.0, "fy": 51.0}),
    "SIMPLE_RADIAL 64 48 50 32 24 0.1": ("pinhole", {"fx": 50.0, "fy": 50.0, "k1": 0.1}),
    "RADIAL 64 48 50 32 24 0.1 0.2": ("pinhole", {"fx": 50.0, "fy": 50.0, "k1": 0.1, "k2": 0.2}),
    "OPENCV 64 48 50 51 32 24 .1 .2 .3 .4": (
        "pinhole",
        {"fx": 50.0, "fy": 51.0, "k1": 0.1, "k2": 0.2, "p1": 0.3, "p2": 0.4},
    ),
    "FULL_OPENCV 64 48 50 51 32 24 1 2 3 4 5 6 7 8": (
        "pinhole",
        {
            "fx": 50.0,
            "fy": 51.0,
            "k1": 1.0,
            "k2": 2.0,
            "p1": 3.0,
            "p2": 4.0,
            "k3": 5.0,
            "k4": 6.0,
            "k5": 7.0,
            "k6": 8.0,
        },
    ),
    "OPENCV_FISHEYE 64 48 50 51 32 24 1 2 3 4": (
        "kannala_brandt",
        {"fx": 50.0, "fy": 51.0, "k1": 1.0, "k2": 2.0, "k3": 3.0, "k4": 4.0},
    ),
    "SIMPLE_RADIAL_FISHEYE 64 48 50 32 24 1": (
        "kannala_brandt",
        {"fx": 50.0, "fy": 50.0, "k1": 1.0, "k2": 0.0, "k3": 0.0, "k4": 0.0},
    ),
    "RADIAL_FISHEYE 64 48 50 32 24 1 2": (
        "kannala_brandt",
        {"fx": 50.0, "fy": 50.0, "k1": 1.0, "k2": 2.0, "k3": 0.0, "k4": 0.0},
    ),
}


@pytest.mark.parametrize("line", COLMAP_LINES)
def test_colmap_models_and_half_pixel(read: Read, line: str) -> None:
    model, parameters = COLMAP_LINES[line]
    spec = read(f"1 {line}\n")[0]
    assert (spec.model, spec.parameters) == (model, {"cx": 31.5, "cy": 23.5, **parameters})


@pytest.mark.parametrize("model", ["FOV", "THIN_PRISM_FISHEYE", "FOURTH"])
def test_colmap_refuses_by_name(read: Read, model: str) -> None:
    text = message(read, f"1 {model} 64 48 50 51 32 24 0.1\n")
    assert f"{model!r} is not supported" in text
    assert "line 1" in text


KALIBR_PAIRS = {
    ("pinhole", "radtan"): ([50, 51, 32, 24], [0.1, 0.2, 0.3, 0.4], "pinhole"),
    ("pinhole", "equidistant"): ([50, 51, 32, 24], [0.1, 0.2, 0.3, 0.4], "kannala_brandt"),
    ("pinhole", "equi"): ([50, 51, 32, 24], [0.1, 0.2, 0.3, 0.4], "kannala_brandt"),
    ("pinhole", "none"): ([50, 51, 32, 24], [], "pinhole"),
    ("omni", "radtan"): ([1.5, 50, 51, 32, 24], [0.1, 0.2, 0.3, 0.4], "unified"),
    ("omni", "none"): ([1.5, 50, 51, 32, 24], [], "unified"),
    ("ds", "none"): ([-0.2, 0.6, 50, 51, 32, 24], [], "double_sphere"),
    ("eucm", "none"): ([0.6, 1.1, 50, 51, 32, 24], [], "extended_unified"),
}


def kalibr(model: str, lens: str, intrinsics: list[float], coefficients: list[float]) -> str:
    return (
        f"cam0:\n  camera_model: {model}\n  distortion_model: {lens}\n  intrinsics: {intrinsics}\n"
        f"  distortion_coeffs: {coefficients}\n  resolution: [64, 48]\n"
    )


@pytest.mark.parametrize("pair", KALIBR_PAIRS)
def test_kalibr_models(read: Read, pair: tuple[str, str]) -> None:
    intrinsics, coefficients, model = KALIBR_PAIRS[pair]
    spec = read(kalibr(*pair, intrinsics, coefficients))[0]
    p = spec.parameters
    assert spec.model == model
    assert (p["fx"], p["fy"], p["cx"], p["cy"]) == (50.0, 51.0, 32.0, 24.0)
    assert p.get("xi") == {"omni": 1.5, "ds": -0.2}.get(pair[0])
    assert p.get("alpha") == {"ds": 0.6, "eucm": 0.6}.get(pair[0])
    assert p.get("beta") == {"eucm": 1.1}.get(pair[0])
    if pair[1] == "radtan":
        assert [p[key] for key in ("k1", "k2", "p1", "p2")] == coefficients


@pytest.mark.parametrize("pair", [("pinhole", "fov"), ("omni", "equidistant"), ("ds", "radtan"), ("tof", "none")])
def test_kalibr_refuses_by_name(read: Read, pair: tuple[str, str]) -> None:
    text = message(read, kalibr(*pair, [50, 51, 32, 24], [0.9]))
    assert f"{pair[0]}-{ {'equidistant': 'equi'}.get(pair[1], pair[1]) }" in text
    assert "is not supported" in text


# --- OpenCV's many spellings -------------------------------------------------------------------------------------


def storage(matrix: str, coefficients: str, count: int, extra: str = "") -> str:
    values = ", ".join(str(0.1 * (k + 1)) for k in range(count))
    return (
        f"%YAML:1.0\n---\n{extra}{matrix}: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
        f"   data: [ 50., 0., 32., 0., 51., 24., 0., 0., 1. ]\n"
        f"{coefficients}: !!opencv-matrix\n   rows: 1\n   cols: {count}\n   dt: d\n   data: [ {values} ]\n"
    )


SIZE = "image_width: 64\nimage_height: 48\n"


@pytest.mark.parametrize(
    "names",
    [
        ("camera_matrix", "distortion_coefficients"),
        ("Camera_Matrix", "Distortion_Coefficients"),
        ("cameraMatrix", "distCoeffs"),
        ("K", "D"),
        ("M1", "D1"),
        ("mtx", "dist"),
    ],
)
@pytest.mark.parametrize("count", [5, 8])
def test_opencv_spellings(read: Read, names: tuple[str, str], count: int) -> None:
    spec = read(storage(*names, count, SIZE))[0]
    order = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")[:count]
    assert spec.model == "pinhole"
    assert [spec.parameters[key] for key in order] == [0.1 * (k + 1) for k in range(count)]


@pytest.mark.parametrize(
    "size", ["width: 64\nheight: 48\n", "imageSize: [64, 48]\n", "image_size: {width: 64, height: 48}\n"]
)
def test_opencv_image_size_spellings(read: Read, size: str) -> None:
    spec = read(storage("K", "D", 5, size))[0]
    assert (spec.width, spec.height) == (64, 48)


def test_opencv_four_coefficients(read: Read) -> None:
    plain = storage("camera_matrix", "distortion_coefficients", 4, SIZE)
    assert read(plain)[0].model == "pinhole"
    assert "calibrateCamera" in read(plain)[0].notes[0]
    assert read(plain, "opencv-fisheye")[0].model == "kannala_brandt"
    assert read(storage("K", "D", 4, SIZE))[0].model == "kannala_brandt"
    assert read(storage("K", "D", 4, SIZE), "opencv-pinhole")[0].model == "pinhole"
    for mark in ("fisheye_model: 1\n", "model_type: fisheye\n", "distortion_model: equidistant\n"):
        text = storage("camera_matrix", "distortion_coefficients", 4, SIZE + mark)
        assert read(text, "opencv")[0].model == "kannala_brandt"
    assert read(storage("camera_matrix", "distCoeffs", 4, SIZE + "fisheye_model: 0\n"))[0].model == "pinhole"
    vague = storage("camera_matrix", "distCoeffs", 4, SIZE + "camera_name: my fisheye\n")
    assert "format='opencv-pinhole' or format='opencv-fisheye'" in message(read, vague)


def test_opencv_refuses_what_the_models_lack(read: Read) -> None:
    assert "thin prism" in message(read, storage("K", "D", 12, SIZE))
    skewed = storage("K", "D", 5, SIZE).replace("50., 0.,", "50., 0.5,")
    assert "a skew of 0.5 px is not supported" in message(read, skewed)
    assert "'fov' is not supported" in message(read, storage("K", "D", 5, SIZE + "model_type: fov\n"))
    assert "7 numbers" in message(read, storage("K", "D", 7, SIZE))
    assert "where 0, 0, 0, 1 belong" in message(read, storage("K", "D", 5, SIZE).replace("0., 1. ]", "1., 1. ]"))
    assert "expected 1 rows of 6" in message(read, storage("K", "D", 5, SIZE).replace("cols: 5", "cols: 6"))


def test_opencv_stereo_and_json(read: Read) -> None:
    two = storage("M1", "D1", 5, SIZE) + storage("M2", "D2", 8).split("---\n")[1]
    assert [camera.name for camera in read(two)] == ["cam0", "cam1"]
    text = (
        '{"image_width": 64, "image_height": 48, "camera_matrix": {"type_id": "opencv-matrix", "rows": 3, "cols": 3,'
        ' "dt": "d", "data": [50, 0, 32, 0, 51, 24, 0, 0, 1]}}'
    )
    assert read(text)[0].parameters == {"fx": 50.0, "fy": 51.0, "cx": 32.0, "cy": 24.0}


def test_written_by_opencv_itself(read: Read, tmp_path: Path) -> None:
    cv2 = pytest.importorskip("cv2")
    matrix = np.array([[210.5, 0.0, 318.5], [0.0, 211.25, 241.75], [0.0, 0.0, 1.0]])
    for ending in ("yml", "xml", "json"):
        path = tmp_path / f"camera.{ending}"
        file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
        file.write("image_width", 640)
        file.write("image_height", 480)
        file.write("K", matrix)
        file.write("D", np.array([[0.0125], [-3.5e-3], [1e-5], [-2.5e-06]]))
        file.write("xi", 1.375)
        file.release()
        spec = read_cameras(path)[0]
        assert spec.model == "unified"
        assert spec.parameters == {"xi": 1.375, **AFFINE, "k1": 0.0125, "k2": -3.5e-3, "p1": 1e-5, "p2": -2.5e-06}


# --- the other formats' variants and refusals ---------------------------------------------------------------------


def edited(key: str, *changes: tuple[str, str]) -> str:
    """A sample with parts of its text exchanged, each of which has to be there."""
    text = SAMPLES[key].text
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return text


REFUSALS: dict[str, tuple[str, str]] = {
    "woodscape model": (edited("woodscape", ("radial_poly", "fov")), "'fov' is not supported"),
    "woodscape order": (edited("woodscape", ('"poly_order": 4', '"poly_order": 5')), "order 5 is not supported"),
    "woodscape unknown key": (edited("woodscape", ('"k4"', '"k5"')), "unknown key 'k5', expected one of k"),
    "basalt type": (edited("basalt", ('"ds"', '"fov"')), "'fov' is not supported"),
    "basalt key": (edited("basalt", ('"xi"', '"xj"')), "unknown key 'xj', expected one of xi"),
    "basalt sizes": (edited("basalt", ("[[640, 480], [640, 480]]", "[[640, 480]]")), "1 image sizes for 2 cameras"),
    "ros model": (edited("ros", ("equidistant", "fov")), "'fov' is not supported"),
    "ros count": (edited("ros", ("equidistant", "plumb_bob"), ("cols: 4", "cols: 3"), (", -2.5e-06", "")), "3 numbers"),
    "camodocal model": (edited("camodocal", ("kannala_brandt", "FOV")), "'FOV' is not supported"),
    "camodocal key": (edited("camodocal", ("k4:", "k6:")), "k4 is missing"),
    "vikit model": ("cam_model: ATAN\ncam_width: 640\ncam_height: 480\n", "'ATAN' is not supported"),
    "vikit distortion": (
        "type: pinhole\nimage_width: 64\nimage_height: 48\nintrinsics: {rows: 4, cols: 1, data: [50, 51, 32, 24]}\n"
        "distortion: {type: fisheye, parameters: {rows: 1, cols: 1, data: [0.9]}}\n",
        "'fisheye' is not supported",
    ),
    "vikit count": (edited("vikit", (", 0.0, 1.0]", "]"), ("rows: 24", "rows: 22")), "22 numbers, expected 24"),
    "stella model": (edited("stella", ("equirectangular", "radial_division")), "'radial_division' is not supported"),
    "orbslam type": (edited("orbslam", ("KannalaBrandt8", "Fov")), "'Fov' is not supported"),
    "boofcv model": (edited("boofcv", ("omnidirectional_universal", "kannala_brandt")), "is not supported"),
    "boofcv radial": (edited("boofcv", ("  - 0.0625", "  - 1\n  - 2\n  - 3")), "4 numbers"),
    "adapter set": (edited("adapter", ("beta", "gamma")), "no supported model has the parameters"),
    "libper type": (edited("libper", ("<type>0", "<type>2")), "type 2 is not supported"),
    "libper count": (edited("libper", (">2</NbCams>", ">3</NbCams>")), "2 cameras, expected 3"),
    "libper entity": ("<!DOCTYPE x [<!ENTITY a 'b'>]><root><camera/></root>", "no known calibration format"),
    "gyroflow model": (
        edited("gyroflow", ('"use_opencv_fisheye": true', '"distortion_model": "poly5"')),
        "'poly5' is not",
    ),
    "gyroflow stretch": (edited("gyroflow", ('stretch": 1.0', 'stretch": 1.33')), "a stretch of 1.33"),
    "multicol count": (edited("multicol", ("nrpol: 3", "nrpol: 5")), "3 coefficients"),
    "colmap count": (edited("colmap", ("cameras: 2", "cameras: 3")), "2 cameras, expected the 3"),
    "colmap twice": (edited("colmap", ("3 SIMPLE", "7 SIMPLE")), "the camera id 7 occurs twice"),
    "colmap words": (edited("colmap", (" -0.25", "")), "3 parameters of SIMPLE_RADIAL, expected 4"),
    "ocam words": (edited("ocamcalib", ("480 640", "480")), "the file ends early, expected the width"),
    "ocam rest": (edited("ocamcalib", ("480 640", "480 640 3")), "after the image size"),
    "ocam count": (edited("ocamcalib", ("\n4 301", "\n9 301")), "line "),
    "ocam word": (edited("ocamcalib", ("160.250000", "160,250000")), "'160,250000', expected a number"),
    "ocam affine": (edited("ocamcalib", ("1.000500", "-1.0")), "determinant"),
    "nan": (edited("kalibr", ("210.5", ".nan")), "found .nan, expected a finite number"),
    "inf": (edited("basalt", ('"fx": 210.5', '"fx": Infinity')), "found inf, expected a finite number"),
    "overflow": (edited("ocamcalib", ("301.500000", "1e999")), "expected a finite number"),
    "wrong type": (edited("kalibr", ("[210.5, 211.25, 318.5, 241.75]", "high")), "found 'high', expected a number"),
    "underscore": (edited("camodocal", ("210.5", "2_1_0.5")), "found '2_1_0.5', expected a number"),
    "fraction of a pixel": (edited("camodocal", ("640", "640.5")), "expected a whole number, at image_width"),
    "zero width": (edited("camodocal", ("640", "0")), "an image width of 0"),
    "negative focal": (edited("camodocal", ("mu: 210.5", "mu: -210.5")), "fx is -210.5, expected a positive number"),
    "missing key": (edited("kalibr", ("intrinsics", "intrinsic")), "intrinsics is missing (there is 'intrinsic')"),
    "twice, differing": (edited("camodocal", ("   mv:", "   mu: 3.0\n   mv:")), "'mu' twice with different values"),
    "twice in JSON": (edited("woodscape", ('"k2"', '"k1"')), "'k1' twice with different values"),
    "own version": (edited("own", ("version = 1", "version = 2")), "version 2 is not supported"),
    "own key": (edited("own", ("width", "widht")), "unknown key 'widht', expected one of width"),
    "own parameter": (edited("own", ("focal_px", "focal")), "unknown key 'focal', expected one of focal_px"),
    "own model": (edited("own", ("equidistant", "equidist")), "'equidist' is not supported"),
    "own syntax": (edited("own", ("640", "640 480")), "is not TOML"),
    "empty": ("", "is empty"),
    "blank": (" \n\t\n", "is empty"),
    "prose": ("Dear reader,\nthis is no calibration.\n", "no known calibration format"),
    "list": ("- 1\n- 2\n", "no known calibration format (read as keys: a list at the top)"),
    "two formats": (edited("kalibr", ("cam0:", "poly_radius_to_z: [1]\ncam0:")), "could be kalibr and py-omnicalib"),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refusals_say_what_and_where(read: Read, case: str) -> None:
    text, expected = REFUSALS[case]
    sentence = message(read, text)
    assert expected in sentence
    assert "calibration: " in sentence
    assert ", expected " in sentence
    assert ", at " in sentence
    assert "\n" not in sentence


def test_harmless_variants(read: Read) -> None:
    tabs = edited("camodocal", ("   mu: ", "   mu:\t"), ("640", "640\t# wide"))
    assert read(tabs)[0].parameters == AFFINE | KB
    same_twice = edited("camodocal", ("   mv:", "   mu: 210.5\n   mv:"))
    assert read(same_twice)[0].parameters == AFFINE | KB
    comments = edited("ocamcalib", ("480 640", "480 # rows\n640 # columns"), ("5 -2.055", "5\n-2.055"))
    assert read(comments)[0].parameters == OCAM
    bare = "\n".join(line for line in SAMPLES["ocamcalib"].text.split("\n") if not line.startswith("#"))
    assert read(bare)[0].parameters == OCAM
    long = edited("ocamcalib", ("4 301.500000 160.250000 -8.500000 21.000000", "33 " + " ".join(["1.5"] * 33)))
    assert len(read(long)[0].parameters["inverse_polynomial"]) == 33
    skewed = read(edited("boofcv", ("skew: 0.0", "skew: 0.5")))[0]
    assert skewed.parameters["skew"] == 0.5
    rational = edited("ros", ("equidistant", "rational_polynomial"), ("cols: 4", "cols: 8"), ("06]", "06, 1, 2, 3, 4]"))
    assert read(rational)[0].parameters["k6"] == 4.0
    message_style = (
        "height: 48\nwidth: 64\ndistortion_model: plumb_bob\nd: [1, 2, 3, 4, 5]\nk: [50, 0, 32, 0, 51, 24, 0, 0, 1]\n"
    )
    assert read(message_style)[0].parameters["k3"] == 5.0
    flat = "Camera.model: fisheye\nCamera.cols: 64\nCamera.rows: 48\n" + "".join(
        f"Camera.{key}: {value}\n" for key, value in (AFFINE | KB).items()
    )
    assert read(flat)[0].parameters == AFFINE | KB
    svo = "cam0:\n  cam_model: PinholeEquidistant\n  cam_width: 64\n  cam_height: 48\n" + "".join(
        f"  cam_{key}: {value}\n"
        for key, value in (*AFFINE.items(), *((f"d{i}", v) for i, v in enumerate(KB.values())))
    )
    assert read(svo)[0].parameters == AFFINE | KB


# --- paths, names and sizes ---------------------------------------------------------------------------------------


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
    ):
        (tmp_path / "raw").write_bytes(raw)
        with pytest.raises(CalibrationError, match=words):
            read_cameras(str(tmp_path / "raw"))


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
    with pytest.raises(InvalidInputError, match="image_size is"):
        read(SAMPLES["libper"].text, image_size=size)


# --- our own file --------------------------------------------------------------------------------------------------

finite = st.floats(allow_nan=False, allow_infinity=False)
positive = st.floats(min_value=5e-324, allow_nan=False, allow_infinity=False)
words = st.text(st.characters(codec="utf-8"), max_size=20)


@st.composite
def specs(draw: st.DrawFn) -> CameraSpec:
    """Any spec the checks let through."""
    model = draw(st.sampled_from(sorted(set(MODELS) - {"ocam"})))
    names = MODELS[model]
    optional = [key for key in names.optional if draw(st.booleans())]
    parameters = {
        key: draw(positive if key in ("fx", "fy", "focal_px", "aspect_ratio") else finite)
        for key in (*names.required, *optional)
    }
    if draw(st.booleans()):
        model = "ocam"
        parameters = {key: draw(finite) for key in ("cx", "cy")} | {
            "c": draw(st.floats(0.5, 2.0)),
            "d": 0.01,
            "e": -0.01,
        }
        parameters["polynomial"] = [-1.0, *draw(st.lists(finite, min_size=1, max_size=30))]
        parameters["inverse_polynomial"] = draw(st.lists(finite, max_size=30))
    side = st.integers(1, 100_000)
    limit = st.none() | st.floats(0.0, math.pi, exclude_min=True)
    notes = tuple(draw(st.lists(words, max_size=2)))
    return CameraSpec(
        model, draw(side), draw(side), parameters, draw(st.booleans()), draw(words), "x", draw(limit), notes
    )


def bits(spec: CameraSpec) -> list[bytes]:
    values = (v if isinstance(v, list) else [v] for _, v in sorted(spec.parameters.items()))
    return [struct.pack(f"<{len(value)}d", *value) for value in values]


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

    monkeypatch.setattr(formats.own.os, "replace", broken)
    with pytest.raises(CalibrationError, match="cannot be written"):
        write_toml(CameraSpec("equirectangular", 64, 32, {}), path)
    monkeypatch.undo()
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["camera.toml"]
    with pytest.raises(CalibrationError, match="cannot be written"):
        write_toml(spec, tmp_path / "no" / "such" / "folder.toml")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"model": "equidist"}, "unknown model"),
        ({"width": 0}, "an image width of 0"),
        ({"parameters": {"focal_px": math.nan, "cx": 1.0, "cy": 1.0}}, "focal_px is nan"),
        ({"parameters": {"cx": 1.0, "cy": 1.0}}, "focal_px is missing"),
        ({"parameters": {"focal_px": 1.0, "cx": 1.0, "cy": 1.0, "cz": 1.0}}, "unknown parameter 'cz'"),
        ({"parameters": {"focal_px": [1.0], "cx": 1.0, "cy": 1.0}}, "expected one number"),
        ({"max_theta_rad": 4.0}, "max_theta_rad is 4.0"),
        ({"model": "ocam", "parameters": OCAM, "max_theta_rad": 4.0}, "max_theta_rad is 4.0"),
        ({"model": "ocam", "parameters": OCAM | {"polynomial": [0.0, 0.0]}}, "the polynomial says nothing"),
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


# --- any bytes -----------------------------------------------------------------------------------------------------


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
            assert set(MODELS[camera.model].required) <= set(camera.parameters)


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
        assert all(set(MODELS[camera.model].required) <= set(camera.parameters) for camera in cameras)


def test_unsupported_is_its_own_error(read: Read) -> None:
    with pytest.raises(UnsupportedFormatError):
        read("1 FOV 64 48 50 51 32 24 0.9\n")
    with pytest.raises(UnsupportedFormatError):
        read("hello: world\n")
    assert issubclass(UnsupportedFormatError, CalibrationError)
    assert issubclass(CalibrationError, TiltvpError)
    assert issubclass(CalibrationError, ValueError)
