"""What the README says is true: its Python runs, its commands exist, its table has the defaults in force."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import tiltvp
from tiltvp.formats import FORMATS

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
RECIPES = set(re.findall(r"^([a-z][a-z-]*)(?: [^:=]*)?:(?!=)", (ROOT / "justfile").read_text(), re.MULTILINE))


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


COMMANDS = [line for block in blocks("console") for line in block.splitlines() if line.startswith("tiltvp ")]


def test_the_python_runs(tmp_path: Path) -> None:
    (program,) = blocks("python")
    assert len([line for line in program.splitlines() if line.strip()]) <= 14
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    alpha, beta, confidence = (float(word) for word in done.stdout.split()[:3])
    error = tiltvp.tilt_error_rad(tiltvp.normal_from_alpha_beta(alpha, beta), tiltvp.normal_from_alpha_beta(0.07, 0.5))
    assert error < np.deg2rad(2.0)
    assert confidence > 0.5
    assert {path.name for path in tmp_path.iterdir()} == {"camera.toml", "level.png", "edges.png"}


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_and_their_options_exist(command: str) -> None:
    words = shlex.split(command)
    verbs = words[1:3] if words[1] == "camera" else words[1:2]
    program = Path(sys.executable).with_name("tiltvp")
    done = subprocess.run([program, *verbs, "--help"], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    for option in (word for word in words if word.startswith("--")):
        assert re.search(rf"{option}\b", done.stdout), option


def test_recipes_exist() -> None:
    named = set(re.findall(r"\bjust ([a-z][a-z-]*)", README))
    assert {"demo", "test"} <= named
    assert named <= RECIPES, named - RECIPES


def test_what_must_pass_is_the_test_line_of_the_readme() -> None:
    lines = [line for block in blocks("console") for line in block.splitlines() if "rust-just" in line]
    assert [line.rsplit(" ", 1)[1] for line in lines] == ["demo", "test"]
    assert lines[1] in (ROOT / ".ci" / "run").read_text().splitlines()


def test_the_table_of_options_has_the_defaults_in_force(camera: tiltvp.Camera) -> None:
    rows = re.findall(r"^\| `(\w+)` \|(.*?)\|(.*?)\|(.*?)\|(.*?)\| .* \|$", README, re.MULTILINE)
    written = {name: [cell.strip() for cell in cells] for name, *cells in rows}
    in_force = [tiltvp.TiltEstimator(camera, method=method).options for method in tiltvp.METHODS]
    expected: dict[str, list[str]] = {}
    for name in dict.fromkeys(name for options in in_force for name in options):
        shown = [options.get(name, "–") for options in in_force]  # noqa: RUF001
        expected[name] = [f"{value:g}" if type(value) in (int, float) else str(value) for value in shown]
    assert written == expected


def test_names_of_methods_and_links() -> None:
    for method in tiltvp.METHODS:
        assert f"| `{method}` |" in README
    for page in [ROOT / "README.md", ROOT / "CONVENTIONS.md", *(ROOT / "docs").glob("*.md")]:
        for link in re.findall(r"\]\((?!https?:)([^)#]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / link).exists(), f"{page.name}: {link}"
    assert len(FORMATS) == 20
