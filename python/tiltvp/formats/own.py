"""Our own TOML: every number of a `CameraSpec` comes back with the same bits.

format = "tiltvp-camera"
version = 1
[[camera]]
name = "cam0"
model = "equidistant"
width = 640
height = 480
[camera.parameters]
focal_px = 139.7
cx = 319.5
cy = 239.5

A robot's file, `format = "tiltvp-robot"`, has one such camera and more beside it: see `tiltvp.Robot`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from tiltvp.arguments import refuse_unless
from tiltvp.errors import CalibrationError, InvalidInputError, TiltvpError
from tiltvp.files import write_whole
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize, Parameters

_FORMAT: Final = "tiltvp-camera"
ROBOT_FORMAT: Final = "tiltvp-robot"
ROBOT_KEYS: Final = ("mask", "mounting", "wheels", "topics")
VERSION: Final = 1
_MARK: Final = re.compile(r"^[^\S\n]*format[^\S\n]*=[^\S\n]*[\"']tiltvp-(camera|robot)[\"']", re.MULTILINE)
_KEYS: Final = ("name", "model", "width", "height", "mirror", "max_theta_rad", "notes", "parameters")


def recognise(document: Document) -> bool:
    """It says `format = "tiltvp-camera"` or `"tiltvp-robot"`."""
    return _MARK.search(document.text) is not None


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The cameras of the file, in file order."""
    root = root_of(document)
    cameras = root.need("camera").items()
    if not cameras:
        root.fail("there is no camera", "one or more [[camera]]")
    return [camera_from(camera, image_size) for camera in cameras]


def root_of(document: Document) -> Node:
    """The top of one of our files, its format, version and keys checked."""
    root = Node(document, document.toml("a file written by tiltvp"))
    word = root.need("format")
    if word.text() not in (_FORMAT, ROBOT_FORMAT):
        word.fail(f"found {word.text()!r}", f"{_FORMAT} or {ROBOT_FORMAT}")
    root.only("format", "version", "camera", *(ROBOT_KEYS if word.text() == ROBOT_FORMAT else ()))
    version = root.need("version")
    if version.integer() != VERSION:
        version.refuse(f"version {version.integer()} is not supported", f"version {VERSION}")
    return root


def write_toml(spec: CameraSpec | Sequence[CameraSpec], path: str | os.PathLike[str]) -> None:
    """Writes one camera, or several, to `path`; the file appears whole or not at all. Raises `OutputError`."""
    write_whole(path, written(checked(spec, path)))


def checked(given: CameraSpec | Sequence[CameraSpec], path: str | os.PathLike[str]) -> list[CameraSpec]:
    """One camera or several with plain numbers, before they are written.

    Raises `CalibrationError` for what no camera can be, `InvalidInputError` for what is no spec.
    """
    specs = list(given) if isinstance(given, Sequence) else [given]
    if not specs:
        raise CalibrationError(f"{path}: there is no camera to write, expected one or more, at spec")
    for one in specs:
        refuse_unless(one, CameraSpec, "spec", "CameraSpec, as Camera.to_spec() gives it")
        if not isinstance(one.name, str):
            raise InvalidInputError(f"name = {one.name!r}, expected a text")
        try:
            one.check()
        except TiltvpError as error:
            raise CalibrationError(f"{path}: {error}, at {one.name}") from None
    return [as_floats(one) for one in specs]


def written(specs: Sequence[CameraSpec]) -> str:
    """The text of a file of these cameras."""
    import tomli_w

    tree = {"format": _FORMAT, "version": VERSION, "camera": [camera_table(one) for one in specs]}
    return tomli_w.dumps(tree)


def camera_from(camera: Node, given: ImageSize | None) -> CameraSpec:
    """The camera of one table."""
    camera.only(*_KEYS)
    size = camera.image_size(given, camera.need("width"), camera.need("height"), "the file")
    name, mirror = camera.get("name"), camera.get("mirror")
    limit, notes = camera.get("max_theta_rad"), camera.get("notes")
    if name is not None and not isinstance(name.value, str):
        name.text()
    parameters = camera.need("parameters")
    spec = CameraSpec(
        camera.need("model").text(),
        size[0],
        size[1],
        dict(parameters.tree),  # type: ignore[arg-type]  # The core says what is no number.
        mirror=mirror.flag() if mirror else False,
        name=str(name.value) if name else "cam0",
        max_theta_rad=limit.number() if limit else None,
        notes=tuple(str(note.value) for note in notes.items()) if notes else (),
    )
    return as_floats(parameters.checked(spec))


def as_floats(spec: CameraSpec) -> CameraSpec:
    """The same camera with plain floats and integers."""
    parameters: Parameters = {
        key: [float(number) for number in value] if isinstance(value, list | tuple) else float(value)
        for key, value in spec.parameters.items()
    }
    limit = None if spec.max_theta_rad is None else float(spec.max_theta_rad)
    return replace(spec, width=int(spec.width), height=int(spec.height), parameters=parameters, max_theta_rad=limit)


def camera_table(spec: CameraSpec) -> dict[str, object]:
    """The table of one camera."""
    table: dict[str, object] = {"name": spec.name, "model": spec.model, "width": spec.width, "height": spec.height}
    if spec.mirror:
        table["mirror"] = True
    if spec.max_theta_rad is not None:
        table["max_theta_rad"] = spec.max_theta_rad
    if spec.notes:
        table["notes"] = list(spec.notes)
    table["parameters"] = dict(spec.parameters)
    return table
