"""The dark surround of an image circle: found, left alone, and left out by the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tiltvp
from tiltvp.cli import main

WHOLE = tiltvp.Camera.equidistant(width=320, height=240, focal_px=70.0, cx=159.5, cy=119.5)


def view(seed: int, radius: float | None = 105.0) -> np.ndarray:
    """Blocks of grey as a room has them, in a circle about (163, 117) with a dark surround."""
    rng = np.random.default_rng(seed)
    image = np.repeat(np.repeat(rng.uniform(20.0, 220.0, (12, 16)), 20, axis=0), 20, axis=1)
    v, u = np.indices(image.shape)
    if radius is not None:
        image = np.where(np.hypot(u - 163.0, v - 117.0) <= radius, image, 6.0)
    return np.asarray(np.clip(image + rng.normal(0.0, 2.0, image.shape), 0, 255), dtype=np.uint8)


@pytest.mark.parametrize("focal_px", [70.0, 60.0])
def test_the_circle_is_found_and_what_lies_within_is_left(focal_px: float) -> None:
    """Also where the corners are farther out than the formula of the lens reaches, which tells nothing of the rim."""
    camera = tiltvp.Camera.equidistant(width=320, height=240, focal_px=focal_px, cx=159.5, cy=119.5)
    assert camera.valid_mask().all() == (focal_px == 70.0)
    mask = tiltvp.surround_mask([view(seed) for seed in range(5)], camera)
    assert mask is not None
    v, u = np.nonzero(mask)
    assert (u.min() + u.max()) / 2 == pytest.approx(163.0, abs=1.5)
    assert (v.min() + v.max()) / 2 == pytest.approx(117.0, abs=1.5)
    assert (u.max() - u.min()) / 2 == pytest.approx(0.97 * 105.0, abs=2.0)


def test_images_without_a_surround_and_cameras_that_know_their_rim_are_left_alone() -> None:
    assert tiltvp.surround_mask([view(seed, None) for seed in range(5)], WHOLE) is None
    known = tiltvp.Camera.equidistant(width=320, height=240, focal_px=70.0, cx=159.5, cy=119.5, max_theta_rad=1.5)
    assert tiltvp.surround_mask([view(seed) for seed in range(5)], known) is None
    assert tiltvp.surround_mask([], WHOLE) is None
    dark = np.zeros((240, 320), np.uint8)
    assert tiltvp.surround_mask([dark] * 5, WHOLE) is None
    band = np.where(np.arange(240)[:, None] > 120, view(0, None), 5).astype(np.uint8)
    assert tiltvp.surround_mask([band], WHOLE) is None


def test_tilt_says_that_it_leaves_it_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for seed in range(5):
        tiltvp.write_image(tmp_path / f"images/{seed}.png", view(seed))
    WHOLE.save(tmp_path / "camera.toml")
    assert main(["tilt", str(tmp_path / "images"), "--camera", str(tmp_path / "camera.toml")]) == 0
    assert "the images have a dark surround" in capsys.readouterr().err
