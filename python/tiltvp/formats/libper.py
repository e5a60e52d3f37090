"""libPeR (MIXEDVISION) XML: one `camera`, or several in a `system`, of type Omni (0), without image size.

Omni is the unified model without distortion: u = au x / (z + xi) + u0 with (x, y, z) on the unit sphere.
"""

from __future__ import annotations

from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize


def recognise(document: Document) -> bool:
    """Its root has a `camera`, or a `system` of them."""
    root = Node(document, document.tree.get("root"))
    return document.is_xml and (root.has("camera") or root.has("system"))


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The cameras of the file, in file order, named cam0, cam1, ..."""
    root = Node.root(document).need("root")
    system = root.need("system") if root.has("system") else root
    found = system.need("camera")
    cameras = found.items() if isinstance(found.value, list) else [found]
    stated = system.get("NbCams")
    if stated is not None and stated.integer() != len(cameras):
        stated.fail(f"{len(cameras)} cameras", f"{stated.integer()} of them")
    return [_camera(camera, image_size, f"cam{index}") for index, camera in enumerate(cameras)]


def _camera(camera: Node, given: ImageSize | None, name: str) -> CameraSpec:
    kind = camera.need("type")
    if kind.integer() != 0:
        kind.refuse(f"the libPeR camera type {kind.integer()} is not supported", "0 (Omni)")
    size = camera.image_size(given, None, None, "the libPeR format")
    theirs = ("xi", "au", "av", "u0", "v0")
    ours = ("xi", "fx", "fy", "cx", "cy")
    values = {our: camera.need(their).number() for our, their in zip(ours, theirs, strict=True)}
    return camera.spec("unified", size, dict(values), name)
