"""JPEG photographs as files of segments: their 360-degree metadata (GPano), and all others kept over new pixels."""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from tiltvp.errors import ImageFileError
from tiltvp.image_headers import JPEG_FRAMES

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = [
    "BELIEVED_MIN", "PHOTO_TILT_MAX_RAD", "PanoramaKind", "encode_like", "jpeg_quality", "panorama_kind", "pose_deg",
    "with_pose",
]  # fmt: skip

BELIEVED_MIN: Final = 0.5
"""Least confidence of an image that is made level where no other is asked for: a tilt that is rather right than not."""
PHOTO_TILT_MAX_RAD: Final = math.radians(60.0)
"""How far a 360-degree camera leans at most in a hand: without a limit three of 108 panoramas were taken, and believed,
to lie on their side."""

_SOI, _SOS, _DQT, _APP0, _APP1, _APP2, _APP14, _COMMENT = 0xD8, 0xDA, 0xDB, 0xE0, 0xE1, 0xE2, 0xEE, 0xFE
_PROGRESSIVE: Final = frozenset((0xC2, 0xC6, 0xCA, 0xCE))
_XMP, _MORE_XMP = b"http://ns.adobe.com/xap/1.0/\0", b"http://ns.adobe.com/xmp/extension/\0"
_SEVERAL_PICTURES = b"MPF\0"
_LARGEST_SEGMENT: Final = 65_533
"""Bytes that a segment may hold: its length is a number of 16 bits and counts itself."""
_GPANO: Final = "http://ns.google.com/photos/1.0/panorama/"
_ATTRIBUTE: Final = r"\s?\bGPano:{0}\s*=\s*(\"[^\"]*\"|'[^']*')"
_ELEMENT: Final = r"\s?<GPano:{0}>([^<]*)</GPano:{0}>"
"""The two ways in which a packet may say a value; neither begins with a run, over which a search would be slow."""
_LUMINANCE: Final = (
    16, 11, 12, 14, 12, 10, 16, 14, 13, 14, 18, 17, 16, 19, 24, 40, 26, 24, 22, 22, 24, 49, 35, 37, 29, 40, 58, 51, 61,
    60, 57, 51, 56, 55, 64, 72, 92, 78, 64, 68, 87, 69, 55, 56, 80, 109, 81, 87, 95, 98, 103, 104, 103, 62, 77, 113,
    121, 112, 100, 120, 92, 101, 103, 99,
)  # fmt: skip
"""Steps of the luminance at quality 50 in the order of the file: ITU-T T.81, table K.1."""


@dataclass(frozen=True)
class _Segment:
    marker: int
    content: bytes

    def __bytes__(self) -> bytes:
        return struct.pack(">BBH", 0xFF, self.marker, len(self.content) + 2) + self.content


@dataclass(frozen=True)
class _Jpeg:
    """The segments before the pixels, and all bytes from these on."""

    head: tuple[_Segment, ...]
    pixels: bytes

    def __bytes__(self) -> bytes:
        return b"\xff\xd8" + b"".join(map(bytes, self.head)) + self.pixels


def _parsed(data: bytes) -> _Jpeg:
    """Raises `ImageFileError` for what is no JPEG file."""
    if data[:2] != b"\xff\xd8":
        raise ImageFileError("not a JPEG file, expected one")
    head: list[_Segment] = []
    at = 2
    while True:
        begin = at
        while data[at : at + 1] == b"\xff":
            at += 1
        if at == begin or at + 3 > len(data):
            raise ImageFileError(f"a broken JPEG file: no segment at byte {begin}")
        marker = data[at]
        if marker == _SOS:
            return _Jpeg(tuple(head), data[begin:])
        length = int(struct.unpack_from(">H", data, at + 1)[0])
        if length < 2 or at + 1 + length > len(data):
            raise ImageFileError(f"a broken JPEG file: a segment of {length} bytes at byte {begin}")
        head.append(_Segment(marker, data[at + 3 : at + 1 + length]))
        at += 1 + length


def is_jpeg(data: bytes) -> bool:
    """Whether the bytes begin as a JPEG file does."""
    return data[:3] == b"\xff\xd8\xff"


@dataclass(frozen=True)
class PanoramaKind:
    """What a file says of itself as a panorama."""

    is_whole: bool
    """Whether it is an equirectangular image of all directions."""
    reason: str
    """By what that is known, or what speaks against it."""


