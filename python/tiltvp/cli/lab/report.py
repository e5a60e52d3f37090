"""`tiltvp report`: the tables and figures of an evaluation run, as files and as one page."""

from __future__ import annotations

from pathlib import Path

from tiltvp.cli.terminal import say, status
from tiltvp.errors import InvalidInputError
from tiltvp.files import check_output_folder


def report(run: Path, /, *, out: Path, also: Path | None = None, label: str | None = None) -> None:
    """Draw tables 3 and 4 and figures 10 to 14, 17, 18, 21 to 25, 27 and 28 of the paper for a run of `evaluate`.

    Parameters
    ----------
    run
        Folder of the run. The table of `tiltvp measure scaling`, if it lies there as scaling.parquet or scaling.csv, is
        drawn too.
    out
        Folder for the figures and tables (PNG, PDF, CSV) and report.html; an earlier report there is replaced.
    also
        Folder of a run of the same dataset on another computer, for figure 25 and table 4.
    label
        What to call that computer; its processor by default.
    """
    from tiltvp.lab.evaluation.runs import read_run
    from tiltvp.lab.report.contents import OtherRun, contents_of, scaling_of
    from tiltvp.lab.report.files import check_target, write_report

    if label is not None and also is None:
        raise InvalidInputError(f"--label {label} without --also, expected both")
    check_target(out)
    check_output_folder(out)
    with status("reading") as say_what:
        other = None
        if also is not None:
            second = read_run(also)
            cpu = second.manifest.get("machine", {}).get("cpu")
            other = OtherRun(second, label or cpu or also.name)
        contents = contents_of(read_run(run), also=other, scaling=scaling_of(run), advance=say_what)
        page = write_report(contents, out, advance=say_what)
    say(str(page))
