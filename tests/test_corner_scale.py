"""One camera that knows its height, the length of an edge or the size of a box: its place, and where it abstains."""

from __future__ import annotations

import math
import pickle
from pathlib import Path

import cv2
import numpy as np
import pytest

import tiltvp
from drawn_corners import CAMERA, COLOURS, GREYS, LEFT_FROM_RIGHT, drawn, photographed, pose
from tiltvp.cli import main
from tiltvp.corner import CornerPoseEstimator
from tiltvp.errors import InvalidInputError
from tiltvp.synth import Room, StereoSequence, zed_cameras

pytestmark = pytest.mark.slow

SIZE_M = 0.3
"""Of the cuboid, along all edges."""


def seen(
    rotation: np.ndarray,
    vertex: np.ndarray,
    faces: dict[str, tuple[int, int, int]],
    *,
    fine: int = 4,
    seed: int = 5,
    rim_m: float = SIZE_M,
) -> np.ndarray:
    """The cuboid before grey, by a line of sight for each fine pixel: drawn polygons are half of one too large.

    Each face has a white label, `rim_m` from its edges.
    """
    u, v = ((np.arange(count * fine) + 0.5) / fine - 0.5 for count in (480, 360))
    rays = np.stack([*np.meshgrid((u - 240.0) / 400.0, (v - 180.0) / 400.0), np.ones((v.size, u.size))], axis=-1)
    rays, camera = rays @ rotation, -rotation.T @ vertex
    picture = np.full(rays.shape, 150, np.uint8)
    for across, face in enumerate(("left", "top", "right")):
        distance = -camera[across] / rays[..., across]
        inside, label = distance > 0.0, distance > 0.0
        for along in {0, 1, 2} - {across}:
            place = camera[along] + distance * rays[..., along]
            inside &= (place >= 0.0) & (place <= SIZE_M)
            label &= (place >= rim_m) & (place <= SIZE_M - rim_m)
        picture[inside] = faces[face]
        picture[label] = 235
    return photographed(picture, 1.0, seed)


def errors(found: object, rotation: np.ndarray, vertex: np.ndarray) -> np.ndarray:
    """(6,): rotation vector and vertex."""
    turn = cv2.Rodrigues(rotation @ found.camera_from_object.T)[0].ravel()
    return np.concatenate([turn, vertex - found.vertex_m])


def test_a_known_height_places_one_camera() -> None:
    """How well covariances are met is measured on rendered frames, in test_corner_measures.py."""
    for k in range(0, 20, 4):
        rotation, vertex = pose(yaw=25.0 + 2.0 * k, pitch=20.0 + 1.3 * k, roll=-8.0 + k)
        above = float(rotation[:, 1] @ vertex)
        image = drawn(rotation, vertex, COLOURS, fine=4)
        exact, measured = (
            CornerPoseEstimator(CAMERA, camera_height_m=above, camera_height_sigma_m=sigma)(image).pose
            for sigma in (0.0, 0.005)
        )
        assert exact is not None
        assert measured is not None
        assert np.linalg.norm(exact.vertex_m - vertex) < 0.03 * np.linalg.norm(vertex)
        # A height that is wrong moves the vertex along its line of sight, and does nothing to the attitude.
        upright = exact.camera_from_object[:, 1]
        assert np.isclose(upright @ exact.vertex_m, above)
        seen = np.zeros(6)
        seen[3:] = exact.vertex_m * 0.005 / above
        assert np.allclose(measured.covariance - exact.covariance, np.outer(seen, seen), atol=1e-15)
        assert np.linalg.eigvalsh(exact.covariance).min() > -1e-15


