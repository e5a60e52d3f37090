"""Types: the package is typed strictly, and the stub of the extension says what the extension does."""

from __future__ import annotations

import ast
import importlib.util
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

from tiltvp import _core

ROOT = Path(__file__).parents[1]


@pytest.mark.slow
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


STUB = (ROOT / "python/tiltvp/_core.pyi").read_text(encoding="utf-8")


def refreshed(stub: str) -> list[str]:
    """The lines of a stub with the names, options and docs that the extension has now."""
    spec = importlib.util.spec_from_file_location("stub", ROOT / "crates/tiltvp-py/stub.py")
    assert spec is not None
    assert spec.loader is not None
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    return ast.unparse(maker.refreshed(ast.parse(stub))).splitlines()


def is_up_to_date(stub: str) -> bool:
    try:
        return refreshed(stub) == ast.unparse(ast.parse(stub)).splitlines()
    except ValueError:
        return False


def test_the_stub_has_the_keywords_the_fields_and_the_docs_of_the_extension() -> None:
    assert refreshed(STUB) == ast.unparse(ast.parse(STUB)).splitlines(), "run `just stub`"


@pytest.mark.parametrize(
    ("there", "elsewhere"),
    [
        pytest.param(" gradient_min: float", " gradient_least: float", id="option"),
        pytest.param("def consistency_band(probability:", "def consistency_band(chance:", id="argument"),
        pytest.param("def alpha_rad(", "def lean_rad(", id="field"),
        pytest.param("def screen_corner(", "def sift_corner(", id="function"),
        pytest.param("Columns of its images.", "Rows of its images.", id="docs"),
        pytest.param("Seed of the random samples.", "A seed.", id="docs of an option"),
    ],
)
def test_another_stub_is_noticed(there: str, elsewhere: str) -> None:
    other = STUB.replace(there, elsewhere, 1)
    assert other != STUB
    assert not is_up_to_date(other)
