"""Small calibration files of every format, with invented numbers, and what each has to be read as."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Sample:
    """The text of a file, the format it has to be recognised as, and its first camera."""

    format: str
    text: str
    model: str
    size: tuple[int, int]
    parameters: dict[str, Any]
    cameras: int = 1
    name: str = "cam0"
    image_size: tuple[int, int] | None = None


AFFINE = {"fx": 210.5, "fy": 211.25, "cx": 318.5, "cy": 241.75}
KB = {"k1": 0.0125, "k2": -3.5e-3, "k3": 1e-5, "k4": -2.5e-06}
RADTAN = {"k1": -0.25, "k2": 0.0625, "p1": 1e-4, "p2": -2e-4}

OCAM = {
    "polynomial": [-205.5, 0.0, 1.5e-3, -2e-6, 6.25e-9],
    "inverse_polynomial": [301.5, 160.25, -8.5, 21.0],
    "c": 1.0005,
    "d": -0.00025,
    "e": 0.000125,
    "cx": 321.5,
    "cy": 238.25,
}

OCAMCALIB = """#polynomial coefficients for the DIRECT mapping function

5 -2.055000e+002 0.000000e+000 1.500000e-003 -2.000000e-006 6.250000e-009

# inverse

4 301.500000 160.250000 -8.500000 21.000000

#center: "row" and "column", starting from 0 (C convention)

238.250000 321.500000

#affine parameters "c", "d", "e"

1.000500 -0.000250 0.000125

#image size: "height" and "width"

480 640
"""

OMNI_CAM = "640 480\n-205.5 0 1.5e-3 -2e-6 6.25e-9\n321.5 238.25\n1.0005 -2.5e-4 1.25e-4\n" + " ".join(
    f"{x}.5" for x in range(300, 312)
)

PYOCAMCALIB = """{"camera_name": "gate", "taylor_coefficient": [205.5, 0.0, -0.0015, 2e-06, -6.25e-09],
 "distortion_center": [321.5, 238.25], "stretch_matrix": [[1.0, 0.0], [0.0, 1.0]], "inverse_poly": [3.0, 2.0, 1.0],
 "rms_overall": 0.25}"""

OPENCV_PINHOLE = """%YAML:1.0
---
calibration_time: "Sun 01 Jan 2023"
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 210.5, 0., 318.5, 0., 2.1125e+02, 241.75, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.5e-01, 6.25e-02, 1e-4,
       -2e-4, 5e-3 ]
"""

OPENCV_FISHEYE = """%YAML:1.0
---
model: fisheye
image_size: [640, 480]
K: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 210.5, 0., 318.5, 0., 211.25, 241.75, 0., 0., 1. ]
D: !!opencv-matrix
   rows: 4
   cols: 1
   dt: d
   data: [ 0.0125, -3.5e-3, 1e-5, -2.5e-06 ]
"""

OPENCV_OMNIDIR_XML = """<?xml version="1.0"?>
<opencv_storage>
<image_width>640</image_width>
<image_height>480</image_height>
<camera_matrix type_id="opencv-matrix">
  <rows>3</rows><cols>3</cols><dt>d</dt>
  <data>210.5 0.125 318.5 0. 211.25 241.75 0. 0. 1.</data></camera_matrix>
<xi type_id="opencv-matrix"><rows>1</rows><cols>1</cols><dt>d</dt><data>1.375</data></xi>
<distortion_coefficients type_id="opencv-matrix">
  <rows>1</rows><cols>4</cols><dt>d</dt>
  <data>-0.25 0.0625 1e-4 -2e-4</data></distortion_coefficients>
</opencv_storage>
"""

MULTICOL = """%YAML:1.0
Camera.Iw: 640
Camera.Ih: 480
Camera.nrpol: 3
Camera.nrinvpol: 2
Camera.a0: -205.5
Camera.a1: 0.0
Camera.a2: 0.0015
Camera.pol0: 301.5
Camera.pol1: 160.25
Camera.c: 1.0
Camera.d: 0.0
Camera.e: 0.0
Camera.u0: 321.5
Camera.v0: 238.25
"""

KALIBR = """cam0:
  T_cam_imu:
  - [1.0, 0.0, 0.0, 0.0]
  camera_model: pinhole
  distortion_coeffs: [0.0125, -3.5e-3, 1e-5, -2.5e-06]
  distortion_model: equidistant
  intrinsics: [210.5, 211.25, 318.5, 241.75]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - - 1.0
    - 0.0
  camera_model: omni
  distortion_coeffs:
  - -0.25
  - 0.0625
  - 1e-4
  - -2e-4
  distortion_model: radtan
  intrinsics: [1.375, 210.5, 211.25, 318.5, 241.75]
  resolution:
  - 640
  - 480