def test_a_height_is_above_the_corners_that_stand_on_the_floor() -> None:
    """Of a grey box the upper corners are often the best ones, but things stand below them."""
    for k in range(10):
        rotation, vertex = pose(yaw=25.0 + 4.0 * k, pitch=14.0 + 2.5 * k, roll=-6.0 + k)
        vertex = vertex + (0.0, -0.08, 0.0)
        feet = vertex + [0.3 * rotation @ (x, 1.0, z) for x, z in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))]
        known = {"camera_height_m": float(rotation[:, 1] @ feet[0]), "camera_height_sigma_m": 0.002}
        estimate = CornerPoseEstimator(CAMERA, method="general", down=rotation[:, 1], **known)(
            drawn(rotation, vertex, GREYS, fine=4)
        )
        assert estimate.pose is not None
        off = min((foot - estimate.pose.vertex_m for foot in feet), key=np.linalg.norm)
        assert off @ np.linalg.solve(estimate.pose.covariance[3:, 3:], off) < 16.3
        assert any(np.abs(estimate.pose.edges + rotation[:, 1]).max(axis=1) < 0.02)
        hidden = drawn(rotation, vertex, GREYS, fine=4)
        hidden[round(vertex[1] / vertex[2] * 400.0 + 180.0) + 60 :] = 150
        upper = CornerPoseEstimator(CAMERA, method="general", down=rotation[:, 1], **known)(hidden)
        assert upper.pose.vertex_m is None
        assert upper.place_reason == "no upright edge rises from a corner, as of what stands on the floor"


def test_what_a_height_does_not_tell() -> None:
    rotation, vertex = pose()
    image = drawn(rotation, vertex, COLOURS)
    above = float(rotation[:, 1] @ vertex)
    for known in ({}, {"camera_height_m": above, "down": -rotation[:, 1]}, {"camera_height_m": 500.0}):
        estimate = CornerPoseEstimator(CAMERA, **known)(image)
        assert estimate
        assert estimate.pose.vertex_m is None
        assert not estimate.pose.covariance[3:].any()
    # Which edge of a grey corner is the upright one is not known without the direction down.
    grey = drawn(rotation, vertex, GREYS)
    down = {"down": rotation[:, 1], "right_handed": True}
    assert CornerPoseEstimator(CAMERA, method="general", camera_height_m=above, **down)(grey).pose.vertex_m is not None
    unknown = CornerPoseEstimator(CAMERA, method="general", camera_height_m=above, right_handed=True)(grey)
    assert all(one.vertex_m is None for one in unknown.hypotheses)
    with pytest.raises(InvalidInputError, match=r"camera_height_m.*two cameras"):
        CornerPoseEstimator(CAMERA, CAMERA, LEFT_FROM_RIGHT, camera_height_m=1.0)
    with pytest.raises(InvalidInputError, match="camera_height_m"):
        CornerPoseEstimator(CAMERA, camera_height_m=0.0)


KNOWN = [
    {"edge_length_m": SIZE_M, "known_edge": "x"},
    {"edge_length_m": SIZE_M},
    {"edge_length_m": SIZE_M, "known_edge": "z"},
    {"box_size_m": (SIZE_M,) * 3},
]


@pytest.mark.parametrize("known", KNOWN, ids=["x", "y", "z", "box"])
def test_a_known_length_places_one_camera(known: dict[str, object]) -> None:
    """The mean of 20 chi-squares of 6 is above 9.8 for one set of 20 independent views in 10,000."""
    nees, shares = [], []
    for k in range(20):
        rotation, vertex = pose(yaw=28.0 + 1.6 * k, pitch=20.0 + 1.1 * k, roll=-8.0 + k)
        vertex = vertex + (0.004 * k, -0.003 * k, 0.03 * k)
        estimate = CornerPoseEstimator(CAMERA, **known)(seen(rotation, vertex, COLOURS, seed=k))
        assert estimate.pose is not None
        assert estimate.place_reason == ""
        error = errors(estimate.pose, rotation, vertex)
        nees.append(error @ np.linalg.solve(estimate.pose.covariance, error))
        shares.append(np.linalg.norm(error[3:]) / np.linalg.norm(vertex))
        assert np.allclose(estimate.edge_lengths_m, SIZE_M, rtol=0.01)
    assert np.mean(nees) < 9.8
    assert np.max(shares) < 0.005


