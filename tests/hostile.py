"""Files made to do harm, by name: what they are called and what is in them."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator

import numpy as np

MIB = 1 << 20
OCAM_TAIL = "\n2 100.0 1.0\n240 320\n1 0 0\n480 640\n"


def own(width: int, height: int, **parameters: object) -> bytes:
    """A calibration file of ours."""
    values = {"focal_px": 139.7, "cx": 319.5, "cy": 239.5} | parameters
    lines = "".join(f"{key} = {value}\n" for key, value in values.items())
    return (
        'format = "tiltvp-camera"\nversion = 1\n[[camera]]\nname = "cam0"\nmodel = "equidistant"\n'
        f"width = {width}\nheight = {height}\n[camera.parameters]\n{lines}"
    ).encode()


def aliases() -> bytes:
    """Two trees of aliases, each of 9^12 values, at keys that have to agree."""
    lines = []
    for tree in "ab":
        lines.append(f"{tree}0: &{tree}0 [1, 1, 1, 1, 1, 1, 1, 1, 1]")
        lines += [f"{tree}{k}: &{tree}{k} [{', '.join([f'*{tree}{k - 1}'] * 9)}]" for k in range(1, 12)]
    lines += ["camera_matrix: *a11", "cameraMatrix: *b11", "K: *a11", "image_width: 64", "image_height: 48"]
    return "\n".join(lines).encode()


def png(width: int, height: int) -> bytes:
    """A black image of that size: some kilobytes for gigabytes of pixels."""

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    packer, packed = zlib.compressobj(9), io.BytesIO()
    for _ in range(height):
        packed.write(packer.compress(bytes(1 + width)))
    packed.write(packer.flush())
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", packed.getvalue()) + chunk(b"IEND", b"")


def calibrations() -> Iterator[tuple[str, bytes]]:
    """Calibration files, most of them of up to 4 MiB."""
    yield "huge-square", own(65_535, 65_535)
    yield "huge-sides", own(100_000, 100_000)
    yield "large-square", own(20_000, 20_000)
    yield "largest", own(20_000, 10_000)
    yield "tiny-focal", own(640, 480, focal_px=1e-308)
    yield "huge-numbers", own(640, 480, focal_px=1e15, cx=-1e15)
    yield "hexadecimal", own(640, 480).replace(b"640", b"0x" + b"f" * 20_000)
    for degree in (201, 2_000, 9_999):
        yield f"ocam-{degree}", (f"{degree} -200.0" + " 1e-3" * (degree - 1) + OCAM_TAIL).encode()
        listed = "[-200.0" + ", 1e-3" * (degree - 1) + "]"
        text = own(640, 480, polynomial=listed).replace(b"equidistant", b"ocam")
        yield f"own-ocam-{degree}", text.replace(b"focal_px = 139.7\n", b"")
    yield "aliases", aliases()
    yield "alias-of-itself", b"K: &a [*a]\nimage_width: &b {c: *b}\n"
    yield "dotted", b'format = "tiltvp-camera"\n' + b".".join([b"a"] * 20_000) + b" = 1\n"
    yield "dotted-inline", b'format = "tiltvp-camera"\nx = {' + b".".join([b"a"] * 20_000) + b" = 1}\n"
    yield "colmap", b"".join(b"%d PINHOLE 64 48 50 50 32 24\n" % k for k in range(50_000))
    yield "digits", b"1" * MIB
    yield "digits-in-keys", b"K: " + b"1" * 100_000 + b"x\n"
    yield "digits-in-ocam", b"1" * 1_000_000 + b"x 2\n"
    yield "long-key", own(640, 480).replace(b"focal_px", b"k" * 150_000)
    yield "long-model", own(640, 480).replace(b"equidistant", b"m" * 150_000)
    for name, unit in {
        "newlines": b"\n", "blanks": b" ", "tabs": b"\t", "zeros": b"\0", "brackets": b"[", "braces": b"{",
        "tags": b"<a>", "dashes": b"- ", "words": b"a b ", "pairs": b"a: b\n", "flow": b"[1],", "quotes": b"'a',",
        "commas": b"1, ", "anchors": b"- &a b\n", "empty-tags": b"<a/>", "objects": b'{"a":1},', "lists": b"[],",
        "dots": b"a.", "rows": b"1 2 3\n", "questions": b"? a\n", "comments": b"# \n", "numbers": b"1.5e-3 ",
        "escapes": b'"\\x41",',
    }.items():  # fmt: skip
        for begin, end in ((b"", b""), (b"a: [", b"]"), (b'format = "tiltvp-camera"\nx = [', b"]"), (b"[", b"0]")):
            for size in (140_000, 4 * MIB - 100):
                yield f"{name}-{len(begin)}-{size}", begin + unit * (size // len(unit)) + end
    yield "xml-children", b"<?xml version='1.0'?><opencv_storage>" + b"<a/>" * (MIB // 5) + b"</opencv_storage>"
    yield "json-lists", b'{"a": [' + b"[]," * (MIB // 4) + b"0]}"


def images() -> Iterator[tuple[str, bytes]]:
    """Image files."""
    yield "wide.png", png(32_000, 32_000)
    yield "lying.png", png(64, 48).replace(struct.pack(">II", 64, 48), struct.pack(">II", 2**31 - 1, 2**31 - 1))
    yield "lying.bmp", b"BM" + struct.pack("<IIIIiiHHIIIIII", 54, 0, 54, 40, 100_000, 100_000, 1, 24, 0, 0, 0, 0, 0, 0)
    yield "lying.ppm", b"P6\n100000 100000\n255\n" + bytes(100)
    yield "lying.pam", b"P7\nWIDTH 100000\nHEIGHT 100000\nDEPTH 3\nMAXVAL 255\nTUPLTYPE RGB\nENDHDR\n"
    yield "lying.jpg", b"\xff\xd8\xff\xc0\x00\x0b\x08\xff\xff\xff\xff\x01\x01\x11\x00\xff\xd9"
    yield "lying.webp", b"RIFF\x1e\0\0\0WEBPVP8X\n\0\0\0\0\0\0\0\xff\xff\xff\xff\xff\xff"
    yield (
        "lying.tif",
        b"II*\0\x08\0\0\0\x02\0" + struct.pack("<HHII", 256, 4, 1, 90_000) + struct.pack("<HHII", 257, 4, 1, 90_000),
    )
    yield "radiance.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 100000 +X 100000\n"
    yield "zeros.png", bytes(4 * MIB)
    yield "begin.jpg", b"\xff\xd8\xff" + b"\xff" * MIB


def logs() -> Iterator[tuple[str, bytes, bytes]]:
    """Odometry and bearings of drives."""
    head, seen = b"step,delta_left_m,delta_right_m\n", b"step,landmark,bearing_rad\n"
    steps = b"".join(b"%d,0.1,0.1\n" % k for k in range(16_000))
    yield "many-steps", head + steps, seen + b"0,1,0.1\n1,1,0.2\n"
    yield "many-landmarks", head + steps, seen + b"".join(b"%d,%d,0.1\n" % (k // 10, k) for k in range(100_000))
    yield "long-cell", head + b"0," + b"1" * 200_000 + b",0\n", seen
    yield "quoted-cell", head + b'0,"' + b"\n" * 200_000, seen
    yield "huge-landmark", head + b"0,0.1,0.1\n", seen + b"0," + b"9" * 400 + b",0.1\n"
    yield "landmark-2^53", head + b"0,0.1,0.1\n", seen + b"0,9007199254740992,0.1\n0,9007199254740993,0.2\n"
    yield "commas", head + b"," * (4 * MIB), seen
    yield "rows", head + b"1,2,3\n" * (4 * MIB // 6), seen
    yield "growing", head + b"".join(b"%d,1,1\n" % k for k in range(400_000)), seen + b"0,1,0.1\n"
    yield "zeros", bytes(4 * MIB), seen
    yield "words", head, b"a b " * MIB


def noise(seed: int, shape: tuple[int, ...]) -> np.ndarray:
    """Grey levels."""
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)
