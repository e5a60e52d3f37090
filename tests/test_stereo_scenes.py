"""Stereo sequences: values, truth that fits the images, folders whole or none, an inertial sensor that can be fused."""

from __future__ import annotations

import csv
import pickle
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml

import tiltvp
from tiltvp._core import option_fields
from tiltvp.cli import main
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.check import check_dataset
from tiltvp.lab.datasets.stereo import write_stereo
from tiltvp.streams import InertialSamples, open_frames
from tiltvp.synth import Laboratory, Room, StereoSequence, zed_cameras

pytestmark = pytest.mark.slow

FRAMES = 8


@pytest.fixture(scope="module")
def laboratory() -> Laboratory:
    return Laboratory(3, light_spacing_m=1.0)


def small_cameras() -> tuple[tiltvp.Camera, tiltvp.Camera]:
    left, right = (camera.scaled(0.1) for camera in zed_cameras())
    return left, right


@pytest.fixture(scope="module")
def sequence(laboratory: Laboratory) -> StereoSequence:
    left, right = small_cameras()
    return StereoSequence(laboratory, left=left, right=right, frames=FRAMES, seed=5, distance_m=(1.0, 1.5))


def test_a_sequence_is_a_value(sequence: StereoSequence, laboratory: Laboratory) -> None:
    again = pickle.loads(pickle.dumps(sequence))
    assert again == sequence
    assert hash(again) == hash(sequence)
    assert again.scene == laboratory == pickle.loads(pickle.dumps(laboratory))
    assert hash(again.scene) == hash(laboratory)
    for mine, theirs in zip(sequence.render(2, threads=1), again.render(2), strict=True):
        assert mine.dtype == np.uint8
        assert np.array_equal(mine, theirs)
    assert np.array_equal(sequence.poses, again.poses)
    assert repr(sequence).startswith("StereoSequence(Laboratory(3, light_spacing_m=1.0), frames=8")
    left, right = small_cameras()
    assert sequence != StereoSequence(laboratory, left=left, right=right, frames=FRAMES, seed=6)
    assert sequence != laboratory
    assert len(sequence) == FRAMES


def test_each_option_changes_something(laboratory: Laboratory) -> None:
    left, right = small_cameras()
    plain = StereoSequence(laboratory, left=left, right=right, frames=2)
    shifted = np.eye(4)
    shifted[0, 3] = 0.2
    others = {
        "left_from_right": shifted, "frame_rate_hz": 10.0, "distance_m": (1.0, 1.2), "roll_max_rad": 0.6,
        "period_s": 5.0, "samples": 1, "noise_sigma": 9.0, "blur_sigma_px": 3.0, "gain": 0.3,
    }  # fmt: skip
    for name, value in others.items():
        other = StereoSequence(laboratory, left=left, right=right, frames=2, **{name: value})  # type: ignore[arg-type]
        assert other != plain, name
        assert not np.array_equal(other.render(1)[1], plain.render(1)[1]), name
    sharp, blurred = (
        StereoSequence(laboratory, left=left, right=right, frames=2, period_s=1.0, exposure_s=open_s, noise_sigma=0.0)
        for open_s in (0.0, 0.1)
    )
    assert np.diff(sharp.render(1)[0].astype(int)).std() > 1.05 * np.diff(blurred.render(1)[0].astype(int)).std()
    for changed in ({"gamma_rad": 1.2}, {"size_m": (0.3, 0.3, 0.3)}, {"clutter": 0.9}, {"side_light": 0.1}):
        assert Laboratory(3, light_spacing_m=1.0, **changed) != laboratory  # type: ignore[arg-type]
    assert Laboratory(0, gamma_rad=1.2, light_spacing_m=1.0, side_light=0.0).gamma_rad == 1.2


def test_the_truth_is_where_the_images_have_it(sequence: StereoSequence) -> None:
    left, right = sequence.cameras
    corner = sequence.corners[sequence.corner]
    assert corner.kind == "solid"
    assert corner.gamma_rad == pytest.approx(np.pi / 2)
    assert np.allclose(corner.edges[1], [0, 0, -1])
    for frame in (0, FRAMES - 1):
        left_from_object = sequence.left_from_object(frame)
        right_from_object = np.linalg.inv(sequence.left_from_right) @ left_from_object
        truth = sequence.truth(frame, threads=2)
        at = truth.corners.tolist().index(sequence.corner)
        for camera, pose, image, vertex in zip(
            (left, right), (left_from_object, right_from_object), sequence.render(frame), truth.vertices_px[at],
            strict=True,
        ):  # fmt: skip
            assert np.allclose(camera.project(pose[:3, 3]), vertex)
            # Inside each of the three faces: top red, left green, right blue.
            inside = 0.17 * np.array([[1, 0, 1], [0, 1, 1], [1, 1, 0]])
            for channel, point in zip((2, 1, 0), inside, strict=True):
                u, v = np.rint(camera.project(pose[:3, :3] @ point + pose[:3, 3])).astype(int)
                levels = image[v, u].astype(int)
                assert int(np.argmax(levels)) == channel
                assert levels[channel] > np.delete(levels, channel).max() + 15
        assert (truth.edges_px[at] > 4).all()
    with pytest.raises(InvalidInputError, match="corner"):
        sequence.left_from_object(0, corner=10_000)
    for wrong in (-1, len(sequence), 0.5, "0"):
        with pytest.raises(InvalidInputError, match=r"frame = .*, expected a whole number below"):
            sequence.left_from_object(wrong)  # type: ignore[arg-type]


