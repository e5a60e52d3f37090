"""The lens models that COLMAP and Kalibr name, read or refused."""

from __future__ import annotations

import pytest

from calibration_reading import Read, message

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
        {"fx": 50.0, "fy": 50.0, "k1": 1.0},
    ),
    "RADIAL_FISHEYE 64 48 50 32 24 1 2": (
        "kannala_brandt",
        {"fx": 50.0, "fy": 50.0, "k1": 1.0, "k2": 2.0},
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
