"""COLMAP's cameras.txt and cameras.bin: id, model, width, height and parameters of each camera, of which any number.

COLMAP has the centre of the top left pixel at (0.5, 0.5): half a pixel is taken off both coordinates of the centre.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from tiltvp.errors import UnsupportedFormatError
from tiltvp.formats.coefficients import BROWN
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize
from tiltvp.formats.writing import brown_of, four_of, general, kannala_brandt_of, refuse, value

_F: Final = ("f", "cx", "cy")
_FXFY: Final = ("fx", "fy", "cx", "cy")
_FOUR: Final = ("k1", "k2", "k3", "k4")
_SIDES: Final = ("width", "height")
_MODELS: Final[dict[str, tuple[int, str, tuple[str, ...]]]] = {
    "SIMPLE_PINHOLE": (0, "pinhole", _F),
    "PINHOLE": (1, "pinhole", _FXFY),
    "SIMPLE_RADIAL": (2, "pinhole", (*_F, "k1")),
    "RADIAL": (3, "pinhole", (*_F, "k1", "k2")),
    "OPENCV": (4, "pinhole", (*_FXFY, *BROWN[:4])),
    "FULL_OPENCV": (6, "pinhole", (*_FXFY, *BROWN)),
    "OPENCV_FISHEYE": (5, "kannala_brandt", (*_FXFY, *_FOUR)),
    "SIMPLE_RADIAL_FISHEYE": (8, "kannala_brandt", (*_F, "k1")),
    "RADIAL_FISHEYE": (9, "kannala_brandt", (*_F, "k1", "k2")),
    "SIMPLE_FISHEYE": (14, "kannala_brandt", _F),
    "FISHEYE": (15, "kannala_brandt", _FXFY),
    "EUCM": (16, "extended_unified", (*_FXFY, "alpha", "beta")),
    "EQUIRECTANGULAR": (17, "equirectangular", _SIDES),
}
"""COLMAP's number of a model, the lens here and the parameters in COLMAP's order. Without a lens here are the field of
view model, the division models and those with thin prisms."""
_BY_NUMBER: Final = {number: name for name, (number, _, _) in _MODELS.items()}
MOST_CAMERAS: Final = 10_000
"""Of a file: they are checked one by one, 10,000 a second."""
_LINE: Final = re.compile(r"\s*\d+\s+[A-Z][A-Z0-9_]*\s+\d+\s+\d+(\s|$)", re.ASCII)
_COUNT: Final = re.compile(r"#\s*Number of cameras:\s*(\d{1,9})\s*$", re.MULTILINE | re.ASCII)
_HEADER: Final = "CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS"
_HEAD: Final = struct.Struct("<IiQQ")
_NAMED: Final = re.compile(r"cam([1-9]\d{0,8})", re.ASCII)


@dataclass(frozen=True)
class _Row:
    """One camera as it stands in a file: where, and its words."""

    at: str
    words: list[str]


def recognise(document: Document) -> bool:
    """It is binary, has COLMAP's header comment, or its first line with content is a camera."""
    lines = document.content_lines
    if document.binary or _HEADER in document.text:
        return True
    return bool(lines) and _LINE.match(" ".join(lines[0][1])) is not None


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The cameras of the file, in file order, each named `cam` and its id."""
    if document.binary:
        return cameras_of(document, _binary_rows(document), image_size)
    lines = document.content_lines
    if len(lines) > MOST_CAMERAS:
        document.fail(f"{len(lines)} cameras", f"at most {MOST_CAMERAS}", "the end of the file")
    cameras = cameras_of(document, (_Row(f"line {number}", words) for number, words in lines), image_size)
    stated = _COUNT.search(document.text)
    if stated is not None and int(stated[1]) != len(cameras):
        document.fail(f"{len(cameras)} cameras", f"the {stated[1]} of the header", "the end of the file")
    return cameras


def cameras_of(document: Document, rows: Iterable[_Row], image_size: ImageSize | None) -> list[CameraSpec]:
    """The cameras of rows; an id may occur once only."""
    cameras: dict[str, CameraSpec] = {}
    for row in rows:
        camera = _camera(document, row, image_size)
        if camera.name in cameras:
            document.fail(f"the camera id {camera.name[3:]} occurs twice", "one entry for each camera", row.at)
        cameras[camera.name] = camera
    if not cameras:
        document.fail("there is no camera", "a line CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]", "the end of the file")
    return list(cameras.values())


def spec_of(
    camera_id: int, model: str, width: int, height: int, parameters: Sequence[float], source: str
) -> CameraSpec:
    """The camera of one entry of COLMAP's, of a database for instance; `source` is for what is raised.

    Raises `CalibrationError`, of which `UnsupportedFormatError` for a model that has no lens here.
    """
    words = [str(camera_id), model, str(width), str(height), *(repr(float(number)) for number in parameters)]
    return _camera(Document.of(source), _Row(f"camera {camera_id}", words), None)


def _binary_rows(document: Document) -> Iterator[_Row]:
    raw = document.binary
    count = int.from_bytes(raw[:8], "little")
    if count > MOST_CAMERAS:
        document.fail(f"{count} cameras", f"at most {MOST_CAMERAS}", "byte 0")
    place = 8
    for index in range(count):
        at = f"camera {index} (byte {place})"
        if place + _HEAD.size > len(raw):
            document.fail("the file ends early", f"the {count} cameras of its beginning", at)
        camera_id, number, width, height = _HEAD.unpack_from(raw, place)
        place += _HEAD.size
        name = _BY_NUMBER.get(number)
        if name is None:
            expected = "one of " + ", ".join(f"{number} {name}" for number, name in sorted(_BY_NUMBER.items()))
            document.fail(f"the COLMAP model {number} is not supported", expected, at, UnsupportedFormatError)
        length = len(_MODELS[name][2])
        if place + 8 * length > len(raw):
            document.fail("the file ends early", f"{length} parameters of {name}", at)
        numbers = struct.unpack_from(f"<{length}d", raw, place)
        place += 8 * length
        yield _Row(at, [str(camera_id), name, str(width), str(height), *map(repr, numbers)])
    if place != len(raw):
        document.fail(f"{len(raw) - place} bytes after the last camera", "the end of the file", f"byte {place}")


def _camera(document: Document, row: _Row, given: ImageSize | None) -> CameraSpec:
    at, words = row.at, row.words
    if len(words) < 4:
        document.fail(f"{len(words)} words", "CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]", at)
    known = _MODELS.get(words[1])
    if known is None:
        expected = "one of " + ", ".join(_MODELS)
        document.fail(f"the COLMAP model {words[1][:40]!r} is not supported", expected, at, UnsupportedFormatError)
    _, model, keys = known
    if len(words) - 4 != len(keys):
        document.fail(f"{len(words) - 4} parameters of {words[1]}", f"{len(keys)}: {', '.join(keys)}", at)
    line = Node(document, None, at)
    camera_id = Node(document, words[0], f"{at} (CAMERA_ID)").integer()
    size = line.image_size(given, Node(document, words[2], at), Node(document, words[3], at), "the camera")
    values = {key: Node(document, word, f"{at} ({key})").number() for key, word in zip(keys, words[4:], strict=True)}
    if keys == _SIDES:
        if (values.pop("width"), values.pop("height")) != size:
            document.fail("another size as parameters than as width and height", "the same", at)
        return line.spec(model, size, {}, f"cam{camera_id}")
    if "f" in values:
        values["fx"] = values["fy"] = values.pop("f")
    values["cx"] -= 0.5
    values["cy"] -= 0.5
    return line.spec(model, size, dict(values), f"cam{camera_id}")


def written(specs: Sequence[CameraSpec]) -> str:
    """The text of cameras.txt. A camera named `cam` and a number keeps it as its id, if all do; else they are counted
    from 1. Raises `UnsupportedFormatError`.
    """
    lines = [f"#   {_HEADER}[]", f"# Number of cameras: {len(specs)}"]
    for camera_id, name, spec, parameters in _entries(specs):
        numbers = " ".join(map(repr, parameters))
        lines.append(f"{camera_id} {name} {spec.width} {spec.height} {numbers}")
    return "\n".join(lines) + "\n"


def written_binary(specs: Sequence[CameraSpec]) -> bytes:
    """The bytes of cameras.bin, with ids as `written`. Raises `UnsupportedFormatError`."""
    parts = [struct.pack("<Q", len(specs))]
    for camera_id, name, spec, parameters in _entries(specs):
        parts.append(_HEAD.pack(camera_id, _MODELS[name][0], spec.width, spec.height))
        parts.append(struct.pack(f"<{len(parameters)}d", *parameters))
    return b"".join(parts)


def _entries(specs: Sequence[CameraSpec]) -> list[tuple[int, str, CameraSpec, list[float]]]:
    """Id, COLMAP's model, camera and parameters of each."""
    stated = [_NAMED.fullmatch(spec.name) for spec in specs]
    ids = [int(one[1]) for one in stated if one]
    if len(set(ids)) != len(specs):
        ids = list(range(1, len(specs) + 1))
    return [(number, *_lens(general(spec, "COLMAP"))) for number, spec in zip(ids, specs, strict=True)]


def _lens(spec: CameraSpec) -> tuple[str, CameraSpec, list[float]]:
    if spec.model == "equirectangular":
        return "EQUIRECTANGULAR", spec, [float(spec.width), float(spec.height)]
    fx, fy, cx, cy = four_of(spec)
    centre = [cx + 0.5, cy + 0.5]
    if spec.model == "pinhole":
        coefficients = brown_of(spec)
        if not any(coefficients):
            return "PINHOLE", spec, [fx, fy, *centre]
        if len(coefficients) == 4:
            return "OPENCV", spec, [fx, fy, *centre, *coefficients]
        return "FULL_OPENCV", spec, [fx, fy, *centre, *coefficients, *[0.0] * (8 - len(coefficients))]
    if spec.model == "kannala_brandt":
        return "OPENCV_FISHEYE", spec, [fx, fy, *centre, *kannala_brandt_of(spec)]
    if spec.model != "extended_unified":
        refuse(spec, "COLMAP", "pinhole, kannala_brandt, extended_unified and equirectangular")
    return "EUCM", spec, [fx, fy, *centre, value(spec, "alpha"), value(spec, "beta")]
