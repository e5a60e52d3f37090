"""The command line without its commands, which `app` adds: what runs one, also from within another."""

from __future__ import annotations

from collections.abc import Sequence

from cyclopts import App, Parameter

from tiltvp import __version__

_PARAMETER = Parameter(negative_iterable=())
"""No `--empty-...` beside an option of several words."""

app = App(
    name="tiltvp",
    help="Orientation and calibration from the straight lines of man-made places: a robot's tilt, vertical lines, "
    "where a camera sits on a robot, and the pose of corners. Files and folders that exist are kept; with --overwrite, "
    "which every command takes, its outputs replace them; a run of evaluate goes on.",
    version=__version__,
    default_parameter=_PARAMETER,
    suppress_keyboard_interrupt=False,
)


def group(name: str, help: str) -> App:
    """Several commands behind one word; the pages of the site do not inherit what `app` says of options."""
    return App(name=name, help=help, default_parameter=_PARAMETER)


def run(words: Sequence[str]) -> int:
    """Runs one command within another or for `main`: its exit code (0 for done), and what is wrong as an exception."""
    try:
        code = app(list(words), exit_on_error=False, print_error=False, result_action="return_value")
    except ModuleNotFoundError:
        # Verbs of the laboratory begin with its packages; where these are not installed, it says so.
        import tiltvp.lab  # noqa: F401

        raise
    return code if isinstance(code, int) else 0