@pytest.mark.parametrize("rim_m", [0.025, 0.03, 0.035, 0.04, 0.05])
def test_labels_end_no_edge(rim_m: float) -> None:
    """Edges of labels, 7 to 16 pixels away from those of the cuboid, seem to meet these before they end."""
    for k in range(4):
        rotation, vertex = pose(yaw=28.0 + 5.0 * k, pitch=20.0 + 4.0 * k)
        image = seen(rotation, vertex, COLOURS, seed=k, rim_m=rim_m)
        estimate = CornerPoseEstimator(CAMERA, edge_length_m=SIZE_M)(image)
        assert estimate.pose is not None
        assert np.linalg.norm(errors(estimate.pose, rotation, vertex)[3:]) < 0.005
        lengths = estimate.edge_lengths_m[[0, 2]]
        assert (np.abs(lengths - SIZE_M) < 4.0 * estimate.edge_length_sigmas_m[[0, 2]]).all()


def test_a_length_that_is_known_roughly_says_so() -> None:
    rotation, vertex = pose()
    image = seen(rotation, vertex, COLOURS)
    exact, rough = (
        CornerPoseEstimator(CAMERA, edge_length_m=SIZE_M, length_sigma_m=sigma)(image).pose for sigma in (0.0, 0.006)
    )
    assert exact is not None
    assert rough is not None
    # One length stretches everything alike: 2 % of it are 2 % of the distance, and nothing of the attitude.
    added = rough.covariance - exact.covariance
    stretched = np.zeros(6)
    stretched[3:] = 0.02 * exact.vertex_m
    assert np.allclose(added, np.outer(stretched, stretched), atol=1e-9)
    assert np.allclose(rough.vertex_m, exact.vertex_m)


def test_a_grey_box_needs_no_names() -> None:
    rotation, vertex = pose()
    image = seen(rotation, vertex, GREYS)
    known = {"down": rotation[:, 1], "right_handed": True, "method": "general"}
    for length in ({"edge_length_m": SIZE_M}, {"box_size_m": (SIZE_M,) * 3, "length_sigma_m": 0.001}):
        estimate = CornerPoseEstimator(CAMERA, **known, **length)(image)
        assert estimate.pose is not None
        assert estimate.place_reason == ""
        error = errors(estimate.pose, estimate.pose.camera_from_object, vertex)
        assert np.linalg.norm(error[3:]) < 0.01 * np.linalg.norm(vertex)
        assert error[3:] @ np.linalg.solve(estimate.pose.covariance[3:, 3:], error[3:]) < 21.1  # one in 10,000
    # A box that is not a cube is none of this shape, whichever way it stands.
    other = CornerPoseEstimator(CAMERA, **known, box_size_m=(0.3, 0.3, 0.2))(image)
    assert other.pose is not None
    assert other.pose.vertex_m is None
    assert other.place_reason == "the edges do not fit the known lengths"
    # Which edge is upright is not known without the direction down.
    unknown = CornerPoseEstimator(CAMERA, method="general", edge_length_m=SIZE_M, right_handed=True)(image)
    assert all(one.vertex_m is None for one in unknown.hypotheses)


def test_another_corner_is_another_object() -> None:
    """Its number did not grow: what is followed has no place."""
    rotation, vertex = pose()
    places = [vertex, vertex, vertex + 0.25 * rotation[:, 0], vertex + 0.25 * rotation[:, 0]]
    known = {"down": rotation[:, 1], "right_handed": True, "method": "general", "edge_length_m": SIZE_M}
    estimator, names, objects = CornerPoseEstimator(CAMERA, **known), [], []
    for place in places:
        found = estimator(seen(rotation, place, GREYS))
        names.append(found.corners[0].id)
        objects.append(found.object)
        estimator = pickle.loads(pickle.dumps(estimator))
    assert names[0] is not None
    assert names == [names[0], names[0], names[2], names[2]]
    assert names[2] not in (None, names[0])
    assert objects == [1, 1, 2, 2]


