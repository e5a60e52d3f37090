"""ROS camera_info, as the YAML of camera_calibration_parsers or as a printed sensor_msgs/CameraInfo.

`K` and the coefficients describe the raw image, so rectification, projection, binning and region are not looked at.
`plumb_bob` is k1 k2 p1 p2 [k3], `rational_polynomial` OpenCV's eight, `equidistant` and `fisheye` cv::fisheye's four,
to which drivers add a zero. Pixel centres are at integers, as in image_geometry and OpenCV.
"""

from __future__ import annotations

from collections.abc import Sequence

from tiltvp.formats.coefficients import brown_conrady, kannala_brandt, without_skew
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize
from tiltvp.formats.writing import brown_of, four_of, general, kannala_brandt_of, only_one, refuse
from tiltvp.formats.yaml_text import yaml_of

_MATRIX = ("camera_matrix", "K", "k")
_COEFFICIENTS = ("distortion_coefficients", "D", "d")
_BROWN = {"plumb_bob": (0, 4, 5), "rational_polynomial": (8, 12, 14), "radtan": (4, 5), "none": (0, 4, 5), "": (0,)}
_FISHEYE = ("equidistant", "fisheye", "kannala_brandt", "kannala_brandt4")


def recognise(document: Document) -> bool:
    """It has a camera matrix and a `distortion_model`."""
    return "distortion_model" in document.tree and any(key in document.tree for key in _MATRIX)


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The one camera of the file."""
    root = Node.root(document)
    size = root.image_size(image_size, root.get("image_width", "width"), root.get("image_height", "height"), "the file")
    model = root.need("distortion_model")
    word = model.text().lower()
    name = root.get("camera_name")
    title = name.text() if name else "cam0"
    coefficients = root.get(*_COEFFICIENTS)
    values = without_skew(root.need(*_MATRIX), f"the distortion model {word!r}")
    if word in _FISHEYE:
        values |= kannala_brandt(root.need(*_COEFFICIENTS), 5)
        return [root.spec("kannala_brandt", size, values, title)]
    if word not in _BROWN:
        known = [*_FISHEYE, *(key for key in _BROWN if key)]
        model.refuse(f"the distortion model {word!r} is not supported", "one of " + ", ".join(known))
    if coefficients is not None:
        coefficients.numbers(*_BROWN[word])
    elif word not in ("none", ""):
        root.need(*_COEFFICIENTS)
    return [root.spec("pinhole", size, values | brown_conrady(coefficients), title)]


def written(specs: Sequence[CameraSpec]) -> str:
    """The YAML of camera_calibration_parsers, of an image that is not rectified: R is the identity, P is K.

    Raises `UnsupportedFormatError`, also for several cameras.
    """
    spec = general(only_one(specs, "ROS"), "ROS")
    fx, fy, cx, cy = four_of(spec)
    if spec.model == "kannala_brandt":
        word, coefficients = "equidistant", kannala_brandt_of(spec)
    elif spec.model == "pinhole":
        coefficients = brown_of(spec)
        word = "rational_polynomial" if len(coefficients) == 8 else "plumb_bob"
        coefficients += [0.0] * (5 - len(coefficients))
    else:
        refuse(spec, "ROS", "pinhole and kannala_brandt")
    table = {
        "image_width": spec.width,
        "image_height": spec.height,
        "camera_name": spec.name,
        "camera_matrix": _matrix(3, [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]),
        "distortion_model": word,
        "distortion_coefficients": _matrix(1, coefficients),
        "rectification_matrix": _matrix(3, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
        "projection_matrix": _matrix(3, [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]),
    }
    return yaml_of(table)


def _matrix(rows: int, data: list[float]) -> dict[str, object]:
    return {"rows": rows, "cols": len(data) // rows, "data": data}
