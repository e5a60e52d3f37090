"""Where one frame of a robot is in another, for ROS: a command, URDF, YAML, and /tf_static in an MCAP file."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.arguments import each_from, number_from, path_from, shaped_from, two_from
from tiltvp.errors import InvalidInputError
from tiltvp.files import check_output, write_whole
from tiltvp.rotations import quaternion, rotation_from
from tiltvp.streams.outputs import messages
from tiltvp.streams.outputs.mcap import check_recording, new_recording

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Matrix = NDArray[np.float64]

__all__ = [
    "COVARIANCE_AXES",
    "TRANSFORM_ENDINGS",
    "TRANSFORM_TOPIC",
    "StaticTransform",
    "check_frames",
    "check_transform",
]

TRANSFORM_TOPIC: Final = "/tiltvp/static_transform"
"""Of a recording that `StaticTransform.write` writes: what its `yaml` is on."""
TRANSFORM_ENDINGS: Final = (".mcap", ".urdf", ".kalibr.yaml", ".yaml")
"""Of the files that `StaticTransform.write` writes."""
COVARIANCE_AXES: Final = ("x", "y", "roll", "pitch", "yaw")
"""Of `StaticTransform.covariance`; roll, pitch and yaw are turns about the parent's x, y and z axes."""
_AXES: Final = ("x", "y", "z", "roll", "pitch", "yaw")


@dataclass(frozen=True, eq=False)
class StaticTransform:
    """Where the frame `child` is in the frame `parent`; what of it is not known is 0 and named."""

    parent: str
    child: str
    translation_m: Matrix
    """(3,): the child's origin in the parent."""
    rotation: Matrix
    """(3, 3): from the child to the parent."""
    missing: tuple[str, ...] = ()
    """What is not known, of x, y, z, roll, pitch and yaw."""
    sigmas: tuple[tuple[str, float], ...] = ()
    """Standard deviations of what was estimated, by the names of `COVARIANCE_AXES`; metres and radians."""
    covariance: Matrix | None = None
    """(5, 5): of the errors along and about the parent's axes, in the order of `COVARIANCE_AXES`."""

    def __post_init__(self) -> None:
        """Raises `InvalidInputError` as `check_frames` does, and for no place, `CalibrationError` for no rotation."""
        check_frames(self.parent, self.child)
        if np.shape(self.translation_m) != (3,) or not np.isfinite(self.translation_m).all():
            raise InvalidInputError(f"mounting: {self.translation_m}, expected three finite numbers")
        rotation_from(np.asarray(self.rotation).tolist(), "mounting")
        if not isinstance(self.missing, tuple) or not set(self.missing) <= {*_AXES}:
            raise InvalidInputError(f"missing = {self.missing!r}, expected a tuple of {', '.join(_AXES)}")
        for sigma in each_from(self.sigmas, "sigmas", "index", "pair of an axis and a number"):
            axis, value = two_from(sigma, "sigmas", "pairs of an axis and a number")
            number_from(value, f"sigmas: {axis}")
        if self.covariance is not None:
            shaped_from(self.covariance, "covariance", 5, 5)

    @property
    def roll_pitch_yaw_rad(self) -> tuple[float, float, float]:
        """As URDF and ROS have them: the rotation is Rz(yaw) Ry(pitch) Rx(roll)."""
        r = self.rotation
        level = float(np.hypot(r[0, 0], r[1, 0]))
        pitch = float(np.arctan2(-r[2, 0], level))
        if level < 1e-9:  # Roll and yaw turn about one axis: all is put into the yaw.
            return 0.0, pitch, float(np.arctan2(-r[0, 1], r[1, 1]))
        return float(np.arctan2(r[2, 1], r[2, 2])), pitch, float(np.arctan2(r[1, 0], r[0, 0]))

    @property
    def note(self) -> str:
        """What is not known, in a sentence; empty where all is."""
        return f"not known, and set to 0: {', '.join(self.missing)}" if self.missing else ""

    def ros_command(self) -> str:
        """The command that publishes it in ROS 2."""
        values = (*self.translation_m, *self.roll_pitch_yaw_rad)
        words = " ".join(f"--{name} {_number(value)}" for name, value in zip(_AXES, values, strict=True))
        return (
            f"ros2 run tf2_ros static_transform_publisher {words} "
            f"--frame-id {self.parent} --child-frame-id {self.child}"
        )

    def urdf_joint(self) -> str:
        """The child's link and the fixed joint that holds it, for the `robot` element of a URDF."""
        xyz, rpy = (" ".join(map(_number, values)) for values in (self.translation_m, self.roll_pitch_yaw_rad))
        return "\n".join([
            *([f"<!-- {self.note} -->"] if self.missing else []),
            f'<link name="{self.child}"/>',
            f'<joint name="{self.parent}_{self.child}" type="fixed">',
            f'  <parent link="{self.parent}"/>',
            f'  <child link="{self.child}"/>',
            f'  <origin xyz="{xyz}" rpy="{rpy}"/>',
            "</joint>",
        ])  # fmt: skip

    def yaml(self) -> str:
        """All of it, as YAML: metres and radians."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.rotation, self.translation_m
        values = dict(zip(_AXES, (*self.translation_m, *self.roll_pitch_yaw_rad), strict=True))
        turn = dict(zip("xyzw", quaternion(self.rotation), strict=True))
        return "\n".join([
            *([f"# {self.note}"] if self.missing else []),
            f"parent_frame: {self.parent}",
            f"child_frame: {self.child}",
            f"translation_m: {_flow({name: values[name] for name in _AXES[:3]})}",
            f"rotation_rad: {_flow({name: values[name] for name in _AXES[3:]})}",
            f"quaternion: {_flow(turn)}",
            "parent_from_child:",
            *(f"  - [{', '.join(map(_number, row))}]" for row in matrix),
            f"sigma: {_flow(dict(self.sigmas))}",
            *self._covariance_lines(),
            f"not_known: [{', '.join(self.missing)}]",
        ])  # fmt: skip

    def _covariance_lines(self) -> list[str]:
        if self.covariance is None:
            return []
        rows = [f"  - [{', '.join(f'{value:.6e}' for value in row)}]" for row in self.covariance]
        return [f"covariance_axes: [{', '.join(COVARIANCE_AXES)}]", "covariance:", *rows]

    def kalibr(self) -> str:
        """As a camera chain of Kalibr has it: the parent is in the place of the inertial sensor."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.rotation.T, -self.rotation.T @ self.translation_m
        return "\n".join([
            *([f"# {self.note}"] if self.missing else []),
            f"# {self.parent} is in the place of the imu, {self.child} is the camera",
            "cam0:",
            "  T_cam_imu:",
            *(f"    - [{', '.join(f'{value:.9f}' if value else '0.0' for value in row)}]" for row in matrix),
        ])  # fmt: skip

    def write(self, path: str | os.PathLike[str]) -> None:
        """As a file, whole or not at all: the ending says which.

        .urdf is `urdf_joint` in a `robot` of its own, for xacro to include; .kalibr.yaml is `kalibr`, other .yaml is
        `yaml`, .mcap has the transform on /tf_static, with the stamp 0, and `yaml` as text on /tiltvp/static_transform.
        Raises as `check_transform` does.
        """
        check_transform(path)
        match path_from(path).suffix.lower():
            case ".urdf":
                write_whole(path, f'<robot name="{self.child}">\n{self.urdf_joint()}\n</robot>\n')
            case ".yaml":
                text = self.kalibr() if str(path).lower().endswith(".kalibr.yaml") else self.yaml()
                write_whole(path, text + "\n")
            case _:
                one = messages.transform(0, self.parent, self.child, self.translation_m, self.rotation)
                with new_recording(path) as recording:
                    recording.write("/tf_static", 0, messages.transforms([one]), latched=True)
                    recording.write(TRANSFORM_TOPIC, 0, messages.text(self.yaml()), latched=True)