def test_a_pose_does_not_tell_which_of_its_edges_is_upright() -> None:
    """Not in any frame, unless it was told in one; and it is told for as long as the box is followed."""
    rotation, vertex = pose()
    image, down = seen(rotation, vertex, GREYS), rotation[:, 1]
    for scale in ({"camera_height_m": float(down @ vertex)}, {"edge_length_m": SIZE_M}):
        estimator = CornerPoseEstimator(CAMERA, method="general", right_handed=True, **scale)
        for _ in range(3):
            untold = estimator(image)
            assert untold.pose is not None
            assert untold.place_reason == "nothing tells which edge is the upright one"
        again = pickle.loads(pickle.dumps(estimator))
        for one in (estimator, again):
            assert one(image, gravity=(down, 0.01)).place_reason == ""
            assert one(image).place_reason == ""
        assert pickle.loads(pickle.dumps(again))(image).place_reason == ""


def test_a_corner_above_the_camera_has_no_height_below_it_in_any_frame() -> None:
    rotation, vertex = pose()
    down = rotation[:, 1]
    known = {"camera_height_m": float(down @ vertex)}
    for method, faces in (("general", GREYS), ("coloured", COLOURS)):
        image = seen(rotation, vertex, faces)
        estimator = CornerPoseEstimator(CAMERA, method=method, right_handed=True, down=-down, **known)
        assert [estimator(image).place_reason for _ in range(3)] == ["the corner is not below the camera"] * 3
        estimator = CornerPoseEstimator(CAMERA, method=method, right_handed=True, **known)
        assert estimator(image, gravity=(-down, 0.01)).place_reason == "the corner is not below the camera"
        assert estimator(image, gravity=(down, 0.01)).place_reason == ""


def covered(image: np.ndarray, middle: np.ndarray, half_px: int, slope: float) -> np.ndarray:
    """The image with a grey board before a place."""
    board = np.array([[-1, -1], [1, -1 + slope], [1 - slope, 1], [-1 - slope, 1 - slope]]) * half_px + middle
    canvas = image.copy()
    cv2.fillPoly(canvas, [np.rint(board * 16).astype(np.int32)], (90, 90, 90), lineType=cv2.LINE_AA, shift=4)
    return canvas


@pytest.mark.parametrize("slope", [0.0, 0.25, -0.3])
@pytest.mark.parametrize("faces", [COLOURS, GREYS], ids=["coloured", "grey"])
def test_an_end_that_is_hidden_tells_no_place(faces: dict[str, tuple[int, int, int]], slope: float) -> None:
    rotation, vertex = pose()
    image = seen(rotation, vertex, faces)
    known = {"edge_length_m": SIZE_M, "down": rotation[:, 1], "right_handed": True}
    known |= {"method": "coloured" if faces is COLOURS else "general"}
    for share in (0.55, 0.7, 0.85, 1.0):
        end = vertex + share * SIZE_M * rotation[:, 1]
        middle = end[:2] / end[2] * 400.0 + (240.0, 180.0)
        # From this place to beyond the end.
        half_px = 14 + int(0.5 * (1.0 - share) * 120)
        estimate = CornerPoseEstimator(CAMERA, **known)(covered(image, middle + (0.0, half_px - 14), half_px, slope))
        assert all(one.vertex_m is None for one in estimate.hypotheses), share
        assert bool(estimate.place_reason) == bool(estimate.hypotheses)


def test_an_edge_that_leaves_the_image_tells_no_place() -> None:
    rotation, vertex = pose()
    poses = 0
    for down_m in (0.39, 0.42, 0.45):
        moved = vertex + (0.0, down_m, 0.0)
        end = moved + SIZE_M * rotation[:, 1]
        assert end[1] / end[2] * 400.0 + 180.0 > 360.0
        image = seen(rotation, moved, COLOURS)
        estimate = CornerPoseEstimator(CAMERA, edge_length_m=SIZE_M)(image)
        if estimate.pose is None:
            continue
        poses += 1
        assert estimate.pose.vertex_m is None
        assert estimate.place_reason == "the edges of known length leave the image"
        # The ends of others may be seen.
        other = CornerPoseEstimator(CAMERA, box_size_m=(SIZE_M,) * 3)(image)
        if other.pose is not None and other.pose.vertex_m is not None:
            assert np.linalg.norm(other.pose.vertex_m - moved) < 0.005 * np.linalg.norm(moved)
    assert poses > 0


