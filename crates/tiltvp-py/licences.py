"""The licences of the crates that the extension links: `licences.py` writes them, `licences.py --check` compares."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
OUT = ROOT / "THIRD-PARTY-LICENSES"
NAMES = ("LICENSE*", "LICENCE*", "COPYING*", "COPYRIGHT*", "NOTICE*", "UNLICENSE*")
ABOUT = """The extension of tiltvp contains code of these crates. Written by `just licences`.
Of those that are offered under the MIT licence or another, the MIT licence is taken.
"""


def linked() -> list[dict[str, Any]]:
    """The packages of others that the extension links, on any platform, by name."""
    command = ["cargo", "metadata", "--locked", "--format-version", "1"]
    found = json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout)
    packages = {package["id"]: package for package in found["packages"]}
    nodes = {node["id"]: node for node in found["resolve"]["nodes"]}
    (start,) = (key for key, package in packages.items() if package["name"] == "tiltvp-py")
    reached, waiting = set(), [start]
    while waiting:
        key = waiting.pop()
        # Macros run while the extension is built, and are no part of it.
        if key in reached or any("proc-macro" in target["kind"] for target in packages[key]["targets"]):
            continue
        reached.add(key)
        normal = (one for one in nodes[key]["deps"] if any(kind["kind"] is None for kind in one["dep_kinds"]))
        waiting += [one["pkg"] for one in normal]
    others = (packages[key] for key in reached if packages[key]["source"])
    return sorted(others, key=lambda package: (package["name"], package["version"]))


def texts(package: dict[str, Any]) -> list[str]:
    """What a package says in its files of licences and notices: the MIT licence alone, where that is among a choice."""
    folder = Path(package["manifest_path"]).parent
    files = sorted({path for name in NAMES for path in folder.glob(name) if path.is_file()})
    if re.search(r"\bMIT\b", package["license"]) and re.search(r" OR |/", package["license"]):
        chosen = [path for path in files if "APACHE" not in path.name.upper()]
        files = chosen if any("MIT" in path.name.upper() for path in chosen) else files
    return [path.read_text(encoding="utf-8", errors="replace").strip() for path in files]


def page() -> str:
    """A list of the crates, then each text once with the crates that it is of."""
    crates: list[str] = []
    # Many texts differ in line breaks only.
    owners: dict[str, tuple[str, list[str]]] = {}
    for package in linked():
        name = f"{package['name']} {package['version']}"
        crates.append(f"{name}: {package['license']}, {package['repository'] or package['homepage'] or 'crates.io'}")
        for text in texts(package):
            owners.setdefault(" ".join(text.split()), (text, []))[1].append(name)
    parts = [ABOUT + "\n" + "\n".join(crates)]
    parts += [", ".join(names) + "\n\n" + text for text, names in owners.values()]
    return ("\n\n" + "=" * 80 + "\n\n").join(parts) + "\n"


if __name__ == "__main__":
    if "--check" in sys.argv:
        if not OUT.exists() or OUT.read_text(encoding="utf-8") != page():
            sys.exit(f"{OUT.name} is not of the crates in Cargo.lock: run `just licences`")
    else:
        OUT.write_text(page(), encoding="utf-8")
