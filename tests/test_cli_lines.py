"""`tiltvp lines` and `tiltvp track`: tables, pictures and videos of a drive, and frames that cannot be used."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import tiltvp
from commands import Run
from tiltvp.cli.line_options import LineOptions
from tiltvp.cli.options import MethodOptions
from tiltvp.errors import ImageFileError, InvalidInputError, UnknownLeanError
from tiltvp.images import read_image, write_image
from tiltvp.lab.plots.tracks import track_plot
from tiltvp.rotations import read_rotation
from tiltvp.streams import open_frames
from tiltvp.synth import MIRROR_BLIND_RAD, Drive, Room, RoomImage, mirror_camera
from tiltvp.videos import video_writer

pytestmark = pytest.mark.slow

FRAMES = 6


@pytest.fixture(scope="module")
def drive() -> Drive:
    room = Room("corridor", 2, light_spacing_m=0.6)
    camera = mirror_camera().scaled(0.6)
    return Drive(room, camera=camera, blind_rad=MIRROR_BLIND_RAD, frames=FRAMES, seed=3, samples=2)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, drive: Drive) -> Path:
    """A camera, its odometry and the frames of a drive."""
    root = tmp_path_factory.mktemp("drive")
    mirror_camera().scaled(0.6).save(root / "camera.toml")
    for k in range(FRAMES):
        write_image(root / "frames" / f"{k}.png", drive.render(k).gray)
    rows = [f"{k}.png,{turn!r}" for k, turn in enumerate(drive.motions[:, 1].tolist())]
    (root / "odometry.csv").write_text("\n".join(["file,yaw_rad", *rows]) + "\n")
    return root


def test_panoramas_look_ahead_for_lines_as_for_tilts() -> None:
    camera = tiltvp.Camera.equirectangular(width=80, height=40)
    ahead = read_rotation("forward")
    np.testing.assert_array_equal(LineOptions().extractor(camera).robot_from_camera, ahead)
    np.testing.assert_array_equal(MethodOptions().estimator(camera).robot_from_camera, ahead)
    told = LineOptions(robot_from_camera="up")
    np.testing.assert_array_equal(told.extractor(camera).robot_from_camera, np.eye(3))
    np.testing.assert_array_equal(LineOptions().extractor(mirror_camera()).robot_from_camera, np.eye(3))


def test_options_that_change_nothing_are_refused(run: Run, folder: Path) -> None:
    frames, camera = folder / "frames", folder / "camera.toml"
    said = run("lines", frames, "--camera", camera, "--method", "radial", "--tilt", "refined")
    assert said.code == 2
    assert "--tilt refined with the method radial, which knows no lean" in said.complaint
    for words in (["--mirror"], ["--image-size", "80x40"], ["--camera-format", "ros"], ["--camera-name", "0"]):
        said = run("lines", frames, "--camera", "equirectangular:80x40", *words)
        assert said.code == 2
        assert f"{words[0]} beside equirectangular:80x40, expected one of them" in said.complaint


def test_lines_of_images(run: Run, folder: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad.png"
    bad.write_bytes(b"nothing")
    words = (folder / "frames" / "0.png", bad, "--camera", folder / "camera.toml", "--tilt", "refined")
    code, said, complaints = run("lines", *words, "--out", tmp_path / "l.parquet", "--overlay", tmp_path / "seen")
    assert code == 1
    assert complaints.startswith(f"tiltvp: {bad}: not an image")
    table = pl.read_parquet(tmp_path / "l.parquet")
    assert table.height > 5
    assert len(said.splitlines()) == table.height + 2
    assert table.schema["support_px"] == pl.UInt32
    assert table["line"].to_list() == list(range(table.height))
    assert table["bearing_rad"].is_sorted()
    assert read_image(tmp_path / "seen" / "0.png").shape == (288, 384, 3)
    assert not (tmp_path / "seen" / "bad.png").exists()


def test_options_reach_the_method(run: Run, folder: Path, tmp_path: Path) -> None:
    words = (
        "lines",
        folder / "frames" / "0.png",
        "--camera",
        folder / "camera.toml",
        "--out",
        tmp_path / "l.csv",
        "--overwrite",
    )
    assert run(*words, "--lines-max", "3")[0] == 0
    assert pl.read_csv(tmp_path / "l.csv").height == 3
    assert run(*words, "--method", "radial", "--length-min", "0.3")[0] == 0
    code, _, complaints = run(*words, "--method", "radical")
    assert (code, complaints.count("\n")) == (2, 1)
    assert "did you mean radial?" in complaints
    assert run(*words, "--method", "radial", "--lines-max", "3")[0] == 2
    assert "expected one of upright, refined" in run(*words, "--tilt", "none")[2]


def test_track_a_folder(run: Run, folder: Path, tmp_path: Path) -> None:
    out, plot, film = tmp_path / "tracks.csv", tmp_path / "tracks.png", tmp_path / "overlay.mp4"
    words = ("track", folder / "frames", "--camera", folder / "camera.toml", "--out", out)
    code, said, complaints = run(*words, "--odometry", folder / "odometry.csv", "--plot", plot, "--video", film)
    assert (code, complaints) == (0, "")
    table = pl.read_csv(out)
    count = table["track"].n_unique()
    assert said == f"{out}: {FRAMES} frames, {table.height} lines, {count} tracks\n"
    assert table.columns[:6] == ["frame", "file", "track", "bearing_rad", "sigma_rad", "support_px"]
    assert table["frame"].unique().sort().to_list() == list(range(FRAMES))
    assert table.select("frame", "track").is_unique().all()
    assert count < 0.5 * table.height
    assert table.filter(pl.col("frame") == 0)["frames_back"].to_list() == [0] * (table["frame"] == 0).sum()
    assert read_image(plot).shape[2] == 3
    assert [frame.read().shape for frame in open_frames(film)] == [(288, 384, 3)] * FRAMES
    # As a pattern that the shell makes words of.
    files = sorted((folder / "frames").glob("*.png"))
    odometry = ("--odometry", folder / "odometry.csv", "--overwrite")
    assert run("track", *files, *words[2:], *odometry)[:2] == (0, said)
    assert pl.read_csv(out).equals(table)
    again = tmp_path / "again.csv"
    # The lines that are drawn into it may speak against the lens.
    assert run("track", film, "--camera", folder / "camera.toml", "--out", again)[0] == 0
    assert pl.read_csv(again)["file"][0] == f"{film}#0"


def test_a_camera_that_was_bumped_is_told(run: Run, folder: Path, drive: Drive, tmp_path: Path) -> None:
    bumped = tmp_path / "odometry.csv"
    turns = drive.motions[:, 1] + np.radians([0.0, 0.0, 0.0, 20.0, 0.0, 0.0])
    bumped.write_text("file,yaw_rad\n" + "".join(f"{k}.png,{turn!r}\n" for k, turn in enumerate(turns.tolist())))
    words = ("--camera", folder / "camera.toml", "--out", tmp_path / "t.csv", "--overwrite", "--odometry")
    _, _, complaints = run("track", folder / "frames", *words, folder / "odometry.csv")
    assert "bumped" not in complaints
    code, _, complaints = run("track", folder / "frames", *words, bumped)
    assert code == 0, complaints
    said = r"at 1 frame lines turn .* by (19|20)\.\d degrees at .*3\.png: the camera was bumped"
    assert re.search(said, complaints)


def test_a_lean_that_loses_lines_is_not_believed(
    room: RoomImage, upright_room: RoomImage, camera: tiltvp.Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = LineOptions(tilt="refined")
    estimate = tiltvp.TiltEstimator(camera)(room.gray)
    assert options.tilts(camera)(room.gray) == estimate
    monkeypatch.setattr(tiltvp, "TiltEstimator", lambda *_, **__: lambda _: estimate)
    with pytest.raises(UnknownLeanError, match=r"lean not known: confidence .*, or lines"):
        options.tilts(camera)(upright_room.gray)


def test_bad_frames_are_skipped_and_the_turn_is_kept(run: Run, folder: Path, tmp_path: Path) -> None:
    frames = tmp_path / "frames"
    frames.mkdir()
    for k in range(FRAMES):
        (frames / f"{k}.png").write_bytes((folder / "frames" / f"{k}.png").read_bytes() if k != 2 else b"")
    write_image(frames / "3.png", np.zeros((4, 4), np.uint8))
    words = ("--camera", folder / "camera.toml", "--odometry", folder / "odometry.csv")
    code, said, complaints = run("track", frames, *words, "--out", tmp_path / "t.csv")
    assert code == 1
    small, broken, *_ = complaints.splitlines()
    assert small.startswith(f"tiltvp: 1 of {FRAMES} images cannot be used for their size, first {frames / '3.png'}: ")
    assert broken.startswith(f"tiltvp: {frames / '2.png'}: not an image")
    assert f"{FRAMES - 2} frames, 2 skipped" in said
    table = pl.read_csv(tmp_path / "t.csv")
    assert table["frame"].unique().sort().to_list() == [0, 1, 4, 5]
    kept = table.filter((pl.col("frame") == 4) & (pl.col("frames_back") > 0)).height
    assert kept > 0.5 * (table["frame"] == 4).sum()


def test_nothing_is_left_behind(run: Run, folder: Path, tmp_path: Path) -> None:
    (tmp_path / "frames").mkdir()
    (tmp_path / "frames" / "0.png").write_bytes(b"")
    before = sorted(tmp_path.rglob("*"))
    words = ("--camera", folder / "camera.toml", "--out", tmp_path / "t.csv")
    code, _, complaints = run("track", tmp_path / "frames", *words, "--video", tmp_path / "v.mp4")
    assert code == 2
    assert "none of which can be read" in complaints
    for wrong in (("--video", tmp_path / "v.gif"), ("--plot", tmp_path / "p.txt"), ("--odometry", tmp_path / "no.csv")):
        assert run("track", folder / "frames", *words, *wrong)[0] == 2
    assert run("track", tmp_path / "no.mp4", *words)[0] == 2
    assert sorted(tmp_path.rglob("*")) == before


def test_videos(tmp_path: Path) -> None:
    (tmp_path / "text.mp4").write_bytes(b"text")
    with pytest.raises(ImageFileError, match=r"text\.mp4: not a video"):
        open_frames(tmp_path / "text.mp4")
    with video_writer(tmp_path / "empty.avi"):
        pass
    with pytest.raises(InvalidInputError, match="expected"):
        _write(tmp_path / "a.avi", (8, 8, 3), (8, 9, 3))
    assert [file.name for file in tmp_path.iterdir()] == ["text.mp4"]


def _write(path: Path, *shapes: tuple[int, int, int]) -> None:
    with video_writer(path) as film:
        for shape in shapes:
            film.add(np.zeros(shape, np.uint8))


def test_the_plot_breaks_where_bearings_wrap() -> None:
    bearings = [math.radians(angle) for angle in (170.0, -170.0, -150.0)]
    table = pl.DataFrame({"frame": [0, 1, 2], "track": [7, 7, 7], "bearing_rad": bearings})
    assert _gaps(table) == [False, True, False, False]
    (axes,) = track_plot(table).axes
    assert [text.get_text() for text in axes.texts] == ["7"]
    # Another is away while all turn by -220 degrees: from 170 to -50 it passes no end, from -100 to 40 it passes -180.
    bearings = [110.0, 50.0, -10.0, -65.0, -110.0, 170.0, -50.0, -100.0, 40.0]
    rows = {"frame": [0, 1, 2, 3, 4, 0, 4, 0, 4], "track": [0] * 5 + [1] * 2 + [2] * 2}
    table = pl.DataFrame(rows | {"bearing_rad": [math.radians(angle) for angle in bearings]})
    assert [_gaps(table, line) for line in (0, 2, 4)] == [[False] * 5, [False] * 2, [False, True, False]]
    track_plot(table.clear())


def _gaps(table: pl.DataFrame, line: int = 0) -> list[bool]:
    (axes,) = track_plot(table).axes
    return np.isnan(np.asarray(axes.lines[line].get_ydata(), dtype=float)).tolist()
