"""docs/measured.md says what the kept runs printed, and the kept runs are of answers that the present build gives."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import measured
from measured import RESTS_ON, ROOT, RUNS, answers_hash

PAGE = (ROOT / "docs" / "measured.md").read_text(encoding="utf-8").partition("## Not yet held")[0]
ROWS = re.findall(r"^\| (.*?) \| `just ([a-z-]+)[^`]*` \| (\d{4}-\d\d-\d\d) \| (.*?) \|$", PAGE, re.MULTILINE)
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?")


def test_every_row_has_a_command_and_a_date() -> None:
    rows = [line for line in PAGE.splitlines() if line.startswith("|") and not line.startswith(("| what", "|---"))]
    assert len(ROWS) == len(rows)


@pytest.mark.parametrize(("what", "recipe", "date", "result"), ROWS, ids=[row[0][:40] for row in ROWS])
def test_rows_say_what_the_kept_run_printed(what: str, recipe: str, date: str, result: str) -> None:
    assert recipe in RESTS_ON
    run = (RUNS / f"{recipe}.txt").read_text(encoding="utf-8")
    head, _, printed = run.partition("\n\n")
    fields = dict(line.split(": ", 1) for line in head.splitlines())
    assert fields["date"] == date
    assert fields["answers"] == answers_hash(recipe), f"{recipe}: answers have changed since; just record {recipe}"
    numbers = {float(word) for word in NUMBER.findall(printed.replace(",", " "))}
    for word in NUMBER.findall(result.replace(",", " ")):
        places = len(word.partition(".")[2].partition("e")[0])
        at = float(word)
        near = any(round(number, places) == at or f"{number:.{places}e}" == f"{at:.{places}e}" for number in numbers)
        assert near, f"{what}: {word} is not in docs/measured/{recipe}.txt"


def test_a_recipe_that_fails_is_told_in_a_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    just = tmp_path / "just"
    just.write_text("#!/bin/sh\necho 1.5\nexit 3\n")
    just.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(measured, "RUNS", tmp_path / "kept")
    with pytest.raises(SystemExit, match="just measure-time: exit code 3, nothing is kept"):
        measured.record("measure-time")
    assert not (tmp_path / "kept").exists()
