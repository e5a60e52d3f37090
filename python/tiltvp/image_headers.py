"""What headers of image files say: how many pixels, so that no more is decoded than memory should hold, and how a
photograph was held."""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Final

__all__ = ["file_orientation", "file_size", "header_size", "is_image_file", "orientation", "unturned"]

# Compiled at the first file and not at the import, a tenth of whose time that would be; `re` keeps them.
_PNM: Final = rb"P[1-7](?:\s|#[^\n]*\n)+"
_PNM_NUMBER: Final = rb"(?:\s|#[^\n]*\n)*(\d{1,9})"
_PAM_SIDE: Final = rb"(?m)^(WIDTH|HEIGHT)[ \t]+(\d{1,9})\s*$"
JPEG_FRAMES: Final = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_TIFF: Final = rb"II[\x2a\x2b]\x00|MM\x00[\x2a\x2b]"
_BEGIN_BYTES: Final = 16
"""In which each kind tells itself."""
_FIRST_BYTES: Final = 1 << 12
"""In which most files tell their size."""
_HEAD_BYTES: Final = 1 << 17
"""Of a photograph, among which its orientation tag is: it has to be in the first 64 kB of segments."""
_TIFF_TYPES: Final = {1: "B", 3: "H", 4: "I", 16: "Q"}


def header_size(data: bytes) -> tuple[int, int] | None:
    """(width, height) of a PNG, JPEG, BMP, TIFF, PNM, WebP or JPEG 2000 file; None for any other or a broken header."""
    for begin, read in _READERS:
        if re.match(begin, data, re.DOTALL):
            try:
                size = read(data)
            except (struct.error, IndexError, OverflowError):  # The last for a place in a BigTIFF that no file has.
                return None
            return size if size is not None and min(size) > 0 else None
    return None


def file_size(path: str | os.PathLike[str]) -> tuple[int, int] | None:
    """`header_size` of a file by its beginning; None where that does not tell. Raises `OSError`."""
    with open(path, "rb", buffering=0) as file:
        data = file.read(_FIRST_BYTES)
        return header_size(data) or header_size(data + file.read(_HEAD_BYTES))


def is_image_file(path: str | os.PathLike[str]) -> bool:
    """Whether a regular file begins as images do whose header can be read; false for one that cannot be opened."""
    with suppress(OSError, ValueError):
        if os.path.isfile(path):
            with open(path, "rb", buffering=0) as file:
                data = file.read(_BEGIN_BYTES)
            return any(re.match(begin, data, re.DOTALL) for begin, _ in _READERS)
    return False


def orientation(data: bytes) -> int:
    """The orientation tag (1 to 8, Exif 2.3) of a JPEG file by its beginning; 1, upright, for any other and without."""
    try:
        at = 2 if data[:2] == b"\xff\xd8" else len(data)
        while data[at : at + 1] == b"\xff" and data[at + 1] != 0xDA:
            length = int(struct.unpack_from(">H", data, at + 2)[0])
            if data[at + 1] == 0xE1 and data[at + 4 : at + 10] == b"Exif\0\0":
                return _orientation_of(data[at + 10 : at + 2 + length])
            at += 2 + length
    except (struct.error, IndexError):
        pass
    return 1


def file_orientation(path: str | os.PathLike[str]) -> int:
    """`orientation` of a file. Raises `OSError`, and `ValueError` for what is no name."""
    # Of other files, which may be many, no more is read than shows what they are.
    with open(path, "rb", buffering=0) as file:
        begin = file.read(2)
        return orientation(begin + file.read(_HEAD_BYTES)) if begin == b"\xff\xd8" else 1


def unturned(data: bytes) -> bytes:
    """A TIFF file, of a header that `header_size` reads, without the turn of its orientation tag, which OpenCV makes
    whatever it is told; any other file as it is."""
    for order, tag, kind, at in _tiff_entries(data) if re.match(_TIFF, data) else ():
        upright = struct.pack(order + "H", 1)
        if (tag, kind) == (0x0112, 3) and data[at : at + 2] != upright:
            return data[:at] + upright + data[at + 2 :]
    return data


def _orientation_of(tiff: bytes) -> int:
    end = ">" if tiff[:2] == b"MM" else "<"
    first = int(struct.unpack_from(end + "I", tiff, 4)[0])
    for number in range(struct.unpack_from(end + "H", tiff, first)[0]):
        tag, kind, count, value = struct.unpack_from(end + "HHIH", tiff, first + 2 + 12 * number)
        if (tag, kind, count) == (0x0112, 3, 1):
            return int(value) if 1 <= value <= 8 else 1
    return 1


