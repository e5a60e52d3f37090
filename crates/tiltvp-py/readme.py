"""Makes the links of README.md absolute, in place, before wheels are built: a package index has no files beside it."""

import re
import sys
import tomllib
from pathlib import Path

_LINK = re.compile(r"(?<=\]\()(?![a-z]+:|#)(?=[^)]+\))")


def absolute(text: str, repository: str) -> str:
    """The text with links into the repository, and with pictures as GitHub gives them."""
    pictures = re.sub(r"!\[[^]]*\]\([^)]+\)", lambda found: _LINK.sub(f"{repository}/raw/main/", found[0]), text)
    return _LINK.sub(f"{repository}/blob/main/", pictures)


if __name__ == "__main__":
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[2]
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    readme = root / project["readme"]
    readme.write_text(absolute(readme.read_text(encoding="utf-8"), project["urls"]["Repository"]), encoding="utf-8")
