"""Vertical lines from Python: true bearings in rooms, values that keep, matches, tracks, and refusals that say why."""

from __future__ import annotations

import copy
import json
import math
import pickle
from typing import Any

import numpy as np
import pytest

import tiltvp
from tiltvp import lines as tl
from tiltvp._core import option_fields
from tiltvp.errors import InvalidInputError
from tiltvp.overlays.lines import draw_lines, line_pixels
from tiltvp.rotations import read_rotation
from tiltvp.synth import Room, RoomImage


@pytest.fixture(scope="module")
def mirror() -> tiltvp.Camera:
    """A hyperbolic mirror that is seen from 30 degrees above the horizon down to the camera."""
    theta, xi = math.radians(120), 0.95
    focal = 232 * (math.cos(theta) + xi) / math.sin(theta)
    return tiltvp.Camera(
        "unified", width=640, height=480, fx=focal, fy=focal, cx=322.3, cy=237.1, xi=xi,
        max_theta_rad=math.radians(121), mirror=True,
    )  # fmt: skip


@pytest.fixture(scope="module")
def office() -> Room:
    return Room("office", 100)


def errors_deg(lines: tl.Lines, room: Room, pose: np.ndarray) -> np.ndarray:
    """(N,): how far each bearing is from that of the nearest vertical edge, visible or not."""
    offset = room.vertical_edges_m[:, 0, :2] - pose[:2]
    truth = np.arctan2(offset[:, 1], offset[:, 0]) - pose[2]
    turn = (lines.bearing_rad[:, None] - truth + np.pi) % (2 * np.pi) - np.pi
    return np.degrees(np.abs(turn).min(axis=1))


@pytest.mark.slow
@pytest.mark.parametrize("alpha_deg", [0.0, 5.0])
def test_bearings_in_rooms_are_true_to_a_tenth_of_a_degree(
    mirror: tiltvp.Camera, office: Room, alpha_deg: float
) -> None:
    extractor = tl.LineExtractor(mirror)
    errors, count = [], 0
    for k, pose in enumerate(office.free_poses(3, 4)):
        alpha, beta = math.radians(alpha_deg), 1.1 * k
        image = office.render(mirror, pose=pose, alpha_rad=alpha, beta_rad=beta, samples=2, seed=k)
        lines = extractor(image.gray, (alpha, beta))
        apart = errors_deg(lines, office, pose)
        count += len(lines)
        errors.append(apart[apart < 0.6])
    found = np.concatenate(errors)
    assert len(found) > 40
    assert len(found) > 0.8 * count
    assert np.sqrt((found**2).mean()) < 0.1


def test_lines_are_plain_frozen_values(room: RoomImage, camera: tiltvp.Camera) -> None:
    lines = tl.extract(room.gray, camera, (room.alpha_rad, room.beta_rad))
    n = len(lines)
    assert n > 3
    for name in ("bearing_rad", "sigma_rad", "support_px", "elevation_min_rad", "elevation_max_rad", "polarity"):
        assert getattr(lines, name).shape == (n,)
    assert np.all(np.diff(lines.bearing_rad) > 0)
    assert np.all(lines.sigma_rad > 0)
    assert np.all(lines.elevation_max_rad > lines.elevation_min_rad)
    assert lines.support_px.dtype == np.uint32
    again = tl.Lines.from_dict(json.loads(json.dumps(lines.to_dict())))
    assert again == lines == pickle.loads(pickle.dumps(lines)) == copy.deepcopy(lines)
    assert lines != tl.extract(room.gray, camera)
    with pytest.raises(InvalidInputError, match="different lengths"):
        tl.Lines.from_dict({**lines.to_dict(), "sigma_rad": []})
    assert str(n) in repr(lines)


def test_a_lean_is_told_by_any_two_or_three_numbers(room: RoomImage, camera: tiltvp.Camera) -> None:
    extractor = tl.LineExtractor(camera)
    told = extractor(room.gray, (0.05, 0.3))
    for lean in ([0.05, 0.3], np.array([0.05, 0.3]), tiltvp.normal_from_alpha_beta(0.05, 0.3)):
        assert extractor(room.gray, lean) == told
        assert extractor.lines_at(told.bearing_rad, lean) == extractor.lines_at(told.bearing_rad, (0.05, 0.3))
    assert extractor(room.gray) != told
    with pytest.raises(InvalidInputError, match="alpha = 4, expected radians"):
        extractor(room.gray, (4.0, 17.0))


