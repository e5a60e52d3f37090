"""Gravity for COLMAP: the tilt of each image of a database, written as a prior of its pose.

COLMAP's camera frame is ours: x right, y down, z forward. Gravity is a unit vector in it, (0, 1, 0) for a level image.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp.arguments import number_from, path_from, refuse_uncallable, refuse_unless, shaped_from
from tiltvp.cameras import Camera
from tiltvp.errors import CalibrationError, ImageFileError, InvalidInputError, MissingExtraError, OutputError
from tiltvp.formats import CameraSpec
from tiltvp.formats.colmap import spec_of
from tiltvp.image_headers import file_orientation
from tiltvp.images import gray_from, read_image
from tiltvp.setup_check import check_setup, mounting_looking
from tiltvp.tilt import TiltEstimate, TiltEstimator

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["ColmapDatabase", "ColmapImage", "ImageGravity", "gravity_from", "image_gravities"]

_TABLES: Final = frozenset(("cameras", "images", "two_view_geometries"))
_UP_OF_TAG: Final = {1: "-y", 3: "+y", 6: "-x", 8: "+x"}
"""Which direction of the camera frame is up, by the orientation tag of a photograph (Exif 2.3); the other four values
are of mirrored images."""
_UNREADABLE: Final = "it cannot be read"
_SETUP_IMAGES: Final = 5
"""Images of one camera that are asked whether they stand upright: enough for `check_setup`."""


@dataclass(frozen=True)
class ColmapImage:
    """An image of a database: its number, its name below the folder of images, and the number of its camera."""

    image_id: int
    name: str
    camera_id: int
    has_gravity: bool
    """Whether its prior tells a gravity that is more than the six directions of an orientation tag."""


@dataclass(frozen=True, eq=False)
class ImageGravity:
    """What was found for an image. True if there is a gravity that is believed."""

    image: ColmapImage
    gravity: NDArray[np.float64] | None
    """(3,): unit vector in the camera frame, x right, y down, z forward; None where the tilt is not believed."""
    reason: str
    """Why there is none, in the words that all images with this fault share; else how the estimate went."""
    confidence: float = 0.0
    is_unreadable: bool = False
    """Whether the image could not be read."""

    def __bool__(self) -> bool:
        return self.gravity is not None


class ColmapDatabase:
    """The cameras and images of a COLMAP database, read once; `write` sets priors in one transaction.

    `cameras` has for each camera's number its `CameraSpec`, or why its images have no known directions. Raises
    `InvalidInputError` for what is no such database and `MissingExtraError` without pycolmap.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = path_from(path)
        _check_database(self.path)
        self._what = f"{self.path}: a database of COLMAP"
        with import_pycolmap(self._what).Database.open(str(self.path)) as opened:
            known = {_key(prior.corr_data_id): prior for prior in opened.read_all_pose_priors()}
            cameras = opened.read_all_cameras()
            self.cameras: dict[int, CameraSpec | str] = {
                camera.camera_id: _spec(camera, self.path) for camera in cameras
            }
            self._sizes = {camera.camera_id: (camera.width, camera.height) for camera in cameras}
            self.images = tuple(
                ColmapImage(image.image_id, image.name, image.camera_id, _is_fine(known.get(_key(image.data_id))))
                for image in sorted(opened.read_all_images(), key=lambda image: image.name)
            )

    def use_cameras(self, specs: Iterable[CameraSpec]) -> None:
        """Takes cameras named `cam` and their number in place of those of the database.

        Raises `InvalidInputError` for one that the database does not have, or that has another image size.
        """
        for spec in specs:
            number = spec.name.removeprefix("cam")
            if not number.isdecimal() or int(number) not in self.cameras:
                known = ", ".join(f"cam{camera_id}" for camera_id in sorted(self.cameras))
                raise InvalidInputError(f"{self.path}: no camera {spec.name!r}, expected one of {known}")
            width, height = self._sizes[int(number)]
            if (spec.width, spec.height) != (width, height):
                given = f"{spec.width} x {spec.height} pixels"
                raise InvalidInputError(f"{self.path}: {spec.name} of {given}, expected its {width} x {height}")
            self.cameras[int(number)] = spec

    def write(self, found: Sequence[ImageGravity]) -> None:
        """Sets the gravity of images that are believed and takes away that of the others; positions stay.

        All of it is written or nothing. Raises `OutputError`.
        """
        pycolmap = import_pycolmap(self._what)
        try:
            with pycolmap.Database.open(str(self.path)) as opened:
                known = {_key(prior.corr_data_id): prior for prior in opened.read_all_pose_priors()}
                ids = {image.image_id: image.data_id for image in opened.read_all_images()}
                with pycolmap.DatabaseTransaction(opened):
                    for one in found:
                        data_id = ids[one.image.image_id]
                        prior = known.get(_key(data_id))
                        if prior is None and one.gravity is None:
                            continue
                        is_new = prior is None
                        prior = pycolmap.PosePrior() if prior is None else prior
                        prior.corr_data_id = data_id
                        prior.gravity = np.full(3, np.nan) if one.gravity is None else one.gravity
                        (opened.write_pose_prior if is_new else opened.update_pose_prior)(prior)
        except (RuntimeError, ValueError, KeyError) as error:
            why = " ".join(str(error).split())
            raise OutputError(f"{self.path}: priors cannot be written ({why}), expected a database that can") from error