def check_frames(parent: str, child: str) -> None:
    """Raises `InvalidInputError` for names that no frame can have, and for one name of both."""
    for what, name in (("parent", parent), ("child", child)):
        if not isinstance(name, str) or re.fullmatch(r"[A-Za-z0-9_/]+", name) is None:
            raise InvalidInputError(f"{what} = {name!r}, expected the name of a frame: letters, digits, _ and /")
    if parent == child:
        raise InvalidInputError(f"child = {child!r}, expected another name than that of the parent")


def check_transform(path: str | os.PathLike[str]) -> None:
    """Refuses what no transform can be written to, before any work is done.

    Raises `InvalidInputError` for another ending than those of `TRANSFORM_ENDINGS`, `MissingExtraError` for .mcap
    without the packages of the extra `bags`, and as `check_output` does.
    """
    ending = path_from(path).suffix.lower()
    if ending not in TRANSFORM_ENDINGS:
        raise InvalidInputError(f"{path}: ends in {ending!r}, expected one of {', '.join(TRANSFORM_ENDINGS)}")
    if ending == ".mcap":
        check_recording(path)
    else:
        check_output(path)


def _number(value: float) -> str:
    """To a micrometre or a microradian; what is nothing at all is 0."""
    return f"{value:.6f}" if value else "0"


def _flow(values: dict[str, float]) -> str:
    return "{" + ", ".join(f"{name}: {_number(value)}" for name, value in values.items()) + "}"
