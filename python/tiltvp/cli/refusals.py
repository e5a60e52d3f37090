"""What is wrong with the words of a command line, where the parser's own sentences do not say what is expected."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

from cyclopts import App, CoercionError, CycloptsError, MissingArgumentError, UnusedCliTokensError
from cyclopts.argument import Argument

_EXPECTED: Final[dict[object, str]] = {int: "a whole number", float: "a number", bool: "true or false"}


def options_of(app: App, words: Sequence[str]) -> Sequence[Argument]:
    """What the verb of a line takes; nothing where no verb is meant, as by --help."""
    names, verbs, _ = app.parse_commands(words)
    # Help and version are commands of their own, and nobody asks for their options.
    if not verbs or verbs[-1].default_command is None or (names and names[-1].startswith("-")):
        return ()
    return verbs[-1].assemble_argument_collection()


def told(error: CycloptsError, app: App, words: Sequence[str]) -> str:
    """A sentence or two."""
    said = str(error)
    if isinstance(error, UnusedCliTokensError) and error.unused_tokens:
        return _left_over(error.unused_tokens, app, words)
    if isinstance(error, CoercionError) and error.token is not None and error.target_type in _EXPECTED:
        name = error.token.keyword or (error.argument.name.lstrip("-").upper() if error.argument else "an argument")
        return f'Invalid value "{error.token.value}" for {name}. Must be {_EXPECTED[error.target_type]}.'
    if isinstance(error, MissingArgumentError) and error.keyword is None:
        return said.replace(" requires an argument.", " is not given.")
    return said


def _left_over(unused: Sequence[str], app: App, words: Sequence[str]) -> str:
    """Of words that nothing takes: one after a switch is taken for its value by who types it."""
    # The last one: an option before it may have taken the same word.
    before = next((before for before, word in reversed([*pairwise(words)]) if word == unused[0]), "")
    for one in options_of(app, words) if before.startswith("--") else ():
        if before in one.names:
            return f'Invalid value "{unused[0]}" for {before}. Expected {" or ".join(one.names)} alone.'
    more = f" and {len(unused) - 1} more" if len(unused) > 1 else ""
    return f'"{unused[0]}"{more}: nothing takes it, expected no further argument.'
