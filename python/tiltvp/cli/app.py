"""The commands put together, and the one door out: what goes wrong is one line on stderr and an exit code."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from cyclopts import App, CycloptsError, Parameter

from tiltvp import __version__
from tiltvp.cli import calibrate, camera, corner, demo, lines, segments, tilt, track
from tiltvp.cli.lab import dataset, evaluate, measure, report
from tiltvp.cli.terminal import complain
from tiltvp.errors import MissingExtraError, TiltvpError

DONE, SOME_FAILED, WRONG_USE, INTERRUPTED = 0, 1, 2, 130

app = App(
    name="tiltvp",
    help="Orientation and calibration from the straight lines of man-made places: a robot's tilt, vertical lines, "
    "where a camera sits on a robot, and the pose of corners.",
    version=__version__,
    default_parameter=Parameter(negative_iterable=()),
    suppress_keyboard_interrupt=False,
)
app.command(tilt.tilt)
app.command(segments.segments)
app.command(lines.lines)
app.command(track.track)
app.command(corner.corner)
app.command(calibrate.calibrate)
app.command(demo.demo)
app.command(camera.app)
app.command(dataset.app)
app.command(evaluate.evaluate)
app.command(measure.app)
app.command(report.report)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and gives the exit code: 0 done, 1 some failed or an extra is missing, 2 wrong use."""
    try:
        code = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()
        return code if isinstance(code, int) else DONE
    except CycloptsError as error:
        complain(f"{error} Try `tiltvp --help`.")
        return WRONG_USE
    except MissingExtraError as error:
        complain(str(error))
        return SOME_FAILED
    except TiltvpError as error:
        complain(str(error))
        return WRONG_USE
    except KeyboardInterrupt:
        complain("interrupted")
        return INTERRUPTED
    except BrokenPipeError:
        # Whoever read the output has seen enough; nothing more may be written to it, not even at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return SOME_FAILED
