"""Cameras over arrays: constructors, shapes, strides, NaN rows, values, agreement with OpenCV, conformance."""

from __future__ import annotations

import copy
import math
import pickle
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import tiltvp
from tiltvp.errors import CalibrationError, InvalidInputError, TiltvpError

Camera = tiltvp.Camera
Array = np.ndarray

VGA = {"width": 640, "height": 480}
AFFINE = {"fx": 300.0, "fy": 301.0, "cx": 319.0, "cy": 240.5}
OCAM = [-150.0, 0.0, 1.5e-3, -1.0e-6, 4.0e-9]

CAMERAS: dict[str, Camera] = {
    "pinhole": Camera.pinhole(**VGA, **AFFINE),
    "pinhole-5": Camera.pinhole(**VGA, **AFFINE, k1=-0.28, k2=0.07, p1=1e-4, p2=-2e-4, k3=-0.01),
    "pinhole-8": Camera.pinhole(
        **VGA, **AFFINE, k1=0.1, k2=-0.05, p1=1e-4, p2=2e-4, k3=0.01, k4=0.12, k5=-0.03, k6=0.01
    ),
    "kannala_brandt": Camera.kannala_brandt(
        width=512, height=512, fx=190.978, fy=190.973, cx=254.93, cy=256.9, k1=3.48e-3, k2=7.15e-4, k3=-2.05e-3, k4=2e-4
    ),
    "ocam": Camera.ocam(**VGA, polynomial=OCAM, cx=321.0, cy=239.0, c=1.0002, d=1e-4, e=-2e-4),
    "unified": Camera.unified(**VGA, xi=1.7, fx=500.0, fy=500.5, cx=320.0, cy=241.0, k1=-0.05, k2=0.02, p1=1e-4),
    "extended_unified": Camera.extended_unified(**VGA, alpha=0.63, beta=1.04, fx=191.0, fy=191.1, cx=320.0, cy=240.0),
    "double_sphere": Camera.double_sphere(**VGA, xi=-0.2, alpha=0.59, fx=158.0, fy=158.3, cx=320.5, cy=240.5),
    "equidistant": Camera.equidistant(**VGA, focal_px=139.7, cx=319.5, cy=239.5, max_theta_rad=math.radians(92.5)),
    "equirectangular": Camera.equirectangular(width=600, height=300),
    "radial_polynomial": Camera.radial_polynomial(
        width=1280, height=966, k1=339.749, k2=-31.988, k3=48.275, k4=-7.201, cx=643.4, cy=479.4
    ),
    "mirror": Camera.ocam(**VGA, polynomial=OCAM, cx=321.0, cy=239.0, mirror=True),
}


def rays(largest_theta_deg: float, n: int = 400, seed: int = 1) -> Array:
    """Bearings at random within an angle of the axis, of any length."""
    rng = np.random.default_rng(seed)
    theta, phi = rng.uniform(0.0, math.radians(largest_theta_deg), n), rng.uniform(-math.pi, math.pi, n)
    unit = np.column_stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    return unit * rng.uniform(0.5, 2.0, (n, 1))


def matrix(camera: Camera) -> Array:
    p: dict[str, Any] = camera.parameters
    return np.array([[p["fx"], 0.0, p["cx"]], [0.0, p["fy"], p["cy"]], [0.0, 0.0, 1.0]])


# --- every model -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("key", CAMERAS)
def test_conformance(key: str) -> None:
    found = CAMERAS[key].conformance()
    assert found["pixels_tested"] > 500
    assert found["pixels_lost"] == 0
    assert found["max_round_trip_px"] <= 1e-6
    assert found["max_jacobian_error_relative"] <= 1e-6


@pytest.mark.parametrize("key", CAMERAS)
def test_pixels_and_bearings_are_inverse(key: str) -> None:
    camera = CAMERAS[key]
    columns, rows = np.meshgrid(np.arange(0, camera.width, 11), np.arange(0, camera.height, 11))
    pixels = np.column_stack([columns.ravel(), rows.ravel()])
    bearings = camera.unproject(pixels)
    seen = np.isfinite(bearings).all(axis=1)
    assert np.array_equal(seen, camera.valid_mask()[pixels[:, 1], pixels[:, 0]])
    assert seen.sum() > 500
    assert np.isnan(bearings[~seen]).all()
    assert np.linalg.norm(bearings[seen], axis=1) == pytest.approx(1.0, abs=1e-12)
    assert camera.project(bearings)[seen] == pytest.approx(pixels[seen], abs=1e-6)
    assert camera.project(7.5 * bearings)[seen] == pytest.approx(pixels[seen], abs=1e-6)


