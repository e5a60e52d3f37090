"""Images as users have them, made the 8-bit grey levels that the core reads; image files."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp import _core
from tiltvp.arguments import path_from, refuse_single, refuse_unless
from tiltvp.decoder_words import quietly
from tiltvp.errors import ImageFileError, InvalidInputError, TiltvpError
from tiltvp.files import read_bytes, write_whole
from tiltvp.image_headers import file_size, header_size, unturned

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = [
    "bgr_from",
    "bits_of",
    "checked_camera",
    "checked_mask",
    "decode_as_stored",
    "decode_image",
    "gray_from",
    "grays_from",
    "image_size",
    "is_as_stored",
    "is_shallow",
    "pixels_from",
    "read_image",
    "read_mask",
    "size_problem",
    "write_image",
]

LARGEST_IMAGE_BYTES: Final = 1 << 30
"""Of an image file: as many pixels as a camera may have, in three uncompressed colours, and a half more."""
_EXPECTED = "(H, W) or (H, W, 3 or 4 in BGR order) of uint8, uint16, or float in [0, 1]"
_DEPTHS = (10, 12, 14, 16)
"""Bits that sensors have where files and arrays have 16."""
_BEYOND: Final = 1e-6
"""By how much floats may be beyond [0, 1]: OpenCV's INTER_AREA makes 1 + 3e-8 of white, and 32 bits as much."""
_TONE, _ASTRAY = 16, 0.15
"""Grey levels by which pixels of a mask may be off its two tones, and the share of those that are farther off: 0.12 of
a mask whose borders were blurred by 6 pixels, 0.01 by the strongest compression of JPEG, 0.21 and more of 114
photographs."""
_NOT_DECODED: Final = "not an image that can be decoded"
_NO_ALPHA: Final = (0, 2, 3)
"""Colour types of PNG, of which 4 and 6 have opacity for each pixel (PNG 11.2.2)."""
_DEEP = (".png", ".tif", ".tiff", ".pgm", ".ppm", ".pnm", ".jp2")
"""Endings of the files that hold 16 bits a value."""


def gray_from(image: ArrayLike, name: str = "image", *, bits: int | None = None) -> NDArray[np.uint8]:
    """A C-contiguous (H, W) uint8 array from an image of any usual kind; the argument is never altered.

    Colour is taken in OpenCV's order (BGR or BGRA). uint16 is scaled so that the greatest value of 10, 12, 14 or 16
    bits becomes 255: of the least of these depths that holds all values of the image, for sensors have fewer bits than
    their files; or that of `bits`, where they are known. Floats in [0, 1] are scaled by 255. All are rounded. Raises
    `InvalidInputError` for other shapes and types, empty images, NaN, floats outside [0, 1], and values above `bits`.
    """
    levels = _bytes_from(_image_from(image, name), name, bits)
    if levels.ndim == 3:
        if levels.shape[2] == 1:
            levels = levels[:, :, 0]
        else:
            import cv2

            code = cv2.COLOR_BGR2GRAY if levels.shape[2] == 3 else cv2.COLOR_BGRA2GRAY
            levels = np.asarray(cv2.cvtColor(np.ascontiguousarray(levels), code), dtype=np.uint8)
    return np.ascontiguousarray(levels)


def pixels_from(image: ArrayLike, name: str, expected: str) -> NDArray[Any]:
    """The array of an image or a mask, of the machine's byte order.

    Raises `InvalidInputError` for what is none, and for one with masked values: they would be pixels like others.
    """
    if np.ma.is_masked(image):
        raise InvalidInputError(f"{name}: an array with masked values, expected one without: {expected}")
    try:
        array = np.asarray(image)
    except ValueError as error:
        raise InvalidInputError(f"{name}: cannot be made an array ({error}), expected {expected}") from error
    if array.ndim == 0:
        raise InvalidInputError(f"{name}: {type(image).__name__}, expected {expected}")
    return array.astype(array.dtype.newbyteorder("="), copy=False)


def _image_from(image: ArrayLike, name: str) -> NDArray[Any]:
    """The array of an image, of a shape that one may have."""
    array = pixels_from(image, name, _EXPECTED)
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] not in (1, 3, 4)):
        raise InvalidInputError(f"{name}: shape {array.shape}, expected {_EXPECTED}")
    if array.size == 0:
        raise InvalidInputError(f"{name}: shape {array.shape} is empty, expected {_EXPECTED}")
    return array


def grays_from(images: Iterable[ArrayLike]) -> list[NDArray[np.uint8]]:
    """`gray_from` of each, by its number; copies where `images` is no sequence: drivers write into one buffer."""
    kept = isinstance(images, Sequence | np.ndarray)
    grays = (gray_from(image, name) for name, image in _named(images))
    return [gray if kept else gray.copy() for gray in grays]


def _named(images: Iterable[ArrayLike]) -> Iterator[tuple[str, ArrayLike]]:
    """Images with the names that messages call them."""
    refuse_single(images, "images", "several images")
    if isinstance(images, str | bytes):
        raise InvalidInputError(f"images = {images!r}, expected several images, as tiltvp.read_image reads them")
    return ((f"images[{number}]", image) for number, image in enumerate(images))


