"""Types: the package is typed strictly, and the stub of the extension says what the extension does."""

from __future__ import annotations

import inspect
import subprocess
import sys
from pathlib import Path

import pytest

from tiltvp import _core

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("command", [["mypy"], ["mypy.stubtest", "tiltvp._core"]], ids=["mypy", "stubtest"])
def test_types_are_true(command: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, capture_output=True, text=True, timeout=280, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_everything_public_has_a_docstring() -> None:
    for name in _core.__all__:
        thing = getattr(_core, name)
        if inspect.isclass(thing):
            for member, value in vars(thing).items():
                if not member.startswith("_"):
                    assert value.__doc__, f"{name}.{member}"
        if callable(thing):
            assert thing.__doc__, name