@pytest.mark.parametrize("key", CAMERAS)
def test_jacobians_are_those_of_the_maps(key: str) -> None:
    camera = CAMERAS[key]
    pixels = np.array([[0.43, 0.4], [0.6, 0.55], [0.37, 0.7]]) * [camera.width, camera.height]
    bearings, back = camera.unproject_jacobian(pixels)
    again, forward = camera.project_jacobian(bearings)
    assert (bearings.shape, back.shape, again.shape, forward.shape) == ((3, 3), (3, 3, 2), (3, 2), (3, 2, 3))
    assert bearings == pytest.approx(camera.unproject(pixels), abs=1e-14)
    assert forward @ back == pytest.approx(np.broadcast_to(np.eye(2), (3, 2, 2)), abs=1e-6)
    assert (forward @ bearings[:, :, None])[:, :, 0] == pytest.approx(0.0, abs=1e-6 * camera.width)
    for axis in range(2):
        step = np.zeros(2)
        step[axis] = 1e-4
        difference = (camera.unproject(pixels + step) - camera.unproject(pixels - step)) / 2e-4
        assert back[:, :, axis] == pytest.approx(difference, abs=1e-6)
    single = camera.unproject_jacobian(pixels[0])
    assert np.array_equal(single[0], bearings[0])
    assert np.array_equal(single[1], back[0])


@pytest.mark.parametrize("key", CAMERAS)
def test_a_mirror_negates_z(key: str) -> None:
    camera = CAMERAS[key]
    pixels = np.array([[0.4, 0.4], [0.6, 0.5]]) * [camera.width, camera.height]
    mirrored = camera.mirrored()
    assert mirrored.mirror != camera.mirror
    assert mirrored.mirrored() == camera
    assert mirrored.unproject(pixels) == pytest.approx(camera.unproject(pixels) * [1.0, 1.0, -1.0], abs=1e-15)


# --- arrays ------------------------------------------------------------------------------------------------------


def test_any_strides_and_dtypes() -> None:
    camera = CAMERAS["kannala_brandt"]
    pixels = np.array([[200, 210], [256, 250], [300, 180], [120, 400]])
    expected = camera.unproject(pixels)
    wide = np.zeros((8, 6), np.float64)
    wide[::2, ::3] = pixels
    for same in (
        pixels.astype(np.float32),
        pixels.astype(np.uint16),
        pixels.astype(np.int8) if pixels.max() < 128 else pixels.astype(np.int32),
        pixels.astype(np.float16),
        pixels.astype(">f8"),
        np.asfortranarray(pixels),
        wide[::2, ::3],
        np.ascontiguousarray(pixels[::-1])[::-1],
        pixels.tolist(),
        tuple(map(tuple, pixels)),
    ):
        assert np.array_equal(camera.unproject(same), expected)
    assert camera.unproject(expected[:, :2]).shape == (4, 3)
    assert camera.project(expected[1]).shape == (2,)
    assert camera.project(np.zeros((0, 3))).shape == (0, 2)
    assert camera.unproject(np.zeros((0, 2))).shape == (0, 3)
    assert camera.project_jacobian(np.zeros((0, 3)))[1].shape == (0, 2, 3)


@pytest.mark.parametrize(
    "wrong",
    [
        np.zeros((3, 3, 3)),
        np.zeros((3, 4)),
        np.zeros(()),
        np.zeros(5),
        [],
        "pixels",
        None,
        [[1.0, 2.0], [3.0]],
        np.zeros((4, 3), complex),
        np.zeros((4, 3), object),
        np.zeros((4, 3), bool),
        np.zeros((4, 3), "datetime64[s]"),
    ],
    ids=repr,
)
def test_wrong_arrays_are_refused(wrong: Any) -> None:
    camera = CAMERAS["equidistant"]
    for ask in (camera.project, camera.unproject, camera.project_jacobian, camera.unproject_jacobian):
        with pytest.raises(InvalidInputError, match=r"bearings|pixels"):
            ask(wrong)


