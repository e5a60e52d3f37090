"""What a robot's own program hands over: images of its drivers, messages of ROS, odometry and readings in lists."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

import tiltvp
from recordings import START_S, Bag
from tiltvp.errors import CalibrationError, ImageFileError, InvalidInputError
from tiltvp.line_logs import see_lines
from tiltvp.lines import LineExtractor
from tiltvp.streams import (
    InertialSamples,
    Motion,
    Odometry,
    Recording,
    camera_from_message,
    image_from_message,
    inertial_samples,
    open_frames,
)


@pytest.mark.parametrize(("encoding", "luma"), [("uyvy", 1), ("yuv422", 1), ("yuyv", 0), ("yuv422_yuy2", 0)])
def test_images_as_cameras_on_usb_send_them(encoding: str, luma: int) -> None:
    bgr = np.zeros((4, 8, 3), np.uint8)
    bgr[:, :4], bgr[:, 4:] = (40, 120, 200), (220, 90, 30)
    yuv = cv2.cvtColor(bgr, cv2.COLOR_BGR2YUV).astype(float)
    values = np.zeros((4, 8, 2), np.uint8)
    # Of limited range (ITU-R BT.601): 16 to 235 and, for colours, 224 levels about 128; U before V. OpenCV's BGR2YUV
    # has U and V larger by 0.492 / 0.564 and 0.877 / 0.713.
    values[:, :, luma] = np.rint(16.0 + yuv[:, :, 0] * 219.0 / 255.0)
    chroma = np.rint(128.0 + (yuv[:, :, 1:] - 128.0) * [0.564 / 0.492, 0.713 / 0.877] * 224.0 / 255.0)
    values[:, ::2, 1 - luma], values[:, 1::2, 1 - luma] = chroma[:, ::2, 0], chroma[:, 1::2, 1]
    # Of rospy, whose data is bytes.
    message = SimpleNamespace(width=8, height=4, encoding=encoding, step=16, is_bigendian=0, data=values.tobytes())
    assert np.abs(image_from_message(message).astype(int) - bgr).max() <= 3
    message.width, message.step = 7, 14
    with pytest.raises(ImageFileError, match="expected an even width"):
        image_from_message(message)


@pytest.mark.parametrize("encoding", ["nv12", "nv21"])
def test_images_as_hardware_decoders_send_them(encoding: str) -> None:
    """Grey levels, then the colours of each four pixels, U before V in NV12; rows may be padded."""
    bgr = np.zeros((4, 8, 3), np.uint8)
    bgr[:, :4], bgr[:, 4:] = (40, 120, 200), (220, 90, 30)
    planes = cv2.cvtColor(bgr, cv2.COLOR_BGR2YUV_I420)
    colours = planes[4:].reshape(2, 8)[:: 1 if encoding == "nv12" else -1]
    rows = np.pad(np.vstack([planes[:4], colours.T.reshape(2, 8)]), ((0, 0), (0, 2)))
    message = SimpleNamespace(width=8, height=4, encoding=encoding, step=10, is_bigendian=0, data=rows.tobytes())
    assert np.abs(image_from_message(message).astype(int) - bgr).max() <= 3
    for change, words in (({"height": 3}, "expected even numbers"), ({"data": rows.tobytes()[:40]}, "6 rows of 8")):
        with pytest.raises(ImageFileError, match=words):
            image_from_message(SimpleNamespace(**(vars(message) | change)))


def test_topics_of_16_bits_for_values_of_8_are_told(tmp_path: Path) -> None:
    made = Bag("mcap")
    for k in range(2):
        made.image("/image", START_S + k, np.full((6, 8), 200, np.uint16), "mono16")
    source = open_frames(made.write(tmp_path))
    assert "/image has no value above 255 in its 16 bits: it is read as of 10 bits, a quarter" in source.notes[0]
    assert [frame.read().max() for frame in source] == [50, 50]


@pytest.mark.parametrize("encoding", ["mono16", "bgra16", "bayer_rggb16"])
def test_images_of_one_sensor_are_scaled_alike(encoding: str, tmp_path: Path) -> None:
    """A dark image of 12 bits was made four times as bright as those beside it that had a bright spot."""
    made = Bag("mcap")
    shape = (6, 8, 4) if encoding == "bgra16" else (6, 8)
    for k, bright in enumerate((800, 4000, 800)):
        pixels = np.full(shape, 800, np.uint16)
        pixels[0, 0] = bright
        if pixels.ndim == 3:
            pixels[:, :, 3] = 65535
        made.image("/image", START_S + k, pixels, encoding)
    source = open_frames(made.write(tmp_path))
    assert source.notes == ()
    assert [frame.read()[5, 7].max() for frame in source] == [50, 50, 50]
    dark = SimpleNamespace(
        width=8, height=6, encoding="16UC1", step=16, is_bigendian=0, data=np.full((6, 8), 800, "<u2").tobytes()
    )
    assert (image_from_message(dark).max(), image_from_message(dark, bits=12).max()) == (199, 50)
    with pytest.raises(InvalidInputError, match=r"a value of 800, expected at most 255 \(8 bits\)"):
        image_from_message(dark, bits=8)
    # Values that fit were refused where the sensor's depth is none of 10, 12, 14 and 16: expected at most 2047.
    bright = SimpleNamespace(**(vars(dark) | {"data": np.full((6, 8), 1500, "<u2").tobytes()}))
    assert image_from_message(bright, bits=11).max() == round(255 * 1500 / 2047)
    for wrong in ("a", 0, 17, 12.5, True):
        with pytest.raises(InvalidInputError, match=r"bits = .*, expected a whole number from 1 to 16"):
            image_from_message(dark, bits=wrong)


def test_what_is_no_image_s_message_is_refused() -> None:
    for other in (None, SimpleNamespace(format="jpeg", data=b"")):
        with pytest.raises(ImageFileError):
            image_from_message(other)


@pytest.mark.parametrize("capital", [False, True], ids=["rclpy", "rospy"])
def test_the_camera_of_a_message(capital: bool) -> None:
    matrix, projection = [300.0, 0, 319.5, 0, 310, 239.5, 0, 0, 1], [250.0, 0, 320, -30, 0, 250, 240, 0, 0, 0, 1, 0]
    numbers = {"k": np.array(matrix), "d": np.array([-0.2, 0.05, 0.0, 0.0, 0.0]), "p": np.array(projection)}
    fields = {name.upper() if capital else name: values for name, values in numbers.items()}
    whole = SimpleNamespace(x_offset=0, y_offset=0, width=0, height=0)
    message = SimpleNamespace(
        width=640, height=480, distortion_model="plumb_bob", roi=whole, binning_x=0, binning_y=0, **fields
    )
    pixels = np.array([[20.0, 30.0], [500.0, 400.0]])
    rays = camera_from_message(message).unproject(pixels)
    plane = cv2.undistortPoints(pixels, np.reshape(matrix, (3, 3)), numbers["d"])[:, 0]
    assert rays[:, :2] / rays[:, 2:] == pytest.approx(plane, abs=1e-4)
    rays = camera_from_message(message, rectified=True).unproject(pixels)
    assert rays[:, :2] / rays[:, 2:] == pytest.approx((pixels - [320.0, 240.0]) / 250.0, abs=1e-12)
    with pytest.raises(InvalidInputError, match="a SimpleNamespace, expected a message of sensor_msgs/CameraInfo"):
        camera_from_message(SimpleNamespace(width=640, height=480))
    message.distortion_model = "unheard_of"
    with pytest.raises(CalibrationError, match="unheard_of"):
        camera_from_message(message)


def test_a_sensor_without_orientation_may_send_anything_for_it(tmp_path: Path) -> None:
    made = Bag("mcap")
    for k in range(40):
        made.imu(START_S + 0.05 * k, [0, 0, 0.4], [0, 0, 9.81])
        made.rows[-1][3].orientation.w = math.nan
    samples = inertial_samples(Recording(made.write(tmp_path)))
    assert (len(samples.times_s), samples.orientations) == (40, None)
    made.rows[7][3].angular_velocity.x = math.nan
    (tmp_path / "bad").mkdir()
    with pytest.raises(InvalidInputError, match=r"/imu: 1 of 40 .* not finite, the first at 1700000000\.350 s"):
        inertial_samples(Recording(made.write(tmp_path / "bad")))


def test_columns_are_taken_as_a_program_collects_them() -> None:
    assert Odometry([0.0, 0.1], [0.0, 1.0], [0, 1]).between(0.0, 0.1) == Motion(1.0, 1.0)  # type: ignore[arg-type]
    for refused in (
        lambda: Odometry.from_wheels([0.0, 0.1], [[0, 0], [1, 1]], wheel_base_m="a"),  # type: ignore[arg-type]
        lambda: Odometry.from_velocities([0.0, 0.1], ["a", 1.0], [0.0, 0.0]),
        lambda: Odometry([0.0, 0.1], "a", None),  # type: ignore[arg-type]
    ):
        with pytest.raises(InvalidInputError, match="number"):
            refused()


def test_samples_are_taken_as_a_program_collects_them() -> None:
    times, rates = [0.0, 0.05, 0.1], [(0, 0, 1)] * 3
    forces = [[9.81 * math.sin(time), 9.81 * math.cos(time), 0.0] for time in times]
    told = InertialSamples(times, rates, forces).known(0.0, 0.1)  # type: ignore[arg-type]
    assert told["gyro"][0][1, 0] == pytest.approx(np.sin(0.1))
    assert told["gravity"] is not None
    with pytest.raises(InvalidInputError, match="inertial sensor: rates_rad_s: no array of numbers"):
        InertialSamples(times, ["a", "b", "c"], None)  # type: ignore[arg-type]


def test_images_of_a_driver_that_writes_into_one_buffer_are_told_apart(
    camera: tiltvp.Camera, images: list[np.ndarray]
) -> None:
    buffer = np.empty_like(images[0])

    def driver() -> Iterator[np.ndarray]:
        for image in images:
            buffer[:] = image
            yield buffer

    estimator = tiltvp.TiltEstimator(camera)
    assert estimator.estimate_many(driver()) == estimator.estimate_many(images)
    assert tiltvp.check_setup(driver(), camera) == tiltvp.check_setup(images, camera)
    assert tiltvp.check_lens(driver(), camera) == tiltvp.check_lens(images, camera)
    seen = list(see_lines(driver(), LineExtractor(camera)))
    assert all(np.array_equal(one.gray, image) for one, image in zip(seen, images, strict=True))  # type: ignore[union-attr]


def test_the_folder_of_a_recorder_that_was_killed_has_no_metadata(tmp_path: Path) -> None:
    (tmp_path / "drive_0.mcap").touch()
    with pytest.raises(InvalidInputError, match=r"a folder of recordings, expected one of them: .*drive_0\.mcap"):
        open_frames(tmp_path)
