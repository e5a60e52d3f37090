"""What a command leaves, and which there are, for the tests of the command line."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from cyclopts import App


class Said(NamedTuple):
    """The exit code of a command and what it wrote."""

    code: int
    out: str
    err: str

    @property
    def complaint(self) -> str:
        """What it wrote to stderr, which is one line."""
        assert self.err.startswith("tiltvp: "), self.err
        assert self.err.count("\n") == 1, self.err
        assert "Traceback" not in self.err
        return self.err


Run = Callable[..., Said]


def verbs(of: App, before: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """The words of every command."""
    names = [name for name in of if not name.startswith("-")]
    if not names:
        yield before
    for name in names:
        yield from verbs(of[name], (*before, name))
