"""What `tiltvp measure corners` measures: the closed form, noise against its bound, poses in rendered sequences."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import polars as pl
import pytest

from tiltvp.cameras import Camera
from tiltvp.cli import main
from tiltvp.corner import CornerHypothesis
from tiltvp.errors import InvalidInputError, MissingExtraError
from tiltvp.lab.evaluation.corner_closed_form import exact_poses, noisy_poses, summarise_exact, summarise_noisy
from tiltvp.lab.evaluation.corner_inertial import IMAGE, compare_inertial, conventional_angles
from tiltvp.lab.evaluation.corner_markers import MarkerLooks
from tiltvp.lab.evaluation.corner_rooms import lengths_off, truth_near
from tiltvp.lab.evaluation.corner_scenes import CORNER_SCENES, CornerScene, fresh_rooms
from tiltvp.lab.evaluation.corners import CornerExperiment, measure_corners, summarise_corners, summarise_rooms
from tiltvp.lab.plots.corner_poses import pose_plot
from tiltvp.lab.plots.corners import corner_errors, inertial_errors
from tiltvp.lab.plots.picture import figure_picture
from tiltvp.stereo_scenes import SceneCorner

pytestmark = pytest.mark.slow


def test_the_truth_is_among_the_hypotheses() -> None:
    table = exact_poses(5000, seed=3)
    assert table["pose"].to_list() == list(range(5000))
    summary = summarise_exact(table).row(0, named=True)
    assert summary["without"] == 0
    assert summary["max_rad"] < 1e-9
    assert summary["hypotheses"] >= 2
    assert table.equals(exact_poses(5000, seed=3))


def test_markers_are_looked_for_beside_corners() -> None:
    options = {"distance_m": (1.0, 1.3), "samples": 2}
    scene = CornerScene("markers", marker_m=0.2, options=options, known={"right_handed": True})
    table, _ = measure_corners(CornerExperiment(frames=10, scenes=(scene,)), threads=2)
    rms = {row["method"]: row for row in summarise_corners(table).iter_rows(named=True)}
    by_markers = [row for method, row in rms.items() if method.startswith("cv2.aruco")]
    assert len(by_markers) == 6
    for row in by_markers:
        assert row["found"] == 1.0
        assert row["flips"] == 0
        assert row["NEES of 6"] is None
        # Markers where they are not, or the wrong way up, would be off by far more.
        assert rms["coloured"]["attitude rms deg"] < row["attitude rms deg"] < 2.0
        assert rms["coloured"]["position rms mm"] < row["position rms mm"] < 30.0
    sequence = CornerScene("none", options=options).sequence(2, 5, 2)
    looks = MarkerLooks(sequence, 0.2)
    looks.look(sequence.render(0))
    assert [pose for looked in looks.poses.values() for pose, _ in looked] == [None] * 6


def test_corners_of_markers_are_where_they_are_drawn() -> None:
    camera = Camera.pinhole(width=320, height=240, fx=300.0, fy=300.0, cx=159.5, cy=119.5)
    looks = MarkerLooks(CornerScene("none").sequence(2, 5, 2), 0.2)
    marker = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50), 0, 600)
    edge = np.array([[-0.5, -0.5], [599.5, -0.5], [599.5, 599.5], [-0.5, 599.5]], np.float32)
    off: dict[str, list[np.ndarray]] = {name: [] for name in looks._detectors}
    rng = np.random.default_rng(0)
    for turn in np.linspace(-0.4, 0.4, 8):
        along = 80.0 * np.array([math.cos(turn), math.sin(turn)])
        across = np.array([-along[1], along[0]])
        corners = np.array([120.0, 70.0]) + rng.uniform(0.0, 1.0, 2) + [np.zeros(2), along, along + across, across]
        to = cv2.getPerspectiveTransform(edge, (16.0 * (corners + 0.5) - 0.5).astype(np.float32))
        drawn = cv2.warpPerspective(marker, to, (16 * 320, 16 * 240), borderValue=255, flags=cv2.INTER_NEAREST)
        light = cv2.GaussianBlur(cv2.resize(drawn, (320, 240), interpolation=cv2.INTER_AREA) / 255.0, (0, 0), 0.8)
        image = np.rint(20.0 + 200.0 * (0.02 + 0.98 * light) ** (1 / 2.2)).astype(np.uint8)
        for name, detector in looks._detectors.items():
            found = looks._corners(detector, camera, image)[0]
            off[name].append(300.0 * found + [159.5, 119.5] - corners)
    for name, each in off.items():
        assert np.abs(np.mean(each, axis=(0, 1))).max() < 0.1, name
    # Black on white looks smaller by the display curve, along both sides of each corner.
    inwards = {name: float(np.mean(np.mean(each, axis=0)[0])) for name, each in off.items()}
    assert inwards[", AprilTag's corners"] > 0.15
    assert abs(inwards[", AprilTag's corners, linear light"]) < 0.1


def test_noise_is_as_the_bound_says() -> None:
    """300 poses: the mean of as many chi-squares of 3 over 3 is within 0.8 and 1.25 but for one seed in 10,000."""
    summary = summarise_noisy(noisy_poses(300, seed=5)).row(0, named=True)
    assert 0.8**0.5 < summary["weighted_over_bound"] < 1.25**0.5
    assert 2.4 < summary["nees_of_3"] < 3.75
    assert 0.85 < summary["rms_over_bound"] < 1.15
    assert summary["firm"] > 200


@pytest.fixture(scope="module")
def measured() -> tuple[pl.DataFrame, pl.DataFrame]:
    scene = CornerScene("cuboid", options={"distance_m": (1.0, 1.3), "samples": 2})
    return measure_corners(CornerExperiment(frames=12, scenes=(scene,)), threads=2)


def test_poses_of_the_cuboid_are_close(measured: tuple[pl.DataFrame, pl.DataFrame]) -> None:
    table, inertial = measured
    summary = summarise_corners(table).row(0, named=True)
    assert summary["frames"] == 12
    assert summary["found"] > 0.9
    assert summary["flips"] == 0
    assert summary["attitude rms deg"] < 0.2
    assert summary["position rms mm"] < 10.0
    told = ("image, told down and turns", "image, one grey camera", "image, one grey camera, told down and turns")
    assert set(inertial["method"]) >= {"image", *told, "gyroscope + image", "gyroscope + accelerometer, Mahony"}
    assert inertial.filter(pl.col("method") == told[0])["roll"].to_list() == pytest.approx(
        inertial.filter(pl.col("method") == "image")["roll"].to_list()
    )
    assert summary["method"] == "coloured"
    published, alone, *scaled = summarise_corners(table).slice(1).iter_rows(named=True)
    assert (published["method"], published["flips"]) == ("paper", 0)
    assert 2.0 * summary["attitude rms deg"] < published["attitude rms deg"] < 1.0
    assert alone["method"] == "coloured, one camera, height known"
    assert alone["found"] == 1.0
    # 5 mm of a height of half a metre are 1 %.
    assert alone["% of distance"] < 2.0
    assert [row["method"] for row in scaled] == [
        "coloured, one camera, edge y known",
        "coloured, one camera, size known",
    ]
    # An edge whose end is hidden tells no place, and says so.
    unplaced = table.filter(~pl.col("found"))
    assert set(unplaced["reason"]) <= {"no edge of known length is seen up to its end"}
    for row, found_min in zip(scaled, (0.75, 1.0), strict=True):
        assert row["found"] >= found_min
        # 1 mm of 0.36 m is 0.3 %; three times that.
        assert row["% of distance"] < 0.9
        assert row["NEES of 6"] < 11.0
    # Means of 12 chi-squares of 6 are above 11 for one seed in 1,000,000; frames err together a little.
    assert max(summary["NEES of 6"], published["NEES of 6"], alone["NEES of 6"]) < 11.0
    found = table.filter("found")
    angles = found.select((pl.col("roll_deg") ** 2 + pl.col("pitch_deg") ** 2 + pl.col("yaw_deg") ** 2).sqrt())
    assert np.allclose(angles.to_series(), found["attitude_deg"])


def test_rooms_are_counted_that_have_a_pose_in_nearly_all_frames() -> None:
    rooms = fresh_rooms(2)
    kinds = [room.kind for room in rooms]
    assert len(set(kinds)) == 3
    assert kinds[3:] == kinds[:3]
    assert {room.share for room in rooms} == {1.0}
    rows = []
    for number, room in enumerate(rooms):
        for frame in range(20):
            # One of twenty frames is none of the second room's, two of the last one's.
            found = frame >= {1: 1, 5: 2}.get(number, 0)
            seen = {"corner": 4, "attitude_deg": 0.1, "position_m": 0.002, "nees": 30.0 if number == 0 else 5.0}
            row = {"scene": room.name, "method": "general"}
            told = {"surface": 4.0 if frame == 19 else 0.0, "lengths": 3, "lengths_off": int(frame == 9)} | seen
            rows.append(row | {"found": found} | (told if found else {"corner": -1}))
            # One camera's NEES is of three numbers.
            alone = {"method": "general, one camera", "attitude_deg": 0.2, "nees": 20.0 if number == 2 else 3.0}
            rows.append(row | alone | {"found": True, "corner": -1})
    table = pl.DataFrame(rows, schema_overrides={"corner": pl.Int64})
    every = summarise_rooms(table, rooms).rows(named=True)
    *by_kind, of_all = [row for row in every if not row["kind"].endswith("one camera")]
    *alone, of_all_alone = [row for row in every if row["kind"].endswith("one camera")]
    assert [row["% NEES > 99.9 %"] for row in alone] == [0.0, 0.0, 50.0]
    assert (of_all_alone["frames"], of_all_alone["listed"], of_all_alone["median deg"]) == (120, 120, 0.2)
    assert [row["rooms with >= 95% found"] for row in by_kind] == [2, 2, 1]
    assert [row["% NEES > 99.9 %"] for row in by_kind] == [50.0, 0.0, 0.0]
    assert (of_all["kind"], of_all["rooms"], of_all["rooms with >= 95% found"]) == ("all", 6, 5)
    assert (of_all["frames"], of_all["listed"]) == (120, 117)
    assert of_all["% off surface"] == pytest.approx(100 * 6 / 117)
    assert (of_all["median deg"], of_all["listed median mm"]) == (0.1, 2.0)
    assert (of_all["lengths"], of_all["% lengths off"]) == (3 * 117, pytest.approx(100 * 6 / 351))
    assert (of_all_alone["lengths"], of_all_alone["% lengths off"]) == (0, None)


def test_in_rooms_axes_may_be_named_at_will_and_corners_lack_in_the_list() -> None:
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    listed = SceneCorner(np.array([0.2, 0.1, 2.0]), turn.T, np.ones(3), "solid")
    front = SceneCorner(np.array([0.2, 0.1, 2.04]), turn.T, np.array([0.02, 0.3, 0.4]), "solid")
    sight = [0]
    sequence = SimpleNamespace(
        corners=(listed, front),
        times_s=np.zeros(1),
        poses_at=lambda _: np.eye(4)[None],
        truth=lambda _: SimpleNamespace(corners=sight),
    )

    def seen(rotation: np.ndarray, vertex: tuple[float, float, float]) -> CornerHypothesis:
        return CornerHypothesis.from_dict({
            "camera_from_object": rotation.tolist(), "edges": listed.edges.tolist(), "vertex_m": list(vertex),
            "covariance": np.eye(6).tolist(), "probability": 1.0, "right_handed": True, "misfit": 0.0,
        })  # fmt: skip

    over = listed.world_from_object @ np.diag([-1.0, -1.0, 1.0])
    own = np.array([1.0, 0.0, 2.0])
    number, truth = truth_near(sequence, 0, seen(over, (0.2, 0.1, 2.03)), own)  # type: ignore[arg-type]
    assert number == 0
    assert np.allclose(truth[:3, :3], over)
    assert np.allclose(truth[:3, 3], listed.position_m)
    # What is 10 pixels beside it is something else; of two the nearer counts; one that is hidden is not seen.
    assert truth_near(sequence, 0, seen(over, (0.23, 0.1, 2.0)), own)[0] == -1  # type: ignore[arg-type]
    sight.append(1)
    number, truth = truth_near(sequence, 0, seen(over, (0.2, 0.1, 2.03)), own)  # type: ignore[arg-type]
    assert number == 1
    assert np.allclose(truth[:3, 3], front.position_m)
    sight.clear()
    assert truth_near(sequence, 0, seen(over, (0.2, 0.1, 2.03)), own)[0] == -1  # type: ignore[arg-type]
    sight.append(0)
    number, truth = truth_near(sequence, 0, seen(over, (1.01, 0.0, 2.0)), own)  # type: ignore[arg-type]
    assert number == -1
    assert np.allclose(truth[:3, :3], over)
    assert np.allclose(truth[:3, 3], own)


def test_a_length_is_wrong_whose_edge_leaves_the_surfaces() -> None:
    """Of edges before a wall 3 m away: one on it, one that leaves it, one that tells no length."""
    wall = SimpleNamespace(distances=lambda _, bearings: 3.0 / bearings[:, 2])
    edges = np.array([[1.0, 0.0, 0.0], [0.0, 0.96, -0.28], [0.0, 0.0, 1.0]])
    pose = SimpleNamespace(vertex_m=np.array([-0.4, 0.2, 3.0]), edges=edges, covariance=1e-6 * np.eye(6))
    corner = SimpleNamespace(pose=pose, edge_lengths_m=np.array([0.7, 0.6, np.nan]))
    unplaced = SimpleNamespace(pose=SimpleNamespace(vertex_m=None))
    assert lengths_off(wall, 0, [corner, unplaced]) == (2, 1)  # type: ignore[arg-type, list-item]
    # As far off as the vertex may be farther away.
    pose.covariance = 0.01 * np.eye(6)
    assert lengths_off(wall, 0, [corner]) == (2, 0)  # type: ignore[arg-type, list-item]


def test_a_plot_of_poses_without_a_place_has_none() -> None:
    """Of one camera there were three empty panels of 5 centimetres."""
    known = {name: [0.0, 1.0] for name in ("time_s", "roll_deg", "pitch_deg", "yaw_deg", "x_m")}
    table = pl.DataFrame(known | {name: [None, None] for name in ("y_m", "z_m")})
    assert [axes.get_ylabel() for axes in pose_plot(table).axes] == [
        "roll (degrees)", "pitch (degrees)", "yaw (degrees)", "x (m)",
    ]  # fmt: skip


def test_plots_show_what_the_tables_hold(measured: tuple[pl.DataFrame, pl.DataFrame]) -> None:
    table, inertial = measured
    lost = table.with_columns(
        found=pl.col("frame") != 3,
        **{name: pl.when(pl.col("frame") != 3).then(name) for name in ("roll_deg", "pitch_deg", "yaw_deg")},
    )
    figure = corner_errors(lost, "cuboid")
    labels = [text.get_text() for axes in figure.axes for text in axes.get_legend().get_texts()]
    assert labels == ["roll", "pitch", "yaw", "x", "y", "z", "no corner found"]
    assert figure_picture(figure, dpi=50).std() > 5
    rows = inertial_errors(inertial).axes
    assert len(rows[0].lines) - 1 == 7
    assert len(rows[2].lines) - 1 == 5


def test_the_command_measures_and_refuses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["measure", "corners", "--poses", "500", "--noisy-poses", "20", "--frames", "0"]) == 0
    assert "Cramer-Rao" in capsys.readouterr().out
    asked = ["measure", "corners", "--poses", "0", "--noisy-poses", "0", "--frames", "20"]
    assert main([*asked, "--scenes", "attic"]) != 0
    assert CORNER_SCENES[0].name in capsys.readouterr().err
    assert main([*asked, "--scenes", "office", "--rooms", "1"]) != 0
    assert "--scenes office and --rooms 1" in capsys.readouterr().err
    (tmp_path / "file").write_text("")
    assert main([*asked, "--out", str(tmp_path / "file")]) != 0
    assert "expected a folder" in capsys.readouterr().err
    with pytest.raises(InvalidInputError, match="frames"):
        CornerExperiment(frames=1)


def test_the_corner_of_one_grey_camera_may_be_along_the_walls_and_its_upright_edge_go_up() -> None:
    """The cuboid stands askew in the room, so that its yaw is no error of a corner there, nor an edge's sense."""
    sequence = CornerScene("cuboid").sequence(12, 8401, 2)
    poses = sequence.poses_at(sequence.times_s)
    cuboid = [pose[:3, :3].T @ sequence.corners[sequence.corner].world_from_object for pose in poses]
    along = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    walls = [pose[:3, :3].T @ along for pose in poses]
    off = [np.degrees(np.arccos(0.5 * (np.trace(a.T @ b) - 1.0))) % 90.0 for a, b in zip(cuboid, walls, strict=True)]
    assert 20.0 < off[0] < 70.0
    named = [*cuboid[:6], *walls[6:]]
    up = [attitude @ np.diag([1.0, -1.0, -1.0]) for attitude in named]
    table = compare_inertial(sequence, {IMAGE: cuboid, "image, one grey camera": [*up[:3], *named[3:9], *up[9:]]})
    errors = table.filter(pl.col("method").str.starts_with("image")).select("roll", "pitch", "yaw").to_numpy()
    assert errors.shape == (24, 3)
    assert np.abs(errors).max() < 1e-6


def test_without_the_inertial_package_its_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ahrs.filters", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'tiltvp\[imu\]'"):
        conventional_angles(SimpleNamespace(), "complementary", 0.5)