@pytest.mark.parametrize("key", CAMERAS)
def test_rows_without_an_answer_are_nan(key: str) -> None:
    camera = CAMERAS[key]
    good = camera.unproject(np.array([0.45, 0.45]) * [camera.width, camera.height])
    odd = np.array([[0.0] * 3, [math.nan, 0.0, 1.0], [math.inf, 0.0, 1.0], [-math.inf] * 3, good])
    pixels = camera.project(odd)
    assert np.isnan(pixels[:4]).all()
    assert np.isfinite(pixels[4]).all()
    bearings = camera.unproject([[math.nan, 1.0], [math.inf, 3.0], [1e300, -1e300]])
    assert np.isnan(bearings[:2]).all()
    assert np.isnan(camera.project_jacobian(odd)[1][:4]).all()


def test_arguments_are_not_altered_and_results_are_fresh() -> None:
    camera = CAMERAS["unified"]
    pixels = np.array([[200.0, 210.0], [256.0, 250.0]])
    pixels.flags.writeable = False
    bearings = camera.unproject(pixels)
    assert bearings.flags.writeable
    kept = bearings.copy()
    camera.project(bearings)[:] = 0.0
    assert np.array_equal(bearings, kept)
    camera.valid_mask()[:] = False
    assert camera.valid_mask().any()
    camera.parameters["xi"] = 9.0
    assert camera.parameters["xi"] == 1.7


# --- values ------------------------------------------------------------------------------------------------------


class Named(Camera):
    """A camera of a user's own class."""


@pytest.mark.parametrize("key", CAMERAS)
def test_values_survive_copy_pickle_dict_and_file(key: str, tmp_path: Path) -> None:
    camera = CAMERAS[key]
    camera.save(tmp_path / "camera.toml")
    twins = [
        copy.copy(camera),
        copy.deepcopy(camera),
        pickle.loads(pickle.dumps(camera)),
        Camera.from_dict(camera.to_dict()),
        Camera.from_spec(camera.to_spec()),
        Camera.load(tmp_path / "camera.toml"),
        eval(repr(camera), {"Camera": Camera}),
    ]
    for twin in twins:
        assert twin == camera
        assert hash(twin) == hash(camera)
        assert type(twin) is Camera
        assert twin.parameters == camera.parameters
        assert (twin.max_theta_rad, twin.mirror) == (camera.max_theta_rad, camera.mirror)
    assert camera != camera.mirrored()
    assert camera != "camera"
    with pytest.raises(InvalidInputError, match=r"'\.yaml', expected \.toml"):
        camera.save(tmp_path / "camera.yaml")
    with pytest.raises(AttributeError):
        camera.width = 3  # type: ignore[misc]


def test_a_subclass_stays_one(tmp_path: Path) -> None:
    named = Named.equidistant(width=100, height=80, focal_px=30.0, cx=50.0, cy=40.0)
    named.save(tmp_path / "camera.toml")
    for twin in (
        named.mirrored(),
        Named.load(tmp_path / "camera.toml"),
        copy.copy(named),
        Named.from_dict(named.to_dict()),
    ):
        assert type(twin) is Named
    assert named == Camera.equidistant(width=100, height=80, focal_px=30.0, cx=50.0, cy=40.0)
    assert tiltvp.TiltEstimator(named).camera is named


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Camera("fisheye", width=640, height=480), ["fisheye", "equidistant"]),
        (lambda: Camera("equidistant", width=640, height=480, focal=3.0), ["focal", "focal_px"]),
        (lambda: Camera("equidistant", width=640, height=480), ["focal_px"]),
        (lambda: Camera("equidistant", **VGA, focal_px=[1.0, 2.0], cx=1.0, cy=1.0), ["focal_px"]),
        (lambda: Camera("equidistant", **VGA, focal_px="long", cx=1.0, cy=1.0), ["focal_px"]),
        (lambda: Camera.equidistant(**VGA, focal_px=0.0, cx=1.0, cy=1.0), ["focal_px"]),
        (lambda: Camera.equidistant(**VGA, focal_px=math.nan, cx=1.0, cy=1.0), ["focal_px"]),
        (lambda: Camera.equidistant(**VGA, focal_px=9.0, cx=math.inf, cy=1.0), ["cx"]),
        (lambda: Camera.equidistant(width=0, height=480, focal_px=9.0, cx=1.0, cy=1.0), ["width"]),
        (lambda: Camera.equidistant(width=-3, height=480, focal_px=9.0, cx=1.0, cy=1.0), ["width"]),
        (lambda: Camera.equidistant(**VGA, focal_px=9.0, cx=1.0, cy=1.0, max_theta_rad=4.0), ["max_theta_rad"]),
        (lambda: Camera.pinhole(**VGA, fx=-1.0, fy=1.0, cx=0.0, cy=0.0), ["fx"]),
        (lambda: Camera.ocam(**VGA, polynomial=[], cx=0.0, cy=0.0), ["polynomial"]),
        (lambda: Camera.ocam(**VGA, polynomial=[[1.0]], cx=0.0, cy=0.0), ["polynomial"]),
        (lambda: Camera.from_dict({"model": "equidistant"}), ["width"]),
        (lambda: Camera.load("nowhere.yaml"), ["nowhere.yaml"]),
    ],
)
def test_impossible_cameras_are_refused(make: Any, words: list[str]) -> None:
    with pytest.raises(TiltvpError) as refusal:
        make()
    for word in words:
        assert word in str(refusal.value)


