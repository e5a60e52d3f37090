"""What is wrong with a dataset, where, and what was expected."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from tiltvp.errors import InvalidInputError

__all__ = ["Finding", "Findings", "near"]


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong: the file, the line in it if there is one, what is there and what was expected.

    A "warning" is a dataset that can be read, but not used for everything.
    """

    file: str
    line: int | None
    what: str
    expected: str
    severity: Literal["error", "warning"] = "error"

    def __str__(self) -> str:
        """One line."""
        place = self.file if self.line is None else f"{self.file}, line {self.line}"
        return f"{place}: {self.what}, expected {self.expected}"


class Findings:
    """Collects what is wrong."""

    def __init__(self) -> None:
        """Nothing is, so far."""
        self.all: list[Finding] = []

    def add(self, file: str | os.PathLike[str], line: int | None, what: str, expected: str) -> None:
        """One more thing that makes the dataset unusable."""
        self.all.append(Finding(os.fspath(file), line, what, expected))

    def warn(self, file: str | os.PathLike[str], line: int | None, what: str, expected: str) -> None:
        """One more thing that does not."""
        self.all.append(Finding(os.fspath(file), line, what, expected, "warning"))

    def refuse(self) -> None:
        """Raises `InvalidInputError` for the first error, if there is one; it says how many more there are."""
        errors = [finding for finding in self.all if finding.severity == "error"]
        if errors:
            more = f" ({len(errors) - 1} more: `tiltvp dataset check` lists them)" if len(errors) > 1 else ""
            raise InvalidInputError(f"{errors[0]}{more}")


def near(word: str, words: Iterable[str]) -> str:
    """ " (did you mean ...?)" if one of the words is near, else nothing."""
    found = difflib.get_close_matches(word, list(words), 1)
    return f" (did you mean {found[0]}?)" if found else ""
