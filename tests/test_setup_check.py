"""Which of a camera's six directions is up, by images of rendered rooms and by edges that were drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tiltvp
from tiltvp.cli import main
from tiltvp.errors import InvalidInputError
from tiltvp.rotations import read_rotation
from tiltvp.setup_check import DIRECTIONS, opposite_direction, shares_of
from tiltvp.setup_features import ImageFeatures
from tiltvp.streams import Frames
from tiltvp.turning import check_turns

PINHOLE = tiltvp.Camera.pinhole(width=320, height=240, fx=190.0, fy=190.0, cx=159.5, cy=119.5)


def ahead(seed: int) -> np.ndarray:
    """A level camera before upright bars, at places and of levels drawn by the seed."""
    rng = np.random.default_rng(seed)
    image = np.full((240, 320), 90.0) + rng.normal(0.0, 2.0, (240, 320))
    for left in rng.choice(np.arange(10, 300, 12), 9, replace=False):
        image[rng.integers(10, 60) : rng.integers(170, 230), left : left + 6] += rng.uniform(40.0, 120.0)
    return np.asarray(np.clip(image, 0, 255), dtype=np.uint8)


IMAGES = [ahead(seed) for seed in range(5)]


def test_upright_bars_tell_that_the_camera_looks_ahead() -> None:
    found = tiltvp.check_setup(IMAGES, PINHOLE, read_rotation("forward"))
    assert found.given == "-y"
    assert found.best in ("-y", "+y")
    assert found
    assert found.images == 5
    assert sum(found.probabilities.values()) == pytest.approx(1.0)
    assert list(found.probabilities) == list(DIRECTIONS)


def test_a_quarter_turn_and_an_upward_mounting_are_not_believed() -> None:
    portrait = [np.ascontiguousarray(np.rot90(image)) for image in IMAGES]
    turned = tiltvp.Camera.pinhole(width=240, height=320, fx=190.0, fy=190.0, cx=119.5, cy=159.5)
    found = tiltvp.check_setup(portrait, turned, read_rotation("forward"))
    assert not found
    assert found.best in ("-x", "+x")
    assert "where the mounting says -y (it looks ahead, image upright" in found.reason
    upward = tiltvp.check_setup(IMAGES, PINHOLE)
    assert not upward
    assert upward.given == "+z"


def test_an_image_upside_down_tells_of_the_opposite_directions() -> None:
    features = ImageFeatures(PINHOLE)
    upright, turned = features(IMAGES[0]), features(np.ascontiguousarray(IMAGES[0][::-1, ::-1]))
    ahead_or_sideways = [opposite_direction(name) if name[1] != "z" else name for name in DIRECTIONS]
    assert upright == pytest.approx(turned[[list(DIRECTIONS).index(name) for name in ahead_or_sideways]], abs=0.005)
    assert np.abs(upright[0] - upright[1]).max() > 0.1


def test_images_of_one_place_do_not_make_sure() -> None:
    """Five tell as much as 24: they err together."""
    features = ImageFeatures(PINHOLE)
    seen = np.array([features(image) for image in IMAGES])
    one, five, many = (shares_of(np.repeat(seen[:1], count, axis=0)).max() for count in (1, 5, 24))
    assert one < five
    assert five == pytest.approx(many, abs=0.01)


@pytest.mark.parametrize("level", [0, 5, 128, 255])
def test_images_without_edges_do_not_speak_against_a_mounting(level: int) -> None:
    noise = np.random.default_rng(3).normal(level, 2.0, (5, 240, 320))
    for mounting, given in ((None, "+z"), (read_rotation("forward"), "-y")):
        found = tiltvp.check_setup(np.clip(noise, 0, 255).astype(np.uint8), PINHOLE, mounting)
        assert found
        assert found.best == found.given == given
        assert set(found.probabilities.values()) == {1.0 / 6.0}
        assert found.reason == "5 images without straight edges, which do not tell which direction is up"
    # Among others they make less sure.
    mixed = tiltvp.check_setup([*IMAGES, *np.zeros((5, 240, 320), np.uint8)], PINHOLE, read_rotation("forward"))
    assert max(mixed.probabilities.values()) < max(tiltvp.check_setup(IMAGES, PINHOLE).probabilities.values())


def test_what_it_cannot_look_at_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="images: none"):
        tiltvp.check_setup([], PINHOLE)
    for mounting, told in (
        (np.eye(2), r"shape \(2, 2\), expected 3 x 3 numbers"),
        (np.diag([1.0, 1.0, -1.0]), "a reflection"),
        (2.0 * np.eye(3), "no rotation"),
        (np.zeros((3, 3)), "no rotation"),
        (np.full((3, 3), np.nan), "not finite"),
        (1j * np.eye(3), "expected a list of numbers"),
        ([[1.0, 0.0], [0.0]], "expected a list of numbers"),
        ("forward", "'forward', expected a list of numbers"),
    ):
        for refused in (
            lambda mounting: tiltvp.check_setup(IMAGES, PINHOLE, mounting),
            lambda mounting: check_turns(IMAGES, np.zeros(5), PINHOLE, mounting),
            lambda mounting: tiltvp.mounting_tilt([], [], mounting),
            lambda mounting: tiltvp.level(IMAGES[0], tiltvp.TiltEstimator(PINHOLE), (0.1, 0.0), mounting),
        ):
            with pytest.raises(InvalidInputError, match=f"robot_from_camera: .*{told}"):
                refused(mounting)
    with pytest.raises(InvalidInputError, match="as the camera's images"):
        tiltvp.check_setup([IMAGES[0][:-1]], PINHOLE)


@pytest.mark.parametrize("camera", ["camera.toml", None, tiltvp.Robot(PINHOLE, np.eye(3))])
def test_what_is_no_camera_is_refused(camera: Any) -> None:
    for refused in (
        lambda: tiltvp.check_setup(IMAGES, camera),
        lambda: check_turns(IMAGES, np.zeros(5), camera, np.eye(3)),
        lambda: tiltvp.find_setup(Frames(), camera),
        lambda: tiltvp.body_mask(IMAGES, camera),
        lambda: tiltvp.surround_mask(IMAGES, camera),
        lambda: tiltvp.Leveller(camera),
        lambda: tiltvp.Unwrapper(camera),
    ):
        with pytest.raises(InvalidInputError, match=r"expected a tiltvp\.Camera"):
            refused()


def test_tilt_warns_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "images"
    for k, image in enumerate(IMAGES):
        tiltvp.write_image(folder / f"{k}.png", image)
    calibration = tmp_path / "camera.toml"
    PINHOLE.save(calibration)
    options = ["--camera", str(calibration), "--method", "segments"]
    assert main(["tilt", str(folder), *options, "--robot-from-camera", "forward"]) == 0
    assert "where the mounting says" not in capsys.readouterr().err
    assert main(["tilt", str(folder), *options]) == 0
    said = [line for line in capsys.readouterr().err.splitlines() if "where the mounting says +z" in line]
    assert len(said) == 1
