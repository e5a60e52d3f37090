"""`tiltvp calibrate`: where a camera sits on a robot, from the logs of its drives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tiltvp.cli.calibrate_inputs import DriveOptions, LogOptions, Tables, sources_from
from tiltvp.cli.calibrate_pictures import PictureLog, PictureOptions
from tiltvp.cli.calibrate_results import Calibration, ResultOptions
from tiltvp.cli.line_options import DrivingLineOptions
from tiltvp.cli.options import CameraOptions, check_word
from tiltvp.cli.rerun_views import send_calibration
from tiltvp.cli.showing import RERUN, RerunOptions
from tiltvp.cli.sources import MotionOptions, check_apart
from tiltvp.cli.terminal import files_first, say, status
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from tiltvp import JoinedTilts, LogCalibration, Robot
    from tiltvp.drive_logs import DriveLog

NOT_RELIABLE = 1
_DRIVE, _READ, _MOTION = DriveOptions(), LogOptions(), MotionOptions()
_PICTURES, _LINES, _RESULTS = PictureOptions(), DrivingLineOptions(), ResultOptions()
_WATCHING = RerunOptions()


def calibrate(
    logs: list[str],
    /,
    *,
    drive: DriveOptions = _DRIVE,
    pictures: PictureOptions = _PICTURES,
    motion: MotionOptions = _MOTION,
    camera: CameraOptions | None = None,
    options: DrivingLineOptions = _LINES,
    method: str = "default",
    read: LogOptions = _READ,
    results: ResultOptions = _RESULTS,
    watching: RerunOptions = _WATCHING,
) -> int:
    """Where a camera (or any sensor of bearings) sits on a robot, from drives past landmarks.

    A log is two tables, ODOMETRY.csv BEARINGS.csv, or pictures of a drive with --camera FILE: the lean of each, its
    vertical lines, and which line is which from image to image. Several logs of one robot are joined. Prints what the
    filter found step by step, what each whole log says at once, roll and pitch as the leans tell them, and the
    transform if it can be relied upon; exit code 1 if it cannot, or if images could not be read.

    Parameters
    ----------
    logs
        Two tables: step, delta_left_m, delta_right_m, and time_s if known; and step, landmark, bearing_rad. Or a folder
        of images, a glob pattern in quotes, a video or a recording of ROS. Or several of these.
    method
        The filter: default, or paper.
    """
    from tiltvp import SelfCalibrator
    from tiltvp.drive_logs import READINGS

    watching.check()
    for word in read.read_as:
        check_word("--read-as", word, tuple(READINGS))
    sources, robot = sources_from(logs), None if camera is None else camera.robot()
    if camera is not None and robot is None and motion.wheel_base is None:
        camera.load(pictures.topic)  # Says what is wrong with a file that would tell the wheel base.
    drive, results = drive.settled(robot, motion.wheel_base), results.settled(robot)
    SelfCalibrator(**drive.of_filter(), method=method)  # Refuses options before there is any work.
    if camera is not None and robot is None and any(isinstance(source, Tables) for source in sources):
        raise InvalidInputError("--camera with a log of tables, expected a robot's file (tiltvp setup)")
    if all(isinstance(source, Tables) for source in sources):
        pictures.refuse(motion, options)
    measured = robot is not None and robot.covariance_rad2 is not None
    for word, given in (("--robot-from-camera", options.robot_from_camera), ("--level-floor", pictures.level_floor)):
        if measured and given:
            assert camera is not None  # It is the robot's file.
            raise InvalidInputError(f"{word} with {camera.camera}, expected no file that tells roll and pitch")
    if camera is not None:
        options = camera.complete(options)
    results.check(camera, options.mask)
    if pictures.tracks is not None and pictures.tracks == results.out:
        raise InvalidInputError(f"--out and --tracks are both {results.out}, expected two files")
    of_one_log = {"--odometry": motion.odometry, "--tracks": pictures.tracks, RERUN: watching.rerun}
    name = next((name for name, value in of_one_log.items() if value is not None), None)
    if len(sources) > 1 and name is not None:
        raise InvalidInputError(f"{name} with {len(sources)} logs, expected one log, or logs that tell of their own")
    opened: list[Tables | PictureLog] = []
    for source in sources:
        if isinstance(source, Tables):
            opened.append(source.checked(read))
        else:
            log = PictureLog.open(source, pictures, motion, camera, options, drive, robot, read)
            written = (results.out, results.robot_out, results.transform, results.plot, pictures.tracks)
            check_apart(log.frames, *written, beside=(motion.odometry,))
            opened.append(log)
    tilt = robot if measured else _joined_tilts([one for one in opened if isinstance(one, PictureLog)])
    found = [_calibrated(one, tilt, drive, read, method, watching) for one in opened]
    with files_first():
        known = results.tell(found, tilt, options.robot_from_camera, drive)
        if known is not None and results.robot_out is not None:
            looked = next((one for one in opened if isinstance(one, PictureLog)), None)
            told = _with_wheels(robot, drive) if looked is None else looked.robot(robot)
            results.write_robot(known, told, estimated=read.estimate_odometry)
    return 0 if known and not any(one.bad for one in opened) else NOT_RELIABLE


def _with_wheels(robot: Robot | None, drive: DriveOptions) -> Robot | None:
    """The robot of a file with the wheel base that its mounting was found by."""
    return robot and replace(robot, wheels=replace(robot.wheels, wheel_base_m=drive.wheel_base))


def _joined_tilts(logs: Sequence[PictureLog]) -> JoinedTilts | None:
    """Roll and pitch as the images of all logs tell them; None where none does."""
    from tiltvp import join_tilts

    tilts = []
    for log in logs:
        tilt = log.tilt()
        say(f"{log.name}: roll and pitch: {tilt.reason}")
        tilts += [tilt] if tilt else []
    joined = join_tilts(tilts) if tilts else None
    if joined is not None and joined.logs > 1:
        say(joined.reason)
    return joined


def _calibrated(
    one: Tables | PictureLog,
    tilt: JoinedTilts | Robot | None,
    drive: DriveOptions,
    read: LogOptions,
    method: str,
    watching: RerunOptions,
) -> Calibration:
    """The filter's and the whole log's answer."""
    from tiltvp import SelfCalibrator
    from tiltvp import calibrate as calibrate_log

    def noise() -> dict[str, float]:
        return {} if one.sigma_rad is None else {"bearing_sigma_rad": one.sigma_rad}

    def solve(log: DriveLog, **options: Any) -> LogCalibration:
        return calibrate_log(
            log.odometry, log.bearings, times_s=log.times_s,
            estimate_odometry=read.estimate_odometry, estimate_time_offset=read.estimate_time_offset,
            estimate_rolling_shutter=read.estimate_rolling_shutter,
            **{"estimate_centre": read.estimate_centre} | noise() | options | drive.of_whole_log(),
        )  # fmt: skip

    log, whole, doubt, remedies, left_out = one.solved(None if tilt is None else tilt.robot_from_camera, solve)
    calibrator = SelfCalibrator(**noise() | drive.of_filter(), method=method)
    with status(f"{one.name}: the filter, {len(log.bearings)} bearings"):
        # The filter estimates neither the image centre nor a rolling shutter.
        history = calibrator.follow(log.odometry, log.about_centre(whole.centre_off_rad).bearings)
    with watching.viewer() as viewer:
        if viewer is not None:
            send_calibration(viewer, log, history, whole)
    for word in remedies:
        say(f"{one.name}: try {' '.join(f'--read-as {known}' for known in (*read.read_as, word))}")
    doubt = "; ".join(filter(None, (doubt, drive.odd_units(log, remedies))))
    return Calibration(one.name, calibrator, history, whole, doubt, one.late_s, left_out)
