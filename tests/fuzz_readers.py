"""Attacks on what reads files, options and states, which coverage guides: an answer or an exception of ours, and soon.

`just survive-long` runs it by a Python that has atheris: `fuzz_readers.py FOLDER [options of libFuzzer]`, with the
folder of what it learns. The first byte of an input says which reader has the rest.
"""

from __future__ import annotations

import copy
import json
import sys
import tempfile
import tomllib
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import atheris

with atheris.instrument_imports(include=["tiltvp"]):
    import tiltvp
    import tiltvp.corner
    import tiltvp.formats.yaml_text  # Which is imported when a file is read.
    import tiltvp.lines
    from tiltvp import _core
    from tiltvp.corrections import TrainedCorrection
    from tiltvp.drive_logs import read_drive_log
    from tiltvp.errors import LONGEST_MESSAGE, TiltvpError
    from tiltvp.formats import FORMATS, read_cameras
    from tiltvp.formats.stereo import read_stereo
    from tiltvp.image_headers import header_size, orientation
    from tiltvp.robot import Robot
    from tiltvp.rotations import read_rotation
    from tiltvp.streams.odometry_tables import OdometryTable

import numpy as np

from calibration_texts import SAMPLES

FORMAT_NAMES = (None, *(one.name for one in FORMATS))
VALUES = sorted(name for name in _core.__all__ if hasattr(getattr(_core, name), "from_dict") and name != "Camera")
"""Without `Camera`, whose `mirror` of other types is a TypeError."""
CAMERA = tiltvp.Camera.equidistant(width=32, height=24, focal_px=9.0, cx=15.5, cy=11.5)
OPTIONED: tuple[Callable[..., object], ...] = (
    tiltvp.TiltFilter,
    tiltvp.SelfCalibrator,
    tiltvp.lines.LineTracker,
    partial(tiltvp.corner.CornerPoseEstimator, tiltvp.corner.CornerDetector(CAMERA)),
)


def states() -> list[Any]:
    """Objects that change as they go, each past a few steps."""
    calibrator = tiltvp.SelfCalibrator(wheel_base_m=0.4)
    tracker, extractor = tiltvp.lines.LineTracker(), tiltvp.lines.LineExtractor(CAMERA)
    image = np.random.default_rng(1).integers(0, 256, (24, 32), dtype=np.uint8)
    lines = extractor(image)
    for k in range(4):
        calibrator.step(0.04, 0.05, [1, 2, 3], [0.1 + 0.01 * k, 0.2, 1.0])
        tracker.update(lines, extractor.describe(image, lines))
    lean = tiltvp.TiltFilter()
    lean.step(([0.0, 0.0, 1.0], 1e-4 * np.eye(2)))
    estimator = tiltvp.corner.CornerPoseEstimator(tiltvp.corner.CornerDetector(CAMERA, method="general"))
    return [calibrator, tracker, lean, estimator]


STATES = states()
FOLDER = Path(tempfile.mkdtemp())


def file_of(content: bytes, name: str = "file") -> Path:
    """The content as a file."""
    path = FOLDER / name
    path.write_bytes(content)
    return path


def cameras(content: bytes) -> object:
    """The second byte says of which format, and whether a size is given."""
    kind = content[0] if content else 0
    size = (640, 480) if kind & 128 else None
    return read_cameras(file_of(content[1:]), FORMAT_NAMES[kind % 128 % len(FORMAT_NAMES)], size)


def drive(content: bytes) -> object:
    """Two tables with a zero byte between."""
    wheels, _, seen = content.partition(b"\0")
    log = read_drive_log(file_of(wheels, "wheels"), file_of(seen, "seen"))
    return tiltvp.SelfCalibrator(wheel_base_m=0.4).follow(log.odometry[:200], log.bearings)


def rotation(content: bytes) -> object:
    """A file of any ending."""
    return [read_rotation(file_of(content, name)) for name in ("file.json", "file.toml")]


def correction(content: bytes) -> object:
    """A trained correction, and the estimator that it asks for."""
    trained = TrainedCorrection.load(file_of(content))
    return trained.estimator_options(CAMERA, {}, None)


def options(content: bytes) -> object:
    """Keywords of a constructor, as TOML; the second byte says whose."""
    try:
        values = tomllib.loads(content[1:].decode())
    except (ValueError, RecursionError):
        return None
    made = OPTIONED[(content[0] if content else 0) % len(OPTIONED)]
    return made(**({"wheel_base_m": 0.4} | values if made is tiltvp.SelfCalibrator else values))


def value(content: bytes) -> object:
    """A frozen value of a dict, as JSON; the second byte says whose. It is told again as it was taken."""
    try:
        values = json.loads(content[1:])
    except (ValueError, RecursionError):
        return None
    kind = getattr(_core, VALUES[content[0] % len(VALUES)])
    made = kind.from_dict(values)
    assert kind.from_dict(made.to_dict()) == made
    return repr(made)


