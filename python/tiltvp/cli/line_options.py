"""The options of `tiltvp lines` and `tiltvp track`: how lines are found, and what the robot's lean is taken for."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter, validators

from tiltvp.cli.options import EdgeOptions, mask_from
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import Camera, TiltEstimate
    from tiltvp.lines import LineExtractor

_LINES = Group("Lines", help="An option that is not given has the default of its method.")
_AS_THEY_ARE = ("method", "margin_px", "gradient_min", "smoothing_px", "support_min_px", "lines_max", "sectors",
                "length_min", "rim_radius_px", "center_search_px")  # fmt: skip
_ANGLES = ("elevation_min", "elevation_max", "length_min", "separation", "tilt_sigma")
_UPRIGHT = "upright"


@Parameter(name="*", group=_LINES)
@dataclass(frozen=True, kw_only=True)
class LineOptions(EdgeOptions):
    """How lines are found."""

    method: str | None = None
    """great-circle (the default) or radial, the paper's."""
    tilt: str = _UPRIGHT
    """upright: the robot stands upright; or how the lean of each frame is estimated: refined or another method of
    `tiltvp tilt`. A frame without an estimate is taken to be upright."""
    tilt_confidence_min: Annotated[float, Parameter(validator=validators.Number(gte=0, lte=1))] = 0.5
    """A frame whose estimated lean is less confident, or leaves far less of its lines, is taken to be upright."""
    length_min_deg: float | None = None
    """great-circle: least elevation that a line covers."""
    separation_deg: float | None = None
    """great-circle: least angle between two lines of the same polarity."""
    support_min_px: int | None = None
    """great-circle: least number of a line's edge pixels."""
    lines_max: int | None = None
    """great-circle: the most lines of an image, the longest ones."""
    tilt_sigma_deg: float | None = None
    """great-circle: standard deviation of the lean that is known."""
    length_min: float | None = None
    """radial: least length of a line as a fraction of the outer radius minus the inner."""
    sectors: int | None = None
    """radial: number of sectors."""
    rim_radius_px: float | None = None
    """radial: radius of the mirror's rim; that of the camera's valid pixels by default."""
    center_search_px: float | None = None
    """radial: how far from the calibrated centre the rim's is looked for; 0 keeps the calibrated one."""

    def extractor(self, camera: Camera, *, yaw_rad: float = 0.0) -> LineExtractor:
        """The extractor with the options that were given, for a camera that is further turned by `yaw_rad`."""
        from tiltvp.lines import LINE_METHODS, LineExtractor

        _check("--method", self.method or LINE_METHODS[0], LINE_METHODS)
        options: dict[str, Any] = {name: getattr(self, name) for name in _AS_THEY_ARE}
        for name in _ANGLES:
            degrees = getattr(self, f"{name}_deg")
            options[f"{name}_rad"] = None if degrees is None else math.radians(degrees)
        options = {name: value for name, value in options.items() if value is not None}
        if self.mask is not None:
            options["mask"] = mask_from(self.mask)
        return LineExtractor(camera, robot_from_camera=self._rotation(yaw_rad), **options)

    def tilts(self, camera: Camera, *, yaw_rad: float = 0.0) -> Callable[[NDArray[np.uint8]], TiltEstimate | None]:
        """What tells the lean of a grey image: None where the robot is taken to be upright."""
        from tiltvp import METHODS, TiltEstimator

        _check("--tilt", self.tilt, (_UPRIGHT, *METHODS))
        if self.tilt == _UPRIGHT:
            return lambda _: None
        options: dict[str, Any] = {"method": self.tilt, "robot_from_camera": self._rotation(yaw_rad)}
        if self.mask is not None:
            options["mask"] = mask_from(self.mask)
        estimator, extractor = TiltEstimator(camera, **options), self.extractor(camera, yaw_rad=yaw_rad)

        def tilt(gray: NDArray[np.uint8]) -> TiltEstimate | None:
            estimate = estimator(gray)
            believed = extractor.believes(gray, estimate, confidence_min=self.tilt_confidence_min)
            return estimate if believed else None

        return tilt

    def _rotation(self, yaw_rad: float) -> NDArray[np.float64]:
        from tiltvp.rotations import about_vertical, read_rotation

        return about_vertical(yaw_rad) @ read_rotation(self.robot_from_camera or "up")


@Parameter(name="*", group=_LINES)
@dataclass(frozen=True, kw_only=True)
class DrivingLineOptions(LineOptions):
    """How lines are found on a robot whose lean matters."""

    tilt: str = "refined"
    """How the lean of each frame is estimated: refined or another method of `tiltvp tilt`, or upright: the robot
    stands upright. A frame without an estimate is taken to be upright."""


def _check(option: str, word: str, known: Sequence[str]) -> None:
    if word not in known:
        near = difflib.get_close_matches(word, known, 1, 0.3)
        meant = f" (did you mean {near[0]}?)" if near else ""
        raise InvalidInputError(f"{option} {word!r}{meant}, expected one of {', '.join(known)}")
