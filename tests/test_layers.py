"""The house on the Python side: who may import whom, and what an import may not cost."""

from __future__ import annotations

import ast
import os
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


def blocked(*packages: str) -> str:
    """The beginning of a program in which these packages are as if they were not installed."""
    return f"""
import sys
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {packages}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Blocked())
"""


@pytest.mark.parametrize("topic", ["", "cameras", "formats", "synth", "lines", "corner", "selfcalib", "streams"])
def test_importing_needs_numpy_alone(topic: str) -> None:
    others = (
        "cv2",
        "yaml",
        "tomli_w",
        "rich",
        "cyclopts",
        "polars",
        "matplotlib",
        "plotly",
        "jinja2",
        "scipy",
        "dask",
        "av",
        "rosbags",
    )
    script = blocked(*others) + f"import tiltvp{topic and '.' + topic}; print('lab' in dir(tiltvp))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.slow
def test_importing_is_quick() -> None:
    """It takes no longer than NumPy by the processor: machines are slow and busy by turns."""
    # By the process's own clock: the times of children are counted in ticks of ten milliseconds.
    clock = "; from time import process_time as now; times.append(now())"
    script = f"times = []{clock}; import numpy{clock}; import tiltvp{clock}; a, b, c = times; print((c - b) / (b - a))"
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    ratios = []
    for _ in range(5):
        done = subprocess.run(
            [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True, env=environment
        )
        ratios.append(float(done.stdout))
    assert min(ratios) < 1.0


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


def test_no_file_has_more_than_400_lines() -> None:
    """Of any language, of tests as of the package; what `just stub` writes is not read from end to end."""
    folders = ("benches", "crates", "docs", "notebooks", "python", "tests")
    files = [
        file for folder in folders for file in (ROOT / folder).rglob("*") if file.suffix in {".py", ".rs", ".c", ".h"}
    ]
    lines = {str(file.relative_to(ROOT)): len(file.read_text(encoding="utf-8").splitlines()) for file in files}
    assert len(lines) > 500
    assert {name: count for name, count in lines.items() if count > 400} == {}


def test_no_function_has_more_than_80_lines() -> None:
    """Of Python; clippy.toml holds those of Rust. Lines of docstrings, which the command line prints, count too."""
    folders = ("benches", "crates", "docs", "notebooks", "python", "tests")
    lines = {
        f"{path.relative_to(ROOT)}: {node.name}": (node.end_lineno or 0) - node.lineno + 1
        for folder in folders
        for path in (ROOT / folder).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef)
    }
    assert len(lines) > 2000
    assert {name: count for name, count in lines.items() if count > 80} == {}
