"""Corners in drawn images: both front ends, one camera and two, rigs on disk."""

from __future__ import annotations

import copy
import json
import math
import pickle
from pathlib import Path

import cv2
import numpy as np
import pytest

import tiltvp
from drawn_corners import (
    CAMERA,
    COLOURS,
    GREYS,
    LEFT_FROM_RIGHT,
    LIT_FROM_ABOVE,
    amid_lines,
    drawn,
    off_deg,
    off_px,
    pair,
    pose,
    turn,
)
from tiltvp.corner import CornerDetector, CornerPoseEstimator
from tiltvp.errors import CalibrationError, InvalidInputError
from tiltvp.rotations import rotation_from_quaternion
from tiltvp.stereo_rigs import StereoRig
from tiltvp.synth import Room, StereoSequence, zed_cameras

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("yaw", [25.0, 45.0, 62.0])
def test_one_camera_finds_the_coloured_cuboid(yaw: float) -> None:
    rotation, vertex = pose(yaw)
    estimate = CornerPoseEstimator(CAMERA)(drawn(rotation, vertex, COLOURS))
    assert estimate, estimate.reason
    assert estimate.pose is not None
    assert estimate.pose.vertex_m is None
    assert off_deg(estimate.pose.camera_from_object, rotation) < 0.3
    assert estimate.pose.right_handed


def test_highlights_do_not_move_the_vertex() -> None:
    rotation, vertex = pose()
    (found,) = CornerDetector(CAMERA)(drawn(rotation, vertex, LIT_FROM_ABOVE))
    assert np.hypot(*off_px(found.vertex, vertex)) < 0.05


def test_rays_end_where_the_cuboid_does() -> None:
    rotation, vertex = pose()
    plain, behind = (
        CornerDetector(CAMERA)(drawn(rotation, vertex, COLOURS, noise=4.0, beyond=beyond))[0]
        for beyond in (False, True)
    )
    assert abs(behind.support_px[0] - plain.support_px[0]) <= 8
    assert np.hypot(*off_px(behind.vertex, vertex)) < 0.1


def test_a_camera_upside_down_finds_it_too() -> None:
    rotation, vertex = pose()
    image = np.ascontiguousarray(drawn(rotation, vertex, COLOURS)[::-1, ::-1])
    found = CornerDetector(CAMERA)(image)
    assert len(found) == 1
    assert not CornerDetector(CAMERA, orientation="upright")(image)


def test_two_cameras_find_its_place() -> None:
    rotation, vertex = pose()
    estimator = CornerPoseEstimator(CAMERA, CAMERA, LEFT_FROM_RIGHT)
    estimate = estimator(*pair(COLOURS))
    assert estimate, estimate.reason
    assert off_deg(estimate.pose.camera_from_object, rotation) < 0.2
    assert np.linalg.norm(estimate.pose.vertex_m - vertex) < 0.01
    assert np.linalg.norm(estimate.pose.camera_in_object_m + rotation.T @ vertex) < 0.01
    assert not estimate.followed
    assert estimator(*pair(COLOURS)).followed


def test_grey_corners_are_found_by_segments() -> None:
    rotation, _ = pose()
    down = rotation[:, 1]
    detector = CornerDetector(CAMERA, method="general")
    left, right = pair(GREYS)
    assert len(detector.segments(left)) >= 6
    assert detector(left, down)
    estimate = CornerPoseEstimator(CAMERA, CAMERA, LEFT_FROM_RIGHT, method="general", down=down)(left, right)
    assert estimate, estimate.reason
    assert estimate.pose.misfit < 3.0
    # Any corner of the cuboid will do: its edges run along the same axes.
    axes = np.abs(estimate.pose.camera_from_object.T @ rotation)
    assert np.allclose(np.sort(axes.ravel())[-3:], 1.0, atol=1e-4)


def test_parallel_edges_tell_the_attitude() -> None:
    images = pair(GREYS)
    found = {}
    for most_rad in (0.0, 0.05):
        estimator = CornerPoseEstimator(
            CAMERA, CAMERA, LEFT_FROM_RIGHT, method="general", down=(0.0, 1.0, 0.0), parallel_max_rad=most_rad
        )
        assert estimator.options["parallel_max_rad"] == most_rad
        found[most_rad] = estimator(*images).pose
    spread = {most_rad: np.trace(pose.covariance[:3, :3]) for most_rad, pose in found.items()}
    assert spread[0.05] < spread[0.0]
    with pytest.raises(InvalidInputError, match="parallel_max_rad"):
        CornerPoseEstimator(CAMERA, parallel_max_rad=-0.1)


