"""`tiltvp measure level`: what levelling leaves of a lean, and what it costs."""

from __future__ import annotations

from pathlib import Path

from tiltvp.cli.lab.measure_options import Every
from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.tables import check_ending, write_frame
from tiltvp.cli.terminal import progress_bar
from tiltvp.errors import InvalidInputError

_PHOTOS = 12
"""As many are timed, more or less."""


def level(
    directory: Path | None = None, /, *, inertial: Path | None = None, every: Every = 1, out: Path | None = None
) -> None:
    """360-degree panoramas made level, turned by up to 30 degrees, and times beside OpenCV's remapping with ready maps.

    Parameters
    ----------
    directory
        Folder with upright panoramas and an INDEX.csv of columns name, environment, tilt_x_deg, tilt_z_deg; without
        one, times alone are measured.
    inertial
        Folder with panoramas as taken, and an INDEX.csv of columns name, environment, imu_pitch_deg, imu_roll_deg.
    out
        Also write the table of turned panoramas: .csv, .json or .parquet.
    """
    from tiltvp.lab.datasets.panoramas import read_panorama_index
    from tiltvp.lab.evaluation.imu import read_inertial_index, summarise_inertial
    from tiltvp.lab.evaluation.levelling import (
        lean_against_sensor,
        photo_times,
        remap_times,
        summarise_turned,
        turned_panoramas,
    )

    check_ending(out)
    if directory is None and out is not None:
        raise InvalidInputError(f"--out {out}: is of turned panoramas, expected a folder of panoramas too")
    if directory is None and inertial is None and every > 1:
        raise InvalidInputError(f"--every {every}: expected a folder of panoramas or --inertial too")
    chosen = [] if directory is None else read_panorama_index(directory)[::every]
    items = [] if inertial is None else read_inertial_index(inertial)[::every]
    with progress_bar(6, "times") as bar:
        times = remap_times(advance=bar.advance)
    show_frame("A level image by a new tilt beside cv2.remap with ready maps, one thread", times, ["image"])
    if directory is not None:
        photos = chosen[:: max(1, len(chosen) // _PHOTOS)]
        with progress_bar(len(photos), "photographs") as bar:
            times = photo_times(photos, advance=bar.advance)
        title = f"A photograph, 2048 x 1024, ms ({len(photos)})"
        show_frame(title, times, ["step"])
        with progress_bar(len(chosen), "panoramas") as bar:
            table = turned_panoramas(chosen, advance=bar.advance)
        if out is not None:
            write_frame(table, out)
        title = f"{len(chosen)} panoramas turned by up to 30 degrees: errors in degrees of those that are believed"
        show_frame(title, summarise_turned(table), ["method"])
    if inertial is not None:
        with progress_bar(len(items), "panoramas as taken") as bar:
            table = lean_against_sensor(items, advance=bar.advance)
        title = "Lean minus sensor, degrees, constant offset removed"
        show_frame(title, summarise_inertial(table), ["panoramas"])
