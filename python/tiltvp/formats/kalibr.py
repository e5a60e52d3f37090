"""Kalibr's camchain YAML: `cam0`, `cam1`, ... with camera_model, intrinsics, distortion_model, distortion_coeffs.

Intrinsics are [fu fv pu pv] (pinhole), [xi fu fv pu pv] (omni), [xi alpha fu fv pu pv] (ds) and [alpha beta fu fv pu
pv] (eucm); radtan is k1 k2 p1 p2, equidistant k1..k4. Pixel centres are at integers (corners come from OpenCV).
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from tiltvp.formats.coefficients import four, kannala_brandt, mei
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize
from tiltvp.formats.writing import brown_of, four_of, general, kannala_brandt_of, mei_of, refuse, value
from tiltvp.formats.yaml_text import yaml_of

_CAMERA = re.compile(r"cam\d+", re.ASCII)
_SUPPORTED = (
    "pinhole-radtan",
    "pinhole-equi",
    "pinhole-none",
    "omni-radtan",
    "omni-none",
    "ds-none",
    "eucm-none",
)


def recognise(document: Document) -> bool:
    """It has a `camN` with a `camera_model`."""
    return any(
        _CAMERA.fullmatch(key) and isinstance(value, dict) and "camera_model" in value
        for key, value in document.tree.items()
    )


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The cameras of the chain, in file order."""
    root = Node.root(document)
    cameras = [root.need(key) for key in root.tree if _CAMERA.fullmatch(key)]
    if not cameras:
        root.fail("there is no camera", "cam0, cam1, ...")
    return [_camera(camera, image_size) for camera in cameras]


def _camera(camera: Node, given: ImageSize | None) -> CameraSpec:
    size = _size(camera, given)
    model = camera.need("camera_model")
    lens = camera.get("distortion_model")
    lens_word = lens.text().lower() if lens else "none"
    pair = f"{model.text().lower()}-{ {'equidistant': 'equi'}.get(lens_word, lens_word) }"
    if pair not in _SUPPORTED:
        model.refuse(f"the Kalibr model {pair!r} is not supported", "one of " + ", ".join(_SUPPORTED))
    intrinsics = camera.need("intrinsics")
    if pair.endswith("-none"):
        coefficients = camera.get("distortion_coeffs")
        if coefficients is not None and any(coefficients.numbers()):
            coefficients.fail("coefficients beside the distortion model 'none'", "an empty list")
    else:
        coefficients = camera.need("distortion_coeffs")
        coefficients.numbers(4)
    if pair.startswith("ds-"):
        xi, alpha, *rest = intrinsics.numbers(6)
        return camera.spec("double_sphere", size, {"xi": xi, "alpha": alpha, **four(rest)}, camera.at)
    if pair.startswith("eucm-"):
        alpha, beta, *rest = intrinsics.numbers(6)
        return camera.spec("extended_unified", size, {"alpha": alpha, "beta": beta, **four(rest)}, camera.at)
    distortion = coefficients if pair.endswith("-radtan") else None
    if pair.startswith("omni-"):
        xi, *rest = intrinsics.numbers(5)
        return camera.spec("unified", size, {"xi": xi, **four(rest), **mei(distortion)}, camera.at)
    values = four(intrinsics.numbers(4))
    if pair == "pinhole-equi":
        return camera.spec("kannala_brandt", size, values | kannala_brandt(camera.need("distortion_coeffs")), camera.at)
    return camera.spec("pinhole", size, values | mei(distortion), camera.at)


def _size(camera: Node, given: ImageSize | None) -> ImageSize:
    resolution = camera.get("resolution")
    if resolution is None:
        return camera.image_size(given, None, None, "the camera")
    width, height = (Node(camera.document, value, resolution.at) for value in resolution.numbers(2))
    return resolution.image_size(given, width, height, "the camera")


def written(specs: Sequence[CameraSpec]) -> str:
    """The text of a chain of cameras, without the rotations between them. Raises `UnsupportedFormatError`."""
    cameras = {f"cam{index}": _table(general(spec, "Kalibr"), index) for index, spec in enumerate(specs)}
    return yaml_of(cameras)


def _table(spec: CameraSpec, index: int) -> dict[str, object]:
    word, lens, intrinsics, coefficients = _lens(spec)
    return {
        "camera_model": word,
        "intrinsics": intrinsics,
        "distortion_model": lens,
        "distortion_coeffs": coefficients,
        "resolution": [spec.width, spec.height],
        "rostopic": f"/cam{index}/image_raw",
    }


def _lens(spec: CameraSpec) -> tuple[str, str, list[float], list[float]]:
    """camera_model, distortion_model, intrinsics and distortion_coeffs."""
    if spec.model == "pinhole" and len(brown_of(spec)) == 4:
        return "pinhole", "radtan", four_of(spec), brown_of(spec)
    if spec.model == "kannala_brandt":
        return "pinhole", "equidistant", four_of(spec), kannala_brandt_of(spec)
    if spec.model == "double_sphere":
        return "ds", "none", [value(spec, "xi"), value(spec, "alpha"), *four_of(spec)], []
    if spec.model == "extended_unified":
        return "eucm", "none", [value(spec, "alpha"), value(spec, "beta"), *four_of(spec)], []
    coefficients = mei_of(spec)
    if spec.model != "unified" or coefficients is None or value(spec, "skew"):
        refuse(
            spec, "Kalibr", "pinhole and unified with k1 k2 p1 p2, kannala_brandt, double_sphere and extended_unified"
        )
    return "omni", "radtan", [value(spec, "xi"), *four_of(spec)], coefficients
