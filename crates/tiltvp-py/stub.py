"""Makes python/tiltvp/_core.pyi: types as pyo3's introspection has them, docs and options as the built module has them.

`just stub` runs it on what `pyo3-introspection` has found in the library. A test holds the stub to `refreshed`.
"""

from __future__ import annotations

import ast
import copy
import inspect
import re
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tiltvp import _core

WIDTH = 120
"""The line length that pyproject.toml sets for ruff."""

METHOD_LISTS: dict[str, Sequence[str | None]] = {
    "TiltEstimator": _core.METHODS,
    "LineExtractor": _core.LINE_METHODS,
    "CornerDetector": _core.CORNER_METHODS,
    "SelfCalibrator": _core.CALIBRATION_METHODS,
    "Drive": [None, "legs"],
}
"""What takes options that depend on the method, and its methods as `option_fields` knows them, the default first."""

LEFT_OUT = {"__repr__", "__reduce__", "__setstate__", "_from_parts"}
"""Members that nobody calls by name: those of `object`, and what pickle finds by itself."""

IMPORTS = {
    "collections.abc": ["Iterable", "Mapping", "Sequence"],
    "typing": ["Any", "Final", "Literal", "Self", "SupportsIndex", "final"],
    "": [],
    "numpy.typing": ["ArrayLike", "NDArray"],
    "typing_extensions": ["disjoint_base"],
}
"""Every name that annotations and decorators may use, by its module, in the order of ruff; "" is numpy itself."""

Definition = ast.FunctionDef | ast.ClassDef


def made(raw: ast.Module) -> ast.Module:
    """The stub of what introspection has found."""
    body: list[ast.stmt] = []
    for node in raw.body:
        if isinstance(node, ast.ClassDef):
            node.body = [method for method in node.body if getattr(method, "name", "") not in LEFT_OUT]
            methods = [method for method in node.body if isinstance(method, ast.FunctionDef)]
            for method in methods:
                spell_method(method, hides_object="object" in {method.name for method in methods})
            body.append(node)
        elif isinstance(node, ast.FunctionDef) and node.name != "__getattr__":
            spell(node)
            body.append(node)
    return refreshed(ast.Module(body, []))


def spell_method(method: ast.FunctionDef, hides_object: bool) -> None:
    spell(method)
    arguments = method.args
    if method.name in ("__new__", "__copy__", "__deepcopy__", "from_dict"):
        method.returns = ast.Name("Self")
    if len(arguments.posonlyargs) == 1:
        # Nobody passes self by keyword.
        arguments.args[:0], arguments.posonlyargs = arguments.posonlyargs, []
    if hides_object:
        for argument in [*arguments.posonlyargs, *arguments.args]:
            if argument.annotation is not None and ast.unparse(argument.annotation) == "object":
                argument.annotation = ast.parse("builtins.object", mode="eval").body


def spell(function: ast.FunctionDef) -> None:
    """Spells the types of a function as people do."""
    arguments = function.args
    every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs, arguments.kwarg]
    for argument in every:
        if argument is not None and argument.annotation is not None:
            argument.annotation = spelled(argument.annotation)
    if function.returns is not None:
        function.returns = spelled(function.returns)


def spelled(annotation: ast.expr) -> ast.expr:
    text = annotation.value if isinstance(annotation, ast.Constant) else ast.unparse(annotation)
    text = str(text).replace("SupportsFloat | SupportsIndex", "float").replace("npt.", "")
    text = re.sub(r"(?<!np\.)\b(bool_|float32|float64|int64|uint8|uint16|uint32)\b", r"np.\1", text)
    text = re.sub(r"\bdict\b(?!\[)", "dict[str, Any]", text)
    if "Incomplete" in text:
        raise ValueError(f"{text}: name the type in Rust")
    return ast.parse(text, mode="eval").body


