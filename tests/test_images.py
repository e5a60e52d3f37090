"""Images of any usual kind as 8-bit grey levels, and image files."""

from __future__ import annotations

import os
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image

import tiltvp
from tiltvp.cli.sources import distinct_names
from tiltvp.csv_files import CsvFile
from tiltvp.errors import ImageFileError, InvalidInputError, OutputError, TiltvpError
from tiltvp.image_headers import header_size
from tiltvp.images import bgr_from, decode_as_stored, gray_from, is_as_stored, read_image, read_mask
from tiltvp.rotations import read_rotation
from tiltvp.streams import open_frames
from tiltvp.streams.image_files import find_images

LEVELS = np.arange(256, dtype=np.uint8).reshape(16, 16)


def test_grey_levels_are_kept() -> None:
    for same in (
        LEVELS,
        LEVELS.astype(np.uint16) * np.uint16(257),
        (LEVELS.astype(np.uint16) * np.uint16(257)).astype(">u2"),
        LEVELS / 255.0,
        (LEVELS / 255.0).astype(np.float16),
    ):
        gray = gray_from(same)
        assert gray.dtype == np.uint8
        assert gray.flags.c_contiguous
        assert np.array_equal(gray, LEVELS)


def test_what_resizing_makes_of_white_is_white() -> None:
    white = cv2.resize(np.ones((480, 640)), (213, 160), interpolation=cv2.INTER_AREA)
    assert white.max() > 1.0
    assert (gray_from(white) == 255).all()
    assert (gray_from(np.full((4, 4), -1e-9, np.float32)) == 0).all()


def test_rounds_to_the_nearest_level() -> None:
    assert gray_from(np.array([[0, 128, 129, 65535, 65406]], np.uint16)).tolist() == [[0, 0, 1, 255, 254]]
    assert gray_from(np.array([[0.0, 0.5 / 255 - 1e-9, 0.5 / 255 + 1e-9, 1.0]])).tolist() == [[0, 0, 1, 255]]
    assert gray_from(np.array([[False, True]])).tolist() == [[0, 255]]


def test_colour_is_in_the_order_of_opencv() -> None:
    bgr = np.zeros((1, 3, 3), np.uint8)
    bgr[0, 0, 0] = bgr[0, 1, 1] = bgr[0, 2, 2] = 255
    expected = [[29, 150, 76]]
    assert gray_from(bgr).tolist() == expected
    assert gray_from(np.dstack([bgr, np.full((1, 3), 7, np.uint8)])).tolist() == expected
    assert gray_from(bgr / 255.0).tolist() == expected
    assert gray_from(bgr[:, ::-1]).tolist() == [expected[0][::-1]]
    assert gray_from(LEVELS[:, :, None]).shape == (16, 16)


def test_the_argument_is_not_altered() -> None:
    image = np.dstack([LEVELS] * 3)
    image.flags.writeable = False
    gray_from(image)
    assert np.array_equal(image, np.dstack([LEVELS] * 3))


@pytest.mark.parametrize(
    ("image", "words"),
    [
        (np.zeros(4), "shape (4,)"),
        (np.zeros((4, 4, 5)), "shape (4, 4, 5)"),
        (np.zeros((0, 4)), "empty"),
        (np.zeros((4, 0, 3)), "empty"),
        (np.zeros((4, 4), np.int32), "int32"),
        (np.full((4, 4), np.nan), "NaN"),
        (np.full((4, 4), 1.01), "1.01"),
        (np.full((4, 4), -1e-3), "-0.001"),
        (np.zeros((4, 4), complex), "complex"),
        (np.zeros((4, 4), "datetime64[s]"), "datetime64"),
        ([[1.0], [2.0, 3.0]], "picture"),
    ],
)
def test_other_images_are_refused_by_name(image: object, words: str) -> None:
    with pytest.raises(InvalidInputError) as refusal:
        gray_from(image, "picture")  # type: ignore[arg-type]
    assert words in str(refusal.value)
    assert str(refusal.value).startswith("picture")