def test_extractor_is_a_value_and_takes_any_usual_image(room: RoomImage, camera: tiltvp.Camera) -> None:
    extractor = tl.LineExtractor(camera, lines_max=7, descriptor_bins=16)
    assert extractor == pickle.loads(pickle.dumps(extractor)) != tl.LineExtractor(camera)
    assert hash(extractor) == hash(copy.copy(extractor))
    assert extractor.options["lines_max"] == 7
    tilt = tiltvp.TiltEstimator(camera)(room.gray)
    lines = extractor(room.bgr, tilt)
    assert 0 < len(lines) <= 7
    assert np.allclose(lines.normal, tilt.normal)
    assert extractor.describe(room.bgr, lines).shape == (len(lines), 96)
    sigma_rad = np.sqrt(np.linalg.eigvalsh(tilt.covariance_rad2)[-1])
    told = tl.LineExtractor(camera, lines_max=7, descriptor_bins=16, tilt_sigma_rad=sigma_rad)
    assert lines == told(room.bgr, tilt.normal) != extractor(room.bgr, tilt.normal)
    assert extractor.describe(room.gray, extractor(np.full_like(room.gray, 9))).shape == (0, 96)


OTHER_VALUES = [
    ("great-circle", {"gradient_min": 400.0}), ("great-circle", {"smoothing_px": 1.5}),
    ("great-circle", {"elevation_min_rad": 0.3}), ("great-circle", {"elevation_max_rad": 0.5}),
    ("great-circle", {"margin_px": 30.0}), ("great-circle", {"plane_max_rad": 0.5}),
    ("great-circle", {"separation_px": 20.0}), ("great-circle", {"length_min_rad": 0.5}),
    ("great-circle", {"support_min_px": 60}), ("great-circle", {"gap_max_rad": 0.3}),
    ("great-circle", {"run_min_px": 20}), ("great-circle", {"tilt_sigma_rad": 0.05}),
    ("great-circle", {"covered_min": 1.0}), ("great-circle", {"scatter_max_px": 0.1}),
    ("great-circle", {"lines_max": 2}), ("great-circle", {"descriptor_areas": 2}),
    ("great-circle", {"descriptor_kind": "profile"}),
    ("great-circle", {"descriptor_areas": 3, "descriptor_overlapping": True}), ("great-circle", {"descriptor_bins": 8}),
    ("great-circle", {"descriptor_clip": 0.3}), ("great-circle", {"descriptor_window": 1.0}),
    ("great-circle", {"descriptor_smoothing": 0.0}),
    ("great-circle", {"descriptor_normalisation": "whole"}), ("radial", {"radial_max_rad": 0.3}),
    ("radial", {"sectors": 300}), ("radial", {"length_min": 0.4}), ("radial", {"radius_min_px": 60.0}),
    ("radial", {"radius_max_px": 100.0}), ("radial", {"rim_radius_px": 100.0}), ("radial", {"center_search_px": 0.0}),
]  # fmt: skip


@pytest.mark.parametrize(("method", "change"), OTHER_VALUES)
def test_every_option_changes_something(
    room: RoomImage, camera: tiltvp.Camera, method: str, change: dict[str, object]
) -> None:
    base: dict[str, object] = {"length_min": 0.2} if method == "radial" else {}
    if "gap_max_rad" in change:
        # Gaps decide where little of a line may be uncovered.
        base["covered_min"] = 0.9

    def seen(**options: object) -> list[object]:
        extractor = tl.LineExtractor(camera, method=method, **{**base, **options})  # type: ignore[arg-type]
        lines = extractor(room.gray, None if method == "radial" else (room.alpha_rad, room.beta_rad))
        return [lines.to_dict(), extractor.describe(room.gray, lines).tolist()]

    assert seen(**change) != seen()


def test_every_option_is_listed_here() -> None:
    for method in tl.LINE_METHODS:
        shared = {name for _, change in OTHER_VALUES for name in change}
        names = {field["name"] for field in option_fields("LineExtractor", method)}
        assert names <= shared | {"method", "mask"}, "OTHER_VALUES needs another value of each option"


OTHER_MATCHING: dict[str, dict[str, object]] = {
    "match_descriptors": {"f1": 0.2, "f2": 0.2, "f3": 0.3, "mutual": False, "ordered": True},
    "match_wide": {"confidence_min": 0.99, "likeness_min": 2.0, "motion_sigma_rad": 0.5},
}


