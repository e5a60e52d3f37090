"""BoofCV's intrinsic YAML: `model` with a `pinhole` group; omnidirectional_universal is Mei's unified model.

`mirror_offset` is xi, `radial` k1 k2 [k3], t1 and t2 are OpenCV's p1 and p2, and `skew` is the entry (0, 1) of the
camera matrix (UniOmniPtoS, BundleUniversalOmni).
"""

from __future__ import annotations

from tiltvp.formats.coefficients import refuse_skew
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize, Parameters

_MODELS = ("pinhole", "pinhole_radial_tangential", "omnidirectional_universal")


def recognise(document: Document) -> bool:
    """It has `model` and a `pinhole` group."""
    return "model" in document.tree and isinstance(document.tree.get("pinhole"), dict)


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The one camera of the file."""
    root = Node.root(document)
    kind = root.need("model")
    if kind.text() not in _MODELS:
        kind.refuse(f"the BoofCV model {kind.text()!r} is not supported", "one of " + ", ".join(_MODELS))
    pinhole = root.need("pinhole")
    size = pinhole.image_size(image_size, pinhole.get("width"), pinhole.get("height"), "the file")
    values = pinhole.named("fx", "fy", "cx", "cy")
    skew = pinhole.get("skew")
    skew_px = skew.number() if skew else 0.0
    if kind.text() != "pinhole":
        values |= _radial_tangential(root.need("radial_tangential"))
    if kind.text() == "omnidirectional_universal":
        values = {"xi": root.need("mirror_offset").number(), **values}
        if skew_px != 0.0:
            values["skew"] = skew_px
        return [root.spec("unified", size, values, "cam0")]
    if skew is not None:
        refuse_skew(skew, skew_px, f"the BoofCV model {kind.text()!r}")
    return [root.spec("pinhole", size, values, "cam0")]


def _radial_tangential(group: Node) -> Parameters:
    radial = group.get("radial")
    values = radial.numbers(0, 1, 2, 3) if radial is not None and radial.value not in ("", None, "null") else []
    parameters: Parameters = dict(zip(("k1", "k2", "k3"), values, strict=False))
    for ours, theirs in (("p1", "t1"), ("p2", "t2")):
        tangential = group.get(theirs)
        if tangential is not None:
            parameters[ours] = tangential.number()
    return parameters
