"""The options that commands share, and their way from words and degrees to what the library takes."""

# Annotations are evaluated: other files inherit these options, and there cyclopts would not find the names of types.

import difflib
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from tiltvp import Camera, TiltEstimator

_CAMERA = Group("Camera")
_METHOD = Group("Method", help="An option that is not given has the default of its method.")
_AS_THEY_ARE = (
    "method", "margin_px", "row_stride", "gradient_min", "smoothing_px", "keep_fraction", "max_iterations",
    "threshold_px", "offset_max_px", "normal", "sampling", "local_optimization", "score", "verification", "seed",
)  # fmt: skip
_ANGLES = ("elevation_min", "elevation_max", "tilt_max", "scale", "tolerance", "threshold")
Switch = Annotated[bool, Parameter(negative="", show_default=False)]


def image_size_from(text: str | None) -> tuple[int, int] | None:
    """(width, height) from `640x480`."""
    if text is None:
        return None
    found = re.fullmatch(r"\s*(\d+)\s*[xX*,]\s*(\d+)\s*", text)
    if found is None:
        raise InvalidInputError(f"--image-size {text!r}, expected WIDTHxHEIGHT in pixels, such as 640x480")
    return int(found[1]), int(found[2])


@Parameter(name="*", group=_CAMERA)
@dataclass(frozen=True, kw_only=True)
class CameraOptions:
    """Which camera took the images."""

    camera: Path
    """Calibration file, of any of the formats that `tiltvp camera formats` lists."""
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

        name = self.camera_name or "0"
        camera = Camera.load(
            self.camera,
            self.camera_format,
            camera=int(name) if name.isdecimal() else name,
            image_size=image_size_from(self.image_size),
        )
        return camera.mirrored() if self.mirror and not camera.mirror else camera


@dataclass(frozen=True, kw_only=True)
class EdgeOptions:
    """Where edges are looked for, and what is one."""

    method: str | None = None
    """Name of the method."""
    robot_from_camera: str | None = None
    """How the camera sits on the robot: up (the default), forward, or a file with a rotation."""
    elevation_min_deg: float | None = None
    """Lowest elevation that is looked at, above the robot's horizon."""
    elevation_max_deg: float | None = None
    """Highest elevation that is looked at."""
    margin_px: float | None = None
    """Pixels kept clear of the lens' rim, the image border and the mask."""
    mask: Path | None = None
    """Image of the camera's size, white where the world is seen and black where the robot is."""
    row_stride: int | None = None
    """Look at every so-manieth row of the image only: less time, and less sure an answer."""
    gradient_min: float | None = None
    """Least gradient magnitude of an edge pixel (3x3 Scharr kernel, 8 bit)."""
    smoothing_px: float | None = None
    """Standard deviation of the Gaussian before the kernel."""


@Parameter(name="*", group=_METHOD)
@dataclass(frozen=True, kw_only=True)
class MethodOptions(EdgeOptions):
    """How the tilt is estimated."""

    method: str | None = None
    """refined, image-space-ransac, image-space-reject-refit or vector-consensus."""
    tilt_max_deg: float | None = None
    """Largest tilt expected: edges that would need a larger one are rejected first."""
    keep_fraction: float | None = None
    """Share of residuals kept in each round of trimming."""
    scale_deg: float | None = None
    """Standard deviation of the soft gate of the refined method."""
    tolerance_deg: float | None = None
    """Change of the direction below which the refined method has converged."""
    max_iterations: int | None = None
    """Most refits of the refined method with the gate at its final scale."""
    threshold_px: float | None = None
    """Largest residual of an inlier of image-space-ransac."""
    threshold_deg: float | None = None
    """Largest residual of an inlier of vector-consensus."""
    offset_max_px: float | None = None
    """Largest edge offset of the image-space methods."""
    normal: str | None = None
    """gradient or tangent: the normals of vector-consensus."""
    correction: str | None = None
    """closed-form, none or a number: the factor from shift (or raw angle) to angle."""
    sampling: str | None = None
    """uniform, progressive or prosac: which samples image-space-ransac and vector-consensus draw."""
    local_optimization: Annotated[bool | None, Parameter(negative="")] = None
    """Refine each new best model by least squares before the next sample."""
    score: str | None = None
    """count, msac or magsac: what makes one model better than another."""
    verification: str | None = None
    """full or sprt: score every model, or give up those that fail a test."""
    seed: int | None = None
    """Seed of the random samples."""

    def estimator(self, camera: "Camera") -> "TiltEstimator":
        """The estimator with the options that were given."""
        from tiltvp import METHODS, TiltEstimator
        from tiltvp.rotations import read_rotation

        options = self._given()
        if self.robot_from_camera is not None:
            options["robot_from_camera"] = read_rotation(self.robot_from_camera)
        if self.method is not None and self.method not in METHODS:
            near = difflib.get_close_matches(self.method, METHODS, 1, 0.3)
            meant = f" (did you mean {near[0]}?)" if near else ""
            raise InvalidInputError(f"--method {self.method!r}{meant}, expected one of {', '.join(METHODS)}")
        return TiltEstimator(camera, **options)

    def _given(self) -> dict[str, Any]:
        """The keywords of `TiltEstimator`: what was not given is left to the library."""
        options: dict[str, Any] = {name: getattr(self, name) for name in _AS_THEY_ARE}
        for name in _ANGLES:
            degrees = getattr(self, f"{name}_deg")
            options[f"{name}_rad"] = None if degrees is None else math.radians(degrees)
        options = {name: value for name, value in options.items() if value is not None}
        if self.mask is not None:
            options["mask"] = mask_from(self.mask)
        if self.correction is not None:
            options["correction"] = _correction_from(self.correction)
        return options


def mask_from(path: Path) -> object:
    """Where an image is bright."""
    from tiltvp import read_image
    from tiltvp.images import gray_from

    return gray_from(read_image(path), str(path)) > 127


def _correction_from(word: str) -> str | float | None:
    if word == "none":
        return None
    try:
        return float(word)
    except ValueError:
        return word
