"""Runs of the measurements that are kept in `docs/measured/`: `just record RECIPE` runs one and keeps what it prints.

A kept run carries the date and the hash of the golden answers that its numbers rest on. When an answer changes, so does
the hash, and tests/test_measured.py asks for a new run. Questions and fields that are new change no answer: `just
golden` writes the new hash into the runs.
"""

from __future__ import annotations

import datetime
import hashlib
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
RUNS = ROOT / "docs" / "measured"
RESTS_ON: dict[str, tuple[str, ...]] = {
    "measure-panoramas": ("cameras", "tilt", "segments"),
    "measure-views": ("cameras", "segments", "anywhere"),
    "measure-segments": ("cameras", "segments"),
    "measure-inertial": ("cameras", "tilt"),
    "measure-database": ("cameras", "tilt"),
    "measure-striding": ("cameras", "tilt"),
    "measure-level": ("cameras", "tilt", "segments", "anywhere"),
    "measure-colmap": ("cameras", "segments"),
    "measure-planar-pose": ("cameras", "tilt"),
    "measure-lines": ("cameras", "lines"),
    "measure-calibration": ("calibration",),
    "measure-calibration-images": ("cameras", "lines", "calibration"),
    "measure-corners": ("cameras", "corners"),
    "measure-corners-real": ("cameras", "corners"),
    "measure-time": (),
    "measure-growth": (),
    "measure-calibration-time": (),
    "measure-vertical-peers": (),
    "measure-cameras": ("cameras",),
    "measure-install": (),
}
"""The golden groups that a measurement's numbers rest on; none for times and sizes."""


def answers_hash(recipe: str) -> str:
    """Of the golden answers that the numbers of a recipe rest on."""
    digest = hashlib.sha256()
    for group in RESTS_ON[recipe]:
        digest.update((ROOT / "tests" / "golden" / f"{group}.json").read_bytes())
    return digest.hexdigest()[:16]


def is_of_kept_answers(recipe: str) -> bool:
    """Whether there is a kept run, of the answers that are kept now."""
    path = RUNS / f"{recipe}.txt"
    return path.exists() and f"\nanswers: {answers_hash(recipe)}\n" in path.read_text(encoding="utf-8")


def stamp(recipe: str) -> None:
    """Says of a kept run that it is of the answers that are kept now."""
    path = RUNS / f"{recipe}.txt"
    said = f"\nanswers: {answers_hash(recipe)}\n"
    path.write_text(re.sub(r"\nanswers: .*\n", said, path.read_text(encoding="utf-8"), count=1), encoding="utf-8")


def header(recipe: str, arguments: list[str]) -> str:
    """The first lines of a kept run."""
    command = " ".join(["just", recipe, *arguments])
    return f"command: {command}\ndate: {datetime.date.today()}\nanswers: {answers_hash(recipe)}\n\n"


def record(recipe: str, *arguments: str) -> None:
    """Runs a recipe and keeps what it prints; of one that fails nothing."""
    print(f"just {recipe} {' '.join(arguments)}", flush=True)
    done = subprocess.run(["just", recipe, *arguments], cwd=ROOT, stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        sys.exit(f"just {recipe}: exit code {done.returncode}, nothing is kept")
    RUNS.mkdir(exist_ok=True)
    (RUNS / f"{recipe}.txt").write_text(header(recipe, list(arguments)) + done.stdout, encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in RESTS_ON:
        sys.exit(f"expected one of {', '.join(RESTS_ON)}")
    record(*sys.argv[1:])
