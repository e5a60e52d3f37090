"""Drives: the same bytes in any order, odometry that adds up, truth on the edges, whole folders or none."""

from __future__ import annotations

import csv
import pickle
from pathlib import Path

import numpy as np
import pytest

from recordings import motions_of
from tiltvp._core import leaning_from_upright, normal_from_alpha_beta
from tiltvp.cli import main
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.driving import DRIVE_KINDS, drive_room, write_drive
from tiltvp.lab.datasets.folder import read_dataset
from tiltvp.synth import MIRROR_BLIND_RAD, WALL_PATTERNS, Drive, Room, mirror_camera

pytestmark = pytest.mark.slow

FRAMES = 12


@pytest.fixture(scope="module")
def room() -> Room:
    return Room("corridor", 2, light_spacing_m=0.6, floor_gloss=0.5, wall_pattern="panels")


@pytest.fixture(scope="module")
def drive(room: Room) -> Drive:
    return Drive(
        room,
        camera=mirror_camera().scaled(0.3),
        blind_rad=MIRROR_BLIND_RAD,
        mount=(0.1, -0.05, 0.2, 0.5),
        frames=FRAMES,
        seed=3,
        bumps_max_rad=0.08,
    )


def test_a_drive_is_a_value(drive: Drive, room: Room) -> None:
    again = pickle.loads(pickle.dumps(drive))
    assert again == drive
    assert hash(again) == hash(drive)
    assert again.room == room
    assert np.array_equal(again.odometry, drive.odometry)
    assert np.array_equal(again.render(7, threads=1).bgr, drive.render(7).bgr)
    assert repr(drive).startswith('Drive(Room("corridor", 2, light_spacing_m=0.6')
    assert drive != Drive(room, camera=drive.camera, frames=FRAMES)
    assert len(drive) == drive.frames == FRAMES


def test_odometry_adds_up_to_the_poses(drive: Drive) -> None:
    assert drive.odometry.shape == drive.true_odometry.shape == drive.tilts.shape == (FRAMES, 2)
    x, y, yaw = drive.poses[0]
    for (left, right), pose in zip(drive.true_odometry[1:], drive.poses[1:], strict=True):
        distance, half = (left + right) / 2, (right - left) / drive.wheel_base_m / 2
        chord = distance * np.sinc(half / np.pi)
        x, y, yaw = x + chord * np.cos(yaw + half), y + chord * np.sin(yaw + half), yaw + 2 * half
        assert np.allclose([x, y], pose[:2], atol=1e-12)
        assert np.cos(yaw - pose[2]) == pytest.approx(1.0)
    assert not np.array_equal(drive.odometry, drive.true_odometry)
    assert np.allclose(drive.motions[:, 0], drive.odometry.mean(axis=1))
    assert np.allclose(drive.motions[:, 1], np.diff(drive.odometry, axis=1)[:, 0] / drive.wheel_base_m)
    assert drive.tilts[:, 0].max() <= 0.08 + 1e-12
    assert drive.tilts[:, 0].max() > 0.0


def test_truth_is_where_the_edges_are(drive: Drive) -> None:
    for frame in (0, FRAMES - 1):
        truth = drive.truth(frame)
        count = len(truth.edges)
        assert count > 10
        assert truth.elevations_rad.shape == (count, 2)
        assert (np.diff(truth.edges) > 0).all()
        x, y, yaw = drive.poses[frame]
        mx, my, _, _ = drive.mount
        center = np.array([x + np.cos(yaw) * mx - np.sin(yaw) * my, y + np.sin(yaw) * mx + np.cos(yaw) * my])
        to = drive.edges_m[truth.edges, :2] - center
        assert np.allclose(np.cos(np.arctan2(to[:, 1], to[:, 0]) - yaw - truth.bearings_rad), 1.0)
        assert ((truth.visible_share > 0) & (truth.visible_share <= 1)).all()


