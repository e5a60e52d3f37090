"""Every answer is, to the last bit, the one that is kept in `golden/`; `just golden` keeps those of today."""

from __future__ import annotations

import json

import pytest

from golden.cases import GROUPS, answers, kept_file

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("group", GROUPS)
def test_answers_are_those_that_are_kept(group: str) -> None:
    kept = json.loads(kept_file(group).read_text())
    now = answers(group)
    assert list(now) == list(kept)
    changed = [name for name in now if now[name] != kept[name]]
    assert not changed, f"{len(changed)} of {len(now)} answers changed: {changed[:8]}"
