"""What every calibration file is turned into: the name of a camera model and its numbers.

Pixel centres are at integers, (0, 0) being the centre of the top left pixel; the camera looks along +z with x to the
right and y down. The core says which parameters a model has and what they mean (`tiltvp.Camera`, docs/cameras.md).
"""

from __future__ import annotations

import operator
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from tiltvp import _core
from tiltvp.arguments import flag_from, refuse_unless, texts_from
from tiltvp.errors import InvalidInputError

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

    def check(self) -> None:
        """Raises what the camera of these numbers raises: `tiltvp.errors.TiltvpError` for what no such lens has."""
        refuse_unless(self.parameters, dict, "parameters", "a dict")
        flag_from(self.mirror, "mirror")
        for name in ("name", "format"):
            refuse_unless(getattr(self, name), str, name, "a text")
        texts_from(self.notes, "notes")
        _core.check_camera(self.model, self.width, self.height, self.parameters, self.max_theta_rad)


def chosen_spec(specs: Sequence[CameraSpec], camera: str | int, where: object) -> CameraSpec:
    """The camera of that name, or else of that number, the first being 0. Raises `InvalidInputError` with `where`."""
    names = [spec.name for spec in specs]
    if isinstance(camera, str):
        if camera in names:
            return specs[names.index(camera)]
        if not re.fullmatch(r"\d{1,9}", camera, re.ASCII) or int(camera) >= len(specs):
            raise InvalidInputError(f"{where}: no camera {camera!r}, expected one of {', '.join(names)} or a number")
        return specs[int(camera)]
    try:
        number = operator.index(camera)
    except TypeError:
        raise InvalidInputError(f"{where}: camera = {camera!r}, expected a name or a whole number") from None
    if not 0 <= number < len(specs):
        raise InvalidInputError(f"{where}: no camera number {number}, expected 0 to {len(specs) - 1}")
    return specs[number]
