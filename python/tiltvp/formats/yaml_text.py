"""YAML text as a tree of texts, for calibration files of several dialects, and the YAML of tables of ours."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from tiltvp import _core

__all__ = ["LARGEST_YAML_BYTES", "MOST_YAML_VALUES", "tree_of", "yaml_of"]

LARGEST_YAML_BYTES: Final = 150_000
"""Calibrations have up to 100 kB."""
MOST_YAML_VALUES: Final = 10_000
"""Calibrations have up to some hundred keys and values; what an alias stands for counts every time."""
DEEPEST_YAML: Final = 50
"""Levels of nesting; calibrations have up to 6."""
DEEPEST_INDENT: Final = 64
"""Columns; calibrations have up to 12."""
_OPENCV_DIRECTIVE: Final = re.compile(r"\A%YAML[: ]*[\d.]*[^\n]*")
_NOT_PRINTABLE: Final = re.compile(r"[^\n\t -~\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_NUMBERS_LINE: Final = re.compile(r"^(?=[ ]*[-+.]?\d[\w.+-]*[ ]*(?:[,\]]|$))", re.ASCII | re.MULTILINE)
"""The beginning of a line that goes on within a list of numbers."""
_PLAIN: Final = re.compile(r"(?!(?:y|n|yes|no|on|off|true|false|null)$)[a-z_/][\w./-]*", re.ASCII | re.IGNORECASE)
"""Texts that no reader of YAML takes for something else."""


def tree_of(text: str) -> object:
    """The content; every scalar is its text. Raises `ValueError` for what is no YAML or more of it than the limits.

    Tags (`!!opencv-matrix`) are ignored, so that 1e-5 is not a matter of dialect.
    """
    if len(text) > LARGEST_YAML_BYTES:
        raise ValueError(f"{len(text)} characters of YAML, more than {LARGEST_YAML_BYTES}")
    plain = _plain_yaml(text)
    if bad := _NOT_PRINTABLE.search(plain):
        raise ValueError(f"found the character U+{ord(bad[0]):04X}, line {plain.count(chr(10), 0, bad.start()) + 1}")
    return _core.yaml_tree(plain, most_values=MOST_YAML_VALUES, deepest=DEEPEST_YAML)


def _plain_yaml(text: str) -> str:
    """Without what other tools take for YAML: `%YAML:1.0`, tabs, and numbers of a list further left than its key."""
    text = _OPENCV_DIRECTIVE.sub("#", text.replace("\t", "    "))
    return _NUMBERS_LINE.sub(" " * DEEPEST_INDENT, text)


def yaml_of(table: Mapping[str, object], indent: str = "") -> str:
    """The YAML of texts, numbers, lists and tables of them: tables and matrices line by line, lists in brackets."""
    lines = []
    for key, value in table.items():
        if isinstance(value, Mapping):
            lines.append(f"{indent}{_scalar(key)}:\n{yaml_of(value, indent + '  ')}")
        elif isinstance(value, list) and value and isinstance(value[0], list):
            rows = "".join(f"{indent}- {_scalar(row)}\n" for row in value)
            lines.append(f"{indent}{_scalar(key)}:\n{rows}")
        else:
            lines.append(f"{indent}{_scalar(key)}: {_scalar(value)}\n")
    return "".join(lines)


def _scalar(value: object) -> str:
    """A text, a number, or a list of them."""
    if isinstance(value, list):
        return f"[{', '.join(map(_scalar, value))}]"
    if isinstance(value, float):
        # 1e-05 is a text in YAML 1.1.
        return re.sub(r"^(-?\d+)e", r"\1.0e", repr(value))
    if isinstance(value, int):
        return str(value)
    text = str(value)
    if _PLAIN.fullmatch(text):
        return text
    return '"' + "".join(c if " " <= c <= "~" and c not in '"\\' else f"\\U{ord(c):08x}" for c in text) + '"'