def test_a_wrong_size_is_refused() -> None:
    rotation, vertex = pose()
    image = seen(rotation, vertex, COLOURS)
    estimate = CornerPoseEstimator(CAMERA, box_size_m=(0.3, 0.3, 0.26))(image)
    assert estimate.pose is not None
    assert estimate.pose.vertex_m is None
    assert estimate.place_reason == "the edges do not fit the known lengths"
    assert pickle.loads(pickle.dumps(estimate)) == estimate
    assert CornerPoseEstimator(CAMERA)(image).place_reason.startswith("one camera, of which neither")


@pytest.mark.parametrize(
    ("known", "complaint"),
    [
        ({"edge_length_m": 0.0}, "edge_length_m = 0"),
        ({"box_size_m": (0.1, -0.1, 0.1)}, "box_size_m"),
        ({"length_sigma_m": -1.0}, "length_sigma_m"),
        ({"known_edge": "w"}, "known_edge"),
        ({"edge_length_m": 0.3, "camera_height_m": 1.0}, "camera_height_m and edge_length_m"),
        ({"edge_length_m": 0.3, "box_size_m": (0.3,) * 3}, "edge_length_m and box_size_m"),
        ({"edge_length_m": 0.3, "known_edge": "x", "method": "general"}, "known_edge"),
        ({"edge_length_m": 0.3, "method": "paper"}, "paper"),
    ],
)
def test_what_does_not_go_together_is_refused(known: dict[str, object], complaint: str) -> None:
    with pytest.raises(InvalidInputError, match=complaint):
        CornerPoseEstimator(CAMERA, **known)


def test_two_cameras_tell_the_scale_themselves() -> None:
    for known in ({"edge_length_m": SIZE_M}, {"box_size_m": (SIZE_M,) * 3}):
        with pytest.raises(InvalidInputError, match=r"two cameras"):
            CornerPoseEstimator(CAMERA, CAMERA, LEFT_FROM_RIGHT, **known)


def test_the_command_line_takes_lengths(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rotation, vertex = pose()
    CAMERA.save(tmp_path / "one.toml")
    tiltvp.write_image(tmp_path / "left" / "a.png", seen(rotation, vertex, COLOURS))
    words = ["corner", str(tmp_path / "left"), "--calibration", str(tmp_path / "one.toml"), "--overwrite"]
    trajectory = tmp_path / "trajectory.txt"
    for known in (["--edge-length-m", "0.3", "--known-edge", "x"], ["--box-size-m", "0.3", "0.3", "0.3"]):
        assert main([*words, *known, "--length-sigma-m", "0.001", "--trajectory", str(trajectory)]) == 0
        place = np.loadtxt(trajectory)[1:4]
        assert np.linalg.norm(place + rotation.T @ vertex) < 0.012
        assert "without a place" not in capsys.readouterr().out
    assert main([*words, "--box-size-m", "0.3", "0.3", "0.2"]) == 0
    assert "without a place: the edges do not fit the known lengths (1)" in capsys.readouterr().out
    assert main([*words, "--edge-length-m", "0.3", "--camera-height-m", "1"]) == 2


def test_one_image_has_the_attitude_of_most_of_its_edges() -> None:
    """By its corners alone it is 0.5 degrees off."""
    left, right = zed_cameras(1280)
    sequence = StereoSequence(Room("office", 10806), left=left, right=right, frames=10, seed=10806)
    down = -sequence.imu(seed=10806).forces_m_s2.mean(axis=0)
    image = sequence.render(0)[0]
    found = CornerPoseEstimator(left, method="general", down=down)(image).pose
    alone = CornerPoseEstimator(left, method="general", down=down, parallel_max_rad=0.0)(image).pose
    assert found is not None
    assert alone is not None
    room = sequence.poses[0][:3, :3].T @ sequence.corners[0].world_from_object
    # Which level edge of a corner is its first is not told: axes are compared, not their names.
    cosines = np.abs(room.T @ found.camera_from_object)
    assert math.degrees(math.acos(min(1.0, float(cosines.max(axis=0).min())))) < 0.1
    sigmas = [math.degrees(math.sqrt(np.trace(pose.covariance[:3, :3]))) for pose in (found, alone)]
    assert sigmas[0] < 0.2 < sigmas[1]
