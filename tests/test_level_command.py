"""`tiltvp level`: images of a camera, 360-degree photographs, videos."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np
import pytest

import tiltvp
from tiltvp.cli import main
from tiltvp.photos import panorama_kind
from tiltvp.rotations import about_vertical, rotation_from
from tiltvp.streams import open_frames
from tiltvp.synth import RoomImage
from tiltvp.videos import video_writer

FORWARD = rotation_from("forward", "the mounting")
LEAN = (math.radians(12.0), 0.7)


@pytest.fixture(scope="module")
def photo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a panoramic camera that leans by 12 degrees sees in a room."""
    camera = tiltvp.Camera.equirectangular(width=1024, height=512)
    room = tiltvp.synth.Room("living-room", 1, threads=1)
    seen = room.render(
        camera,
        pose=room.free_poses(1, 0)[0],
        robot_from_camera=FORWARD,
        alpha_rad=LEAN[0],
        beta_rad=LEAN[1],
        threads=1,
    )
    path = tmp_path_factory.mktemp("photos") / "photo.jpg"
    path.write_bytes(cv2.imencode(".jpg", seen.bgr, [cv2.IMWRITE_JPEG_QUALITY, 91])[1].tobytes())
    return path


def lean_deg(path: Path) -> float:
    image = tiltvp.read_image(path)
    camera = tiltvp.Camera.equirectangular(width=image.shape[1], height=image.shape[0])
    estimate = tiltvp.TiltEstimator(camera, method="segments", robot_from_camera=FORWARD, tilt_max_rad=math.pi)(image)
    assert estimate.confidence > 0.5
    return math.degrees(estimate.alpha_rad)


@pytest.mark.slow
def test_a_photograph_is_level_and_says_so(photo: Path, tmp_path: Path) -> None:
    assert lean_deg(photo) == pytest.approx(12.0, abs=1.0)
    assert main(["level", str(photo), "--out", str(tmp_path / "level")]) == 0
    written = tmp_path / "level" / "photo.jpg"
    assert lean_deg(written) < 1.0
    image = tiltvp.read_image(written)
    assert image.shape == (512, 1024, 3)
    assert panorama_kind(written.read_bytes(), 1024, 512).reason == "GPano metadata"
    # The first and the last column are neighbours: as near to one another as any two are.
    steps = np.abs(np.diff(image.astype(int), axis=1)).mean(axis=(0, 2))
    assert np.abs(image[:, 0].astype(int) - image[:, -1]).mean() <= steps.max()


@pytest.mark.slow
def test_metadata_alone_leave_the_pixels_as_they_are(photo: Path, tmp_path: Path) -> None:
    assert main(["level", str(photo), "--out", str(tmp_path), "--metadata-only", "--overwrite"]) == 0
    written = (tmp_path / "photo.jpg").read_bytes()
    begin = photo.read_bytes().index(b"\xff\xdb")
    assert written.endswith(photo.read_bytes()[begin:])
    # Leaning forward the middle of the image looks down.
    pitch_deg = float(written.split(b'PosePitchDegrees="')[1].split(b'"')[0])
    roll_deg = float(written.split(b'PoseRollDegrees="')[1].split(b'"')[0])
    normal = tiltvp.normal_from_alpha_beta(*LEAN)
    assert pitch_deg == pytest.approx(math.degrees(math.asin(normal[0])), abs=1.0)
    assert roll_deg == pytest.approx(math.degrees(math.atan2(normal[1], normal[2])), abs=1.0)


