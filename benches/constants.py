"""What each constant of the core does: halved and doubled in a copy of the tree, by golden answers and known truth.

`just measure-constants [PATH...]` (files or folders below crates/tiltvp-core/src; all without) prints, for each module
constant, how many golden answers change, and how the errors of `tests/golden/errors.py` change. A constant that changes
nothing there does nothing, or guards against what the golden images do not hold; its doc comment says which.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import track
from rich.table import Table

ROOT = Path(__file__).parents[1]
CORE = Path("crates/tiltvp-core/src")
TYPES = ("f64", "f32", "usize", "u64", "u32", "u16", "u8", "i64", "i32", "i16")
DECLARED = re.compile(
    rf"^(?P<head> *(?:pub(?:\([a-z ]+\))? )?const (?P<name>[A-Z][A-Z0-9_]*): (?P<type>{'|'.join(TYPES)}) = )"
    r"(?P<value>[^;]+);",
    re.MULTILINE,
)
GROUPS_OF_ROOM = {
    "selfcalib": ["calibration"],
    "corner": ["corners"],
    "lines": ["lines"],
    "tilt": ["tilt", "filters", "level", "anywhere"],
}
"""The golden groups that a room's constants may change; others are asked for all."""
EVERYTHING = sorted(file.stem for file in (ROOT / "tests" / "golden").glob("*.json"))
REPORT = """
import json, sys
from golden.cases import GROUPS, answers, kept_file
from golden.errors import ERRORS
out = {}
for group in sys.argv[1:]:
    kept = json.loads(kept_file(group).read_text())
    try:
        now = answers(group)
    except Exception as error:
        out[group] = {"changed": type(error).__name__, "of": len(kept), "errors": {}}
        continue
    changed = sum(now.get(name) != answer for name, answer in kept.items())
    out[group] = {"changed": changed, "of": len(kept), "errors": ERRORS[group]() if group in ERRORS else {}}
print(json.dumps(out))
"""


@dataclass(frozen=True)
class Constant:
    """A module constant of the core."""

    path: Path
    name: str
    type: str
    value: str

    @property
    def groups(self) -> list[str]:
        """The golden groups that it may change."""
        return GROUPS_OF_ROOM.get(self.path.relative_to(CORE).parts[0], EVERYTHING)

    def scaled(self, text: str, factor: float) -> str:
        """A source with the constant multiplied by a half or by two."""
        one = f"({self.value})"
        if self.type.startswith("f"):
            new = f"{one} * {factor:.1f}"
        else:
            new = f"{one} * {factor:.0f}" if factor > 1.0 else f"{one} / {1.0 / factor:.0f}"
        replace = re.compile(re.escape(f"const {self.name}: {self.type} = {self.value};"))
        return replace.sub(f"const {self.name}: {self.type} = {new};", text, count=1)


def constants(paths: list[Path]) -> Iterator[Constant]:
    """Those of files and folders below the core's sources, but for tests'."""
    for place in paths or [CORE]:
        files = sorted((ROOT / place).rglob("*.rs")) if (ROOT / place).is_dir() else [ROOT / place]
        for path in files:
            library = path.read_text(encoding="utf-8").partition("#[cfg(test)]")[0]
            for match in DECLARED.finditer(library):
                yield Constant(path.relative_to(ROOT), match["name"], match["type"], match["value"])


def report(tree: Path, groups: list[str]) -> dict[str, dict[str, object]] | None:
    """What the build of a tree changes; None where it does not compile."""
    build = ["cargo", "build", "--quiet", "--locked", "--profile", "quick", "--package", "tiltvp-py"]
    if subprocess.run(build, cwd=tree, stderr=subprocess.DEVNULL, check=False).returncode != 0:
        return None
    (tree / "python/tiltvp/_core.abi3.so").write_bytes((tree / "target/quick/lib_core.so").read_bytes())
    environment = {**os.environ, "PYTHONPATH": f"{tree / 'python'}{os.pathsep}{tree / 'tests'}"}
    done = subprocess.run(
        [sys.executable, "-c", REPORT, *groups], env=environment, stdout=subprocess.PIPE, text=True, check=False
    )  # fmt: skip
    return json.loads(done.stdout) if done.returncode == 0 else None


def words(found: dict[str, dict[str, object]] | None, before: dict[str, dict[str, object]]) -> tuple[str, str]:
    """How many answers changed, and which errors moved by how much."""
    if found is None:
        return "refused by the compiler or stopped", ""
    changed = ", ".join(f"{group} {row['changed']} of {row['of']}" for group, row in found.items() if row["changed"])
    moved = [
        f"{name} {old:.3g} -> {new:.3g}"
        for group, row in found.items()
        for name, new in row["errors"].items()  # type: ignore[attr-defined]
        if abs(new - (old := before[group]["errors"][name])) > 5e-4 * abs(old)  # type: ignore[index]
    ]
    return changed or "nothing", "; ".join(moved)


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("paths", nargs="*", type=Path, help="files or folders, such as crates/tiltvp-core/src/corner")
    parser.add_argument("--most", type=int, default=10_000, help="at most so many constants")
    parser.add_argument("--list", action="store_true", help="only list them")
    arguments = parser.parse_args()
    console, chosen = Console(width=200), list(constants(arguments.paths))[: arguments.most]
    if arguments.list:
        for constant in chosen:
            console.print(f"{constant.path} {constant.name} = {constant.value}")
        return
    tree = ROOT / "target" / "constants"
    tree.mkdir(parents=True, exist_ok=True)
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    for name in listed.stdout.splitlines():
        source, copy = ROOT / name, tree / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        if source.exists() and (not copy.exists() or copy.read_bytes() != source.read_bytes()):
            copy.write_bytes(source.read_bytes())
    groups = sorted({group for constant in chosen for group in constant.groups})
    before = report(tree, groups)
    if before is None:
        sys.exit("the tree does not build as it is")
    table = Table("constant", "value", "halved: answers", "errors", "doubled: answers", "errors", expand=True)
    for constant in track(chosen, "constants", console=console):
        path = tree / constant.path
        text = path.read_text(encoding="utf-8")
        cells = []
        for factor in (0.5, 2.0):
            path.write_text(constant.scaled(text, factor), encoding="utf-8")
            cells += words(report(tree, constant.groups), before)
        path.write_text(text, encoding="utf-8")
        table.add_row(f"{constant.path.relative_to(CORE)}\n{constant.name}", constant.value, *cells)
    console.print(table)


if __name__ == "__main__":
    main()
