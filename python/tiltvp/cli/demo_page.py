"""The page of `tiltvp demo --page`: one file in which a visitor leans a robot and sees what its camera tells."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Callable
from importlib import resources
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp.cli.demo import FIELD_OF_VIEW_DEG
from tiltvp.cli.results import degrees
from tiltvp.photos import BELIEVED_MIN

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp import Camera, Leveller, TiltEstimate, TiltEstimator

    Image = NDArray[np.uint8]

__all__ = ["LEANS_DEG", "page"]

LEANS_DEG: Final = tuple(range(-16, 17, 4))
"""To the front and to the right. The corners, 23 degrees, are beyond what the estimator is asked to look for: there the
page shows what it looks like when it does not know."""
WRONG_DEG: Final = 2.0
"""An estimate that is further off is shown as wrong: three times what 95 % on real panoramas are (measured.md)."""
SIDE_PX: Final = 352
"""Of each picture: three of them and 81 leans make a page of a few megabytes, and a phone shows no more."""
_QUALITY: Final = 70
_PANORAMA_PX: Final = 800
"""Rows of the panorama that is rendered: more than two for each pixel of a picture."""
_FINER: Final = 2.0
_NOISE: Final = 2.0
"""Grey levels, as `render_room` adds."""
_METHOD: Final[dict[str, Any]] = {"method": "segments", "tilt_max_rad": math.radians(20.0)}
_TEMPLATE: Final = "demo_page.html"


def page(kind: str, seed: int, *, advance: Callable[[], None] = lambda: None) -> str:
    """The text of the page, with everything in it. `advance` is called for each of the leans."""
    from tiltvp import Leveller, TiltEstimator
    from tiltvp.synth import Room

    camera = _camera()
    estimator = TiltEstimator(camera, **_METHOD)
    leveller = Leveller(camera)
    room = Room(kind, seed)
    panorama = room.render_panorama(pose=room.free_poses(1, seed)[0], height=_PANORAMA_PX, samples=2, seed=seed).bgr
    rng = np.random.default_rng(seed)
    frames = []
    for front in LEANS_DEG:
        for right in LEANS_DEG:
            alpha, beta = math.radians(math.hypot(front, right)), math.atan2(-right, front)
            view = _view(panorama, camera, alpha, beta, rng)
            frames.append(_frame(view, (alpha, beta), estimator, leveller))
            advance()
    data = {"leans": list(LEANS_DEG), "frames": frames}
    template = resources.files("tiltvp.cli").joinpath(_TEMPLATE).read_text(encoding="utf-8")
    # Within a script nothing may look like the end of one.
    content = json.dumps(data, separators=(",", ":")).replace("</", "<\\/")
    return template.replace("@DATA@", content)


def _camera() -> Camera:
    from tiltvp import Camera

    middle, reach = (SIDE_PX - 1) / 2.0, math.radians(FIELD_OF_VIEW_DEG / 2.0)
    focal = (SIDE_PX / 2.0) / reach
    return Camera.equidistant(
        width=SIDE_PX, height=SIDE_PX, focal_px=focal, cx=middle, cy=middle, max_theta_rad=reach
    )  # fmt: skip


def _view(panorama: Image, camera: Camera, alpha_rad: float, beta_rad: float, rng: np.random.Generator) -> Image:
    """What the leaning camera sees of the room: a robot that leans about its camera sees the same panorama, turned."""
    import cv2

    from tiltvp import Camera, normal_from_alpha_beta
    from tiltvp.rotations import levelling, rotation_from

    fine = camera.scaled(_FINER)
    whole = Camera.equirectangular(width=panorama.shape[1], height=panorama.shape[0])
    v, u = np.mgrid[0 : fine.height, 0 : fine.width]
    bearings = fine.unproject(np.stack([u.ravel(), v.ravel()], axis=1).astype(np.float64))
    level = bearings @ levelling(normal_from_alpha_beta(alpha_rad, beta_rad)).T
    places = whole.project(level @ rotation_from("forward", "the mounting")).reshape(fine.height, fine.width, 2)
    across, down = (np.nan_to_num(places[:, :, k], nan=-10.0).astype(np.float32) for k in range(2))
    around = cv2.copyMakeBorder(panorama, 0, 0, 1, 1, cv2.BORDER_WRAP)
    seen = cv2.remap(around, across + 1.0, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    seen[~np.isfinite(places).all(axis=2)] = 0
    small = cv2.resize(seen, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    return np.clip(small + rng.normal(0.0, _NOISE, (*small.shape[:2], 1)), 0, 255).astype(np.uint8)


def _frame(
    view: Image, lean: tuple[float, float], estimator: TiltEstimator, leveller: Leveller
) -> dict[str, str | None]:
    """Pictures, numbers and verdict of one lean; an estimate that is not believed makes nothing level."""
    from tiltvp import normal_from_alpha_beta, tilt_error_rad
    from tiltvp.overlays.tilt import tilt_overlay

    estimate, edges = estimator.with_edges(view)
    pictures = {"seen": view, "edges": tilt_overlay(view, estimator, estimate, edges)}
    is_believed = bool(estimate) and estimate.confidence >= BELIEVED_MIN
    if is_believed:
        pictures["level"] = leveller(view, estimate)
    true = normal_from_alpha_beta(*lean)
    error = math.degrees(tilt_error_rad(estimate.normal, true)) if estimate else None
    return {
        **{name: _jpeg(picture) for name, picture in pictures.items()},
        "verdict": _verdict(is_believed, error),
        "true": _words(*lean),
        "found": _found(estimate),
        "error": None if error is None else f"{error:.2f}",
        "confidence": f"{estimate.confidence:.2f}",
    }


def _verdict(is_believed: bool, error_deg: float | None) -> str:
    if error_deg is None:
        return "none"
    if not is_believed:
        return "doubted"
    return "wrong" if error_deg > WRONG_DEG else "right"


def _found(estimate: TiltEstimate) -> str:
    return _words(estimate.alpha_rad, estimate.beta_rad) if estimate else estimate.reason


def _words(alpha_rad: float, beta_rad: float) -> str:
    if round(math.degrees(alpha_rad), 2) == 0.0:
        return "upright"
    return f"{degrees(alpha_rad)}° towards {degrees(beta_rad, 0)}°"


def _jpeg(picture: NDArray[np.uint8]) -> str:
    import cv2

    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return base64.b64encode(data.tobytes()).decode("ascii")
