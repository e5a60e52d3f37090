"""What recordings tell of their camera and its mounting."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tiltvp
from recordings import START_S, Bag
from tiltvp.errors import CalibrationError, InvalidInputError
from tiltvp.streams import Recording, recorded_camera, robot_from_camera

AHEAD = (0.5, -0.5, 0.5, -0.5)
UP = (0.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize("again", [("mast", UP), ("base_link", AHEAD)], ids=["turned", "elsewhere"])
def test_transforms_that_contradict_each_other_are_refused(
    again: tuple[str, tuple[float, ...]], tmp_path: Path
) -> None:
    made = Bag("mcap")
    made.static("odom", "base_link", UP)
    made.static("map", "base_link", AHEAD)
    made.static("base_link", "mast", UP)
    made.static("mast", "camera", AHEAD)
    made.static("mast", "camera", AHEAD)
    made.static("mast", "other", AHEAD)
    parent, turn = again
    made.static(parent, "other", turn)
    recording = Recording(made.write(tmp_path))
    with pytest.raises(InvalidInputError, match=r"/tf_static has transforms of 'other' that contradict each other"):
        robot_from_camera(recording, camera_frame="other")
    found = robot_from_camera(recording, camera_frame="camera")
    assert found == pytest.approx(tiltvp.rotations.read_rotation("forward"), abs=1e-12), "sent twice, and apart"


@pytest.mark.parametrize("fifth", [0.0, 0.01])
def test_drivers_of_fisheyes_write_a_fifth_zero(fifth: float, tmp_path: Path) -> None:
    made, lens = Bag("mcap"), [0.01, -0.02, 0.003, -0.001]
    made.camera_info(START_S, 64, 48, "equidistant", [*lens, fifth], [30.0, 0, 31.5, 0, 30, 23.5, 0, 0, 1])
    recording = Recording(made.write(tmp_path))
    if fifth:
        with pytest.raises(CalibrationError, match="more than four coefficients are not supported"):
            recorded_camera(recording)
    else:
        assert [recorded_camera(recording).parameters[f"k{k}"] for k in (1, 2, 3, 4)] == lens


def test_the_calibration_of_another_camera_of_a_recording_is_refused(tmp_path: Path) -> None:
    """Of two cameras whose one CameraInfo was recorded."""
    made = Bag("mcap")
    made.camera_info(
        START_S, 64, 48, "equidistant", [0.01, -0.02, 0.003, -0.001], [30.0, 0, 31.5, 0, 30, 23.5, 0, 0, 1]
    )
    made.rows[-1][3].header.frame_id = "right"
    for side in ("left", "right"):
        made.image(f"/{side}/image", START_S, np.zeros((48, 64), np.uint8), "mono8")
        made.rows[-1][3].header.frame_id = side
    recording = Recording(made.write(tmp_path))
    assert recorded_camera(recording, images="/right/image").width == 64
    with pytest.raises(InvalidInputError, match=r"/camera_info is of the frame of /right/image, not of .* /left/image"):
        recorded_camera(recording, images="/left/image")
    assert recorded_camera(recording, "/camera_info", images="/left/image").width == 64, "who names it knows"