def panorama_kind(data: bytes, width: int, height: int) -> PanoramaKind:
    """Whether an image file shows all directions, equirectangular: by its GPano metadata, else by its shape 2:1."""
    words = _packet(data) if is_jpeg(data) else ""
    kind = _value(words, "ProjectionType")
    if kind is not None and kind.strip().lower() != "equirectangular":
        return PanoramaKind(False, f"GPano says {kind!r}, expected equirectangular")
    if kind is not None:
        for side, full, here in (("Width", "FullPanoWidthPixels", width), ("Height", "FullPanoHeightPixels", height)):
            whole, part = _value(words, full), _value(words, f"CroppedAreaImage{side}Pixels")
            if whole is not None and part is not None and whole.strip() != part.strip():
                return PanoramaKind(False, f"GPano says that {part} of {whole} pixels are there, expected all of them")
            if here < 1:
                return PanoramaKind(False, "an image without pixels")
    if width != 2 * height:
        said = "GPano says equirectangular, but " if kind is not None else ""
        return PanoramaKind(False, f"{said}{width} x {height} pixels, expected twice as wide as high")
    return PanoramaKind(True, "GPano metadata" if kind is not None else "its shape 2:1")


def _packet(data: bytes) -> str:
    """The XMP packet, empty if there is none or the file is broken: whoever reads the pixels will say so."""
    try:
        head = _parsed(data).head
    except ImageFileError:
        return ""
    for segment in head:
        if segment.marker == _APP1 and segment.content.startswith(_XMP):
            return segment.content[len(_XMP) :].decode("utf-8", "replace")
    return ""


def _value(packet: str, name: str) -> str | None:
    found = re.search(_ATTRIBUTE.format(name), packet) or re.search(_ELEMENT.format(name), packet)
    return found and found[1].strip().strip("\"'")


def pose_deg(robot_from_camera: NDArray[np.floating], normal: NDArray[np.floating]) -> tuple[float, float]:
    """Pitch and roll, as `with_pose` takes them, of a camera with that mounting (3, 3) where the robot has the ground
    normal (3,)."""
    right, down, ahead = (float(value) for value in robot_from_camera.T @ normal)
    # Straight up, where there is no roll, it is that of 0, not of -0.
    return math.degrees(math.atan2(ahead, math.hypot(right, down))), math.degrees(math.atan2(0.0 - right, 0.0 - down))


def with_pose(data: bytes, pitch_deg: float, roll_deg: float, width: int, height: int) -> bytes:
    """The JPEG file with PosePitchDegrees and PoseRollDegrees of GPano, everything else left as it is, bit for bit.

    Pitch is the elevation of the image's centre, roll grows as the horizon turns counter-clockwise in the image. Where
    there is no GPano metadata it is added, for a whole equirectangular image of that size. Raises `ImageFileError`.
    """
    jpeg = _parsed(data)
    packet = _posed(_packet(data), pitch_deg, roll_deg, width, height)
    segment = _Segment(_APP1, _XMP + packet.encode("utf-8"))
    if len(segment.content) > _LARGEST_SEGMENT:
        raise ImageFileError(f"its XMP metadata would be of {len(segment.content)} bytes, expected at most 65,533")
    kept = [one for one in jpeg.head if not (one.marker == _APP1 and one.content.startswith(_XMP))]
    # After JFIF and EXIF, which readers expect first.
    first = next((k for k, one in enumerate(kept) if not _goes_first(one)), len(kept))
    return bytes(_Jpeg((*kept[:first], segment, *kept[first:]), jpeg.pixels))


def _goes_first(segment: _Segment) -> bool:
    return segment.marker == _APP0 or (segment.marker == _APP1 and segment.content.startswith(b"Exif\0"))


def _posed(packet: str, pitch_deg: float, roll_deg: float, width: int, height: int) -> str:
    """An XMP packet with the pose, beside the kind of the projection if that is there."""
    pose = {"PosePitchDegrees": f"{pitch_deg:.2f}", "PoseRollDegrees": f"{roll_deg:.2f}"}
    for name in pose:
        packet = re.sub(_ATTRIBUTE.format(name) + "|" + _ELEMENT.format(name), "", packet)
    if found := re.search(_ATTRIBUTE.format("ProjectionType"), packet):
        return packet[: found.end()] + _attributes(pose) + packet[found.end() :]
    if found := re.search(_ELEMENT.format("ProjectionType"), packet):
        elements = "".join(f"<GPano:{name}>{value}</GPano:{name}>" for name, value in pose.items())
        return packet[: found.end()] + elements + packet[found.end() :]
    wanted = {"ProjectionType": "equirectangular"} | pose | {"UsePanoramaViewer": "True"}
    for side, pixels in (("Width", width), ("Height", height)):
        wanted |= {f"FullPano{side}Pixels": str(pixels), f"CroppedAreaImage{side}Pixels": str(pixels)}
    wanted |= {"CroppedAreaLeftPixels": "0", "CroppedAreaTopPixels": "0"}
    described = f'<rdf:Description rdf:about="" xmlns:GPano="{_GPANO}"{_attributes(wanted)}/>'
    if "</rdf:RDF>" in packet:
        return packet.replace("</rdf:RDF>", f"{described}</rdf:RDF>", 1)
    return (
        '<?xpacket begin="\ufeff" id="W5M0MpCehiHzreSzNTczkc9d"?><x:xmpmeta xmlns:x="adobe:ns:meta/">'
        '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
        f'{described}</rdf:RDF></x:xmpmeta><?xpacket end="w"?>'
    )


