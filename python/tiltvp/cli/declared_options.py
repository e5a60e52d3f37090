"""Options of the command line made from those that the library declares: names, types, help and defaults.

Angles are degrees here: `elevation_min_rad` of the library is `--elevation-min-deg`. What is not given is left to the
library.
"""

import inspect
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeVar

from cyclopts import CoercionError, Parameter, Token

from tiltvp._core import option_fields
from tiltvp.images import read_mask

T = TypeVar("T")


def _whole_from(_: object, tokens: Sequence[Token]) -> int:
    """A whole number; of 1.5 cyclopts would make 2."""
    try:
        return int(tokens[0].value)
    except ValueError:
        raise CoercionError(token=tokens[0], target_type=int) from None


Whole = Annotated[int, Parameter(converter=_whole_from)]

_TYPES: dict[str, Any] = {
    "bool": bool, "int": Whole, "float": float, "str": str,
    "tuple[float, float]": tuple[float, float],
    "tuple[float, float, float]": tuple[float, float, float],
    "npt.NDArray[np.bool_]": Path,
}  # fmt: skip

KEYWORDS = {"robot_from_camera"}
"""The keywords of the library that are options here."""
_OTHER_FLAGS = {"gamma_rad": "--gamma"}
"""Names of options that are not made of their keywords."""


class LibraryOptions:
    """What was given of the options that `from_library` adds to a class."""

    _keywords: ClassVar[Mapping[str, str]] = {}

    def given(self) -> dict[str, Any]:
        """The keywords of the library."""
        options: dict[str, Any] = {}
        for name, keyword in self._keywords.items():
            value = getattr(self, name)
            if value is not None:
                options[keyword] = _to_library(keyword, value)
        return options


def from_library(
    owners: Mapping[str, Sequence[str]], *, words: Mapping[str, str] | None = None, but: Sequence[str] = ()
) -> Callable[[type[T]], type[T]]:
    """Adds the options of owners and their methods, but for some, as fields to a class that is made a dataclass above.

    An option that the class already has is left as it is there; `words` are further words for some options.
    """

    def make(cls: type[T]) -> type[T]:
        keywords: dict[str, str] = dict(getattr(cls, "_keywords", {}))
        own = {name for base in cls.__mro__ for name in inspect.get_annotations(base)}
        for owner, methods in owners.items():
            for keyword, (field, helps) in _fields(owner, methods or (None,)).items():
                name = _name(keyword)
                if keyword in but or name in keywords:
                    continue
                keywords[name] = keyword
                if name not in own:
                    further = (words or {}).get(keyword)
                    cls.__annotations__[name] = _annotation(name, field, helps, further, several=len(methods) > 1)
                    setattr(cls, name, None)
        KEYWORDS.update(keywords.values())
        cls._keywords = keywords  # type: ignore[attr-defined]
        return cls

    return make


def _fields(owner: str, methods: Sequence[str | None]) -> dict[str, tuple[dict[str, Any], dict[str | None, str]]]:
    """Each option by its keyword: how it is declared first, and its default for each method that has it."""
    found: dict[str, tuple[dict[str, Any], dict[str | None, str]]] = {}
    for method in methods:
        for field in option_fields(owner, method):
            _, defaults = found.setdefault(field["name"], (field, {}))
            defaults[method] = _shown(field)
    return found


def _annotation(
    name: str, field: Mapping[str, Any], defaults: Mapping[str | None, str], further: str | None, *, several: bool
) -> Any:
    plain = field["type"].removesuffix(" | None")
    kind = _TYPES.get(plain, str)
    flag = flag_of(name)
    names = [flag] if further is None else [further, flag]
    off = "" if plain == "bool" and field["default"] is False else None
    shown = Parameter(name=names, help=_help(field, defaults, several=several), negative=off, show_default=False)
    return Annotated[kind | None, shown]


def _help(field: Mapping[str, Any], defaults: Mapping[str | None, str], *, several: bool) -> str:
    doc = (
        " ".join(field["doc"].replace("`", "").split())
        .replace("in radians", "in degrees")
        .replace("radians", "degrees")
    )
    expected = field["expected"].replace('"', "")
    if field["type"].startswith(("Literal", "str")) and not all(
        word in doc for word in re.findall(r"[\w-]+", expected)
    ):
        doc = f"{doc} Expected {expected}."
    if len(set(defaults.values())) == 1:
        only = "" if not several or len(defaults) > 1 else f"{next(iter(defaults))}: "
        return f"{only}{doc} Default {next(iter(defaults.values()))}."
    each = ", ".join(f"{default} for {method}" for method, default in defaults.items())
    return f"{doc} Default {each}."


def _shown(field: Mapping[str, Any]) -> str:
    value, name = field["default"], field["name"]
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{math.degrees(value) if is_angle(name) else value:.4g}"
    if isinstance(value, str | int):
        return str(value)
    return " ".join(f"{x:.4g}" for x in value) if isinstance(value, tuple) else "as said"


def flag_of(keyword: str) -> str:
    """The name of an option of the library, or of its field here, on the command line."""
    return _OTHER_FLAGS.get(keyword) or f"--{_name(keyword).replace('_', '-')}"


def is_angle(keyword: str) -> bool:
    """Whether an option of the library is in radians."""
    return "rad" in keyword.split("_")


def _name(keyword: str) -> str:
    return "_".join("deg" if part == "rad" else part for part in keyword.split("_"))


def _to_library(keyword: str, value: Any) -> Any:
    if keyword == "mask":
        return read_mask(value)
    if keyword == "correction":
        return _correction_from(value)
    return math.radians(value) if is_angle(keyword) and isinstance(value, float) else value


def _correction_from(word: str) -> str | float | None:
    if word == "none":
        return None
    try:
        return float(word)
    except ValueError:
        return word
