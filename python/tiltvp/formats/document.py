"""A calibration file as text or bytes, and as the tree of its YAML, JSON or XML; every syntax error is one of ours."""

from __future__ import annotations

import json
import os
import re
import tomllib
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final, NoReturn

from tiltvp.errors import CalibrationError, CalibrationNotFoundError
from tiltvp.files import read_bytes
from tiltvp.formats.yaml_text import tree_of
from tiltvp.image_headers import is_image_file

Tree = dict[str, object]

LARGEST_BYTES: Final = 1 << 20
"""Of a calibration file. Calibrations have up to 100 kB, COLMAP's of 10,000 cameras 800 kB; JSON and XML take up to 100
bytes of memory a byte."""
LARGEST_TOML_BYTES: Final = 200_000
"""The standard library reads some 200 kB a second of the worst text."""
DEEPEST_KEY: Final = 16
"""Parts of a dotted key, whose number the standard library takes squared; ours have 2."""
_COUNT_BYTES: Final = 4
"""Of the eight that count things in a binary file, those that are used by any number that could be meant. No text has
four zero bytes."""
_PART: Final = re.compile(r"[ \t]*[^\s,=\[\]{}#]+[ \t]*")


@dataclass(frozen=True)
class Document:
    """The text of one calibration file; `tree` is its content if it is YAML, JSON or XML, and empty otherwise."""

    path: Path
    text: str
    binary: bytes = b""
    """The bytes of a file that begins with a count in eight of them, as COLMAP's; `text` is then empty."""

    @staticmethod
    def of(source: str) -> Document:
        """A document without a text: something else than a file, which has this name where something is wrong."""
        return Document(Path(source), "")

    @staticmethod
    def load(path: str | os.PathLike[str], expected: str = "a calibration file") -> Document:
        """Reads the file; a missing, unreadable, empty, oversized or binary one is a `CalibrationError`."""
        try:
            file = Path(path)
            raw = read_bytes(file, LARGEST_BYTES)
            if len(raw) >= 8 and not any(raw[_COUNT_BYTES:8]):
                return Document(file, "", raw)
            text = raw.decode("utf-8-sig")
        except FileNotFoundError:
            raise CalibrationNotFoundError(f"{path}: no such file, expected {expected}, at this path") from None
        except IsADirectoryError:
            raise CalibrationError(f"{path}: is a folder, expected {expected}, at this path") from None
        except (OSError, ValueError, TypeError) as error:
            why = (error.strerror if isinstance(error, OSError) else None) or error
            problem = f"cannot be read ({why})"
            if not isinstance(error, TypeError) and is_image_file(path):
                problem = "is an image"
            elif isinstance(error, UnicodeDecodeError):
                raise CalibrationError(f"{path}: is not text, expected UTF-8, at byte {error.start}") from None
            raise CalibrationError(f"{path!s}: {problem}, expected {expected}, at this path") from None
        if not text.strip():
            raise CalibrationError(f"{path}: is empty, expected {expected}, at line 1")
        return Document(file, text.replace("\r\n", "\n").replace("\r", "\n"))

    def fail(self, problem: str, expected: str, at: str, error: type[CalibrationError] = CalibrationError) -> NoReturn:
        """Raises `error` in the one form all the messages of the readers have."""
        raise error(f"{self.path}: {problem}, expected {expected}, at {at}")

    @property
    def tree(self) -> Tree:
        """The mapping at the top of the file; empty if the file is not YAML, JSON or XML, or has no mapping there."""
        return self._parsed[0]

    @property
    def syntax_problem(self) -> str:
        """Why `tree` is empty; an empty string if it is not."""
        return self._parsed[1]

    @property
    def is_xml(self) -> bool:
        """Whether the text begins as XML does."""
        return self.text.lstrip().startswith("<")

    @property
    def xml(self) -> ElementTree.Element | None:
        """The element at the top of XML; None where `syntax_problem` says why."""
        return _xml_root(self.text) if self.is_xml and self.tree else None

    def toml(self, expected: str) -> Tree:
        """The content as TOML; what is none is refused."""
        problem = None
        if len(self.text) > LARGEST_TOML_BYTES:
            problem = f"{len(self.text)} characters, more than {LARGEST_TOML_BYTES}"
        elif _has_deep_key(self.text):
            problem = f"a key of more than {DEEPEST_KEY} parts"
        if problem is None:
            try:
                return tomllib.loads(self.text)
            except RecursionError:
                problem = "nested too deeply"
            except ValueError as error:
                problem = str(error)
        self.fail(f"is not TOML that is read ({problem})", expected, "the place named")

    @cached_property
    def content_lines(self) -> list[tuple[int, list[str]]]:
        """(line number, words) of the lines that hold something besides a `#` comment."""
        lines = ((number, line.split("#", 1)[0].split()) for number, line in enumerate(self.text.split("\n"), 1))
        return [(number, words) for number, words in lines if words]

    @cached_property
    def _parsed(self) -> tuple[Tree, str]:
        try:
            start = self.text.lstrip()[:1]
            if start == "<":
                root = _xml_root(self.text)
                tree: object = {root.tag: _from_element(root)}
            elif start in "{[":
                tree = json.loads(self.text, object_pairs_hook=_from_pairs)
            else:
                tree = tree_of(self.text)
        except RecursionError:
            return {}, "nested too deeply"
        except (ElementTree.ParseError, ValueError, LookupError) as error:
            return {}, " ".join(str(error).split()) or type(error).__name__
        if not isinstance(tree, dict):
            return {}, f"a {type(tree).__name__} at the top"
        return {str(key): value for key, value in tree.items()}, ""


def _has_deep_key(text: str) -> bool:
    """Whether so many words follow each other with dots between; a sentence has spaces within its parts."""
    parts = 0
    for part in text.split("."):
        parts = parts + 1 if _PART.fullmatch(part) else 1
        if parts > DEEPEST_KEY:
            return True
    return False


def _from_pairs(pairs: list[tuple[str, object]]) -> Tree:
    tree: Tree = {}
    for key, value in pairs:
        if key in tree and tree[key] != value:
            raise ValueError(f"found the key {key!r} twice with different values")
        tree[key] = value
    return tree


def _xml_root(text: str) -> ElementTree.Element:
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("found a document type declaration")
    return ElementTree.fromstring(text)


def _from_element(element: ElementTree.Element) -> object:
    """A leaf is its text, `_` children are a list (OpenCV), and so are children that repeat a name."""
    children = list(element)
    if not children:
        return (element.text or "").strip()
    if all(child.tag == "_" for child in children):
        return [_from_element(child) for child in children]
    tree: Tree = {}
    for child in children:
        value = _from_element(child)
        earlier = tree.get(child.tag)
        if child.tag not in tree:
            tree[child.tag] = value
        elif isinstance(earlier, _Repeated):
            earlier.append(value)
        else:
            tree[child.tag] = _Repeated([earlier, value])
    return tree


class _Repeated(list[object]):
    """The values of XML siblings of one name, in file order."""
