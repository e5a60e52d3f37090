"""What is known of a robot with a camera, in one file: calibration, mounting, mask, wheels, topics."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from tiltvp.arguments import array_from, number_from, pair_from, path_from, refuse_unless
from tiltvp.cameras import Camera
from tiltvp.errors import CalibrationError, InvalidInputError
from tiltvp.files import check_output, check_toml, write_whole
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.own import ROBOT_FORMAT, VERSION, camera_from, camera_table, root_of
from tiltvp.images import checked_camera, checked_mask, read_mask, write_image
from tiltvp.rotations import mounting_from
from tiltvp.streams.wheels import Wheels

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp.tilt import TiltEstimator

__all__ = ["TOPICS", "Robot", "is_robot", "mask_path", "named_mask"]

TOPICS: Final = ("images", "odometry", "joints", "inertial")
"""What a recording may have topics of."""
_WHEELS: Final = ("wheel_base_m", "wheel_radius_m", "ticks_per_turn")
_MARK: Final = re.compile(rf"^[^\S\n]*format[^\S\n]*=[^\S\n]*[\"']{ROBOT_FORMAT}[\"']", re.MULTILINE)


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot with a camera. `Robot.load("robot.toml")`; `tiltvp setup` writes such a file.

    Every command takes the file as its `--camera`, and with it the mounting and the mask.
    """

    camera: Camera
    robot_from_camera: NDArray[np.float64]
    """(3, 3): rotation R of v_robot = R v_camera."""
    covariance_rad2: NDArray[np.float64] | None = None
    """(2, 2): of the errors of the mounting about the robot's x and y axes; None where it was not measured. Where
    `covariance` is given it is that one's."""
    mask: NDArray[np.bool_] | None = None
    """(H, W): True where images show the world; None: everywhere."""
    wheels: Wheels = field(default_factory=Wheels)
    topics: dict[str, str] = field(default_factory=dict)
    """Topics of its recordings, by what they are of: images, odometry, joints, inertial."""
    place_m: tuple[float, float] | None = None
    """x and y of the camera in the robot's frame; None where they are not known."""
    height_m: float | None = None
    """Its z there, likewise."""
    covariance: NDArray[np.float64] | None = None
    """(5, 5): of the errors of x, y and the mounting about the robot's x, y and z axes (see `tiltvp.Extrinsics`)."""

    def __post_init__(self) -> None:
        checked_camera(self.camera)
        refuse_unless(self.wheels, Wheels, "wheels", "tiltvp.streams.Wheels")
        refuse_unless(self.topics, dict, "topics", "a dict")
        object.__setattr__(self, "robot_from_camera", mounting_from(self.robot_from_camera))
        if self.mask is not None:
            object.__setattr__(self, "mask", checked_mask(self.mask, self.camera))
        if self.covariance is not None:
            if self.place_m is None:
                raise InvalidInputError("covariance: without place_m, expected both")
            object.__setattr__(self, "covariance", _covariance("covariance", self.covariance, 5))
            object.__setattr__(self, "covariance_rad2", np.asarray(self.covariance)[2:4, 2:4])
        elif self.covariance_rad2 is not None:
            object.__setattr__(self, "covariance_rad2", _covariance("covariance_rad2", self.covariance_rad2, 2))
        # Numbers of any kind, as NumPy's, are those that a file takes.
        if self.place_m is not None:
            object.__setattr__(self, "place_m", pair_from(self.place_m, "place_m"))
        if self.height_m is not None:
            object.__setattr__(self, "height_m", number_from(self.height_m, "height_m"))
        if not np.isfinite([*(self.place_m or ()), self.height_m or 0.0]).all():
            raise InvalidInputError(f"place_m, height_m: {self.place_m}, {self.height_m}, expected finite metres")
        for name, topic in self.topics.items():
            if name not in TOPICS or not isinstance(topic, str):
                raise InvalidInputError(f"topics: {name!r}: {topic!r}, expected names of {', '.join(TOPICS)}")

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """The robot of a file. Raises `CalibrationError` that says what was wrong, what was expected and where."""
        document = Document.load(path)
        root = root_of(document)
        if root.need("format").text() != ROBOT_FORMAT:
            root.need("format").fail(f"found {root.need('format').text()!r}", f"{ROBOT_FORMAT}, a robot's file")
        cameras = root.need("camera").items()
        if len(cameras) != 1:
            root.fail(f"{len(cameras)} cameras", "one [[camera]]")
        mounting = root.need("mounting")
        mounting.only("robot_from_camera", "covariance_rad2", "place_m", "height_m", "covariance")
        place, height = mounting.get("place_m"), mounting.get("height_m")
        lean, covariance = mounting.get("covariance_rad2"), mounting.get("covariance")
        try:
            return cls(
                camera=Camera.from_spec(camera_from(cameras[0], None)),
                robot_from_camera=np.reshape(mounting.need("robot_from_camera").numbers(9), (3, 3)),
                covariance_rad2=None if lean is None else np.reshape(lean.numbers(4), (2, 2)),
                mask=_mask_of(named_mask(path)),
                wheels=_wheels_of(root.get("wheels")),
                topics=_topics_of(root.get("topics")),
                place_m=None if place is None else _two(place),
                height_m=None if height is None else height.number(),
                covariance=None if covariance is None else np.reshape(covariance.numbers(25), (5, 5)),
            )
        except CalibrationError:
            raise
        except InvalidInputError as error:
            raise CalibrationError(f"{path}: {error}") from error

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the file (.toml), and the mask as an image beside it; nothing half-written is left.

        Raises `InvalidInputError` for another ending, and `OutputError`.
        """
        import tomli_w

        file = path_from(path)
        check_toml(file)
        check_output(file)
        tree: dict[str, Any] = {"format": ROBOT_FORMAT, "version": VERSION}
        if self.mask is not None:
            picture = mask_path(file)
            write_image(picture, np.where(self.mask, 255, 0).astype(np.uint8))
            tree["mask"] = picture.name
        mounting: dict[str, Any] = {"robot_from_camera": self.robot_from_camera.tolist()}
        if self.place_m is not None:
            mounting["place_m"] = list(self.place_m)
        if self.height_m is not None:
            mounting["height_m"] = self.height_m
        if self.covariance is not None:
            mounting["covariance"] = self.covariance.tolist()
        elif self.covariance_rad2 is not None:
            mounting["covariance_rad2"] = self.covariance_rad2.tolist()
        tree["mounting"] = mounting
        known = {name: getattr(self.wheels, name) for name in (*_WHEELS, "joints")}
        known = {name: value for name, value in known.items() if value is not None}
        tree |= {name: table for name, table in (("wheels", known), ("topics", dict(self.topics))) if table}
        tree["camera"] = [camera_table(self.camera.to_spec())]
        write_whole(file, tomli_w.dumps(tree))

    def estimator(self, **options: Any) -> TiltEstimator:
        """An estimator of this robot's tilt, with the options of `TiltEstimator`."""
        from tiltvp.tilt import TiltEstimator

        own = {"robot_from_camera": self.robot_from_camera, "mask": self.mask}
        return TiltEstimator(self.camera, **(own | options))