"""

BASALT = """{"value0": {"T_imu_cam": [], "intrinsics": [
 {"camera_type": "ds", "intrinsics": {"fx": 210.5, "fy": 211.25, "cx": 318.5, "cy": 241.75, "xi": -0.25, "alpha": 0.5}},
 {"camera_type": "ucm", "intrinsics": {"fx": 210.5, "fy": 211.25, "cx": 318.5, "cy": 241.75, "alpha": 0.5}}],
 "resolution": [[640, 480], [640, 480]]}}"""

COLMAP = """# Camera list with one line of data per camera:
#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]
# Number of cameras: 2
7 OPENCV_FISHEYE 640 480 210.5 211.25 319.0 242.25 0.0125 -3.5e-3 1e-5 -2.5e-06
3 SIMPLE_RADIAL 640 480 210.5 320 240 -0.25
"""

ROS = """image_width: 640
image_height: 480
camera_name: gate
camera_matrix:
  rows: 3
  cols: 3
  data: [210.5, 0, 318.5, 0, 211.25, 241.75, 0, 0, 1]
distortion_model: equidistant
distortion_coefficients:
  rows: 1
  cols: 4
  data: [0.0125, -3.5e-3, 1e-5, -2.5e-06]
"""

CAMODOCAL = """%YAML:1.0
---
model_type: kannala_brandt
camera_name: gate
image_width: 640
image_height: 480
projection_parameters:
   k2: 0.0125
   k3: -3.5e-3
   k4: 1e-5
   k5: -2.5e-06
   mu: 210.5
   mv: 211.25
   u0: 318.5
   v0: 241.75
"""

CAMODOCAL_OCAM = """%YAML:1.0
model_type: SCARAMUZZA
image_width: 640
image_height: 480
poly_parameters:
   p0: -205.5
   p1: 0.0
   p2: 0.0015
inv_poly_parameters:
   p0: 301.5
   p1: 160.25
affine_parameters:
   ac: 1.0
   ad: 0.0
   ae: 0.0
   cx: 321.5
   cy: 238.25
"""

WOODSCAPE = """{"extrinsic": {"quaternion": [0, 0, 0, 1]}, "name": "FV",
 "intrinsic": {"aspect_ratio": 1.25, "cx_offset": 2.5, "cy_offset": -3.5, "height": 480.0, "width": 640.0,
  "k1": 340.5, "k2": -32.25, "k3": 48.5, "k4": -7.25, "model": "radial_poly", "poly_order": 4}}"""

VIKIT = (
    "cameras:\n- camera:\n    distortion: {type: none}\n    image_height: 480\n    image_width: 640\n"
    "    intrinsics:\n      cols: 1\n      rows: 24\n      data: [-205.5, 0, 1.5e-3, -2e-6, 6.25e-9, 321.5, 238.25, "
    "1.0005, -2.5e-4, 1.25e-4, " + ", ".join(f"{x}.5" for x in range(300, 312)) + ", 0.0, 1.0]\n"
    "    label: left\n    type: omni\n"
)

STELLA = """Camera:
  name: "shop"
  setup: "monocular"
  model: "equirectangular"
  fps: 30.0
  cols: 640
  rows: 480
Feature:
  scale_factor: 1.2
"""

ORBSLAM = """%YAML:1.0
File.version: "1.0"
Camera.type: "KannalaBrandt8"
Camera1.fx: 210.5
Camera1.fy: 211.25
Camera1.cx: 318.5
Camera1.cy: 241.75
Camera1.k1: 0.0125
Camera1.k2: -3.5e-3
Camera1.k3: 1e-5
Camera1.k4: -2.5e-06
Camera.width: 640
Camera.height: 480
"""

BOOFCV = """# Omnidirectional camera model
pinhole:
  fx: 210.5
  fy: 211.25
  cx: 318.5
  cy: 241.75
  width: 640
  height: 480
  skew: 0.0
model: omnidirectional_universal
radial_tangential:
  radial:
  - -0.25
  - 0.0625
  t1: 1.0E-4
  t2: -2.0E-4
mirror_offset: 1.375
"""

ADAPTER = """image:
  width: 640
  height: 480
parameter:
  fx: 210.5
  fy:  211.25
  cx: 318.5
  cy: 241.75
  alpha: 0.5
  beta: 1.125
"""

ADAPTER_OCAM = """image: {width: 640, height: 480}
parameter:
  c: 1.0
  d: 0.0
  e: 0.0
  cx: 321.5
  cy: 238.25
  coefficients:
    projection: [301.5, 160.25]
    unprojection: [2.055e+02, 0.0, -1.5e-3]