def _png(data: bytes) -> tuple[int, int] | None:
    width, height = struct.unpack_from(">II", data, 16)
    return (width, height) if data[12:16] == b"IHDR" else None


def _jpeg(data: bytes) -> tuple[int, int] | None:
    at = 2
    while True:
        at = data.find(b"\xff", at)
        if at < 0:
            return None
        while data[at] == 0xFF:
            at += 1
        marker = data[at]
        at += 1
        if marker in JPEG_FRAMES:
            height, width = struct.unpack_from(">HH", data, at + 3)
            return width, height
        if marker not in (0x00, 0x01, *range(0xD0, 0xD9)):
            at += int(struct.unpack_from(">H", data, at)[0])


def _bmp(data: bytes) -> tuple[int, int] | None:
    if struct.unpack_from("<I", data, 14)[0] == 12:
        width, height = struct.unpack_from("<HH", data, 18)
    else:
        width, height = struct.unpack_from("<ii", data, 18)
    return abs(width), abs(height)


def _pnm(data: bytes) -> tuple[int, int] | None:
    if data[1:2] == b"7":
        sides = {name: int(number) for name, number in re.findall(_PAM_SIDE, data[:4096])}
        return (sides[b"WIDTH"], sides[b"HEIGHT"]) if len(sides) == 2 else None
    start = re.match(_PNM, data)
    width = None if start is None else re.compile(_PNM_NUMBER).match(data, start.end())
    height = None if width is None else re.compile(_PNM_NUMBER).match(data, width.end())
    return (int(width[1]), int(height[1])) if width is not None and height is not None else None


def _tiff(data: bytes) -> tuple[int, int] | None:
    sides: dict[int, int] = {}
    for order, tag, kind, at in _tiff_entries(data):
        if tag in (256, 257) and kind in _TIFF_TYPES:
            sides[tag] = max(sides.get(tag, 0), int(struct.unpack_from(order + _TIFF_TYPES[kind], data, at)[0]))
    return (sides[256], sides[257]) if len(sides) == 2 else None


def _tiff_entries(data: bytes) -> Iterator[tuple[str, int, int, int]]:
    """The order of bytes, and of each entry of the first directory its tag, its type and where its value is."""
    order = "<" if data[:2] == b"II" else ">"
    big = struct.unpack_from(order + "H", data, 2)[0] == 43
    place = int(struct.unpack_from(order + ("Q" if big else "I"), data, 8 if big else 4)[0])
    count = int(struct.unpack_from(order + ("Q" if big else "H"), data, place)[0])
    entries, each = place + (8 if big else 2), 20 if big else 12
    for k in range(min(count, 4096)):
        tag, kind = struct.unpack_from(order + "HH", data, entries + each * k)
        yield order, tag, kind, entries + each * k + (12 if big else 8)


def _webp(data: bytes) -> tuple[int, int] | None:
    match data[12:16]:
        case b"VP8X":
            return 1 + int.from_bytes(data[24:27], "little"), 1 + int.from_bytes(data[27:30], "little")
        case b"VP8L":
            bits = int(struct.unpack_from("<I", data, 21)[0])
            return 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
        case b"VP8 ":
            width, height = struct.unpack_from("<HH", data, 26)
            return width & 0x3FFF, height & 0x3FFF
    return None


def _jpeg2000(data: bytes) -> tuple[int, int] | None:
    """The SIZ marker of the code stream, which is what is decoded."""
    at = data.find(b"\xff\x4f\xff\x51")
    if at < 0:
        return None
    right, bottom, left, top = struct.unpack_from(">IIII", data, at + 8)
    return right - left, bottom - top


_READERS: Final[tuple[tuple[bytes, Callable[[bytes], tuple[int, int] | None]], ...]] = (
    (rb"\x89PNG\r\n\x1a\n", _png),
    (rb"\xff\xd8\xff", _jpeg),
    (rb"BM", _bmp),
    (rb"P[1-7][\s#]", _pnm),
    (_TIFF, _tiff),
    (rb"RIFF....WEBP", _webp),
    (rb"\x00\x00\x00\x0cjP  |\xff\x4f\xff\x51", _jpeg2000),
)
