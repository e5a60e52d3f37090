"""Every real calibration file loads as the model and numbers it states, or is refused by one sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from published_calibrations import FILES
from tiltvp.errors import CalibrationError
from tiltvp.formats import CameraSpec, read_cameras, write_toml

REFUSED_IN_OMNI = {
    "eowjd0512_fisheye-calib-adapter/UCM.yml": "a unified model with alpha = 1.01674 is not supported",
    "jakarto3d_py-OCamCalib/calibration_fisheye_1_18052022_154907.json": "carries no image size",
    "tasptz_py-omnicalib/calibration.yml": "carries no image size",
    "tasptz_py-omnicalib/example_calibration.yml": "carries no image size",
    "tasptz_py-omnicalib/undistort_calibration.yml": "carries no image size",
    "valeoai_WoodScape/calibration_readme.txt": "no known calibration format",
    "xmba15_omnidirectional_camera/param_config.json": "no known calibration format",
}


def test_no_file_is_left_out(data: Path) -> None:
    files = {path.name for path in (data / "calib_formats").iterdir()} - {"INDEX.md"}
    assert files == set(FILES)
    assert len(files) == 43


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("is_named", [False, True])
def test_model_and_numbers(data: Path, name: str, is_named: bool) -> None:
    expected = FILES[name]
    cameras = read_cameras(data / "calib_formats" / name, expected.format if is_named else None, expected.image_size)
    first, last = cameras[0], cameras[-1]
    assert (first.format, len(cameras), first.model) == (expected.format, expected.cameras, expected.model)
    assert all((camera.width, camera.height) == expected.size for camera in cameras)
    assert {camera.model for camera in cameras} == {expected.model}
    for camera, numbers in ((first, expected.numbers), (last, expected.last or {})):
        for key, value in numbers.items():
            assert camera.parameters[key] == pytest.approx(value, rel=1e-15, abs=0.0), key
    assert len({camera.name for camera in cameras}) == len(cameras)


@pytest.mark.parametrize("name", [name for name, expected in FILES.items() if expected.image_size])
def test_a_file_without_image_size_says_so(data: Path, name: str) -> None:
    with pytest.raises(CalibrationError, match=r"carries no image size, expected image_size=\(width, height\)"):
        read_cameras(data / "calib_formats" / name)


@pytest.mark.parametrize("name", FILES)
def test_converts_to_our_own_file(data: Path, tmp_path: Path, name: str) -> None:
    cameras = read_cameras(data / "calib_formats" / name, image_size=FILES[name].image_size)
    write_toml(cameras, tmp_path / "own.toml")
    assert read_cameras(tmp_path / "own.toml") == cameras


def test_every_calibration_beside_the_images(data: Path) -> None:
    refused, loaded = {}, 0
    for path in sorted((data / "omni").glob("*/*")):
        if path.suffix not in (".txt", ".yaml", ".yml", ".json", ".xml"):
            continue
        try:
            cameras = read_cameras(path)
        except CalibrationError as error:
            refused[f"{path.parent.name}/{path.name}"] = str(error)
        else:
            loaded += 1
            assert cameras
            if path.name.startswith("calib_results"):
                assert cameras[0].model == "ocam"
    assert set(refused) == set(REFUSED_IN_OMNI)
    for name, sentence in refused.items():
        assert REFUSED_IN_OMNI[name] in sentence
        assert "\n" not in sentence
    assert loaded >= 24


@pytest.mark.parametrize("name", [name for name, expected in FILES.items() if expected.model == "ocam"])
def test_direct_and_inverse_polynomial_agree(data: Path, name: str) -> None:
    """The signs and axes are right if the pixel of the bearing of a pixel is that pixel, by two fits of one lens."""
    spec = read_cameras(data / "calib_formats" / name, image_size=FILES[name].image_size)[0]
    if "inverse_polynomial" not in spec.parameters:
        assert spec.format in ("pyocamcalib", "py-omnicalib", "fisheye-calib-adapter")
        return
    radius = 0.45 * min(spec.width, spec.height)
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    pixels = np.array([spec.parameters["cx"], spec.parameters["cy"]]) + radius * np.column_stack(
        [np.cos(angle), np.sin(angle)]
    )
    again = _project(spec, _unproject(spec, pixels))
    assert np.abs(again - pixels).max() < 0.01


def _unproject(spec: CameraSpec, pixels: np.ndarray) -> np.ndarray:
    p: dict[str, Any] = dict(spec.parameters)
    matrix = np.array([[p["c"], p["d"]], [p["e"], 1.0]])
    xy = np.linalg.solve(matrix, (pixels[:, ::-1] - [p["cy"], p["cx"]]).T).T
    f = np.polynomial.polynomial.polyval(np.hypot(*xy.T), p["polynomial"])
    return np.column_stack([xy[:, 1], xy[:, 0], -f])


def _project(spec: CameraSpec, rays: np.ndarray) -> np.ndarray:
    p: dict[str, Any] = dict(spec.parameters)
    across = np.hypot(rays[:, 0], rays[:, 1])
    rho = np.polynomial.polynomial.polyval(np.arctan2(-rays[:, 2], across), p["inverse_polynomial"])
    x, y = rays[:, 1] / across * rho, rays[:, 0] / across * rho
    return np.column_stack([p["e"] * x + y + p["cx"], p["c"] * x + p["d"] * y + p["cy"]])
