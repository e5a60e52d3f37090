"""Every answer is, to the last bit, the one that is kept in `golden/`; `just golden` keeps those of today."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import measured
import tiltvp
from golden import __main__ as golden
from golden.cases import CAMERAS, GROUPS, METHODS, answers, kept_file
from tiltvp import _core


def test_every_lens_and_method_is_asked() -> None:
    lenses = {camera.model for camera in CAMERAS.values()}
    methods = {method for method, _ in METHODS.values()} | {"segments"}  # A group of its own.
    assert [name for name in _core.CAMERA_MODELS if name not in lenses] == [], "not among CAMERAS of golden/cases.py"
    assert [name for name in tiltvp.METHODS if name not in methods] == [], "not among METHODS of golden/cases.py"


@pytest.mark.slow
@pytest.mark.parametrize("group", GROUPS)
def test_answers_are_those_that_are_kept(group: str) -> None:
    kept = json.loads(kept_file(group).read_text())
    now = answers(group)
    if_meant = f"if that is meant, `just golden {group}` keeps them, and the change is read as a diff"
    assert list(now) == list(kept), f"other questions than are kept; {if_meant}"
    changed = [name for name in now if now[name] != kept[name]]
    assert not changed, f"{len(changed)} of {len(now)} answers changed, {changed[:8]}; {if_meant}"


@pytest.mark.parametrize(
    ("now", "stays"),
    [
        ({"a": {"x": "1.0"}, "b": [1]}, True),
        ({"a": {"x": "1.0", "new": 3}, "b": [1], "c": 2}, True),
        ({"a": {"x": "1.5"}, "b": [1]}, False),
        ({"a": {"x": "1.0"}, "b": [1, 2]}, False),
        ({"a": {"x": "1.0"}}, False),
        ({"a": {"y": "1.0"}, "b": [1]}, False),
    ],
)
def test_a_measurement_stays_valid_while_no_answer_changes(
    now: dict[str, object], stays: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = tmp_path / "tests" / "golden" / "things.json"
    kept.parent.mkdir(parents=True)
    monkeypatch.setattr(measured, "ROOT", tmp_path)
    monkeypatch.setattr(measured, "RUNS", tmp_path)
    monkeypatch.setitem(measured.RESTS_ON, "measure-things", ("things",))
    monkeypatch.setattr(golden, "kept_file", lambda group: kept)
    for told in ({"a": {"x": "1.0"}, "b": [1]}, now):
        monkeypatch.setattr(golden, "answers", lambda group, told=told: told)
        golden.keep("things")
        if told is not now:
            (tmp_path / "measure-things.txt").write_text(measured.header("measure-things", []) + "1.5\n")
    assert json.loads(kept.read_text()) == now
    assert measured.is_of_kept_answers("measure-things") == stays
