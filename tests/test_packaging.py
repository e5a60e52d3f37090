"""What the package says of what it needs and contains."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_licences_are_those_of_the_crates_in_the_lock() -> None:
    command = [sys.executable, str(ROOT / "crates" / "tiltvp-py" / "licences.py"), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_lock_has_every_requirement_and_its_hashes() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    asked = [*project["dependencies"], *(one for extra in project["optional-dependencies"].values() for one in extra)]
    names = {re.split(r"[^\w.-]", one)[0].lower().replace("_", "-") for one in asked} - {project["name"]}
    lock = (ROOT / "requirements-dev.lock").read_text(encoding="utf-8")
    locked = re.findall(r"^([\w.-]+)==.*\\\n    --hash=sha256:\w{64}", lock, flags=re.MULTILINE)
    assert names <= set(locked)
    assert len(locked) == len(re.findall(r"^[\w.-]+==", lock, flags=re.MULTILINE))