def refreshed(stub: ast.Module) -> ast.Module:
    """A stub with the names, docs and options of the built module; refuses one that has not the module's members."""
    stub = copy.deepcopy(stub)
    definitions = [node for node in stub.body if isinstance(node, Definition)]
    public = [name for name in sorted(vars(_core)) if not name.startswith("_")]
    constants = [name for name in public if not callable(getattr(_core, name))]
    same("_core", {node.name for node in definitions}, set(public) - set(constants))
    for node in definitions:
        built = getattr(_core, node.name)
        if isinstance(node, ast.ClassDef):
            refresh_class(node, built)
        else:
            refresh_arguments(node, node.name, built.__text_signature__)
            document(node, built.__doc__ + options_doc(node.name, node), 4)
    public.sort(key=lambda name: (not name.isupper(), name[0].islower(), name))
    listed = ast.parse(f"__all__ = {public!r}").body[0]
    kinds = {name: type(getattr(_core, name)).__name__.replace("list", "list[str]") for name in constants}
    named = [ast.parse(f"{name}: Final[{kind}]").body[0] for name, kind in kinds.items()]
    document_module = ast.Expr(ast.Constant(laid_out(_core.__doc__ or "", 0)))
    stub.body = [listed, *named, *definitions]
    stub.body = [document_module, *imports(ast.unparse(stub)), *stub.body]
    return ast.fix_missing_locations(stub)


def imports(text: str) -> list[ast.stmt]:
    lines = ["import builtins"] if "builtins." in text else []
    for module, names in IMPORTS.items():
        lines += [] if module else ["import numpy as np"]
        used = [name for name in names if re.search(rf"\b{name}\b", text)]
        lines += [f"from {module} import {', '.join(used)}"] if used else []
    return ast.parse("\n".join(lines)).body


def refresh_class(node: ast.ClassDef, built: type) -> None:
    methods = [each for each in node.body if isinstance(each, ast.FunctionDef)]
    members = {name for name in vars(built) if not name.startswith("__") and name not in LEFT_OUT}
    same(node.name, {method.name for method in methods if not method.name.startswith("__")}, members)
    document(node, built.__doc__ or "", 4)
    for method in methods:
        if method.name == "__new__":
            refresh_arguments(method, node.name, built.__text_signature__ or "")
            document(method, options_doc(node.name, method).strip(), 8)
        else:
            member = getattr(built, method.name)
            if not method.name.startswith("__") and callable(member):
                refresh_arguments(method, "", member.__text_signature__)
            document(method, "" if method.name.startswith("__") else member.__doc__, 8)


def same(owner: str, stub: set[str], module: set[str]) -> None:
    if stub != module:
        only = f"{sorted(stub - module)} stand in the stub alone, {sorted(module - stub)} in the module alone"
        raise ValueError(f"{owner}: {only}; run `just stub`")


def refresh_arguments(function: ast.FunctionDef, owner: str, signature: str) -> None:
    """Holds the arguments to the module's, and puts the options of `owner` where `**options` stands."""
    parsed = ast.parse(f"def own{signature.replace('$', '')}: ...").body[0]
    assert isinstance(parsed, ast.FunctionDef)
    own, arguments = argument_names(parsed.args), function.args
    keywords = dict(zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True))
    chosen: dict[ast.arg, ast.expr] = {}
    if owner and "options" in own:
        own.remove("options")
        former = [default for argument, default in keywords.items() if argument.arg not in own and default is not None]
        marks = [
            *(ast.unparse(default) for default in former),
            ast.unparse(arguments.kwarg).split()[-1] if arguments.kwarg else "",
        ]
        fields = [(name, option) for name, option in options(owner).items() if name not in own]
        chosen = dict(keyword(name, option["type"], none_is_default="None" in marks) for name, option in fields)
        keywords = {argument: default for argument, default in keywords.items() if argument.arg in own}
        arguments.kwarg = None
    arguments.kwonlyargs = list(keywords)
    same(f"{owner}.{function.name}", set(argument_names(arguments)), set(own))
    for argument in keywords:
        if argument.arg == "method" and owner in METHOD_LISTS:
            words = METHOD_LISTS[owner]
            argument.annotation = ast.parse(f"Literal[{', '.join(map(repr, words))}] | str", mode="eval").body
    keywords |= chosen
    arguments.kwonlyargs, arguments.kw_defaults = list(keywords), list(keywords.values())


def argument_names(arguments: ast.arguments) -> list[str]:
    every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs, arguments.vararg, arguments.kwarg]
    return [argument.arg for argument in every if argument is not None and argument.arg not in ("self", "cls")]


