"""Stereo sequences as folders: pairs of images, calibration, and the true poses; the same bytes for any threads."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent.futures import CancelledError
from threading import Event
from typing import Any, Final

import numpy as np

from tiltvp import _core
from tiltvp.errors import InvalidInputError
from tiltvp.formats.yaml_text import yaml_of
from tiltvp.images import write_image
from tiltvp.lab.datasets.description import CALIBRATION
from tiltvp.lab.datasets.new import NewDataset, in_order, new_folder
from tiltvp.rotations import quaternion
from tiltvp.streams.inertial import INERTIAL_COLUMNS
from tiltvp.synth import Laboratory, StereoSequence, StereoTruth

__all__ = ["CALIBRATION", "POSES", "write_stereo"]

POSES: Final = "poses.txt"
"""The true `object_from_left` of each frame in the object frame of the corner that is looked at: TUM's format."""

_FRAMES: Final = ("frame", "left", "right", "time_s")
_CORNERS: Final = (
    "corner", "kind", "x_m", "y_m", "z_m", *(f"{edge}_{axis}" for edge in ("ex", "ey", "ez") for axis in "xyz"),
    "ex_m", "ey_m", "ez_m", "gamma_rad",
)  # fmt: skip
_TRUTH: Final = (
    "frame", "corner", "left_u_px", "left_v_px", "right_u_px", "right_v_px",
    *(f"{side}_{edge}_px" for side in ("left", "right") for edge in ("ex", "ey", "ez")),
)  # fmt: skip


def write_stereo(
    sequence: StereoSequence,
    out: str | os.PathLike[str],
    *,
    threads: int = 1,
    source: dict[str, Any] | None = None,
    force: bool = False,
    advance: Callable[[], None] = lambda: None,
) -> None:
    """A folder of all frames of a sequence, whole or not at all:

    left/ and right/ (the images of each frame under the same name), camchain.yaml (`CALIBRATION`), poses.txt
    (`POSES`: time, position, quaternion x y z w), frames.csv (when each frame was taken), imu.csv (what an inertial
    sensor reads), corners.csv (where each corner of the scene is, and its edges, in the world), truth.csv (the corners
    in sight at each frame, as `StereoTruth`) and dataset.toml. `advance` is called after each frame. Raises
    `InvalidInputError`, also for cameras that Kalibr's format does not have.
    """
    digits = max(6, len(str(len(sequence) - 1)))
    names = [f"{frame:0{digits}d}.png" for frame in range(len(sequence))]
    calibration = yaml_of(_camchain(sequence))
    stop = Event()
    with new_folder(out, force=force) as new:
        for side in ("left", "right"):
            (new.directory / side).mkdir()

        def render(frame: int) -> StereoTruth:
            if stop.is_set():
                raise CancelledError
            for side, image in zip(("left", "right"), sequence.render(frame, threads=1), strict=True):
                write_image(new.directory / side / names[frame], image)
            return sequence.truth(frame, threads=1)

        truth: list[tuple[object, ...]] = []
        with in_order(render, range(len(sequence)), threads, stop) as results:
            for frame, seen in enumerate(results):
                truth.extend(_truth_rows(frame, seen))
                advance()
        (new.directory / CALIBRATION).write_text(calibration, encoding="utf-8")
        (new.directory / POSES).write_text(_trajectory(sequence), encoding="utf-8")
        _write_tables(sequence, names, truth, new)
        new.write_toml("dataset.toml", _description(sequence, source or {}))


def _write_tables(sequence: StereoSequence, names: list[str], truth: list[tuple[object, ...]], new: NewDataset) -> None:
    times = sequence.times_s.tolist()
    rows = ((k, f"left/{name}", f"right/{name}", time) for k, (name, time) in enumerate(zip(names, times, strict=True)))
    new.write_table("frames.csv", _FRAMES, rows)
    corners = (
        (k, c.kind, *c.position_m.tolist(), *c.edges.ravel().tolist(), *c.lengths_m.tolist(), c.gamma_rad)
        for k, c in enumerate(sequence.corners)
    )
    new.write_table("corners.csv", _CORNERS, corners)
    new.write_table("truth.csv", _TRUTH, truth)
    imu = sequence.imu(seed=sequence.seed)
    readings = np.column_stack([imu.times_s, imu.rates_rad_s, imu.forces_m_s2])
    new.write_table("imu.csv", INERTIAL_COLUMNS, readings.tolist())


def _truth_rows(frame: int, seen: StereoTruth) -> list[tuple[object, ...]]:
    count = len(seen.corners)
    numbers = np.hstack([seen.vertices_px.reshape(count, 4), seen.edges_px.reshape(count, 6)])
    return [(frame, corner, *row) for corner, row in zip(seen.corners.tolist(), numbers.tolist(), strict=True)]


def _trajectory(sequence: StereoSequence) -> str:
    lines = ["# time_s x_m y_m z_m qx qy qz qw of object_from_left"]
    for frame, time in enumerate(sequence.times_s.tolist()):
        pose = np.linalg.inv(sequence.left_from_object(frame))
        values = [time, *pose[:3, 3].tolist(), *quaternion(pose[:3, :3]).tolist()]
        lines.append(" ".join(f"{value:.9f}" for value in values))
    return "\n".join(lines) + "\n"


def _camchain(sequence: StereoSequence) -> dict[str, Any]:
    chain = {f"cam{k}": _kalibr_camera(camera) for k, camera in enumerate(sequence.cameras)}
    chain["cam1"]["T_cn_cnm1"] = np.linalg.inv(sequence.left_from_right).tolist()
    return chain


def _kalibr_camera(camera: _core.Camera) -> dict[str, Any]:
    given = {key: value for key, value in camera.parameters.items() if isinstance(value, float)}
    focal = [given.pop(key) for key in ("fx", "fy", "cx", "cy") if key in given]
    lenses = {
        "pinhole": ("radtan", ("k1", "k2", "p1", "p2")),
        "kannala_brandt": ("equidistant", ("k1", "k2", "k3", "k4")),
    }
    if camera.model not in lenses or camera.mirror:
        raise InvalidInputError(
            f"camera: {camera.model}, expected pinhole or kannala_brandt, which {CALIBRATION} can hold"
        )
    word, keys = lenses[camera.model]
    distortion = [given.pop(key, 0.0) for key in keys]
    if any(given.values()):
        raise InvalidInputError(f"camera: {', '.join(given)}, expected {', '.join(keys)} alone, for {CALIBRATION}")
    return {
        "camera_model": "pinhole",
        "distortion_model": word,
        "intrinsics": focal,
        "distortion_coeffs": distortion,
        "resolution": [camera.width, camera.height],
    }


def _description(sequence: StereoSequence, source: dict[str, Any]) -> dict[str, Any]:
    scene = sequence.scene
    about: dict[str, Any] = {"kind": "laboratory" if isinstance(scene, Laboratory) else "room", "seed": scene.seed}
    if isinstance(scene, Laboratory):
        about |= {"size_m": list(scene.size_m), "gamma_deg": math.degrees(scene.gamma_rad), "clutter": scene.clutter}
    return {
        "frames": len(sequence),
        "seed": sequence.seed,
        "frame_rate_hz": sequence.frame_rate_hz,
        "exposure_s": sequence.exposure_s,
        "corner": sequence.corner,
        "scene": about,
        "source": {"kind": "stereo"} | source,
    }
