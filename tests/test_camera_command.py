"""`tiltvp camera`: what files say, conversions, checks and new cameras; and images that do not fit their camera."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tiltvp
from calibration_texts import SAMPLES
from commands import Run
from tiltvp import Camera, Robot
from tiltvp.cli.lab.dataset_options import LensOptions
from tiltvp.cli.options import CameraOptions
from tiltvp.formats import write_toml
from tiltvp.rotations import read_rotation
from tiltvp.streams import Wheels


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A camera of 185 degrees on 240 x 180 pixels."""
    path = tmp_path_factory.mktemp("camera") / "camera.toml"
    limit = math.radians(92.5)
    Camera.equidistant(width=240, height=180, focal_px=52.4, cx=119.5, cy=89.5, max_theta_rad=limit).save(path)
    return path


def test_camera_info(run: Run, file: Path) -> None:
    said = run("camera", "info", file)
    assert said.code == 0
    for words in ("equidistant", "240 x 180 px", "focal_px", "52.4", "185.00 deg", "92.50 deg", "valid pixels"):
        assert words in said.out
    share = float(said.out.split("valid pixels")[1].split("%")[0])
    assert abs(share - 100.0 * Camera.load(file).valid_mask().mean()) < 0.1
    assert "seen in a mirror" in run("camera", "info", file, "--mirror").out


def test_camera_convert_and_check(run: Run, tmp_path: Path) -> None:
    chain = "\n".join(
        f"{name}:\n  camera_model: pinhole\n  intrinsics: [{focal}, {focal}, 320.0, 240.0]\n"
        "  distortion_model: equidistant\n  distortion_coeffs: [0.01, -0.002, 0.001, -0.0001]\n  resolution: [640, 480]"
        for name, focal in (("cam0", 200.0), ("cam1", 210.0))
    )
    (tmp_path / "chain.yaml").write_text(chain)
    said = run("camera", "convert", tmp_path / "chain.yaml", tmp_path / "both.toml")
    assert (said.code, said.err) == (0, "")
    for name in ("cam0", "cam1"):
        loaded = Camera.load(tmp_path / "both.toml", camera=name)
        assert loaded == Camera.load(tmp_path / "chain.yaml", camera=name)
    for name in ("cam1", "1"):
        words = ("camera", "convert", tmp_path / "chain.yaml", tmp_path / "one.toml", "--format", "kalibr")
        assert run(*words, "--camera-name", name, "--overwrite").code == 0
        assert Camera.load(tmp_path / "one.toml") == loaded
    for ending in ("txt", "bin"):
        theirs = tmp_path / f"cameras.{ending}"
        said = run("camera", "convert", tmp_path / "chain.yaml", theirs, "--to", "colmap")
        assert (said.code, said.err) == (0, "")
        assert Camera.load(theirs, camera=1) == loaded
    said = run("camera", "check", tmp_path / "both.toml", tmp_path / "chain.yaml")
    assert (said.code, said.err) == (0, "")
    assert said.out.count("sound") == 4
    said = run("camera", "check", tmp_path / "none.yaml", tmp_path / "both.toml")
    assert said.code == 1
    assert said.out.count("sound") == 2
    assert "none.yaml" in said.complaint


def test_camera_convert_tells_that_a_limit_is_lost(run: Run, file: Path, tmp_path: Path) -> None:
    said = run("camera", "convert", file, tmp_path / "camera.json", "--to", "basalt")
    assert said.code == 0
    assert "the limit of 92.50 deg from the axis is not in it" in said.complaint


def test_camera_formats(run: Run) -> None:
    said = run("camera", "formats")
    assert said.code == 0
    for one in tiltvp.formats.FORMATS:
        assert one.name in said.out


def test_a_size_that_a_file_lacks_is_asked_for_by_its_option(run: Run, tmp_path: Path) -> None:
    coefficients = "poly_incident_angle_to_radius: [0.0, 120.0]\npoly_radius_to_z: [-120.0, 0.0, 0.002]\n"
    (tmp_path / "c.yml").write_text(coefficients + "principal_point: [160.0, 120.0]\n")
    said = run("camera", "info", tmp_path / "c.yml", "--format", "py-omnicalib")
    assert said.code == 2
    assert "--image-size" in said.complaint


def test_cameras_are_made_on_the_command_line(run: Run, tmp_path: Path) -> None:
    new, part, small = (str(tmp_path / f"{name}.toml") for name in ("new", "part", "small"))
    circle = ["--centre", "310", "250", "--radius-px", "230", "--view-deg", "185"]
    assert run("camera", "new", new, "--image-size", "640x480", *circle).code == 0
    assert Camera.load(new).parameters["cx"] == 310.0
    assert run("camera", "crop", new, part, "--at", "80", "0", "--size", "480x480").code == 0
    assert Camera.load(part) == Camera.load(new).cropped(80, 0, 480, 480)
    assert run("camera", "scale", new, small, "--to", "321x241").code == 0
    assert (Camera.load(small).width, Camera.load(small).height) == (321, 241)
    assert run("camera", "scale", new, small, "--factor", "0.5", "--overwrite").code == 0
    assert Camera.load(small) == Camera.load(new).scaled(0.5)
    for told, words in (
        ("other proportions", ["scale", new, small, "--to", "320x320"]),
        ("expected one of them", ["scale", new, small]),
        ("beyond the image", ["crop", new, part, "--at", "300", "0", "--size", "480x480"]),
        ("is the file to be read", ["crop", new, new, "--at", "0", "0", "--size", "48x48"]),
        ("expected .toml", ["new", str(tmp_path / "a.yaml"), "--image-size", "64x48", "--view-deg", "90"]),
    ):
        said = run("camera", *words, "--overwrite")
        assert said.code == 2
        assert told in said.err


