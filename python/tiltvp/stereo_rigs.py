"""`StereoRig`: a pair of calibrated cameras and how they sit to each other, from calibration files."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import NoReturn, Self

import numpy as np
from numpy.typing import NDArray

from tiltvp import _core
from tiltvp.arguments import refuse_unless
from tiltvp.cameras import Camera
from tiltvp.errors import InvalidInputError
from tiltvp.files import check_toml
from tiltvp.formats.stereo import StereoSpec, read_stereo, rigid_motion, write_stereo_toml

__all__ = ["StereoRig"]


@dataclass(frozen=True, eq=False)
class StereoRig:
    """Two cameras of any lens models.

    Raises `tiltvp.errors.InvalidInputError` for what is no camera, and for a `left_from_right` that is no rigid motion
    between two places; what is one to 1e-3, as in files, is taken as the nearest.
    """

    left: Camera
    right: Camera
    left_from_right: NDArray[np.float64]
    """(4, 4): the right camera's pose in the left one's frame, metres."""

    def __post_init__(self) -> None:
        refuse_unless(self.left, _core.Camera, "left", "a tiltvp.Camera")
        refuse_unless(self.right, _core.Camera, "right", "a tiltvp.Camera")
        object.__setattr__(self, "left_from_right", rigid_motion(self.left_from_right, _fail))

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, image_size: tuple[int, int] | None = None) -> Self:
        """From a camchain of Kalibr with two cameras, the left one first, or from our own TOML.

        Raises `tiltvp.errors.CalibrationError` that says what was wrong, what was expected and where.
        """
        spec = read_stereo(path, image_size)
        return cls(Camera.from_spec(spec.left), Camera.from_spec(spec.right), spec.left_from_right)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes our own TOML, whole or not at all. Raises `InvalidInputError` where `path` does not end in .toml."""
        check_toml(path)
        spec = StereoSpec(self.left.to_spec("left"), self.right.to_spec("right"), self.left_from_right)
        write_stereo_toml(spec, path)


def _fail(problem: str, expected: str) -> NoReturn:
    raise InvalidInputError(f"left_from_right: {problem}, expected {expected}")
