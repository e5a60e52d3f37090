"""Frames of videos: with their own times, each in its place, and decoded no more often than it takes."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from recordings import write_video
from tiltvp.errors import counted
from tiltvp.streams import open_frames, video_files

RNG = np.random.default_rng(5)
TIMES_MS = np.cumsum([40, 13, 200, 57, 33, 90, 41, 150, 22, 71, 66, 34]).tolist()


def shade(k: int) -> np.ndarray:
    return np.full((48, 64, 3), 20 * k, np.uint8)


@pytest.mark.parametrize(("ending", "codec"), [("mp4", "mpeg4"), ("mkv", "libx264"), ("avi", "mjpeg")])
def test_videos_have_their_own_times(ending: str, codec: str, tmp_path: Path) -> None:
    path = tmp_path / f"drive.{ending}"
    if codec == "mjpeg":
        from tiltvp.videos import video_writer

        with video_writer(path, 20.0) as writer:
            for k in range(12):
                writer.add(shade(k))
        times = np.arange(12) / 20.0
    else:
        write_video(path, map(shade, range(12)), TIMES_MS, codec=codec)
        times = np.array(TIMES_MS) / 1e3
    frames = open_frames(path)
    assert frames.count == 12
    # Containers may begin their clock with the first frame.
    assert frames.times_s - frames.times_s[0] == pytest.approx(times - times[0], abs=6e-4)
    shown = [int(np.median(frame.read())) for frame in frames]
    assert np.abs(np.array(shown) - 20 * np.arange(12)).max() < 8
    assert [frame.time_s for frame in frames] == frames.times_s.tolist()
    for number, frame in zip((2, 5, 11), frames.sample([2, 5, 11]), strict=True):
        assert frame.name == frames.names[number] == f"{path}#{number:02d}"
        assert abs(int(np.median(frame.read())) - 20 * number) < 8


def test_what_a_video_was_trimmed_by_is_no_frame(tmp_path: Path) -> None:
    """Editors leave the frames from the key frame to the cut in the file, and tell players to pass over them."""
    whole, path = tmp_path / "whole.mp4", tmp_path / "trimmed.mp4"
    one_key = {"sc_threshold": "1000000000"}
    write_video(whole, map(shade, range(12)), [100 * k for k in range(12)], options=one_key)
    with av.open(str(whole)) as source, av.open(str(path), "w") as target:
        stream = source.streams.video[0]
        copied = target.add_stream_from_template(stream)
        for packet in source.demux(stream):
            if packet.dts is not None:
                packet.pts -= round(0.5 / stream.time_base)
                packet.dts -= round(0.5 / stream.time_base)
                packet.stream = copied
                target.mux(packet)
    frames = open_frames(path)
    assert frames.times_s == pytest.approx(0.1 * np.arange(7), abs=1e-3)
    for chosen in (list(frames), list(frames.sample(range(7)))):
        assert [round(float(np.median(one.read())) / 20) for one in chosen] == [5, 6, 7, 8, 9, 10, 11]


@pytest.mark.parametrize("package", ["av", "cv2"])
def test_videos_that_are_shown_turned_are_told(package: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "drive.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=10)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        stream.set_display_rotation(90)
        for k in range(3):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(shade(k), format="bgr24")))
        container.mux(stream.encode())
    if package == "cv2":
        monkeypatch.setitem(sys.modules, "av", None)
    frames = open_frames(path)
    assert next(iter(frames)).read().shape == (48, 64, 3)
    assert "shown turned by 90 degrees counter-clockwise, which is not followed" in frames.notes[-1]


@pytest.mark.parametrize("name", ["drive.mp4", "drive.mpg"])
def test_frames_of_a_video_that_are_chosen_are_those_of_all_and_decoded_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path, times_ms = tmp_path / name, range(0, 60 * 40, 40)
    images = [cv2.resize(RNG.integers(0, 256, (3, 4, 3), np.uint8), (320, 240)) for _ in times_ms]
    if name.endswith(".mpg"):
        # Seeking leads anywhere in such files.
        film = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"PIM1"), 25.0, (320, 240))
        for image in images:
            film.write(image)
        film.release()
    else:
        # Frames shown before a key frame are stored after it.
        options = {"g": "12", "x264-params": "open-gop=1:bframes=3:b-adapt=0"}
        write_video(path, images, times_ms, codec="libx264", options=options)
    frames, count, decoded = open_frames(path), 0, video_files._decoded

    def counted_frames(container: object) -> Iterator[object]:
        nonlocal count
        for frame in decoded(container):
            count += 1
            yield frame

    monkeypatch.setattr(video_files, "_decoded", counted_frames)
    images = [frame.read() for frame in frames]
    assert len(images) == count == 60
    assert all((next(frames.sample([k])).read() == image).all() for k, image in enumerate(images))
    count, chosen = 0, list(range(1, 60, 2))
    assert all((one.read() == images[k]).all() for k, one in zip(chosen, frames.sample(chosen), strict=True))
    assert count < 2 * 60


def test_a_video_that_is_damaged_within_keeps_its_frames_in_their_places(tmp_path: Path) -> None:
    path = tmp_path / "drive.mkv"
    noisy = [RNG.integers(0, 256, (48, 64, 3), np.uint8) for _ in range(12)]
    write_video(path, noisy, TIMES_MS)
    content = bytearray(path.read_bytes())
    content[len(content) // 2 : len(content) // 2 + 3000] = bytes(3000)
    path.write_bytes(bytes(content))
    frames = open_frames(path)
    assert len(list(frames)) == frames.count <= 12
    assert frames.notes == ()
    path.write_bytes(bytes(content[: len(content) // 3]))
    frames = open_frames(path)
    assert 0 < frames.count < 12
    assert frames.notes == (f"{path}: ends before its end, after {counted(frames.count, 'frames')} (cut off?)",)
    assert len(list(frames)) == frames.count
