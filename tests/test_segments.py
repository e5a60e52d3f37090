"""Straight edges: those of rendered polygons of known place through every kind of lens, and what no image may do."""

from __future__ import annotations

import copy
import math
import pickle
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import tiltvp
from tiltvp.cli import main
from tiltvp.errors import InvalidInputError
from tiltvp.overlays.segments import draw_segments, segment_pixels
from tiltvp.rotations import rotation_from
from tiltvp.synth import Room, RoomImage, mirror_camera

FORWARD = rotation_from("forward", "the mounting")
CAMERAS = {
    "fisheye": tiltvp.Camera.equidistant(
        width=320, height=320, focal_px=94.0, cx=159.5, cy=159.5, max_theta_rad=math.radians(97)
    ),
    "mirror": mirror_camera(),
    "pinhole": tiltvp.Camera.pinhole(
        width=320, height=240, fx=220.0, fy=224.0, cx=161.0, cy=118.0, k1=-0.25, k2=0.06, p1=0.001
    ),
    "panorama": tiltvp.Camera.equirectangular(width=1024, height=512),
}
CENTRES = {
    "fisheye": [(0.0, 0.0, 1.0), (0.9, 0.3, 0.3), (0.9, -0.1, 0.02)],
    "mirror": [(0.8, 0.1, -0.2), (-0.7, 0.5, 0.1)],
    "pinhole": [(0.0, 0.0, 1.0), (0.2, -0.1, 1.0)],
    # The last two lie on the seam.
    "panorama": [(0.0, 0.0, 1.0), (0.9, 0.3, 0.1), (0.1, 0.2, -1.0), (0.0, -0.3, -1.0)],
}
CASES = [(name, centre) for name in CAMERAS for centre in range(len(CENTRES[name]))]


def sides(name: str, centre: int) -> np.ndarray:
    """(5, 3) normals of a pentagon's sides, inwards, in turn."""
    rng = np.random.default_rng(10 * centre + len(name))
    axis = np.array(CENTRES[name][centre])
    axis /= np.linalg.norm(axis)
    across = np.linalg.qr(np.column_stack([axis, rng.normal(size=(3, 2))]))[0][:, 1:]
    turns = 2.0 * math.pi * (np.arange(5) + rng.uniform(-0.2, 0.2, 5)) / 5
    radius = 0.25
    normals = math.sin(radius) * axis - math.cos(radius) * (across @ np.array([np.cos(turns), np.sin(turns)])).T
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def picture(
    camera: tiltvp.Camera, normals: np.ndarray, levels: tuple[float, float], seed: int, sigma: float = 2.0
) -> np.ndarray:
    """The polygon, of the second level on a ground of the first, with noise; 25 rays a pixel beside its sides."""
    v, u = np.mgrid[0 : camera.height, 0 : camera.width].reshape(2, -1).astype(float)

    def within(du: float, dv: float, chosen: np.ndarray) -> np.ndarray:
        bearings = np.nan_to_num(camera.unproject(np.column_stack([u[chosen] + du, v[chosen] + dv])))
        return np.asarray((bearings @ normals.T).min(axis=1))

    distance = within(0.0, 0.0, np.ones(len(u), bool))
    # Two pixels of the coarsest camera.
    near = np.abs(distance) < 0.025
    places = (np.arange(5) - 2.0) / 5.0
    share = (distance > 0.0).astype(float)
    share[near] = np.mean([within(du, dv, near) > 0.0 for dv in places for du in places], axis=0)
    grey = levels[0] + (levels[1] - levels[0]) * share + np.random.default_rng(seed).normal(0.0, sigma, len(u))
    return np.rint(grey).clip(0, 255).astype(np.uint8).reshape(camera.height, camera.width)


def corners_of(normals: np.ndarray) -> np.ndarray:
    """(5, 2, 3): the ends of each side."""
    corners = np.cross(normals, np.roll(normals, -1, axis=0))
    corners /= np.linalg.norm(corners, axis=1, keepdims=True)
    corners *= np.sign(np.sum(corners * normals.sum(axis=0), axis=1))[:, None]
    return np.stack([np.roll(corners, 1, axis=0), corners], axis=1)