def test_an_image_attitude_fuses_with_the_gyroscope(laboratory: Laboratory) -> None:
    from tiltvp.lab.evaluation.corner_inertial import IMAGE, compare_inertial, summarise_inertial_comparison

    left, right = small_cameras()
    sequence = StereoSequence(laboratory, left=left, right=right, frames=300, seed=2)
    rng = np.random.default_rng(0)
    noise = [cv2.Rodrigues(np.deg2rad(0.2) * rng.standard_normal(3))[0] for _ in range(300)]
    seen = [turn @ sequence.left_from_object(k)[:3, :3] if k % 10 else None for k, turn in enumerate(noise)]
    table = summarise_inertial_comparison(compare_inertial(sequence, {IMAGE: seen}))
    rms = {row["method"]: row for row in table.to_dicts()}
    image, fused = rms["image"], rms["gyroscope + image"]
    assert image["readings"] == 270
    for name in ("roll rms", "pitch rms", "yaw rms"):
        assert fused[name] < image[name] < 0.3
    assert 0.2 < rms["gyroscope + accelerometer, Mahony"]["roll rms"] < 20.0
    assert rms["gyroscope + accelerometer, complementary"]["yaw rms"] is None


def test_the_inertial_sensor_has_bits_and_a_range(sequence: StereoSequence) -> None:
    imu = sequence.imu(rate_hz=100.0, seed=1)
    assert imu.rates_rad_s.shape == imu.forces_m_s2.shape == imu.rate_biases_rad_s.shape == (len(imu.times_s), 3)
    assert imu.times_s[-1] >= sequence.times_s[-1]
    steps = imu.rates_rad_s / (4.363323 / 32768)
    assert np.allclose(steps, np.rint(steps), atol=1e-6)
    narrow = sequence.imu(accelerometer=(0.0, 0.0, 0.0, 0.0, 5.0))
    assert np.abs(narrow.forces_m_s2).max() <= 5.0
    for wrong in ({"rate_hz": 0.0}, {"gyroscope": (1.0, 2.0)}, {"accelerometer": (0.0, 0.0, 0.0, 0.0, -1.0)}):
        with pytest.raises(InvalidInputError):
            sequence.imu(**wrong)  # type: ignore[arg-type]


def test_the_filter_refuses_what_makes_no_sense() -> None:
    fusion = tiltvp.ComplementaryFilter(np.eye(3), time_constant_s=1.0)
    assert fusion.time_constant_s == 1.0
    assert repr(fusion).startswith("ComplementaryFilter(time_constant_s=1.0")
    fusion.predict([0.1, 0.0, 0.0], 1.0)
    found = fusion.correct(np.eye(3))
    assert np.allclose(found, [-0.1, 0, 0])
    assert fusion.bias_rad_s[0] > 0
    assert fusion.bias_time_constant_s > 0
    assert np.allclose(fusion.reference_from_body @ fusion.reference_from_body.T, np.eye(3))
    again = pickle.loads(pickle.dumps(fusion))
    assert again == fusion
    for one in (fusion, again):
        one.predict([0.2, 0.1, 0.0], 0.5)
        one.correct(np.eye(3))
    assert again == fusion
    for state in ((1.0, 0.0, 0.0, 1.0), (np.nan, 0.0, 0.0, 0.0)):
        with pytest.raises(InvalidInputError, match="quaternion"):
            again.__setstate__((state, (0.0, 0.0, 0.0), 0.0))
    assert again == fusion
    for wrong in (lambda: fusion.predict([0, 0, 0], -1.0), lambda: fusion.correct(np.ones((3, 3)))):
        with pytest.raises(InvalidInputError):
            wrong()
    with pytest.raises(InvalidInputError, match="time_constant_s"):
        tiltvp.ComplementaryFilter(np.eye(3), time_constant_s=0.0)


@pytest.mark.parametrize("field", option_fields("ComplementaryFilter"), ids=lambda field: field["name"])
def test_every_option_of_the_filter_changes_something(field: dict[str, Any]) -> None:
    def answer(**options: float) -> list[float]:
        fusion = tiltvp.ComplementaryFilter(np.eye(3), **options)
        for _ in range(3):
            fusion.predict([0.1, 0.0, 0.0], 1.0)
            fusion.correct(np.eye(3))
        return [*fusion.reference_from_body.ravel(), *fusion.bias_rad_s]

    assert answer(**{field["name"]: 2.0 * field["default"]}) != answer()


