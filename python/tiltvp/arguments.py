"""Arguments that many functions take, checked alike: sizes of images, numbers and pairs of them."""

from __future__ import annotations

from tiltvp.errors import InvalidInputError

__all__ = ["number_from", "pair_from", "size_from"]


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
    """A real number, which may be NaN; a text is none. Raises `InvalidInputError`."""
    try:
        if not isinstance(value, str | bytes):
            return float(value)
    except (TypeError, ValueError, OverflowError):
        pass
    raise InvalidInputError(f"{name} = {value!r}, expected a number")


def pair_from(pair: tuple[float, float], name: str) -> tuple[float, float]:
    """Two real numbers. Raises `InvalidInputError`."""
    try:
        first, second = pair
    except (TypeError, ValueError):
        raise InvalidInputError(f"{name} = {pair!r}, expected two numbers") from None
    return number_from(first, name), number_from(second, name)
