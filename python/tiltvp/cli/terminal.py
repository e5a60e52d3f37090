"""Where things are printed: tables on stdout; progress and complaints on stderr."""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import TYPE_CHECKING, Final

from tiltvp.decoder_words import left_out

if TYPE_CHECKING:
    from rich.progress import Progress
    from rich.table import Table

_WIDTH_IN_FILES = 240
"""Columns that a table may take where there is no terminal to fit it into."""
_WAITING: Final[ContextVar[list[Callable[[], None]] | None]] = ContextVar("waiting", default=None)
"""What `files_first` keeps for its end."""


def open_closed_streams() -> None:
    """What is printed where stdout or stderr were closed, as of a service's, goes nowhere, and not into a file that
    is opened in their place."""
    for name, number in (("stdin", 0), ("stdout", 1), ("stderr", 2)):
        if getattr(sys, name) is not None:
            continue
        with suppress(OSError):
            os.fstat(number)
            continue
        # The least number that is free, for those below are open by now.
        os.open(os.devnull, os.O_RDWR)
        setattr(sys, name, open(number, "r" if number == 0 else "w", encoding="utf-8"))  # noqa: SIM115


def print_any_name() -> None:
    """Names of files that are no UTF-8 are printed on stdout as on stderr, with `\\udcff` for a byte 0xff."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


@contextmanager
def apart_from_decoders() -> Iterator[None]:
    """Our lines are all that stderr has of images that are damaged: we write to a duplicate of it, and decoders, to
    nowhere."""
    try:
        ours = sys.stderr if sys.stderr.fileno() == 2 else None
    except (AttributeError, OSError, ValueError):
        ours = None
    if ours is None:
        yield
        return
    duplicate = os.dup(2)
    sys.stderr = open(duplicate, "w", 1, ours.encoding, ours.errors, closefd=False)  # noqa: SIM115
    try:
        with left_out(duplicate):
            yield
    finally:
        sys.stderr.flush()
        sys.stderr = ours


@contextmanager
def files_first() -> Iterator[None]:
    """What is said and shown within comes at its end, when files are written: a full output, or one that is closed as
    by `head`, ends the command."""
    token = _WAITING.set([])
    try:
        yield
    finally:
        waiting = _WAITING.get() or []
        _WAITING.reset(token)
        for one in waiting:
            one()


def _now_or_later(out: Callable[[], None]) -> None:
    waiting = _WAITING.get()
    if waiting is None:
        out()
    else:
        waiting.append(out)


def show(*tables: Table) -> None:
    """Tables on stdout: fitted to a terminal, and as wide as they are, without padding, in files and pipes."""
    _now_or_later(lambda: _show(*tables))


def _show(*tables: Table) -> None:
    from rich.console import Console

    console = Console(highlight=False, markup=False, emoji=False, width=width())
    if console.is_terminal:
        console.print(*tables)
        return
    with console.capture() as capture:
        console.print(*tables)
    for line in capture.get().splitlines():
        if line.strip():
            print(line.rstrip())


def width() -> int:
    """Columns of text that a table may take."""
    from rich.console import Console

    console = Console()
    return console.width if console.is_terminal else _WIDTH_IN_FILES


def say(text: str) -> None:
    """Lines on stdout at once, as they are."""
    _now_or_later(lambda: print(text, flush=True))


def complain(problem: str) -> None:
    """One line on stderr."""
    print(_line(problem), file=sys.stderr, flush=True)


def _line(problem: str) -> str:
    """One line, in the words of the command line where the library speaks of its arguments."""
    from tiltvp.cli.option_words import of_option

    words = of_option(" ".join(problem.split()))
    words = words.replace("image_size=(width, height) from the caller", "--image-size WIDTHxHEIGHT")
    words = words.replace(" of image_size=", " of --image-size")
    words = words.replace("format= to say which", "--format or --camera-format to say which")
    words = words.replace(", at format=", ", at --format or --camera-format")
    words = re.sub(r"given with to='(\w+)'", r"given with --to \1", words)
    words = re.sub(r"^(parent|child) = ", r"--\1-frame = ", words)
    words = re.sub(r"^joints = ", "--wheel-joints = ", words)
    return f"tiltvp: {words}{_remedy(words)}"


def _remedy(problem: str) -> str:
    """What makes a calibration fit images of another size; empty where nothing is wrong with the size."""
    found = re.search(r"got (\d+) x (\d+) pixels, expected (\d+) x (\d+) \(rows x columns\), as the camera's", problem)
    if found is None:
        return ""
    rows, columns, height, width = (int(number) for number in found.groups())
    # As many rows as a camera that is scaled to these columns has, up to the rounding of both.
    if abs(rows * width - columns * height) <= max(width, height):
        return f": if they were resized, `tiltvp camera scale FILE OUT --to {columns}x{rows}` makes one that fits"
    if (rows, columns) == (width, height):
        return ": rows and columns are swapped, turn the images by a quarter"
    if rows > height or columns > width:
        return ": they show more than the calibration does, expected that of the whole image"
    return f": if they are a part, `tiltvp camera crop FILE OUT --at U V --size {columns}x{rows}` makes one that fits"


def named(name: object, problem: str) -> str:
    """The problem with the name of its file in front, unless it has it."""
    return problem if str(name) in problem else f"{name}: {problem}"


def new_table(title: str | None, columns: Iterable[str], left: Iterable[str] = ()) -> Table:
    """A table of right-justified numbers; the columns in `left` hold words."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    words = set(left)
    table = Table(title=title, box=SIMPLE_HEAD, title_justify="left", pad_edge=False)
    for column in columns:
        if column in words:
            table.add_column(column, overflow="fold")
        else:
            table.add_column(column, justify="right", no_wrap=True)
    return table


@contextmanager
def status(words: str) -> Iterator[Callable[[str], None]]:
    """A moving sign on stderr while something takes long, on a terminal; call what it yields to change the words."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console

    with Console(stderr=True).status(words) as sign:
        yield lambda text: sign.update(text)


@contextmanager
def progress_bar(total: int, what: str, *, done: int = 0, told: Collection[str] = ()) -> Iterator[ProgressBar]:
    """A bar with the time left on stderr for several things on a terminal, nothing otherwise; complaints go above it.

    What was `done` before counts as done, and not for the time left. Of names that were `told` of nothing is said.
    """
    if total < 2 or not sys.stderr.isatty():
        yield ProgressBar(None, told)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True, highlight=False)
    columns = (TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        progress.add_task(what, total=total, completed=done)
        yield ProgressBar(progress, told)


class ProgressBar:
    """Counts what is done."""

    def __init__(self, progress: Progress | None, told: Collection[str]) -> None:
        self._progress, self._told = progress, told

    def advance(self) -> None:
        """One more is done."""
        if self._progress is not None:
            self._progress.advance(self._progress.task_ids[0])

    def blame(self, name: object, problem: str) -> None:
        """`complain` of what has a name, unless it was told of before."""
        if str(name) not in self._told:
            self.complain(named(name, problem))

    def complain(self, problem: str) -> None:
        """One line on stderr, above the bar."""
        if self._progress is None:
            complain(problem)
        else:
            self._progress.console.print(_line(problem), markup=False, soft_wrap=True)
