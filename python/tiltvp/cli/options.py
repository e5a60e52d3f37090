"""The options that commands share, and their way from words and degrees to what the library takes."""

# Annotations are evaluated: other files inherit these options, and there cyclopts would not find the names of types.

import difflib
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self, TypeVar

from cyclopts import Group, Parameter, validators

from tiltvp._core import METHODS
from tiltvp.arguments import THREADS_MAX
from tiltvp.cli.declared_options import LibraryOptions, Whole, from_library
from tiltvp.errors import InvalidInputError
from tiltvp.images import read_mask

if TYPE_CHECKING:
    import numpy as np
    from _typeshed import DataclassInstance
    from numpy.typing import NDArray

    from tiltvp import Camera, Robot, TiltEstimator

_CAMERA = Group("Camera")
_METHOD = Group("Method", help="An option that is not given has the default of its method.")
M = TypeVar("M", bound=LibraryOptions)
Switch = Annotated[bool, Parameter(negative="", show_default=False)]
FrameRate = Annotated[float | None, Parameter(validator=validators.Number(gte=0.01, lte=1000))]
"""From time-lapses to fast cameras: OpenCV writes no video of 0.001 frames a second, nor of 100,000."""
ABOVE_0 = Parameter(validator=validators.Number(gt=0))


def at_least(least: int) -> Parameter:
    """A number of things: up to a million, of which a list is some hundred megabytes, and making them takes days."""
    return Parameter(validator=validators.Number(gte=least, lte=1_000_000))


AtLeast0 = Annotated[Whole, at_least(0)]
AtLeast1 = Annotated[Whole, at_least(1)]
Seed = Annotated[Whole, Parameter(validator=validators.Number(gte=0, lte=2**64 - 1))]
ALL_CORES = os.cpu_count() or 1
ThreadCount = Annotated[Whole, Parameter(validator=validators.Number(gte=1, lte=THREADS_MAX))]
Threads = Annotated[ThreadCount, Parameter(help="How many at the same time; all cores by default.", show_default=False)]


_PANORAMA = "equirectangular:"


def image_size_from(text: str | None, option: str = "--image-size") -> tuple[int, int] | None:
    """(width, height) from `640x480`."""
    if text is None:
        return None
    found = re.fullmatch(r"\s*(0*[1-9]\d*)\s*[xX*,]\s*(0*[1-9]\d*)\s*", text)
    if found is None:
        raise InvalidInputError(f"{option} {text!r}, expected WIDTHxHEIGHT in pixels, such as 640x480")
    return int(found[1]), int(found[2])


@Parameter(name="*", group=_CAMERA)
@dataclass(frozen=True, kw_only=True)
class CameraOptions:
    """Which camera took the images."""

    camera: Path
    """Calibration file, of any of the formats that `tiltvp camera formats` lists, a robot's file (`tiltvp setup`), a
    recording of ROS with CameraInfo, or equirectangular:WIDTHxHEIGHT."""
    camera_format: str | None = None
    """Its format, where its content does not tell."""
    camera_name: str | None = None
    """Name or number of the camera in a file of several; the first is 0. Of a recording the topic."""
    image_size: str | None = None
    """WIDTHxHEIGHT in pixels, for formats that do not carry it."""
    mirror: Switch = False
    """The image is seen in a mirror."""

    def load(self, topic: str | None = None) -> "Camera":
        """The camera, of a recording that of its images of `topic`, by default of its only images."""
        from tiltvp import Camera
        from tiltvp.streams import Recording, is_recording, recorded_camera

        if is_recording(self.camera):
            refuse_beside(self, ("camera_format", "image_size"), f"{self.camera}, a recording")
            return self._mirrored(recorded_camera(Recording(self.camera), self.camera_name, images=topic))
        word = str(self.camera)
        if word.startswith(_PANORAMA):
            refuse_beside(self, ("camera_format", "camera_name", "image_size", "mirror"), word)
            whole = image_size_from(word.removeprefix(_PANORAMA), f"--camera {_PANORAMA}")
            assert whole is not None  # There is a text.
            return Camera.equirectangular(width=whole[0], height=whole[1])
        size = image_size_from(self.image_size)
        camera = Camera.load(self.camera, self.camera_format, camera=self.camera_name or 0, image_size=size)
        return self._mirrored(camera)

    def _mirrored(self, camera: "Camera") -> "Camera":
        return camera.mirrored() if self.mirror and not camera.mirror else camera

    def robot(self) -> "Robot | None":
        """What a robot's file (`tiltvp setup`) knows; None for other calibrations."""
        from tiltvp.robot import Robot, is_robot

        return Robot.load(self.camera) if is_robot(self.camera) else None

    def complete(self, options: "M") -> "M":
        """Options with the mounting and the mask of a robot's file (`tiltvp setup`) where these are not given."""
        from tiltvp.robot import named_mask

        if self.robot() is None:
            return options
        known: dict[str, Any] = {"robot_from_camera": str(self.camera)}
        if (mask := named_mask(self.camera)) is not None:
            known["mask"] = mask
        missing = {name: value for name, value in known.items() if getattr(options, name, options) is None}
        return replace(options, **missing)  # type: ignore[type-var]


