"""JPEG photographs: what a file says of itself as a panorama, its pose written, its metadata kept."""

from __future__ import annotations

import struct

import cv2
import numpy as np
import pytest

from tiltvp.errors import ImageFileError
from tiltvp.photos import encode_like, is_jpeg, jpeg_quality, panorama_kind, with_pose

EXIF = b"Exif\0\0MM\0*" + struct.pack(">IH", 8, 0) + b"camera of the test"
PROFILE = b"ICC_PROFILE\0\1\1" + bytes(range(200))
XMP = b"http://ns.adobe.com/xap/1.0/\0"
GPANO = (
    '<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
    '<rdf:Description rdf:about="" xmlns:GPano="http://ns.google.com/photos/1.0/panorama/" '
    'GPano:ProjectionType="{kind}" GPano:FullPanoWidthPixels="256" GPano:CroppedAreaImageWidthPixels="{part}" '
    'GPano:PosePitchDegrees="7.5"><GPano:PoseRollDegrees>-3</GPano:PoseRollDegrees>'
    "<GPano:PoseHeadingDegrees>120</GPano:PoseHeadingDegrees></rdf:Description></rdf:RDF></x:xmpmeta>"
)


def segment(marker: int, content: bytes) -> bytes:
    return struct.pack(">BBH", 0xFF, marker, len(content) + 2) + content


def photo(*segments: bytes, quality: int = 87, size: tuple[int, int] = (256, 128)) -> bytes:
    rng = np.random.default_rng(0)
    image = cv2.resize(rng.integers(0, 256, (8, 16, 3), dtype=np.uint8), size)
    data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
    return data[:2] + b"".join(segments) + data[2:]


def gpano(kind: str = "equirectangular", part: int = 256) -> bytes:
    return segment(0xE1, XMP + GPANO.format(kind=kind, part=part).encode())


def decoded(data: bytes) -> np.ndarray:
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    assert image is not None
    return image


def scan(data: bytes) -> bytes:
    return data[data.index(b"\xff\xda") :]


def test_panoramas_are_known_by_their_metadata_or_their_shape() -> None:
    assert panorama_kind(photo(), 256, 128).reason == "its shape 2:1"
    assert panorama_kind(photo(gpano()), 256, 128).reason == "GPano metadata"
    assert panorama_kind(b"no JPEG", 256, 128).is_whole
    for data, width, words in (
        (photo(), 300, "twice as wide"),
        (photo(gpano("cylindrical")), 256, "cylindrical"),
        (photo(gpano(part=200)), 256, "200 of 256"),
        (photo(gpano()), 300, "GPano says equirectangular, but"),
    ):
        kind = panorama_kind(data, width, 128)
        assert not kind.is_whole
        assert words in kind.reason


@pytest.mark.parametrize("segments", [(), (segment(0xE1, EXIF),), (segment(0xE1, EXIF), gpano())])
def test_a_pose_leaves_all_else_as_it_is(segments: tuple[bytes, ...]) -> None:
    data = photo(*segments, segment(0xE2, PROFILE))
    posed = with_pose(data, -12.345, 3.0, 256, 128)
    assert scan(posed) == scan(data)
    assert np.array_equal(decoded(posed), decoded(data))
    assert posed.count(b'GPano:PosePitchDegrees="-12.35"') + posed.count(b'GPano:PosePitchDegrees="-12.34"') == 1
    assert posed.count(b"PosePitchDegrees") == 1
    assert posed.count(b"PoseRollDegrees") == 1
    assert posed.count(b"PoseHeadingDegrees") == 2 * (len(segments) == 2)
    assert posed.count(XMP) == 1
    assert PROFILE in posed
    assert panorama_kind(posed, 256, 128).reason == "GPano metadata"
    assert with_pose(posed, -12.345, 3.0, 256, 128) == posed


@pytest.mark.parametrize("quality", [35, 60, 87, 95, 100])
def test_quality_sampling_and_metadata_are_kept(quality: int) -> None:
    data = photo(segment(0xE1, EXIF), gpano(), segment(0xE2, PROFILE), segment(0xE2, b"MPF\0other"), quality=quality)
    assert jpeg_quality(data) == quality
    image = np.full((128, 256, 3), 90, np.uint8)
    written = encode_like(image, data)
    assert is_jpeg(written)
    assert jpeg_quality(written) == quality
    assert segment(0xE1, EXIF) in written
    assert PROFILE in written
    assert b"MPF\0" not in written
    assert b'GPano:PosePitchDegrees="0.00"' in written
    assert np.abs(decoded(written).astype(int) - 90).max() <= 2
    flat = encode_like(image[:, :100], data, None)
    assert XMP not in flat
    assert EXIF in flat
    # Headings are those of where the original looks.
    turned = encode_like(image, data, (90.0, 0.0), turned=True)
    assert b'GPano:PosePitchDegrees="90.00"' in turned
    assert b"PoseHeading" in written
    assert b"PoseHeading" not in turned
    gray = encode_like(image[:, :, 0], data)
    assert decoded(gray).ndim == 2


def test_broken_files_are_refused() -> None:
    data = photo(gpano())
    for broken in (b"", b"BM", data[:2], data[:40], data[:2] + b"\xff\xe1\xff\xff", data[:2] + b"\xff\xe1\0\1"):
        with pytest.raises(ImageFileError):
            with_pose(broken, 0.0, 0.0, 256, 128)
    with pytest.raises(ImageFileError, match="65,533"):
        with_pose(photo(segment(0xE1, XMP + b"<rdf:RDF>" + b" " * 65400 + b"</rdf:RDF>")), 0.0, 0.0, 256, 128)
