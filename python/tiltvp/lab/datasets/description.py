"""`dataset.toml`: which camera took the images, how it sits on the robot, and where its wheels are."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp.cameras import Camera
from tiltvp.errors import CalibrationError, ImageFileError, InvalidInputError, TiltvpError
from tiltvp.files import read_text
from tiltvp.formats.document import LARGEST_BYTES
from tiltvp.images import read_mask
from tiltvp.lab.datasets.findings import Findings, near
from tiltvp.robot import Robot, is_robot, named_mask
from tiltvp.rotations import rotation_from

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["CALIBRATION", "DESCRIPTION", "Description", "Wheels", "read_description"]

DESCRIPTION: Final = "dataset.toml"
CALIBRATION: Final = "camchain.yaml"
"""Of a stereo sequence: both cameras and how they sit to each other, as Kalibr writes it."""

_KEYS: Final = {
    "camera": "the name of a calibration file or a robot's file in this folder",
    "camera_format": "the name of a format, as `tiltvp camera formats` lists them",
    "camera_name": "the name or number of a camera in that file",
    "image_size": "[width, height] in pixels",
    "mirror": "true or false",
    "mask": "the name of an image in this folder",
    "robot_from_camera": "three rows of three numbers, or one of the words up and forward",
    "wheels": "a table with half_track_m and caster_m",
    "source": "a table",
}


@dataclass(frozen=True)
class Wheels:
    """Where the wheels touch the ground, metres (fig. 20): the main wheels at (0, +-r_w), the caster at (-r_c, 0)."""

    half_track_m: float
    caster_m: float


@dataclass(frozen=True, eq=False)
class Description:
    """What a `dataset.toml` says, as far as it can be read.

    `mask` is (H, W) bool, True where the image shows the world; `files` are those that the description names.
    """

    camera: Camera | None
    robot_from_camera: NDArray[np.float64]
    mask: NDArray[np.bool_] | None
    wheels: Wheels | None
    source: dict[str, Any] = field(default_factory=dict)
    files: tuple[Path, ...] = ()


def read_description(directory: Path, findings: Findings) -> Description:
    """The description of a dataset; what is wrong with it goes to `findings`."""
    file = directory / DESCRIPTION
    table = _table(file, findings)
    if table is None:
        return Description(None, np.eye(3), None, None)
    for key, value in table.items():
        if key not in _KEYS:
            findings.add(file, None, f"unknown key {key!r}{near(key, _KEYS)}", f"one of {', '.join(_KEYS)}")
        elif not _fits(key, value):
            findings.add(file, None, f"{key} = {value!r}", _KEYS[key])
    table = {key: value for key, value in table.items() if key in _KEYS and _fits(key, value)}
    camera, robot = _camera(file, table, findings)
    rotation = np.eye(3) if robot is None else robot.robot_from_camera
    mask_file = directory / table["mask"] if "mask" in table else None
    if mask_file is None and robot is not None:
        mask_file = named_mask(directory / table["camera"])
    if "robot_from_camera" in table:
        try:
            rotation = rotation_from(table["robot_from_camera"], "robot_from_camera")
        except CalibrationError as error:
            what, _, expected = str(error).partition(", expected ")
            findings.add(file, None, what, expected or _KEYS["robot_from_camera"])
    files = [file, *([directory / table["camera"]] if "camera" in table else []), *filter(None, [mask_file])]
    return Description(
        camera=camera,
        robot_from_camera=rotation,
        mask=None if mask_file is None else _mask(mask_file, camera, findings),
        wheels=_wheels(file, table.get("wheels"), findings),
        source=table.get("source", {}),
        files=tuple(files),
    )


def _table(file: Path, findings: Findings) -> dict[str, Any] | None:
    try:
        return tomllib.loads(read_text(file, LARGEST_BYTES))
    except OSError as error:
        findings.add(file, None, error.strerror or str(error), f"a dataset: a folder with {DESCRIPTION}")
    except (ValueError, RecursionError) as error:
        findings.add(file, None, f"is not TOML ({error})", "a description of a dataset in TOML")
    return None


def _fits(key: str, value: object) -> bool:
    match key:
        case "camera" | "camera_format" | "mask":
            return isinstance(value, str)
        case "camera_name":
            return isinstance(value, str | int) and not isinstance(value, bool)
        case "image_size":
            return isinstance(value, list) and len(value) == 2 and all(type(side) is int for side in value)
        case "mirror":
            return isinstance(value, bool)
        case "wheels" | "source":
            return isinstance(value, dict)
        case _:
            return True


def _camera(file: Path, table: dict[str, Any], findings: Findings) -> tuple[Camera | None, Robot | None]:
    """The camera, and the robot where the calibration is a robot's file."""
    if "camera" not in table:
        findings.add(file, None, "no key camera", _KEYS["camera"])
        return None, None
    path = file.parent / table["camera"]
    size = table.get("image_size")
    try:
        camera = Camera.load(
            path,
            table.get("camera_format"),
            camera=table.get("camera_name", 0),
            image_size=None if size is None else (size[0], size[1]),
        )
        robot = Robot.load(path) if is_robot(path) else None
    except TiltvpError as error:
        what, _, expected = str(error).removeprefix(f"{path}: ").partition(", expected ")
        findings.add(file, None, f"camera {table['camera']!r}: {what}", expected or _KEYS["camera"])
        return None, None
    return camera.mirrored() if table.get("mirror", False) and not camera.mirror else camera, robot


def _mask(file: Path, camera: Camera | None, findings: Findings) -> NDArray[np.bool_] | None:
    expected = "an image of the camera's size, white where the world is seen and black where the robot is"
    try:
        mask = read_mask(file)
    except (ImageFileError, InvalidInputError) as error:
        findings.add(file, None, str(error).removeprefix(f"{file}: ").partition(", expected ")[0], expected)
        return None
    if camera is not None and mask.shape != (camera.height, camera.width):
        found = f"{mask.shape[1]} x {mask.shape[0]} pixels"
        findings.add(file, None, found, f"{camera.width} x {camera.height}, {expected}")
        return None
    return mask


def _wheels(file: Path, table: dict[str, Any] | None, findings: Findings) -> Wheels | None:
    if table is None:
        return None
    names = ("half_track_m", "caster_m")
    for key in table:
        if key not in names:
            findings.add(file, None, f"unknown key wheels.{key}{near(key, names)}", " and ".join(names))
    lengths = [_length(file, table, name, findings) for name in names]
    return Wheels(*lengths) if all(math.isfinite(length) for length in lengths) else None


def _length(file: Path, table: dict[str, Any], name: str, findings: Findings) -> float:
    """A positive number of metres; NaN, and a finding, for anything else."""
    value = table.get(name)
    if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value) and value > 0.0:
        return float(value)
    what = f"wheels.{name} = {value!r}" if name in table else f"no key wheels.{name}"
    findings.add(file, None, what, "a positive number of metres")
    return math.nan