@pytest.mark.parametrize("ending", [".png", ".bmp", ".tiff", ".pgm"])
def test_files_without_loss_are_read_back(tmp_path: Path, ending: str) -> None:
    path = tmp_path / "deeper" / f"image{ending}"
    tiltvp.write_image(path, LEVELS)
    assert np.array_equal(tiltvp.read_image(path), LEVELS)
    assert [file.name for file in path.parent.iterdir()] == [path.name]


@pytest.mark.parametrize("ending", [".png", ".jpg", ".bmp", ".tiff", ".ppm", ".webp", ".jp2"])
def test_an_image_in_place_of_another_file_is_told_to_be_one(tmp_path: Path, ending: str) -> None:
    """It was told to be no text, and a large one to be larger than calibrations are."""
    noise = np.random.default_rng(0).integers(0, 255, (900, 900, 3), dtype=np.uint8)
    cv2.imwrite(str(path := tmp_path / f"image{ending}"), noise)
    for read, expected in (
        (tiltvp.Camera.load, "a calibration file"),
        (read_rotation, "a file with a rotation"),
        (tiltvp.TrainedCorrection.load, "a file written by `tiltvp lab train`"),
        (lambda file: CsvFile(file, "odometry as CSV"), "odometry as CSV"),
    ):
        with pytest.raises(TiltvpError, match=rf"image{ending}: is an image, expected {expected}"):
            read(path)


@pytest.mark.parametrize(
    ("mode", "clear", "once"),
    [
        *((mode, None, True) for mode in ("1", "L", "P", "RGB")),
        *((mode, None, False) for mode in ("LA", "RGBA", "I;16")),
        *((mode, clear, False) for mode, clear in (("L", 7), ("P", 7), ("RGB", (7, 7, 7)))),
    ],
)
def test_a_png_is_decoded_once_if_nothing_of_it_is_lost(mode: str, clear: Any, once: bool, tmp_path: Path) -> None:
    image = Image.fromarray(LEVELS.astype(np.uint16)) if mode == "I;16" else Image.fromarray(LEVELS).convert(mode)
    image.save(path := tmp_path / "a.png", **({} if clear is None else {"transparency": clear}))
    data = path.read_bytes()
    assert is_as_stored(data) == once
    assert not once or np.array_equal(read_image(path), decode_as_stored(data))


def test_colour_and_odd_names(tmp_path: Path) -> None:
    path = tmp_path / "Küche 1 台所.png"
    colour = np.dstack([LEVELS, LEVELS.T, LEVELS[::-1]])
    tiltvp.write_image(path, colour)
    assert np.array_equal(tiltvp.read_image(path), colour)
    assert np.array_equal(tiltvp.read_image(str(path)), colour)


def test_files_of_16_bits_are_read_as_grey_levels(tmp_path: Path) -> None:
    path = tmp_path / "deep.png"
    cv2.imwrite(str(path), LEVELS.astype(np.uint16) * 257)
    assert np.array_equal(gray_from(tiltvp.read_image(path)), LEVELS)


