"""From what a method measures, a shift in pixels or a raw angle, to the lean: learned from images of known tilt."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Self, TypeAlias

from tiltvp._core import (
    METHODS,
    AffineCorrection,
    Camera,
    PosteriorCorrection,
    PriorOfTilt,
    TiltEstimator,
    apply_correction,
    option_fields,
    train_affine,
    train_factor,
    train_posterior,
)
from tiltvp.arguments import array_from, number_from, path_from, refuse_unless
from tiltvp.errors import CalibrationError, InvalidInputError, TiltvpError
from tiltvp.files import check_output, check_toml, write_whole

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from tiltvp.formats.document import Document

__all__ = [
    "CORRECTION_KINDS",
    "AffineCorrection",
    "PosteriorCorrection",
    "PriorOfTilt",
    "TrainedCorrection",
    "apply_correction",
    "train_affine",
    "train_correction",
    "train_factor",
    "train_posterior",
]

Correction: TypeAlias = "float | AffineCorrection | PosteriorCorrection"

CORRECTION_KINDS: Final = ("posterior", "affine", "factor")
"""What `train_correction` trains: P(alpha | l) of section 5.1 of Fleer 2017, a and b of section 4, a of eq. 30 or a' of
eq. 45."""
_FORMAT: Final = "tiltvp-correction"
_FILE: Final = "a file written by `tiltvp lab train`"
_MOUNTING: Final = "robot_from_camera"
_VERSION: Final = 1
_FREE: Final = ("correction", "mask", "seed", _MOUNTING)
"""Options that a correction does not depend on, or that it is, and the mounting, which is compared as one."""
_SAME_MOUNTING_RAD: Final = math.radians(1.0)
"""Between the verticals of mountings that count as one: a few percent of a lean, as a factor went from 169 to 292 over
40 degrees."""


@dataclass(frozen=True)
class TrainedCorrection:
    """A correction with what it was trained for: it means nothing for another method, other options or another lens."""

    correction: Correction
    method: str
    options: dict[str, Any] = field(default_factory=dict)
    """Options of the method, without mask and seed."""
    camera: dict[str, Any] = field(default_factory=dict)
    """As `Camera.to_dict` gives it."""
    images: int = 0
    """How many images it was trained on."""
    robot_from_camera: list[list[float]] | None = None
    """The rows of the mounting, (3, 3); None in files from before it was kept."""

    def __post_init__(self) -> None:
        if self.robot_from_camera is not None:
            rows: list[list[float]] = array_from(self.robot_from_camera, _MOUNTING).tolist()
            object.__setattr__(self, _MOUNTING, rows)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """The correction of a file of `save`. Raises `CalibrationError` that says what was wrong and where."""
        from tiltvp.formats.document import Document

        return cls._read(Document.load(path, _FILE))

    @classmethod
    def _read(cls, document: Document) -> Self:
        # Importing the package would take longer with them.
        import numpy as np

        from tiltvp.formats.node import Node

        path = document.path
        root = Node(document, document.toml(_FILE))
        if not root.has("format") or root.need("format").text() != _FORMAT:
            root.fail("it is no correction", f'format = "{_FORMAT}"')
        root.only("format", "version", "kind", "method", "images", "correction", "options", "camera", _MOUNTING)
        version = root.need("version")
        if version.integer() != _VERSION:
            version.refuse(f"version {version.integer()} is not supported", f"version {_VERSION}")
        kind, method = root.need("kind"), root.need("method")
        if kind.text() not in CORRECTION_KINDS:
            kind.fail(f"found {kind.text()!r}", f"one of {', '.join(CORRECTION_KINDS)}")
        if method.text() not in METHODS:
            method.fail(f"found {method.text()!r}", f"one of {', '.join(METHODS)}")
        values = dict(root.need("correction").tree)
        try:
            made: Correction
            match kind.text():
                case "factor":
                    made = root.need("correction").need("factor").number()
                case "affine":
                    made = AffineCorrection.from_dict(values)
                case _:
                    made = PosteriorCorrection.from_dict(values)
        except CalibrationError:
            raise
        except (InvalidInputError, KeyError, TypeError, ValueError) as error:
            raise CalibrationError(f"{path}: {error}, expected a {kind.text()} correction, at correction") from error
        trained = cls(
            made,
            method.text(),
            dict(root.need("options").tree),
            dict(root.need("camera").tree),
            root.need("images").integer(),
            None if (mounting := root.get(_MOUNTING)) is None else np.reshape(mounting.numbers(9), (3, 3)).tolist(),
        )
        try:
            camera = Camera.from_dict(trained.camera)
            TiltEstimator(camera, **trained.estimator_options(camera, {}, None))
        except (TiltvpError, TypeError) as error:
            raise CalibrationError(f"{path}: {error}, at camera, options or {_MOUNTING}") from error
        return trained

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes it as TOML (.toml), whole or not at all.

        Raises `InvalidInputError` for another ending and for what is no TOML, `CalibrationError` for what could not be
        read again, and `OutputError`.
        """
        import tomli_w

        from tiltvp.formats.document import Document

        check_toml(path)
        check_output(path)
        made = self.correction
        curves = (AffineCorrection, PosteriorCorrection)
        values = made.to_dict() if isinstance(made, curves) else {"factor": number_from(made, "correction")}
        tree = {
            "format": _FORMAT, "version": _VERSION, "kind": self.kind, "method": self.method, "images": self.images,
            "correction": values, "options": self.options, "camera": self.camera,
        }  # fmt: skip
        if self.robot_from_camera is not None:
            tree[_MOUNTING] = self.robot_from_camera
        try:
            text = tomli_w.dumps(tree)
        except TypeError as error:
            raise InvalidInputError(f"{path}: {error}, expected plain numbers, texts, lists and dicts") from error
        self._read(Document(path_from(path), text))
        write_whole(path, text)

    @property
    def kind(self) -> str:
        """One of `CORRECTION_KINDS`."""
        names = {AffineCorrection: "affine", PosteriorCorrection: "posterior"}
        return names.get(type(self.correction), "factor")

    def estimator_options(self, camera: Camera, given: dict[str, Any], method: str | None) -> dict[str, Any]:
        """The keywords of an estimator that it corrects: what was given, and for the rest what it was trained with.

        Raises `InvalidInputError` for another method, for an option that was given otherwise, for another camera and
        for a mounting that sees the vertical more than a degree elsewhere.
        """
        refuse_unless(camera, Camera, "camera", "a tiltvp.Camera")
        if method is not None and method != self.method:
            raise InvalidInputError(f"a correction of {self.method} with the method {method}, expected {self.method}")
        for name, value in given.items():
            if name not in _FREE and value != (trained := self.options.get(name)):
                raise InvalidInputError(f"{name} = {value} with a correction that was trained at {trained}")
        if (seen := camera.to_dict()) != self.camera:
            names = [name for name in {**seen, **self.camera} if seen.get(name) != self.camera.get(name)]
            raise InvalidInputError(
                f"a correction of another camera ({', '.join(sorted(names))} differ), expected that of its training"
            )
        known = self.options if self.robot_from_camera is None else {**self.options, _MOUNTING: self.robot_from_camera}
        if _MOUNTING in given and self.robot_from_camera is not None:
            angle_rad = _between_verticals(given[_MOUNTING], self.robot_from_camera)
            if angle_rad > _SAME_MOUNTING_RAD:
                raise InvalidInputError(
                    f"{_MOUNTING}: a correction of a camera mounted {math.degrees(angle_rad):.1f} degrees otherwise, "
                    f"expected that of its training, {self.robot_from_camera}"
                )
        return {**known, **given, "method": self.method, "correction": self.correction}


