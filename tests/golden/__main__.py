"""Keeps the answers of today: `just golden` writes them, and the change is read as a diff."""

from __future__ import annotations

import json
import sys

from golden.cases import GROUPS, answers, kept_file

for group in sys.argv[1:] or GROUPS:
    now = answers(group)
    rows = ",\n".join(f"{json.dumps(name)}: {json.dumps(answer)}" for name, answer in now.items())
    kept_file(group).write_text("{\n" + rows + "\n}\n")
    print(f"{group}: {len(now)} answers")
