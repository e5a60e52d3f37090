"""stella_vslam (OpenVSLAM) YAML: `Camera` with model perspective, fisheye or equirectangular.

Older files have flat keys (`Camera.model`). The coefficients have OpenCV's meaning and so have the pixel centres.
"""

from __future__ import annotations

from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize

_MODELS = {
    "perspective": ("pinhole", ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")),
    "fisheye": ("kannala_brandt", ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4")),
    "equirectangular": ("equirectangular", ()),
}


def recognise(document: Document) -> bool:
    """It has a `model` under `Camera`."""
    return Node(document, document.tree.get("Camera")).has("model") or "Camera.model" in document.tree


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The one camera of the file."""
    root = Node.root(document)
    if root.has("Camera"):
        camera = root.need("Camera")
    else:
        flat = {key.removeprefix("Camera."): value for key, value in root.tree.items() if key.startswith("Camera.")}
        camera = Node(document, flat, "Camera")
    kind = camera.need("model")
    known = _MODELS.get(kind.text())
    if known is None:
        kind.refuse(f"the stella_vslam model {kind.text()!r} is not supported", "one of " + ", ".join(_MODELS))
    size = camera.image_size(image_size, camera.get("cols"), camera.get("rows"), "the file")
    name = camera.get("name")
    return [camera.spec(known[0], size, camera.named(*known[1]), name.text() if name else "cam0")]