def test_what_is_written_is_what_was_meant(tmp_path: Path) -> None:
    deep = LEVELS.astype(np.uint16) * np.uint16(257)
    for image in (LEVELS / 255.0, (LEVELS / 255.0).astype(np.float32), deep):
        tiltvp.write_image(tmp_path / "a.png", image)
        assert np.array_equal(read_image(tmp_path / "a.png"), LEVELS)
    tiltvp.write_image(tmp_path / "mask.png", LEVELS > 100)
    assert np.array_equal(read_image(tmp_path / "mask.png"), np.where(LEVELS > 100, 255, 0))
    assert np.array_equal(read_mask(tmp_path / "mask.png"), LEVELS > 100)
    cv2.imwrite(str(tmp_path / "mask.jpg"), np.where(LEVELS > 100, 255, 0), [cv2.IMWRITE_JPEG_QUALITY, 50])
    assert np.array_equal(read_mask(tmp_path / "mask.jpg"), LEVELS > 100)
    tiltvp.write_image(tmp_path / "photograph.png", LEVELS)
    with pytest.raises(InvalidInputError, match=r"photograph\.png: .* other than two tones, expected a mask: white"):
        read_mask(tmp_path / "photograph.png")
    (tmp_path / "camera.toml").write_text("[camera]")
    with pytest.raises(
        ImageFileError, match=r"camera\.toml: not an image .* \(8 bytes\), expected a mask: white where"
    ):
        read_mask(tmp_path / "camera.toml")
    tiltvp.write_image(tmp_path / "a.bmp", deep)
    assert np.array_equal(read_image(tmp_path / "a.bmp"), LEVELS)
    for other in (LEVELS.astype(np.int16), 1.0 * LEVELS, LEVELS.astype(complex)):
        with pytest.raises(InvalidInputError, match=r"b\.png"):
            tiltvp.write_image(tmp_path / "b.png", other)
    assert not (tmp_path / "b.png").exists()


def test_what_is_no_image_is_not_written(tmp_path: Path) -> None:
    for image in (LEVELS[0], LEVELS[:0], np.dstack([LEVELS] * 2), np.dstack([LEVELS] * 5), None, [[1], [2, 3]]):
        with pytest.raises(InvalidInputError, match=r"a\.png.*expected \(H, W\) or"):
            tiltvp.write_image(tmp_path / "a.png", image)  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def test_the_byte_order_of_an_array_does_not_matter(tmp_path: Path) -> None:
    deep = LEVELS.astype(np.uint16) * np.uint16(255)
    tiltvp.write_image(tmp_path / "a.png", deep.astype(">u2"))
    assert np.array_equal(decode_as_stored((tmp_path / "a.png").read_bytes()), deep)
    camera = tiltvp.Camera.equidistant(width=16, height=16, focal_px=5.0, cx=7.5, cy=7.5)
    levelled = tiltvp.level(deep.astype(">u2"), camera, (0.1, 0.7), np.eye(3))
    assert np.array_equal(levelled, tiltvp.level(deep, camera, (0.1, 0.7), np.eye(3)))


def test_masked_values_are_no_pixels() -> None:
    camera = tiltvp.Camera.equidistant(width=16, height=16, focal_px=5.0, cx=7.5, cy=7.5)
    hidden = np.ma.masked_array(LEVELS, mask=LEVELS > 100)
    calls = [
        gray_from,
        tiltvp.TiltEstimator(camera, elevation_min_rad=0.2),
        lambda image: tiltvp.level(image, camera, (0.1, 0.7), np.eye(3)),
        lambda image: tiltvp.body_mask([image] * 5, camera),
        lambda image: tiltvp.write_image("a.png", image),
        lambda image: bgr_from(np.ma.dstack([image] * 3)),
    ]
    for call in calls:
        with pytest.raises(InvalidInputError, match="masked values, expected one without"):
            call(hidden)
    assert np.array_equal(gray_from(np.ma.masked_array(LEVELS)), LEVELS)


@pytest.mark.parametrize("check", [tiltvp.body_mask, tiltvp.check_lens, tiltvp.check_setup, tiltvp.surround_mask])
def test_what_are_no_images_or_no_camera_is_said(check: Callable[..., object]) -> None:
    camera = tiltvp.Camera.equidistant(width=16, height=16, focal_px=5.0, cx=7.5, cy=7.5)
    with pytest.raises(InvalidInputError, match=r"images: NoneType, expected several images"):
        check(None, camera)
    with pytest.raises(InvalidInputError, match=r"images = 'drive/', expected several images, as tiltvp\.read_image"):
        check("drive/", camera)
    if check is not tiltvp.surround_mask:
        with pytest.raises(InvalidInputError, match=r"camera: str, expected a tiltvp\.Camera"):
            check([LEVELS] * 5, "camera.toml", mask=LEVELS > 3)
        with pytest.raises(InvalidInputError, match=r"mask: cannot be made an array"):
            check([LEVELS] * 5, camera, mask=[[True], [True, False]])


