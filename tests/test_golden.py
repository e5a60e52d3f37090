"""Every answer is, to the last bit, the one that is kept in `golden/`; `just golden` keeps those of today."""

from __future__ import annotations

import json

import pytest

import tiltvp
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
