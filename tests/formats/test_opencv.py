"""OpenCV's many spellings of a calibration."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from calibration_reading import Read, message
from calibration_texts import AFFINE
from tiltvp.errors import CalibrationError
from tiltvp.formats import read_cameras
from tiltvp.formats.stereo import read_stereo


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


@pytest.mark.parametrize("name", ["dist_coefs", "distortion_coefs", "distCoeffs1", "radial_distortion", "D1", "coeffs"])
def test_opencv_refuses_coefficients_under_a_name_that_is_not_read(read: Read, name: str) -> None:
    text = storage("camera_matrix", name, 5, SIZE)
    assert "expected distortion_coefficients or Distortion_Coefficients or" in message(read, text)
    assert message(read, text).endswith(f"at {name}")
    assert message(read, storage("K", "unread", 5, SIZE + "k1: -0.25\n")).endswith("at k1")
    # Matrices of a pair are none.
    pair = storage("K1", "R", 9, SIZE) + storage("K2", "P1", 12).split("---\n")[1]
    assert [camera.parameters["fx"] for camera in read(pair)] == [50.0, 50.0]
    # Coefficients of 0, and what is no number, change no lens.
    plain = "dist_type: none\nmarker_distance: [0.5, 0.5]\nundistorted_size: [64, 48]\ndist_coefs: [0, 0, 0, 0]\n"
    assert read(storage("camera_matrix", "unread", 5, SIZE + plain))[0].model == "pinhole"


def test_opencv_stereo_and_json(read: Read) -> None:
    two = storage("M1", "D1", 5, SIZE) + storage("M2", "D2", 8).split("---\n")[1]
    assert [camera.name for camera in read(two)] == ["cam0", "cam1"]
    text = (
        '{"image_width": 64, "image_height": 48, "camera_matrix": {"type_id": "opencv-matrix", "rows": 3, "cols": 3,'
        ' "dt": "d", "data": [50, 0, 32, 0, 51, 24, 0, 0, 1]}}'
    )
    assert read(text)[0].parameters == {"fx": 50.0, "fy": 51.0, "cx": 32.0, "cy": 24.0}


def test_what_opencv_tells_of_a_pair_alone_is_no_camera(read: Read, tmp_path: Path) -> None:
    """As the sample of cv::stereoCalibrate writes its extrinsics.yml; it was no known format."""
    said = message(read, storage("P1", "P2", 12, SIZE))
    assert "P1 and P2, projections of rectified images, without the cameras' own K1, D1, K2 and D2" in said
    path = tmp_path / "extrinsics.yml"
    path.write_text(storage("R", "T", 3))
    with pytest.raises(CalibrationError, match="pair of OpenCV, which is not read: its T may be in metres, milli"):
        read_stereo(path)


def test_written_by_opencv_itself(tmp_path: Path) -> None:
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


def test_numbers_that_are_shares_of_the_image_are_no_pixels(tmp_path: Path) -> None:
    path = tmp_path / "normalised.json"
    numbers = {"camera_matrix": [[0.6, 0, 0.5], [0, 0.8, 0.5], [0, 0, 1]], "distortion_coefficients": [0, 0, 0, 0, 0]}
    path.write_text(json.dumps(numbers | {"image_width": 640, "image_height": 480}))
    with pytest.raises(CalibrationError, match=r"0\.5\] of 640 x 480 pixels, expected pixels, not shares of the image"):
        read_cameras(path)
