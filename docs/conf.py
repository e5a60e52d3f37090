"""The pages of the site, by `just docs`. Sources are read where they stand, so Sphinx's root is the project's."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

import tiltvp
from tiltvp.cli.app import app as commands

ROOT = Path(__file__).parents[1]

project = "tiltvp"
author = "The tiltvp developers"
release = tiltvp.__version__

root_doc = "docs/index"
include_patterns = ["docs/**", "notebooks/*.py", "*.md", "benches/README.md"]
exclude_patterns = ["docs/conf.py", "docs/pictures.py", "docs/measured/*", "README.md", "CODE_OF_CONDUCT.md"]
extensions = ["myst_nb", "sphinx.ext.autodoc"]

# Notebooks are programs in the percent format. A cell that fails, a failed assertion too, fails the build.
nb_custom_formats = {".py": ["jupytext.reads", {"fmt": "py:percent"}]}
nb_execution_mode = "cache"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_execution_cache_path = str(ROOT / "target" / "docs" / "notebooks")
nb_merge_streams = True

myst_heading_anchors = 4
smartquotes = False
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "none"

html_theme = "furo"
html_title = f"tiltvp {release}"
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
html_extra_path = ["site/index.html"]
html_static_path = ["site/static"]
html_css_files = ["wide.css"]
# Nothing is asked of a network, when the pages are made or when they are read.
linkcheck_ignore = [r"https?://"]

_QUOTED = re.compile(r"(`+[^`]*`+)")
_MARK = re.compile(r"([|*\\])|_(?=\W|$)")
_OF_EVERY_VALUE = {"from_dict", "to_dict"}


def constructors() -> dict[str, ast.FunctionDef]:
    """The constructors of the extension's classes by name, from the stub: the library itself does not tell them."""
    tree = ast.parse((ROOT / "python" / "tiltvp" / "_core.pyi").read_text(encoding="utf-8"))
    found = {}
    for one in tree.body:
        if isinstance(one, ast.ClassDef):
            for part in one.body:
                if isinstance(part, ast.FunctionDef) and part.name == "__new__":
                    found[one.name] = part
    return found


NEW = constructors()


def constructor(thing: Any) -> ast.FunctionDef | None:
    """That of a class of the extension, or of what derives from one without a constructor of its own."""
    for one in thing.__mro__:
        if one.__module__ == "tiltvp._core":
            return NEW.get(one.__name__)
        if "__init__" in one.__dict__ or "__new__" in one.__dict__:
            return None
    return None


def signature(_app: Any, what: str, _name: str, thing: Any, _options: Any, given: str, _back: str) -> Any:
    """A class' arguments without their types, which the options' page and the stub have; private ones are left out."""
    if what != "class" or (new := constructor(thing)) is None:
        return (given, None)
    arguments = new.args
    kept = [
        (one, default)
        for one, default in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
        if not one.arg.startswith("_")
    ]
    arguments.kwonlyargs, arguments.kw_defaults = [one for one, _ in kept], [default for _, default in kept]
    for one in [*arguments.args, *arguments.kwonlyargs]:
        one.annotation = None
    told = ast.unparse(arguments).removeprefix("cls").removeprefix(", ").removeprefix("/").removeprefix(", ")
    return (f"({told})", None)


def docstring(_app: Any, what: str, _name: str, thing: Any, _options: Any, lines: list[str]) -> None:
    """Docstrings are plain text with code in backticks: what reStructuredText would make of other marks is taken away.

    Classes get the parameters of their constructors, as the stub has them.
    """
    told = constructor(thing) if what == "class" else None
    text = [*lines, "", *(ast.get_docstring(told) or "").splitlines()] if told else list(lines)
    lines[:] = fields([escaped(line) for line in text])


def escaped(line: str) -> str:
    """A line of text outside of whose backticks nothing is a mark."""
    parts = _QUOTED.split(line)
    parts[::2] = [_MARK.sub(lambda mark: "\\" + mark.group(0), part) for part in parts[::2]]
    return "".join(parts)


def fields(lines: list[str]) -> list[str]:
    """NumPy's section of parameters as a list."""
    if "Parameters" not in lines:
        return lines
    place = lines.index("Parameters")
    made = lines[:place]
    for line in lines[place + 2 :]:
        made += [line] if not line or line.startswith(" ") else ["", f"`{line}`"]
    return made


def skipped(_app: Any, _what: str, name: str, _thing: Any, skip: bool, _options: Any) -> bool | None:
    """Leaves out what every value has, which the reference says once."""
    return True if name in _OF_EVERY_VALUE else None


def write_commands(_app: Any) -> None:
    """The page of the command line, from the commands themselves."""
    path = ROOT / "target" / "docs" / "commands.md"
    path.parent.mkdir(parents=True, exist_ok=True)
    text = commands.generate_docs(output_format="markdown", heading_level=1)
    # The table of contents is the page's own.
    path.write_text(re.sub(r"## Table of Contents\n.*?(?=\n\*\*Commands)", "", text, flags=re.DOTALL), encoding="utf-8")


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect("builder-inited", write_commands)
    app.connect("autodoc-process-signature", signature)
    app.connect("autodoc-process-docstring", docstring)
    app.connect("autodoc-skip-member", skipped)
