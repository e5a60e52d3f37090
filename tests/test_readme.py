"""What the README says is true: its Python prints what is written, its commands exist, its links lead somewhere."""

from __future__ import annotations

import ast
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import tiltvp
from commands import verbs
from tiltvp.cli.app import app
from tiltvp.formats import FORMATS

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
RECIPES = set(re.findall(r"^([a-z][a-z0-9-]*)(?: [^:]*)?:(?!=)", (ROOT / "justfile").read_text(), re.MULTILINE))
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "benches").glob("*.md")]


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


CONSOLE = [line for block in blocks("console") for line in block.splitlines()]
COMMANDS = [line for line in CONSOLE if line.startswith("tiltvp ")]


def test_it_is_short() -> None:
    assert len(README.split()) <= 900
    assert len(COMMANDS) == 5


@pytest.mark.slow
def test_the_python_prints_what_is_written(tmp_path: Path) -> None:
    (program,), (printed,) = blocks("python"), blocks("text")
    assert len(ast.parse(program).body) <= 5
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout == printed


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_commands_and_their_options_exist(command: str) -> None:
    words = shlex.split(command)
    verbs = words[1:3] if words[1] == "camera" else words[1:2]
    program = Path(sys.executable).with_name("tiltvp")
    done = subprocess.run([program, *verbs, "--help"], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    for option in (word for word in words if word.startswith("--")):
        assert re.search(rf"{option}\b", done.stdout), option


def commands_of(page: Path) -> list[list[str]]:
    """The words of the commands on a page: on lines of their own, indented or after a prompt too, and within one."""
    text = page.read_text(encoding="utf-8").replace("\\\n", " ")
    lines = re.findall(r"^(?:\$ |    )?(tiltvp .*)$", text, re.MULTILINE) + re.findall(r"`(tiltvp [^`]+)`", text)
    return [re.split(r" [|>&#]", line)[0].split()[1:] for line in lines]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_the_commands_of_a_page_have_such_options(page: Path) -> None:
    if page.name == "CHANGELOG.md":  # It tells of some that are gone.
        return
    for words in commands_of(page):
        _, commands, rest = app.parse_commands(words)
        if commands[-1].default_command is None:
            assert rest == [], words
            continue
        known = {name for one in commands[-1].assemble_argument_collection() for name in one.names} | {"--overwrite"}
        given = [word.partition("=")[0] for word in rest if word.startswith("--")]
        assert [word for word in given if word not in known] == [], words


def test_every_verb_is_in_a_guide_or_in_a_recipe() -> None:
    told = "\n".join(page.read_text(encoding="utf-8") for page in [*(ROOT / "docs").glob("*.md"), ROOT / "justfile"])
    missing = [verb for verb in map(" ".join, verbs(app)) if not re.search(rf"tiltvp {verb}\b", told)]
    assert missing == [], "on no page of docs/, and in no recipe of the justfile"


def test_recipes_exist() -> None:
    for page in PAGES:
        named = set(re.findall(r"`just\s+([a-z][a-z0-9-]*)", page.read_text(encoding="utf-8")))
        assert named <= RECIPES, (page.name, named - RECIPES)


def test_recipes_are_told_in_the_one_line_that_is_listed() -> None:
    """`just --list` has the last line above a recipe, so no sentence may begin before it."""
    lines = (ROOT / "justfile").read_text(encoding="utf-8").splitlines()
    comments = [line if line.startswith("#") else "" for line in lines]
    told = {
        line: comments[i - 2 : i]
        for i, line in enumerate(lines)
        if re.match(r"[a-z][a-z0-9-]*(?: [^:]*)?:(?!=)", line) and lines[i - 1] != "[private]"
    }
    assert len(told) > 50
    for recipe, (before, line) in told.items():
        assert re.match(r"# [A-Z0-9`].*\.\)?$", line), recipe
        assert re.match(r"(#.*[.)])?$", before), recipe


def test_how_to_install_and_the_two_commands() -> None:
    assert "pip install ." in CONSOLE
    lines = [line for line in CONSOLE if "rust-just" in line]
    assert [line.rsplit(" ", 1)[1] for line in lines] == ["demo", "test"]
    assert {"demo", "test"} <= RECIPES


def test_what_must_pass_is_the_test_line_of_the_readme_then_the_system_then_real_data() -> None:
    (line,) = (line for line in CONSOLE if "rust-just" in line and line.endswith(" test"))
    steps = [line, ".venv/bin/just test-system", ".venv/bin/just test-real"]
    assert [step for step in (ROOT / ".ci" / "run").read_text().splitlines() if step in steps] == steps
    assert {"test", "test-system", "test-real"} <= RECIPES


def test_as_many_formats_and_the_methods_of_the_library() -> None:
    (told,) = re.findall(r"(\S+) formats of calibration files", README)
    assert (told, len(FORMATS)) == ("twenty", 20), "the README says how many formats are read, here too"
    guide = (ROOT / "docs" / "tilt.md").read_text(encoding="utf-8")
    assert [method for method in tiltvp.METHODS if f"`{method}`" not in guide] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_to_files(page: Path) -> None:
    links = re.findall(r"\]\((?!https?:)([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    assert [link for link in links if not (page.parent / link).exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_to_headings(page: Path) -> None:
    """By the names that GitHub gives them, which the site takes too."""
    for link, heading in re.findall(r"\]\((?!https?:)([^)#]*\.md|)#([^)]*)\)", page.read_text(encoding="utf-8")):
        text = (page.parent / link if link else page).read_text(encoding="utf-8")
        titles = [title.lower().replace(" ", "-") for title in re.findall(r"^#+ (.*)$", text, re.MULTILINE)]
        assert heading in [re.sub(r"[^\w-]", "", title) for title in titles], (link, heading)


def test_symptoms_are_what_is_said() -> None:
    page = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
    camera = tiltvp.Camera.equidistant(width=640, height=480, focal_px=139.7, cx=319.5, cy=239.5)
    estimator = tiltvp.TiltEstimator(camera)
    said = [estimator(np.zeros((480, 640), np.uint8)).reason]
    noise = np.random.default_rng(1).normal(110.0, 30.0, (480, 640)).clip(0.0, 255.0).astype(np.uint8)
    said.append(estimator(noise).reason.partition(" % of the ")[2])
    with pytest.raises(tiltvp.errors.InvalidInputError) as refusal:
        estimator(np.zeros((240, 320), np.uint8))
    said.append(str(refusal.value))
    said.append(tiltvp.LensCheck((20.0, 0.0), 1.0, (0.1, 0.1, 0.01), 0.14, 5, 100).reason.split(" ", 1)[1])
    for symptom in re.findall(r'^\| "([^"]*?)(?: \.\.\.)?"', page, re.MULTILINE):
        assert any(message.startswith(symptom) for message in said), symptom


def guides() -> list[Path]:
    """The pages that the site lists as guides."""
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    return [ROOT / "docs" / f"{name}.md" for name in index.split(":caption: Guides\n")[1].split("```")[0].split()]


@pytest.mark.parametrize("page", guides(), ids=lambda page: page.stem)
def test_guides_open_with_a_picture_and_an_example(page: Path) -> None:
    title, picture, *_ = page.read_text(encoding="utf-8").split("\n\n")
    assert title.startswith("# ")
    assert re.match(r"!\[[^]]{10,}\]\(images/", picture), picture
    opening = page.read_text(encoding="utf-8").split("\n## ")[0]
    example = re.search(r"^```(?:python|console|c)\n(.*?)^```$", opening, re.MULTILINE | re.DOTALL)
    assert example is not None
    assert 2 <= len(example[1].splitlines()) <= 10