@pytest.mark.slow
def test_every_option_of_matching_changes_something(mirror: tiltvp.Camera, office: Room) -> None:
    x, y, yaw = office.free_poses(1, 4)[0]
    images = [office.render(mirror, pose=(x + step, y, yaw), samples=2).gray for step in (0.0, 0.6)]
    areas, profiles = (tl.LineExtractor(mirror, descriptor_kind=kind) for kind in ("areas", "profile"))
    described = [areas.describe(image, areas(image)) for image in images]
    profiled = [thing for image in images for thing in (profiles(image), profiles.describe(image, profiles(image)))]

    def answer(owner: str, **options: object) -> list[object]:
        if owner == "match_descriptors":
            # The other way round they are in no order.
            return tl.match(described[0], described[1][::-1].copy(), **options).tolist()
        # The way is told aslant, as odometry might.
        pairs, confidences = tl.match_wide(*profiled, ahead_rad=(0.3 - yaw, 0.3 - yaw), **options)
        return [pairs.tolist(), confidences.tolist()]

    for owner, others in OTHER_MATCHING.items():
        assert {field["name"] for field in option_fields(owner)} == set(others)
        for name, value in others.items():
            assert answer(owner, **{name: value}) != answer(owner), f"{name} changes nothing"


def test_a_mask_keeps_lines_out(room: RoomImage, camera: tiltvp.Camera) -> None:
    mask = np.ones(room.gray.shape, dtype=bool)
    mask[:, :128] = False
    lines = tl.LineExtractor(camera, mask=mask)(room.gray, (room.alpha_rad, room.beta_rad))
    assert len(lines) > 0
    assert np.all(np.cos(lines.bearing_rad) > -0.05)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"lines_mx": 3}, "did you mean lines_max"),
        ({"sectors": 300}, "unknown to method"),
        ({"separation_px": -3}, "separation_px = -3"),
        ({"margin_px": 0.5}, "at least 1 pixel"),
        ({"separation_px": "many"}, "separation_px"),
        ({"method": "square"}, "great-circle"),
        ({"plane_max_rad": -1.0}, "plane_max_rad"),
        ({"descriptor_clip": 0.0}, "clip"),
        ({"descriptor_normalisation": "none"}, "normalisation"),
        ({"method": "radial", "descriptor_kind": "profile"}, "radial lines"),
        (
            {"method": "radial", "robot_from_camera": [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]},
            "90.0 degrees from the vertical",
        ),
        ({"robot_from_camera": np.zeros((3, 3))}, "rotation"),
        ({"method": "radial", "radius_min_px": 90.0, "radius_max_px": 80.0}, "radius_min_px"),
    ],
)
def test_wrong_options_are_refused(camera: tiltvp.Camera, options: dict[str, object], message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        tl.LineExtractor(camera, **options)  # type: ignore[arg-type]


def test_wrong_arguments_are_refused(room: RoomImage, camera: tiltvp.Camera) -> None:
    extractor = tl.LineExtractor(camera)
    with pytest.raises(InvalidInputError, match="image"):
        extractor(room.gray[:100])
    with pytest.raises(InvalidInputError, match="without a tilt"):
        extractor(room.gray, tiltvp.TiltEstimator(camera)(np.zeros_like(room.gray)))
    with pytest.raises(InvalidInputError, match="normal"):
        extractor(room.gray, np.zeros(3))
    with pytest.raises(InvalidInputError, match=r"expected an estimate, \(alpha_rad, beta_rad\) or a normal"):
        extractor(room.gray, "forward")
    radial = tl.extract(room.gray, camera, method="radial", length_min=0.2)
    with pytest.raises(InvalidInputError, match="other method"):
        extractor.describe(room.gray, radial)
    assert tl.describe(room.gray, camera, radial).shape == (len(radial), 192)
    with pytest.raises(InvalidInputError, match="values a row"):
        tl.match(np.zeros((2, 5), np.float32), np.zeros((2, 6), np.float32))
    with pytest.raises(InvalidInputError, match="float32"):
        tl.match(np.zeros((2, 5)), np.zeros((2, 5), np.float32))  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="unknown"):
        tl.match(np.zeros((2, 5), np.float32), np.zeros((2, 5), np.float32), f4=1)
    with pytest.raises(InvalidInputError, match="all three"):
        tl.match(np.zeros((2, 5), np.float32), np.zeros((2, 5), np.float32), gate_rad=1.0)
    with pytest.raises(InvalidInputError, match="f2"):
        tl.LineTracker(f2=2.0)
    with pytest.raises(InvalidInputError, match="look_back"):
        tl.LineTracker(look_back=0)
    lines = extractor(room.gray)
    with pytest.raises(InvalidInputError, match="rows"):
        tl.LineTracker().update(lines, np.zeros((len(lines) + 1, 192), np.float32))


