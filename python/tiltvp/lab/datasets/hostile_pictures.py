"""Drives with pictures that mislead: rendered once, and told wrongly, disturbed or cut in many ways."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.cameras import Camera
from tiltvp.lab.datasets.hostile_drives import TOO_SHORT, UNDISTURBED, harmed_odometry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp import _core

    Image = NDArray[np.uint8]
    Table = NDArray[np.float64]

__all__ = ["PICTURE_CASES", "PictureCase", "PictureDrive", "told_drive"]


@dataclass(frozen=True)
class PictureDrive:
    """The images of a drive and what is told of them, and the mounting that is to be found."""

    images: Sequence[Image]
    """Grey, (H, W)."""
    odometry: Table
    """(N, 2): displacements of the left and the right wheel since the frame before, metres."""
    camera: _core.Camera
    wheel_base_m: float
    mounting: Table
    """True x and y in metres and yaw in radians, at the end."""
    factors: dict[str, float] = field(default_factory=dict)
    """By how much options of `tiltvp.calibrate` are told too large."""


@dataclass(frozen=True)
class PictureCase:
    """How a drive is told wrongly, or which other drive is rendered for it."""

    odometry: str = UNDISTURBED
    """The case of `DRIVE_CASES` that harms it."""
    base: float = 1.0
    """By how much the wheel base is told too large."""
    factors: dict[str, float] = field(default_factory=dict)
    """As of a `PictureDrive`."""
    harm: Callable[[PictureDrive, np.random.Generator], PictureDrive] = lambda drive, _: drive
    legs: tuple[tuple[float, float], ...] | None = None
    """Arcs, metres and radians, that are driven instead."""
    is_bumped: bool = False
    """Half-way the camera turns by four degrees."""


def _mirrored(drive: PictureDrive, _: np.random.Generator) -> PictureDrive:
    return replace(drive, images=[np.ascontiguousarray(image[:, ::-1]) for image in drive.images])


def _late(drive: PictureDrive, _: np.random.Generator) -> PictureDrive:
    """Each image comes with the motion of the next: a fifth of a second at five a second."""
    return replace(drive, images=[drive.images[0], *drive.images[:-1]])


def _cut(drive: PictureDrive, _: np.random.Generator) -> PictureDrive:
    return replace(drive, images=drive.images[:TOO_SHORT])


def _lens(*, focal: float = 1.0, off_px: float = 0.0) -> PictureCase:
    """A focal length is told too large, or a centre that is so far off."""

    def harm(drive: PictureDrive, rng: np.random.Generator) -> PictureDrive:
        way, values = rng.uniform(-math.pi, math.pi), drive.camera.to_dict()
        scaled = {name: focal * values[name] for name in ("fx", "fy")}
        moved = {"cx": values["cx"] + off_px * math.cos(way), "cy": values["cy"] + off_px * math.sin(way)}
        return replace(drive, camera=Camera.from_dict(values | scaled | moved))

    return PictureCase(harm=harm)


PICTURE_CASES: Final = {
    UNDISTURBED: PictureCase(),
    **{name: PictureCase(name) for name in (
        "wheels swapped", "both wheels negated", "left wheel negated", "right wheel negated", "lengths in millimetres",
        "cumulative", "wheels slip", "carpet",
    )},
    "images mirrored": PictureCase(harm=_mirrored),
    **{f"wheel base {share:+.0f} %": PictureCase(base=1.0 + 0.01 * share) for share in (10, -10, 30, -30)},
    "sigma told 5 times too small": PictureCase(factors={"bearing_sigma_rad": 0.2}),
    "sigma told 5 times too large": PictureCase(factors={"bearing_sigma_rad": 5.0}),
    "K told 5 times too small": PictureCase(factors={"odometry_k_m": 0.2}),
    "K told 5 times too large": PictureCase(factors={"odometry_k_m": 5.0}),
    "images 0.2 s late": PictureCase(harm=_late),
    "camera bumped": PictureCase(is_bumped=True),
    "image centre off by 1 px": _lens(off_px=1.0),
    "image centre off by 2 px": _lens(off_px=2.0),
    "focal length +10 %": _lens(focal=1.1),
    "straight on only": PictureCase(legs=((2.3, 0.0),)),
    "rotation only": PictureCase(legs=((0.0, math.tau),)),
    "too short": PictureCase(harm=_cut),
}  # fmt: skip
"""Each case by its name."""


def told_drive(drive: PictureDrive, case: str, seed: int) -> PictureDrive:
    """A drive as a case tells it; images and odometry are as long as each other."""
    made, rng = PICTURE_CASES[case], np.random.default_rng((seed, 17))
    told = made.harm(replace(drive, odometry=harmed_odometry(made.odometry, drive.odometry, rng)), rng)
    count = len(told.images)
    return replace(
        told, odometry=told.odometry[:count], wheel_base_m=made.base * drive.wheel_base_m, factors=made.factors
    )