def test_edges_are_as_long_as_they_are() -> None:
    """All three of the grey cuboid's end where two others meet them, 0.3 m from the vertex."""
    rotation, vertex = pose()
    left, right = (image[..., 0] for image in pair(GREYS))
    estimator = CornerPoseEstimator(CAMERA, CAMERA, LEFT_FROM_RIGHT, method="general", down=rotation[:, 1])
    estimate = estimator(left, right)
    assert estimate, estimate.reason
    assert np.allclose(estimate.edge_lengths_m, 0.3, atol=0.006)
    ends = vertex + 0.3 * estimate.pose.edges
    assert np.allclose(estimate.edge_ends_m, ends, atol=0.012)
    assert type(estimate).from_dict(json.loads(json.dumps(estimate.to_dict()))) == estimate
    alone = CornerPoseEstimator(CAMERA, method="general", down=rotation[:, 1])(left)
    assert np.isnan(alone.edge_lengths_m).all()
    assert np.isnan(alone.edge_ends_m).all()


def test_values_and_options() -> None:
    detector = CornerDetector(CAMERA, faces="gbr", chromaticity_min=0.5)
    again = pickle.loads(pickle.dumps(detector))
    assert again == detector
    assert again.options["faces"] == "gbr"
    [feature] = CornerDetector(CAMERA)(drawn(*pose(), COLOURS))
    assert pickle.loads(pickle.dumps(feature)) == feature
    assert np.isclose(np.linalg.norm(feature.vertex), 1.0)
    for wrong in (
        {"faces": "rrb"},
        {"chromaticity_min": 0.1},
        {"chromatic": 1},
        {"method": "none"},
        {"gradient_min": 60},
    ):
        with pytest.raises(InvalidInputError, match=next(iter(wrong))):
            CornerDetector(CAMERA, **wrong)
    with pytest.raises(InvalidInputError, match="360 x 480"):
        CornerDetector(CAMERA)(np.zeros((10, 10, 3), np.uint8))
    with pytest.raises(InvalidInputError, match="shape"):
        CornerDetector(CAMERA)(np.zeros((360, 480), np.uint8))
    with pytest.raises(InvalidInputError, match="vertical: got one for method 'coloured'"):
        CornerDetector(CAMERA)(np.zeros((360, 480, 3), np.uint8), (0.0, 1.0, 0.0))
    with pytest.raises(InvalidInputError, match="left_from_right"):
        CornerPoseEstimator(CAMERA, CAMERA)
    with pytest.raises(InvalidInputError, match="misfit_max"):
        CornerPoseEstimator(CAMERA, misfit_max=-1.0)
    blank = np.full((360, 480, 3), 128, np.uint8)
    empty = CornerPoseEstimator(CAMERA)(blank)
    assert not empty
    assert empty.pose is None
    assert "left" in empty.reason


def test_detectors_and_what_stands_beside_them_agree() -> None:
    coloured, general = (CornerDetector(CAMERA, method=method) for method in ("coloured", "general"))
    oblique = CornerDetector(CAMERA, method="general", gamma_rad=1.2)
    for pair_of, beside, complaint in (
        ((coloured,), {"method": "general"}, "method = 'general' beside a CornerDetector of 'coloured'"),
        ((CAMERA, coloured, LEFT_FROM_RIGHT), {"method": "paper"}, "method = 'paper'"),
        ((coloured, general, LEFT_FROM_RIGHT), {}, "method = 'coloured' beside a CornerDetector of 'general'"),
        ((general,), {"gamma_rad": 1.2}, r"gamma_rad = 1\.2, expected 1\.57\d*, as the detector has it"),
        ((oblique, general, LEFT_FROM_RIGHT), {}, r"gamma_rad = 1\.2, expected 1\.57\d*, as the detector has it"),
        ((coloured,), {"faces": "rgb"}, "faces"),
    ):
        with pytest.raises(InvalidInputError, match=complaint):
            CornerPoseEstimator(*pair_of, **beside)
    for estimator in (
        CornerPoseEstimator(oblique),
        CornerPoseEstimator(oblique, method="general", gamma_rad=1.2),
        CornerPoseEstimator(oblique, CAMERA, LEFT_FROM_RIGHT),
        CornerPoseEstimator(CAMERA, method="general", gamma_rad=1.2),
    ):
        assert estimator.left == oblique
        assert estimator.options["gamma_rad"] == 1.2
    assert CornerPoseEstimator(coloured, gamma_rad=1.2).options["gamma_rad"] == 1.2


