"""OpenCV FileStorage (YAML, XML, JSON) with a camera matrix: pinhole, cv::fisheye, cv::omnidir; and MultiCol-SLAM's.

What tells the models apart, in this order: a word of the file (`fisheye_model: 1`, `model: fisheye`, ...), `xi`, the
number of coefficients. Four coefficients are k1 k2 p1 p2 to cv::calibrateCamera and k1 k2 k3 k4 to cv::fisheye; then
the names decide: `K` with `D`, the argument names of cv::fisheye, against all the others, of which a file that mentions
a fisheye is refused. The formats `opencv-pinhole` and `opencv-fisheye` say it outright. Pixel centres are at integers.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from tiltvp.errors import CalibrationError
from tiltvp.formats import multicol
from tiltvp.formats.coefficients import brown_conrady, camera_matrix, kannala_brandt, mei, refuse_skew
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize, Parameters
from tiltvp.formats.writing import brown_of, four_of, general, kannala_brandt_of, mei_of, only_one, refuse, value

_MATRIX = ("camera_matrix", "cameraMatrix", "Camera_Matrix", "CameraMatrix", "K", "M", "intrinsic_matrix", "mtx")
_COEFFICIENTS = (
    "distortion_coefficients",
    "Distortion_Coefficients",
    "distCoeffs",
    "dist_coeffs",
    "distortion_coeffs",
    "dist_coeff",
    "distCoeff",
    "distortion",
    "dist",
    "D",
)
_LIKE_COEFFICIENTS = re.compile(r"(?!.*undist).*(dist(?!anc)|coef).*|d\d?|[kp][1-6]", re.ASCII | re.IGNORECASE)
_MATRICES = re.compile(r"[KP]\d")
"""Of a stereo pair: the camera matrices, and the projections (3, 4) of rectified images."""
_WIDTH = ("image_width", "imageWidth", "image_Width", "img_width", "width", "Width")
_HEIGHT = ("image_height", "imageHeight", "image_Height", "img_height", "height", "Height")
_SIZE = ("image_size", "imageSize", "img_size", "resolution", "size")
_FLAGS = ("fisheye_model", "fisheye", "is_fisheye", "use_fisheye")
_WORDS = ("distortion_model", "model_type", "lens_model", "projection_model")
_LOOSE_WORDS = ("model", "camera_model", "cameraModel", "camera_type")
_SUFFIXES = ("", "1", "2", "_1", "_2", "_left", "_right", "Left", "Right", "L", "R")
_MODEL_OF_WORD = {
    "pinhole": "pinhole",
    "perspective": "pinhole",
    "plumb_bob": "pinhole",
    "rational_polynomial": "pinhole",
    "radtan": "pinhole",
    "fisheye": "fisheye",
    "equidistant": "fisheye",
    "kannala_brandt": "fisheye",
    "omnidir": "omnidir",
    "omni": "omnidir",
    "mei": "omnidir",
    "unified": "omnidir",
}


def recognise(document: Document) -> bool:
    """It has a camera matrix at the top and no ROS `distortion_model`, P1 and P2, or MultiCol-SLAM's `Camera.a0`."""
    tree = _storage(document)
    if "Camera.a0" in tree or _is_rectified_pair(tree):
        return True
    return "distortion_model" not in tree and any(key + tail in tree for key in _MATRIX for tail in _SUFFIXES)


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The cameras of the file: one, or one per numbered camera matrix."""
    return _parse(document, image_size, None)


def parse_as_pinhole(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """As `parse`, with the coefficients read as cv::calibrateCamera's."""
    return _parse(document, image_size, "pinhole")


