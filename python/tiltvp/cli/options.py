"""The options that commands share, and their way from words and degrees to what the library takes."""

# Annotations are evaluated: other files inherit these options, and there cyclopts would not find the names of types.

import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from tiltvp._core import METHODS
from tiltvp.cli.declared_options import LibraryOptions, from_library
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from tiltvp import Camera, TiltEstimator

_CAMERA = Group("Camera")
_METHOD = Group("Method", help="An option that is not given has the default of its method.")
Switch = Annotated[bool, Parameter(negative="", show_default=False)]


_PANORAMA = "equirectangular:"


def image_size_from(text: str | None, option: str = "--image-size") -> tuple[int, int] | None:
    """(width, height) from `640x480`."""
    if text is None:
        return None
    found = re.fullmatch(r"\s*(\d+)\s*[xX*,]\s*(\d+)\s*", text)
    if found is None:
        raise InvalidInputError(f"{option} {text!r}, expected WIDTHxHEIGHT in pixels, such as 640x480")
    return int(found[1]), int(found[2])


@Parameter(name="*", group=_CAMERA)
@dataclass(frozen=True, kw_only=True)
class CameraOptions:
    """Which camera took the images."""

    camera: Path
    """Calibration file, of any of the formats that `tiltvp camera formats` lists; or equirectangular:WIDTHxHEIGHT."""
    camera_format: str | None = None
    """Its format, where its content does not tell."""
    camera_name: str | None = None
    """Name or number of the camera in a file of several; the first is 0."""
    image_size: str | None = None
    """WIDTHxHEIGHT in pixels, for formats that do not carry it."""
    mirror: Switch = False
    """The image is seen in a mirror."""

    def load(self) -> "Camera":
        """The camera."""
        from tiltvp import Camera

        word = str(self.camera)
        if word.startswith(_PANORAMA):
            size = image_size_from(word.removeprefix(_PANORAMA), f"--camera {_PANORAMA}")
            assert size is not None  # There is a text.
            return Camera.equirectangular(width=size[0], height=size[1])
        name = self.camera_name or "0"
        camera = Camera.load(
            self.camera,
            self.camera_format,
            camera=int(name) if name.isdecimal() else name,
            image_size=image_size_from(self.image_size),
        )
        return camera.mirrored() if self.mirror and not camera.mirror else camera


@dataclass(frozen=True, kw_only=True)
class MountedOptions(LibraryOptions):
    """How the camera sits on the robot, and where the robot sees itself."""

    robot_from_camera: str | None = None
    """How the camera sits on the robot: up (the default, but for panoramas), forward, or a file with a rotation."""
    mask: Path | None = None
    """Image of the camera's size, white where the world is seen and black where the robot is."""


@Parameter(name="*", group=_METHOD)
@dataclass(frozen=True, kw_only=True)
@from_library({"TiltEstimator": METHODS})
class MethodOptions(MountedOptions):
    """How the tilt is estimated."""

    method: str | None = None
    """refined, image-space-ransac, image-space-reject-refit, vector-consensus or segments."""
    correction: str | None = None
    """closed-form, none or a number: the factor from shift (or raw angle) to angle."""

    def estimator(self, camera: "Camera", **otherwise: Any) -> "TiltEstimator":
        """The estimator with the options that were given, and others where they were not."""
        from tiltvp import TiltEstimator
        from tiltvp.rotations import read_rotation

        options = otherwise | self.given()
        mounting = self.robot_from_camera or ("forward" if camera.model == "equirectangular" else None)
        if mounting is not None:
            options["robot_from_camera"] = read_rotation(mounting)
        if self.method is not None:
            check_word("--method", self.method, METHODS)
            options["method"] = self.method
        return TiltEstimator(camera, **options)


def check_word(option: str, word: str, known: Sequence[str]) -> None:
    """Refuses a word that is not known, and names the near ones."""
    if word not in known:
        near = difflib.get_close_matches(word, known, 1, 0.3)
        meant = f" (did you mean {near[0]}?)" if near else ""
        raise InvalidInputError(f"{option} {word!r}{meant}, expected one of {', '.join(known)}")