@pytest.mark.parametrize("gamma_rad", [1.5708, 1.57])
def test_a_right_angle_in_few_digits_is_one(gamma_rad: float) -> None:
    """Much is known of right angles alone, as which edges are parallel and where they end."""
    right = CornerPoseEstimator(CAMERA, method="general")
    assert CornerDetector(CAMERA, method="general", gamma_rad=gamma_rad) == right.left
    assert CornerPoseEstimator(CAMERA, method="general", gamma_rad=gamma_rad) == right
    assert CornerPoseEstimator(CornerDetector(CAMERA, method="general"), gamma_rad=gamma_rad) == right
    other = CornerPoseEstimator(CAMERA, method="general", gamma_rad=1.568)
    assert other.options["gamma_rad"] == other.left.options["gamma_rad"] == 1.568


@pytest.mark.parametrize("told_deg", [80.0, 110.0])
def test_a_corner_whose_angle_is_not_the_one_told_is_none(told_deg: float) -> None:
    """That of two images: of a right-angled one poses by these angles were 80 degrees off, and sure."""
    (rotation, vertex), gamma_rad = pose(), math.radians(told_deg)
    such = np.column_stack([*np.eye(3)[:2], (math.cos(gamma_rad), 0.0, math.sin(gamma_rad))])
    for edges, reason in ((such, ""), (np.eye(3), "no corner that fits")):
        images = [drawn(rotation @ edges, vertex - side, GREYS) for side in (np.zeros(3), LEFT_FROM_RIGHT[:3, 3])]
        estimator = CornerPoseEstimator(CAMERA, CAMERA, LEFT_FROM_RIGHT, method="general", gamma_rad=gamma_rad)
        found = estimator(*images)
        assert ((found.pose is not None), found.reason) == (not reason, reason)


def test_estimates_are_kept() -> None:
    seen = CornerPoseEstimator(CAMERA, CAMERA, LEFT_FROM_RIGHT)(*pair(COLOURS))
    blank = np.full((360, 480, 3), 128, np.uint8)
    for estimate in (seen, CornerPoseEstimator(CAMERA)(blank)):
        for again in (
            pickle.loads(pickle.dumps(estimate)),
            type(estimate).from_dict(json.loads(json.dumps(estimate.to_dict()))),
        ):
            assert again == estimate
            assert again.to_dict() == estimate.to_dict()
            assert again.reason == estimate.reason
    assert pickle.loads(pickle.dumps(seen.pose)) == seen.pose
    with pytest.raises(InvalidInputError, match="reason"):
        type(seen).from_dict(seen.to_dict() | {"reason": "none"})
    with pytest.raises(InvalidInputError, match="camera_from_object"):
        type(seen.pose).from_dict(seen.pose.to_dict() | {"camera_from_object": [1.0]})


@pytest.mark.parametrize(("method", "faces"), [("coloured", COLOURS), ("general", GREYS), ("paper", COLOURS)])
def test_estimators_go_on_where_they_were(method: str, faces: dict[str, tuple[int, int, int]]) -> None:
    images = pair(faces)
    estimator = CornerPoseEstimator(CAMERA, CAMERA, LEFT_FROM_RIGHT, method=method, down=(0.0, 1.0, 0.0))
    new = pickle.loads(pickle.dumps(estimator))
    assert new == estimator
    assert estimator(*images)
    assert new != estimator
    again = [pickle.loads(pickle.dumps(estimator)), copy.copy(estimator), copy.deepcopy(estimator)]
    for one in again:
        assert type(one) is CornerPoseEstimator
        assert one == estimator
        assert str(one.options) == str(estimator.options)
    following = estimator(*images)
    assert following.followed
    for one in again:
        assert one(*images) == following
        assert one == estimator
    estimator.reset()
    assert estimator != again[0]


def test_the_published_method_stands_beside_ours() -> None:
    """The paper's lines of midpoints, eq. 27, its closed form, and the middle between two lines of sight."""
    images, (rotation, vertex) = pair(COLOURS), pose()
    published = CornerPoseEstimator(CAMERA, CAMERA, LEFT_FROM_RIGHT, method="paper")
    estimate = published(*images)
    assert estimate.pose is not None
    assert estimate.pose.right_handed
    assert off_deg(estimate.pose.camera_from_object, rotation) < 1.0
    assert np.linalg.norm(estimate.pose.vertex_m - vertex) < 0.02
    # The attitude is the left view's own, by the closed form and nothing else.
    [feature] = CornerDetector(CAMERA, method="paper")(images[0])
    own = [attitude.camera_from_object for attitude in tiltvp.corner.attitudes(feature)]
    assert min(np.abs(one - estimate.pose.camera_from_object).max() for one in own) == 0.0
    # The vertex is equally far from both lines of sight.
    [other] = CornerDetector(CAMERA, method="paper")(images[1])
    seen = [np.cross(estimate.pose.vertex_m - at, one.vertex) for at, one in
            ((np.zeros(3), feature), (LEFT_FROM_RIGHT[:3, 3], other))]  # fmt: skip
    assert np.allclose(seen[0], -seen[1] * np.sign(seen[0] @ -seen[1]), atol=1e-3)
    assert np.isclose(np.linalg.norm(seen[0]), np.linalg.norm(seen[1]), rtol=1e-9)
    assert CornerPoseEstimator(CAMERA, method="paper")(images[0]).reason.startswith("several hypotheses")
    assert CornerPoseEstimator(CAMERA, method="paper", down=rotation[:, 1])(images[0])
    with pytest.raises(InvalidInputError, match=r"mask.*paper.*general"):
        CornerDetector(CAMERA, method="paper", mask=np.ones((360, 480), np.bool_))


