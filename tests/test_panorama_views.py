"""Views of panoramas: what they show by the definition of camera, lean and sphere, pixel by pixel."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
import pytest

import tiltvp
from tiltvp._core import PixelRays, leaning_from_upright
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.panoramas import Panorama, PanoramaViews

QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@pytest.fixture(scope="module")
def lens() -> tiltvp.Camera:
    """A fisheye whose rim is inside its image, off the middle."""
    return tiltvp.Camera.equidistant(
        width=121, height=91, focal_px=26.0, cx=61.2, cy=44.0, max_theta_rad=math.radians(92.5)
    )


@pytest.fixture(scope="module")
def panorama(tmp_path_factory: pytest.TempPathFactory) -> Panorama:
    path = tmp_path_factory.mktemp("panorama") / "noise.png"
    noise = np.random.default_rng(3).integers(0, 256, (16, 32), dtype=np.uint8)
    tiltvp.write_image(path, cv2.resize(noise, (512, 256), interpolation=cv2.INTER_CUBIC))
    zenith = np.array([0.02, -0.05, 1.0]) / math.sqrt(1.0 + 0.02**2 + 0.05**2)
    return Panorama("noise", path, "nowhere", (float(zenith[0]), float(zenith[1]), float(zenith[2])))


def levels_by_definition(
    panorama: Panorama, camera: tiltvp.Camera, normal: np.ndarray, yaw_rad: float, mounting: np.ndarray, samples: int
) -> np.ndarray:
    """Each ray unprojected, turned, projected to the sphere, looked up in double precision; each pixel's mean."""
    image = tiltvp.read_image(panorama.path).astype(np.float64)
    height, width = image.shape
    places = (np.arange(samples) + 0.5) / samples - 0.5
    u = (np.arange(camera.width)[:, None] + places).ravel()
    v = (np.arange(camera.height)[:, None] + places).ravel()
    bearings = camera.unproject(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2))
    turn = np.array([[np.cos(yaw_rad), -np.sin(yaw_rad), 0], [np.sin(yaw_rad), np.cos(yaw_rad), 0], [0, 0, 1]])
    rotation = leaning_from_upright(panorama.zenith) @ turn @ leaning_from_upright(normal).T @ mounting
    x, y, z = (bearings @ rotation.T).T
    across = (np.arctan2(-y, x) / (2 * np.pi) + 0.5) * width - 0.5
    down = np.clip((0.5 - np.arctan2(z, np.hypot(x, y)) / np.pi) * height - 0.5, 0, height - 1)
    seen = ~np.isnan(across)
    left, top = np.floor(np.nan_to_num(across)).astype(int), np.floor(np.nan_to_num(down)).astype(int)
    s, t = np.nan_to_num(across) - left, np.nan_to_num(down) - top
    below = np.minimum(top + 1, height - 1)
    upper = (1 - s) * image[top, left % width] + s * image[top, (left + 1) % width]
    lower = (1 - s) * image[below, left % width] + s * image[below, (left + 1) % width]
    values = np.where(seen, (1 - t) * upper + t * lower, 0.0)
    return values.reshape(camera.height, samples, camera.width, samples).mean(axis=(1, 3))


@pytest.mark.parametrize(
    ("samples", "yaw_rad", "mounting"), [(1, 0.0, np.eye(3)), (2, 0.7, QUARTER), (3, -3.0, QUARTER)]
)
def test_views_are_what_the_camera_sees(
    panorama: Panorama, lens: tiltvp.Camera, samples: int, yaw_rad: float, mounting: np.ndarray
) -> None:
    normal = tiltvp.normal_from_alpha_beta(0.08, 2.0)
    views = PanoramaViews(panorama, lens, robot_from_camera=mounting, samples=samples)
    expected = levels_by_definition(panorama, lens, normal, yaw_rad, mounting, samples)
    levels = views.levels(normal, yaw_rad=yaw_rad)
    # OpenCV looks up whole grey levels at 32nds of a pixel.
    assert np.abs(levels - expected).max() <= 1.0
    assert np.abs(levels - expected).mean() < 0.3
    image = views.render(normal, yaw_rad=yaw_rad, noise_sigma=0.0)
    assert np.abs(image - levels).max() <= 0.5


def test_noise_and_threads(panorama: Panorama, lens: tiltvp.Camera) -> None:
    views = PanoramaViews(panorama, lens)
    normal = tiltvp.normal_from_alpha_beta(0.05, 1.0)
    with ThreadPoolExecutor(4) as pool:
        images = list(pool.map(lambda seed: views.render(normal, seed=seed), [1, 2, 1, 1, 2]))
    assert np.array_equal(images[0], images[2])
    assert np.array_equal(images[1], images[4])
    spread = images[0].astype(float) - images[1]
    middle = spread[40:50, 55:65]
    assert 1.5 < np.std(middle) < 4.5


def test_wrong_samples(lens: tiltvp.Camera) -> None:
    with pytest.raises(InvalidInputError, match=r"samples = 0, expected rays per pixel and side from 1 to 16"):
        PixelRays(lens, samples=0)
    rays = PixelRays(lens, samples=2)
    assert rays.samples == 2
    assert rays.panorama_map(np.eye(3), width=40, height=20).shape == (2, 4, len(rays.pixels))
    with pytest.raises(InvalidInputError, match="rotation"):
        rays.panorama_map(np.eye(2), width=40, height=20)


def test_a_photograph_is_no_panorama(lens: tiltvp.Camera, tmp_path: Path) -> None:
    tiltvp.write_image(tmp_path / "a.png", np.zeros((48, 64), np.uint8))
    with pytest.raises(InvalidInputError, match=r"a\.png: 64 x 48 pixels, expected a panorama, twice as wide as high"):
        PanoramaViews(Panorama("a", tmp_path / "a.png", "nowhere", None), lens)