def test_unreadable_files_are_named(tmp_path: Path) -> None:
    empty, text, cut = tmp_path / "empty.png", tmp_path / "text.png", tmp_path / "cut.png"
    empty.touch()
    text.write_text("not an image")
    tiltvp.write_image(cut, np.random.default_rng(0).integers(0, 256, (64, 64), np.uint8))
    cut.write_bytes(cut.read_bytes()[:40])
    for path in (empty, text, cut, tmp_path / "missing.png", tmp_path):
        with pytest.raises(ImageFileError) as refusal:
            tiltvp.read_image(path)
        assert str(path) in str(refusal.value)
        assert "\n" not in str(refusal.value)


def test_a_tiff_that_points_beyond_any_file_is_unreadable(tmp_path: Path) -> None:
    (tmp_path / "far.tiff").write_bytes(b"II+\0\x08\0\0\0" + b"\xff" * 8)
    with pytest.raises(ImageFileError, match=r"far\.tiff"):
        read_image(tmp_path / "far.tiff")


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("turn", range(1, 9))
def test_pixels_are_where_the_sensor_has_them(turn: int, channels: int, tmp_path: Path) -> None:
    """Whatever the orientation tag says: OpenCV turns TIFF files by it also where it is told not to."""
    pixels, path = np.random.default_rng(0).integers(0, 256, (6, 8, channels), np.uint8).squeeze(), tmp_path / "a.tiff"
    Image.fromarray(pixels[..., ::-1] if channels == 3 else pixels).save(path, tiffinfo={0x0112: turn})
    np.testing.assert_array_equal(read_image(path), pixels)
    np.testing.assert_array_equal(decode_as_stored(path.read_bytes()), pixels)


def test_a_file_of_floats_is_read_as_an_array_of_them(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "a.tif"), (LEVELS / 255.0).astype(np.float32))
    np.testing.assert_array_equal(read_image(tmp_path / "a.tif"), LEVELS)
    cv2.imwrite(str(tmp_path / "a.tif"), LEVELS.astype(np.float32))
    with pytest.raises(ImageFileError, match=r"a\.tif: floats with values from 0 to 255, expected floats in \[0, 1\]"):
        read_image(tmp_path / "a.tif")


def test_a_photograph_that_was_turned_is_told_to_stay_as_it_is(tmp_path: Path) -> None:
    turned = Image.Exif()
    turned[0x0112] = 3
    Image.fromarray(LEVELS).save(tmp_path / "a.jpg", exif=turned)
    Image.fromarray(LEVELS).save(tmp_path / "0.png")
    Image.fromarray(LEVELS).save(tmp_path / "1.jpg")
    [note] = open_frames([str(tmp_path)]).notes
    assert "a.jpg: its orientation tag 3 is not followed: pixels stay where the sensor has them" in note
    Image.fromarray(LEVELS).save(tmp_path / "b.jpg", exif=turned)
    [note] = open_frames([str(tmp_path)]).notes
    assert "a.jpg: its orientation tag 3 is not followed (2 such): pixels stay" in note
    (tmp_path / "b.jpg").unlink()
    Image.fromarray(LEVELS).save(tmp_path / "a.jpg")
    assert open_frames([str(tmp_path)]).notes == ()