def test_rigs_come_back_from_disk(tmp_path: Path) -> None:
    rig = StereoRig(CAMERA, CAMERA, LEFT_FROM_RIGHT)
    rig.save(tmp_path / "rig.toml")
    again = StereoRig.load(tmp_path / "rig.toml")
    assert again.left == CAMERA
    assert np.allclose(again.left_from_right, LEFT_FROM_RIGHT, atol=1e-15)
    CAMERA.save(tmp_path / "one.toml")
    with pytest.raises(CalibrationError, match="pair of cameras"):
        StereoRig.load(tmp_path / "one.toml")
    with pytest.raises(InvalidInputError, match=r"'\.yaml', expected \.toml"):
        rig.save(tmp_path / "rig.yaml")
    lens = "camera_model: pinhole, distortion_model: none, distortion_coeffs: [], intrinsics: [400, 400, 240, 180]"
    camera = f"{{{lens}, resolution: [480, 360]"
    motion = np.linalg.inv(LEFT_FROM_RIGHT).tolist()
    (tmp_path / "chain.yaml").write_text(f"cam0: {camera}}}\ncam1: {camera}, T_cn_cnm1: {motion}}}\n")
    chain = StereoRig.load(tmp_path / "chain.yaml")
    assert np.allclose(chain.left_from_right, LEFT_FROM_RIGHT, atol=1e-12)


def test_rigs_are_of_two_places_and_a_rotation() -> None:
    rounded = LEFT_FROM_RIGHT.copy()
    rounded[:3, :3] = np.round(rotation_from_quaternion(np.array([0.6, 0.0, 0.48, 0.64]), "q"), 5)
    kept = StereoRig(CAMERA, CAMERA, rounded.tolist()).left_from_right
    assert np.allclose(kept, rounded, atol=1e-4)
    assert np.allclose(kept[:3, :3] @ kept[:3, :3].T, np.eye(3), atol=1e-14)
    mirrored, still = LEFT_FROM_RIGHT.copy(), np.eye(4)
    mirrored[0, 0] = -1.0
    for wrong in (np.eye(3), mirrored, still, LEFT_FROM_RIGHT * np.nan, 2.0 * LEFT_FROM_RIGHT, 1e308 * mirrored, "up"):
        with pytest.raises(InvalidInputError, match=r"left_from_right: .*, expected"):
            StereoRig(CAMERA, CAMERA, wrong)


def test_corners_of_one_image_that_contradict_each_other_are_no_pose() -> None:
    """Two boxes, one leaning: alike within `agree_max_rad`, and not within what their edges are known to."""
    rotation, _ = pose(roll=0.0)
    for lean_deg, misfit_max, found in ((0.0, 1.0, True), (3.0, 1.0, False), (3.0, 5.0, True)):
        left = drawn(rotation, np.array([-0.45, 0.0, 1.6]), GREYS)
        right = drawn(turn("x", lean_deg) @ rotation, np.array([0.45, 0.0, 1.6]), GREYS)
        estimator = CornerPoseEstimator(CAMERA, method="general", misfit_max=misfit_max)
        estimate = estimator(np.hstack([left[:, :240], right[:, 240:]]))
        assert len(estimate.features_left) >= 2
        assert (estimate.pose is not None) == found, (lean_deg, misfit_max)