@pytest.mark.slow
def test_a_drive_keeps_its_tracks(mirror: tiltvp.Camera, office: Room) -> None:
    """A robot turns on the spot and leans: lines stay the same tracks, with and without knowledge of the turn."""
    extractor = tl.LineExtractor(mirror, length_min_rad=math.radians(20))
    x, y, yaw = office.free_poses(1, 4)[0]
    trackers = [tl.LineTracker(), tl.LineTracker(ordered=True)]
    known: list[dict[int, float]] = [{}, {}]
    right, wrong = [0, 0], [0, 0]
    for k in range(5):
        tilt = (0.04 * (k % 2), 0.8 * k)
        pose = (x, y, yaw + 0.05 * k)
        image = office.render(mirror, pose=pose, alpha_rad=tilt[0], beta_rad=tilt[1], samples=3, seed=k)
        lines = extractor(image.gray, tilt)
        descriptors = extractor.describe(image.gray, lines)
        motions: list[dict[str, float]] = [{"yaw_change_rad": 0.05 if k else 0.0, "distance_m": 0.0}, {}]
        for t, (tracker, motion, seen) in enumerate(zip(trackers, motions, known, strict=True)):
            tracked = tracker.update(lines, descriptors, **motion)
            assert tracked.frame == k
            assert len(set(tracked.track.tolist())) == len(lines)
            for track, bearing in zip(tracked.track.tolist(), (lines.bearing_rad + 0.05 * k).tolist(), strict=True):
                if track in seen:
                    same = abs((bearing - seen[track] + math.pi) % (2 * math.pi) - math.pi) < 0.01
                    right[t] += same
                    wrong[t] += not same
                seen[track] = bearing
        trackers[0] = pickle.loads(pickle.dumps(trackers[0]))
    assert min(right) > 50
    assert wrong[0] == 0
    assert wrong[1] <= 0.05 * right[1]  # Folds of a curtain look alike.
    assert trackers[0] == copy.copy(trackers[0]) != trackers[1]


@pytest.mark.slow
def test_similarity_matrices_are_darkest_on_the_diagonal(mirror: tiltvp.Camera, office: Room) -> None:
    image = office.render(mirror, pose=office.free_poses(1, 4)[0], samples=3)
    extractor = tl.LineExtractor(mirror)
    lines = extractor.lines_at(np.radians(np.arange(0.0, 360.0, 10.0)))
    assert len(lines) == 36
    distances = tl.descriptor_distances(*2 * (extractor.describe(image.gray, lines),))
    patches = extractor.patches(image.gray, lines)
    flat = patches.reshape(len(lines), -1)
    for matrix in (distances, tl.ssd_matrix(flat, flat), 1.0 - tl.zncc_matrix(flat, flat)):
        assert matrix.shape == (36, 36)
        assert np.allclose(np.diag(matrix), 0.0, atol=1e-6)
        assert np.allclose(matrix, matrix.T, atol=1e-6)
        assert np.median(matrix) > 0.0
    pairs = tl.match(extractor.describe(image.gray, lines), extractor.describe(image.gray, lines))
    assert np.array_equal(pairs, np.stack([np.arange(36)] * 2, axis=1))


@pytest.mark.slow
def test_lines_match_after_more_than_a_metre(mirror: tiltvp.Camera, office: Room) -> None:
    x, y, yaw = office.free_poses(1, 4)[0]
    poses = office.free_poses(200, 6)
    away = np.hypot(*(poses[:, :2] - (x, y)).T)
    there = poses[np.flatnonzero((away > 1.0) & (away < 1.5))[0]]
    extractor = tl.LineExtractor(mirror, descriptor_kind="profile")
    seen = []
    for pose in ((x, y, yaw), there):
        image = office.render(mirror, pose=pose, samples=2)
        lines = extractor(image.gray)
        seen += [lines, extractor.describe(image.gray, lines)]
        assert seen[-1].shape == (len(lines), 190)
    ahead = math.atan2(there[1] - y, there[0] - x)
    told = (ahead - yaw, ahead - there[2])
    for ahead_rad in (None, told):
        pairs, confidences = tl.match_wide(*seen, ahead_rad=ahead_rad, confidence_min=0.0)
        assert pairs.shape == (len(confidences), 2)
        assert (confidences > 0.0).all()
        assert (confidences < 1.0).all()
        assert all(len(set(column)) == len(column) for column in pairs.T.tolist())
        sure, _ = tl.match_wide(*seen, ahead_rad=ahead_rad, confidence_min=0.7)
        assert len(sure) == (confidences >= 0.7).sum()
    # A line stays on its side of the way, and turns away from where the camera goes.
    first, second = (np.angle(np.exp(1j * (lines.bearing_rad - at))) for lines, at in zip(seen[::2], told, strict=True))
    assert (first[pairs[:, 0]] * second[pairs[:, 1]] > -0.1).all()
    same, _ = tl.match_wide(*seen[:2], *seen[:2], ahead_rad=told[:1] * 2)
    assert len(same) == len(seen[0])
    assert (same[:, 0] == same[:, 1]).all()
    with pytest.raises(InvalidInputError, match="190 for each line"):
        tl.match_wide(seen[0], seen[1][:, 1:], seen[2], seen[3])
    with pytest.raises(InvalidInputError, match="two bearings"):
        tl.match_wide(*seen, ahead_rad=[0.0])
    with pytest.raises(InvalidInputError, match="match_wide"):
        tl.match(seen[1], seen[3])


