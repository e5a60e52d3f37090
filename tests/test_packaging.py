"""What the package says of what it needs and contains."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[1]
WORKFLOWS = ROOT / ".github" / "workflows"


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


def test_all_parts_have_one_version() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]
    crates = [one["version"] for name, one in workspace["dependencies"].items() if name.startswith("tiltvp-")]
    face = (ROOT / "python" / "tiltvp" / "__init__.py").read_text(encoding="utf-8")
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))["version"]
    (told,) = re.findall(r'^__version__ = "(.*)"$', face, re.MULTILINE)
    assert {project["version"], workspace["package"]["version"], *crates, told, cited} == {told}


def test_the_workflows_run_the_commands_of_the_readme() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    commands = [line for line in readme.splitlines() if line.startswith("python3 -m venv")]
    jobs = yaml.safe_load((WORKFLOWS / "ci.yml").read_text(encoding="utf-8"))["jobs"]
    steps = [step.get("run") for step in jobs["test"]["steps"]]
    assert len(commands) == 2
    assert [command for command in commands if command not in steps] == []


def test_links_of_the_readme_lead_somewhere_from_a_package_index(tmp_path: Path) -> None:
    """Wheels and sdist are built with it; whether the files are there test_readme knows of the relative ones."""
    for name in ("README.md", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    for _ in range(2):  # Once more changes nothing.
        subprocess.run([sys.executable, str(ROOT / "crates" / "tiltvp-py" / "readme.py"), str(tmp_path)], check=True)
        links = re.findall(r"(!?)\[[^]]*\]\(([^)]*)\)", (tmp_path / "README.md").read_text(encoding="utf-8"))
        assert len(links) > 20
        assert [link for _, link in links if not link.startswith("https://")] == []
        home = "https://github.com/tiltvp/tiltvp/"
        assert [link for is_picture, link in links if is_picture] == [f"{home}raw/main/docs/images/demo.png"]
        assert ("", f"{home}blob/main/docs/tilt.md") in links
    jobs = yaml.safe_load((WORKFLOWS / "wheels.yml").read_text(encoding="utf-8"))["jobs"]
    for job in ("build", "sdist"):
        steps = [step.get("run", step.get("uses")) for step in jobs[job]["steps"]]
        before = steps[next(k for k, step in enumerate(steps) if step.startswith("PyO3/maturin")) - 1]
        assert before.endswith("crates/tiltvp-py/readme.py")


def test_every_wheel_is_tried_before_it_is_published() -> None:
    jobs = yaml.safe_load((WORKFLOWS / "wheels.yml").read_text(encoding="utf-8"))["jobs"]
    built = {one["name"] for one in jobs["build"]["strategy"]["matrix"]["include"]}
    tested = {one["name"] for job in ("test", "test-musl") for one in jobs[job]["strategy"]["matrix"]["include"]}
    assert built == tested
    assert set(jobs["publish"]["needs"]) == set(jobs) - {"publish"}
    assert all("tests/smoke.py" in str(jobs[job]["steps"]) for job in ("test", "test-musl", "sdist"))


def test_the_container_reads_what_robots_record() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    (installed,) = re.findall(r"\.whl\)\[(.*)\]", (ROOT / "Dockerfile").read_text(encoding="utf-8"))
    assert {"bags", "video"} <= set(installed.split(",")) <= set(extras)