def bgr_from(image: ArrayLike, name: str = "image", *, bits: int | None = None) -> NDArray[np.uint8]:
    """A C-contiguous (H, W, 3) uint8 array in BGR order from a colour image of any usual kind; never altered.

    As `gray_from`; grey images are refused too.
    """
    expected = "(H, W, 3 or 4 in BGR order) of uint8, uint16, or float in [0, 1]"
    array = pixels_from(image, name, expected)
    if array.ndim != 3 or array.shape[2] not in (3, 4) or array.size == 0:
        raise InvalidInputError(f"{name}: shape {array.shape}, expected {expected}")
    return np.ascontiguousarray(_bytes_from(array[:, :, :3], name, bits))


def camera_grays(images: Iterable[ArrayLike], camera: _core.Camera) -> Iterator[NDArray[np.uint8]]:
    """Each image of a camera as `gray_from` makes it, (H, W), one after the other.

    Raises `InvalidInputError` with the number of what is no image, or one of another size than the camera's.
    """
    shape = (camera.height, camera.width)
    for name, image in _named(images):
        gray = gray_from(image, name)
        if gray.shape != shape:
            raise InvalidInputError(f"{name}: shape {gray.shape}, expected {shape}, as the camera's images")
        yield gray


def size_problem(size: tuple[int, int], camera: _core.Camera) -> str:
    """What is wrong with an image of that (width, height), as the core says it."""
    expected = f"{camera.height} x {camera.width} (rows x columns), as the camera's images"
    return f"got {size[1]} x {size[0]} pixels, expected {expected}"


def checked_camera(camera: object) -> None:
    """Raises `InvalidInputError` for what is no camera, such as the path of one or a `Robot`."""
    refuse_unless(camera, _core.Camera, "camera", "a tiltvp.Camera")


def checked_mask(mask: ArrayLike, camera: _core.Camera) -> NDArray[np.bool_]:
    """A fresh (H, W) bool array, True where images of the camera show the world.

    Raises `InvalidInputError` for other types, such as uint8, for other shapes, and for one that is True nowhere.
    """
    checked_camera(camera)
    expected = f"({camera.height}, {camera.width}) of bool, as the camera's images"
    array = pixels_from(mask, "mask", expected).copy()
    if array.dtype != np.bool_ or array.shape != (camera.height, camera.width):
        raise InvalidInputError(f"mask: shape {array.shape} of {array.dtype}, expected {expected}")
    if not array.any():
        raise InvalidInputError("mask: False everywhere, expected True where images show the world")
    return array


