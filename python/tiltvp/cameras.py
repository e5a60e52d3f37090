"""`Camera`: a calibrated camera, by keyword or from a calibration file."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Self

from tiltvp.errors import CalibrationError, InvalidInputError
from tiltvp.lenses import Lenses

if TYPE_CHECKING:
    from tiltvp.formats import CameraSpec

__all__ = ["Camera"]


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
        """The camera that a reader of calibration files describes."""
        return cls(
            spec.model, width=spec.width, height=spec.height, max_theta_rad=spec.max_theta_rad, mirror=spec.mirror,
            **spec.parameters,
        )  # fmt: skip

    @classmethod
    def load(
        cls, path: str | os.PathLike[str], format: str | None = None, *, camera: str | int = 0,
        image_size: tuple[int, int] | None = None, mirror: bool = False,
    ) -> Self:  # fmt: skip
        """The camera of a calibration file.

        The format is recognised by its content unless `format` names it (`tiltvp.formats.FORMATS` lists them). `camera`
        picks one by its name or place where the file has several. `image_size`, (width, height) in pixels, is for the
        files that do not carry it. `mirror` says that the images are seen in a mirror, where the file does not.
        Raises `tiltvp.errors.CalibrationError` that says what was wrong, what was expected and where.
        """
        from tiltvp.formats import read_cameras

        specs = read_cameras(path, format, image_size)
        names = [spec.name for spec in specs]
        if isinstance(camera, str):
            if camera not in names:
                raise InvalidInputError(f"{path}: no camera {camera!r}, expected one of {', '.join(names)}")
            camera = names.index(camera)
        if not 0 <= camera < len(specs):
            raise InvalidInputError(f"{path}: no camera number {camera}, expected 0 to {len(specs) - 1}")
        try:
            found = cls.from_spec(specs[camera])
            return found.mirrored() if mirror and not found.mirror else found
        except CalibrationError as error:
            raise CalibrationError(f"{path}: {error}") from error

    def save(self, path: str | os.PathLike[str], name: str = "cam0") -> None:
        """Writes the camera as TOML, whole or not at all; `load` gives an equal camera back."""
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