@pytest.mark.parametrize(
    "wrong",
    [{"bearing_rad": [math.nan]}, {"bearing_rad": [math.inf]}, {"sigma_rad": [math.nan]}, {"sigma_rad": [-1.0]},
     {"sigma_rad": [1e300]}, {"polarity": [math.nan]}, {"polarity": [-2.0]}, {"elevation_max_rad": [math.inf]},
     {"normal": [0.0, 0.0, 0.0]}],
)  # fmt: skip
def test_what_is_no_line_is_not_made_one(camera: tiltvp.Camera, wrong: dict[str, Any]) -> None:
    line = tl.LineExtractor(camera).lines_at([0.5])
    with pytest.raises(InvalidInputError, match="lines: got"):
        tl.Lines.from_dict({**line.to_dict(), **wrong})


def test_numbers_that_tell_no_motion_are_refused(camera: tiltvp.Camera) -> None:
    line, tracker = tl.LineExtractor(camera).lines_at([0.5]), tl.LineTracker()
    tracker.update(line, np.ones((1, 192), np.float32), yaw_change_rad=0.0, distance_m=0.0)
    before = copy.copy(tracker)
    with pytest.raises(InvalidInputError, match="distance_m"):
        tracker.update(line, np.ones((1, 192), np.float32), yaw_change_rad=0.0, distance_m=1e200)
    assert tracker == before
    ones = np.ones((1, 192), np.float32)
    with pytest.raises(InvalidInputError, match="gate_rad"):
        tl.match(ones, ones, expected_rad=[0.0], seen_rad=[0.0], gate_rad=-0.1)
    for name in ("expected_rad", "seen_rad"):
        bearings = {"expected_rad": [0.0], "seen_rad": [0.0], name: [np.nan]}
        with pytest.raises(InvalidInputError, match=f"^{name}: got NaN at 0, expected finite"):
            tl.match(ones, ones, **bearings, gate_rad=1.0)


def test_lines_are_drawn_where_they_are(room: RoomImage, camera: tiltvp.Camera) -> None:
    tilt = (room.alpha_rad, room.beta_rad)
    lines = tl.extract(room.gray, camera, tilt)
    pixels = line_pixels(camera, lines)
    assert pixels.shape == (len(lines), 32, 2)
    picture = draw_lines(room.gray, camera, lines, tracks=list(range(len(lines))))
    assert picture.shape == (*room.gray.shape, 3)
    assert picture.dtype == np.uint8
    u, v = np.rint(pixels[0, 16]).astype(int)
    assert np.ptp(picture[v, u].astype(int)) > 60
    with pytest.raises(InvalidInputError, match="tracks"):
        draw_lines(room.gray, camera, lines, tracks=[1])


def test_a_line_across_the_seam_of_a_panorama_is_drawn_on_both_sides() -> None:
    panorama, ahead = tiltvp.Camera.equirectangular(width=256, height=128), read_rotation("forward")
    behind = tl.LineExtractor(panorama, robot_from_camera=ahead).lines_at([np.pi], (0.15, np.pi / 2.0))
    drawn = draw_lines(np.zeros((128, 256), np.uint8), panorama, behind, ahead, labels=False).any(axis=(0, 2))
    assert drawn[:3].any()
    assert drawn[-3:].any()
    assert not drawn[20:-20].any()


def test_same_bytes_from_many_threads(room: RoomImage, camera: tiltvp.Camera) -> None:
    from concurrent.futures import ThreadPoolExecutor

    extractor = tl.LineExtractor(camera)
    expected = extractor(room.gray).to_dict()
    with ThreadPoolExecutor(4) as pool:
        assert all(found.to_dict() == expected for found in pool.map(extractor, [room.gray] * 12))
