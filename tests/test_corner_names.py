"""All corners of a frame by name: in rendered rooms where some are hidden for a while, and in drawn pairs."""

from __future__ import annotations

import math
import pickle

import cv2
import numpy as np
import polars as pl
import pytest

from drawn_corners import CAMERA, COLOURS, GREYS, LEFT_FROM_RIGHT, drawn, on_wall, pair, pose
from tiltvp.corner import BelievedCorner, CornerPoseEstimator, join_boxes
from tiltvp.corner_tables import CORNER_COLUMNS, corner_rows, pose_rows
from tiltvp.errors import InvalidInputError
from tiltvp.lab.evaluation.corner_names import COVERS, names_seen, summarise_names
from tiltvp.lab.evaluation.corner_scenes import down_in
from tiltvp.overlays.corners import draw_corners, draw_names
from tiltvp.synth import Laboratory, Room, StereoSequence, zed_cameras

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def walk() -> StereoSequence:
    """A hand-held pair in a furnished room, in small images."""
    left, right = (camera.scaled(0.5) for camera in zed_cameras())
    room = Room("living-room", 7008, light_spacing_m=0.3)
    return StereoSequence(room, left=left, right=right, frames=40, seed=7008, samples=1)


def test_names_last_while_a_corner_is_hidden(walk: StereoSequence) -> None:
    every = names_seen(walk, threads=2, down=down_in(walk))
    assert list(every) == list(COVERS)
    for cover, seen in every.items():
        told = summarise_names(seen)
        assert told["named"] > 40
        assert told["shared"] == 0
        assert told["back"] >= 1
        if cover != "all":
            # The others tell where the camera is, so that what was covered is known again.
            assert told["kept"] == told["back"]
        # No two corners of one frame have one name.
        named = seen.drop_nulls("id")
        assert named.select("frame", "id").is_duplicated().sum() == 0
    left, right = walk.cameras
    short = StereoSequence(walk.scene, left=left, right=right, frames=39)
    with pytest.raises(InvalidInputError, match="40 or more"):
        names_seen(short)


def test_what_a_believed_corner_tells() -> None:
    rotation, vertex = pose()
    estimator = CornerPoseEstimator(
        CAMERA, CAMERA, LEFT_FROM_RIGHT, method="general", down=rotation[:, 1], right_handed=True
    )
    images = pair(GREYS)
    estimate = estimator(*images)
    first = estimate.corners[0]
    assert first.id == 1
    assert first.pose == estimate.pose
    assert first.hypotheses == estimate.hypotheses
    assert np.array_equal(first.edge_lengths_m, estimate.edge_lengths_m, equal_nan=True)
    off = (first.edge_lengths_m - 0.3) / first.edge_length_sigmas_m
    assert np.isfinite(off).any()
    assert np.nanmax(np.abs(off)) < 4.0
    # Places 0.12 m apart tell no angle, 0.4 m apart all of them.
    assert np.isnan([first.edge_angles_rad, first.edge_angle_sigmas_rad]).all()
    apart = LEFT_FROM_RIGHT.copy()
    apart[0, 3] = 0.4
    wide = CornerPoseEstimator(CAMERA, CAMERA, apart, method="general", down=rotation[:, 1], right_handed=True)
    told, *_ = wide.poses(images[0], drawn(rotation, vertex - apart[:3, 3], GREYS))
    assert (np.abs(told.edge_angles_rad - math.pi / 2) < 4.0 * told.edge_angle_sigmas_rad).all()
    assert (told.edge_angle_sigmas_rad < math.radians(5.0)).all()
    assert pickle.loads(pickle.dumps(first)) == first
    # Names go on in copies, and `poses` is the same list.
    copy = pickle.loads(pickle.dumps(estimator))
    again = estimator.poses(*images)
    assert again == copy.poses(*images)
    assert again[0].id == 1
    # What has a name keeps it to itself.
    estimator.reset()
    assert estimator.poses(*images)[0].id not in {corner.id for corner in estimate.corners}
    rows = corner_rows([(0.0, "a.png", estimate)])
    assert len(rows) == sum(len(corner.hypotheses) for corner in estimate.corners)
    table = pl.DataFrame(rows, schema={name: getattr(pl, kind) for name, kind in CORNER_COLUMNS.items()})
    assert table["id"][0] == 1
    assert math.isclose(table["cov_z_z"][0], first.pose.covariance[5, 5])
    assert np.allclose(table.select("vertex_x_m", "vertex_y_m", "vertex_z_m").row(0), first.pose.vertex_m)
    canvas = np.zeros((360, 480, 3), np.uint8)
    draw_names(canvas, CAMERA, estimate.features_left, estimate.corners)
    assert canvas.max() == 255


