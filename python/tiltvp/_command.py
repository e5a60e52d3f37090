"""Ctrl-C while the package is imported for its own command, before there is code of the command that hears of it."""

import os
import sys
from types import TracebackType

_INTERRUPTED = 130


def _end(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    if issubclass(kind, KeyboardInterrupt):
        os.write(2, b"tiltvp: interrupted\n")
        os._exit(_INTERRUPTED)
    sys.__excepthook__(kind, error, trace)


def _is_run() -> bool:
    """Whether this process is `tiltvp` or `python -m tiltvp`, whose first word is -m until the package is there."""
    name = os.path.basename(sys.argv[0]) if getattr(sys, "argv", None) else ""
    is_module = ("-m", "tiltvp") in zip(sys.orig_argv, sys.orig_argv[1:], strict=False)
    return name.removesuffix(".exe") == "tiltvp" or (name == "-m" and is_module)


if _is_run():
    sys.excepthook = _end