@pytest.mark.slow
def test_a_pose_is_the_cameras_however_it_is_mounted(photo: Path, tmp_path: Path) -> None:
    aside = tmp_path / "aside.txt"
    np.savetxt(aside, about_vertical(0.5 * math.pi) @ FORWARD)
    outputs: dict[str, list[str]] = {
        "as it is": ["--metadata-only"],
        "aside": ["--metadata-only", "--robot-from-camera", str(aside)],
        "up": ["--robot-from-output", "up"],
    }
    poses = {}
    for name, words in outputs.items():
        assert main(["level", str(photo), "--out", str(tmp_path / name), *words]) == 0
        written = (tmp_path / name / "photo.jpg").read_bytes()
        poses[name] = [float(written.split(b'Pose%bDegrees="' % key)[1].split(b'"')[0]) for key in (b"Pitch", b"Roll")]
    assert poses["aside"] == pytest.approx(poses["as it is"], abs=0.1)
    assert poses["up"] == [90.0, 0.0]


@pytest.mark.slow
def test_masks_and_pixels_are_those_of_photographs(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    large = tmp_path / "large.png"
    tiltvp.write_image(large, cv2.resize(tiltvp.read_image(photo), (2048, 1024)))
    seen = np.ones((1024, 2048), np.bool_)
    seen[800:] = False
    for name, mask in (("mask", seen), ("narrow", seen[:, :1000])):
        tiltvp.write_image(tmp_path / f"{name}.png", mask)
    words = ["level", str(large), "--out", str(tmp_path / "level"), "--overwrite", "--margin-px", "20", "--mask"]
    assert main([*words, str(tmp_path / "mask.png")]) == 0
    assert lean_deg(tmp_path / "level" / "large.png") < 1.0
    assert main([*words, str(tmp_path / "narrow.png")]) == 2
    assert "mask: shape (1024, 1000)" in capsys.readouterr().err


@pytest.mark.slow
def test_what_is_not_believed_is_said_and_left_out_or_copied(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    blank, narrow = tmp_path / "blank.png", tmp_path / "narrow.png"
    tiltvp.write_image(blank, np.full((256, 512), 90, np.uint8))
    tiltvp.write_image(narrow, np.full((256, 300), 90, np.uint8))
    out = tmp_path / "out"
    assert main(["level", str(blank), str(narrow), str(photo), "--out", str(out)]) == 1
    seen = capsys.readouterr()
    assert "blank.png: no tilt" in seen.err
    assert "left out" in seen.err
    assert "300 x 256 pixels, expected twice as wide as high" in seen.err
    assert "1 of 3 made level" in seen.out
    assert [file.name for file in out.iterdir()] == ["photo.jpg"]
    assert main(["level", str(blank), "--out", str(out), "--copy-unlevelled", "--overwrite"]) == 1
    assert (out / "blank.png").read_bytes() == blank.read_bytes()
    assert "copied as it is" in capsys.readouterr().err


@pytest.mark.slow
def test_views_of_a_photograph(photo: Path, tmp_path: Path) -> None:
    pinhole = ["--to", "pinhole", "--size", "320x240", "--field-of-view-deg", "80"]
    assert main(["level", str(photo), "--out", str(tmp_path / "pinhole"), *pinhole]) == 0
    assert tiltvp.read_image(tmp_path / "pinhole" / "photo.jpg").shape == (240, 320, 3)
    assert b"GPano" not in (tmp_path / "pinhole" / "photo.jpg").read_bytes()
    assert main(["level", str(photo), "--out", str(tmp_path / "x"), "--field-of-view-deg", "80"]) == 2
    assert main(["level", str(photo), "--out", str(tmp_path / "x"), "--metadata-only", "--to", "pinhole"]) == 2


def test_a_video_is_level_at_its_own_rate(camera: tiltvp.Camera, room: RoomImage, tmp_path: Path) -> None:
    camera.save(tmp_path / "camera.toml")
    with video_writer(tmp_path / "drive.avi", 12.0) as video:
        for gray in [np.zeros_like(room.gray), *[room.gray] * 4]:
            video.add(cv2.cvtColor(gray, cv2.COLOR_GRAY2BGR))
    words = ["level", str(tmp_path / "drive.avi"), "--camera", str(tmp_path / "camera.toml")]
    # The first frame is black, and comes before the filter knows anything.
    assert main([*words, "--out", str(tmp_path / "level.avi")]) == 1
    level = open_frames(tmp_path / "level.avi")
    assert level.count == 5
    assert level.rate_hz == pytest.approx(12.0)
    frames = [frame.read() for frame in level]
    assert not frames[0].any()
    estimate = tiltvp.TiltEstimator(camera)(frames[-1])
    assert estimate.alpha_rad < math.radians(1.0)


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_depth_and_opacity_stay(channels: int, camera: tiltvp.Camera, room: RoomImage, tmp_path: Path) -> None:
    camera.save(tmp_path / "camera.toml")
    deep = room.gray.astype(np.uint16) * 257 + 3
    image = deep if channels == 1 else np.dstack([deep] * 3 + [np.full_like(deep, 65_535)] * (channels - 3))
    (tmp_path / "images").mkdir()
    for name in ("a.png", "b.tiff"):
        cv2.imwrite(str(tmp_path / "images" / name), image)
    words = ["level", str(tmp_path / "images"), "--camera", str(tmp_path / "camera.toml"), "--out"]
    assert main([*words, str(tmp_path / "out")]) == 0
    for name in ("a.png", "b.png"):
        level = cv2.imread(str(tmp_path / "out" / name), cv2.IMREAD_UNCHANGED)
        assert (level.dtype, level.shape) == (np.uint16, image.shape)
        assert len(np.unique(level)) > 300


def test_a_video_has_a_filter_whose_options_and_plot_count(
    camera: tiltvp.Camera, room: RoomImage, tmp_path: Path
) -> None:
    camera.save(tmp_path / "camera.toml")
    with video_writer(tmp_path / "drive.avi", 12.0) as video:
        for _ in range(3):
            video.add(cv2.cvtColor(room.gray, cv2.COLOR_GRAY2BGR))
    tiltvp.write_image(tmp_path / "images" / "a.png", room.gray)
    options = ["--camera", str(tmp_path / "camera.toml"), "--lost-after", "3"]
    for source, out, more in (("drive.avi", "level.avi", []), ("images", "level", ["--filter"])):
        plot = tmp_path / f"{out}.png"
        words = ["level", str(tmp_path / source), "--out", str(tmp_path / out), *options, "--filter-plot", str(plot)]
        assert main([*words, *more]) == 0
        assert plot.exists()
    assert main(["level", str(tmp_path / "images"), "--out", str(tmp_path / "one"), *options]) == 2


def test_what_a_filter_does_not_tell_is_not_laid_to_the_image(
    camera: tiltvp.Camera, room: RoomImage, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of one that was sure of itself it was said that it is not believed, confidence 0.99."""
    camera.save(tmp_path / "camera.toml")
    images = tmp_path / "images"
    for name in "ab":
        tiltvp.write_image(images / f"{name}.png", room.gray)
    (images / "frames.csv").write_text("file,time_s\na.png,0\nb.png,9\n")
    (images / "odometry.csv").write_text("time_s,distance_m,yaw_rad\n0,0,0\n0.4,0,0\n")
    words = ["level", str(images), "--camera", str(tmp_path / "camera.toml"), "--out", str(tmp_path / "out")]
    assert main([*words, "--filter"]) == 1
    assert "b.png: no filtered tilt: the odometry does not tell of its time; left out\n" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["level.mkv", "level.png", "level.gif"])
def test_a_file_of_another_ending_is_no_folder(
    name: str, photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["level", str(photo), "--out", str(tmp_path / name)]) == 2
    assert "expected .mp4 or .avi, or a folder" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_panorama_is_a_camera_in_every_command(photo: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tilt", str(photo), "--camera", "equirectangular:1024x512", "--method", "segments",
                 "--tilt-max-deg", "90", "--out", "-"]) == 0  # fmt: skip
    assert '"error": null' in capsys.readouterr().out
    assert main(["tilt", str(photo), "--camera", "equirectangular:wide"]) == 2
    assert "expected WIDTHxHEIGHT" in capsys.readouterr().err