def options(owner: str) -> dict[str, dict[str, Any]]:
    """The options of all methods: the type, and by method the default and the doc."""
    found: dict[str, dict[str, Any]] = {}
    for method in METHOD_LISTS.get(owner, [None]):
        for field in _core.option_fields(owner, method):
            option = found.setdefault(field["name"], {"type": field["type"], "defaults": {}, "docs": {}})
            option["defaults"][method] = field["default"]
            option["docs"].setdefault(field["doc"], []).append(method)
    return found


def keyword(name: str, annotation: str, none_is_default: bool) -> tuple[ast.arg, ast.expr]:
    text = re.sub(r"tuple\[[^\]]*\]", "ArrayLike", annotation.replace("npt.", ""))
    text = re.sub(r"\bint\b", "SupportsIndex", text)
    if none_is_default:
        # The values may come from a file: words are any text there.
        text = re.sub(r"Literal\[.*?\]", "str", text)
        text += "" if "None" in text else " | None"
    default: Any = None if none_is_default else ...
    return ast.arg(name, ast.parse(text, mode="eval").body), ast.Constant(default)


def takes_options(owner: str) -> bool:
    return "**options" in (getattr(_core, owner).__text_signature__ or "")


def options_doc(owner: str, function: ast.FunctionDef) -> str:
    """What the docs of a class or function say of its options."""
    if not takes_options(owner):
        return ""
    keywords = dict(zip(function.args.kwonlyargs, function.args.kw_defaults, strict=True))
    taken = {argument.arg: default for argument, default in keywords.items()}
    methods = METHOD_LISTS.get(owner, [None])
    lines = ["", "", "The options, by keyword.", "", "Parameters", "----------"]
    for name, option in options(owner).items():
        if name not in taken:
            continue
        lines.append(name)
        for doc, having in option["docs"].items():
            named = [f'"{method}"' for method in having if method not in (None, name)]
            which = ", ".join(named) + ": " if named and len(having) < len(methods) else ""
            defaults = {default_text(option["defaults"][method]) for method in having}
            default = f" Default: {defaults.pop()}." if len(defaults) == 1 else " The default depends on the method."
            lines.append(f"    {which}{' '.join(doc.split())}{default if taken[name] else ''}")
    return "\n".join(lines)


def default_text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if hasattr(value, "tolist"):
        return str(value.tolist())
    return f'"{value}"' if isinstance(value, str) else str(value)


def document(node: Definition, doc: str, indent: int) -> None:
    """Gives a class or function its docstring."""
    rest: list[ast.stmt] = [each for each in node.body if isinstance(each, Definition)]
    text = laid_out(doc, indent)
    node.body = [ast.Expr(ast.Constant(text)), *rest] if text else rest or [ast.Expr(ast.Constant(...))]


def laid_out(doc: str, indent: int) -> str:
    """A docstring as it stands in the file: paragraphs that fit the line."""
    blocks: list[str] = []
    for block in re.split(r"\n\s*\n", inspect.cleandoc(doc)):
        lines = block.split("\n")
        if any(re.match(r"\s|- |\d+\. |---", line) for line in lines):
            wrapped = [part for line in lines for part in wrap(line, indent, line[: -len(line.lstrip())])]
        else:
            wrapped = wrap(" ".join(block.split()), indent, "", "" if blocks else '"""')
        blocks.append("\n".join(wrapped).removeprefix('"""'))
    text = "\n\n".join(blocks)
    if "\n" not in text and indent + len(text) + 6 > WIDTH:
        text = "\n".join(wrap(text, indent + 3, "", '"""')).removeprefix('"""')
    if "\n" not in text:
        return text
    return re.sub(r"\n(?=[^\n])", "\n" + " " * indent, text) + "\n" + " " * indent


def wrap(text: str, indent: int, inner: str, before: str = "") -> list[str]:
    return textwrap.wrap(
        before + text.strip(),
        WIDTH - indent,
        initial_indent=inner,
        subsequent_indent=inner,
        break_long_words=False,
        break_on_hyphens=False,
    ) or [""]


if __name__ == "__main__":
    found, out = map(Path, sys.argv[1:])
    out.write_text(ast.unparse(made(ast.parse(found.read_text()))) + "\n")
