"""`Camera`: a constructor by keyword for each lens model, and calibration files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Self

from tiltvp import _core
from tiltvp.errors import CalibrationError, InvalidInputError
from tiltvp.formats import CameraSpec, read_cameras, write_toml

__all__ = ["Camera"]


class Camera(_core.Camera):
    """A calibrated central camera: pixels to unit bearings and back.

    Camera frame: z along the optical axis, x right (columns u), y down (rows v); pixel centres at integers. Rows
    without an answer are NaN. `mirror=True` says that the image is seen in a mirror: the z component of bearings is
    negated, as a camera that looks up into a convex mirror needs. `max_theta_rad` limits the angle from the ray through
    the centre. Impossible parameters raise `tiltvp.errors.CalibrationError`.
    """

    __slots__ = ()

    @classmethod
    def pinhole(
        cls, *, width: int, height: int, fx: float, fy: float, cx: float, cy: float,
        k1: float | None = None, k2: float | None = None, p1: float | None = None, p2: float | None = None,
        k3: float | None = None, k4: float | None = None, k5: float | None = None, k6: float | None = None,
        max_theta_rad: float | None = None, mirror: bool = False,
    ) -> Self:  # fmt: skip
        """Pinhole with Brown-Conrady distortion of 4, 5 or 8 coefficients, in OpenCV's meaning."""
        return cls(
            "pinhole", width=width, height=height, fx=fx, fy=fy, cx=cx, cy=cy, k1=k1, k2=k2, p1=p1, p2=p2, k3=k3,
            k4=k4, k5=k5, k6=k6, max_theta_rad=max_theta_rad, mirror=mirror,
        )  # fmt: skip

    @classmethod
    def kannala_brandt(
        cls, *, width: int, height: int, fx: float, fy: float, cx: float, cy: float,
        k1: float | None = None, k2: float | None = None, k3: float | None = None, k4: float | None = None,
        max_theta_rad: float | None = None, mirror: bool = False,
    ) -> Self:  # fmt: skip
        """r = theta + k1 theta^3 + k2 theta^5 + k3 theta^7 + k4 theta^9: OpenCV's fisheye, Kalibr's equidistant."""
        return cls(
            "kannala_brandt", width=width, height=height, fx=fx, fy=fy, cx=cx, cy=cy, k1=k1, k2=k2, k3=k3, k4=k4,
            max_theta_rad=max_theta_rad, mirror=mirror,
        )  # fmt: skip

    @classmethod
    def ocam(
        cls, *, width: int, height: int, polynomial: Sequence[float], cx: float, cy: float,
        c: float | None = None, d: float | None = None, e: float | None = None,
        inverse_polynomial: Sequence[float] | None = None, max_theta_rad: float | None = None, mirror: bool = False,
    ) -> Self:  # fmt: skip
        """Scaramuzza's OCam: `polynomial` lowest power first in OCamCalib's sign; `cx` the column, `cy` the row of the
        centre, counted from 0; row = c x + d y + cy, column = e x + y + cx."""
        return cls(
            "ocam", width=width, height=height, polynomial=polynomial, cx=cx, cy=cy, c=c, d=d, e=e,
            inverse_polynomial=inverse_polynomial, max_theta_rad=max_theta_rad, mirror=mirror,
        )  # fmt: skip

    @classmethod
    def unified(
        cls, *, width: int, height: int, xi: float, fx: float, fy: float, cx: float, cy: float,
        k1: float | None = None, k2: float | None = None, p1: float | None = None, p2: float | None = None,
        k3: float | None = None, skew: float | None = None, max_theta_rad: float | None = None, mirror: bool = False,
    ) -> Self:  # fmt: skip
        """Mei's unified model: Kalibr's `omni`, OpenCV's `omnidir`; `skew` is the entry (0, 1) of K in pixels."""
        return cls(
            "unified", width=width, height=height, xi=xi, fx=fx, fy=fy, cx=cx, cy=cy, k1=k1, k2=k2, p1=p1, p2=p2,
            k3=k3, skew=skew, max_theta_rad=max_theta_rad, mirror=mirror,
        )  # fmt: skip

    @classmethod
    def extended_unified(
        cls, *, width: int, height: int, alpha: float, beta: float, fx: float, fy: float, cx: float, cy: float,
        max_theta_rad: float | None = None, mirror: bool = False,
    ) -> Self:  # fmt: skip
        """The extended unified model of Khomutenko et al. 2016."""
        return cls(
            "extended_unified", width=width, height=height, alpha=alpha, beta=beta, fx=fx, fy=fy, cx=cx, cy=cy,
            max_theta_rad=max_theta_rad, mirror=mirror,
        )  # fmt: skip

    @classmethod
    def double_sphere(
        cls, *, width: int, height: int, xi: float, alpha: float, fx: float, fy: float, cx: float, cy: float,
        max_theta_rad: float | None = None, mirror: bool = False,
    ) -> Self:  # fmt: skip
        """The double sphere model of Usenko et al. 2018."""
        return cls(
            "double_sphere", width=width, height=height, xi=xi, alpha=alpha, fx=fx, fy=fy, cx=cx, cy=cy,
            max_theta_rad=max_theta_rad, mirror=mirror,
        )  # fmt: skip

    @classmethod
    def equidistant(
        cls, *, width: int, height: int, focal_px: float, cx: float, cy: float, max_theta_rad: float | None = None,
        mirror: bool = False,
    ) -> Self:  # fmt: skip
        """r = focal_px theta, `focal_px` in pixels per radian."""
        return cls(
            "equidistant", width=width, height=height, focal_px=focal_px, cx=cx, cy=cy, max_theta_rad=max_theta_rad,
            mirror=mirror,
        )  # fmt: skip

    @classmethod
    def equirectangular(
        cls, *, width: int, height: int, max_theta_rad: float | None = None, mirror: bool = False
    ) -> Self:
        """A whole-sphere panorama: longitude ((u + 0.5) / width - 0.5) 2 pi, latitude (0.5 - (v + 0.5) / height) pi."""
        return cls("equirectangular", width=width, height=height, max_theta_rad=max_theta_rad, mirror=mirror)

    @classmethod
    def radial_polynomial(
        cls, *, width: int, height: int, k1: float, k2: float, k3: float, k4: float, cx: float, cy: float,
        aspect_ratio: float | None = None, max_theta_rad: float | None = None, mirror: bool = False,
    ) -> Self:  # fmt: skip
        """WoodScape's r = k1 theta + k2 theta^2 + k3 theta^3 + k4 theta^4, in pixels."""
        return cls(
            "radial_polynomial", width=width, height=height, k1=k1, k2=k2, k3=k3, k4=k4, cx=cx, cy=cy,
            aspect_ratio=aspect_ratio, max_theta_rad=max_theta_rad, mirror=mirror,
        )  # fmt: skip

    @classmethod
    def from_spec(cls, spec: CameraSpec) -> Self:
        """The camera that a reader of calibration files describes."""
        return cls(
            spec.model, width=spec.width, height=spec.height, max_theta_rad=spec.max_theta_rad, mirror=spec.mirror,
            **spec.parameters,
        )  # fmt: skip

    @classmethod
    def load(
        cls, path: str | os.PathLike[str], format: str | None = None, *, camera: str | int = 0,
        image_size: tuple[int, int] | None = None,
    ) -> Self:  # fmt: skip
        """The camera of a calibration file.

        The format is recognised by its content unless `format` names it (`tiltvp.formats.FORMATS` lists them). `camera`
        picks one by its name or place where the file has several. `image_size`, (width, height) in pixels, is for the
        files that do not carry it. Raises `tiltvp.errors.CalibrationError` that says what was wrong, what was expected
        and where.
        """
        specs = read_cameras(path, format, image_size)
        names = [spec.name for spec in specs]
        if isinstance(camera, str):
            if camera not in names:
                raise InvalidInputError(f"{path}: no camera {camera!r}, expected one of {', '.join(names)}")
            camera = names.index(camera)
        if not 0 <= camera < len(specs):
            raise InvalidInputError(f"{path}: no camera number {camera}, expected 0 to {len(specs) - 1}")
        try:
            return cls.from_spec(specs[camera])
        except CalibrationError as error:
            raise CalibrationError(f"{path}: {error}") from error

    def save(self, path: str | os.PathLike[str], name: str = "cam0") -> None:
        """Writes the camera as TOML, whole or not at all; `load` gives an equal camera back."""
        write_toml(self.to_spec(name), path)

    def to_spec(self, name: str = "cam0") -> CameraSpec:
        """The camera as the readers and writers of calibration files know it."""
        return CameraSpec(
            model=self.model,
            width=self.width,
            height=self.height,
            parameters=self.parameters,
            mirror=self.mirror,
            name=name,
            max_theta_rad=self.max_theta_rad,
        )