def seen_sides(camera: tiltvp.Camera, normals: np.ndarray) -> np.ndarray:
    """Which sides lie inside the image, five pixels from what the lens does not see."""
    kernel = np.ones((11, 11), np.uint8)
    inside = cv2.erode(np.pad(camera.valid_mask().astype(np.uint8), 1), kernel)[1:-1, 1:-1]
    wraps = "equirectangular" in repr(camera)
    seen = []
    for first, last in corners_of(normals):
        t = np.linspace(0.0, 1.0, 60)[:, None]
        pixels = np.rint(camera.project((1 - t) * first + t * last))
        u, v = pixels.T
        within = np.isfinite(pixels).all(axis=1) & (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
        seen.append(wraps or (within.all() and inside[v.astype(int), u.astype(int)].all()))
    return np.array(seen)


@pytest.mark.slow
@pytest.mark.parametrize(("sigma", "levels"), [(2.0, (80.0, 180.0)), (12.0, (160.0, 90.0))])
@pytest.mark.parametrize(("name", "centre"), CASES)
def test_sides_are_found_as_well_as_they_say(name: str, centre: int, sigma: float, levels: tuple[float, float]) -> None:
    camera, all_normals = CAMERAS[name], sides(name, centre)
    due = seen_sides(camera, all_normals)
    assert due.sum() >= 2
    # Normals look to the brighter side.
    sign = np.sign(levels[1] - levels[0])
    normals, corners = sign * all_normals[due], corners_of(all_normals)[due]
    squares, aside_px, ends_px = [], [], []
    detector = tiltvp.SegmentDetector(camera)
    for seed in range(3):
        found = detector(picture(camera, all_normals, levels, seed, sigma))
        assert (np.diff(found.length_rad) <= 0.0).all()
        near = found.normal @ normals.T > math.cos(math.radians(2.0))
        # Each side is one edge, also across the seam; strong noise may part it.
        assert near.any(axis=0).all()
        assert sigma > 5.0 or near.sum(axis=0).tolist() == [1] * due.sum()
        for normal, ends, i in zip(normals, corners, near.argmax(axis=0), strict=True):
            px_per_rad = found.support[i] / found.length_rad[i]
            error = normal - found.normal[i]
            away = np.array([error @ found.middle[i], error @ np.cross(found.normal[i], found.middle[i])])
            squares.append(float((away**2 / found.variances_rad2[i]).sum()))
            aside_px.append(away[0] * px_per_rad)
            in_turn = ends if normal @ np.cross(*ends) > 0.0 else ends[::-1]
            ends_px += list(np.linalg.norm(found.ends[i] - in_turn, axis=1) * px_per_rad)
            assert found.contrast[i] > 10.0
            assert found.rms_px[i] < 0.6
    # Two degrees of freedom, and their quantile of 99.9 %. What moves whole edges of real lenses is not in here.
    assert np.mean(squares) < 2.0
    assert max(squares) < 13.8
    assert np.sqrt(np.mean(np.square(aside_px))) < (0.03 if sigma < 5.0 else 0.15)
    assert np.median(ends_px) < 1.5


@pytest.mark.slow
@pytest.mark.parametrize("name", CAMERAS)
def test_what_belongs_together(name: str) -> None:
    camera = CAMERAS[name]
    found = tiltvp.SegmentDetector(camera)(picture(camera, sides(name, 0), (60.0, 200.0), 5))
    assert len(found) == len(found.normal) >= 2
    for directions in (found.normal, found.middle, found.ends[:, 0], found.ends[:, 1]):
        assert np.linalg.norm(directions, axis=1) == pytest.approx(1.0, abs=1e-12)
    for on_circle in (found.middle, found.ends[:, 0], found.ends[:, 1]):
        assert np.abs(np.sum(found.normal * on_circle, axis=1)).max() < 1e-12
    # From the first end to the second is a positive turn about the normal.
    turn = np.sum(found.normal * np.cross(found.ends[:, 0], found.ends[:, 1]), axis=1)
    assert (turn > 0.0).all()
    assert np.arcsin(turn) == pytest.approx(found.length_rad, abs=1e-9)
    assert len(found.points_px) == found.support.sum()
    assert np.concatenate([found.pixels(i) for i in range(len(found))]) == pytest.approx(found.points_px)
    for index in (-1, len(found)):
        with pytest.raises(IndexError, match=f"index = {index}, expected at least 0 and less than {len(found)}"):
            found.pixels(index)
    for i in range(len(found)):
        along = np.cross(found.normal[i], found.middle[i])
        offset, slope = found.variances_rad2[i]
        expected = offset * np.outer(found.middle[i], found.middle[i]) + slope * np.outer(along, along)
        assert found.covariance[i] == pytest.approx(expected, abs=1e-15)
        bearings = camera.unproject(found.pixels(i))
        assert np.median(np.abs(bearings @ found.normal[i])) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("name", CAMERAS)
def test_negatives_have_opposite_normals(name: str) -> None:
    camera = CAMERAS[name]
    image = picture(camera, sides(name, 0), (60.0, 200.0), 6)
    detector = tiltvp.SegmentDetector(camera)
    plain, other = detector(image), detector(255 - image)
    # Ties of equal gradients, and their order, are broken the same way in both.
    cosines = plain.normal @ other.normal.T
    assert len(plain) == len(other)
    assert (cosines.min(axis=1) < -math.cos(5e-3)).all()


def test_empty_images_have_no_edges(camera: tiltvp.Camera) -> None:
    for level in (0, 128, 255):
        found = tiltvp.SegmentDetector(camera)(np.full((256, 256), level, np.uint8))
        assert len(found) == 0
        assert found.normal.shape == (0, 3)
        assert found.ends.shape == (0, 2, 3)
        assert found.covariance.shape == (0, 3, 3)
        assert found.points_px.shape == (0, 2)
        assert type(found).from_dict(found.to_dict()) == found


@pytest.mark.slow
def test_any_threads_and_strides_have_the_same_bytes(camera: tiltvp.Camera, images: list[np.ndarray]) -> None:
    detector = tiltvp.SegmentDetector(camera)
    expected = [detector(image) for image in images]
    assert any(len(found) > 20 for found in expected)
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(detector, images * 5)) == expected * 5
    for image, found in zip(images, expected, strict=True):
        assert tiltvp.SegmentDetector(camera)(np.asfortranarray(image)) == found
        assert detector(np.dstack([image] * 3)) == found


