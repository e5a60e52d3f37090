"""OCamCalib's text file (`calib_results.txt`), and the comment-free parameter list of omni_cam.

The text file is the counted polynomial (lowest power first), the counted inverse polynomial, the centre as row and
column from 0, c, d, e, and height, width, over any number of lines, with `#` comments. Its conventions are those of
`CameraSpec`'s `ocam`, so the numbers are taken as they are (cam2world: row = c x + d y + row_c, column = e x + y +
column_c, ray (x, y, f(rho))).

omni_cam reads, without any count: width, height, five coefficients, the centre as column and row, c, d, e, twelve
inverse coefficients. It applies [[1, e], [d, c]] to (column, row) and negates the polynomial for z, which is the same
camera with the centre written the other way round.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Final

from tiltvp import _core
from tiltvp.errors import UnsupportedFormatError
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize
from tiltvp.formats.writing import only_one, refuse, refuse_mirror, value

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)", re.ASCII | re.IGNORECASE)
_OMNI_CAM_WORDS = 2 + 5 + 2 + 3 + 12
INVERSE_ERROR_PX: Final = 0.01
"""Largest error of an inverse polynomial that is made: that of OCamCalib's own `findinvpoly`."""
_MOST_INVERSE: Final = 33
"""Coefficients of an inverse polynomial: the most of calibrations in use (docs/cameras.md)."""
_SAMPLES: Final = 500
"""Radii that it is fitted to: a pixel or two apart."""


def recognise(document: Document) -> bool:
    """The first line with content, and nothing but it is asked, is numbers only, two of them or a lone count."""
    lines = document.content_lines
    return bool(lines) and all(_NUMBER.fullmatch(word) for word in lines[0][1])


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The one camera of the file."""
    words = _Words(document)
    is_omni_cam = "#" not in document.text and len(words.words) == _OMNI_CAM_WORDS and words.starts_with_image_size()
    return [_omni_cam(words, image_size) if is_omni_cam else _ocamcalib(words, image_size)]


def _ocamcalib(words: _Words, given: ImageSize | None) -> CameraSpec:
    polynomial = words.counted("direct polynomial")
    inverse = words.counted("inverse polynomial")
    row, column = words.take(2, "centre as row and column")
    c, d, e = words.take(3, "affine parameters c, d, e")
    height, width = words.node("height"), words.node("width")
    words.end()
    return _spec(words, given, width, height, polynomial, inverse, column, row, (c, d, e))


def _omni_cam(words: _Words, given: ImageSize | None) -> CameraSpec:
    width, height = words.node("width"), words.node("height")
    polynomial = words.take(5, "direct polynomial")
    column, row = words.take(2, "centre as column and row")
    c, d, e = words.take(3, "affine parameters c, d, e")
    inverse = words.take(12, "inverse polynomial")
    return _spec(words, given, width, height, polynomial, inverse, column, row, (c, d, e))


def _spec(
    words: _Words,
    given: ImageSize | None,
    width: Node,
    height: Node,
    polynomial: list[float],
    inverse: list[float],
    column: float,
    row: float,
    affine: tuple[float, float, float],
) -> CameraSpec:
    size = Node(words.document, None).image_size(given, width, height, "OCamCalib")
    c, d, e = affine
    return Node(words.document, None).spec(
        "ocam",
        size,
        {
            "polynomial": polynomial,
            "inverse_polynomial": inverse,
            "c": c,
            "d": d,
            "e": e,
            "cx": column,
            "cy": row,
        },
        "cam0",
    )


class _Words:
    """The words of the file in order, each knowing its line."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.words = [(number, word) for number, line in document.content_lines for word in line]
        self._next = 0

    def node(self, what: str) -> Node:
        """The next word."""
        if self._next >= len(self.words):
            last = self.words[-1][0] if self.words else 1
            self.document.fail("the file ends early", f"the {what}", f"line {last}")
        line, word = self.words[self._next]
        self._next += 1
        return Node(self.document, word, f"line {line} ({what})")

    def take(self, count: int, what: str) -> list[float]:
        """The next `count` numbers."""
        return [self.node(what).number() for _ in range(count)]

    def counted(self, what: str) -> list[float]:
        """A count and that many numbers."""
        node = self.node(f"number of coefficients of the {what}")
        count = node.integer()
        if not 1 <= count <= _core.MOST_COEFFICIENTS:
            node.fail(f"found {count} coefficients", f"1 to {_core.MOST_COEFFICIENTS}")
        return self.take(count, what)

    def end(self) -> None:
        """Nothing may follow."""
        if self._next < len(self.words):
            line, word = self.words[self._next]
            self.document.fail(f"found {word[:40]!r} after the image size", "the end of the file", f"line {line}")

    def starts_with_image_size(self) -> bool:
        """Whether the first two words are whole numbers too large to be a count of what follows."""
        return all(re.fullmatch(r"\d+", word, re.ASCII) and int(word[:9]) > 24 for _, word in self.words[:2])


