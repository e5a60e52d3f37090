"""Keeps the answers of today: `just golden` writes them, and the change is read as a diff."""

from __future__ import annotations

import json
import sys
from typing import Any

from golden.cases import GROUPS, answers, kept_file
from measured import RESTS_ON, is_of_kept_answers, stamp


def is_within(old: Any, new: Any) -> bool:
    """Whether answers are as they were, but for questions and fields that are new."""
    if isinstance(old, dict) and isinstance(new, dict):
        return all(key in new and is_within(value, new[key]) for key, value in old.items())
    if isinstance(old, list) and isinstance(new, list):
        return len(old) == len(new) and all(map(is_within, old, new))
    return bool(old == new)


def keep(group: str) -> None:
    """Writes a group; measurements stay valid that rest on answers of which none has changed."""
    now, path = answers(group), kept_file(group)
    before = json.loads(path.read_text()) if path.exists() else {}
    valid = [recipe for recipe, groups in RESTS_ON.items() if group in groups and is_of_kept_answers(recipe)]
    rows = ",\n".join(f"{json.dumps(name)}: {json.dumps(answer)}" for name, answer in now.items())
    path.write_text("{\n" + rows + "\n}\n")
    changed = [name for name, answer in before.items() if not is_within(answer, now.get(name))]
    for recipe in [] if changed else valid:
        stamp(recipe)
    print(f"{group}: {len(now)} answers, {len(changed)} of those that were kept have changed")


if __name__ == "__main__":
    for group in sys.argv[1:] or GROUPS:
        keep(group)
