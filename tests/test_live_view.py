"""What a person watches: the picture of `--show` without a screen, and recordings of `--rerun` read back."""

from __future__ import annotations

import io
import os
import socket
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader

import tiltvp
from commands import Run
from drawn_corners import CAMERA, COLOURS, LEFT_FROM_RIGHT, pair
from recordings import write_video
from tiltvp.errors import OutputError
from tiltvp.overlays.drive_map import landmark_places, robot_poses
from tiltvp.overlays.live import TiltView, live_words, roll_and_pitch
from tiltvp.stereo_rigs import StereoRig
from tiltvp.synth import RoomImage, simulate_drive

FRAMES = 5


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory, camera: tiltvp.Camera, room: RoomImage) -> Path:
    """A video of a robot that turns, whose third frame is black, and a folder with the same beside a broken file."""
    folder = tmp_path_factory.mktemp("watched")
    camera.save(folder / "camera.toml")
    frames = [np.rot90(room.bgr, k) for k in range(FRAMES)]
    frames[2] = np.zeros_like(frames[2])
    write_video(folder / "drive.mp4", [np.ascontiguousarray(frame) for frame in frames], [0, 40, 80, 120, 160])
    for number, frame in enumerate(frames):
        tiltvp.write_image(folder / "images" / f"{number}.png", np.ascontiguousarray(frame))
    (folder / "images" / "9.png").write_bytes(b"no image")
    return folder


@pytest.fixture(scope="module")
def tilt(camera: tiltvp.Camera, room: RoomImage) -> tiltvp.TiltEstimate:
    return tiltvp.TiltEstimator(camera)(room.gray)


def rows_of(path: Path) -> Counter[str]:
    """How many rows each entity of a recording has, but for what Rerun writes of itself."""
    counts: Counter[str] = Counter()
    for chunk in RrdReader(path).stream():
        entity = str(chunk.entity_path)
        if not entity.startswith("/__") and not chunk.is_static:
            counts[entity] += chunk.num_rows
    return counts


def gone_of(path: Path, entity: str) -> list[int]:
    """The frames from which on nothing is shown at an entity."""
    batches = [one.to_record_batch() for one in RrdReader(path).stream() if str(one.entity_path) == entity]
    return [
        frame for batch in batches if "Clear:is_recursive" in batch.schema.names for frame in batch["frame"].to_pylist()
    ]


def values_of(path: Path, entity: str) -> np.ndarray:
    """(N, k): the values of the curves of an entity, by their frames."""
    rows: dict[int, list[float]] = {}
    for chunk in RrdReader(path).stream():
        if str(chunk.entity_path) == entity and not chunk.is_static:
            batch = chunk.to_record_batch()
            (scalars,) = (name for name in batch.schema.names if "scalars" in name)
            rows |= dict(zip(batch["frame"].to_pylist(), batch[scalars].to_pylist(), strict=True))
    return np.array([rows[frame] for frame in sorted(rows)])


def test_the_picture_has_three_parts(tilt: tiltvp.TiltEstimate, room: RoomImage) -> None:
    view, words = TiltView(), live_words(tilt, tilt.confidence, 24.96)
    for k in range(10):
        view.add(0.1 * k, None if k == 5 else tilt)
    picture = view.picture(room.bgr, room.gray, words)
    assert (picture.shape, picture.dtype) == ((660, 1280, 3), np.uint8)
    # The right panel is the gray image, the left one has colours.
    assert np.ptp(picture[60:400, 700:1200].astype(int), axis=2).max() == 0
    # One red curve and its band, with a gap where there was no tilt, in the last second of the chart.
    chart = picture[460:, 1150:1265].astype(int)
    red = (chart[:, :, 2] > 150) & (chart[:, :, 0] < 80)
    assert red.any()
    assert words.endswith("25.0 frames/s")
    assert f"roll {np.degrees(tilt.roll_rad):.2f} +- " in words
    assert live_words(None, 0.0, np.nan) == "no tilt; - frames/s"


def test_a_tilt_between_frames_without_one_is_seen(tilt: tiltvp.TiltEstimate, room: RoomImage) -> None:
    """Where every second frame had no tilt the chart was empty."""
    reds = []
    for tilts in ((None, tilt), (None, None)):
        view = TiltView()
        for k in range(40):
            view.add(0.1 * k, tilts[k % 2])
        chart = view.picture(room.bgr, None, "")[460:].astype(int)
        reds.append(np.count_nonzero((chart[:, :, 2] > 150) & (chart[:, :, 0] < 80)))
    assert reds[0] - reds[1] >= 20


