"""A robot's hours in minutes: live streams, recordings and disks that go wrong, for as long as is asked: `just soak`.

Every round is a live camera whose cable comes loose and whose images come in wrong sizes, under a clock that is set
back; its end by Ctrl-C, also while it is unplugged; a recording whose times go back and whose odometry has gaps; and a
disk that fills. What was lost must have been counted and said, interrupts must end within half a second and a frame,
and memory must stay as it was after the first rounds.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import io
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

import tiltvp
from tiltvp.cli import main
from tiltvp.streams import live
from tiltvp.synth import Room

SIDE = 256
WARM_UP = 3
"""Rounds after which every table and cache is there."""
MEMORY_MB = 5.0
INTERRUPT_S = 0.5
GAP_S = 0.5


class SoakError(AssertionError):
    """What the soak finds."""


def demand(holds: bool, what: object) -> None:
    if not holds:
        raise SoakError(what)


@dataclass
class Pool:
    """Images that a camera could give, and where everything is."""

    folder: Path
    images: list[np.ndarray]
    camera: Path
    random: np.random.Generator


@dataclass
class Plan:
    """What a camera gives, and what it has given."""

    pool: Pool
    frames: int
    """After which Ctrl-C comes, or with `unplugged_at_end` the cable."""
    unplugged_at_end: bool = False
    given: int = 0
    wrong: int = 0
    gaps: int = 0
    """Times without images, however often it was opened in vain."""
    gone: bool = False
    missing: int = 0
    """Tries to open it that are still to fail."""
    interrupted_s: float = 0.0
    backwards: float = 0.0

    def lose(self, missing: int) -> None:
        """The camera gives no image, and cannot be opened so many times."""
        self.gaps += not self.gone
        self.gone, self.missing = True, missing

    def interrupt(self) -> None:
        self.interrupted_s = time.perf_counter()
        os.kill(os.getpid(), signal.SIGINT)


def camera_of(plan: Plan) -> type:
    """What stands for cv2.VideoCapture."""

    class Capture:
        def __init__(self, _: int) -> None:
            plan.missing = max(0, plan.missing - 1)

        def isOpened(self) -> bool:  # noqa: N802
            return plan.missing == 0

        def get(self, _: int) -> float:
            return 30.0

        def release(self) -> None:
            pass

        def read(self) -> tuple[bool, np.ndarray | None]:
            if plan.missing:
                return False, None
            chance = plan.pool.random.random()
            if plan.given >= plan.frames:
                if plan.unplugged_at_end and not plan.interrupted_s:
                    plan.lose(10**9)
                    threading.Timer(0.3, plan.interrupt).start()
                    plan.interrupted_s = -1.0
                    return False, None
                if not plan.interrupted_s:
                    plan.interrupt()
            elif chance < 0.002 and plan.given:
                plan.lose(int(plan.pool.random.integers(1, 4)))
                return False, None
            plan.given += 1
            plan.gone = False
            image = plan.pool.images[int(plan.pool.random.integers(len(plan.pool.images)))]
            if 0.01 < chance < 0.02:
                plan.wrong += 1
                image = image[: int(plan.pool.random.integers(1, SIDE))]
            if chance > 0.995:
                plan.backwards += 3600.0 * plan.pool.random.random()
            return True, image

    return Capture


@contextlib.contextmanager
def played(plan: Plan) -> Iterator[None]:
    """In the block a camera gives what is planned, and the clock is set back at times."""
    capture, clock, again = cv2.VideoCapture, live.time, live._AGAIN_S

    class Clock:
        def monotonic(self) -> float:
            return time.monotonic() - plan.backwards

    cv2.VideoCapture, live.time, live._AGAIN_S = camera_of(plan), Clock(), 0.02  # type: ignore[misc, assignment]
    try:
        yield
    finally:
        cv2.VideoCapture, live.time, live._AGAIN_S = capture, clock, again  # type: ignore[misc, assignment]


@dataclass
class Said:
    """Counts the rows on stdout and the complaints on stderr, and keeps none."""

    rows: int = 0
    bad_rows: int = 0
    complaints: list[str] = field(default_factory=list)


class Rows(io.TextIOBase):
    """Takes stdout."""

    def __init__(self, said: Said) -> None:
        self._said, self._left = said, ""

    def write(self, text: str) -> int:
        *lines, self._left = (self._left + text).split("\n")
        for line in lines:
            self._said.rows += 1
            self._said.bad_rows += json.loads(line)["error"] is not None
        return len(text)


def ran(words: Sequence[object], *, rows: bool = False) -> tuple[int, Said, str]:
    said, errors, plain = Said(), io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(Rows(said) if rows else plain), contextlib.redirect_stderr(errors):
        code = main([str(word) for word in words])
    said.complaints = errors.getvalue().splitlines()
    return code, said, plain.getvalue()


def stream(pool: Pool, frames: int, totals: dict[str, float], *, unplugged_at_end: bool) -> None:
    """A live camera till Ctrl-C: a row for each image and each gap, a complaint for each that could not be used."""
    plan = Plan(pool, frames, unplugged_at_end)
    with played(plan):
        code, said, _ = ran(["tilt", "--live", 0, "--camera", pool.camera, "--filter", "--out", "-"], rows=True)
        took_s = time.perf_counter() - plan.interrupted_s
    lost = plan.wrong + plan.gaps
    demand(code == (1 if lost else 0), f"exit code {code} with {lost} lost")
    demand(said.rows == plan.given + plan.gaps, f"{said.rows} rows of {plan.given} images and {plan.gaps} gaps")
    demand(said.bad_rows == lost, f"{said.bad_rows} rows with an error, {lost} lost")
    told = [line for line in said.complaints if "#" in line]
    demand(len(told) == lost, f"{len(told)} complaints of {lost} lost: {said.complaints[-3:]}")
    end = f"tiltvp: camera 0: {lost} of {said.rows} frames could not be used"
    demand(not lost or said.complaints[-1] == end, said.complaints[-1:])
    demand(took_s < INTERRUPT_S + 0.5, f"an interrupt took {took_s:.2f} s")
    totals["frames"] += said.rows
    totals["gaps"] += plan.gaps
    totals["wrong sizes"] += plan.wrong
    totals["hours set back"] += plan.backwards / 3600.0
    totals["interrupts"] += 1
    totals["slowest interrupt s"] = max(totals["slowest interrupt s"], took_s)


def recording(pool: Pool, totals: dict[str, float]) -> None:
    """Times that go back and odometry with gaps: frames of which nobody knows the motion are counted and named."""
    folder, count = pool.folder / "drive", 60
    times = np.cumsum(pool.random.uniform(0.05, 0.15, count))
    for place in pool.random.integers(5, count, 3):
        times[place] -= pool.random.uniform(0.2, 1.0)
    names = [f"{number:03d}.png" for number in range(count)]
    if not folder.exists():
        for number, name in enumerate(names):
            tiltvp.write_image(folder / "images" / name, pool.images[number % len(pool.images)])
    rows = "\n".join(f"{name},{time_s:.6f}" for name, time_s in zip(names, times, strict=True))
    (folder / "frames.csv").write_text(f"file,time_s\n{rows}\n")
    ticks = np.arange(0.0, times.max() + 0.2, 0.05)
    begin = pool.random.uniform(1.0, 3.0)
    ticks = ticks[(ticks < begin) | (ticks > begin + 2.0 * GAP_S)]
    table = "\n".join(f"{time_s:.3f},{0.2 * time_s:.6f},0,{0.1 * time_s:.6f}" for time_s in ticks)
    (folder / "odometry.csv").write_text(f"time_s,x_m,y_m,yaw_rad\n{table}\n")
    out = pool.folder / "drive.csv"
    code, said, _ = ran(["tilt", folder, "--camera", pool.camera, "--filter", "--out", out, "--overwrite"])
    demand(code == 0, f"exit code {code}: {said.complaints}")
    verdicts = [line.count("no-odometry") for line in out.read_text().splitlines()[1:]]
    unknown = sum(verdicts)
    demand(len(verdicts) == count, f"{len(verdicts)} rows of {count}")
    within = int(np.sum((times > begin) & (times < begin + 2.0 * GAP_S)))
    demand(unknown >= within, f"{unknown} frames without odometry, {within} within its gap")
    demand(not unknown or any("gap" in line or "back" in line for line in said.complaints), said.complaints)
    totals["frames"] += count
    totals["without odometry"] += unknown


@contextlib.contextmanager
def small_disk(pool: Pool) -> Iterator[Path]:
    """A disk of a megabyte; without the right to mount, a limit of the size of files has to do."""
    folder = pool.folder / "disk"
    folder.mkdir(exist_ok=True)
    words = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    if subprocess.run(words, capture_output=True, check=False).returncode == 0:
        try:
            yield folder
        finally:
            subprocess.run(["umount", str(folder)], check=True)
        return
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, before[1]))
    try:
        yield folder
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def filling(pool: Pool, totals: dict[str, float]) -> None:
    """Pictures of a live camera on a disk that fills: one sentence, exit code 1, and nothing half written."""
    with small_disk(pool) as disk:
        plan = Plan(pool, 10**9)
        with played(plan):
            words = ["tilt", "--live", 0, "--camera", pool.camera, "--out", "-", "--overlay", disk / "seen"]
            code, said, _ = ran(words, rows=True)
        demand(code == 1, f"exit code {code} on a full disk")
        demand("cannot be written" in said.complaints[-1], said.complaints[-1])
        left = [path.name for path in (disk / "seen").iterdir() if path.name.startswith(".")]
        demand(not left, f"left on the disk: {left}")
        for path in (disk / "seen").iterdir():
            demand(cv2.imread(str(path)) is not None, f"{path.name} is no whole picture")
            path.unlink()
        totals["frames"] += plan.given
        totals["disks filled"] += 1


def resident_mb() -> float:
    """Megabytes of this process that are in memory."""
    gc.collect()
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 2**20


def soak(minutes: float, frames: int, seed: int) -> dict[str, Any]:
    """Rounds until the time is over; raises `SoakError`."""
    cv2.setNumThreads(1)
    totals: dict[str, float] = dict.fromkeys(
        ("rounds", "frames", "gaps", "wrong sizes", "hours set back", "without odometry", "disks filled",
         "interrupts", "slowest interrupt s"), 0.0,
    )  # fmt: skip
    middle = (SIDE - 1) / 2
    camera = tiltvp.Camera.equidistant(width=SIDE, height=SIDE, focal_px=76.0, cx=middle, cy=middle, max_theta_rad=1.6)
    room = Room("office", 3)
    images = [
        room.render(camera, pose=pose, alpha_rad=0.03, beta_rad=0.3 * number, samples=1).bgr
        for number, pose in enumerate(room.free_poses(12, seed=1))
    ]
    end, memory = time.monotonic() + 60.0 * minutes, []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        camera.save(folder / "camera.toml")
        pool = Pool(folder, images, folder / "camera.toml", np.random.default_rng(seed))
        while time.monotonic() < end or totals["rounds"] <= WARM_UP:
            stream(pool, frames, totals, unplugged_at_end=False)
            stream(pool, frames // 10, totals, unplugged_at_end=True)
            recording(pool, totals)
            filling(pool, totals)
            totals["rounds"] += 1
            memory.append(resident_mb())
            if sys.stderr.isatty() or totals["rounds"] % 10 == 1:
                print(f"round {totals['rounds']:.0f}: {totals['frames']:.0f} frames, {memory[-1]:.1f} MB", flush=True)
            if len(memory) > WARM_UP:
                grown = memory[-1] - memory[WARM_UP - 1]
                demand(grown < MEMORY_MB, f"memory has grown by {grown:.1f} MB in {totals['rounds']:.0f} rounds")
    warm = memory[WARM_UP - 1 :]
    return totals | {"memory MB": warm[-1], "memory grown by MB": max(warm) - warm[0]}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--frames", type=int, default=3000, help="of a live stream between two ends")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    for key, value in soak(given.minutes, given.frames, given.seed).items():
        print(f"{key}: {value:.10g}" if value == int(value) else f"{key}: {value:.2f}")
