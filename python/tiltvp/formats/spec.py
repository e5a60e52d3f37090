"""What every calibration file is turned into: the name of a camera model and its numbers.

Pixel centres are at integers, (0, 0) being the centre of the top left pixel; the camera looks along +z with x to the
right and y down. Parameter names per model are those of `MODELS`.

`ocam`: with (x, y) the affinely corrected offset along rows and columns and rho its length, row = c x + d y + cy,
column = e x + y + cx, and the bearing is (y, x, -f(rho)), f being `polynomial`, lowest power first, in OCamCalib's
sign.
`inverse_polynomial` gives rho from atan(f(rho) / rho), lowest power first. `unified`: `skew` is the entry (0, 1) of the
camera matrix, in pixels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

Parameters = dict[str, "float | list[float]"]
ImageSize = tuple[int, int]


@dataclass(frozen=True)
class CameraSpec:
    """One camera of a calibration file: `model` names the lens model, `parameters` its numbers.

    `mirror` says that the image is seen in a mirror. `max_theta_rad` limits the angle from the optical axis, if known.
    `format` and `notes` say where the numbers come from and do not take part in comparisons.
    """

    model: str
    width: int
    height: int
    parameters: Parameters
    mirror: bool = False
    name: str = "cam0"
    format: str = field(default="", compare=False)
    max_theta_rad: float | None = None
    notes: tuple[str, ...] = field(default=(), compare=False)


@dataclass(frozen=True)
class ModelParameters:
    """The parameter names of one camera model; those in `lists` hold several numbers, lowest power first."""

    required: tuple[str, ...]
    optional: tuple[str, ...] = ()
    lists: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """All the names, the required ones first."""
        return self.required + self.optional


_AFFINE_K: Final = ("fx", "fy", "cx", "cy")
_RADTAN: Final = ("k1", "k2", "p1", "p2")

MODELS: Final[dict[str, ModelParameters]] = {
    "pinhole": ModelParameters(_AFFINE_K, (*_RADTAN, "k3", "k4", "k5", "k6")),
    "kannala_brandt": ModelParameters((*_AFFINE_K, "k1", "k2", "k3", "k4")),
    "ocam": ModelParameters(
        ("polynomial", "c", "d", "e", "cx", "cy"), ("inverse_polynomial",), ("polynomial", "inverse_polynomial")
    ),
    "unified": ModelParameters(("xi", *_AFFINE_K), (*_RADTAN, "k3", "skew")),
    "extended_unified": ModelParameters(("alpha", "beta", *_AFFINE_K)),
    "double_sphere": ModelParameters(("xi", "alpha", *_AFFINE_K)),
    "equidistant": ModelParameters(("focal_px", "cx", "cy")),
    "equirectangular": ModelParameters(()),
    "radial_polynomial": ModelParameters(("k1", "k2", "k3", "k4", "cx", "cy", "aspect_ratio")),
}

_POSITIVE: Final = ("fx", "fy", "focal_px", "aspect_ratio")
LARGEST_SIDE_PX: Final = 100_000


def first_fault(spec: CameraSpec) -> tuple[str, str, str] | None:
    """What is wrong with the values of `spec`, as (problem, expectation, key); None if nothing is."""
    model = MODELS.get(spec.model)
    if model is None:
        return f"unknown model {spec.model!r}", "one of " + ", ".join(MODELS), "model"
    for key, side in (("width", spec.width), ("height", spec.height)):
        if not 1 <= side <= LARGEST_SIDE_PX:
            return f"an image {key} of {side}", f"1 to {LARGEST_SIDE_PX} pixels", key
    for key in model.required:
        if key not in spec.parameters:
            return f"{key} is missing", f"the parameters {', '.join(model.required)} of {spec.model}", "parameters"
    for key, value in spec.parameters.items():
        if key not in model.names:
            return f"unknown parameter {key!r} of {spec.model}", f"one of {', '.join(model.names)}", "parameters"
        if (key in model.lists) != isinstance(value, list):
            return f"{key} is {value!r}", "a list of numbers" if key in model.lists else "one number", key
        for number in value if isinstance(value, list) else [value]:
            if not math.isfinite(number):
                return f"{key} is {number}", "a finite number", key
        if key in _POSITIVE and isinstance(value, float) and value <= 0.0:
            return f"{key} is {value!r}", "a positive number", key
    if spec.max_theta_rad is not None and not 0.0 < spec.max_theta_rad <= math.pi:
        return f"max_theta_rad is {spec.max_theta_rad!r}", "an angle above 0, at most pi", "max_theta_rad"
    return _ocam_fault(spec.parameters) if spec.model == "ocam" else None


def _ocam_fault(parameters: Parameters) -> tuple[str, str, str] | None:
    polynomial = parameters["polynomial"]
    if not isinstance(polynomial, list) or len(polynomial) < 2 or not any(polynomial):
        return "the polynomial says nothing", "two coefficients or more, not all zero", "polynomial"
    c, d, e = (parameters[key] for key in ("c", "d", "e"))
    if isinstance(c, float) and isinstance(d, float) and isinstance(e, float) and c - d * e <= 0.0:
        return f"the affine matrix has determinant {c - d * e!r}", "a positive one", "c, d, e"
    return None