def parse_as_fisheye(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """As `parse`, with the coefficients read as cv::fisheye's."""
    return _parse(document, image_size, "fisheye")


def never(document: Document) -> bool:
    """For a format that is only ever asked for by name."""
    del document
    return False


def is_pair(document: Document) -> bool:
    """Whether it is what cv::stereoCalibrate or cv::stereoRectify tells of two cameras."""
    tree = _storage(document)
    return {"R", "T"} <= tree.keys() or _is_rectified_pair(tree)


def _is_rectified_pair(tree: dict[str, object]) -> bool:
    return {"P1", "P2"} <= tree.keys()


def _storage(document: Document) -> dict[str, object]:
    tree = document.tree.get("opencv_storage", document.tree)
    return {str(key): value for key, value in tree.items()} if isinstance(tree, dict) else {}


def _parse(document: Document, image_size: ImageSize | None, kind: str | None) -> list[CameraSpec]:
    Node.root(document)
    root = Node(document, _storage(document))
    if kind is None and root.has("Camera.a0"):
        return [multicol.parse(root, image_size)]
    tails = [tail for tail in _SUFFIXES if any(root.has(key + tail) for key in _MATRIX)]
    if not tails and _is_rectified_pair(root.tree):
        root.fail(
            "P1 and P2, projections of rectified images, without the cameras' own K1, D1, K2 and D2",
            "those; or for rectified images a file with K, the first three columns of P1 or P2, alone",
        )
    if not tails:
        root.need(*_MATRIX)
    name = root.get("camera_name", "cameraName", "name")
    single = name.text() if name is not None and len(tails) == 1 else None
    return [_camera(root, tail, image_size, kind, single or f"cam{index}") for index, tail in enumerate(tails)]


def _camera(root: Node, tail: str, given: ImageSize | None, kind: str | None, name: str) -> CameraSpec:
    matrix = root.need(*(key + tail for key in _MATRIX))
    coefficients = root.get(*(key + tail for key in _COEFFICIENTS))
    if coefficients is None:
        _refuse_other_names(root)
    xi = root.get("xi" + tail, "Xi" + tail)
    size = _size(root, given)
    values, skew = camera_matrix(matrix)
    notes: tuple[str, ...] = ()
    stated = _stated(root, xi)
    if kind is not None and stated is not None and kind != stated:
        root.fail(f"the file says it is a {stated} camera", f"a {kind} camera, as format= says")
    kind = kind or stated
    if kind is None:
        kind, notes = _inferred(matrix, coefficients, xi)
    parameters: Parameters
    if kind == "omnidir":
        parameters = {"xi": root.need("xi" + tail, "Xi" + tail).numbers(1)[0], **values, **mei(coefficients)}
        if skew != 0.0:
            parameters["skew"] = skew
        return root.spec("unified", size, parameters, name, *notes)
    if xi is not None:
        xi.fail(f"found xi in a {kind} camera", "xi in a cv::omnidir camera only")
    refuse_skew(matrix, skew, f"a {kind} camera")
    if kind == "fisheye":
        if coefficients is None:
            root.fail("the four coefficients of a fisheye are missing", " or ".join(_COEFFICIENTS))
        return root.spec("kannala_brandt", size, values | kannala_brandt(coefficients), name, *notes)
    return root.spec("pinhole", size, values | brown_conrady(coefficients), name, *notes)


def _refuse_other_names(root: Node) -> None:
    """Refuses coefficients that stand under a name that is not read: the lens would be one without distortion."""
    for key in root.tree:
        if not _LIKE_COEFFICIENTS.fullmatch(key):
            continue
        node = root.need(key)
        try:
            numbers = node.numbers()
        except CalibrationError:  # A word about them.
            continue
        if any(numbers) and not (_MATRICES.fullmatch(key) and len(numbers) in (9, 12)):
            node.fail("looks like coefficients of a lens, under a name that is not read", " or ".join(_COEFFICIENTS))


def _stated(root: Node, xi: Node | None) -> str | None:
    """The model a flag or a word of the file names; a loose word may also be the name of a product."""
    flag = root.get(*_FLAGS)
    if flag is not None and not isinstance(flag.value, dict | list):
        return "fisheye" if flag.flag() else "pinhole" if xi is None else "omnidir"
    for keys, is_loose in ((_WORDS, False), (_LOOSE_WORDS, True)):
        word = root.get(*keys)
        if word is not None:
            model = _MODEL_OF_WORD.get(word.text().lower().replace("-", "_").replace(" ", "_"))
            if model is not None:
                return model
            if not is_loose:
                word.refuse(f"the lens model {word.text()!r} is not supported", "one of " + ", ".join(_MODEL_OF_WORD))
    return None


def _inferred(matrix: Node, coefficients: Node | None, xi: Node | None) -> tuple[str, tuple[str, ...]]:
    if xi is not None:
        return "omnidir", ()
    if coefficients is None or len(coefficients.numbers()) != 4:
        return "pinhole", ()
    if matrix.at.startswith("K") and coefficients.at.startswith("D"):
        return "fisheye", ("four coefficients named D beside K were read as cv::fisheye's k1 k2 k3 k4",)
    if "fisheye" in matrix.document.text.lower():
        coefficients.fail(
            "four coefficients in a file that mentions a fisheye can be k1 k2 p1 p2 or k1 k2 k3 k4",
            "format='opencv-pinhole' or format='opencv-fisheye'",
        )
    return "pinhole", ("four coefficients were read as cv::calibrateCamera's k1 k2 p1 p2",)


def _size(root: Node, given: ImageSize | None) -> ImageSize:
    both = root.get(*_SIZE)
    if both is None:
        return root.image_size(given, root.get(*_WIDTH), root.get(*_HEIGHT), "the file")
    if isinstance(both.value, dict) and "data" not in both.value:
        return both.image_size(given, both.get("width"), both.get("height"), "the file")
    width, height = (Node(root.document, value, both.at) for value in both.numbers(2))
    return both.image_size(given, width, height, "the file")


def written(specs: Sequence[CameraSpec]) -> str:
    """The text of a file of cv::FileStorage with the names that `parse` tells models by.

    Raises `UnsupportedFormatError`, also for several cameras.
    """
    spec = general(only_one(specs, "OpenCV"), "OpenCV")
    fx, fy, cx, cy = four_of(spec)
    skew, names = 0.0, ("camera_matrix", "distortion_coefficients")
    lines = [f"image_width: {spec.width}", f"image_height: {spec.height}", f"camera_name: {json.dumps(spec.name)}"]
    if spec.model == "pinhole":
        # Of five or eight numbers it is known whose they are.
        coefficients = [*brown_of(spec), 0.0] if len(brown_of(spec)) == 4 else brown_of(spec)
        lines.append("model: pinhole")
    elif spec.model == "kannala_brandt":
        coefficients, names = kannala_brandt_of(spec), ("K", "D")
        lines.append("model: fisheye")
    else:
        mei_four = mei_of(spec)
        if spec.model != "unified" or mei_four is None:
            refuse(spec, "OpenCV", "pinhole, kannala_brandt, and unified with k1 k2 p1 p2")
        coefficients, skew = mei_four, value(spec, "skew")
        lines += ["model: omnidir", _matrix("xi", [[value(spec, "xi")]])]
    lines.append(_matrix(names[0], [[fx, skew, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]))
    lines.append(_matrix(names[1], [coefficients]))
    return "\n".join(["%YAML:1.0", "---", *lines, ""])


def _matrix(name: str, rows: list[list[float]]) -> str:
    data = ", ".join(repr(number) for row in rows for number in row)
    head = f"{name}: !!opencv-matrix\n   rows: {len(rows)}\n   cols: {len(rows[0])}\n   dt: d\n"
    return f"{head}   data: [ {data} ]"
