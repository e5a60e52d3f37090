"""Whether a calibration fits its images, by straight edges that are drawn through a fisheye."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tiltvp
from tiltvp.cli import main
from tiltvp.errors import InvalidInputError
from tiltvp.rotations import read_rotation

FOCAL = 139.7
CENTRE = (319.5, 239.5)
FORWARD = read_rotation("forward")


def fisheye(focal: float = FOCAL, du: float = 0.0, dv: float = 0.0) -> tiltvp.Camera:
    return tiltvp.Camera.equidistant(
        width=640, height=480, focal_px=focal, cx=CENTRE[0] + du, cy=CENTRE[1] + dv, max_theta_rad=225.6 / focal
    )


def seen_by(camera: tiltvp.Camera, seed: int) -> np.ndarray:
    """Dark half-planes whose borders are great circles, each over a sector of the view."""
    rng = np.random.default_rng(seed)
    v, u = np.mgrid[: camera.height, : camera.width].astype(np.float64)
    bearings = np.nan_to_num(camera.unproject(np.column_stack([u.ravel(), v.ravel()])))
    levels = np.full(len(bearings), 120.0)
    for _ in range(10):
        normal, middle = rng.normal(size=(2, 3))
        normal /= np.linalg.norm(normal)
        middle = np.cross(normal, middle)
        middle[2] = abs(middle[2])
        middle /= np.linalg.norm(middle)
        shown = np.clip(0.5 + FOCAL * (bearings @ normal), 0.0, 1.0)
        levels -= 60.0 * shown * ((bearings @ normal < 0.15) & (bearings @ middle > 0.8))
    levels[~bearings.any(axis=1)] = 0.0
    image = levels.reshape(camera.height, camera.width) + rng.normal(0.0, 2.0, (camera.height, camera.width))
    return np.asarray(np.clip(image, 0, 255), dtype=np.uint8)


IMAGES = [seen_by(fisheye(), seed) for seed in range(5)]


def test_the_lens_that_saw_the_images_is_believed() -> None:
    found = tiltvp.check_lens(IMAGES, fisheye())
    assert found
    assert found.told
    assert found.images == 5
    assert np.abs(found.centre_off_px).max() < 0.5
    assert found.scale == pytest.approx(1.0, abs=0.005)
    assert "as straight as by the calibration" in found.reason


@pytest.mark.parametrize("off", [(9.0, 0.0), (0.0, -9.0), (-6.0, 7.0)])
def test_a_centre_that_is_off_is_measured_with_its_sign(off: tuple[float, float]) -> None:
    found = tiltvp.check_lens(IMAGES, fisheye(du=off[0], dv=off[1]))
    assert not found
    assert found.scale_believable
    assert not found.centre_believable
    assert found.centre_off_px == pytest.approx((-off[0], -off[1]), abs=1.5)
    assert found.lean_off_rad == pytest.approx(np.hypot(*off) / FOCAL, rel=0.2)
    assert "leans err by" in found.reason


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_focal_length_that_is_off_is_measured(share: float) -> None:
    found = tiltvp.check_lens(IMAGES, fisheye(focal=FOCAL * share))
    assert not found
    assert not found.scale_believable
    assert found.scale == pytest.approx(1.0 / share, abs=0.03)
    assert "focal length" in found.reason


def test_a_pinhole_keeps_straight_what_is_straight_so_that_nothing_is_told() -> None:
    told = tiltvp.Camera.pinhole(width=640, height=480, fx=400.0, fy=400.0, cx=319.5, cy=239.5)
    images = [seen_by(told, seed) for seed in range(5)]
    other = tiltvp.Camera.pinhole(width=640, height=480, fx=440.0, fy=440.0, cx=335.0, cy=239.5)
    for camera in (told, other):
        found = tiltvp.check_lens(images, camera)
        assert found
        assert min(found.sigmas[:2]) > 10.0
        assert found.sigmas[2] > 0.1


def pinhole(focal: float) -> tiltvp.Camera:
    return tiltvp.Camera.pinhole(width=640, height=480, fx=focal, fy=focal, cx=319.5, cy=239.5)


@pytest.fixture(scope="module")
def ahead() -> list[np.ndarray]:
    """Views ahead in a rendered room, by a pinhole of 380 pixels a radian."""
    room, rng = tiltvp.synth.Room("office", seed=11406), np.random.default_rng(0)
    leans = {"alpha_rad": 0.1, "camera_height_m": 1.0, "robot_from_camera": FORWARD}
    return [
        room.render(pinhole(380.0), pose=pose, beta_rad=float(rng.uniform(-3.0, 3.0)), **leans).gray
        for pose in room.free_poses(12, seed=0)
    ]


@pytest.mark.parametrize("share", [0.9, 1.0, 1.1])
def test_right_angles_tell_the_focal_length_of_a_pinhole(ahead: list[np.ndarray], share: float) -> None:
    found = tiltvp.check_lens(ahead, pinhole(380.0 * share))
    assert found.scale_by_right_angles == pytest.approx(1.0 / share, abs=4.0 * found.sigma_by_right_angles)
    assert found.sigma_by_right_angles < 0.02
    assert bool(found) == found.scale_believable == (share == 1.0)
    assert ("at right angles" in found.reason) == (share != 1.0)


def test_a_few_images_and_bare_ones_tell_nothing() -> None:
    wrong = fisheye(du=9.0)
    for images in (IMAGES[:3], [np.full((480, 640), 90, np.uint8)] * 5):
        found = tiltvp.check_lens(images, wrong)
        assert found
        assert not found.told
        assert "too few to tell" in found.reason


@pytest.mark.parametrize("order", [1, -1])
def test_images_without_edges_are_not_counted(order: int) -> None:
    bare = np.full((480, 640), 90, np.uint8)
    one = tiltvp.check_lens([IMAGES[0], bare, bare, bare, bare][::order], fisheye(du=9.0))
    assert one
    assert not one.told
    assert one.images == 1
    assert one.sigmas == pytest.approx((64.0, 64.0, 0.3))
    assert "long straight edges of 1 image are too few" in one.reason
    four = tiltvp.check_lens([*IMAGES[:4], bare][::order], fisheye(du=9.0))
    assert not four
    assert four.images == 4
    assert four.sigmas[:2] == pytest.approx(tiltvp.check_lens(IMAGES[:4], fisheye(du=9.0)).sigmas[:2])


def test_what_it_cannot_look_at_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="images: none"):
        tiltvp.check_lens([], fisheye())
    with pytest.raises(InvalidInputError, match="as the camera's images"):
        tiltvp.check_lens([image[:-1] for image in IMAGES], fisheye())
    shape = IMAGES[0].shape
    for mask, told in (
        (np.ones((3, 3), dtype=bool), r"shape \(3, 3\) of bool"),
        (np.full(shape, 255, np.uint8), r"of uint8, expected \(\d+, \d+\) of bool"),
        (np.zeros(shape, dtype=bool), "False everywhere"),
    ):
        for check in (tiltvp.check_lens, tiltvp.check_setup):
            with pytest.raises(InvalidInputError, match=f"mask: .*{told}"):
                check(IMAGES, fisheye(), mask=mask)


def test_check_setup_and_tilt_warn_of_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wrong = fisheye(du=9.0)
    found = tiltvp.check_setup(IMAGES, wrong)
    assert not found
    assert found.lens.reason in found.reason
    for k, image in enumerate(IMAGES):
        tiltvp.write_image(tmp_path / "images" / f"{k}.png", image)
    wrong.save(tmp_path / "camera.toml")
    assert main(["tilt", str(tmp_path / "images"), "--camera", str(tmp_path / "camera.toml")]) == 0
    said = [line for line in capsys.readouterr().err.splitlines() if "bent, as by another lens" in line]
    assert len(said) == 1
