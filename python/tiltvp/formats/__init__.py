"""Calibration files of many tools, read into `CameraSpec`s: the table of formats and the one door, `read_cameras`."""

from __future__ import annotations

import difflib
import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final

from tiltvp.arguments import path_from, size_from
from tiltvp.errors import CalibrationError, UnsupportedFormatError
from tiltvp.files import write_whole
from tiltvp.formats import (
    basalt,
    boofcv,
    camodocal,
    colmap,
    fisheye_calib_adapter,
    gyroflow,
    kalibr,
    libper,
    ocamcalib,
    omnicalib,
    opencv,
    orbslam3,
    own,
    pyocamcalib,
    ros,
    stella_vslam,
    stereo,
    vikit,
    woodscape,
)
from tiltvp.formats.document import Document
from tiltvp.formats.own import write_toml
from tiltvp.formats.spec import CameraSpec, ImageSize

__all__ = ["FORMATS", "CameraSpec", "Format", "read_cameras", "write_cameras", "write_toml"]


@dataclass(frozen=True)
class Format:
    """One format: its name for `format=`, whether a document looks like it, how it is read and, if it is, written."""

    name: str
    recognise: Callable[[Document], bool]
    parse: Callable[[Document, ImageSize | None], list[CameraSpec]]
    written: Callable[[Sequence[CameraSpec]], str] | None = None


FORMATS: Final[tuple[Format, ...]] = (
    Format("tiltvp", own.recognise, own.parse, own.written),
    Format("ocamcalib", ocamcalib.recognise, ocamcalib.parse, ocamcalib.written),
    Format("pyocamcalib", pyocamcalib.recognise, pyocamcalib.parse),
    Format("opencv", opencv.recognise, opencv.parse, opencv.written),
    Format("opencv-pinhole", opencv.never, opencv.parse_as_pinhole),
    Format("opencv-fisheye", opencv.never, opencv.parse_as_fisheye),
    Format("kalibr", kalibr.recognise, kalibr.parse, kalibr.written),
    Format("basalt", basalt.recognise, basalt.parse, basalt.written),
    Format("colmap", colmap.recognise, colmap.parse, colmap.written),
    Format("ros", ros.recognise, ros.parse, ros.written),
    Format("camodocal", camodocal.recognise, camodocal.parse),
    Format("woodscape", woodscape.recognise, woodscape.parse),
    Format("vikit", vikit.recognise, vikit.parse),
    Format("stella-vslam", stella_vslam.recognise, stella_vslam.parse),
    Format("orbslam3", orbslam3.recognise, orbslam3.parse),
    Format("boofcv", boofcv.recognise, boofcv.parse),
    Format("fisheye-calib-adapter", fisheye_calib_adapter.recognise, fisheye_calib_adapter.parse),
    Format("libper", libper.recognise, libper.parse),
    Format("gyroflow", gyroflow.recognise, gyroflow.parse),
    Format("py-omnicalib", omnicalib.recognise, omnicalib.parse),
)


def read_cameras(
    path: str | os.PathLike[str], format: str | None = None, image_size: ImageSize | None = None
) -> list[CameraSpec]:
    """All the cameras of a calibration file, in file order.

    `format` is the name of one of `FORMATS`; without it the file is recognised by its content. `image_size` is (width,
    height) in pixels, for files that do not carry it; it may not contradict a file that does. Raises `CalibrationError`
    with the file, what is wrong, what was expected and where; `UnsupportedFormatError`, which is one, for a format or a
    lens model that is not supported; `CalibrationNotFoundError`, which is one and a `FileNotFoundError`.
    """
    size = None if image_size is None else size_from(image_size, "image_size")
    chosen = None if format is None else _named(format)
    document = Document.load(path)
    if chosen is None:
        chosen = _recognised(document)
    try:
        return [replace(spec, format=chosen.name) for spec in chosen.parse(document, size)]
    except CalibrationError as error:
        fitting = [one.name for one in FORMATS if one.recognise(document)]
        if chosen.name in fitting or not fitting:
            raise
        raise type(error)(f"{error} (read as {chosen.name}, and it is of {' or '.join(fitting)})") from error


def write_cameras(
    specs: CameraSpec | Sequence[CameraSpec], path: str | os.PathLike[str], format: str = "tiltvp"
) -> None:
    """Writes one camera, or several, as a calibration file of `format`; the file appears whole or not at all.

    Formats that are written are those of `FORMATS` with `written`. COLMAP's is binary if `path` ends in .bin. A limit
    `max_theta_rad` is kept by our own format alone. Raises `CalibrationError` for what no camera can be,
    `InvalidInputError` for what is no spec, `UnsupportedFormatError` for a lens or a number of cameras that the format
    cannot hold, with those that can, and `OutputError`.
    """
    chosen = _named(format)
    if chosen.written is None:
        known = ", ".join(one.name for one in FORMATS if one.written)
        raise UnsupportedFormatError(f"{path}: {chosen.name} is not written, expected one of {known}")
    checked = own.checked(specs, path)
    try:
        is_binary = chosen.name == "colmap" and str(path_from(path)).lower().endswith(".bin")
        content = colmap.written_binary(checked) if is_binary else chosen.written(checked)
    except UnsupportedFormatError as error:
        raise UnsupportedFormatError(f"{path}: {error}; {', '.join(_holding(checked))} can hold it") from None
    write_whole(path, content)


def _holding(specs: Sequence[CameraSpec]) -> list[str]:
    """The formats that can hold all the cameras; our own can."""
    names = []
    for one in FORMATS:
        if one.written is not None:
            with suppress(UnsupportedFormatError):
                one.written(specs)
                names.append(one.name)
    return names


def _named(name: str) -> Format:
    words = {_plain(one.name): one for one in FORMATS}
    chosen = words.get(_plain(str(name)))
    if chosen is None:
        near = [words[word].name for word in difflib.get_close_matches(_plain(str(name)), words, 3)]
        meant = f"near it: {', '.join(near)}; all: " if near else "one of "
        raise UnsupportedFormatError(
            f"unknown format {name!r}, expected {meant}{', '.join(one.name for one in FORMATS)}, at format="
        )
    return chosen


def _plain(name: str) -> str:
    return "".join(letter for letter in name.lower() if letter.isalnum())


def _recognised(document: Document) -> Format:
    fitting = [one for one in FORMATS if one.recognise(document)]
    if len(fitting) == 1:
        return fitting[0]
    if fitting:
        names = " and ".join(one.name for one in fitting)
        document.fail(f"could be {names}", "format= to say which", "the whole file")
    if stereo.is_own(document):
        document.fail(
            "is a pair of cameras",
            "one camera (pairs are for StereoRig.load, and for tiltvp corner with right images)",
            "the top of the file",
            UnsupportedFormatError,
        )
    why = f" (read as keys: {document.syntax_problem})" if document.syntax_problem else ""
    if document.path.suffix.lower() == ".toml":
        why = ' (TOML without format = "tiltvp-camera")'
    document.fail(
        f"no known calibration format{why}",
        "one of " + ", ".join(one.name for one in FORMATS),
        "the whole file",
        UnsupportedFormatError,
    )