def test_bands_are_those_of_the_covariance(tilt: tiltvp.TiltEstimate) -> None:
    roll, pitch = np.radians(roll_and_pitch(tilt))
    sigmas = np.sqrt(np.diag(tilt.covariance_rad2))
    # At small leans the normal is (pitch, -roll, 1).
    assert (pitch[2] - pitch[1], roll[2] - roll[1]) == pytest.approx(2 * 1.96 * sigmas[:2], rel=0.01)
    assert (roll[0], pitch[0]) == pytest.approx((tilt.roll_rad, tilt.pitch_rad))
    assert np.isnan(roll_and_pitch(None)).all()


@pytest.mark.parametrize("pitch", [0.0, -0.8, 1.2])
def test_bands_hold_roll_and_pitch_of_robots_that_lean_far(pitch: float) -> None:
    """Half of a band is the difference that a small error of the normal makes, whichever way it is."""
    normal = np.array([-np.sin(pitch), np.sin(0.3) * np.cos(pitch), np.cos(0.3) * np.cos(pitch)])
    lean: Any = SimpleNamespace(normal=normal, roll_rad=0.3, pitch_rad=pitch, covariance_rad2=1e-8 * np.eye(2))
    differences = []
    for axis in np.cross(np.eye(3), normal):
        n = normal + 1e-4 * axis
        angles = [np.arctan2(n[1], n[2]), -np.arcsin(n[0] / np.linalg.norm(n))]
        differences.append(np.degrees(np.array(angles) - [0.3, pitch]))
    _, _, ends = roll_and_pitch(lean).T
    # The three differences have the covariance of equal errors in the tangent plane.
    half = 1.96 * np.sqrt((np.array(differences) ** 2).sum(axis=0))
    assert np.allclose(ends - np.degrees([0.3, pitch]), half, rtol=1e-3)


def test_time_that_goes_back_begins_a_new_chart(tilt: tiltvp.TiltEstimate, room: RoomImage) -> None:
    view, fresh = TiltView(), TiltView()
    for time_s in (0.0, 1.0, 100.0, 3.0):
        view.add(time_s, tilt)
    fresh.add(3.0, tilt)
    assert np.array_equal(view.picture(room.bgr, None, ""), fresh.picture(room.bgr, None, ""))


