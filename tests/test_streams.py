"""Where frames come from: images with their times, bags of ROS; and files that are none of them."""

from __future__ import annotations

import io
import sqlite3
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

import tiltvp
from recordings import KINDS, START_S, Bag, write_video
from tiltvp.drive_logs import read_drive_log
from tiltvp.errors import CalibrationError, ImageFileError, InvalidInputError, MissingExtraError, TiltvpError
from tiltvp.streams import (
    InertialSamples,
    NamedImages,
    RawImages,
    Recording,
    Wheels,
    image_from_message,
    inertial_samples,
    open_frames,
    read_odometry,
    recorded_camera,
    robot_from_camera,
)
from tiltvp.streams.bag_motion import bag_odometry

RNG = np.random.default_rng(5)


def shade(k: int) -> np.ndarray:
    return np.full((48, 64, 3), 20 * k, np.uint8)


@pytest.fixture(scope="module", params=KINDS)
def bag(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two seconds of a robot that turns: its images are written down 30 ms after they are taken."""
    made = Bag(request.param)
    for k in range(20):
        made.image("/image", START_S + 0.1 * k, np.full((6, 8), k, np.uint8), "mono8", late_s=0.03)
    for k in range(40):
        time_s = START_S + 0.05 * k
        made.odometry(time_s, 0.0, 0.0, 0.4 * 0.05 * k)
        made.imu(time_s, [0, 0, 0.4], [0, 0, 9.81])
    model, d = ("equidistant", [0.1, 0.0, 0.0, 0.0]) if request.param == "mcap" else ("plumb_bob", [0.0] * 5)
    made.camera_info(START_S, 8, 6, model, d, [5.0, 0, 4, 0, 5, 3, 0, 0, 1])
    made.static("base_link", "mast", [0, 0, 0, 1.0])
    made.static("mast", "camera", [-0.5, 0.5, -0.5, 0.5])
    return made.write(tmp_path_factory.mktemp("bags"))


def test_frames_of_a_bag(bag: Path) -> None:
    frames = open_frames(bag)
    assert (frames.count, frames.names[7]) == (20, f"{bag}#07")
    assert frames.times_s == pytest.approx(START_S + 0.1 * np.arange(20), abs=1e-6)
    assert frames.rate_hz == pytest.approx(10.0, rel=1e-5)
    assert frames.recording == bag
    seen = list(frames)
    assert [frame.read()[0, 0] for frame in seen] == list(range(20))
    assert [frame.time_s for frame in seen] == frames.times_s.tolist()
    assert [frame.read()[0, 0] for frame in frames.sample([3, 11])] == [3, 11]
    assert [frame.read()[0, 0] for frame in frames] == list(range(20)), "it can be iterated again"


def test_what_else_a_bag_tells(bag: Path) -> None:
    recording = Recording(bag)
    assert {(topic.name, topic.kind, topic.count) for topic in recording.topics} >= {("/imu", "sensor_msgs/Imu", 40)}
    samples = inertial_samples(recording)
    assert samples.times_s == pytest.approx(START_S + 0.05 * np.arange(40), abs=1e-6)
    assert (samples.rates_rad_s == [0, 0, 0.4]).all()
    assert (samples.accelerations_m_s2 == [0, 0, 9.81]).all()
    assert (samples.orientations, samples.frame) == (None, "imu")
    camera = recorded_camera(recording)
    assert (camera.width, camera.height) == (8, 6)
    assert camera.model == ("kannala_brandt" if "mcap" in bag.name else "pinhole")
    assert robot_from_camera(recording) == pytest.approx(tiltvp.rotations.read_rotation("forward"), abs=1e-12)
    with pytest.raises(InvalidInputError, match=r"does not join 'base_link' and 'lidar'.*base_link, camera, mast"):
        robot_from_camera(recording, camera_frame="lidar")


def test_the_camera_of_a_region_that_is_binned(tmp_path: Path) -> None:
    made = Bag("mcap")
    made.camera_info(START_S, 640, 480, "", [], [300.0, 0, 319.5, 0, 300, 239.5, 0, 0, 1], (2, 2), (100, 40, 401, 501))
    camera = recorded_camera(Recording(made.write(tmp_path)))
    whole = tiltvp.Camera.pinhole(width=640, height=480, fx=300.0, fy=300.0, cx=319.5, cy=239.5)
    assert (camera.width, camera.height) == (250, 200)
    # The first bin is of the pixels 100 and 101 of the sensor's columns, 40 and 41 of its rows.
    np.testing.assert_allclose(camera.unproject([0.0, 0.0]), whole.unproject([100.5, 40.5]), atol=1e-12)
    odd = Bag("mcap")
    odd.camera_info(START_S, 8, 6, "", [], [5.0, 0, 4, 0, 5, 3, 0, 0, 1], (2, 1))
    (tmp_path / "odd").mkdir()
    with pytest.raises(CalibrationError, match="binned 2 x 1"):
        recorded_camera(Recording(odd.write(tmp_path / "odd")))


def test_single_files_of_ros_2_bags_are_read_too(bag: Path) -> None:
    for file in (*bag.glob("*.mcap"), *bag.glob("*.db3")):
        assert [frame.read()[0, 0] for frame in open_frames(file)] == list(range(20))


def test_the_topic_is_chosen_or_asked_for(tmp_path: Path) -> None:
    made = Bag("mcap")
    for k in range(3):
        made.image("/left", START_S + k, np.full((4, 4), 1, np.uint8), "mono8")
    made.image("/right", START_S, np.full((4, 4), 2, np.uint8), "mono8")
    path = made.write(tmp_path)
    with pytest.raises(InvalidInputError, match=r"2 topics .*\(/left: 3, /right: 1\), expected one, by --topic"):
        open_frames(path)
    assert [frame.read()[0, 0] for frame in open_frames(path, topic="/right")] == [2]
    with pytest.raises(InvalidInputError, match=r"no topic '/up'.*/left \(sensor_msgs/Image, 3\)"):
        open_frames(path, topic="/up")
    with pytest.raises(InvalidInputError, match="no topics of sensor_msgs/Imu"):
        inertial_samples(Recording(path))


COLOURS = RNG.integers(0, 256, (6, 8, 3), np.uint8)
DEEP = RNG.integers(0, 4096, (6, 8), np.uint16)
DEEP[0, 0] = 4095


@pytest.mark.parametrize("kind", ["ros1", "mcap"])
def test_every_encoding(kind: str, tmp_path: Path) -> None:
    made = Bag(kind)
    alpha = np.dstack([COLOURS, np.full((6, 8), 9, np.uint8)])
    cases = [
        (COLOURS, "bgr8", COLOURS), (COLOURS[:, :, ::-1], "rgb8", COLOURS), (alpha, "bgra8", COLOURS),
        (alpha[:, :, [2, 1, 0, 3]], "rgba8", COLOURS), (COLOURS[:, :, 0], "mono8", COLOURS[:, :, 0]),
        (COLOURS[:, :, 0], "8UC1", COLOURS[:, :, 0]), (DEEP, "mono16", np.rint(DEEP / 4095 * 255)),
        (DEEP.astype(">u2"), "mono16", np.rint(DEEP / 4095 * 255)),
    ]  # fmt: skip
    for k, (pixels, encoding, _) in enumerate(cases):
        made.image("/image", START_S + k, np.ascontiguousarray(pixels), encoding)
    padded = np.zeros((6, 12), np.uint8)
    padded[:, :8] = COLOURS[:, :, 1]
    made.add(
        "/image", "sensor_msgs/Image", START_S + 90, made.header(START_S + 90), 6, 8, "mono8", 0, 12, padded.ravel()
    )
    found = [frame.read() for frame in open_frames(made.write(tmp_path))]
    for (_, encoding, expected), image in zip(cases, found, strict=False):
        assert np.array_equal(image, expected), encoding
    assert np.array_equal(found[-1], COLOURS[:, :, 1])


@pytest.mark.parametrize("pattern", ["rggb", "bggr", "gbrg", "grbg"])
def test_bayer_patterns_give_the_colours_of_the_scene(pattern: str) -> None:
    colour = dict(zip("bgr", (40, 120, 200), strict=True))
    tile = np.array([[colour[pattern[0]], colour[pattern[1]]], [colour[pattern[2]], colour[pattern[3]]]], np.uint8)
    mosaic = np.tile(tile, (8, 8))
    message = SimpleNamespace(
        width=16, height=16, encoding=f"bayer_{pattern}8", step=16, is_bigendian=0, data=mosaic.ravel()
    )
    assert np.abs(image_from_message(message)[4:-4, 4:-4].astype(int) - [40, 120, 200]).max() <= 1
    message = SimpleNamespace(
        width=16, height=16, encoding=f"bayer_{pattern}16", step=32, is_bigendian=0,
        data=np.frombuffer((mosaic.astype("<u2") * 257).tobytes(), np.uint8),
    )  # fmt: skip
    assert image_from_message(message)[8, 8].argmax() == 2


def test_compressed_images_and_bad_messages_among_good_ones(tmp_path: Path) -> None:
    made = Bag("ros1")
    content = cv2.imencode(".png", COLOURS)[1].tobytes()
    for k, data in enumerate((content, b"no image", content[:50], content)):
        made.compressed("/image", START_S + k, data)
    frames = list(open_frames(made.write(tmp_path)))
    assert np.array_equal(frames[0].read(), COLOURS)
    assert np.array_equal(frames[3].read(), COLOURS)
    for k in (1, 2):
        with pytest.raises(ImageFileError, match=rf"drive\.bag#{k}: .*not an image that can be decoded"):
            frames[k].read()
        assert isinstance(frames[k].image, ImageFileError)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"width": 0}, "0 x 6 pixels"),
        ({"width": 2**31, "height": 2**31}, "expected 1 to 200000000"),
        ({"encoding": "yuv444"}, "encoding 'yuv444', expected mono8"),
        ({"step": 3}, "rows of 3, expected 6 rows of 8"),
        ({"data": np.zeros(40, np.uint8)}, "40 bytes"),
        ({"encoding": "bayer_xxyy8"}, "encoding 'bayer_xxyy8'"),
    ],
)
def test_images_that_are_not_what_they_say(change: dict[str, object], words: str) -> None:
    fields = {
        "width": 8,
        "height": 6,
        "encoding": "mono8",
        "step": 8,
        "is_bigendian": 0,
        "data": np.zeros(48, np.uint8),
    }
    with pytest.raises(ImageFileError, match=words):
        image_from_message(SimpleNamespace(**(fields | change)))


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_bags_that_are_cut_or_damaged_are_errors_of_ours(kind: str, tmp_path: Path) -> None:
    made = Bag(kind)
    for k in range(10):
        made.image("/image", START_S + k, RNG.integers(0, 256, (20, 20), np.uint8), "mono8")
    path = made.write(tmp_path)
    file = path if kind == "ros1" else next(file for file in path.iterdir() if file.suffix in (".mcap", ".db3"))
    whole = file.read_bytes()
    damaged = [whole[: len(whole) * part // 10] for part in range(10)]
    for _ in range(60):
        changed = bytearray(whole)
        for place in RNG.integers(0, len(whole), 6):
            changed[place] = RNG.integers(0, 256)
        damaged.append(bytes(changed))
    refused = 0
    for content in damaged:
        file.write_bytes(content)
        try:
            for frame in open_frames(path):
                _ = frame.image
        except TiltvpError as error:
            refused += str(path) in str(error)
            continue
    assert refused >= 8, "what is cut is refused"


def test_messages_that_are_lost_within_a_bag_are_told(tmp_path: Path) -> None:
    made = Bag("sqlite3")
    for k in range(10):
        made.image("/image", START_S + 0.1 * k, np.full((6, 8), k, np.uint8), "mono8")
        made.odometry(START_S + 0.1 * k, 0.0, 0.0, 0.1 * k)
        made.joints(START_S + 0.1 * k, ["left_wheel", "right_wheel"], [0.1 * k, 0.1 * k])
    path = made.write(tmp_path)
    assert open_frames(path).problems == ()
    database = sqlite3.connect(next(path.glob("*.db3")), isolation_level=None)
    database.execute("DELETE FROM messages WHERE id BETWEEN 10 AND 18")
    database.close()
    frames = open_frames(path)
    assert frames.count == 7
    assert frames.problems == (f"{path}: /image: 3 of 10 messages cannot be read (damaged?)",)
    for topic in ("/odom", "/joint_states"):
        wheels = Wheels(wheel_radius_m=0.05, wheel_base_m=0.3)
        notes = bag_odometry(Recording(path), topic, wheels).notes
        assert notes == (f"{path}: {topic}: 3 of 10 messages cannot be read (damaged?)",)


@pytest.mark.parametrize("name", ["a.bag", "a.mcap", "a.db3", "a.mp4", "a.avi"])
@pytest.mark.parametrize("content", [b"", b"text", b"\x89MCAP0\r\n", b"#ROSBAG V2.0\n", b"SQLite format 3\0" * 20])
def test_foreign_files(name: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(TiltvpError, match=name):
        open_frames(tmp_path / name)
    with pytest.raises(TiltvpError, match=f"missing_{name}: no such file"):
        open_frames(tmp_path / f"missing_{name}")


def test_metadata_that_nobody_would_write(tmp_path: Path) -> None:
    for content in ("", "a: [", "rosbag2_bagfile_information: {version: 99}", "x" * (17 << 20)):
        (tmp_path / "metadata.yaml").write_text(content)
        with pytest.raises(InvalidInputError, match="expected"):
            open_frames(tmp_path)


def test_a_camera_that_was_not_calibrated_or_is_cut(tmp_path: Path) -> None:
    made = Bag("mcap")
    made.camera_info(START_S, 8, 6, "", [], [0.0] * 9)
    with pytest.raises(CalibrationError, match="was not calibrated"):
        recorded_camera(Recording(made.write(tmp_path)))


@pytest.mark.parametrize("package", ["av", "rosbags"])
def test_without_the_extras(package: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    video, bag = tmp_path / "a.mp4", tmp_path / "a.bag"
    write_video(video, map(shade, range(3)), [0, 40, 80])
    bag.write_bytes(b"")
    for name in [name for name in sys.modules if name.split(".")[0] == package]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    if package == "av":
        frames = open_frames(video)
        needed = "reading its time stamps needs the extra video (av: not installed)"
        assert frames.notes[0].endswith(f"frames a second; {needed}, expected `pip install 'tiltvp[video]'`")
        assert np.diff(frames.times_s) == pytest.approx([1 / frames.rate_hz] * 2)
        assert [abs(int(frame.read()[5, 5, 0]) - 20 * k) < 8 for k, frame in enumerate(frames)] == [True] * 3
    else:
        with pytest.raises(MissingExtraError, match=r"tiltvp\[bags\]") as refusal:
            open_frames(bag)
        needed = f"{bag}: a recording of ROS needs the extra bags (rosbags: not installed)"
        assert str(refusal.value) == f"{needed}, expected `pip install 'tiltvp[bags]'`"


def test_a_drive_s_folder_and_times_of_images(tmp_path: Path) -> None:
    for k in range(3):
        tiltvp.write_image(tmp_path / "images" / f"{k}.png", shade(k))
    (tmp_path / "odometry.csv").write_text("yaw_rad\n0\n0\n0\n")
    frames = open_frames(tmp_path)
    assert [Path(name).name for name in frames.names] == ["0.png", "1.png", "2.png"]
    assert (frames.times_s, frames.recording, frames.rate_hz) == (None, tmp_path / "odometry.csv", 25.0)
    (tmp_path / "frames.csv").write_text("file,time_s\n2.png,7.5\n0.png,7\n1.png,7.25\n")
    frames = open_frames(tmp_path)
    assert [frame.time_s for frame in frames] == [7.0, 7.25, 7.5]
    assert frames.rate_hz == 4.0
    for text, words in (
        ("file,time_s\n0.png,7\n", "no time of .*1.png .2 missing"),
        ("file,time_s\n0.png,x\n", "line 2"),
        ("file,time_s\n0.png,1_0\n", "time_s = '1_0', expected a finite number"),
    ):
        (tmp_path / "frames.csv").write_text(text)
        with pytest.raises(InvalidInputError, match=words):
            open_frames(tmp_path)
    assert open_frames(tmp_path / "images").times_s is None


def test_hidden_files_of_a_folder_are_no_images(tmp_path: Path) -> None:
    """A Mac puts ._a.png beside a.png where a file system has no place for what it knows of it."""
    for name in ("a.png", "b.png"):
        tiltvp.write_image(tmp_path / name, np.zeros((4, 4), np.uint8))
        (tmp_path / f"._{name}").write_bytes(b"\0\5\x16\7")
    (tmp_path / "frames.csv").write_text("file,time_s\na.png,1\nb.png,2\n")
    frames = open_frames(tmp_path)
    assert [Path(name).name for name in frames.names or ()] == ["a.png", "b.png"]


def test_names_that_are_times(tmp_path: Path) -> None:
    for name in ("1403636579763555584", "1403636579813555456"):
        tiltvp.write_image(tmp_path / f"{name}.png", shade(1))
    frames = open_frames(tmp_path)
    assert np.diff(frames.times_s) == pytest.approx([0.05], abs=1e-6)
    assert "names of the images" in frames.notes[0]


def test_what_is_not_there_is_told(tmp_path: Path) -> None:
    tiltvp.write_image(tmp_path / "a.png", shade(1))
    (tmp_path / "empty").mkdir()
    frames = open_frames([tmp_path / "a.png", tmp_path / "empty", f"{tmp_path}/*.jpg"])
    assert (frames.count, len(frames.problems)) == (1, 2)
    with pytest.raises(InvalidInputError, match="a folder without images"):
        open_frames(tmp_path / "empty")
    with pytest.raises(InvalidInputError, match="expected one video or recording"):
        open_frames([tmp_path / "a.png", tmp_path / "b.mp4"])
    with pytest.raises(InvalidInputError, match="nowhere: no such file or folder, expected images, a video"):
        open_frames(tmp_path / "nowhere")
    assert len(open_frames([tmp_path / "a.png", tmp_path / "nowhere"]).problems) == 1
    with pytest.raises(InvalidInputError, match="zero byte"):
        open_frames("a\0b")
    with pytest.raises(InvalidInputError, match="letters that a file's name can have"):
        open_frames("\ud800x")


def test_names_on_stdin(tmp_path: Path) -> None:
    tiltvp.write_image(tmp_path / "ä b.png", shade(2))
    lines = io.BytesIO(f"{tmp_path}/ä b.png\n\n{tmp_path}/none.png\r\n".encode())
    good, bad = NamedImages(lines)
    assert good.read()[0, 0, 0] == 40
    with pytest.raises(ImageFileError, match=r"none\.png: No such file"):
        bad.read()
    with pytest.raises(InvalidInputError, match="4096 bytes"):
        list(NamedImages(io.BytesIO(b"x" * 5000)))


@pytest.mark.parametrize("shape", [(4, 6), (4, 6, 3), (4, 6, 4)])
def test_raw_pixels(shape: tuple[int, ...]) -> None:
    pixels = RNG.integers(0, 256, (2, *shape), np.uint8)
    first, second, rest = RawImages(shape, io.BytesIO(pixels.tobytes() + b"end"))
    for frame, expected in zip((first, second), pixels, strict=True):
        assert np.array_equal(frame.read(), expected if len(shape) == 2 else expected[:, :, :3])
    with pytest.raises(ImageFileError, match="-#000002: 3 bytes, expected"):
        rest.read()


def test_frames_are_decoded_late(tmp_path: Path) -> None:
    read: Callable[[], object] = next(iter(open_frames([tmp_path / "none.png"]))).read
    with pytest.raises(ImageFileError, match="none"):
        read()


@pytest.mark.parametrize(("mark", "told"), [(";", "semicolons"), ("\t", "tabs")])
def test_tables_with_other_marks_than_commas_are_told_to_have_them(mark: str, told: str, tmp_path: Path) -> None:
    """They were told to have one unknown column."""
    (path := tmp_path / "table.csv").write_text(f"time_s{mark}yaw_rad\n1,5{mark}0\n")
    for read in (read_odometry, InertialSamples.read, lambda table: read_drive_log(table, table)):
        with pytest.raises(InvalidInputError, match=rf"table\.csv, line 1: {told} between the cells, expected commas"):
            read(path)
