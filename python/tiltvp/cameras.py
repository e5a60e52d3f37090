"""`Camera`: a calibrated camera, by keyword or from a calibration file."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, Self

from tiltvp.arguments import flag_from, number_from, pair_from, refuse_unless, size_from
from tiltvp.errors import CalibrationError, InvalidInputError
from tiltvp.files import check_toml
from tiltvp.lenses import Lenses

if TYPE_CHECKING:
    from tiltvp.formats import CameraSpec

__all__ = ["VIEW_LENSES", "Camera"]

VIEW_LENSES: Final = ("equidistant", "equisolid", "stereographic", "pinhole")
"""Lenses that an angle and a radius determine, for `Camera.from_view`: theta, 2 sin(theta/2), 2 tan(theta/2) and
tan(theta) times the focal length from the centre."""
_EQUISOLID: Final = (-1.0 / 24.0, 1.0 / 1920.0, -1.0 / 322560.0, 1.0 / 92897280.0)
"""2 sin(theta/2) as theta + k1 theta^3 + ...: at 100 degrees the next term is 7e-9."""


class Camera(Lenses):
    """A calibrated central camera: pixels to unit bearings and back.

    Camera frame: z along the optical axis, x right (columns u), y down (rows v); pixel centres at integers. Rows
    without an answer are NaN. `mirror=True` says that the image is seen in a mirror: the z component of bearings is
    negated, as a camera that looks up into a convex mirror needs. `max_theta_rad` limits the angle from the ray through
    the centre. `Camera(model, ...)` takes the name of a lens model and its parameters, and each model has a constructor
    of its name, as in `Camera.equidistant(...)`. Impossible parameters raise `tiltvp.errors.CalibrationError`.
    """

    __slots__ = ()

    @classmethod
    def from_spec(cls, spec: CameraSpec) -> Self:
        """The camera that a reader of calibration files describes. Raises `InvalidInputError` for what is no spec."""
        from tiltvp.formats.spec import CameraSpec

        refuse_unless(spec, CameraSpec, "spec", "one CameraSpec, as read_cameras gives them")
        return cls(
            spec.model, width=spec.width, height=spec.height, max_theta_rad=spec.max_theta_rad, mirror=spec.mirror,
            **spec.parameters,
        )  # fmt: skip

    @classmethod
    def from_view(
        cls, lens: str = "equidistant", *, width: int, height: int, view_rad: float, radius_px: float | None = None,
        centre_px: tuple[float, float] | None = None, mirror: bool = False,
    ) -> Self:  # fmt: skip
        """A camera of an ideal lens of `VIEW_LENSES` that sees `view_rad` across 2 `radius_px` pixels.

        With the centre (u, v) and the radius of the image circle it is the camera of Fleer 2017 (2.1.1), which ends at
        the circle; without a radius the view is that across the width of the image, and the centre is that of the image
        if none is given. How far a real lens is from its ideal it does not know: calibrate where you can. Raises
        `InvalidInputError` for an unknown lens, for angles and lengths that cannot be, and for a circle outside the
        image.
        """
        if not (isinstance(lens, str) and lens in VIEW_LENSES):
            raise InvalidInputError(f"lens = {lens!r}, expected one of {', '.join(VIEW_LENSES)}")
        width, height = size_from((width, height), "width, height")
        view_rad = number_from(view_rad, "view_rad")
        half, most = 0.5 * view_rad, math.pi if lens == "pinhole" else 2.0 * math.pi
        if not (half > 0.0 and view_rad < most):
            degrees = f"{math.degrees(view_rad):g} degrees"
            raise InvalidInputError(f"view_rad: {degrees}, expected more than 0 and less than {math.degrees(most):g}")
        radius = 0.5 * width if radius_px is None else number_from(radius_px, "radius_px")
        if not (math.isfinite(radius) and radius > 0.0):
            raise InvalidInputError(f"radius_px = {radius_px}, expected a positive number of pixels")
        cx, cy = (0.5 * (width - 1), 0.5 * (height - 1)) if centre_px is None else pair_from(centre_px, "centre_px")
        outside = (max(0.0, -0.5 - c, c + 0.5 - side) for c, side in ((cx, width), (cy, height)))
        if radius_px is not None and math.hypot(*outside) >= radius:
            raise InvalidInputError(
                f"centre_px = ({cx:g}, {cy:g}), radius_px = {radius:g}: no pixel is within, expected another circle"
            )
        common: dict[str, Any] = {
            "width": width, "height": height, "cx": cx, "cy": cy, "mirror": flag_from(mirror, "mirror"),
            "max_theta_rad": None if radius_px is None else half,
        }  # fmt: skip
        if lens == "equidistant":
            return cls("equidistant", focal_px=radius / half, **common)
        if lens == "equisolid":
            focal = radius / (2.0 * math.sin(0.5 * half))
            k1, k2, k3, k4 = _EQUISOLID
            return cls("kannala_brandt", fx=focal, fy=focal, k1=k1, k2=k2, k3=k3, k4=k4, **common)
        if lens == "stereographic":
            # A unified camera with xi = 1 has f sin(theta) / (1 + cos(theta)) = f tan(theta/2).
            focal = radius / math.tan(0.5 * half)
            return cls("unified", xi=1.0, fx=focal, fy=focal, **common)
        focal = radius / math.tan(half)
        return cls("pinhole", fx=focal, fy=focal, **common)

    def scaled(self, factor: float) -> Self:
        """The camera of the image resized by `factor`: what was at u is at factor (u + 1/2) - 1/2.

        The size is rounded to whole pixels. Raises `InvalidInputError` for a factor that is not positive.
        """
        return super().scaled(number_from(factor, "factor"))

    def cropped(self, u: int, v: int, width: int, height: int) -> Self:
        """The camera of a part of the image, whose first pixel is (u, v).

        What of it is beyond the image is a border that shows nothing, which no camera knows, and whose edges are as
        straight as those of a room: leave it out of what is looked at by `mask`. Raises `InvalidInputError` for an
        equirectangular camera, which covers the sphere, and for what is no number.
        """
        parameters = self.parameters
        if not {"cx", "cy"} <= parameters.keys():
            raise InvalidInputError(f"a part of an image of model {self.model}, expected a model with a centre")
        moved = {
            "cx": float(parameters["cx"]) - number_from(u, "u"),
            "cy": float(parameters["cy"]) - number_from(v, "v"),
        }
        width, height = size_from((width, height), "width, height")
        spec = replace(
            self.to_spec(), width=width, height=height, parameters={**parameters, **moved}, max_theta_rad=None
        )
        found = type(self).from_spec(spec)
        if self.max_theta_rad < found.max_theta_rad:
            return type(self).from_spec(replace(spec, max_theta_rad=self.max_theta_rad))
        return found

    @classmethod
    def load(
        cls, path: str | os.PathLike[str], format: str | None = None, *, camera: str | int = 0,
        image_size: tuple[int, int] | None = None, mirror: bool = False,
    ) -> Self:  # fmt: skip
        """The camera of a calibration file.

        The format is recognised by its content unless `format` names it (`tiltvp.formats.FORMATS` lists them). `camera`
        picks one by its name, or else its number from 0, where the file has several. `image_size`, (width, height) in
        pixels, is for the files that do not carry it. `mirror` says that the images are seen in a mirror, where the
        file does not. Raises `tiltvp.errors.CalibrationError` that says what was wrong, what was expected and where.
        """
        from tiltvp.formats import read_cameras
        from tiltvp.formats.spec import chosen_spec

        spec = chosen_spec(read_cameras(path, format, image_size), camera, path)
        try:
            found = cls.from_spec(spec)
            return found.mirrored() if flag_from(mirror, "mirror") and not found.mirror else found
        except CalibrationError as error:
            raise CalibrationError(f"{path}: {error}") from error

    def save(self, path: str | os.PathLike[str], name: str = "cam0") -> None:
        """Writes the camera as TOML, whole or not at all; `load` gives an equal camera back.

        Raises `InvalidInputError` where `path` does not end in .toml: other formats are of `formats.write_cameras`.
        """
        check_toml(path)
        from tiltvp.formats import write_toml

        write_toml(self.to_spec(name), path)

    def to_spec(self, name: str = "cam0") -> CameraSpec:
        """The camera as the readers and writers of calibration files know it."""
        from tiltvp.formats import CameraSpec

        return CameraSpec(
            model=self.model,
            width=self.width,
            height=self.height,
            parameters=self.parameters,
            mirror=self.mirror,
            name=name,
            max_theta_rad=self.max_theta_rad,
        )