def _attributes(values: Mapping[str, str]) -> str:
    return "".join(f' GPano:{name}="{value}"' for name, value in values.items())


def jpeg_quality(data: bytes) -> int:
    """The quality, 1 to 100, with which common programs write tables nearest to the luminance's of a JPEG file."""
    table = next(_luminance(_parsed(data).head), None)
    if table is None:
        raise ImageFileError("a JPEG file without tables of its quality")
    return _quality_of(table)


@lru_cache
def _quality_of(table: tuple[int, ...]) -> int:
    return min(range(1, 101), key=lambda quality: (_apart(_steps(quality), table), -quality))


def _luminance(head: Sequence[_Segment]) -> Iterator[tuple[int, ...]]:
    """The quantisation table number 0."""
    for segment in head:
        content = segment.content if segment.marker == _DQT else b""
        while content:
            wide, number = content[0] >> 4, content[0] & 15
            size = 64 * (1 + wide)
            if len(content) < 1 + size:
                return
            if number == 0:
                yield struct.unpack(">64H" if wide else ">64B", content[1 : 1 + size])
            content = content[1 + size :]


def _steps(quality: int) -> list[int]:
    """As the library of the Independent JPEG Group scales the standard's table."""
    scale = 5000 // quality if quality < 50 else 200 - 2 * quality
    return [min(255, max(1, (step * scale + 50) // 100)) for step in _LUMINANCE]


def _apart(ours: Sequence[int], theirs: Sequence[int]) -> int:
    return sum(abs(a - b) for a, b in zip(ours, theirs, strict=True))


def encode_like(
    image: NDArray[np.uint8], original: bytes, pose: tuple[float, float] | None = (0.0, 0.0), *, turned: bool = False
) -> bytes:
    """(H, W) or (H, W, 3) BGR as a JPEG file of the quality, sampling and metadata of another one.

    EXIF, colour profile and comments are kept. With a `pose`, pitch and roll as of `with_pose`, it is a panorama: its
    GPano metadata are those of the original, if it is of this size and not `turned` against it, with that pose;
    without, it is no panorama, and XMP is left out. So are pictures that stand behind the first in the file. Raises
    `ImageFileError`.
    """
    import cv2

    jpeg = _parsed(original)
    options = [cv2.IMWRITE_JPEG_QUALITY, jpeg_quality(original)]
    frame = next((segment for segment in jpeg.head if segment.marker in JPEG_FRAMES), None)
    # A frame begins with its precision, its height and its width.
    same_size = frame is not None and struct.unpack(">HH", frame.content[1:5]) == image.shape[:2]
    if frame is not None:
        options += [cv2.IMWRITE_JPEG_PROGRESSIVE, int(frame.marker in _PROGRESSIVE)]
        # Horizontal and vertical samples of luminance and of the two colours, as OpenCV writes them down.
        if len(frame.content) >= 15 and frame.content[5] == 3 and image.ndim == 3:
            y, b, r = (frame.content[k] for k in (7, 10, 13))
            sampling = y << 16 | b << 8 | r
            if sampling in (0x411111, 0x221111, 0x211111, 0x121111, 0x111111):
                options += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, sampling]
    done, encoded = cv2.imencode(".jpg", image, options)
    if not done:
        raise ImageFileError("cannot be encoded as a JPEG file")
    own = _parsed(encoded.tobytes())
    kept = [segment for segment in jpeg.head if _is_kept(segment)]
    written = [segment for segment in own.head if not (segment.marker == _APP0 and kept)]
    joined = bytes(_Jpeg((*kept, *written), own.pixels))
    if pose is None:
        return joined
    like = same_size and not turned
    packet = [s for s in jpeg.head if s.marker == _APP1 and s.content.startswith(_XMP)] if like else []
    joined = bytes(_Jpeg((*kept, *packet, *written), own.pixels))
    return with_pose(joined, *pose, *_size(image))


def _size(image: NDArray[Any]) -> tuple[int, int]:
    return int(image.shape[1]), int(image.shape[0])


def _is_kept(segment: _Segment) -> bool:
    """Whether metadata outlive the pixels: not XMP, which is written anew, nor what points into the file, nor Adobe's
    word on colours, which is the encoder's."""
    if segment.marker in (_APP1, _APP2) and segment.content.startswith((_XMP, _MORE_XMP, _SEVERAL_PICTURES)):
        return False
    return (_APP0 <= segment.marker <= 0xEF and segment.marker != _APP14) or segment.marker == _COMMENT