@Parameter(name="*", group=_METHOD)
@dataclass(frozen=True, kw_only=True)
class MountedOptions(LibraryOptions):
    """How the camera sits on the robot, and where the robot sees itself."""

    robot_from_camera: str | None = None
    """How the camera sits on the robot: up (the default, but for panoramas), forward, a file with a rotation, or a
    recording of ROS whose /tf_static joins base_link to the frame of its images, of --topic or of the only topic."""
    mask: Path | None = None
    """Image of the camera's size, white where the world is seen and black where the robot is."""
    topic: Annotated[str | None, Parameter(parse=False)] = None
    """The topic of the images, where that is chosen: a recording's mounting is of their frame."""

    def of_topic(self, topic: str | None) -> Self:
        """The same for images of a topic."""
        return replace(self, topic=topic)

    def mounting(self, camera: "Camera") -> "NDArray[np.float64]":
        """(3, 3): the mounting that was given, or that of a camera that looks up, of a panorama's that looks ahead."""
        default = "forward" if camera.model == "equirectangular" else "up"
        return rotation_of(self.robot_from_camera or default, self.topic)

    def mounted(self, camera: "Camera", **options: Any) -> "TiltEstimator":
        """An estimator of that mask and mounting, or of the one in these options where none was given."""
        from tiltvp import TiltEstimator

        if self.robot_from_camera is not None or "robot_from_camera" not in options:
            options["robot_from_camera"] = self.mounting(camera)
        if self.mask is not None and "mask" not in options:
            options["mask"] = read_mask(self.mask)
        return TiltEstimator(camera, **options)


@Parameter(name="*", group=_METHOD)
@dataclass(frozen=True, kw_only=True)
@from_library({"TiltEstimator": METHODS})
class MethodOptions(MountedOptions):
    """How the tilt is estimated."""

    method: str | None = None
    """refined, image-space-ransac, image-space-reject-refit, vector-consensus or segments."""
    correction: str | None = None
    """closed-form, none or a number, the factor from shift (or raw angle) to angle; or a file of `tiltvp lab train`,
    which brings its method, options and mounting."""

    def estimator(self, camera: "Camera", **otherwise: Any) -> "TiltEstimator":
        """The estimator with the options that were given, and others where they were not."""
        options = otherwise | self.given()
        if self.correction is not None and Path(self.correction).suffix.lower() == ".toml":
            from tiltvp.corrections import TrainedCorrection

            trained = TrainedCorrection.load(self.correction)
            options = {name: value for name, value in options.items() if name not in ("method", "correction")}
            if self.robot_from_camera is not None:
                options["robot_from_camera"] = self.mounting(camera)
            try:
                options = trained.estimator_options(camera, options, self.method)
            except InvalidInputError as error:
                raise InvalidInputError(f"--correction {self.correction}: {error}") from error
            return self.mounted(camera, **options)
        if self.method is not None:
            check_word("--method", self.method, METHODS)
            options["method"] = self.method
        return self.mounted(camera, **options)


def rotation_of(source: str, topic: str | None = None, *, option: str = "--robot-from-camera") -> "NDArray[np.float64]":
    """The (3, 3) rotation of a word, a file or a recording, of that of the frame of `topic` where it has it."""
    from tiltvp.rotations import read_rotation
    from tiltvp.streams import Recording, is_recording, robot_from_camera

    if not is_recording(source):
        try:
            return read_rotation(source)
        except InvalidInputError as error:  # Of a word that is not known.
            raise InvalidInputError(f"{option} {error}") from error
    recording = Recording(source)
    return robot_from_camera(recording, topic=topic if topic in [one.name for one in recording.topics] else None)


def given_words(options: "DataclassInstance") -> list[str]:
    """The words of those options that are not as they are by default."""
    given = [field.name for field in fields(options) if getattr(options, field.name) != field.default]
    return [f"--{name.replace('_', '-')}" for name in given]


def refuse_beside(options: object, names: Sequence[str], what: str) -> None:
    """Refuses those of some options that were given beside what knows nothing of them."""
    for name in names:
        if getattr(options, name):
            raise InvalidInputError(f"--{name.replace('_', '-')} beside {what}, expected one of them")


def check_word(option: str, word: str, known: Sequence[str]) -> None:
    """Refuses a word that is not known, and names the near ones."""
    if word not in known:
        near = difflib.get_close_matches(word, known, 1, 0.3)
        meant = f" (did you mean {near[0]}?)" if near else ""
        raise InvalidInputError(f"{option} {word!r}{meant}, expected one of {', '.join(known)}")