def _bytes_from(array: NDArray[Any], name: str, bits: int | None = None) -> NDArray[np.uint8]:
    if array.dtype == np.uint8:
        return array
    if array.dtype == np.uint16:
        deep = bits_of(array) if bits is None else bits
        if isinstance(deep, bool) or not isinstance(deep, int) or not 1 <= deep <= _DEPTHS[-1]:
            raise InvalidInputError(f"bits = {bits!r}, expected a whole number from 1 to {_DEPTHS[-1]}")
        white = 2**deep - 1
        if array.max() > white:
            raise InvalidInputError(f"{name}: a value of {array.max()}, expected at most {white} ({bits} bits)")
        return np.asarray((array.astype(np.uint32) * 255 + white // 2) // white, dtype=np.uint8)
    if array.dtype == np.bool_:
        return array.astype(np.uint8) * np.uint8(255)
    if array.dtype.kind == "f":
        low, high = float(array.min()), float(array.max())
        if not (low >= -_BEYOND and high <= 1.0 + _BEYOND):
            what = "NaN" if np.isnan(low) else f"values from {low:g} to {high:g}"
            raise InvalidInputError(f"{name}: floats with {what}, expected floats in [0, 1]")
        return np.asarray(np.rint(array * 255.0), dtype=np.uint8)
    raise InvalidInputError(f"{name}: dtype {array.dtype}, expected {_EXPECTED}")


def bits_of(array: NDArray[np.uint16]) -> int:
    """The depth of a sensor whose values stand in 16 bits: the least of 10, 12, 14 and 16 that holds them all."""
    greatest = int(array.max())
    return next(bits for bits in _DEPTHS if greatest < 2**bits)


def read_image(path: str | os.PathLike[str]) -> NDArray[np.uint8]:
    """The image file as (H, W) or (H, W, 3) uint8, colour in BGR order. Raises `ImageFileError` with the path.

    Pixels stay where the sensor has them: a calibration knows nothing of the orientation tag of a photograph. Files of
    16 bits a value are scaled as arrays of uint16 are, those of floats as arrays of floats.
    """
    file = path_from(path)
    return decode_image(image_bytes(file), str(file))


def read_mask(path: str | os.PathLike[str]) -> NDArray[np.bool_]:
    """(H, W): where an image file of two tones is light.

    Raises `ImageFileError` as `read_image` does, `InvalidInputError` for a photograph.
    """
    expected = "a mask: white where images show the world, black elsewhere"
    try:
        gray = gray_from(read_image(path), str(path))
    except ImageFileError as error:
        raise ImageFileError(f"{error}, expected {expected}") from None
    light = gray > 127
    tones = [tone for tone in (gray[light], gray[~light]) if tone.size]
    astray = sum(np.count_nonzero(np.abs(tone - np.median(tone)) > _TONE) for tone in tones) / gray.size
    if astray > _ASTRAY:
        raise InvalidInputError(f"{path}: {astray:.0%} of its pixels are of other than two tones, expected {expected}")
    return light


def image_bytes(file: Path) -> bytes:
    """The content of an image file. Raises `ImageFileError` with the path."""
    try:
        return read_bytes(file, LARGEST_IMAGE_BYTES)
    except OSError as error:
        raise ImageFileError(f"{file}: {error.strerror or error}") from error


def image_size(path: str | os.PathLike[str]) -> tuple[int, int]:
    """(width, height) by the header of an image file. Raises `ImageFileError` with the path, as `read_image` does."""
    file = path_from(path)
    try:
        size = file_size(file)
    except OSError as error:
        raise ImageFileError(f"{file}: {error.strerror or error}") from error
    return size or _header_of(image_bytes(file), str(file))


def decode_image(data: bytes, name: str) -> NDArray[np.uint8]:
    """The content of an image file as `read_image` gives it. Raises `ImageFileError` that begins with `name`."""
    try:
        return _bytes_from(_decoded(data, name), name)
    except InvalidInputError as error:
        raise ImageFileError(str(error)) from None


def is_shallow(file: Path) -> bool:
    """Whether an image file of 16 bits a value has none above 255; not what cannot be read."""
    if file.suffix.lower() not in _DEEP:
        return False
    try:
        data = image_bytes(file)
        # A PNG tells its bits in the header; others, which are rare, are decoded.
        if data[12:16] == b"IHDR" and data[24:25] != b"\x10":
            return False
        pixels = _decoded(data, str(file))
    except (TiltvpError, ValueError):
        return False
    return pixels.dtype == np.uint16 and int(pixels.max()) <= 255


def _decoded(data: bytes, name: str) -> NDArray[Any]:
    width, height = _header_of(data, name)
    if width * height > _core.MOST_PIXELS:
        raise ImageFileError(f"{name}: {width} x {height} pixels, expected at most {_core.MOST_PIXELS} in all")
    image = _decode(data)
    if image is None:
        raise ImageFileError(f"{name}: {_NOT_DECODED} ({len(data)} bytes)")
    return image


def _header_of(data: bytes, name: str) -> tuple[int, int]:
    size = header_size(data)
    if size is None:
        raise ImageFileError(f"{name}: {_NOT_DECODED} ({len(data)} bytes)")
    return size


def _decode(data: bytes) -> NDArray[Any] | None:
    import cv2

    depths = cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        with quietly():
            return cv2.imdecode(np.frombuffer(unturned(data), dtype=np.uint8), depths)
    except (cv2.error, MemoryError):
        return None


def decode_as_stored(data: bytes) -> NDArray[Any]:
    """What `decode_image` takes, with its depth and opacity: (H, W) or (H, W, 3 or 4) uint8 or uint16, BGR or BGRA."""
    import cv2

    with quietly():
        return np.asarray(cv2.imdecode(np.frombuffer(unturned(data), dtype=np.uint8), cv2.IMREAD_UNCHANGED))


def is_as_stored(data: bytes) -> bool:
    """Whether `decode_image` gives all that `decode_as_stored` does: of a PNG of at most 8 bits and without opacity."""
    return data[12:16] == b"IHDR" and data[24] <= 8 and data[25] in _NO_ALPHA and b"tRNS" not in data


def write_image(path: str | os.PathLike[str], image: NDArray[Any]) -> None:
    """Writes an image (H, W) or (H, W, 3 or 4), colour in BGR order, whole or not at all; the ending says the format.

    uint16 is kept where the format holds it. What else `gray_from` takes becomes uint8 as there: bool, so masks are
    black and white, floats in [0, 1], and uint16. Raises `InvalidInputError` for other types and shapes,
    `ImageFileError` for an image that the format cannot hold, `OutputError` where it cannot be written.
    """
    import cv2

    file = path_from(path)
    ending = file.suffix or ".png"
    levels = _image_from(image, os.fspath(file))
    if levels.dtype != np.uint16 or ending.lower() not in _DEEP:
        levels = _bytes_from(levels, os.fspath(file))
    try:
        done, data = cv2.imencode(ending, levels)
    except cv2.error as error:
        raise ImageFileError(
            f"{file}: cannot be encoded as {file.suffix!r}, expected .png, .jpg or the like"
        ) from error
    if not done:
        raise ImageFileError(f"{file}: cannot be encoded as {file.suffix!r}")
    write_whole(file, data.tobytes())
