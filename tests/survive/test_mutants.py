"""Seeded damage to files and states that are sound: an answer or an exception of ours, and soon."""

from __future__ import annotations

import copy
import random
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np
import pytest

import tiltvp
from calibration_texts import SAMPLES
from hostile import noise
from recordings import motions_of
from tiltvp.drive_logs import read_drive_log
from tiltvp.errors import TiltvpError
from tiltvp.formats import FORMATS
from tiltvp.lines import LineExtractor, LineTracker

PIECES = (
    b"nan",
    b"-",
    b"1e999",
    b"0",
    b"9" * 30,
    b"[",
    b"{",
    b'"',
    b"\n",
    b",",
    b"&a ",
    b"*a ",
    b"\0",
    b"\xff",
    b"a.b",
    b"<",
)
SLOWEST_S = 5.0
"""Of the processor, for one mutant."""


def mutant(raw: bytes, rng: random.Random) -> bytes:
    """One to four pieces of it replaced, doubled, removed, or a bit turned."""
    data = bytearray(raw)
    for _ in range(rng.randint(1, 4)):
        start = rng.randrange(len(data) + 1)
        stop = min(len(data), start + rng.randrange(20))
        kind = rng.randrange(4)
        if kind == 0:
            data[start:stop] = rng.choice(PIECES)
        elif kind == 1:
            data[start:start] = data[start:stop] * rng.randint(1, 50)
        elif kind == 2:
            del data[start:stop]
        elif start < len(data):
            data[start] ^= 1 << rng.randrange(8)
    return bytes(data)


def attack(count: int, seed: int, raw: Callable[[random.Random], bytes], use: Callable[[bytes], object]) -> None:
    """Uses so many mutants; each raises an exception of ours or none."""
    rng = random.Random(seed)
    for number in range(count):
        content = mutant(raw(rng), rng)
        start = time.process_time()
        with suppress(TiltvpError):
            use(content)
        assert time.process_time() - start < SLOWEST_S, (number, content[:200])


def test_calibrations(tmp_path: Path) -> None:
    path, names = tmp_path / "camera", [None, *(one.name for one in FORMATS)]
    keys, rng = sorted(SAMPLES), random.Random(5)

    def use(content: bytes) -> None:
        path.write_bytes(content)
        camera = tiltvp.Camera.load(path, rng.choice(names), image_size=rng.choice([None, (640, 480)]))
        assert np.isfinite(camera.project([[0.1, 0.2, 1.0]])).all(axis=1).sum() <= 1
        if camera.width * camera.height <= 2_000_000:
            camera.valid_mask()

    attack(2500, 1, lambda rng: SAMPLES[rng.choice(keys)].text.encode(), use)


def test_logs(tmp_path: Path) -> None:
    wheels = b"step,delta_left_m,delta_right_m,time_s\n" + b"".join(b"%d,0.1,0.11,%d.5\n" % (k, k) for k in range(30))
    seen = b"step,landmark,bearing_rad\n" + b"".join(b"%d,%d,0.%d\n" % (k // 2, k % 5, k) for k in range(60))
    turns = b"file,yaw_deg,distance_m,left_m,right_m\n" + b"".join(b"%d.png,1.5,0.1,0.1,0.1\n" % k for k in range(20))
    files = [Path(f"{k}.png") for k in range(20)]
    paths = [tmp_path / name for name in ("wheels.csv", "seen.csv", "turns.csv")]
    for path, content in zip(paths, (wheels, seen, turns), strict=True):
        path.write_bytes(content)

    def use_log(which: int) -> Callable[[bytes], None]:
        def use(content: bytes) -> None:
            paths[which].write_bytes(content)
            log = read_drive_log(paths[0], paths[1])
            tiltvp.SelfCalibrator(wheel_base_m=0.4).follow(log.odometry, log.bearings)

        return use

    attack(500, 2, lambda _: wheels, use_log(0))
    paths[0].write_bytes(wheels)
    attack(500, 3, lambda _: seen, use_log(1))

    def use_turns(content: bytes) -> None:
        paths[2].write_bytes(content)
        motions_of(paths[2], files)

    attack(500, 4, lambda _: turns, use_turns)


@pytest.mark.parametrize("ending", [".png", ".jpg", ".bmp", ".tif", ".webp", ".pgm", ".jp2"])
def test_images(ending: str, tmp_path: Path) -> None:
    done, encoded = cv2.imencode(ending, cv2.GaussianBlur(noise(1, (64, 96)), (0, 0), 2.0))
    assert done
    raw, path = encoded.tobytes(), tmp_path / f"image{ending}"

    def use(content: bytes) -> None:
        path.write_bytes(content)
        tiltvp.read_image(path)

    attack(150, 6, lambda _: raw, use)


def test_states() -> None:
    camera = tiltvp.Camera.equidistant(width=120, height=90, focal_px=26.0, cx=59.5, cy=44.5)
    extractor, image = LineExtractor(camera), noise(2, (90, 120))
    lines = extractor(image)
    tracker = LineTracker()
    tracker.update(lines, extractor.describe(image, lines))
    calibrator = tiltvp.SelfCalibrator(wheel_base_m=0.4)
    for k in range(6):
        calibrator.step(0.04, 0.05, [1, 2, 3], [0.1 + 0.01 * k, 0.2, 1.0])
    raw = calibrator.__reduce__()[2]

    def use(content: bytes) -> None:
        other = copy.copy(calibrator)
        other.__setstate__(content)
        other.step(0.04, 0.05, [1, 2, 4], [0.1, 0.2, 0.3])
        assert other.estimate is not None

    attack(500, 7, lambda _: raw, use)
    state, rng = tracker.__reduce__()[2], random.Random(8)
    hostile = (0, -1, 2**63, 2**64, 1e308, float("nan"), float("inf"), "", None, [], [1.0], (), True)
    for _ in range(300):
        other = LineTracker()
        try:
            other.__setstate__(damaged(state, rng, hostile))
            other.update(lines, extractor.describe(image, lines))
        except (TiltvpError, TypeError, OverflowError, ValueError):
            continue


def damaged(state: object, rng: random.Random, hostile: tuple[object, ...]) -> object:
    """The state with one of its values replaced, however deep."""
    if isinstance(state, list | tuple) and len(state) and rng.random() < 0.8:
        parts = list(state)
        place = rng.randrange(len(parts))
        parts[place] = damaged(parts[place], rng, hostile)
        return type(state)(parts)
    return rng.choice(hostile)
