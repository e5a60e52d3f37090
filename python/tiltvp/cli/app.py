"""The commands put together, and the one door out: what goes wrong is one line on stderr and an exit code."""

from __future__ import annotations

import glob
import os
import re
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from typing import Final

from cyclopts import CycloptsError

from tiltvp.cli.option_words import OPTIONS
from tiltvp.cli.refusals import options_of, told
from tiltvp.cli.root import app, run
from tiltvp.cli.showing import RERUN
from tiltvp.cli.sources import STDIN
from tiltvp.cli.terminal import complain, print_any_name
from tiltvp.errors import InvalidInputError, MissingExtraError, OutputError, TiltvpError
from tiltvp.files import keeping_existing

__all__ = ["app", "run_words"]

_OVERWRITE = "--overwrite"
"""Anywhere in the line: every command that writes keeps what exists without it."""
SOME_FAILED, WRONG_USE = 1, 2

_VERBS: Final = {
    "setup": "setup:setup",
    "tilt": "tilt:tilt",
    "mount": "mount:mount",
    "level": "level:level",
    "segments": "segments:segments",
    "lines": "lines:lines",
    "track": "track:track",
    "corner": "corner:corner",
    "calibrate": "calibrate:calibrate",
    "colmap": "colmap:colmap",
    "demo": "demo:demo",
    "camera": "camera_making:app",
    "dataset": "lab.dataset:app",
    "lab": "lab.train:app",
    "evaluate": "lab.evaluate:evaluate",
    "measure": "lab.measure:app",
    "report": "lab.report:report",
}
"""What each command is in `tiltvp.cli`. Only the one that is run is imported."""
for _name, _place in _VERBS.items():
    app.command(f"tiltvp.cli.{_place}", name=_name)


def run_words(arguments: Sequence[str] | None) -> int:
    """Runs the words of a command line, by default those of the process, and gives the exit code."""
    print_any_name()
    words = list(sys.argv[1:] if arguments is None else arguments)
    overwrite = _OVERWRITE in words
    words = [word for word in words if word != _OVERWRITE]
    if words[:1] in ([], ["--help"], ["-h"]):
        for name in _VERBS:
            app[name]  # Imports it, for the list of commands has the first sentence of each.
    for place in [place for place, word in enumerate(words) if word == RERUN]:
        following = "".join(words[place + 1 : place + 2])
        if following.startswith("-") or (_is_there(following) and not following.lower().endswith(".rrd")):
            from tiltvp.streams.outputs.viewer import VIEWER

            # Without a file it is the viewer that is meant; an option takes a word, or none, not both.
            words[place] = f"{RERUN}={VIEWER}"
    for place in [place for place, word in enumerate(words) if word == "-"]:
        if place and not _takes_a_word(words[place - 1], words):
            # A word that begins so is taken for an option, which its name would be looked for among.
            words[place] = STDIN
    OPTIONS.set(lambda: {name for one in options_of(app, words) for name in one.names})
    try:
        _refuse_empty(words)
        _refuse_wordless(words)
        with nullcontext() if overwrite else keeping_existing():
            code = run(words)
        sys.stdout.flush()
        return code
    except CycloptsError as error:
        complain(f"{told(error, app, words)} Try `{' '.join(('tiltvp', *(error.command_chain or ()), '--help'))}`.")
        return WRONG_USE
    except (MissingExtraError, OutputError) as error:
        complain(str(error))
        return SOME_FAILED
    except ImportError as error:
        if (error.name or "").startswith("tiltvp"):
            raise
        complain(f"a package that is installed cannot be imported: {error}")
        return SOME_FAILED
    except MemoryError:
        complain("the memory does not suffice, expected a smaller camera, image or file")
        return SOME_FAILED
    except TiltvpError as error:
        complain(str(error))
        return WRONG_USE
    except OSError as error:
        # Nothing more may be written to the output, not even at exit. Whoever reads a pipe may have seen enough.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if not isinstance(error, BrokenPipeError):
            complain(f"{error.filename or 'the output'}: {error.strerror or error}")
        return SOME_FAILED


def _refuse_empty(words: Sequence[str]) -> None:
    """Refuses words without a letter, which would be the working folder, or as if the option were not given."""
    for before, word in zip(("", *words), words, strict=False):
        if word == "" or re.fullmatch("--[^=]+=", word):
            option = word.removesuffix("=") or (before if before.startswith("--") else "an argument")
            raise InvalidInputError(f"{option}: an empty word, expected one that is not (a variable that is not set?)")


def _refuse_wordless(words: Sequence[str]) -> None:
    """Refuses an option of several words that has none, which the parser takes for no value at all."""
    bare = {word for word, after in zip(words, (*words[1:], "--"), strict=True) if word[:2] == after[:2] == "--"}
    for one in options_of(app, words) if bare else ():
        for option in bare.intersection(one.names if one.parameter.consume_multiple else ()):
            raise InvalidInputError(f"{option}: no word follows, expected one or more")


def _is_there(word: str) -> bool:
    """Whether a word is a source that can be read, or none at all."""
    return not word or os.path.lexists(word) or bool(glob.glob(word, recursive=True))


def _takes_a_word(option: str, words: Sequence[str]) -> bool:
    """Whether a word of the line is an option whose value comes next: no name, no switch, and none with its value."""
    if not option.startswith("--") or "=" in option:
        return False
    options = options_of(app, words)
    return not any(option in one.names and one.token_count()[0] == 0 for one in options)
