"""The robot's own body: found where the world moves, unknown where it does not, left out by the command line."""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import polars as pl
import pytest

import tiltvp
from tiltvp.cli import main
from tiltvp.lab.datasets.body import PaintedBody

SMALL = tiltvp.Camera.equidistant(width=320, height=240, focal_px=70.0, cx=159.5, cy=119.5)
LARGE = tiltvp.Camera.equidistant(width=960, height=720, focal_px=210.0, cx=479.5, cy=359.5)
COUNT = 12


def world(seed: int, camera: tiltvp.Camera = SMALL) -> np.ndarray:
    """Blocks of grey whose corners are elsewhere in each image, in light and noise of its own."""
    rng = np.random.default_rng(seed)
    side = camera.width // 16
    blocks = np.repeat(np.repeat(rng.uniform(20.0, 220.0, (14, 18)), side, axis=0), side, axis=1)
    down, right = rng.integers(0, side, 2)
    image = blocks[down : down + camera.height, right : right + camera.width] * rng.uniform(0.7, 1.1)
    return np.asarray(np.clip(image + rng.normal(0.0, 2.0, image.shape), 0, 255), dtype=np.uint8)


def lit(image: np.ndarray, seed: int) -> np.ndarray:
    """The same view in another light, with other noise."""
    rng = np.random.default_rng(seed)
    return np.asarray(
        np.clip(image * rng.uniform(0.8, 1.1) + rng.normal(0.0, 2.0, image.shape), 0, 255), dtype=np.uint8
    )


@pytest.mark.slow
@pytest.mark.parametrize("camera", [SMALL, LARGE], ids=["small", "large"])
@pytest.mark.parametrize("seed", range(3))
def test_the_body_is_found_and_the_world_is_left(camera: tiltvp.Camera, seed: int) -> None:
    body = PaintedBody(camera, seed)
    found = tiltvp.body_mask((body.paint(world(k, camera), k) for k in range(2 * COUNT)), camera)
    assert found
    assert found.images == 2 * COUNT
    assert found.mask is not None
    assert found.mask.shape == (camera.height, camera.width)
    outline = cv2.morphologyEx((body.cover > 0.5).astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) > 0
    assert np.mean(~found.mask[outline]) > 0.95
    reach = 12 * camera.width // 320 + 1
    far = cv2.dilate((body.cover > 0).astype(np.uint8), np.ones((reach, reach), np.uint8)) == 0
    assert np.mean(~found.mask[far]) < 0.005


def test_a_bar_is_found_that_is_darker_here_and_lighter_there() -> None:
    images = [world(seed) for seed in range(24)]
    for image in images:
        image[60:180, 150:160] = 115
    mask = tiltvp.body_mask(images, SMALL).mask
    assert mask is not None
    assert not mask[70:170, 149:161].all(axis=1).any()
    assert mask[:, :140].all()


def test_nothing_is_left_out_where_no_edge_stays() -> None:
    found = tiltvp.body_mask([world(seed) for seed in range(COUNT)], SMALL)
    assert not found
    assert found.mask is not None
    assert found.mask.all()
    assert "no edges stay in place" in found.reason


def test_what_is_alike_without_edges_is_left_in() -> None:
    v, u = np.indices((240, 320))
    ceiling = np.exp(-0.5 * (np.hypot(u - 160, v - 120) / 45.0) ** 4)
    images = [(world(seed) * (1.0 - ceiling) + 180.0 * ceiling).astype(np.uint8) for seed in range(COUNT)]
    mask = tiltvp.body_mask(images, SMALL).mask
    assert mask is not None
    assert mask.all()