"""

LIBPER = """<?xml version="1.0"?>
<root><!--two of them--><system><NbCams>2</NbCams>
<camera><name>Omni</name><type>0</type><au>210.5</au><av>211.25</av><u0>318.5</u0><v0>241.75</v0><xi>1.375</xi></camera>
<camera><name>Omni</name><type>0</type><au>209.5</au><av>211.25</av><u0>318.5</u0><v0>241.75</v0><xi>1.5</xi></camera>
</system></root>"""

GYROFLOW = """{"name": "lens", "calib_dimension": {"w": 640, "h": 480}, "use_opencv_fisheye": true,
 "input_horizontal_stretch": 1.0, "fisheye_params": {"camera_matrix": [[210.5, 0.0, 318.5], [0.0, 211.25, 241.75],
 [0.0, 0.0, 1.0]], "distortion_coeffs": [0.0125, -0.0035, 1e-05, -2.5e-06]}}"""

OMNICALIB = """poly_incident_angle_to_radius: [0.0, 200.5, -11.5]
poly_radius_to_z: [205.5, 0.0, -0.0015]
principal_point: [321.5, 238.25]
extrinsics:
- - - 1.0
"""

OWN = """format = "tiltvp-camera"
version = 1

[[camera]]
name = "gate"
model = "equidistant"
width = 640
height = 480

[camera.parameters]
focal_px = 139.7
cx = 319.5
cy = 239.5
"""

_SHORT = {"polynomial": [-205.5, 0.0, 0.0015], "c": 1.0, "d": 0.0, "e": 0.0, "cx": 321.5, "cy": 238.25}
_INVERSE = {"inverse_polynomial": [301.5, 160.25]}
_LONG = {"inverse_polynomial": [x + 0.5 for x in range(300, 312)]}
_MEI = {"xi": 1.375, **AFFINE, **RADTAN}
_SIZE = (640, 480)

SAMPLES: dict[str, Sample] = {
    "own": Sample("tiltvp", OWN, "equidistant", _SIZE, {"focal_px": 139.7, "cx": 319.5, "cy": 239.5}, name="gate"),
    "ocamcalib": Sample("ocamcalib", OCAMCALIB, "ocam", _SIZE, OCAM),
    "omni_cam": Sample("ocamcalib", OMNI_CAM, "ocam", _SIZE, OCAM | _LONG),
    "pyocamcalib": Sample(
        "pyocamcalib",
        PYOCAMCALIB,
        "ocam",
        _SIZE,
        _SHORT | {"polynomial": OCAM["polynomial"]},
        name="gate",
        image_size=_SIZE,
    ),
    "opencv_pinhole": Sample("opencv", OPENCV_PINHOLE, "pinhole", _SIZE, AFFINE | RADTAN | {"k3": 5e-3}),
    "opencv_fisheye": Sample("opencv", OPENCV_FISHEYE, "kannala_brandt", _SIZE, AFFINE | KB),
    "opencv_omnidir": Sample("opencv", OPENCV_OMNIDIR_XML, "unified", _SIZE, _MEI | {"skew": 0.125}),
    "multicol": Sample("opencv", MULTICOL, "ocam", _SIZE, _SHORT | _INVERSE),
    "kalibr": Sample("kalibr", KALIBR, "kannala_brandt", _SIZE, AFFINE | KB, cameras=2),
    "basalt": Sample("basalt", BASALT, "double_sphere", _SIZE, AFFINE | {"xi": -0.25, "alpha": 0.5}, cameras=2),
    "colmap": Sample("colmap", COLMAP, "kannala_brandt", _SIZE, AFFINE | KB, cameras=2, name="cam7"),
    "ros": Sample("ros", ROS, "kannala_brandt", _SIZE, AFFINE | KB, name="gate"),
    "camodocal": Sample("camodocal", CAMODOCAL, "kannala_brandt", _SIZE, AFFINE | KB, name="gate"),
    "camodocal_ocam": Sample("camodocal", CAMODOCAL_OCAM, "ocam", _SIZE, _SHORT | _INVERSE),
    "woodscape": Sample(
        "woodscape",
        WOODSCAPE,
        "radial_polynomial",
        _SIZE,
        {"k1": 340.5, "k2": -32.25, "k3": 48.5, "k4": -7.25, "aspect_ratio": 1.25, "cx": 322.0, "cy": 236.0},
        name="FV",
    ),
    "vikit": Sample("vikit", VIKIT, "ocam", _SIZE, OCAM | _LONG, name="left"),
    "stella": Sample("stella-vslam", STELLA, "equirectangular", _SIZE, {}, name="shop"),
    "orbslam": Sample("orbslam3", ORBSLAM, "kannala_brandt", _SIZE, AFFINE | KB),
    "boofcv": Sample("boofcv", BOOFCV, "unified", _SIZE, _MEI),
    "adapter": Sample(
        "fisheye-calib-adapter", ADAPTER, "extended_unified", _SIZE, AFFINE | {"alpha": 0.5, "beta": 1.125}
    ),
    "adapter_ocam": Sample("fisheye-calib-adapter", ADAPTER_OCAM, "ocam", _SIZE, _SHORT),
    "libper": Sample("libper", LIBPER, "unified", _SIZE, {"xi": 1.375, **AFFINE}, cameras=2, image_size=_SIZE),
    "gyroflow": Sample("gyroflow", GYROFLOW, "kannala_brandt", _SIZE, AFFINE | KB, name="lens"),
    "omnicalib": Sample("py-omnicalib", OMNICALIB, "ocam", _SIZE, _SHORT, image_size=_SIZE),
}