def state(content: bytes) -> object:
    """What pickle has kept, as bytes or JSON; the second byte says whose. What is taken can be kept again."""
    one = copy.copy(STATES[content[0] % len(STATES)]) if content else STATES[0]
    kept: Any = content[1:]
    if not isinstance(one, tiltvp.SelfCalibrator):
        try:
            kept = json.loads(kept)
        except (ValueError, RecursionError):
            return None
        kept = tuple(kept) if isinstance(kept, list) else kept
    # pyo3's own refusals of other types than `__reduce__` gives: pickles are not promised more.
    with suppress(TypeError, OverflowError):
        one.__setstate__(kept)
    if isinstance(one, tiltvp.SelfCalibrator):
        one.step(0.04, 0.05, [1, 2, 4], [0.1, 0.2, 0.3])
        assert one.estimate is not None
    return one.__reduce__()


READERS: tuple[Callable[[bytes], object], ...] = (
    cameras,
    drive,
    rotation,
    correction,
    options,
    value,
    state,
    lambda content: Robot.load(file_of(content)),
    lambda content: read_stereo(file_of(content)),
    lambda content: OdometryTable.read(file_of(content)),
    lambda content: (header_size(content), orientation(content)),
)


def seeds() -> list[bytes]:
    """An input or more for each reader."""
    rows = b"".join(b"%d,0.1,0.11,%d.5\n" % (k, k) for k in range(6))
    wheels = b"step,delta_left_m,delta_right_m,time_s\n" + rows
    seen = b"step,landmark,bearing_rad\n" + b"".join(b"%d,%d,0.%d\n" % (k // 2, k % 3, k) for k in range(12))
    made = [(0, b"\0" + one.text.encode()) for one in SAMPLES.values()]
    made += [(0, bytes([128 + FORMAT_NAMES.index(one.format)]) + one.text.encode()) for one in SAMPLES.values()]
    made += [(1, wheels + b"\0" + seen), (9, wheels), (9, b"time_s,x_m,y_m,yaw_rad\n0,0,0,0\n1,0.5,0,0.1\n")]
    # More digits than a float has room for do not come by chance.
    made.append((2, b'{"robot_from_camera": [[1%s,0,0],[0,1,0],[0,0,1]]}' % (400 * b"0")))
    made += [(2, b'{"robot_from_camera": [[1,0,0],[0,1,0],[0,0,1]]}'), (2, b"quaternion = [0.0, 0.0, 0.0, 1.0]\n")]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file.toml"
        trained = tiltvp.train_affine([1.0, 2.0, 3.0, 4.5], [0.1, 0.2, 0.3, 0.4])
        TrainedCorrection(trained, "image-space-ransac", {}, CAMERA.to_dict(), 4).save(path)
        made.append((3, path.read_bytes()))
        Robot(CAMERA, np.eye(3), place_m=(0.1, 0.2), height_m=0.5).save(path)
        made.append((7, path.read_bytes()))
    made += [(4, b"\0gate_probability = 0.99\nlost_after = 4\n"), (4, b"\1start = [0.1, 0.0, 0.2]\n")]
    image = np.zeros((24, 32), np.uint8)
    values = [trained, tiltvp.TiltEstimator(CAMERA)(image), tiltvp.lines.LineExtractor(CAMERA)(image)]
    values.append(tiltvp.common_direction(np.eye(3)[:2]))
    for one in values:
        made.append((5, bytes([VALUES.index(type(one).__name__)]) + json.dumps(one.to_dict()).encode()))
    for place, one in enumerate(STATES):
        kept = one.__reduce__()[2]
        made.append((6, bytes([place]) + (kept if isinstance(kept, bytes) else json.dumps(kept).encode())))
    made += [(8, one.text.encode()) for one in SAMPLES.values() if one.cameras == 2]
    made += [
        (10, b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\1\0\0\0\1\x08\0\0\0\0"),
        (10, b"II*\0\x08\0\0\0\1\0\0\1\4\0\1\0\0\0\3\0\0\0"),
    ]
    return [bytes([which]) + content for which, content in made]


def attack(data: bytes) -> None:
    """One input."""
    if not data:
        return
    try:
        READERS[data[0] % len(READERS)](data[1:])
    except TiltvpError as error:
        message = str(error.args[0]) if error.args else ""
        assert 0 < len(message) <= LONGEST_MESSAGE, message


def main() -> None:
    """Runs until libFuzzer's options say that it is enough."""
    learned = Path(sys.argv[1])
    learned.mkdir(parents=True, exist_ok=True)
    for number, content in enumerate(seeds()):
        (learned / f"seed-{number}").write_bytes(content)
    atheris.Setup(sys.argv, attack)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
