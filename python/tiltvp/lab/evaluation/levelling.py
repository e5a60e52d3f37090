"""Levelling measured: panoramas turned by known rotations, others with a sensor's word, and times beside OpenCV's."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np
import polars as pl

from tiltvp.cameras import Camera
from tiltvp.images import gray_from, read_image
from tiltvp.lab.datasets.ahead import FORWARD
from tiltvp.lab.datasets.panoramas import Panorama, PanoramaViews, paper_camera
from tiltvp.lab.evaluation.imu import InertialPanorama, against_sensor
from tiltvp.levelling import Leveller
from tiltvp.photos import BELIEVED_MIN, PHOTO_TILT_MAX_RAD, encode_like
from tiltvp.tilt import TiltEstimate, TiltEstimator, normal_from_alpha_beta, tilt_error_rad

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["lean_against_sensor", "photo_times", "remap_times", "summarise_turned", "turned_panoramas"]

_METHODS: Final = (("segments", 1024), ("segments", 2048), ("refined", 1024))
"""What is compared: a method, and the columns of the panorama that it is given."""
_LARGEST_DEG: Final = 30.0
_WIDTH: Final = 2048
_QUALITY: Final = 90
"""Of JPEG photographs: what cameras write."""
_RUNS: Final = 30
"""Of each way, in turns, of which the least time counts: others come from what else the machine does."""


def _panorama_camera(width: int) -> Camera:
    return Camera.equirectangular(width=width, height=width // 2)


def _estimator(method: str, width: int) -> TiltEstimator:
    """Of panoramas of that width that look ahead; refined starts upright, with a gate as wide as need be."""
    camera = _panorama_camera(width)
    if method == "segments":
        return TiltEstimator(camera, method=method, robot_from_camera=FORWARD, tilt_max_rad=PHOTO_TILT_MAX_RAD)
    return TiltEstimator(
        camera,
        method=method,
        robot_from_camera=FORWARD,
        elevation_min_rad=-math.pi / 4,
        tilt_max_rad=math.radians(_LARGEST_DEG + 5.0),
    )


def _seen(method: TiltEstimator, gray: NDArray[np.uint8]) -> TiltEstimate:
    size = method.camera.width, method.camera.height
    return method(gray if gray.shape == size[::-1] else cv2.resize(gray, size, interpolation=cv2.INTER_AREA))


def turned_panoramas(
    panoramas: Sequence[Panorama], *, seed: int = 0, advance: Callable[[], None] = lambda: None
) -> pl.DataFrame:
    """Each panorama with a heading and a lean of up to 30 degrees: one row for each method and size, in degrees.

    `error_deg` is what levelling by the estimate leaves of the lean, against the panorama's own zenith.
    """
    rng = np.random.default_rng(seed)
    estimators = [_estimator(*method) for method in _METHODS]
    rows = []
    for panorama in panoramas:
        alpha, beta, yaw = math.radians(rng.uniform(0.0, _LARGEST_DEG)), *rng.uniform(-math.pi, math.pi, 2)
        truth = normal_from_alpha_beta(alpha, beta)
        views = PanoramaViews(panorama, _panorama_camera(_WIDTH), robot_from_camera=FORWARD, samples=1)
        image = views.render(truth, yaw_rad=yaw, noise_sigma=0.0)
        for (method, width), one in zip(_METHODS, estimators, strict=True):
            begin = time.process_time()
            estimate = _seen(one, image)
            took = time.process_time() - begin
            rows.append(
                {
                    "name": panorama.name,
                    "location": panorama.location,
                    "method": f"{method}, {width} columns",
                    "lean_deg": math.degrees(alpha),
                    "error_deg": math.degrees(tilt_error_rad(estimate.normal, truth)) if estimate else math.nan,
                    "confidence": estimate.confidence,
                    "time_ms": 1e3 * took,
                }
            )
        advance()
    return pl.DataFrame(rows)


def summarise_turned(table: pl.DataFrame) -> pl.DataFrame:
    """Errors in degrees of those that are believed, from a confidence of 0.5 on, and how many they are."""
    rows = []
    for (method,), part in table.group_by(["method"], maintain_order=True):
        believed = part.filter(pl.col("error_deg").is_finite() & (pl.col("confidence") >= BELIEVED_MIN))
        errors = believed["error_deg"].to_numpy()
        rows.append(
            {
                "method": method,
                "count": len(part),
                "believed": len(believed),
                "median": float(np.median(errors)) if len(errors) else None,
                "p95": float(np.percentile(errors, 95)) if len(errors) else None,
                "largest": float(errors.max()) if len(errors) else None,
                "above 5": int((errors > 5.0).sum()),
                "ms": float(np.median(part["time_ms"].to_numpy())),
            }
        )
    return pl.DataFrame(rows, infer_schema_length=None)


def lean_against_sensor(
    panoramas: Iterable[InertialPanorama], *, advance: Callable[[], None] = lambda: None
) -> pl.DataFrame:
    """One row for each panorama as it was taken, for `summarise_inertial`: by segments in 1,024 columns."""
    one = _estimator("segments", 1024)
    rows = []
    for item in panoramas:
        estimate = _seen(one, gray_from(read_image(item.panorama.path)))
        rows.append(against_sensor(item, estimate))
        advance()
    return pl.DataFrame(rows)


def remap_times(*, seed: int = 0, advance: Callable[[], None] = lambda: None) -> pl.DataFrame:
    """Milliseconds of the processor for a level image by a new tilt, beside `cv2.remap` with ready maps, on one thread.

    Floating maps and those that `cv2.convertMaps` makes of them are both tried; the ratio is to the faster way.
    """
    rng = np.random.default_rng(seed)
    polynomial = (-170.0, 0.0, 1.9e-3, -2.5e-6, 1.1e-8)
    ocam = Camera.ocam(width=640, height=480, polynomial=polynomial, cx=319.5, cy=239.5)
    cases: list[tuple[str, Camera, NDArray[np.float64] | None]] = [
        ("fisheye, 640 x 480", paper_camera(), None),
        ("OCam, 640 x 480", ocam, None),
        ("panorama, 2048 x 1024", _panorama_camera(_WIDTH), FORWARD),
    ]
    rows = []
    with _one_thread():
        for name, camera, mounting in cases:
            leveller = Leveller(camera, mounting)
            for channels in (1, 3):
                shape = (camera.height, camera.width, channels)[: 2 if channels == 1 else 3]
                image = rng.integers(0, 256, shape, dtype=np.uint8)
                rows.append({"image": name, "channels": channels} | _times(leveller, image))
                advance()
    return pl.DataFrame(rows)


@contextmanager
def _one_thread() -> Iterator[None]:
    """OpenCV on one thread, as the extension is."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)


