"""WoodScape's calibration JSON: rho = k1 theta + k2 theta^2 + k3 theta^3 + k4 theta^4.

Its projection has u = rho x / chi + cx_offset + width / 2 - 0.5 and v = aspect_ratio rho y / chi + cy_offset +
height / 2 - 0.5 with the centre of the top left pixel at (0, 0), so the centre is offset + size / 2 - 0.5.
"""

from __future__ import annotations

from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize

_COEFFICIENTS = ("k1", "k2", "k3", "k4")
_KEYS = (*_COEFFICIENTS, "aspect_ratio", "cx_offset", "cy_offset", "height", "width", "model", "poly_order")


def recognise(document: Document) -> bool:
    """It has `intrinsic` with `cx_offset` or a `model` of polynomials."""
    intrinsic = Node(document, document.tree.get("intrinsic"))
    return intrinsic.has("cx_offset") or intrinsic.has("poly_order") or intrinsic.has("model")


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The one camera of the file."""
    root = Node.root(document)
    values = root.need("intrinsic")
    model = values.need("model")
    if model.text() != "radial_poly":
        model.refuse(f"the WoodScape model {model.text()!r} is not supported", "radial_poly")
    order = values.get("poly_order")
    if order is not None and order.integer() != len(_COEFFICIENTS):
        order.refuse(f"a polynomial of order {order.integer()} is not supported", "order 4")
    values.only(*_KEYS)
    size = values.image_size(image_size, values.get("width"), values.get("height"), "the file")
    parameters = values.named(*_COEFFICIENTS, "aspect_ratio")
    parameters["cx"] = values.need("cx_offset").number() + size[0] / 2.0 - 0.5
    parameters["cy"] = values.need("cy_offset").number() + size[1] / 2.0 - 0.5
    name = root.get("name")
    return [values.spec("radial_polynomial", size, parameters, name.text() if name else "cam0")]