def test_cameras_of_a_file_are_picked_by_name_or_place(tmp_path: Path) -> None:
    from calibration_texts import SAMPLES

    path = tmp_path / "camchain.yaml"
    path.write_text(SAMPLES["kalibr"].text)
    assert Camera.load(path, camera=1) == Camera.load(path, camera="cam1", format="kalibr")
    for wrong in ("cam7", 2, -1):
        with pytest.raises(InvalidInputError, match=str(wrong)):
            Camera.load(path, camera=wrong)
    with pytest.raises(CalibrationError):
        Camera.load(path, format="basalt")


# --- against OpenCV ----------------------------------------------------------------------------------------------

FISHEYES = {
    "no distortion": [0.0, 0.0, 0.0, 0.0],
    "TUM-VI": [3.4823894e-3, 7.1503e-4, -2.0532e-3, 2.0294e-4],
    "T265": [-6.7624e-3, 4.7e-2, -4.5e-2, 8.375e-3],
    "turns back at its rim": [7.337e-2, 2.4e-2, 1.1e-2, -2.5e-2],
    "Insta360": [3.0349e-2, -5.1e-3, 2.2e-3, -3.56e-4],
}


def fisheye(k: list[float]) -> Camera:
    names = dict(zip(["k1", "k2", "k3", "k4"], k, strict=True))
    return Camera.kannala_brandt(width=848, height=800, fx=286.6, fy=286.9, cx=419.5, cy=401.2, **names)


@pytest.mark.parametrize("lens", FISHEYES)
def test_opencv_fisheye_agrees_within_80_degrees(lens: str) -> None:
    camera = fisheye(FISHEYES[lens])
    bearings = rays(min(80.0, math.degrees(camera.max_theta_rad) - 0.1))
    k = np.array(FISHEYES[lens])
    theirs, _ = cv2.fisheye.projectPoints(bearings[:, None], np.zeros(3), np.zeros(3), matrix(camera), k)
    ours = camera.project(bearings)
    assert np.isfinite(ours).all()
    assert ours == pytest.approx(theirs[:, 0], abs=1e-6)


@pytest.mark.parametrize("lens", [lens for lens in FISHEYES if "rim" not in lens])
def test_right_at_95_degrees_where_a_plane_at_z_1_has_no_point(lens: str) -> None:
    """r(theta) goes on past 90 degrees, on the side the ray comes from; a point (x / z, y / z) is on the other one."""
    camera, k = fisheye(FISHEYES[lens]), FISHEYES[lens]
    theta, phi = math.radians(95.0), np.linspace(-3.0, 3.0, 25)
    bearings = np.column_stack(
        [math.sin(theta) * np.cos(phi), math.sin(theta) * np.sin(phi), np.full(25, math.cos(theta))]
    )
    r = theta + sum(k[i] * theta ** (3 + 2 * i) for i in range(4))
    expected = np.column_stack([286.6 * r * np.cos(phi) + 419.5, 286.9 * r * np.sin(phi) + 401.2])
    assert camera.project(bearings) == pytest.approx(expected, abs=1e-9)
    assert camera.unproject(expected) == pytest.approx(bearings, abs=1e-9)
    assert camera.max_theta_rad >= theta


