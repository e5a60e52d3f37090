"""The circle of a rim in one image: found to a fraction of a pixel, or not at all."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

import tiltvp
from tiltvp.cli import main


def view(centre: tuple[float, float], radius: float, shape: tuple[int, int] = (240, 320)) -> np.ndarray:
    """Blocks of grey within a circle, darker beyond, blurred as a lens does, with noise."""
    rng = np.random.default_rng(7)
    blocks = rng.uniform(60.0, 220.0, (12, 16)).astype(np.float32)
    image = cv2.resize(blocks, (shape[1], shape[0]), interpolation=cv2.INTER_NEAREST)
    v, u = np.indices(shape)
    image = np.where(np.hypot(u - centre[0], v - centre[1]) <= radius, image, 20.0)
    image = cv2.GaussianBlur(image, (0, 0), 1.0) + rng.normal(0.0, 2.0, shape)
    return np.asarray(np.clip(image, 0, 255), dtype=np.uint8)


@pytest.mark.parametrize(
    ("centre", "radius", "shape"),
    [
        ((163.0, 117.0), 105.0, (240, 320)),
        ((150.4, 128.7), 131.5, (240, 320)),
        ((642.3, 475.1), 420.0, (960, 1280)),
        ((120.0, 118.0), 60.0, (240, 240)),
    ],
)
def test_centre_and_radius(centre: tuple[float, float], radius: float, shape: tuple[int, int]) -> None:
    found = tiltvp.rim_circle(view(centre, radius, shape))
    assert found is not None
    # A pixel of the image in which larger ones are looked at.
    pixel = max(1.0, min(shape) / 480)
    assert found.centre_px == pytest.approx(centre, abs=0.4 * pixel)
    assert found.radius_px == pytest.approx(radius, abs=0.8 * pixel)
    assert 0.8 <= found.covered <= 1.0


@pytest.mark.slow
def test_of_an_image_without_a_rim_none_is_told() -> None:
    assert tiltvp.rim_circle(view((160.0, 120.0), 400.0)) is None
    assert tiltvp.rim_circle(np.full((240, 320), 90, np.uint8)) is None
    for seed, shape in [*((seed, (240, 320)) for seed in range(5)), (1, (480, 640)), (2, (480, 640)), (0, (720, 1280))]:
        noise = np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)
        assert tiltvp.rim_circle(noise) is None
    # Lighter beyond: a lamp shade, not a rim.
    assert tiltvp.rim_circle(255 - view((160.0, 120.0), 100.0)) is None


def test_what_is_no_image_is_refused() -> None:
    for wrong in (np.zeros((60, 300), np.uint8), np.zeros((0, 0)), np.full((100, 100), np.nan)):
        with pytest.raises(tiltvp.errors.InvalidInputError):
            tiltvp.rim_circle(wrong)


def test_the_command_names_images_without_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    seen, none = tmp_path / "seen.png", tmp_path / "none.png"
    tiltvp.write_image(seen, view((163.0, 117.0), 105.0))
    tiltvp.write_image(none, view((163.0, 117.0), 400.0))
    assert main(["camera", "rim", str(seen)]) == 0
    assert "seen.png" in capsys.readouterr().out
    assert main(["camera", "rim", str(seen), str(none), str(tmp_path / "missing.png")]) == 1
    told = capsys.readouterr().err
    assert "none.png: no circle" in told
    assert "missing.png" in told
    none.unlink()
    assert main(["camera", "rim", str(tmp_path)]) == 0
    assert "seen.png" in capsys.readouterr().out
    seen.unlink()
    assert main(["camera", "rim", str(tmp_path)]) == 2
    assert "a folder without images" in capsys.readouterr().err