def test_one_of_several_cameras_is_cropped_and_scaled(run: Run, tmp_path: Path) -> None:
    chain, out = tmp_path / "camchain.yaml", tmp_path / "out.toml"
    chain.write_text(SAMPLES["kalibr"].text)
    whole = Camera.load(chain, camera="cam1")
    for name in ("cam1", "1"):
        said = run(
            "camera", "crop", chain, out, "--at", "8", "4", "--size", "40x40", "--camera-name", name, "--overwrite"
        )
        assert (said.code, Camera.load(out)) == (0, whole.cropped(8, 4, 40, 40))
        assert run("camera", "scale", chain, out, "--factor", "2", "--camera-name", name, "--overwrite").code == 0
        assert Camera.load(out) == whole.scaled(2.0)
    said = run("camera", "scale", chain, out, "--factor", "2", "--camera-name", "2", "--overwrite")
    assert (said.code, Camera.load(out)) == (2, whole.scaled(2.0))
    assert "no camera '2', expected one of cam0, cam1 or a number" in said.complaint


def test_a_name_that_is_a_number_is_a_name(run: Run, tmp_path: Path) -> None:
    file, out = tmp_path / "cameras.toml", tmp_path / "out.toml"
    one, other = (Camera.pinhole(width=64, height=48, fx=focal, fy=focal, cx=32.0, cy=24.0) for focal in (50.0, 70.0))
    write_toml([one.to_spec("1"), other.to_spec("0")], file)
    assert run("camera", "crop", file, out, "--at", "0", "0", "--size", "64x48", "--camera-name", "1").code == 0
    told = Camera.load(out), CameraOptions(camera=file, camera_name="1").load(), Camera.load(file, camera="1")
    assert told == (one,) * 3
    assert (CameraOptions(camera=file).load(), LensOptions(camera=file, camera_name="0").load()) == (one, other)


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    """robot.toml of one that looks ahead and sees itself in the lowest quarter of 64 x 48 pixels."""
    mask = np.ones((48, 64), dtype=bool)
    mask[36:, :20] = False
    camera = Camera.equidistant(width=64, height=48, focal_px=20.0, cx=31.5, cy=23.5)
    wheels, topics = Wheels(wheel_base_m=0.35), {"images": "/up"}
    made = Robot(camera, read_rotation("forward"), mask=mask, wheels=wheels, topics=topics, place_m=(0.1, 0.0))
    made.save(tmp_path / "robot.toml")
    return made


@pytest.mark.parametrize(
    ("words", "camera", "mask"),
    [
        (["scale", "--to", "32x24"], lambda c: c.scaled(0.5), lambda m: m[::2, ::2]),
        (["scale", "--factor", "2"], lambda c: c.scaled(2.0), lambda m: m.repeat(2, 0).repeat(2, 1)),
        (["crop", "--at", "8", "4", "--size", "40x40"], lambda c: c.cropped(8, 4, 40, 40), lambda m: m[4:44, 8:48]),
    ],
)
def test_a_robot_whose_images_change_stays_a_robot(
    run: Run, tmp_path: Path, robot: Robot, words: list[str], camera: Any, mask: Any
) -> None:
    out = tmp_path / "made.toml"
    said = run("camera", words[0], tmp_path / "robot.toml", out, *words[1:])
    assert (said.code, said.err) == (0, "")
    made = Robot.load(out)
    assert made.camera == camera(robot.camera)
    assert robot.mask is not None
    np.testing.assert_array_equal(made.mask, mask(robot.mask))
    np.testing.assert_array_equal(made.robot_from_camera, robot.robot_from_camera)
    assert (made.wheels, made.topics, made.place_m) == (robot.wheels, robot.topics, robot.place_m)


@pytest.mark.usefixtures("robot")
def test_converting_a_robot_tells_what_is_left_out(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "camera.toml"
    said = run("camera", "convert", tmp_path / "robot.toml", out)
    assert said.code == 0
    assert f"{out}: the camera alone, mask, mounting, wheels, topics of" in said.complaint


@pytest.mark.parametrize(
    ("size", "told"),
    [
        ((320, 240), "camera scale FILE OUT --to 320x240"),
        ((480, 640), "by a quarter"),
        ((600, 480), "camera crop"),
        ((650, 480), "they show more than the calibration does, expected that of the whole image"),
    ],
)
def test_images_of_another_size_are_told_what_fits(run: Run, tmp_path: Path, size: tuple[int, int], told: str) -> None:
    camera, image = tmp_path / "camera.toml", tmp_path / "a.png"
    Camera.from_view(width=640, height=480, view_rad=3.0).save(camera)
    tiltvp.write_image(image, np.zeros((size[1], size[0]), np.uint8))
    said = run("tilt", image, "--camera", camera)
    assert said.code == 2
    assert told in said.err