def test_closing_the_window_ends(run: Run, world: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[np.ndarray] = []

    class Window:
        def __init__(self, _: str) -> None:
            self.is_open = True

        def show(self, picture: np.ndarray) -> None:
            shown.append(picture)
            self.is_open = len(shown) < 4

        def close(self) -> None:
            pass

    monkeypatch.setattr("tiltvp.cli.window.Window", Window)
    out = tmp_path / "a.csv"
    code, said, complaints = run("tilt", world / "drive.mp4", "--camera", world / "camera.toml", "--show", "--out", out)
    assert (code, len(out.read_text().splitlines())) == (0, 1 + 4), complaints
    assert said.startswith("4 images: ")
    # The black frame has no tilt: the right panel is black too.
    assert shown[2][100:350, 850:1050].max() == 0
    assert shown[3][100:350, 850:1050].max() > 100
    # What is no image is told, and whether the window is still open is asked.
    shown.clear()
    images = [world / "images" / name for name in ("0.png", "9.png")]
    assert run("tilt", *images, "--camera", world / "camera.toml", "--show")[0] == 1
    assert [picture[100:350, 200:400].max() > 100 for picture in shown] == [True, False]


def test_no_screen(run: Run, world: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class TclError(Exception):
        pass

    def no_root() -> None:
        raise TclError("no display name and no $DISPLAY environment variable")

    # Debian's Python comes without it.
    monkeypatch.setitem(sys.modules, "tkinter", SimpleNamespace(Tk=no_root, TclError=TclError))
    words = ("tilt", world / "drive.mp4", "--camera", world / "camera.toml", "--show")
    code, _, complaints = run(*words)
    assert code == 2
    assert complaints.splitlines()[-1].endswith("expected a screen, or --rerun FILE.rrd")
    monkeypatch.setitem(sys.modules, "tkinter", None)
    code, _, complaints = run(*words)
    assert code == 1
    assert "expected the system's package python3-tk" in complaints


@pytest.mark.parametrize("threads", [1, 2])
def test_tilt_in_rerun(run: Run, world: Path, tmp_path: Path, threads: int) -> None:
    record, table = tmp_path / "tilt.rrd", tmp_path / "tilt.csv"
    words = ("--camera", world / "camera.toml", "--threads", threads, "--out", table)
    code, _, _ = run("tilt", "--rerun", record, world / "images", *words)
    assert code == 1  # One file is no image.
    each = ("/image", "/level", "/tilt/roll_deg", "/tilt/pitch_deg", "/confidence", "/frame_rate_hz")
    assert rows_of(record) == {"/log": 1} | dict.fromkeys(each, FRAMES + 1)
    # Of the black frame nothing is level, and the last one is no image: the pictures before them do not stay.
    assert (gone_of(record, "/image"), gone_of(record, "/level")) == ([5], [2, 5])
    rolls = [row.split(",")[4] for row in table.read_text().splitlines()[1:]]
    values = values_of(record, "/tilt/roll_deg")
    assert values[[0, 1, 3, 4], 0] == pytest.approx(np.degrees([float(rolls[k]) for k in (0, 1, 3, 4)]))
    assert values[0, 1] < values[0, 0] < values[0, 2]
    assert np.isnan(values[[2, 5]]).all()


def test_tracks_in_rerun(run: Run, world: Path, tmp_path: Path) -> None:
    record, out = tmp_path / "tracks.rrd", tmp_path / "tracks.csv"
    words = ("--camera", world / "camera.toml", "--support-min-px", 5, "--out", out)
    assert run("track", world / "drive.mp4", *words, "--rerun", record)[0] == 0
    rows = rows_of(record)
    tracks: dict[str, list[int]] = {}
    for line in out.read_text().splitlines()[1:]:
        frame, _, track, *_ = line.split(",")
        tracks.setdefault(f"/tracks/{track}/bearing_deg", []).append(int(frame))
    assert rows.pop("/image") == FRAMES
    assert len(tracks) > 3
    for track, frames in tracks.items():
        # A curve has a gap from where its line is not seen, as in the black frame, which it was drawn across.
        ends = [frame for frame in frames if frame + 1 not in frames and frame + 1 < FRAMES]
        assert rows.pop(track) == len(frames) + len(ends)
        assert np.isnan(values_of(record, track)).sum() == len(ends)
    assert not rows
    assert any(2 not in frames and max(frames) > 2 > min(frames) for frames in tracks.values())


def test_a_mounting_that_converges_in_rerun(run: Run, tmp_path: Path) -> None:
    drive, record = simulate_drive("paper", seed=1), tmp_path / "mounting.rrd"
    for name, header, rows in (
        ("wheels.csv", "step,delta_left_m,delta_right_m", [(i, *row) for i, row in enumerate(drive.odometry.tolist())]),
        ("bearings.csv", "step,landmark,bearing_rad", [(int(a), int(b), c) for a, b, c in drive.bearings.tolist()]),
    ):
        (tmp_path / name).write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n")
    sure = ("--wheel-base", 0.4, "--step-sigma", 1e-4, "--step-sigma-deg", 0.01)
    assert run("calibrate", tmp_path / "wheels.csv", tmp_path / "bearings.csv", *sure, "--rerun", record)[0] == 0
    rows, steps = rows_of(record), len(drive.odometry)
    each = ("/mounting/x_mm", "/mounting/y_mm", "/mounting/yaw_deg", "/world/robot", "/world/seen")
    assert rows == dict.fromkeys(each, steps) | dict.fromkeys(
        ("/world/way", "/world/robot/camera", "/world/landmarks"), 1
    )
    x_mm = values_of(record, "/mounting/x_mm")
    half = 0.5 * (x_mm[:, 2] - x_mm[:, 1])
    assert half[-1] < 0.2 * half[0]


def test_landmarks_are_where_they_were() -> None:
    """Exact bearings of known places, from a camera that is turned and off the axis."""
    wheels = np.tile([[0.10, 0.13]], (60, 1))
    poses = robot_poses(wheels, wheel_base_m=0.4)
    x, y, yaw = 0.2, -0.1, 0.7
    truth = {3: np.array([2.0, 1.0]), 8: np.array([-3.0, 4.0])}
    rows = []
    for step, (px, py, heading) in enumerate(poses):
        c, s = np.cos(heading), np.sin(heading)
        camera_at = np.array([px + c * x - s * y, py + s * x + c * y])
        for name, place in truth.items():
            toward = place - camera_at
            rows.append((step, name, np.arctan2(toward[1], toward[0]) - heading - yaw))
    rows.append((0, 5, 0.1))  # Seen once: nobody knows how far.
    found = landmark_places(poses, rows, (x, y, yaw))
    assert found.keys() == truth.keys()
    for name, place in truth.items():
        assert found[name] == pytest.approx(place, abs=1e-9)
    # A full circle of arcs comes back.
    around = robot_poses(np.tile([[0.1, 0.1 + 0.4 * 2 * np.pi / 100]], (100, 1)), wheel_base_m=0.4)
    assert around[-1] == pytest.approx([0.0, 0.0, 2 * np.pi], abs=1e-12)


def test_corner_poses_in_rerun(run: Run, tmp_path: Path) -> None:
    StereoRig(CAMERA, CAMERA, LEFT_FROM_RIGHT).save(tmp_path / "rig.toml")
    for side, image in zip(("left", "right"), pair(COLOURS), strict=True):
        for name in "ab":
            tiltvp.write_image(tmp_path / side / f"{name}.png", image)
        tiltvp.write_image(tmp_path / side / "c.png", np.zeros_like(image))
    record = tmp_path / "corner.rrd"
    words = ("corner", tmp_path / "left", tmp_path / "right", "--calibration", tmp_path / "rig.toml", "--rerun", record)
    code, _, complaints = run(*words)
    assert code == 0, complaints
    curves = [f"/corner/{name}" for name in ("roll_deg", "pitch_deg", "yaw_deg", "confidence")]
    assert rows_of(record) == dict.fromkeys([*curves, "/image", "/world/camera"], 3) | {"/log": 1}
    # Where nobody knows the pose the one before does not stay.
    assert gone_of(record, "/world/camera") == [2]
    # The images tell no times.
    assert all("time" not in chunk.timeline_names for chunk in RrdReader(record).stream())
    code, _, complaints = run(*words)
    assert (code, "--rerun" in complaints, "expected a new file, or --overwrite" in complaints) == (2, True, True)


def test_without_rerun_and_wrong_words(run: Run, world: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    words = ("tilt", world / "images", "--camera", world / "camera.toml")
    spawned: list[int] = []
    monkeypatch.setattr("rerun.RecordingStream.spawn", lambda _, port: spawned.append(port))
    with socket.create_server(("127.0.0.1", 0)) as listening:
        monkeypatch.setattr("tiltvp.streams.outputs.viewer._PORT", listening.getsockname()[1])
        for order in ((*words, "--rerun"), (words[0], "--rerun", *words[1:]), (*words, "--rerun", "viewer")):
            # One of the images is broken.
            assert run(*order)[0] == 1
        # The images' names come on stdin.
        monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(str(world / "images/0.png").encode())))
        assert run("tilt", "--rerun", "-", *words[2:])[0] == 0
    assert len(spawned) == 4
    # Without a screen the viewer that was begun has ended already.
    code, _, complaints = run(*words, "--rerun")
    assert (code, complaints.count("\n")) == (1, 1)
    assert "the viewer of Rerun cannot be begun" in complaints
    for wrong in (["--rerun=answers.csv"], ["--rerun", "answers.csv"]):
        code, _, complaints = run(*words, *wrong)
        assert code == 2
        assert "--rerun answers.csv: ends in '.csv', expected .rrd or viewer" in complaints
    monkeypatch.setitem(sys.modules, "rerun", None)
    code, _, complaints = run(*words, "--rerun", tmp_path / "a.rrd")
    assert code == 1
    assert "pip install 'tiltvp[rerun]'" in complaints
    assert os.listdir(tmp_path) == []


class _Cut:
    """A recording of which a full disk took the end: Rerun writes on, and tells it in its log alone."""

    def save(self, path: Path) -> None:
        """As much as there is room for."""
        path.write_bytes(b"RRF2" + bytes(1000))

    def disconnect(self) -> None:
        """There is nothing more to write."""


def test_a_recording_without_its_end_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from tiltvp.streams.outputs import viewer

    monkeypatch.setattr(viewer, "_rerun", lambda: SimpleNamespace(RecordingStream=lambda _: _Cut()))
    record = tmp_path / "a.rrd"
    with pytest.raises(OutputError, match="its end is missing"), viewer.open_viewer(record):
        pass
    assert os.listdir(tmp_path) == []


def test_the_window_by_a_toolkit_of_paper(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a picture becomes: pixels in the order of red, green, blue, with their size in front."""
    from tiltvp.cli.window import Window

    given: list[bytes] = []

    class Anything:
        def __init__(self, *_: object, **keywords: Any) -> None:
            self.configure(**keywords)

        def configure(self, **keywords: Any) -> None:
            given.extend(value for key, value in keywords.items() if key == "data")

        def __getattr__(self, _: str) -> Callable[..., None]:
            return lambda *_, **__: None

    toolkit = SimpleNamespace(Tk=Anything, Label=Anything, PhotoImage=Anything, TclError=RuntimeError)
    monkeypatch.setitem(sys.modules, "tkinter", toolkit)
    window = Window("title")
    picture = np.zeros((1, 2, 3), np.uint8)
    picture[0, 0] = (1, 2, 3)
    for _ in range(2):
        window.show(picture)
    assert given == [b"P6 2 1 255\n\x03\x02\x01\0\0\0"] * 2
    window.close()
    window.show(picture)
    assert (window.is_open, len(given)) == (False, 2)