def photo_times(panoramas: Sequence[Panorama], *, advance: Callable[[], None] = lambda: None) -> pl.DataFrame:
    """Milliseconds of the processor for a 360-degree photograph in colour of 2048 x 1024, from JPEG to JPEG.

    The median of the photographs for each step, and for all steps together; tables of the camera are ready.
    """
    camera = _panorama_camera(_WIDTH)
    estimator, leveller = _estimator("segments", 1024), Leveller(camera, FORWARD)
    rows = []
    with _one_thread():
        for panorama in panoramas:
            image = cv2.resize(read_image(panorama.path), (_WIDTH, _WIDTH // 2), interpolation=cv2.INTER_AREA)
            photo = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1].tobytes()
            clock = [time.process_time()]
            read = cv2.imdecode(np.frombuffer(photo, np.uint8), cv2.IMREAD_COLOR)
            clock.append(time.process_time())
            estimate = _seen(estimator, gray_from(np.asarray(read, dtype=np.uint8)))
            clock.append(time.process_time())
            level = leveller(np.asarray(read, dtype=np.uint8), estimate if estimate else (0.1, 0.5))
            clock.append(time.process_time())
            encode_like(level, photo)
            clock.append(time.process_time())
            rows.append([*np.diff(clock), clock[-1] - clock[0]])
            advance()
    steps = ("read", "tilt", "level image", "write", "in all")
    medians = 1e3 * np.median(np.array(rows), axis=0)
    return pl.DataFrame({"step": steps, "ms": medians})


def _times(leveller: Leveller, image: NDArray[np.uint8]) -> dict[str, float]:
    places = np.nan_to_num(leveller.map((0.1, 0.5)), nan=-1e6)
    across, down = np.ascontiguousarray(places[:, :, 0]), np.ascontiguousarray(places[:, :, 1])
    fixed = cv2.convertMaps(across, down, cv2.CV_16SC2)
    best = {"leveller": math.inf, "floating maps": math.inf, "fixed maps": math.inf}
    for run in range(_RUNS):
        tilt = (0.1 + 1e-3 * run, 0.5 + 0.1 * run)
        ways: dict[str, Callable[[], object]] = {
            "leveller": lambda tilt=tilt: leveller(image, tilt),  # type: ignore[misc]
            "floating maps": lambda: cv2.remap(image, across, down, cv2.INTER_LINEAR),
            "fixed maps": lambda: cv2.remap(image, *fixed, cv2.INTER_LINEAR),
        }
        for way, work in ways.items():
            begin = time.process_time()
            work()
            best[way] = min(best[way], 1e3 * (time.process_time() - begin))
    ratio = best["leveller"] / min(best["floating maps"], best["fixed maps"])
    return {f"{way}, ms": took for way, took in best.items()} | {"ratio": ratio}
