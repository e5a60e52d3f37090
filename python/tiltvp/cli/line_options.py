"""The options of `tiltvp lines` and `tiltvp track`: how lines are found, and what the robot's lean is taken for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from cyclopts import Group, Parameter, validators

from tiltvp._core import LINE_METHODS
from tiltvp.cli.declared_options import from_library
from tiltvp.cli.options import MountedOptions, check_word
from tiltvp.errors import InvalidInputError
from tiltvp.images import read_mask

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import Camera, TiltEstimate
    from tiltvp.lines import LineExtractor

_LINES = Group("Lines", help="An option that is not given has the default of its method.")
_UPRIGHT = "upright"
_LINE_METHOD = "--line-method"


@Parameter(name="*", group=_LINES)
@dataclass(frozen=True, kw_only=True)
@from_library({"LineExtractor": LINE_METHODS})
class LineOptions(MountedOptions):
    """How lines are found."""

    _METHOD: ClassVar[str] = "--method"
    method: str | None = None
    """great-circle (the default) or radial, the paper's."""
    tilt: str = _UPRIGHT
    """upright: the robot stands upright; or how the lean of each frame is estimated: refined or another method of
    `tiltvp tilt`. A frame whose lean is not known is left out."""
    tilt_confidence_min: Annotated[float, Parameter(validator=validators.Number(gte=0, lte=1))] = 0.5
    """A frame whose estimated lean is less confident, or leaves far less of its lines, is left out."""

    def extractor(self, camera: Camera, *, rotation: NDArray[np.float64] | None = None) -> LineExtractor:
        """The extractor with the options that were given, for their mounting or another."""
        from tiltvp.lines import LineExtractor

        check_word(self._METHOD, self.method or LINE_METHODS[0], LINE_METHODS)
        options = self.given() | ({} if self.method is None else {"method": self.method})
        return LineExtractor(
            camera, robot_from_camera=self.mounting(camera) if rotation is None else rotation, **options
        )

    def tilts(
        self, camera: Camera, *, rotation: NDArray[np.float64] | None = None
    ) -> Callable[[NDArray[np.uint8]], TiltEstimate | None]:
        """What tells the lean of a grey image: None with --tilt upright; raises `UnknownLeanError`."""
        from tiltvp import METHODS, TiltEstimator
        from tiltvp.line_logs import believed_leans
        from tiltvp.robot_setup import TILT_OPTIONS

        check_word("--tilt", self.tilt, (_UPRIGHT, *METHODS))
        if self.tilt == _UPRIGHT:
            if self.tilt_confidence_min != type(self).tilt_confidence_min:
                told = f"--tilt-confidence-min with --tilt {_UPRIGHT}, which estimates no lean"
                raise InvalidInputError(f"{told}, expected another method")
            return lambda _: None
        if self.method == LINE_METHODS[1] and self.tilt != type(self).tilt:
            raise InvalidInputError(f"--tilt {self.tilt} with the method radial, which knows no lean, expected upright")
        mounting = self.mounting(camera) if rotation is None else rotation
        own = TILT_OPTIONS if self.tilt == TILT_OPTIONS["method"] else {"method": self.tilt}
        options: dict[str, Any] = {**own, "robot_from_camera": mounting}
        if self.mask is not None:
            options["mask"] = read_mask(self.mask)
        estimator, extractor = TiltEstimator(camera, **options), self.extractor(camera, rotation=mounting)

        return believed_leans(estimator, extractor, confidence_min=self.tilt_confidence_min)


@Parameter(name="*", group=_LINES)
@dataclass(frozen=True, kw_only=True)
class DrivingLineOptions(LineOptions):
    """How lines are found on a robot whose lean matters."""

    _METHOD: ClassVar[str] = _LINE_METHOD
    method: Annotated[str | None, Parameter(name=_LINE_METHOD)] = None
    """How lines are found: great-circle (the default) or radial, the paper's."""
    tilt: str = "segments"
    """How the lean of each frame is estimated: segments or another method of `tiltvp tilt`, or upright: the robot
    stands upright. A frame whose lean is not known is left out."""