def test_rows_have_the_deviations_of_the_places_beside_them() -> None:
    estimate = CornerPoseEstimator(CAMERA, CAMERA, LEFT_FROM_RIGHT)(*pair(COLOURS))
    [row] = pose_rows([(0.0, "a.png", estimate)])
    found = estimate.pose
    assert found is not None
    assert found.vertex_m is not None
    errors = np.random.default_rng(1).multivariate_normal(np.zeros(6), found.covariance, 20_000)
    places = [
        -(cv2.Rodrigues(error[:3])[0] @ found.camera_from_object).T @ (found.vertex_m + error[3:]) for error in errors
    ]
    assert np.allclose([row[f"sigma_{axis}_m"] for axis in "xyz"], np.std(places, axis=0), rtol=0.05)
    assert np.allclose([row[f"sigma_r{axis}_rad"] for axis in "xyz"], np.std(errors[:, :3], axis=0), rtol=0.05)


def test_corners_without_a_place_have_no_name() -> None:
    rotation, vertex = pose()
    estimate = CornerPoseEstimator(CAMERA, method="general", down=rotation[:, 1], right_handed=True)(
        drawn(rotation, vertex, GREYS)
    )
    [one] = estimate.corners
    # What is not known of a place has no variance of 0 in tables.
    [row] = corner_rows([(0.0, "a.png", estimate)])
    assert row["cov_rz_rz"] == one.pose.covariance[2, 2] > 0.0
    assert [row["cov_rx_x"], row["cov_rz_z"], row["cov_x_x"], row["cov_z_z"]] == [None] * 4
    assert one.id is None
    assert one.pose.vertex_m is None
    assert np.isnan(one.edge_angles_rad).all()
    # Colours are a name.
    estimator = CornerPoseEstimator(CAMERA, CAMERA, LEFT_FROM_RIGHT)
    assert [corner.id for corner in estimator.poses(*pair(COLOURS))] == [1]
    estimator.reset()
    assert [corner.id for corner in estimator.poses(*pair(COLOURS))] == [1]
    assert estimator.poses(*pair(dict.fromkeys(GREYS, (150, 150, 150)))) == []


def corner(
    vertex: tuple[float, float, float],
    signs: tuple[int, int, int],
    lengths: tuple[float | None, ...],
    turn_deg: float = 0.0,
) -> BelievedCorner:
    """A corner with edges along the axes, turned about the y axis, and lengths known to 2 mm."""
    c, s = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    rotation = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    pose = {
        "camera_from_object": rotation.tolist(), "edges": (np.diag(signs) @ rotation.T).tolist(),
        "vertex_m": list(vertex), "covariance": (1e-6 * np.eye(6)).tolist(), "probability": 1.0, "right_handed": True,
        "misfit": 0.0,
    }  # fmt: skip
    return BelievedCorner.from_dict({
        "id": None, "hypotheses": [pose], "left": 0, "right": 0, "edge_lengths_m": list(lengths),
        "edge_length_sigmas_m": [None if length is None else 0.002 for length in lengths],
        "edge_ends_m": [None] * 3, "edge_angles_rad": [None] * 3, "edge_angle_sigmas_rad": [None] * 3,
    })  # fmt: skip


def test_corners_that_share_edges_are_joined() -> None:
    first = corner((0.0, 0.0, 2.0), (1, 1, 1), (0.4, None, None))
    second = corner((0.401, 0.0, 2.0), (-1, 1, 1), (None, 0.3, None))
    third = corner((0.4, 0.301, 2.0), (-1, -1, 1), (None, None, None))
    [box] = join_boxes([first, second, third])
    assert box.corners == (0, 1, 2)
    # Vertices are known to 1 mm, their distance to 1.4 mm, better than the ends; nothing shows the depth.
    assert np.allclose(box.sizes_m[:2], (0.401, 0.301), atol=1e-4)
    assert np.allclose(box.size_sigmas_m[:2], 0.001 * math.sqrt(2.0))
    assert np.isnan(box.sizes_m[2])
    # Not joined: no end is seen there; the end is elsewhere; another box in line, of other edges; turned; no place.
    assert join_boxes([third, corner((0.0, 0.301, 2.0), (1, -1, 1), (None, None, None))]) == []
    assert join_boxes([corner((0.0, 0.0, 2.0), (1, 1, 1), (0.3, None, None)), second]) == []
    assert join_boxes([first, corner((0.4, 0.0, 2.0), (1, 1, 1), (None, None, None))]) == []
    assert join_boxes([first, corner((0.4, 0.0, 2.0), (-1, 1, 1), (None, None, None), turn_deg=8.0)]) == []
    # One corner whose edges are all seen; edges that disagree tell nothing.
    [alone] = join_boxes([corner((0.0, 0.0, 2.0), (1, 1, 1), (0.4, 0.3, 0.2))])
    assert np.allclose(alone.sizes_m, (0.4, 0.3, 0.2))
    torn = [corner((0.0, 0.0, 2.0), (1, 1, 1), (0.4, 0.2, None)), second]
    assert np.isnan(join_boxes(torn)[0].sizes_m[1])