def written(specs: Sequence[CameraSpec]) -> str:
    """The text of `calib_results.txt`. A camera without an inverse polynomial is given one that is fitted.

    Raises `UnsupportedFormatError`, also for several cameras, and where no inverse polynomial is near enough.
    """
    spec = only_one(specs, "OCamCalib")
    refuse_mirror(spec, "OCamCalib")
    polynomial, inverse = spec.parameters.get("polynomial"), spec.parameters.get("inverse_polynomial")
    if spec.model != "ocam" or not isinstance(polynomial, list):
        refuse(spec, "OCamCalib", "ocam")
    if not isinstance(inverse, list) or not inverse:
        inverse = _fitted_inverse(spec, polynomial)
    row_and_column = [value(spec, "cy"), value(spec, "cx")]
    affine = [value(spec, "c", 1.0), value(spec, "d"), value(spec, "e")]
    parts: dict[str, Sequence[float]] = {
        "polynomial coefficients for the DIRECT mapping function": [len(polynomial), *polynomial],
        "polynomial coefficients for the inverse mapping function": [len(inverse), *inverse],
        'center: "row" and "column", starting from 0 (C convention)': row_and_column,
        'affine parameters "c", "d", "e"': affine,
        'image size: "height" and "width"': [spec.height, spec.width],
    }
    return "\n".join(f"#{what}\n\n{' '.join(map(repr, numbers))}\n" for what, numbers in parts.items())


def _fitted_inverse(spec: CameraSpec, polynomial: list[float]) -> list[float]:
    """rho = sum b_k t^k of t = atan2(f(rho), rho), as OCamCalib fits it: of the least degree that is near enough, from
    the centre to the farthest corner or to where the angle stops growing.
    """
    import numpy as np

    across = max(value(spec, "cx"), spec.width - 1 - value(spec, "cx"))
    down = max(value(spec, "cy"), spec.height - 1 - value(spec, "cy"))
    rho = np.linspace(0.0, math.hypot(across, down), _SAMPLES)
    angle = np.arctan2(np.polynomial.polynomial.polyval(rho, polynomial), rho)
    growing = np.diff(angle) * (-1.0 if polynomial[0] > 0.0 else 1.0) > 0.0
    last = _SAMPLES if growing.all() else int(np.argmin(growing)) + 1
    rho, angle = rho[:last], angle[:last]
    for degree in range(1, _MOST_INVERSE):
        # With `full` it says nothing of a fit that is poorly conditioned: how good it is, is seen below.
        fit, _ = np.polynomial.Polynomial.fit(angle, rho, degree, full=True)
        inverse = [float(number) for number in fit.convert().coef]
        if np.abs(np.polynomial.polynomial.polyval(angle, inverse) - rho).max() <= INVERSE_ERROR_PX:
            return inverse
    raise UnsupportedFormatError(
        f"{spec.name}: no inverse polynomial of {_MOST_INVERSE} coefficients is within {INVERSE_ERROR_PX} px, "
        "and files of OCamCalib need one"
    )
