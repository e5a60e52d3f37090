"""Calibrations with a fault are refused by one sentence; harmless variants are read."""

from __future__ import annotations

import pytest

from calibration_reading import Read, edited, message
from calibration_texts import AFFINE, KB, OCAM, SAMPLES

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
    "orbslam k4 of a pinhole": (edited("orbslam", ("KannalaBrandt8", "PinHole")), "is not read of a PinHole camera"),
    "orbslam k1 of no camera": (
        edited("orbslam", ("Camera1.k1: 0.0125", "Camera1.k1: 0\nCamera.k1: 0.0125")),
        "Camera.k1",
    ),
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
    "ocam affine": (edited("ocamcalib", ("1.000500", "-1.0")), "positive determinant"),
    "nan": (edited("kalibr", ("210.5", ".nan")), "found .nan, expected a finite number"),
    "inf": (edited("basalt", ('"fx": 210.5', '"fx": Infinity')), "found inf, expected a finite number"),
    "overflow": (edited("ocamcalib", ("301.500000", "1e999")), "expected a finite number"),
    "wrong type": (edited("kalibr", ("[210.5, 211.25, 318.5, 241.75]", "high")), "found 'high', expected a number"),
    "underscore": (edited("camodocal", ("210.5", "2_1_0.5")), "found '2_1_0.5', expected a number"),
    "fraction of a pixel": (edited("camodocal", ("640", "640.5")), "expected a whole number, at image_width"),
    "a list for a side": (
        edited("own", ("width = 640", "width = [640]")),
        "a list of 1, expected a number, at camera[0].width",
    ),
    "a list for an angle": (
        edited("own", ("width = 640", "max_theta_rad = [1.5]\nwidth = 640")),
        "a list of 1, expected a number, at camera[0].max_theta_rad",
    ),
    "a list for a focal length": (
        edited("camodocal", ("mu: 210.5", "mu: [210.5]")),
        "a list of 1, expected a number, at projection_parameters.mu",
    ),
    "zero width": (edited("camodocal", ("640", "0")), "width = 0, expected 1 to 100000 pixels"),
    "negative focal": (
        edited("camodocal", ("mu: 210.5", "mu: -210.5")),
        "fx = -210.5, expected a positive finite number",
    ),
    "missing key": (edited("kalibr", ("intrinsics", "intrinsic")), "intrinsics is missing (there is 'intrinsic')"),
    "twice, differing": (edited("camodocal", ("   mv:", "   mu: 3.0\n   mv:")), "'mu' twice with different values"),
    "twice in JSON": (edited("woodscape", ('"k2"', '"k1"')), "'k1' twice with different values"),
    "own version": (edited("own", ("version = 1", "version = 2")), "version 2 is not supported"),
    "own key": (edited("own", ("width", "widht")), "unknown key 'widht', expected one of width"),
    "own parameter": (edited("own", ("focal_px", "focal")), 'parameter = "focal", expected one of: focal_px, cx, cy'),
    "own model": (edited("own", ("equidistant", "equidist")), 'model = "equidist"'),
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