def gravity_from(estimate: TiltEstimate, robot_from_camera: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,): where things fall, in the camera frame, by the tilt of a robot on which the camera sits so."""
    refuse_unless(estimate, TiltEstimate, "estimate", "a TiltEstimate")
    return -np.asarray(estimate.normal) @ shaped_from(robot_from_camera, "robot_from_camera", 3, 3)


def image_gravities(
    database: ColmapDatabase,
    folder: str | os.PathLike[str],
    estimator_of: Callable[[Camera, NDArray[np.float64]], TiltEstimator],
    *,
    confidence_min: float,
    advance: Callable[[], None] = lambda: None,
) -> list[ImageGravity]:
    """What each image of a database tells of gravity, in the order of their names.

    `estimator_of` makes the estimator of a camera and a mounting (3, 3), which is that of a camera that looks ahead
    with the side of the image up that the photograph's orientation tag tells, upright without one; it may take another
    mounting. Images of one camera and tag that speak against it are not believed. `advance` is called per image.
    """
    refuse_unless(database, ColmapDatabase, "database", "a ColmapDatabase")
    folder, confidence_min = path_from(folder), number_from(confidence_min, "confidence_min")
    refuse_uncallable(estimator_of, "estimator_of", "what makes an estimator of a camera and a mounting")
    groups: dict[tuple[int, str], list[ColmapImage]] = {}
    found: dict[int, ImageGravity] = {}
    for image in database.images:
        spec = database.cameras.get(image.camera_id, "its camera is not in the database")
        up = spec if isinstance(spec, str) else _up_of(folder / image.name)
        if up in _UP_OF_TAG.values():
            groups.setdefault((image.camera_id, up), []).append(image)
        else:
            is_unreadable = not isinstance(spec, str) and up == _UNREADABLE
            found[image.image_id] = ImageGravity(image, None, up, is_unreadable=is_unreadable)
            advance()
    for (camera_id, up), images in groups.items():
        spec = database.cameras[camera_id]
        assert isinstance(spec, CameraSpec)
        group = _Group(estimator_of(Camera.from_spec(spec), mounting_looking(up)), folder, confidence_min)
        speaks_against = group.speaks_against(images)
        for image in images:
            one = group.look(image)
            if one and speaks_against is not None:
                one = replace(one, gravity=None, reason=speaks_against)
            found[image.image_id] = one
            advance()
    return [found[image.image_id] for image in database.images]


@dataclass(frozen=True, eq=False)
class _Group:
    """Images of one camera that are held in one way."""

    estimator: TiltEstimator
    folder: Path
    confidence_min: float

    def gray(self, image: ColmapImage) -> NDArray[np.uint8]:
        """Raises `ImageFileError` and `InvalidInputError`."""
        gray = gray_from(read_image(self.folder / image.name), image.name)
        camera = self.estimator.camera
        if gray.shape != (camera.height, camera.width):
            raise InvalidInputError("it has another size than its camera")
        return gray

    def speaks_against(self, images: Sequence[ColmapImage]) -> str | None:
        """What a few of the images say against the way they are held; of fewer than five nothing is asked."""
        if len(images) < _SETUP_IMAGES:
            return None
        grays = []
        for place in np.linspace(0, len(images) - 1, _SETUP_IMAGES).astype(int):
            try:
                grays.append(self.gray(images[place]))
            except (ImageFileError, InvalidInputError):
                continue
        mounting = self.estimator.robot_from_camera
        told = check_setup(grays, self.estimator.camera, mounting) if grays else None
        return (
            None if told is None or told else f"images of its camera speak against the side that is up: {told.reason}"
        )

    def look(self, image: ColmapImage) -> ImageGravity:
        """What an image tells."""
        try:
            estimate = self.estimator(self.gray(image))
        except ImageFileError:
            return ImageGravity(image, None, _UNREADABLE, is_unreadable=True)
        except InvalidInputError as error:
            return ImageGravity(image, None, str(error))
        if not estimate:
            return ImageGravity(image, None, f"no tilt: {estimate.report.stop}", estimate.confidence)
        if estimate.confidence < self.confidence_min:
            return ImageGravity(image, None, f"a confidence below {self.confidence_min:g}", estimate.confidence)
        gravity = gravity_from(estimate, self.estimator.robot_from_camera)
        return ImageGravity(image, gravity, estimate.reason, estimate.confidence)


def _up_of(path: Path) -> str:
    """A direction of the camera frame, or why there is none."""
    try:
        tag = file_orientation(path)
    except (OSError, ValueError):
        return _UNREADABLE
    return _UP_OF_TAG.get(tag, f"its orientation tag {tag} is that of a mirrored image")


def _check_database(path: Path) -> None:
    """Refuses what is no database of COLMAP's, into which opening it would write tables."""
    if not path.is_file():
        raise InvalidInputError(f"{path}: no such file, expected a database of COLMAP")
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as opened:
            tables = {name for (name,) in opened.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    except sqlite3.Error as error:
        raise InvalidInputError(f"{path}: {error}, expected a database of COLMAP") from None
    if not tables >= _TABLES:
        raise InvalidInputError(
            f"{path}: has no tables {', '.join(sorted(_TABLES - tables))}, expected those of COLMAP"
        )


def import_pycolmap(what: str) -> Any:
    """The package, for `what`. Raises `MissingExtraError` where it is missing or too old."""
    try:
        import pycolmap
    except ImportError as error:
        raise MissingExtraError.of(what, "colmap", error) from error
    if not hasattr(pycolmap.PosePrior, "gravity"):
        version = getattr(pycolmap, "__version__", "that is installed")
        raise MissingExtraError.of(what, "colmap", f"pycolmap {version}: its priors have no gravity")
    return pycolmap


def _spec(camera: Any, path: Path) -> CameraSpec | str:
    """A camera of the database, or why its images are of no use."""
    try:
        spec = spec_of(camera.camera_id, camera.model_name, camera.width, camera.height, camera.params, str(path))
    except CalibrationError as error:
        return str(error).removeprefix(f"{path}: ")
    if spec.model != "equirectangular" and not camera.has_prior_focal_length:
        return "the focal length of its camera is a guess of COLMAP's"
    return spec


def _key(data_id: Any) -> tuple[int, int, int]:
    return int(data_id.sensor_id.type), data_id.sensor_id.id, data_id.id


def _is_fine(prior: Any) -> bool:
    """Whether a prior has a gravity other than the six directions that COLMAP takes from orientation tags."""
    return prior is not None and bool(prior.has_gravity()) and int(np.count_nonzero(prior.gravity)) > 1
