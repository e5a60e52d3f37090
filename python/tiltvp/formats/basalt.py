"""Basalt's calibration JSON: `value0.intrinsics[i]` of type ds, eucm, ucm, kb4 or pinhole, and `value0.resolution[i]`.

`ucm` is the unified model written with alpha (`coefficients.unified_from_alpha`). Pixel centres are at integers.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

from tiltvp.formats.coefficients import unified_from_alpha
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize
from tiltvp.formats.writing import brown_of, general, mei_of, refuse, value

_KEYS = {
    "ds": ("double_sphere", ("fx", "fy", "cx", "cy", "xi", "alpha")),
    "eucm": ("extended_unified", ("fx", "fy", "cx", "cy", "alpha", "beta")),
    "ucm": ("unified", ("fx", "fy", "cx", "cy", "alpha")),
    "kb4": ("kannala_brandt", ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4")),
    "pinhole": ("pinhole", ("fx", "fy", "cx", "cy")),
}


def recognise(document: Document) -> bool:
    """It has `value0.intrinsics`."""
    return Node(document, document.tree.get("value0")).has("intrinsics")


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The cameras of the file, in file order."""
    root = Node.root(document).need("value0")
    cameras = root.need("intrinsics").items()
    resolution = root.get("resolution")
    sizes = resolution.items() if resolution else []
    if not cameras:
        root.fail("there is no camera", "one or more intrinsics")
    if resolution is not None and len(sizes) != len(cameras):
        resolution.fail(f"{len(sizes)} image sizes for {len(cameras)} cameras", "one for each")
    return [
        _camera(camera, sizes[index] if sizes else None, image_size, f"cam{index}")
        for index, camera in enumerate(cameras)
    ]


def _camera(camera: Node, resolution: Node | None, given: ImageSize | None, name: str) -> CameraSpec:
    sides: list[Node | None] = [None, None]
    if resolution is not None:
        sides = [Node(camera.document, side, resolution.at) for side in resolution.numbers(2)]
    size = camera.image_size(given, sides[0], sides[1], "the camera")
    kind = camera.need("camera_type")
    known = _KEYS.get(kind.text())
    if known is None:
        kind.refuse(f"the Basalt camera type {kind.text()!r} is not supported", "one of " + ", ".join(_KEYS))
    model, keys = known
    values = camera.need("intrinsics")
    values.only(*keys)
    parameters = values.named(*keys)
    if model == "unified":
        fx, fy, alpha = (values.need(key).number() for key in ("fx", "fy", "alpha"))
        del parameters["alpha"]
        parameters |= unified_from_alpha(values.need("alpha"), fx, fy, alpha)
    return values.spec(model, size, parameters, name)


def written(specs: Sequence[CameraSpec]) -> str:
    """The text of `intrinsics` and `resolution`, to which Basalt wants poses and the numbers of an IMU added.

    Raises `UnsupportedFormatError`.
    """
    plain = [general(spec, "Basalt") for spec in specs]
    tree = {"intrinsics": [_table(spec) for spec in plain], "resolution": [[one.width, one.height] for one in plain]}
    return json.dumps({"value0": tree}, indent=2) + "\n"


def _table(spec: CameraSpec) -> dict[str, object]:
    kind = next((kind for kind, (model, _) in _KEYS.items() if model == spec.model), None)
    unwritten = (
        (kind == "pinhole" and any(brown_of(spec)))
        or (kind == "ucm" and (any(mei_of(spec) or [1.0]) or value(spec, "skew") or value(spec, "xi") < 0.0))
    )  # fmt: skip
    if kind is None or unwritten:
        refuse(
            spec,
            "Basalt",
            "double_sphere, extended_unified, kannala_brandt, and pinhole and unified (xi at least 0) without "
            "coefficients",
        )
    values = {key: value(spec, key) for key in _KEYS[kind][1]}
    if kind == "ucm":
        # The inverse of `coefficients.unified_from_alpha`.
        shrink = 1.0 / (1.0 + value(spec, "xi"))
        values |= {"fx": values["fx"] * shrink, "fy": values["fy"] * shrink, "alpha": value(spec, "xi") * shrink}
    return {"camera_type": kind, "intrinsics": values}