def test_files_of_16_bits_for_values_of_8_are_told(tmp_path: Path) -> None:
    """They are read as of 10 bits, a quarter as bright."""
    for name in ("a.png", "b.png"):
        cv2.imwrite(str(tmp_path / name), LEVELS.astype(np.uint16))
    [note] = open_frames([str(tmp_path)]).notes
    assert "a.png: no value of its 16 bits is above 255: it is read as one of 10 bits, expected files of 8" in note
    for levels in (LEVELS, LEVELS.astype(np.uint16) * 4):
        cv2.imwrite(str(tmp_path / "a.png"), levels)
        assert open_frames([str(tmp_path)]).notes == ()
    (tmp_path / "a.png").write_bytes(b"none")
    assert open_frames([str(tmp_path)]).notes == ()


@pytest.mark.parametrize("order", "<>")
def test_the_size_of_a_big_tiff_is_in_its_header(order: str) -> None:
    entries = struct.pack(order + "HHQQ", 257, 16, 1, 300) + struct.pack(order + "HHQQ", 256, 16, 1, 70_000)
    begin = (b"II" if order == "<" else b"MM") + struct.pack(order + "HHHQ", 43, 8, 0, 16)
    assert header_size(begin + struct.pack(order + "Q", 2) + entries + bytes(8)) == (70_000, 300)


def test_unwritable_files_are_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    cases = ((tmp_path / "image.unknown", ImageFileError), (tmp_path / "file" / "image.png", OutputError))
    for path, kind in cases:
        with pytest.raises(kind) as refusal:
            tiltvp.write_image(path, LEVELS)
        assert str(path) in str(refusal.value)
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


def test_images_are_found_once_and_named_apart(tmp_path: Path) -> None:
    for name in ("x/a.png", "x/a.jpg", "y/a.png", "y/B.png", "y/notes.txt", "y/b.PNG.txt"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"")
    os.symlink(tmp_path / "x" / "a.png", tmp_path / "x" / "link.png")
    files, problems, repeated = find_images([str(tmp_path / "x/a.png"), str(tmp_path / "x"), f"{tmp_path}/*/[aB].png"])
    assert not problems
    assert repeated == [(tmp_path / "x/link.png", tmp_path / "x/a.png")]
    assert "x/link.png leads to " in open_frames([str(tmp_path / "x")]).notes[0]
    assert [str(file.relative_to(tmp_path)) for file in files] == ["x/a.png", "x/a.jpg", "y/B.png", "y/a.png"]
    names = distinct_names(files)
    assert names == ["x_a_png", "x_a_jpg", "B", "y_a_png"]
    assert distinct_names([Path("p/a.png"), Path("P/A.png"), Path("p_a.png")]) == ["p_a", "P_A_2", "p_a_3"]


@pytest.mark.parametrize(
    "names",
    [
        ["1.png", "2.png", "9.png", "10.png", "100.png"],
        ["a-2_9.png", "a-2_10.png", "a-10_1.png"],
        ["0.05.png", "0.10.png", "0.2.png", "10.1.png"],
        ["a.png", "a2.png", "a10.png", "b.png"],
    ],
)
def test_numbers_in_names_are_in_their_order(tmp_path: Path, names: list[str]) -> None:
    for name in reversed(names):
        (tmp_path / name).write_bytes(b"")
    for word in (str(tmp_path), f"{tmp_path}/*.png"):
        assert [file.name for file in find_images([word])[0]] == names


@pytest.mark.parametrize("bits", [10, 12, 14, 16])
def test_values_of_sensors_with_fewer_bits_are_not_black(tmp_path: Path, bits: int) -> None:
    white = 2**bits - 1
    deep = (LEVELS.astype(np.uint32) * white // 255).astype(np.uint16)
    deep[0, 0] = white
    expected = LEVELS.copy()
    expected[0, 0] = 255
    path = tmp_path / "deep.png"
    cv2.imwrite(str(path), deep)
    for gray in (gray_from(deep), read_image(path)):
        assert gray.dtype == np.uint8
        assert np.abs(gray.astype(int) - expected).max() <= 1
