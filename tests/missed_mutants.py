"""The mutants that Rust's tests missed, by the kept answers: each is built into the extension, which is asked again.

It changes the sources of the checkout, one mutant after the other, and puts them back: `just mutants-missed`. The
extension that it leaves is one of the profile quick.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

from tiltvp.cli.terminal import progress_bar

ROOT: Final = Path(__file__).resolve().parent.parent
MUTANTS: Final = ROOT / "out" / "mutants.out"
EXTENSION: Final = ROOT / "python" / "tiltvp" / "_core.abi3.so"
BUILD: Final = ("cargo", "build", "--locked", "--quiet", "--profile", "quick", "--package", "tiltvp-py")
LOOPS_S: Final = 900
"""The tests take a few minutes; a mutant that has not ended by then loops for ever."""
TOLD_BY: Final = {
    "tilt": "tilt or anywhere or filters or level or segments",
    "selfcalib": "calibration",
    "corner": "corners",
}
"""The kept answers that a module of the core has to do with."""


def missed() -> list[dict[str, Any]]:
    """What Rust's tests did not notice."""
    outcomes = json.loads((MUTANTS / "outcomes.json").read_text())["outcomes"]
    return [outcome for outcome in outcomes if outcome["summary"] == "MissedMutant"]


def build() -> None:
    """The extension of the sources as they are."""
    subprocess.run(BUILD, cwd=ROOT, check=True)
    # In place of the old one: a process that has it open keeps it.
    shutil.copy(ROOT / "target" / "quick" / "lib_core.so", EXTENSION.with_suffix(".new"))
    EXTENSION.with_suffix(".new").replace(EXTENSION)


def is_noticed(outcome: dict[str, Any]) -> bool:
    """Whether the tests fail, or do not end, with this mutant."""
    module = Path(outcome["scenario"]["Mutant"]["file"]).parts[3]
    command = [sys.executable, "-m", "pytest", "-q", "-x", "tests/test_golden.py", "-k", TOLD_BY[module]]
    # As the checkout's own package, whatever is installed.
    environment = os.environ | {"PYTHONPATH": str(ROOT / "python")}
    source = ROOT / outcome["scenario"]["Mutant"]["file"]
    original = source.read_bytes()
    # Its second line is what the mutant is called, where git wants a file.
    before, _, change = (MUTANTS / outcome["diff_path"]).read_text().split("\n", 2)
    diff = "\n".join([before, f"+++ {outcome['scenario']['Mutant']['file']}", change])
    try:
        subprocess.run(["git", "apply", "-p0"], cwd=ROOT, input=diff, text=True, check=True)
        build()
        return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, timeout=LOOPS_S).returncode != 0
    except subprocess.TimeoutExpired:
        return True
    finally:
        source.write_bytes(original)


def main() -> None:
    """Prints those that live on, and how many there were."""
    mutants = missed()
    alive = []
    try:
        with progress_bar(len(mutants), "mutants") as bar:
            for outcome in mutants:
                name = outcome["scenario"]["Mutant"]["name"]
                if not is_noticed(outcome):
                    alive.append(name)
                    print(name, flush=True)
                bar.advance()
    finally:
        build()
    print(f"{len(alive)} of {len(mutants)} mutants that Rust's tests missed are missed by the kept answers too")


if __name__ == "__main__":
    main()
