"""Arguments that many functions take, checked alike: paths, sizes of images, numbers and pairs of them."""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = [
    "THREADS_MAX",
    "array_from",
    "each_from",
    "flag_from",
    "number_from",
    "pair_from",
    "path_from",
    "refuse_single",
    "refuse_uncallable",
    "refuse_unless",
    "shaped_from",
    "size_from",
    "texts_from",
    "two_from",
]

THREADS_MAX: Final = 1024
"""At the same time: more than machines have cores, and fewer than a system refuses."""


def array_from(values: ArrayLike, name: str) -> NDArray[np.float64]:
    """A fresh array of real numbers, of any shape, which may be NaN. Raises `InvalidInputError`.

    Texts, bools, complex numbers and dates are none, nor are arrays with masked values.
    """
    with suppress(TypeError, ValueError, OverflowError):
        array = np.asarray(values)
        if array.dtype.kind in "iufO" and not np.ma.is_masked(values):
            return np.array(array, dtype=np.float64)
    raise InvalidInputError(f"{name}: no array of numbers, expected one")


def shaped_from(values: Any, name: str, *shape: int | None) -> NDArray[np.float64]:
    """`array_from` of that shape, in which None is any length. Raises `InvalidInputError`."""
    array = array_from(values, name)
    if array.ndim != len(shape) or any(want not in (None, has) for want, has in zip(shape, array.shape, strict=True)):
        expected = str(tuple("N" if want is None else want for want in shape)).replace("'", "")
        raise InvalidInputError(f"{name}: shape {array.shape}, expected {expected}")
    return array


def each_from(values: Any, name: str, has: str, kind: str, *, or_none: bool = False) -> list[Any]:
    """Several things of one kind, which an attribute tells. Raises `InvalidInputError` with the number of another."""
    refuse_single(values, name, f"several {kind}")
    found = list(values)
    for number, one in enumerate(found):
        if not (hasattr(one, has) or (or_none and one is None)):
            raise InvalidInputError(f"{name}[{number}]: {type(one).__name__}, expected a {kind}")
    return found


def path_from(path: str | os.PathLike[str]) -> Path:
    """A path; bytes are none, nor is an empty text, of which `Path` would make the working folder, nor one with half
    of a surrogate pair, which no file's name has.

    Raises `InvalidInputError`.
    """
    if isinstance(path, str | os.PathLike) and isinstance(name := os.fspath(path), str) and name:
        with suppress(UnicodeEncodeError):
            os.fsencode(name)
            return Path(name)
        raise InvalidInputError(f"path = {name!r}, expected letters that a file's name can have")
    raise InvalidInputError(f"path = {path!r}, expected a str or an os.PathLike that is not empty")


def size_from(size: tuple[int, int], name: str) -> tuple[int, int]:
    """(width, height) in pixels as whole numbers; `name` is the argument's. Raises `InvalidInputError`."""
    try:
        width, height = size
        whole = (int(width), int(height))
    except (TypeError, ValueError, OverflowError):
        whole = (0, 0)
    if min(whole) < 1 or whole != (width, height):
        raise InvalidInputError(f"{name} = {size!r}, expected (width, height) in pixels, whole numbers above 0")
    return whole


def number_from(value: float, name: str) -> float:
    """A real number, which may be NaN; texts, bools and complex numbers are none. Raises `InvalidInputError`."""
    with suppress(TypeError, ValueError, OverflowError):
        array = np.asarray(value)
        if array.ndim == 0 and array.dtype.kind in "iufO" and not np.ma.is_masked(value):
            return float(value)
    raise InvalidInputError(f"{name} = {value!r}, expected a number")


def flag_from(value: bool, name: str) -> bool:
    """True or False; no other values that are true or false. Raises `InvalidInputError`."""
    if not isinstance(value, bool | np.bool_):
        raise InvalidInputError(f"{name} = {value!r}, expected True or False")
    return bool(value)


def refuse_unless(value: object, kinds: type | UnionType, name: str, expected: str) -> None:
    """Raises `InvalidInputError` for what is of none of the kinds."""
    if not isinstance(value, kinds):
        raise InvalidInputError(f"{name}: {type(value).__name__}, expected {expected}")


def refuse_single(values: object, name: str, expected: str) -> None:
    """Raises `InvalidInputError` for what is not several things, nor an array without dimensions."""
    if getattr(values, "ndim", 1) == 0:
        raise InvalidInputError(f"{name}: an array without dimensions, expected {expected}")
    refuse_unless(values, Iterable, name, expected)


def refuse_uncallable(value: object, name: str, expected: str) -> None:
    """Raises `InvalidInputError` for what cannot be called, and for a class, which is called for one of its own."""
    if isinstance(value, type):
        raise InvalidInputError(f"{name}: the class {value.__name__}, expected {expected}")
    if not callable(value):
        raise InvalidInputError(f"{name}: {type(value).__name__}, expected {expected}")


def texts_from(values: Any, name: str) -> tuple[str, ...]:
    """Several texts; a single one is none. Raises `InvalidInputError`."""
    if not isinstance(values, str):
        with suppress(TypeError):
            found = tuple(values)
            if all(isinstance(one, str) for one in found):
                return found
    raise InvalidInputError(f"{name} = {values!r}, expected a tuple of texts")


def pair_from(pair: tuple[float, float], name: str) -> tuple[float, float]:
    """Two real numbers. Raises `InvalidInputError`."""
    first, second = two_from(pair, name, "two numbers")
    return number_from(first, name), number_from(second, name)


def two_from(pair: Any, name: str, expected: str) -> tuple[Any, Any]:
    """Two things of any kind. Raises `InvalidInputError`."""
    try:
        first, second = pair
    except (TypeError, ValueError):
        raise InvalidInputError(f"{name} = {pair!r}, expected {expected}") from None
    return first, second
