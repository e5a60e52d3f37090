"""ORB-SLAM2 and ORB-SLAM3 settings YAML: `Camera1.fx`, `Camera2.fx`, or the older `Camera.fx`.

`KannalaBrandt8` is cv::fisheye's model, `PinHole` k1 k2 p1 p2 [k3], `Rectified` has no distortion. OpenCV's meaning.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize

_TYPES = ("PinHole", "KannalaBrandt8", "Rectified")
_AFFINE = ("fx", "fy", "cx", "cy")
_COEFFICIENTS: Final = {"pinhole": ("k1", "k2", "p1", "p2", "k3"), "kannalabrandt8": ("k1", "k2", "k3", "k4")}
_COEFFICIENT: Final = re.compile(r"(Camera[12]?)\.([kp]\d)", re.ASCII)


def recognise(document: Document) -> bool:
    """It has a focal length or a type of camera among its `Camera.` keys, and is not MultiCol-SLAM's or OpenVSLAM's."""
    tree = document.tree
    if "Camera.a0" in tree or "Camera.model" in tree:
        return False
    return any(key in tree for key in ("Camera1.fx", "Camera.fx", "Camera.type"))


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The cameras of the file, in file order."""
    root = Node.root(document)
    size = root.image_size(image_size, root.get("Camera.width"), root.get("Camera.height"), "the file")
    kind = root.get("Camera.type")
    word = kind.text() if kind else "PinHole"
    if kind is not None and word.lower() not in [known.lower() for known in _TYPES]:
        kind.refuse(f"the ORB-SLAM camera type {word!r} is not supported", "one of " + ", ".join(_TYPES))
    prefixes = [prefix for prefix in ("Camera1", "Camera2", "Camera") if root.has(f"{prefix}.fx")]
    if not prefixes:
        root.need("Camera1.fx", "Camera.fx")
    _refuse_unread(root, prefixes, word)
    return [_camera(root, prefix, word.lower(), size, f"cam{index}") for index, prefix in enumerate(prefixes)]


def _refuse_unread(root: Node, prefixes: Sequence[str], word: str) -> None:
    """Refuses coefficients of another type of camera, and of a camera that is not there."""
    read = _COEFFICIENTS.get(word.lower())
    if read is None:
        return
    for key in root.tree:
        found = _COEFFICIENT.fullmatch(key)
        if found and (found[1] not in prefixes or found[2] not in read) and root.need(key).number() != 0.0:
            root.need(key).fail(f"is not read of a {word} camera", f"{', '.join(read)} of {' and '.join(prefixes)}")


def _camera(root: Node, prefix: str, word: str, size: ImageSize, name: str) -> CameraSpec:
    values = {key: root.need(f"{prefix}.{key}").number() for key in _AFFINE}
    if word == "kannalabrandt8":
        values |= {key: root.need(f"{prefix}.{key}").number() for key in _COEFFICIENTS[word]}
        return root.spec("kannala_brandt", size, dict(values), name)
    if word == "pinhole":
        for key in _COEFFICIENTS[word]:
            coefficient = root.get(f"{prefix}.{key}")
            if coefficient is not None:
                values[key] = coefficient.number()
    return root.spec("pinhole", size, dict(values), name)
