"""The house on the Python side: who may import whom, and what an import may not cost."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import tiltvp

PACKAGE = Path(tiltvp.__file__).parent
ROOT = Path(__file__).parents[1]
MODULES = sorted(PACKAGE.rglob("*.py"))


def test_arrows_point_down() -> None:
    done = subprocess.run(
        [sys.executable, "-c", "from importlinter.cli import lint_imports_command as run; run()"],
        cwd=ROOT, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


def test_only_the_extension_is_taken_from_the_root() -> None:
    """The contract does not look at imports of the root package, because the extension module hangs there."""
    for path in MODULES:
        if path == PACKAGE / "__init__.py":
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module == "tiltvp" and "cli" not in path.parts:
                assert [alias.name for alias in node.names] == ["_core"], f"{path.name}, line {node.lineno}"


@pytest.mark.parametrize("module", ["tiltvp", "tiltvp.synth", "tiltvp.formats"])
def test_importing_is_light(module: str) -> None:
    heavy = ["matplotlib", "polars", "rich", "cyclopts", "hypothesis", "scipy"]
    script = f"import sys, {module}; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip() == "[]"


def test_one_import_brings_the_topics() -> None:
    topics = ["tiltvp.corner.solve", "tiltvp.lines.extract", "tiltvp.synth.render_room"]
    script = f"import tiltvp; print(*(thing.__name__ for thing in ({', '.join(topics)})))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.split() == ["solve", "extract", "render_room"]


def test_only_the_command_line_prints() -> None:
    for path in MODULES:
        if "cli" not in path.parts:
            names = {node.id for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Name)}
            assert "print" not in names, path


def test_what_is_public_is_there() -> None:
    assert len(set(tiltvp.__all__)) == len(tiltvp.__all__)
    for name in tiltvp.__all__:
        thing = getattr(tiltvp, name)
        assert name.endswith("METHODS") or thing.__doc__, name
