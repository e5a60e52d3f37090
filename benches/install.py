"""How large an installation without extras is, and how long `import tiltvp` takes there: `just measure-install`."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

SIZE_MAX_MB, IMPORT_MAX_S, ROUNDS = 260.0, 0.15, 10


def main(environment: Path) -> int:
    """Prints size and time; 1 where one is beyond its limit."""
    [packages] = environment.glob("lib/python*/site-packages")
    sizes = {part.name: megabytes(part) for part in packages.iterdir()}
    for name, size in sorted(sizes.items(), key=lambda item: -item[1])[:6]:
        print(f"{size:8.1f} MB  {name}")
    size = sum(sizes.values())
    print(f"{size:8.1f} MB  in all, at most {SIZE_MAX_MB:.0f}")
    python = environment / "bin" / "python"
    empty, numpy, tiltvp = (best(python, program) for program in ("pass", "import numpy", "import tiltvp"))
    print(f"{tiltvp - empty:8.3f} s   import tiltvp, at most {IMPORT_MAX_S}; NumPy's part {numpy - empty:.3f}")
    return int(size > SIZE_MAX_MB or tiltvp - empty > IMPORT_MAX_S)


def megabytes(path: Path) -> float:
    """The size of a file, or of all files below a folder."""
    files = [path] if path.is_file() else [file for file in path.rglob("*") if file.is_file()]
    return sum(file.stat().st_size for file in files) / 1e6


def best(python: Path, program: str) -> float:
    """Seconds of the quickest of several runs."""
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        subprocess.run([python, "-c", program], check=True, env={**os.environ, "PYTHONPATH": ""})
        times.append(time.perf_counter() - start)
    return min(times)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