def is_robot(path: str | os.PathLike[str]) -> bool:
    """Whether it is a robot's file, and no other calibration; whoever reads it says what is wrong with it."""
    try:
        text = Document.load(path).text
    except CalibrationError:
        return False
    return _MARK.search(text) is not None


def mask_path(path: Path) -> Path:
    """The image that `Robot.save` writes beside a robot's file for its mask."""
    return path.with_name(f"{path.stem}-mask.png")


def named_mask(path: str | os.PathLike[str]) -> Path | None:
    """The image that a robot's file, whatever it is called by now, names as its mask; None where it names none."""
    node = root_of(Document.load(path)).get("mask")
    if node is None:
        return None
    name = node.text()
    if Path(name).name != name:
        node.fail(f"found {name!r}", "the name of an image beside this file")
    return Path(path).with_name(name)


def _mask_of(image: Path | None) -> NDArray[np.bool_] | None:
    return None if image is None else read_mask(image)


def _wheels_of(node: Node | None) -> Wheels:
    if node is None:
        return Wheels()
    node.only(*_WHEELS, "joints")
    known: dict[str, Any] = {key: node.need(key).number() for key in _WHEELS if node.has(key)}
    if (joints := node.get("joints")) is not None:
        names = [joint.text() for joint in joints.items()]
        if len(names) != 2:
            joints.fail(f"{len(names)} names", "those of the left and the right wheel")
        known["joints"] = (names[0], names[1])
    return Wheels(**known)


def _topics_of(node: Node | None) -> dict[str, str]:
    if node is None:
        return {}
    node.only(*TOPICS)
    return {key: node.need(key).text() for key in node.tree}


def _two(node: Node) -> tuple[float, float]:
    first, second = node.numbers(2)
    return first, second


def _covariance(name: str, values: ArrayLike, size: int) -> NDArray[np.float64]:
    covariance = array_from(values, name)
    fits = covariance.shape == (size, size) and bool(np.isfinite(covariance).all())
    # One that is nearly singular may by rounding have a value just below zero.
    if fits:
        values = np.linalg.eigvalsh(0.5 * (covariance + covariance.T))
        fits = bool(values[0] >= -1e-9 * values[-1] and values[-1] >= 0.0)
    if not fits:
        raise InvalidInputError(f"{name}: {covariance.tolist()}, expected a covariance ({size}, {size})")
    return covariance
