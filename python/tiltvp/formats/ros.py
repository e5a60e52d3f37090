"""ROS camera_info, as the YAML of camera_calibration_parsers or as a printed sensor_msgs/CameraInfo.

`K` and the coefficients describe the raw image, so rectification, projection, binning and region are not looked at.
`plumb_bob` is k1 k2 p1 p2 [k3], `rational_polynomial` OpenCV's eight, `equidistant` and `fisheye` cv::fisheye's four.
Pixel centres are at integers, as in image_geometry and OpenCV.
"""

from __future__ import annotations

from tiltvp.formats.coefficients import brown_conrady, kannala_brandt, without_skew
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize

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
        values |= kannala_brandt(root.need(*_COEFFICIENTS))
        return [root.spec("kannala_brandt", size, values, title)]
    if word not in _BROWN:
        known = [*_FISHEYE, *(key for key in _BROWN if key)]
        model.refuse(f"the distortion model {word!r} is not supported", "one of " + ", ".join(known))
    if coefficients is not None:
        coefficients.numbers(*_BROWN[word])
    elif word not in ("none", ""):
        root.need(*_COEFFICIENTS)
    return [root.spec("pinhole", size, values | brown_conrady(coefficients), title)]
