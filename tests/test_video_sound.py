"""The sound of a video goes with its level frames: the same packets, at the same times, beside the same frames."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

import tiltvp
from recordings import START_S, Bag
from tiltvp.errors import ImageFileError
from tiltvp.streams import open_frames
from tiltvp.synth import RoomImage
from tiltvp.videos import video_writer

RATE_HZ = 48_000
EVEN_S = tuple(0.1 * k for k in range(20))
UNEVEN_S = tuple(0.1 * k + (0.6 if k >= 10 else 0.0) for k in range(20))


def film(path: Path, times_s: tuple[float, ...], codec: str | None, gray: np.ndarray | None = None) -> Path:
    """A video with frames at these times and, as long as they last, a tone of 440 Hz."""
    base = Fraction(1, 1000)
    seen = np.full((64, 64), 90, np.uint8) if gray is None else gray
    with av.open(str(path), "w") as out:
        video = out.add_stream("mpeg4", rate=30)
        video.bit_rate = 20_000_000  # By less the tilt of some frames is not believed.
        video.time_base = video.codec_context.time_base = base
        video.height, video.width, video.pix_fmt = *seen.shape, "yuv420p"
        sound = None if codec is None else out.add_stream(codec, rate=RATE_HZ, layout="mono")
        for time_s in times_s:
            frame = av.VideoFrame.from_ndarray(np.dstack([seen] * 3), format="bgr24")
            frame.pts, frame.time_base = round(time_s / base), base
            out.mux(video.encode(frame))
        out.mux(video.encode())
        if sound is None:
            return path
        count = round(times_s[-1] * RATE_HZ)
        wave = np.round(8000.0 * np.sin(2.0 * np.pi * 440.0 * np.arange(count) / RATE_HZ)).astype(np.int16)
        for start in range(0, count, 960):
            piece = av.AudioFrame.from_ndarray(wave[None, start : start + 960], format="s16", layout="mono")
            piece.sample_rate, piece.pts, piece.time_base = RATE_HZ, start, Fraction(1, RATE_HZ)
            out.mux(sound.encode(piece))
        out.mux(sound.encode())
    return path


def packets(path: Path) -> list[tuple[float, bytes]]:
    """Time and content of each packet of the sound."""
    with av.open(str(path)) as read:
        return [(float(p.pts * p.time_base), bytes(p)) for p in read.demux(read.streams.audio) if p.size]


def test_levelling_keeps_the_sound(
    run: Callable[..., tuple[int, str, str]], camera: tiltvp.Camera, room: RoomImage, tmp_path: Path
) -> None:
    camera.save(tmp_path / "camera.toml")
    source = film(tmp_path / "drive.mp4", UNEVEN_S, "aac", room.gray)
    words = ["level", source, "--camera", tmp_path / "camera.toml", "--out", tmp_path / "level.mp4"]
    code, _, complaints = run(*words)
    # What stands is compressed to the same images.
    assert (code, [line for line in complaints.splitlines() if "last byte" not in line]) == (0, [])
    level = open_frames(tmp_path / "level.mp4")
    assert level.times_s == pytest.approx(UNEVEN_S, abs=1e-3)
    then, now = packets(source), packets(tmp_path / "level.mp4")
    assert [content for _, content in now] == [content for _, content in then]
    assert [at for at, _ in now] == pytest.approx([at for at, _ in then], abs=1e-6)
    assert len(now) > 80
    with av.open(str(tmp_path / "level.mp4")) as read, av.open(str(source)) as was:
        seconds = [float(one.streams.audio[0].duration * one.streams.audio[0].time_base) for one in (read, was)]
    assert seconds[0] == pytest.approx(seconds[1], abs=1e-6)


@pytest.mark.parametrize(
    ("ending", "codec", "times_s", "told"),
    [
        (".avi", "pcm_s16le", EVEN_S, None),
        (".avi", "pcm_s16le", UNEVEN_S, "sound and picture are up to 0.60 s apart"),
        (".mp4", "wavpack", EVEN_S, "its sound (wavpack) is not copied into .mp4"),
        (".mp4", None, EVEN_S, None),
        (".mp4", None, UNEVEN_S, None),
        (".avi", None, UNEVEN_S, "time and picture are up to 0.60 s apart"),
    ],
)
def test_what_a_container_takes(
    ending: str, codec: str | None, times_s: tuple[float, ...], told: str | None, tmp_path: Path
) -> None:
    source, out = film(tmp_path / "film.mkv", times_s, codec), tmp_path / f"out{ending}"
    with video_writer(out, 10.0, sound_of=source) as video:
        for time_s in times_s:
            video.add(np.full((64, 64, 3), 90, np.uint8), time_s)
    assert told in (video.note or "") if told else video.note is None
    if ending == ".mp4":
        assert open_frames(out).times_s == pytest.approx(times_s, abs=1e-3)
    assert open_frames(out).count == len(times_s)
    assert {file.name for file in tmp_path.iterdir()} == {source.name, out.name}
    kept = codec is not None and codec != "wavpack"
    assert [content for _, content in (packets(out) if kept else [])] == [
        content for _, content in (packets(source) if kept else [])
    ]


@pytest.mark.parametrize("verb", ["level", "track"])
def test_videos_of_a_recording_keep_its_times(
    verb: str, run: Callable[..., tuple[int, str, str]], camera: tiltvp.Camera, room: RoomImage, tmp_path: Path
) -> None:
    camera.save(tmp_path / "camera.toml")
    made = Bag("mcap")
    for time_s in UNEVEN_S:
        made.image("/image", START_S + time_s, room.gray, "mono8")
    for ending, told in ((".mp4", ""), (".avi", "time and picture are up to 0.60 s apart")):
        out = ["--out", tmp_path / f"out{ending}"]
        if verb == "track":
            out = ["--out", tmp_path / f"{ending}.csv", "--video", tmp_path / f"out{ending}"]
        code, _, complaints = run(verb, made.write(tmp_path / ending), "--camera", tmp_path / "camera.toml", *out)
        assert (code, told in complaints) == (0, True)
    assert open_frames(tmp_path / "out.mp4").times_s == pytest.approx(UNEVEN_S, abs=1e-3)


def test_times_that_go_back_are_no_video_s(tmp_path: Path) -> None:
    """An .mp4 was told to want .mp4."""
    with video_writer(tmp_path / "back.mp4", 10.0) as video:
        for time_s in (0.0, 0.1, 0.2, -5.0, -4.9):
            video.add(np.zeros((48, 64, 3), np.uint8), time_s)
    assert video.note == "its frames are not even: time and picture are up to 5.30 s apart, as their times do not rise"


def test_a_source_that_is_no_video_is_told(tmp_path: Path) -> None:
    (tmp_path / "no.mp4").write_text("no video")
    with video_writer(tmp_path / "out.mp4", sound_of=tmp_path / "no.mp4") as video:
        video.add(np.zeros((64, 64, 3), np.uint8), 0.0)
    assert "its sound (of unknown kind) is not copied" in (video.note or "")
    assert open_frames(tmp_path / "out.mp4").count == 1


def test_codecs_that_nobody_knows_are_told(tmp_path: Path) -> None:
    data = film(tmp_path / "known.mkv", EVEN_S, "pcm_s16le").read_bytes()
    (tmp_path / "heard.mkv").write_bytes(data.replace(b"A_PCM/INT/LIT", b"A_UNKNOWN/LIT"))
    with video_writer(tmp_path / "out.mp4", sound_of=tmp_path / "heard.mkv") as video:
        video.add(np.zeros((64, 64, 3), np.uint8), 0.0)
    assert video.note == "its sound (of unknown kind) is not copied into .mp4 (its codec is not known)"
    (tmp_path / "seen.mkv").write_bytes(data.replace(b"V_MPEG4/ISO/ASP", b"V_UNKNOWN/ISO/A"))
    with pytest.raises(ImageFileError, match=r"seen.mkv: cannot be decoded, for its codec is not known"):
        open_frames(tmp_path / "seen.mkv")