def test_masked_pixels_are_not_looked_at(camera: tiltvp.Camera, room: RoomImage) -> None:
    half = np.zeros((256, 256), bool)
    half[:, :128] = True
    detector = tiltvp.SegmentDetector(camera, mask=half)
    found = detector(room.gray)
    assert len(found)
    assert found.points_px[:, 0].max() < 128.5
    other = room.gray.copy()
    other[:, 132:] = 255 - other[:, 132:]
    assert detector(other) == found


SECOND: dict[str, Any] = {
    "gradient_min": 120.0,
    "smoothing_px": 1.5,
    "margin_px": 30.0,
    "mask": np.arange(256 * 256).reshape(256, 256) % 256 < 128,
    "gradient_start": 900.0,
    "stray_max_px": 0.2,
    "rms_max_px": 0.15,
    "support_min_px": 40,
    "gap_max": 0.0,
}


@pytest.mark.parametrize("option", SECOND)
def test_every_option_changes_something(camera: tiltvp.Camera, room: RoomImage, option: str) -> None:
    plain = tiltvp.SegmentDetector(camera)
    assert set(plain.options) == set(SECOND)
    changed = tiltvp.SegmentDetector(camera, **{option: SECOND[option]})
    assert changed != plain
    assert changed(room.gray) != plain(room.gray)
    again = pickle.loads(pickle.dumps(changed))
    assert again == changed == tiltvp.SegmentDetector(camera, **changed.options) == copy.deepcopy(changed)
    assert hash(again) == hash(changed)
    assert again(room.gray) == changed(room.gray)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"gradient_minimum": 3.0}, ["gradient_minimum", "did you mean gradient_min"]),
        ({"elevation_min_rad": 0.0}, ["elevation_min_rad"]),
        ({"gradient_min": 0.0}, ["gradient_min", "positive"]),
        ({"gradient_start": math.nan}, ["gradient_start = NaN"]),
        ({"stray_max_px": 0.0}, ["stray_max_px = 0", "0.05"]),
        ({"rms_max_px": -1.0}, ["rms_max_px"]),
        ({"support_min_px": 3}, ["support_min_px = 3", "from 4"]),
        ({"support_min_px": 12.5}, ["support_min_px"]),
        ({"gap_max": -0.1}, ["gap_max"]),
        ({"margin_px": 0.0}, ["margin_px = 0", "at least 1 pixel"]),
        ({"margin_px": 900.0}, ["pixel"]),
        ({"mask": np.ones((3, 3), bool)}, ["mask", "256 x 256"]),
        ({"mask": np.ones((256, 256), np.uint8)}, ["mask", "bool"]),
        ({"mask": np.zeros((256, 256), bool)}, ["mask"]),
    ],
)
def test_impossible_options_are_refused(camera: tiltvp.Camera, options: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(InvalidInputError) as refusal:
        tiltvp.SegmentDetector(camera, **options)
    for word in words:
        assert word in str(refusal.value)


def test_wrong_cameras_and_images_are_refused(camera: tiltvp.Camera) -> None:
    with pytest.raises(InvalidInputError, match=r"str, expected a tiltvp\.Camera"):
        tiltvp.SegmentDetector("camera.yaml")  # type: ignore[arg-type]
    detector = tiltvp.SegmentDetector(camera)
    with pytest.raises(InvalidInputError, match="255 x 256 pixels, expected 256 x 256"):
        detector(np.zeros((255, 256), np.uint8))
    with pytest.raises(InvalidInputError, match=r"image: shape \(3, 3\), expected \(256, 256\)"):
        draw_segments(np.zeros((3, 3), np.uint8), camera, detector(np.zeros((256, 256), np.uint8)))


@pytest.mark.parametrize("name", CAMERAS)
def test_arcs_are_drawn_where_the_edges_are(name: str) -> None:
    camera = CAMERAS[name]
    image = picture(camera, sides(name, len(CENTRES[name]) - 1), (60.0, 200.0), 7)
    found = tiltvp.SegmentDetector(camera)(image)
    for i, arc in enumerate(segment_pixels(camera, found)):
        places = found.pixels(i)
        known = arc[np.isfinite(arc).all(axis=1)]
        apart = np.linalg.norm(places[:, None] - known[None], axis=2).min(axis=1)
        assert np.median(apart) < max(3.0, len(places) / 10)
    drawn = draw_segments(image, camera, found)
    assert drawn.shape == (*image.shape, 3)
    coloured = np.ptp(drawn.astype(int), axis=2) > 40
    assert coloured.any()
    # Nothing is drawn across a panorama.
    assert coloured.sum() < 6 * len(found.points_px)


def test_the_command_writes_rows_and_pictures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    camera = CAMERAS["pinhole"]
    image = picture(camera, sides("pinhole", 0), (60.0, 200.0), 8)
    tiltvp.write_image(tmp_path / "view.png", np.dstack([image] * 3))
    camera.save(tmp_path / "camera.toml")
    out, overlay = tmp_path / "edges.csv", tmp_path / "drawn"
    arguments = ["segments", str(tmp_path / "view.png"), "--camera", str(tmp_path / "camera.toml")]
    assert main([*arguments, "--out", str(out), "--overlay", str(overlay)]) == 0
    assert "edges" in capsys.readouterr().out
    assert (overlay / "view.png").exists()
    found = tiltvp.SegmentDetector(camera)(image)
    rows = out.read_text().splitlines()
    assert len(rows) == 1 + len(found)
    assert rows[0].startswith("file,edge,normal_x")
    assert main([*arguments, "--support-min-px", "2"]) == 2
    assert "--support-min-px = 2, expected" in capsys.readouterr().err


# --- the method of the tilt ----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_rooms_have_their_lean(camera: tiltvp.Camera, render: Any) -> None:
    estimator = tiltvp.TiltEstimator(camera, method="segments")
    errors, squares = [], []
    for seed, kind in enumerate(("office", "corridor", "living-room", "l-shaped")):
        alpha, beta = 0.02 * (seed + 1), 1.3 * seed
        estimate = estimator(render(kind=kind, seed=40 + seed, alpha_rad=alpha, beta_rad=beta).gray)
        truth = tiltvp.normal_from_alpha_beta(alpha, beta)
        errors.append(math.degrees(tiltvp.tilt_error_rad(estimate.normal, truth)))
        away = (truth - estimate.normal)[:2]
        squares.append(float(away @ np.linalg.solve(estimate.covariance_rad2, away)))
        assert estimate.confidence > 0.9
        assert estimate.edge_pixels >= estimate.prefiltered_pixels >= estimate.inlier_pixels > 100
    # A quarter of what `refined` errs, at 256 x 256.
    assert max(errors) < 0.4
    assert np.mean(squares) < 4.0


def test_other_options_are_as_good_as_new(camera: tiltvp.Camera, room: RoomImage) -> None:
    start = tiltvp.TiltEstimator(camera, method="segments")
    for change in ({"scatter_rad": 0.05}, {"gradient_min": 90.0}, {"tilt_max_rad": 0.1}, {"margin_px": 5.0}):
        made, fresh = start.with_options(**change), tiltvp.TiltEstimator(camera, method="segments", **change)
        assert made == fresh
        assert made(room.gray) == fresh(room.gray)
        assert made(room.gray) != start(room.gray)


def test_it_takes_no_edge_pixels(camera: tiltvp.Camera, room: RoomImage) -> None:
    estimator = tiltvp.TiltEstimator(camera, method="segments")
    with pytest.raises(InvalidInputError, match="segments, expected a method of edge pixels"):
        estimator.detect(room.gray)
    with pytest.raises(InvalidInputError, match="segments, expected a method of edge pixels"):
        estimator.estimate_edges(tiltvp.TiltEstimator(camera).detect(room.gray))


def test_blank_images_have_no_lean(camera: tiltvp.Camera) -> None:
    estimate, edges = tiltvp.TiltEstimator(camera, method="segments").with_edges(np.full((256, 256), 77, np.uint8))
    assert not estimate
    assert estimate.confidence == 0.0
    assert np.isnan(estimate.normal).all()
    assert "too few" in estimate.reason
    assert len(edges) == 0


def test_the_first_alternative_is_the_tilt(camera: tiltvp.Camera, room: RoomImage) -> None:
    for mounting in (np.eye(3), FORWARD):
        estimate = tiltvp.TiltEstimator(camera, method="segments", robot_from_camera=mounting)(room.gray)
        assert len(estimate.alternatives) > 0
        assert not estimate or estimate.alternatives[0].normal == pytest.approx(estimate.normal, abs=1e-7)


def test_either_side_of_an_axis_may_be_up_only_where_any_lean_may_be(camera: tiltvp.Camera, room: RoomImage) -> None:
    """Edges are the same upside down, and what is light and which way they face tells little: nothing is sure."""
    for limit, both in ((math.pi, True), (2.0, True), (math.pi / 2, False)):
        options = {"method": "segments", "robot_from_camera": FORWARD, "tilt_max_rad": limit}
        for image in (room.gray, np.ascontiguousarray(room.gray[::-1, ::-1])):
            ups, _ = tiltvp.TiltEstimator(camera, **options)._hypotheses(image)
            assert bool((ups[:, 2] < -0.01).any()) == both
            assert (ups[:, 2] >= math.cos(limit) - 1e-12).all()
            if limit == math.pi:
                assert all((ups @ up < -0.999_999).any() for up in ups)


def test_a_panorama_upside_down_is_right_or_not_sure() -> None:
    camera = tiltvp.Camera.equirectangular(width=512, height=256)
    estimator = tiltvp.TiltEstimator(camera, method="segments", robot_from_camera=FORWARD, tilt_max_rad=math.pi)
    for seed in range(7, 11):
        image = Room("office", seed).render_panorama(pose=(2.0, 2.0, 0.4), height=256, samples=2).gray
        over = estimator(np.ascontiguousarray(image[::-1, ::-1]))
        assert over.confidence < 0.9 or over.normal[2] < 0.0
