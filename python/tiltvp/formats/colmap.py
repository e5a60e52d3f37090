"""COLMAP's cameras.txt: one line `CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]` per camera, of which any number.

COLMAP has the centre of the top left pixel at (0.5, 0.5): half a pixel is taken off both coordinates of the centre.
"""

from __future__ import annotations

import re
from typing import Final

from tiltvp.errors import UnsupportedFormatError
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize

_F: Final = ("f", "cx", "cy")
_FXFY: Final = ("fx", "fy", "cx", "cy")
_MODELS: Final[dict[str, tuple[str, tuple[str, ...]]]] = {
    "SIMPLE_PINHOLE": ("pinhole", _F),
    "PINHOLE": ("pinhole", _FXFY),
    "SIMPLE_RADIAL": ("pinhole", (*_F, "k1")),
    "RADIAL": ("pinhole", (*_F, "k1", "k2")),
    "OPENCV": ("pinhole", (*_FXFY, "k1", "k2", "p1", "p2")),
    "FULL_OPENCV": ("pinhole", (*_FXFY, "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")),
    "OPENCV_FISHEYE": ("kannala_brandt", (*_FXFY, "k1", "k2", "k3", "k4")),
    "SIMPLE_RADIAL_FISHEYE": ("kannala_brandt", (*_F, "k1")),
    "RADIAL_FISHEYE": ("kannala_brandt", (*_F, "k1", "k2")),
}
MOST_CAMERAS: Final = 10_000
"""Of a file: they are checked one by one, 10,000 a second."""
_LINE: Final = re.compile(r"\s*\d+\s+[A-Z][A-Z0-9_]*\s+\d+\s+\d+(\s|$)", re.ASCII)
_COUNT: Final = re.compile(r"#\s*Number of cameras:\s*(\d{1,9})\s*$", re.MULTILINE | re.ASCII)
_HEADER: Final = "CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS"


def recognise(document: Document) -> bool:
    """It has COLMAP's header comment, or its first line with content is a camera."""
    lines = document.content_lines
    return _HEADER in document.text or (bool(lines) and _LINE.match(" ".join(lines[0][1])) is not None)


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The cameras of the file, in file order, each named `cam` and its id."""
    if len(document.content_lines) > MOST_CAMERAS:
        document.fail(f"{len(document.content_lines)} cameras", f"at most {MOST_CAMERAS}", "the end of the file")
    cameras = [_camera(document, number, words, image_size) for number, words in document.content_lines]
    if not cameras:
        document.fail("there is no camera", "a line CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]", "the end of the file")
    stated = _COUNT.search(document.text)
    if stated is not None and int(stated[1]) != len(cameras):
        document.fail(f"{len(cameras)} cameras", f"the {stated[1]} of the header", "the end of the file")
    names: set[str] = set()
    for (number, _), camera in zip(document.content_lines, cameras, strict=True):
        if camera.name in names:
            document.fail(f"the camera id {camera.name[3:]} occurs twice", "one line for each camera", f"line {number}")
        names.add(camera.name)
    return cameras


def _camera(document: Document, number: int, words: list[str], given: ImageSize | None) -> CameraSpec:
    at = f"line {number}"
    if len(words) < 4:
        document.fail(f"{len(words)} words", "CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]", at)
    known = _MODELS.get(words[1])
    if known is None:
        expected = "one of " + ", ".join(_MODELS)
        document.fail(f"the COLMAP model {words[1][:40]!r} is not supported", expected, at, UnsupportedFormatError)
    model, keys = known
    if len(words) - 4 != len(keys):
        document.fail(f"{len(words) - 4} parameters of {words[1]}", f"{len(keys)}: {', '.join(keys)}", at)
    line = Node(document, None, at)
    camera_id = Node(document, words[0], f"{at} (CAMERA_ID)").integer()
    size = line.image_size(given, Node(document, words[2], at), Node(document, words[3], at), "the camera")
    values = {key: Node(document, word, f"{at} ({key})").number() for key, word in zip(keys, words[4:], strict=True)}
    if "f" in values:
        values["fx"] = values["fy"] = values.pop("f")
    values["cx"] -= 0.5
    values["cy"] -= 0.5
    return line.spec(model, size, dict(values), f"cam{camera_id}")
