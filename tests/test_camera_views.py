"""Cameras made of a view, and parts of cameras."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tiltvp import Camera
from tiltvp.errors import InvalidInputError
from tiltvp.field_of_view import field_of_view
from tiltvp.formats import read_cameras, write_cameras


@pytest.mark.parametrize(
    ("lens", "law"),
    [
        ("equidistant", lambda theta: theta),
        ("equisolid", lambda theta: 2.0 * np.sin(theta / 2.0)),
        ("stereographic", lambda theta: 2.0 * np.tan(theta / 2.0)),
        ("pinhole", np.tan),
    ],
)
def test_a_camera_of_a_view(lens: str, law: Any) -> None:
    view = 1.4 if lens == "pinhole" else 3.4
    found = Camera.from_view(lens, width=640, height=480, view_rad=view, radius_px=230.0, centre_px=(310.0, 250.0))
    theta = np.linspace(0.0, 0.4999 * view, 50)
    bearings = np.column_stack([np.sin(theta), np.zeros(50), np.cos(theta)])
    radii = found.project(bearings)[:, 0] - 310.0
    np.testing.assert_allclose(radii, 230.0 * law(theta) / law(0.5 * view), atol=1e-4)
    assert np.isnan(found.project([np.sin(0.51 * view), 0.0, np.cos(0.51 * view)])).all()
    across = Camera.from_view(lens, width=640, height=480, view_rad=view)
    u, v = across.project([-np.sin(0.5 * view), 0.0, np.cos(0.5 * view)])
    np.testing.assert_allclose((u, v), (-0.5, 239.5), atol=1e-4)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"lens": "fisheye"}, "lens = 'fisheye'"),
        ({"view_rad": 0.0}, "view_rad: 0 degrees"),
        ({"view_rad": 7.0}, "view_rad: 401"),
        ({"view_rad": "2"}, "view_rad = '2'"),
        ({"radius_px": -1.0}, "radius_px = -1"),
        ({"radius_px": "3"}, "radius_px = '3'"),
        ({"centre_px": (1,)}, "centre_px = .1,."),
        ({"centre_px": 5}, "centre_px = 5"),
        ({"centre_px": "ab"}, "centre_px = 'a'"),
        ({"centre_px": (90, 20), "radius_px": 20}, "centre_px = .90, 20., radius_px = 20: no pixel is within"),
        ({"width": 0}, "width, height = .0, 48."),
        ({"height": 4.5}, "width, height = .64, 4.5."),
        ({"lens": "pinhole", "view_rad": 3.2}, "view_rad: 183"),
        ({"lens": "pinhole", "view_rad": 5e-324}, "view_rad: "),
        ({"lens": np.ones(2)}, "lens = "),
        ({"mirror": "no"}, "mirror = 'no'"),
    ],
)
def test_a_view_that_cannot_be(wrong: dict[str, Any], told: str) -> None:
    with pytest.raises(InvalidInputError, match=f"^{told}.*, expected"):
        Camera.from_view(**({"width": 64, "height": 48, "view_rad": 1.0} | wrong))


def test_a_part_of_an_image_sees_what_it_saw() -> None:
    whole = Camera.equidistant(width=640, height=480, focal_px=139.7, cx=319.5, cy=239.5, max_theta_rad=1.2)
    part = whole.cropped(100, 50, 300, 200)
    assert (part.width, part.height, part.max_theta_rad) == (300, 200, 1.2)
    pixels = np.array([[0.0, 0.0], [299.0, 199.0], [150.0, 120.0]])
    np.testing.assert_allclose(part.unproject(pixels), whole.unproject(pixels + [100.0, 50.0]), atol=1e-12)
    assert whole.mirrored().cropped(0, 0, 640, 480) == whole.mirrored()
    with pytest.raises(InvalidInputError, match="equirectangular"):
        Camera.equirectangular(width=64, height=32).cropped(0, 0, 32, 32)
    with pytest.raises(InvalidInputError, match="u = '80', expected a number"):
        whole.cropped("80", 0, 32, 32)  # type: ignore[arg-type]
    assert whole.cropped(0, 0, 100.0, 50.0) == whole.cropped(0, 0, 100, 50)  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match=r"width, height = \(100.5, 50\), expected .* whole numbers"):
        whole.cropped(0, 0, 100.5, 50)  # type: ignore[arg-type]


@pytest.mark.parametrize("factor", ["a", None, True, [2.0], 10**400])
def test_what_is_no_factor_is_said(factor: Any) -> None:
    with pytest.raises(InvalidInputError, match=r"factor = .*, expected a number"):
        Camera.equirectangular(width=64, height=32).scaled(factor)


def test_a_camera_in_a_mirror_is_told_by_true_or_false(tmp_path: Path) -> None:
    path, camera = tmp_path / "one.toml", Camera.pinhole(width=64, height=48, fx=30.0, fy=30.0, cx=31.5, cy=23.5)
    camera.save(path)
    assert Camera.load(path, mirror=np.True_) == camera.mirrored()
    for mirror in ("no", 1, None, np.ones(2)):
        with pytest.raises(InvalidInputError, match=r"mirror = .*, expected True or False"):
            Camera.load(path, mirror=mirror)  # type: ignore[arg-type]


def test_what_is_no_spec_is_neither_read_nor_written(tmp_path: Path) -> None:
    camera = Camera.equirectangular(width=64, height=32)
    write_cameras(camera.to_spec(), tmp_path / "one.toml")
    assert Camera.load(tmp_path / "one.toml") == camera
    for format in ("tiltvp", "kalibr"):
        for given, told in (
            (camera, "spec: Camera, expected CameraSpec"),
            ([camera], "spec: Camera, expected CameraSpec"),
            (camera.to_spec(None), "name = None, expected a text"),  # type: ignore[arg-type]
        ):
            with pytest.raises(InvalidInputError, match=told):
                write_cameras(given, tmp_path / "two.toml", format)  # type: ignore[arg-type]
    assert not (tmp_path / "two.toml").exists()
    with pytest.raises(InvalidInputError, match="spec: list, expected one CameraSpec"):
        Camera.from_spec(read_cameras(tmp_path / "one.toml"))  # type: ignore[arg-type]


def test_the_view_of_a_part_without_the_axis_is_that_of_its_rays() -> None:
    whole = Camera.pinhole(width=640, height=480, fx=300.0, fy=300.0, cx=319.5, cy=239.5)
    part = whole.cropped(0, 40, 200, 400)
    view = field_of_view(part)
    left, right, top, bottom = part.unproject([[0.0, 199.5], [199.0, 199.5], [99.5, 0.0], [99.5, 399.0]])
    assert view.horizontal_rad == pytest.approx(np.arccos(left @ right))
    assert view.vertical_rad == pytest.approx(np.arccos(top @ bottom))
    assert view.axis_px == pytest.approx((319.5, 199.5))
    assert view.valid_radius_px == pytest.approx(np.hypot(319.5, 199.5))
    corner = Camera.equidistant(width=640, height=480, focal_px=140.0, cx=319.5, cy=239.5).cropped(0, 0, 101, 101)
    assert field_of_view(corner).horizontal_rad < 0.72
    # Where the axis is in the image the view is that through it.
    assert field_of_view(whole).horizontal_rad == pytest.approx(2.0 * np.arctan(319.5 / 300.0))


@pytest.mark.parametrize("camera", [0.0, None, (0,)])
def test_a_place_in_a_file_is_a_name_or_a_number(camera: Any, tmp_path: Path) -> None:
    Camera.equirectangular(width=64, height=32).save(tmp_path / "one.toml")
    assert Camera.load(tmp_path / "one.toml", camera=np.int64(0)).width == 64
    with pytest.raises(InvalidInputError, match="expected a name or a whole number"):
        Camera.load(tmp_path / "one.toml", camera=camera)
