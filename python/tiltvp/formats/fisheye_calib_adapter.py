"""fisheye-calib-adapter's YAML: groups `image` and `parameter`, in which the set of names tells the model.

UCM is the unified model written with alpha. OCamCalib's unproject applies the inverse of [[c, d], [e, 1]] to
(column, row) and takes z = +unprojection(rho) forward, so that polynomial is negated and the affine matrix rewritten
(`coefficients.ocam_from_column_affine`). `projection` is used with either sign of its angle there, so it is left to be
recomputed.
"""

from __future__ import annotations

from tiltvp.formats.coefficients import ocam_from_column_affine, unified_from_alpha
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize

_AFFINE = ("fx", "fy", "cx", "cy")
_OCAM = ("c", "d", "e", "cx", "cy", "coefficients")
_MODELS: dict[frozenset[str], str] = {
    frozenset(_AFFINE): "pinhole",
    frozenset((*_AFFINE, "k1", "k2", "p1", "p2")): "pinhole",
    frozenset((*_AFFINE, "k1", "k2", "k3", "p1", "p2")): "pinhole",
    frozenset((*_AFFINE, "k1", "k2", "k3", "k4")): "kannala_brandt",
    frozenset((*_AFFINE, "alpha")): "unified",
    frozenset((*_AFFINE, "alpha", "beta")): "extended_unified",
    frozenset((*_AFFINE, "alpha", "xi")): "double_sphere",
    frozenset(_OCAM): "ocam",
}


def recognise(document: Document) -> bool:
    """It has the groups `image` and `parameter`."""
    return isinstance(document.tree.get("image"), dict) and isinstance(document.tree.get("parameter"), dict)


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The one camera of the file."""
    root = Node.root(document)
    image = root.need("image")
    size = image.image_size(image_size, image.get("width"), image.get("height"), "the file")
    values = root.need("parameter")
    model = _MODELS.get(frozenset(values.tree))
    if model is None:
        sets = "; ".join(sorted(" ".join(sorted(keys)) for keys in _MODELS))
        values.refuse(f"no supported model has the parameters {' '.join(sorted(values.tree))}", f"one of: {sets}")
    if model == "ocam":
        return [_ocam(values, size)]
    parameters = values.named(*values.tree)
    if model == "unified":
        fx, fy, alpha = (values.need(key).number() for key in ("fx", "fy", "alpha"))
        del parameters["alpha"]
        parameters |= unified_from_alpha(values.need("alpha"), fx, fy, alpha)
    return [values.spec(model, size, parameters, "cam0")]


def _ocam(values: Node, size: ImageSize) -> CameraSpec:
    c, d, e = (values.need(key).number() for key in "cde")
    unprojection = values.need("coefficients").need("unprojection").numbers()
    parameters = ocam_from_column_affine(values.need("c"), [0.0 - a for a in unprojection], None, (c, d, e))
    parameters |= values.named("cx", "cy")
    return values.spec("ocam", size, parameters, "cam0", "projection is used with either sign; recomputed")
