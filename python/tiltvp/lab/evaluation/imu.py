"""The refined method against the inertial sensor of a panoramic camera: the one truth that does not come from edges."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import polars as pl

from tiltvp.cameras import Camera
from tiltvp.lab.datasets.panoramas import Panorama, PanoramaViews, read_index
from tiltvp.tilt import TiltEstimate, TiltEstimator

__all__ = ["InertialPanorama", "estimate_leaning", "read_inertial_index", "summarise_inertial"]

_TILT_MAX_RAD = float(np.deg2rad(25.0))
"""Hand-held panoramic cameras lean further than robots."""


class InertialPanorama:
    """A panorama as it was taken, with the pitch and roll of the camera's own sensor, in degrees."""

    def __init__(self, panorama: Panorama, pitch_deg: float, roll_deg: float) -> None:
        """The panorama's own zenith is not used."""
        self.panorama, self.pitch_deg, self.roll_deg = panorama, pitch_deg, roll_deg


def read_inertial_index(directory: str | os.PathLike[str]) -> list[InertialPanorama]:
    """The panoramas of a folder with an `INDEX.csv` of columns name, environment, imu_pitch_deg, imu_roll_deg."""

    def item(row: dict[str, str], folder: Path) -> InertialPanorama:
        panorama = Panorama(row["name"], folder / f"{row['name']}.jpg", row["environment"], None)
        return InertialPanorama(panorama, float(row["imu_pitch_deg"]), float(row["imu_roll_deg"]))

    return read_index(directory, ("name", "environment", "imu_pitch_deg", "imu_roll_deg"), item)


def estimate_leaning(
    panoramas: Iterable[InertialPanorama],
    camera: Camera,
    *,
    samples: int = 2,
    noise_sigma: float = 2.0,
    advance: Callable[[], None] = lambda: None,
) -> pl.DataFrame:
    """One row for each panorama, by `refined`: `against_sensor`."""
    estimator = TiltEstimator(camera, method="refined", tilt_max_rad=_TILT_MAX_RAD)
    rows = []
    for number, item in enumerate(panoramas):
        views = PanoramaViews(item.panorama, camera, samples=samples, upright=False)
        estimate = estimator(views.render((0.0, 0.0, 1.0), noise_sigma=noise_sigma, seed=number))
        rows.append(against_sensor(item, estimate))
        advance()
    return pl.DataFrame(rows)


def against_sensor(item: InertialPanorama, estimate: TiltEstimate) -> dict[str, object]:
    """How far to the front and left a method and the sensor see the vertical, in degrees.

    A camera that leans to the front sees it behind, at less than 0.
    """
    x, y, z = estimate.normal
    return {
        "name": item.panorama.name,
        "location": item.panorama.location,
        "forward": math.degrees(math.atan2(x, z)),
        "left": math.degrees(math.atan2(y, z)),
        "imu_forward": item.pitch_deg,
        "imu_left": item.roll_deg,
        "confidence": estimate.confidence,
    }


def summarise_inertial(table: pl.DataFrame) -> pl.DataFrame:
    """The differences in degrees without their median, the constant offset between lens and sensor; their standard
    deviations are about the mean, of all of them.
    """
    found = table.filter(pl.col("forward").is_finite())
    rows: list[dict[str, object]] = []
    for label, part in (
        ("all", found),
        ("lean below 5 degrees", found.filter((pl.col("imu_forward") ** 2 + pl.col("imu_left") ** 2).sqrt() < 5.0)),
    ):
        if part.is_empty():
            rows.append({"panoramas": label, "count": 0})
            continue
        differences = np.stack(
            [(part["forward"] - part["imu_forward"]).to_numpy(), (part["left"] - part["imu_left"]).to_numpy()], axis=1
        )
        offset = np.median(differences, axis=0)
        sd = differences.std(axis=0, ddof=1) if len(part) > 1 else np.full(2, np.nan)
        lengths = np.linalg.norm(differences - offset, axis=1)
        rows.append(
            {
                "panoramas": label,
                "count": len(part),
                "offset forward": float(offset[0]),
                "offset left": float(offset[1]),
                "sd forward": float(sd[0]),
                "sd left": float(sd[1]),
                "mean": float(lengths.mean()),
                "median": float(np.median(lengths)),
                "p95": float(np.percentile(lengths, 95)),
            }
        )
    return pl.DataFrame(rows, infer_schema_length=None)