@pytest.mark.parametrize("key", ["pinhole", "pinhole-4", "pinhole-5", "pinhole-8"])
def test_opencv_pinhole_agrees(key: str) -> None:
    camera = CAMERAS.get(key) or Camera.pinhole(**VGA, **AFFINE, k1=-0.28, k2=0.07, p1=1e-4, p2=-2e-4)
    names = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]
    count = {"pinhole": 4, "pinhole-4": 4, "pinhole-5": 5, "pinhole-8": 8}[key]
    distortion = np.array([camera.parameters[name] for name in names[:count]])
    bearings = rays(40.0)
    theirs, _ = cv2.projectPoints(bearings[:, None], np.zeros(3), np.zeros(3), matrix(camera), distortion)
    assert camera.project(bearings) == pytest.approx(theirs[:, 0], abs=1e-6)


def omnidir_pixels(camera: Camera, bearings: Array) -> Array:
    """The formulas of OpenCV's omnidir module, for builds that come without it."""
    p: dict[str, Any] = camera.parameters
    unit = bearings / np.linalg.norm(bearings, axis=1)[:, None]
    x, y = unit[:, 0] / (unit[:, 2] + p["xi"]), unit[:, 1] / (unit[:, 2] + p["xi"])
    r2 = x * x + y * y
    radial = 1.0 + p["k1"] * r2 + p["k2"] * r2 * r2
    xd = x * radial + 2.0 * p["p1"] * x * y + p["p2"] * (r2 + 2.0 * x * x)
    yd = y * radial + p["p1"] * (r2 + 2.0 * y * y) + 2.0 * p["p2"] * x * y
    return np.column_stack([p["fx"] * xd + p["skew"] * yd + p["cx"], p["fy"] * yd + p["cy"]])


def test_opencv_omnidir_agrees() -> None:
    camera = Camera.unified(
        **VGA, xi=1.4, fx=420.0, fy=421.0, cx=320.0, cy=241.0, k1=-0.05, k2=0.02, p1=1e-4, p2=-3e-4, skew=0.7
    )
    bearings = rays(95.0)
    ours = camera.project(bearings)
    assert ours == pytest.approx(omnidir_pixels(camera, bearings), abs=1e-6)
    if hasattr(cv2, "omnidir"):
        k = matrix(camera)
        k[0, 1] = 0.7
        theirs, _ = cv2.omnidir.projectPoints(
            bearings[None], np.zeros(3), np.zeros(3), k, 1.4, np.array([[-0.05, 0.02, 1e-4, -3e-4]])
        )
        assert ours == pytest.approx(theirs.reshape(-1, 2), abs=1e-6)


def test_equirectangular_by_its_definition() -> None:
    camera = CAMERAS["equirectangular"]
    pixels = np.array([[0.0, 0.0], [299.5, 149.5], [599.0, 299.0], [449.5, 149.5], [100.25, 30.5]])
    longitude = ((pixels[:, 0] + 0.5) / 600.0 - 0.5) * 2.0 * math.pi
    latitude = (0.5 - (pixels[:, 1] + 0.5) / 300.0) * math.pi
    expected = np.column_stack(
        [np.cos(latitude) * np.sin(longitude), -np.sin(latitude), np.cos(latitude) * np.cos(longitude)]
    )
    assert camera.unproject(pixels) == pytest.approx(expected, abs=1e-12)
    assert camera.unproject([299.5, 149.5]) == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    assert camera.project(rays(180.0)).shape == (400, 2)
    assert np.isfinite(camera.project(rays(180.0))).all()


def test_ocam_by_its_definition() -> None:
    """row = c x + d y + cy, column = e x + y + cx, bearing (y, x, -f(rho))."""
    camera = CAMERAS["ocam"]
    pixels = np.array([[400.0, 100.0], [100.0, 300.0], [330.0, 250.0]])
    affine = np.array([[1.0002, 1e-4], [-2e-4, 1.0]])
    xy = np.linalg.solve(affine, (pixels[:, ::-1] - [239.0, 321.0]).T).T
    f = np.polynomial.polynomial.polyval(np.hypot(*xy.T), OCAM)
    expected = np.column_stack([xy[:, 1], xy[:, 0], -f])
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    assert camera.unproject(pixels) == pytest.approx(expected, abs=1e-12)


def test_max_theta_limits_the_lens() -> None:
    camera = CAMERAS["equidistant"]
    inside, outside = math.radians(92.4), math.radians(92.6)
    assert np.isfinite(camera.project([math.sin(inside), 0.0, math.cos(inside)])).all()
    assert np.isnan(camera.project([math.sin(outside), 0.0, math.cos(outside)])).all()
    assert np.isnan(camera.unproject([319.5 + 139.7 * outside, 239.5])).all()
