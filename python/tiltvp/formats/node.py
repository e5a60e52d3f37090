"""A value in a document together with where it stands, so that every complaint can name the key."""

from __future__ import annotations

import difflib
import itertools
import math
import re
from collections.abc import Iterable
from typing import Final, NoReturn

from tiltvp import _core
from tiltvp.errors import CalibrationError, TiltvpError, UnsupportedFormatError
from tiltvp.formats.document import Document
from tiltvp.formats.spec import CameraSpec, ImageSize, Parameters

_NUMBER: Final = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_DEEPEST: Final = 4
MOST_NUMBERS: Final = 10_000
"""Of a list or a matrix; the largest that a camera has are 20."""
_SHARES: Final = 4.0
"""Below this focal lengths and centre are shares of the image's sides, as some tools have them: of a lens that sees 40
degrees the focal length is 1.4 of a side."""
LONGEST_NUMBER: Final = 400
"""Characters of a number: the longest decimals of a double have 327."""


class Node:
    """One value of a `Document`; `at` is its dotted key."""

    def __init__(self, document: Document, value: object, at: str = "") -> None:
        self.document = document
        self.value = value
        self.at = at

    @staticmethod
    def root(document: Document) -> Node:
        """The top of the document, which has to be YAML, JSON or XML with a mapping there."""
        if not document.tree:
            document.fail(f"no keys to read ({document.syntax_problem or 'it is empty'})", "named values", "the top")
        return Node(document, document.tree)

    @property
    def place(self) -> str:
        """Where this is, for a message."""
        return self.at or "the top"

    def fail(self, problem: str, expected: str) -> NoReturn:
        """Raises a `CalibrationError` at this place."""
        self.document.fail(problem, expected, self.place)

    def refuse(self, problem: str, expected: str) -> NoReturn:
        """Raises an `UnsupportedFormatError` at this place."""
        self.document.fail(problem, expected, self.place, UnsupportedFormatError)

    @property
    def tree(self) -> dict[str, object]:
        """The value as a mapping."""
        if not isinstance(self.value, dict):
            self.fail(f"found {_shown(self.value)}", "a group of named values")
        return self.value

    def has(self, *keys: str) -> bool:
        """Whether this is a mapping that has all of `keys`."""
        return isinstance(self.value, dict) and all(key in self.value for key in keys)

    def get(self, *keys: str) -> Node | None:
        """The value at the first of `keys` that is there; two of them with different values are an error."""
        found = [key for key in keys if key in self.tree]
        if not found:
            return None
        if any(self.tree[key] != self.tree[found[0]] for key in found[1:]):
            self.fail(f"{' and '.join(found)} say different things", f"one of {', '.join(keys)}")
        return self._child(found[0])

    def need(self, *keys: str) -> Node:
        """As `get`, but nothing there is an error that names a near key."""
        node = self.get(*keys)
        if node is None:
            near = difflib.get_close_matches(keys[0], [str(key) for key in self.tree], 1)
            hint = f" (there is {near[0]!r})" if near else ""
            self.fail(f"{keys[0]} is missing{hint}", " or ".join(keys))
        return node

    def only(self, *keys: str) -> None:
        """Any other key than `keys` here is an error that names the near ones."""
        for key in self.tree:
            if key not in keys:
                near = difflib.get_close_matches(str(key), keys, 3, cutoff=0.5) or keys
                self.fail(f"unknown key {key!r}", "one of " + ", ".join(near))

    def items(self) -> list[Node]:
        """The elements of a list."""
        if not isinstance(self.value, list):
            self.fail(f"found {_shown(self.value)}", "a list")
        return [Node(self.document, item, f"{self.at}[{index}]") for index, item in enumerate(self.value)]

    def text(self) -> str:
        """The value as a word."""
        if not isinstance(self.value, str):
            self.fail(f"found {_shown(self.value)}", "a word")
        return self.value.strip().strip("\"'")

    def number(self) -> float:
        """The value as one finite number."""
        return self._number(self.value)

    def integer(self) -> int:
        """The value as a whole number; 1280.0 counts."""
        number = self.number()
        if number != math.floor(number) or abs(number) > 1e9:
            self.fail(f"found {_shown(self.value)}", "a whole number")
        return int(number)

    def flag(self) -> bool:
        """The value as yes or no."""
        if isinstance(self.value, bool):
            return self.value
        word = str(self.value).strip().lower()
        if word not in ("0", "1", "true", "false", "yes", "no", "on", "off"):
            self.fail(f"found {_shown(self.value)}", "true or false")
        return word in ("1", "true", "yes", "on")

    def numbers(self, *counts: int) -> list[float]:
        """All the numbers of a list, of nested rows, or of an OpenCV matrix (`rows`, `cols`, `data`), row by row."""
        value, shape = self.value, None
        if isinstance(value, dict):
            shape = (self.need("rows").integer(), self.need("cols").integer())
            value = self.need("data").value
        items = list(itertools.islice(self._flat(value, _DEEPEST), MOST_NUMBERS + 1))
        if len(items) > MOST_NUMBERS:
            self.fail(f"more than {MOST_NUMBERS} numbers", "the numbers of one camera")
        numbers = [self._number(item) for item in items]
        if shape is not None and shape[0] * shape[1] != len(numbers):
            self.fail(f"{len(numbers)} numbers", f"{shape[0]} rows of {shape[1]}")
        if counts and len(numbers) not in counts:
            self.fail(f"{len(numbers)} numbers", " or ".join(str(count) for count in counts))
        return numbers

    def named(self, *keys: str) -> Parameters:
        """The numbers at `keys`, each of which has to be there."""
        return {key: self.need(key).number() for key in keys}

    def _child(self, key: str) -> Node:
        return Node(self.document, self.tree[key], f"{self.at}.{key}" if self.at else key)

    def _flat(self, value: object, depth: int) -> Iterable[object]:
        if isinstance(value, str):
            yield from value.split()
        elif not isinstance(value, list):
            yield value
        elif depth == 0:
            self.fail("lists nested too deeply", "rows of numbers")
        else:
            for item in value:
                yield from self._flat(item, depth - 1)

    def _number(self, value: object) -> float:
        if isinstance(value, str):
            word = value.strip()
            if word.lower().lstrip("+-.") in ("nan", "inf", "infinity"):
                self.fail(f"found {word}", "a finite number")
            if len(word) > LONGEST_NUMBER or not _NUMBER.fullmatch(word):
                self.fail(f"found {_shown(value)}", "a number")
            number = float(word)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            try:
                number = float(value)
            except OverflowError:
                number = math.inf
        else:
            self.fail(f"found {_shown(value)}", "a number")
        if not math.isfinite(number):
            self.fail(f"found {number}", "a finite number")
        return number

    def image_size(self, given: ImageSize | None, width: Node | None, height: Node | None, what: str) -> ImageSize:
        """The image size the file states, or `given` if it states none; a contradiction of the two is an error."""
        if width is None or height is None:
            if width is not height:
                self.fail("only one side of the image is given", "its width and its height")
            if given is None:
                self.fail(f"{what} carries no image size", "image_size=(width, height) from the caller")
            return given
        stated = (width.integer(), height.integer())
        if given is not None and given != stated:
            self.fail(f"the image is {stated[0]}x{stated[1]}", f"the {given[0]}x{given[1]} of image_size=")
        return stated

    def spec(self, model: str, size: ImageSize, parameters: Parameters, name: str, *notes: str) -> CameraSpec:
        """The camera of these numbers, which the core has checked."""
        four = [parameters.get(key, math.inf) for key in ("fx", "fy", "cx", "cy")]
        if min(size) > _SHARES and all(isinstance(value, float) and abs(value) < _SHARES for value in four):
            self.fail(f"fx, fy, cx, cy = {four} of {size[0]} x {size[1]} pixels", "pixels, not shares of the image")
        return self.checked(CameraSpec(model, size[0], size[1], parameters, name=name, notes=notes))

    def checked(self, spec: CameraSpec) -> CameraSpec:
        """The same camera; what the core says against it is raised with the file and this place."""
        try:
            spec.check()
        except TiltvpError as error:
            kind = CalibrationError if spec.model in _core.CAMERA_MODELS else UnsupportedFormatError
            raise kind(f"{self.document.path}: {error}, at {self.place}") from None
        return spec


def _shown(value: object) -> str:
    if isinstance(value, dict):
        return "a group of named values"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "..."