@pytest.mark.parametrize("painted", [False, True], ids=["no body", "body"])
def test_it_is_not_known_where_the_robot_stands(painted: bool) -> None:
    body = PaintedBody(SMALL, 1)
    views = [body.paint(world(k), k) if painted else world(k) for k in range(COUNT)]
    still = [lit(views[0], k) for k in range(COUNT)]
    for images in (still, [views[0]] * COUNT, still[:6] + views[6:], still[:9] + views[9:]):
        found = tiltvp.body_mask(images, SMALL)
        assert found.mask is None
        assert not found
        assert "not from different places" in found.reason
    blank = tiltvp.body_mask([views[0] * 0] * COUNT, SMALL)
    assert blank.mask is None
    assert blank.reason == f"{COUNT} images without an edge"
    few = tiltvp.body_mask(views[:4], SMALL)
    assert few.mask is None
    assert few.reason == "4 images, expected at least 5 from different places"
    assert tiltvp.body_mask([], SMALL).images == 0


def test_only_what_is_looked_at_is_judged() -> None:
    images = [world(seed) for seed in range(COUNT)]
    for image in images:
        image[100:200, :60] = 5
    looked = np.ones((240, 320), dtype=bool)
    assert tiltvp.body_mask(images, SMALL, mask=looked)
    looked[90:210, :70] = False
    assert not tiltvp.body_mask(images, SMALL, mask=looked)


def test_images_are_not_kept() -> None:
    held: list[weakref.ref[np.ndarray]] = []

    def views() -> Iterator[np.ndarray]:
        for seed in range(8):
            image = world(seed)
            held.append(weakref.ref(image))
            assert sum(one() is not None for one in held) <= 2
            yield image

    assert tiltvp.body_mask(views(), SMALL).images == 8


def test_bad_input_is_named() -> None:
    images = [world(seed) for seed in range(COUNT)]
    with pytest.raises(tiltvp.errors.InvalidInputError, match=r"images\[1\]: shape \(239, 320\), expected"):
        tiltvp.body_mask([images[0], images[1][:-1]], SMALL)
    with pytest.raises(tiltvp.errors.InvalidInputError, match=r"mask: shape \(320, 240\) of bool, expected \(240"):
        tiltvp.body_mask(images, SMALL, mask=np.ones((320, 240), dtype=bool))
    for mask in (np.full((240, 320), np.nan), np.full((240, 320), 3, np.uint8), np.zeros((240, 320), dtype=bool)):
        with pytest.raises(tiltvp.errors.InvalidInputError, match=r"mask: .*, expected "):
            tiltvp.body_mask(images, SMALL, mask=mask)
    with pytest.raises(tiltvp.errors.InvalidInputError, match=r"images\[0\]"):
        tiltvp.body_mask([np.zeros(3)], SMALL)


@pytest.mark.slow
def test_tilt_says_that_it_leaves_the_body_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    body = PaintedBody(SMALL, 2)
    SMALL.save(tmp_path / "camera.toml")
    for k in range(COUNT):
        tiltvp.write_image(tmp_path / f"drive/{k:02d}.png", body.paint(world(k), k))
        tiltvp.write_image(tmp_path / f"still/{k:02d}.png", lit(world(0), k))
    tiltvp.write_image(tmp_path / "whole.png", np.full((240, 320), 255, np.uint8))

    def said(folder: str, *words: str) -> tuple[list[str], float]:
        table = tmp_path / "tilts.csv"
        command = ["tilt", str(tmp_path / folder), "--camera", str(tmp_path / "camera.toml"), "--out", str(table)]
        assert main([*command, "--overwrite", *words]) == 0
        told = [line for line in capsys.readouterr().err.splitlines() if "--mask" in line]
        return told, pl.read_csv(table)["edge_pixels"].mean()

    lines, edges = said("drive")
    assert len(lines) == 1
    assert "12 images: edges that stay in place cover" in lines[0]
    lines, all_edges = said("drive", "--mask", str(tmp_path / "whole.png"))
    assert lines == []
    assert edges < 0.95 * all_edges
    lines, _ = said("still")
    assert len(lines) == 1
    assert "do not tell" in lines[0]