def test_a_drawn_box_has_its_sizes() -> None:
    rotation, _ = pose()
    estimator = CornerPoseEstimator(
        CAMERA, CAMERA, LEFT_FROM_RIGHT, method="general", down=rotation[:, 1], right_handed=True
    )
    estimate = estimator(*pair(GREYS))
    [box] = join_boxes(estimate.corners)
    off = (box.sizes_m - 0.3) / box.size_sigmas_m
    assert np.isfinite(off).sum() >= 2
    assert np.nanmax(np.abs(off)) < 4.0
    assert corner_rows([(0.0, "a.png", estimate)])[0]["box"] == 1


def test_a_box_that_stands_turned_against_the_walls_is_listed_beside_them() -> None:
    left, right = zed_cameras(1280)
    sequence = StereoSequence(Laboratory(8401), left=left, right=right, frames=100, seed=8401)
    estimate = CornerPoseEstimator(left, right, sequence.left_from_right, method="general")(*sequence.render(70))
    box_m = sequence.left_from_object(70)[:3, 3]
    away_m = np.array([np.linalg.norm(corner.pose.vertex_m - box_m) for corner in estimate.corners])
    assert min(away_m) < 0.03, away_m
    # Its other corners, and those of the walls.
    assert np.count_nonzero(away_m < 0.5) >= 3, away_m
    assert np.count_nonzero(away_m > 2.0) >= 2, away_m


def test_corners_of_which_one_edge_is_not_seen_are_poses() -> None:
    rotation, vertex = pose()
    # A silhouette: all faces have one level.
    images = pair(dict.fromkeys(GREYS, (60, 60, 60)))
    estimator = CornerPoseEstimator(CAMERA, CAMERA, LEFT_FROM_RIGHT, method="general", down=rotation[:, 1])
    for _ in range(2):
        estimate = estimator(*images)
        place = rotation.T @ (estimate.pose.vertex_m - vertex) / 0.3
        assert np.abs(place - np.clip(np.rint(place), 0.0, 1.0)).max() < 0.01
        axes = np.abs(estimate.pose.camera_from_object.T @ rotation)
        assert np.allclose(np.sort(axes.ravel())[-3:], 1.0, atol=1e-4)
        feature = estimate.features_left[estimate.chosen_left[0]]
        assert sorted(support > 0 for support in feature.support_px) == [False, True, True]
        (corner,) = estimate.corners
        unseen = feature.support_px.index(0)
        assert corner.id == 1
        assert np.isnan(corner.edge_lengths_m[unseen])
        assert np.isnan(np.delete(corner.edge_angles_rad, unseen)).all()
    # Two colours of three.
    picture = draw_corners(images[0], CAMERA, [feature]).reshape(-1, 3).astype(int)
    assert set(picture[np.ptp(picture, axis=1) > 120].argmax(axis=1)) == {0, 1, 2} - {2 - unseen}
    # Without a vertical nothing tells what the edges run along, and of what is parallel to nothing other edges do not.
    for known in ({}, {"down": rotation[:, 1], "parallel_max_rad": 0.0}):
        assert CornerPoseEstimator(CAMERA, CAMERA, LEFT_FROM_RIGHT, method="general", **known)(*images).pose is None


def test_which_of_many_like_corners_both_images_show_is_told_by_a_distance_alone() -> None:
    rotation, _ = pose(yaw=0.0, pitch=0.0, roll=0.0)
    # A square of the other column, where the right image does not show it, would be a quarter of a metre away.
    images = [on_wall(rotation, (0, 1)), on_wall(rotation, (0,), right_m=0.12)]
    left_from_right = np.eye(4)
    left_from_right[0, 3] = 0.12
    found = {
        nearest_m: CornerPoseEstimator(
            CAMERA, CAMERA, left_from_right, method="general", down=rotation[:, 1], distance_min_m=nearest_m
        )(*images)
        for nearest_m in (0.2, 1.0)
    }
    assert found[0.2].pose is None
    place = rotation.T @ (found[1.0].pose.vertex_m - (0.0, 0.0, 2.0))
    assert np.abs(place - 0.3 * np.rint(place / 0.3)).max() < 0.01, place
    assert place[0] < 0.4, place