def test_true_directions_are_seen_by_the_camera(drive: Drive) -> None:
    """Levelled bearing and elevation, leaned and turned into the camera, are in the image."""
    truth = drive.truth(5)
    alpha, beta = drive.tilts[5]
    elevation = truth.elevations_rad.mean(axis=1)
    cosine = np.cos(elevation)
    azimuth = truth.bearings_rad
    upright = np.stack([cosine * np.cos(azimuth), cosine * np.sin(azimuth), np.sin(elevation)], axis=1)
    leaning = upright @ leaning_from_upright(normal_from_alpha_beta(alpha, beta)).T
    whole = truth.visible_share > 0.5
    pixels = drive.camera.project(leaning @ drive.robot_from_camera)
    assert whole.sum() > 5
    assert np.isfinite(pixels[whole]).all()


def test_wrong_arguments_are_refused(drive: Drive, room: Room) -> None:
    camera = drive.camera
    with pytest.raises(InvalidInputError, match="frame"):
        drive.render(FRAMES)
    with pytest.raises(InvalidInputError, match="mount"):
        Drive(room, camera=camera, mount=(0.0, 0.0))
    with pytest.raises(InvalidInputError, match="lighting"):
        Drive(room, camera=camera, lighting=2.0)
    with pytest.raises(InvalidInputError, match="wall_pattern"):
        Room("corridor", 0, wall_pattern="plaid")
    with pytest.raises(InvalidInputError, match="extent"):
        Room("corridor", 0, extent=9.0)
    with pytest.raises(InvalidInputError, match="kind"):
        drive_room("street")
    assert "hall" in DRIVE_KINDS
    assert WALL_PATTERNS == ("drawn", "stripes", "panels", "tiles")


def test_a_drive_as_a_folder(drive: Drive, tmp_path: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    write_drive(drive, one)
    write_drive(drive, two, threads=3)
    names = sorted(str(path.relative_to(one)) for path in one.rglob("*") if path.is_file())
    assert {"camera.toml", "dataset.toml", "drive.toml", "edges.csv", "odometry.csv", "poses.csv", "truth.csv"} < {
        *names
    }
    for name in names:
        assert (one / name).read_bytes() == (two / name).read_bytes()
    dataset = read_dataset(one)
    assert len(dataset.images) == FRAMES
    assert np.array_equal(dataset.read(dataset.images[4]), drive.render(4).gray)
    motions = motions_of(one / "odometry.csv", [image.path for image in dataset.images])
    assert np.allclose([(m.distance_m, m.yaw_rad) for m in motions], drive.motions)
    lines = (one / "truth.csv").read_text(encoding="utf-8").splitlines()
    rows = [row for row in csv.DictReader(lines) if row["frame"] == "4"]
    truth = drive.truth(4)
    assert [int(row["edge"]) for row in rows] == truth.edges.tolist()
    assert [float(row["bearing_rad"]) for row in rows] == truth.bearings_rad.tolist()
    with pytest.raises(InvalidInputError, match="exists"):
        write_drive(drive, one)


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "drive"
    words = ["--frames", "3", "--kind", "narrow", "--camera", "mirror", "--resolution-scale", "0.2", "--seed", "1"]
    code = main(["dataset", "drive", "--out", str(out), *words, "--bumps-deg", "3", "--mount", "0.1", "0", "10", "0.5"])
    assert code == 0
    assert "3 frames" in capsys.readouterr().out
    assert len(list((out / "images").glob("*.png"))) == 3
    assert main(["dataset", "check", str(out)]) == 0
    for name, line, told in (
        ("poses.csv", "1,x", "line 3: 2 cells"),
        ("odometry.csv", "000001.png,x,0,0,0", "left_m = 'x'"),
    ):
        rows = (out / name).read_text().splitlines()
        (out / name).write_text("\n".join([*rows[:2], line, *rows[3:]]))
        assert main(["dataset", "check", str(out)]) == 1
        assert told in capsys.readouterr().out
