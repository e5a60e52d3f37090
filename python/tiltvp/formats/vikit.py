"""vikit and SVO YAML: flat `cam_model`, one camera with `type` and `intrinsics`, or a rig of `cameras`.

`omni` intrinsics are five coefficients, the centre as column and row, c, d, e, twelve inverse coefficients and two
relative radii of a mask, which is not part of the camera. Its OmniProjection applies [[1, e], [d, c]] to (column, row)
and takes z = -f(rho): OCamCalib's camera with the centre written the other way round.
"""

from __future__ import annotations

from tiltvp.formats.coefficients import brown_conrady, four, kannala_brandt
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize, Parameters

_RADTAN = ("Pinhole", "PinholeRadialTangential")
_EQUIDISTANT = ("PinholeEquidistant", "EquidistantCamera")
_TYPES = ("pinhole with none, radial-tangential or equidistant", "omni")


def recognise(document: Document) -> bool:
    """It has `cam_model` at the top or in a `camN`, or `intrinsics` beside `type`, or a list of such `cameras`."""
    top = Node(document, document.tree)
    if top.has("cam_model") or top.has("type", "intrinsics"):
        return True
    rig = document.tree.get("cameras")
    if isinstance(rig, list) and rig and isinstance(rig[0], dict) and "camera" in rig[0]:
        return True
    return any(Node(document, value).has("cam_model") for value in document.tree.values())


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The cameras of the file, in file order."""
    root = Node.root(document)
    if root.has("cam_model"):
        return [_flat(root, image_size, "cam0")]
    if root.has("cameras"):
        cameras = root.need("cameras").items()
        if not cameras:
            root.fail("there is no camera", "a list of cameras")
        return [_typed(item.need("camera"), image_size, f"cam{i}") for i, item in enumerate(cameras)]
    if root.has("intrinsics"):
        return [_typed(root, image_size, "cam0")]
    keys = [key for key, value in root.tree.items() if Node(document, value).has("cam_model")]
    if not keys:
        root.need("cam_model")
    return [_flat(root.need(key), image_size, key) for key in keys]


def _flat(camera: Node, given: ImageSize | None, name: str) -> CameraSpec:
    size = camera.image_size(given, camera.get("cam_width"), camera.get("cam_height"), "the camera")
    model = camera.need("cam_model")
    kind = model.text()
    if kind not in _RADTAN + _EQUIDISTANT:
        model.refuse(f"the vikit model {kind!r} is not supported", "one of " + ", ".join(_RADTAN + _EQUIDISTANT))
    scale = camera.get("scale")
    if scale is not None and scale.number() != 1.0:
        scale.refuse(f"a scale of {scale.number()!r} is not supported", "1")
    values: Parameters = {key: camera.need(f"cam_{key}").number() for key in ("fx", "fy", "cx", "cy")}
    if kind in _EQUIDISTANT:
        prefix, first = ("k", 1) if kind == "EquidistantCamera" else ("cam_d", 0)
        values |= {f"k{i + 1}": camera.need(f"{prefix}{i + first}").number() for i in range(4)}
        return camera.spec("kannala_brandt", size, values, name)
    for index, key in enumerate(("k1", "k2", "p1", "p2", "k3")):
        coefficient = camera.get(f"cam_d{index}")
        if coefficient is not None:
            values[key] = coefficient.number()
    for index in range(5, 14):
        further = camera.get(f"cam_d{index}")
        if further is not None and further.number() != 0.0:
            further.refuse("more than five coefficients are not supported", "zero")
    return camera.spec("pinhole", size, values, name)


def _typed(camera: Node, given: ImageSize | None, fallback: str) -> CameraSpec:
    size = camera.image_size(given, camera.get("image_width"), camera.get("image_height"), "the camera")
    label = camera.get("label")
    name = label.text() if label else fallback
    model = camera.need("type")
    lens = camera.get("distortion")
    lens_type = lens.need("type") if lens else model
    lens_word = lens_type.text() if lens else "none"
    intrinsics = camera.need("intrinsics")
    if model.text() == "omni":
        n = intrinsics.numbers(24)
        parameters: Parameters = {"polynomial": n[:5], "cx": n[5], "cy": n[6], "c": n[7], "d": n[8], "e": n[9]}
        parameters["inverse_polynomial"] = n[10:22]
        return camera.spec("ocam", size, parameters, name)
    if model.text() != "pinhole":
        model.refuse(f"the vikit camera type {model.text()!r} is not supported", " or ".join(_TYPES))
    values = four(intrinsics.numbers(4))
    if lens is None or lens_word == "none":
        return camera.spec("pinhole", size, values, name)
    if lens_word == "radial-tangential":
        coefficients = lens.need("parameters")
        coefficients.numbers(4)
        return camera.spec("pinhole", size, values | brown_conrady(coefficients), name)
    if lens_word == "equidistant":
        return camera.spec("kannala_brandt", size, values | kannala_brandt(lens.need("parameters")), name)
    lens_type.refuse(f"the vikit distortion {lens_word!r} is not supported", "none, radial-tangential or equidistant")