@pytest.mark.parametrize(
    ("kind", "seed", "frame"),
    [("living-room", 10710, 0), ("office", 10418, 0), ("l-shaped", 10714, 1)],
    ids=["wallpaper with its pattern about the corner", "rounded edges that miss each other", "bare walls"],
)
def test_corners_of_rooms_that_show_little_of_themselves_are_found(kind: str, seed: int, frame: int) -> None:
    left, right = zed_cameras(1280)
    sequence = StereoSequence(Room(kind, seed), left=left, right=right, frames=10, seed=seed)
    down = -sequence.imu(seed=seed).forces_m_s2.mean(axis=0)
    estimator = CornerPoseEstimator(left, right, sequence.left_from_right, method="general", down=down)
    estimate = estimator(*sequence.render(frame))
    assert estimate, estimate.reason
    assert estimate.pose is not None
    truths = np.array([sequence.left_from_object(frame, n)[:3, 3] for n in range(len(sequence.corners))])
    off = truths - estimate.pose.vertex_m
    off = off[np.argmin(np.linalg.norm(off, axis=1))]
    assert np.linalg.norm(off) < 0.01
    assert off @ np.linalg.solve(estimate.pose.covariance[3:, 3:], off) < 16.3


def test_edges_of_both_images_tell_that_the_cameras_are_turned_otherwise() -> None:
    """Places were 0.4 and 2.5 m off then, and sure."""
    left, right = zed_cameras(1280)
    sequence = StereoSequence(Room("l-shaped", 12002), left=left, right=right, frames=120, seed=12002)
    down, images = -sequence.imu(seed=12002).forces_m_s2.mean(axis=0), sequence.render(20)
    truths = np.array([sequence.left_from_object(20, n)[:3, 3] for n in range(len(sequence.corners))])
    contradicted = "edges of both images contradict the calibration of the pair"
    for yaw_deg, reason in ((0.0, ""), (0.25, ""), (1.0, contradicted)):
        told = sequence.left_from_right.copy()
        told[:3, :3] = turn("y", yaw_deg) @ told[:3, :3]
        estimate = CornerPoseEstimator(left, right, told, method="general", down=down)(*images)
        assert estimate.reason == reason
        if estimate.pose is not None:
            seen = estimate.pose.vertex_m / np.linalg.norm(estimate.pose.vertex_m)
            ahead = truths / np.linalg.norm(truths, axis=1)[:, None] @ seen
            off = truths[np.argmax(ahead)] - estimate.pose.vertex_m
            assert off @ np.linalg.solve(estimate.pose.covariance[3:, 3:], off) < 16.3


def test_a_cuboid_that_misfits_the_calibration_is_none() -> None:
    """Its place was 128 mm off, and sure."""
    for focal, reason in ((400.0, ""), (440.0, "no corner that fits")):
        camera = tiltvp.Camera.pinhole(width=480, height=360, fx=focal, fy=focal, cx=240.0, cy=180.0)
        estimate = CornerPoseEstimator(camera, camera, LEFT_FROM_RIGHT)(*pair(COLOURS))
        assert estimate.reason == reason


def test_three_lines_of_one_image_are_no_corner_amid_edges_that_run_otherwise() -> None:
    """Any three lines that meet are a corner with right angles to one camera."""
    picture, centre = np.full((1440, 1920), 150, np.uint8), np.array([960, 720])
    tips = [centre + 480 * np.array([np.cos(t), np.sin(t)]) for t in (np.pi / 2 + 0.05, np.pi + 0.5, -0.45)]
    for side, grey in enumerate((60, 110, 200)):
        cv2.fillPoly(picture, [np.array([centre, tips[side], tips[(side + 1) % 3]]).astype(np.int32)], (grey,))
    estimate = CornerPoseEstimator(CAMERA, method="general", down=(0.0, 1.0, 0.0))(amid_lines(picture, centre, 560))
    assert estimate.features_left
    assert not estimate.hypotheses
    # Nor are two that agree, as here where the left and the right face have one level; four of a cuboid are.
    rotation, vertex = pose()
    for faces, is_told in ((GREYS, True), (GREYS | {"right": GREYS["left"]}, False)):
        cuboid = cv2.resize(drawn(rotation, vertex, faces, noise=0.0)[..., 1], (1920, 1440))
        estimator = CornerPoseEstimator(CAMERA, method="general", down=rotation[:, 1])
        assert len(estimator(amid_lines(cuboid, centre, 620)).chosen_left) == (4 if is_told else 0)
        assert len(estimator.left(amid_lines(cuboid, centre, 620), rotation[:, 1])) > 1


def test_a_frame_that_is_refused_leaves_all_as_it_was() -> None:
    left, right = pair(GREYS)
    estimator = CornerPoseEstimator(CAMERA, CAMERA, LEFT_FROM_RIGHT, method="general")
    assert estimator(left, right)
    before = copy.deepcopy(estimator)
    for images in ((left, right[:-1]), (left[:-1], right)):
        with pytest.raises(InvalidInputError, match="pixels"):
            estimator(*images)
        assert estimator == before
