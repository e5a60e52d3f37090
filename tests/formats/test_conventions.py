"""The bearing of a pixel and the pixel of a bearing, by each tool's own formulas."""

from __future__ import annotations

import numpy as np
import pytest

from calibration_reading import Read, message
from calibration_texts import OCAM, SAMPLES
from tiltvp.formats import CameraSpec

Array = np.ndarray
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
