"""The Dockerfile's steps as a script, where no engine runs: `just docker-steps`.

The files that .dockerignore leaves, each RUN in its order, and the smoke test at its end; folders of the image are
below one of ours, and the second stage has an environment of its own. What only an image has (packages of Debian, a
user) is left out, and said.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).parents[1]
OF_AN_IMAGE = ("apt-get", "useradd")
FOLDERS = re.compile(r"(?<![\w./])/(build|wheels|source|smoke\.py)\b")


def copy_context(to: Path) -> None:
    """What `COPY . .` copies: nothing but what .dockerignore names with a !, without what it names after."""
    kept, left_out = [], []
    for line in (ROOT / ".dockerignore").read_text(encoding="utf-8").split():
        (kept if line.startswith("!") else left_out).append(line.removeprefix("!").removeprefix("**/"))
    for pattern in kept:
        for path in ROOT.glob(pattern):
            target = to / path.relative_to(ROOT)
            target.parent.mkdir(parents=True, exist_ok=True)
            if path.is_dir():
                shutil.copytree(path, target, ignore=shutil.ignore_patterns(*(set(left_out) - {"*"})))
            else:
                shutil.copy(path, target)


def steps() -> list[tuple[int, str]]:
    """The stage and the command of each RUN."""
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8").replace("\\\n", " ")
    found, stage = [], 0
    for line in text.splitlines():
        if line.startswith("FROM "):
            stage += 1
        elif line.startswith("RUN "):
            found.append((stage, re.sub(r"^RUN (--\S+ )*", "", line)))
    return found


def main() -> int:
    """Runs them; the code of the first that fails."""
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        copy_context(root / "source")
        shutil.copy(ROOT / "tests" / "smoke.py", root / "smoke.py")
        venv.create(root / "python", with_pip=True)
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        for stage, command in steps():
            if command.startswith(OF_AN_IMAGE):
                sys.stdout.write(f"left out: {command}\n")
                continue
            sys.stdout.write(f"{command}\n")
            sys.stdout.flush()
            where = {"PATH": f"{root / 'python' / 'bin'}:{os.environ['PATH']}"} if stage > 1 else {}
            there = FOLDERS.sub(lambda found: str(root / found[1]), command)
            done = subprocess.run(["bash", "-c", there], cwd=root / "source", env=environment | where, check=False)
            if done.returncode:
                return done.returncode
    return 0


if __name__ == "__main__":
    sys.exit(main())
