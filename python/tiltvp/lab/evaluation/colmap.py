"""COLMAP on views of rendered rooms: how far gravity is off in its reconstructions, without priors and with them."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import polars as pl

from tiltvp.cameras import Camera
from tiltvp.colmap import ColmapDatabase, ImageGravity, image_gravities, import_pycolmap
from tiltvp.formats import write_cameras
from tiltvp.images import write_image
from tiltvp.lab.datasets.ahead import FORWARD
from tiltvp.photos import PHOTO_TILT_MAX_RAD
from tiltvp.synth import Room
from tiltvp.tilt import TiltEstimator, normal_from_alpha_beta

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Truth = dict[str, NDArray[np.float64]]

__all__ = ["reconstruct_room"]

LEAN_MAX_DEG: Final = 20.0
"""A camera in a hand."""
_WALK_M: Final = 0.5
"""Views are from places within so much of one, a full turn of headings: enough is seen of each by its neighbours."""
_HEIGHT_M: Final = (1.1, 1.5)
_SEED: Final = 0
"""Of whatever COLMAP draws. By default it draws matches anew in every run, and its threads add in any order: sums that
differ by rounding end in other reconstructions. With the seed and one thread the same views give the same numbers."""


def reconstruct_room(
    kind: str, seed: int, folder: Path, *, views: int = 24, confidence_min: float, advance: Callable[[], None]
) -> pl.DataFrame:
    """One row for each way to a reconstruction of one room, by views at drawn places and leans: errors in degrees.

    An image's gravity by a reconstruction is the direction that is (0, 1, 0) in its world, COLMAP's down. `advance` is
    called per view and way. The new `folder` keeps images and database. Raises `MissingExtraError` without pycolmap.
    """
    pycolmap = import_pycolmap("a reconstruction by COLMAP")
    pycolmap.logging.minloglevel = pycolmap.logging.ERROR.value
    pycolmap.set_random_seed(_SEED)
    camera = Camera.pinhole(width=640, height=480, fx=320.0, fy=320.0, cx=319.5, cy=239.5)
    truth = _render(camera, kind, seed, folder / "images", views, advance)
    database = folder / "database.db"
    _match(pycolmap, camera, database, folder)
    rows = []

    def add(way: str, models: dict[int, Any]) -> None:
        model = max(models.values(), key=lambda one: one.num_reg_images(), default=None)
        rows.append({"room": f"{kind} {seed}", "way": way, "views": views} | _errors(model, truth))
        advance()

    options = pycolmap.IncrementalPipelineOptions(random_seed=_SEED, num_threads=1)
    add("incremental", pycolmap.incremental_mapping(database, folder / "images", _new(folder / "incremental"), options))
    add("global", _global(pycolmap, database, folder, "global", use_gravity=False))
    found = _write_priors(database, folder, confidence_min)
    add("global, with priors", _global(pycolmap, database, folder, "priors", use_gravity=True))
    errors = [_angle_deg(one.gravity, truth[one.image.name]) for one in found if one.gravity is not None]
    rows.append({"room": f"{kind} {seed}", "way": "the priors themselves", "views": views} | _summary(errors))
    return pl.DataFrame(rows)


def _render(camera: Camera, kind: str, seed: int, folder: Path, views: int, advance: Callable[[], None]) -> Truth:
    """Writes the views; gravity in the camera frame of each by its name."""
    room, rng = Room(kind, seed), np.random.default_rng(seed)
    x, y, _ = room.free_poses(1, seed)[0]
    truth: Truth = {}
    while len(truth) < views:
        number = len(truth)
        pose = (*(np.array([x, y]) + rng.uniform(-_WALK_M, _WALK_M, 2)), 2.0 * math.pi * number / views)
        alpha, beta = math.radians(rng.uniform(0.0, LEAN_MAX_DEG)), rng.uniform(-math.pi, math.pi)
        view = room.render(
            camera, pose=pose, alpha_rad=alpha, beta_rad=beta, robot_from_camera=FORWARD,
            camera_height_m=rng.uniform(*_HEIGHT_M), samples=1, seed=number,
        )  # fmt: skip
        name = f"{number:03d}.png"
        write_image(folder / name, view.bgr)
        truth[name] = -np.asarray(normal_from_alpha_beta(alpha, beta)) @ FORWARD
        advance()
    return truth


def _match(pycolmap: Any, camera: Camera, database: Path, folder: Path) -> None:
    """Features and matches; the camera is that of the views."""
    cameras = folder / "cameras.txt"
    write_cameras([camera.to_spec()], cameras, "colmap")
    _, model, _, _, *numbers = cameras.read_text().splitlines()[-1].split()
    reader = pycolmap.ImageReaderOptions(camera_model=model, camera_params=",".join(numbers))
    pycolmap.extract_features(
        database, folder / "images", camera_mode=pycolmap.CameraMode.SINGLE, reader_options=reader,
        extraction_options=pycolmap.FeatureExtractionOptions(num_threads=1), device=pycolmap.Device.cpu,
    )  # fmt: skip
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = _SEED
    pycolmap.match_exhaustive(
        database, matching_options=pycolmap.FeatureMatchingOptions(num_threads=1), verification_options=verification,
        device=pycolmap.Device.cpu,
    )  # fmt: skip


def _write_priors(database: Path, folder: Path, confidence_min: float) -> list[ImageGravity]:
    def estimator_of(camera: Camera, mounting: NDArray[np.float64]) -> TiltEstimator:
        return TiltEstimator(camera, method="segments", robot_from_camera=mounting, tilt_max_rad=PHOTO_TILT_MAX_RAD)

    opened = ColmapDatabase(database)
    found = image_gravities(opened, folder / "images", estimator_of, confidence_min=confidence_min)
    opened.write(found)
    return found


def _global(pycolmap: Any, database: Path, folder: Path, name: str, *, use_gravity: bool) -> dict[int, Any]:
    options = pycolmap.GlobalPipelineOptions(random_seed=_SEED, num_threads=1)
    options.mapper.rotation_averaging.use_gravity = use_gravity
    options.mapper.bundle_adjustment.refine_focal_length = False
    return dict(pycolmap.global_mapping(database, folder / "images", _new(folder / name), options))


def _new(folder: Path) -> Path:
    folder.mkdir(parents=True)
    return folder


def _errors(model: Any, truth: Truth) -> dict[str, float | int]:
    """Of the images that have a pose."""
    if model is None:
        return _summary([])
    posed = [image for image in model.images.values() if image.has_pose]
    return _summary([_angle_deg(one.cam_from_world().rotation.matrix()[:, 1], truth[one.name]) for one in posed])


def _summary(errors: list[float]) -> dict[str, float | int]:
    if not errors:
        return {"images": 0, "median": math.nan, "largest": math.nan}
    return {"images": len(errors), "median": float(np.median(errors)), "largest": max(errors)}


def _angle_deg(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(a, b))), float(np.dot(a, b))))
