"""The `tiltvp` command: what a person types. The only place of the package that prints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tiltvp.cli.terminal import apart_from_decoders, complain, open_closed_streams

__all__ = ["main"]

_INTERRUPTED: Final = 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and gives the exit code.

    0 done, 1 some failed, an extra is missing or an output cannot be written, 2 wrong use, 130 interrupted.
    """
    try:
        open_closed_streams()
        # Within, for it takes most of the time until a command begins, and Ctrl-C may come before that.
        from tiltvp.cli.app import run_words

        with apart_from_decoders():
            return run_words(arguments)
    except KeyboardInterrupt:
        complain("interrupted")
        return _INTERRUPTED
