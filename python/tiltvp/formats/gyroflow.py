"""Gyroflow's lens profile JSON: OpenCV fisheye (the default) or OpenCV standard, at `calib_dimension`."""

from __future__ import annotations

from tiltvp.formats.coefficients import brown_conrady, kannala_brandt, without_skew
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize

_FISHEYE = "opencv_fisheye"
_STANDARD = "opencv_standard"


def recognise(document: Document) -> bool:
    """It has `calib_dimension` or `fisheye_params`."""
    return "fisheye_params" in document.tree or "calib_dimension" in document.tree


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The one camera of the profile."""
    root = Node.root(document)
    size_node = root.need("calib_dimension")
    size = size_node.image_size(image_size, size_node.need("w"), size_node.need("h"), "the profile")
    for key in ("input_horizontal_stretch", "input_vertical_stretch"):
        stretch = root.get(key)
        if stretch is not None and stretch.value is not None and stretch.number() not in (0.0, 1.0):
            stretch.refuse(f"a stretch of {stretch.number()!r} is not supported", "1")
    digital = root.get("digital_lens")
    if digital is not None and digital.value:
        digital.refuse("a digital lens is not supported", "none")
    model = _model(root)
    group = root.need("fisheye_params" if model == _FISHEYE else "calib_params")
    if model == _STANDARD and not group.has("camera_matrix"):
        group = root.need("fisheye_params")
    values = without_skew(group.need("camera_matrix"), "a lens profile")
    coefficients = group.need("distortion_coeffs")
    name = root.get("name")
    title = name.text() if name else "cam0"
    if model == _FISHEYE:
        return [group.spec("kannala_brandt", size, values | kannala_brandt(coefficients), title)]
    return [group.spec("pinhole", size, values | brown_conrady(coefficients), title)]


def _model(root: Node) -> str:
    stated = root.get("distortion_model")
    if stated is not None and stated.value:
        if stated.text() not in (_FISHEYE, _STANDARD):
            stated.refuse(f"the lens model {stated.text()!r} is not supported", f"{_FISHEYE} or {_STANDARD}")
        return stated.text()
    fisheye, standard = root.get("use_opencv_fisheye"), root.get("use_opencv_standard")
    is_fisheye = fisheye is None or fisheye.flag()
    is_standard = standard is not None and standard.flag()
    if not is_fisheye and not is_standard:
        root.refuse("a profile that uses neither of OpenCV's models is not supported", f"{_FISHEYE} or {_STANDARD}")
    return _FISHEYE if is_fisheye else _STANDARD