def test_rooms_have_corners_to_look_at() -> None:
    room = Room("office", 3, light_spacing_m=1.0)
    left, right = small_cameras()
    sequence = StereoSequence(room, left=left, right=right, frames=5, seed=1)
    assert sequence.scene == room
    assert {corner.kind for corner in sequence.corners} == {"solid", "hollow"}
    assert sequence.corner in sequence.truth(4).corners


def test_folders_are_whole_and_say_what_is_true(sequence: StereoSequence, tmp_path: Path) -> None:
    done: list[None] = []
    write_stereo(sequence, tmp_path / "a", threads=1, advance=lambda: done.append(None))
    write_stereo(sequence, tmp_path / "b", threads=3)
    assert len(done) == FRAMES
    names = sorted(str(path.relative_to(tmp_path / "a")) for path in (tmp_path / "a").rglob("*") if path.is_file())
    assert len([name for name in names if name.endswith(".png")]) == 2 * FRAMES
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    left = tiltvp.Camera.load(tmp_path / "a" / "camchain.yaml", camera=0)
    assert left.parameters["fx"] == pytest.approx(sequence.cameras[0].parameters["fx"])
    chain = yaml.safe_load((tmp_path / "a" / "camchain.yaml").read_text())
    assert np.allclose(np.linalg.inv(chain["cam1"]["T_cn_cnm1"]), sequence.left_from_right)
    trajectory = np.loadtxt(tmp_path / "a" / "poses.txt")
    assert trajectory.shape == (FRAMES, 8)
    x, y, z, w = trajectory[3, 4:]
    axis = np.array([x, y, z])
    rotation = cv2.Rodrigues(axis / np.linalg.norm(axis) * 2 * np.arctan2(np.linalg.norm(axis), w))[0]
    assert np.allclose(rotation, sequence.left_from_object(3)[:3, :3].T, atol=1e-7)
    assert np.allclose(trajectory[3, 1:4], np.linalg.inv(sequence.left_from_object(3))[:3, 3], atol=1e-7)
    with (tmp_path / "a" / "truth.csv").open(newline="") as file:
        assert {row["frame"] for row in csv.DictReader(file)} == {str(frame) for frame in range(FRAMES)}
    samples, readings = sequence.imu(seed=sequence.seed), InertialSamples.read(tmp_path / "a" / "imu.csv")
    np.testing.assert_allclose(readings.times_s, samples.times_s)
    np.testing.assert_allclose(readings.rates_rad_s, samples.rates_rad_s)
    assert readings.accelerations_m_s2 is not None
    np.testing.assert_allclose(readings.accelerations_m_s2, samples.forces_m_s2)
    times_s = open_frames(tmp_path / "a" / "right").times_s
    assert times_s is not None
    assert times_s.tolist() == pytest.approx(sequence.times_s)
    assert check_dataset(tmp_path / "a") == []
    (tmp_path / "a" / "right" / "000002.png").unlink()
    tiltvp.write_image(tmp_path / "a" / "left" / "000001.png", np.zeros((3, 4), np.uint8))
    told = [str(one) for one in check_dataset(tmp_path / "a")]
    assert len(told) == 2
    assert "left/000001.png: 4 x 3 pixels" in told[0]
    assert "000002.png of one side alone" in told[1]
    with pytest.raises(InvalidInputError, match="exists"):
        write_stereo(sequence, tmp_path / "a")
    wide = tiltvp.Camera.equidistant(width=64, height=48, focal_px=20.0, cx=31.5, cy=23.5)
    odd = StereoSequence(sequence.scene, left=wide, right=wide, frames=2)
    with pytest.raises(InvalidInputError, match="pinhole"):
        write_stereo(odd, tmp_path / "c")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]


def test_what_makes_no_sense_is_refused(laboratory: Laboratory) -> None:
    left, right = small_cameras()
    for wrong in (
        {"frames": 0}, {"distance_m": (3.0, 1.0)}, {"distance_m": (1.0,)}, {"left_from_right": np.ones((4, 4))},
        {"corner": 1000}, {"exposure_s": 1.0}, {"gain": 0.0},
    ):  # fmt: skip
        with pytest.raises(InvalidInputError):
            StereoSequence(laboratory, left=left, right=right, **wrong)  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="scene"):
        StereoSequence("office", left=left, right=right)  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="gamma"):
        Laboratory(0, gamma_rad=3.0)
    with pytest.raises(InvalidInputError, match="width"):
        zed_cameras(640)


def test_the_command_refuses_before_it_renders(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for said, *words in (
        ("expected", "--width", "640"), ("expected", "--kind", "office", "--gamma-deg", "80"),
        ("expected", "--kind", "attic"), ("Must be >= 0", "--seed", "-1"),
    ):  # fmt: skip
        assert main(["dataset", "stereo", "--out", str(tmp_path / "set"), *words]) != 0
        assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
