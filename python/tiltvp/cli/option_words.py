"""What the library says of its options, by the names and in the degrees that are typed."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection
from contextvars import ContextVar
from typing import Final

_NUMBER: Final = r"(?<![\w.-])-?(?:pi(?:/\d+)?|\d[\d.]*(?:e[+-]?\d+)?)\b"
_OF_PYTHON: Final = {
    ", or None": "",
    "None, ": "none, ",
    ", an AffineCorrection or a PosteriorCorrection": " or a file of `tiltvp lab train` (.toml)",
}
"""What is accepted in Python, and on the command line."""


OPTIONS: Final[ContextVar[Callable[[], Collection[str]]]] = ContextVar("options", default=tuple)
"""The names of the options that the command of a line takes."""
_OTHERWISE: Final = {
    "blur_sigma_px": "--blur-sigma",
    "bumps_max_rad": "--bumps-deg",
    "distance_m": "--distance",
    "factor": "--resolution-scale",
    "gamma_rad": "--gamma-deg",
}
"""Options of commands that the library has under other names."""


def of_option(problem: str) -> str:
    """What is wrong with an option or argument of the library as it is typed; else as it is."""
    head = r"(?:option (?:view\.|stereo\.)?|(?=field_of_view_rad\b)|(?=(\w+)(?:: got | = )))"
    found = re.match(head + r"(\w+)(?:, (\w+))?(?: = (\[[^]]*\]|[^ ,]+),)?(?=[ :])", problem)
    if found is None:
        return problem
    from tiltvp.cli.declared_options import KEYWORDS, flag_of, is_angle

    taken = OPTIONS.get()()

    def called(keyword: str) -> str:
        flag, other = flag_of(keyword), _OTHERWISE.get(keyword, "")
        return other if flag not in taken and other in taken else flag

    known = KEYWORDS if f"{found[1]}: got " in problem else ()
    if found[1] is not None and found[1] not in known and called(found[1]) not in taken:
        return problem
    (_, keyword, second, value), rest = found.groups(), problem[found.end() :]
    told = "" if value is None else f" = {value},"
    for python, typed_word in _OF_PYTHON.items():
        rest = rest.replace(python, typed_word)
    if value is not None and is_angle(keyword):
        digits = ".6g" if second is None else ".3g"
        angles = [f"{math.degrees(float(one)):{digits}}" for one in value.strip("[]").split(",")]
        told, rest = f" = {', '.join(angles)} degrees,", _in_degrees(rest)
    # Words in quotes are values, and such as "mask" are words of sentences too, but for those of a list of names.
    before, listed, names = rest.partition(", expected one of ")
    if before.startswith(": unknown"):
        names = ", ".join(map(flag_of, names.split(", ")))
    flags = ", ".join(map(called, filter(None, (keyword, second))))
    return f"{flags}{told}{typed(before + listed + names)}"


def typed(reason: str) -> str:
    """A sentence of the library with its options, and what it tells to set them to, as they are typed."""
    from tiltvp.cli.declared_options import KEYWORDS, flag_of, is_angle

    def shown(found: re.Match[str]) -> str:
        keyword, value = found.groups()
        if keyword not in KEYWORDS:
            return found[0]
        if value is not None and is_angle(keyword):
            value = f"{math.degrees(float(value)):.3g}"
        return flag_of(keyword) if value is None else f"{flag_of(keyword)} {value}"

    return re.sub(r'"[^"]*"|\b([a-z]+(?:_[a-z]+)+)\b(?:=True| = (\d[\d.]*(?:e[+-]?\d+)?))?', shown, reason)


def _in_degrees(expected: str) -> str:
    """What is expected of an angle, in degrees where the library says radians."""
    told = re.sub(r" (?:in )?rad(?:ians?)?\b", "", expected)
    numbers = list(re.finditer(_NUMBER, told))
    for found in reversed(numbers):
        after = found.end() + (told[found.end() :][:1] in (")", "]"))
        unit = " degrees" if found is numbers[-1] else ""
        told = f"{told[: found.start()]}{_degrees(found[0])}{told[found.end() : after]}{unit}{told[after:]}"
    return told


def _degrees(number: str) -> str:
    """Of `0.5`, `-pi/2` or `1e-4` radians."""
    top, _, bottom = number.replace("pi", str(math.pi)).partition("/")
    return f"{math.degrees(float(top) / float(bottom or 1)):.4g}"