def _between_verticals(mounting: ArrayLike, other: ArrayLike) -> float:
    """The angle between the robot's z axes, as the camera sees them, of two mountings (3, 3)."""
    import numpy as np

    from tiltvp.rotations import mounting_from

    here, there = mounting_from(mounting)[2], mounting_from(other)[2]
    return math.atan2(float(np.linalg.norm(np.cross(here, there))), float(here @ there))


def train_correction(
    estimator: TiltEstimator,
    measured: NDArray[np.float64] | Sequence[float],
    alpha_rad: NDArray[np.float64] | Sequence[float],
    *,
    kind: str = "posterior",
) -> TrainedCorrection:
    """A correction of an estimator from what it measured (N,), shifts or raw angles, at known leans (N,) in radians.

    The estimator has no correction (`correction=None`), by which it would measure something else. NaN is an image
    without an estimate, which is left out. Raises `InvalidInputError` for an unknown kind, for an estimator that cannot
    have a correction or has one, and where the numbers do not determine one.
    """
    import numpy as np

    refuse_unless(estimator, TiltEstimator, "estimator", "a TiltEstimator")
    if not (isinstance(kind, str) and kind in CORRECTION_KINDS):
        raise InvalidInputError(f"kind = {kind!r}, expected one of {', '.join(CORRECTION_KINDS)}")
    if all(one["name"] != "correction" for one in option_fields("TiltEstimator", estimator.method)):
        raise InvalidInputError(f"method {estimator.method} has no correction, expected one of the paper's methods")
    # The vector consensus as it is has the factor 1.
    if (present := estimator.options["correction"]) not in (None, 1.0):
        raise InvalidInputError(f"an estimator with correction = {present!r}, expected one that measures with None")
    shifts, leans = array_from(measured, "measured"), array_from(alpha_rad, "alpha_rad")
    if shifts.ndim != 1 or shifts.shape != leans.shape:
        raise InvalidInputError(f"measured, alpha_rad: shapes {shifts.shape} and {leans.shape}, expected (N,) of both")
    # Upright images do not tell a factor.
    known = ~np.isnan(shifts) & ((leans != 0.0) | (kind != "factor"))
    shifts, leans = shifts[known], leans[known]
    made: Correction
    match kind:
        case "factor":
            made = train_factor(shifts, leans)
        case "affine":
            made = train_affine(shifts, leans)
        case _:
            made = train_posterior(shifts, leans)
    options = {name: value for name, value in estimator.options.items() if name not in _FREE and value is not None}
    return TrainedCorrection(
        made, estimator.method, options, estimator.camera.to_dict(), len(shifts), estimator.robot_from_camera.tolist()
    )
