"""`tiltvp calibrate`: where a camera sits on a robot, from the log of a drive."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tiltvp.cli.calibrate_inputs import DriveOptions, PictureOptions, log_of_images, log_of_tables, other_readings
from tiltvp.cli.calibrate_results import Calibration, ResultOptions
from tiltvp.cli.line_options import DrivingLineOptions
from tiltvp.cli.options import CameraOptions, Switch
from tiltvp.cli.rerun_views import send_calibration
from tiltvp.cli.showing import RerunOptions
from tiltvp.cli.sources import MotionOptions
from tiltvp.cli.terminal import say
from tiltvp.errors import InvalidInputError

NOT_RELIABLE = 1
_PICTURES, _LINES, _RESULTS, _MOTION = PictureOptions(), DrivingLineOptions(), ResultOptions(), MotionOptions()
_WATCHING = RerunOptions()


def calibrate(
    odometry_log: Path | None = None,
    bearings_log: Path | None = None,
    /,
    *,
    drive: DriveOptions,
    pictures: PictureOptions = _PICTURES,
    motion: MotionOptions = _MOTION,
    camera: CameraOptions | None = None,
    options: DrivingLineOptions = _LINES,
    method: str = "default",
    read_as: Annotated[tuple[str, ...], Parameter(consume_multiple=True)] = (),
    estimate_odometry: Switch = False,
    estimate_time_offset: Switch = False,
    results: ResultOptions = _RESULTS,
    watching: RerunOptions = _WATCHING,
) -> int:
    """Where a camera (or any sensor of bearings) sits on a robot, from a drive past landmarks.

    From two tables, ODOMETRY.csv BEARINGS.csv; or from pictures, --images SOURCE --camera FILE --odometry FILE: the
    lean of each, its vertical lines, and which line is which from image to image. Prints what the filter found step by
    step, what the whole log says at once, and the transform of the whole log if it can be relied upon; exit code 1 if
    it cannot, or if images could not be read.

    Parameters
    ----------
    odometry_log
        CSV with the columns step, delta_left_m, delta_right_m, and time_s if known.
    bearings_log
        CSV with the columns step, landmark, bearing_rad.
    method
        The filter: default, or paper.
    read_as
        How the log was recorded, where not by our conventions: wheels-swapped, wheels-negated, left-wheel-negated,
        right-wheel-negated, clockwise, degrees, millimetres, cumulative.
    estimate_odometry
        From the whole log also the wheel base and which wheel runs farther.
    estimate_time_offset
        From the whole log also by how much the bearings are later than the odometry.
    """
    from tiltvp import SelfCalibrator
    from tiltvp import calibrate as calibrate_log

    results.check()
    watching.check()
    bad, sigma = 0, {}
    if pictures.images is None:
        pictures.refuse(camera, motion)
        log = log_of_tables(odometry_log, bearings_log, with_times=estimate_time_offset)
    else:
        if odometry_log is not None:
            raise InvalidInputError(f"{odometry_log}: a log beside --images, expected one of them")
        log, sigma_rad, bad = log_of_images(pictures, motion, camera, options, drive, with_times=estimate_time_offset)
        sigma = {"bearing_sigma_rad": sigma_rad}
    log = log.read_as(*read_as)
    calibrator = SelfCalibrator(**sigma | drive.of_filter(), method=method)
    history = calibrator.follow(log.odometry, log.bearings)
    whole = calibrate_log(
        log.odometry, log.bearings, **sigma | drive.of_whole_log(), times_s=log.times_s,
        estimate_odometry=estimate_odometry, estimate_time_offset=estimate_time_offset,
    )  # fmt: skip
    with watching.viewer() as viewer:
        if viewer is not None:
            send_calibration(viewer, log, history, whole)
    results.tell(Calibration(calibrator, history, whole), options.robot_from_camera)
    for word in other_readings(whole.misreading):
        say(f"try {' '.join([*(f'--read-as {known}' for known in read_as), f'--read-as {word}'])}")
    return 0 if whole and not bad else NOT_RELIABLE
