"""`tiltvp corner`: the pose of a camera or a pair of cameras before a corner, image after image."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter, validators

from tiltvp._core import CORNER_METHODS
from tiltvp.cli.corner_inertial import Inertial, InertialOptions
from tiltvp.cli.corner_methods import AUTO, SCALES, Searches, methods_for
from tiltvp.cli.corner_pairs import pairs_of, partners_of
from tiltvp.cli.corner_results import CornerResults, tell
from tiltvp.cli.declared_options import LibraryOptions, from_library
from tiltvp.cli.frame_checks import tell_lens_of
from tiltvp.cli.options import FrameRate, Switch, image_size_from
from tiltvp.cli.repeats import Repeats
from tiltvp.cli.rerun_views import send_corner
from tiltvp.cli.showing import RerunOptions
from tiltvp.cli.sources import SourceOptions, check_apart, ending_at_interrupt, picture_names
from tiltvp.cli.terminal import files_first, named, progress_bar, say
from tiltvp.errors import InvalidInputError, TiltvpError, counted
from tiltvp.images import read_mask

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import Camera
    from tiltvp.corner import CornerEstimate
    from tiltvp.robot import Robot
    from tiltvp.streams import Frame, Frames
    from tiltvp.streams.outputs.viewer import Viewer

_BELONGS_TO = {
    "--down-sigma-deg": ("--pitch", "--down"),
    "--camera-height-sigma-m": ("--camera-height-m",),
    "--length-sigma-m": ("--edge-length-m", "--box-size-m"),
    "--known-edge": ("--edge-length-m",),
}
"""Options that tell nothing without one of others."""


@Parameter(name="*", group=Group("Corners", help="An option that is not given has the default of its method."))
@dataclass(frozen=True, kw_only=True)
@from_library({"CornerDetector": CORNER_METHODS, "CornerPoseEstimator": ()}, but=("gamma_rad",))
class CornerOptions(LibraryOptions):
    """How corners are found and told apart."""

    gamma: Annotated[float, Parameter(validator=validators.Number(gt=0, lt=180))] = 90.0
    """Angle between the corner's level edges, degrees."""
    pitch: Annotated[float | None, Parameter(validator=validators.Number(gte=-90, lte=90))] = None
    """How far the left camera looks above the horizon, degrees, held without roll: negative looks down. Roughly; it
    says which of the edges is vertical, for the first image. With roll: --down."""
    mask: Path | None = None
    """For general: image of the cameras' size, white where the world is seen and black where it is not; of a pair, for
    both images."""

    def given(self) -> dict[str, Any]:
        """The keywords of the library."""
        for option, owners in _BELONGS_TO.items():
            if self._has(option) and not any(map(self._has, owners)):
                raise InvalidInputError(f"{option} without {' or '.join(owners)}, expected both")
        known = {"gamma_rad": math.radians(self.gamma)} | super().given()
        if self.pitch is not None:
            if "down" in known:
                raise InvalidInputError("--pitch and --down: expected one of them")
            pitch_rad = math.radians(self.pitch)
            known["down"] = (0.0, math.cos(pitch_rad), -math.sin(pitch_rad))
        return known | ({} if self.mask is None else {"mask": read_mask(self.mask)})

    def _has(self, option: str) -> bool:
        return getattr(self, option.removeprefix("--").replace("-", "_")) is not None


_OPTIONS, _SOURCE, _RESULTS, _WATCHING = CornerOptions(), SourceOptions(), CornerResults(), RerunOptions()
_INERTIAL = InertialOptions()


def corner(
    left: str | None = None,
    right: str | None = None,
    /,
    *,
    calibration: Path,
    source: SourceOptions = _SOURCE,
    topic_right: str | None = None,
    method: str = AUTO,
    options: CornerOptions = _OPTIONS,
    results: CornerResults = _RESULTS,
    frame_rate: FrameRate = None,
    image_size: str | None = None,
    independent: Switch = False,
    inertial: InertialOptions = _INERTIAL,
    watching: RerunOptions = _WATCHING,
) -> int:
    """Find a corner in each image, or pair of images, and from it the camera's attitude, with a pair also its position.

    One camera tells its position too where its height above the corner (--camera-height-m), the length of an edge
    (--edge-length-m) or the size of the box (--box-size-m) is known.

    The last pose is where the next one is looked for. Images that cannot be read are named on stderr and skipped (exit
    code 1); images without a corner have rows that say why. Where no image has a pose, a line says what to try.

    Parameters
    ----------
    left
        Image, folder of images, glob pattern, video or recording of ROS of the left or only camera; or - for names of
        files on stdin.
    right
        The same of the right camera, with as many frames, or where both tell times those of the same times; under equal
        names where files of both folders have such.
    calibration
        Of two cameras: a camchain of Kalibr or a TOML of tiltvp with left, right and left_from_right. Of one camera:
        any format that `tiltvp camera formats` lists, or a robot's file, whose topics of recordings are taken too,
        whose mounting says where --pitch and --down do not which way is down, and whose mask `general` takes.
    topic_right
        The topic of the right camera's images, where its recording has several.
    method
        auto: coloured, and where it finds nothing general; the first that has a pose goes on alone. coloured: a cuboid
        with red, green and blue faces; general: corners of rooms, boxes and buildings; paper: the cuboid by the method
        as it was published, to compare.
    frame_rate
        Frames per second: by default the times that frames tell, and 25 for images that tell none, but with --imu. With
        it the times of pairs are not compared.
    image_size
        WIDTHxHEIGHT in pixels, for calibrations that do not carry it.
    independent
        Look at every frame anew.
    """
    known = options.given()
    has_scale = right is not None or not SCALES.isdisjoint(known)
    results.check(has_scale=has_scale)
    if topic_right is not None and right is None:
        raise InvalidInputError(f"--topic-right {topic_right} of one camera: expected two")
    watching.check()
    words = [] if left is None else [left]
    robot, known = _robot_of(calibration, known)
    source = source.of_robot(robot, words)
    sensor = inertial.of_robot(robot).knowledge(source.topic)
    cameras, estimator = _searches(calibration, right is not None, method, known, robot, image_size_from(image_size))
    frames, others = source.open(words, cameras[0]), None
    if right is not None:
        others = SourceOptions(topic=topic_right).open([right], cameras[1], topic_option="--topic-right")
    for side in (frames, others):
        check_apart(side, *results.files.values(), beside=(inertial.imu, options.mask, calibration))
    partners = None if others is None else partners_of(frames, others, timed=frame_rate is None)
    _tell_lenses(cameras, frames, others, known.get("mask", None if robot is None else robot.mask))
    with watching.viewer() as viewer:
        look = Look(cameras[0], estimator, independent, results.overlay, viewer, sensor)
        estimates = list(look.each(frames, others, partners, frame_rate))
    if not estimates:
        raise InvalidInputError(f"{frames.source}: {counted(look.bad, 'frames')}, none of which can be used")
    with files_first():
        tell(str(frames.source), estimator, look.bad, has_scale=has_scale, advice_for=(right is not None, known))
        if sensor is not None:
            say(sensor.summary())
        results.write(estimates)
    return 1 if look.bad or frames.problems else 0


@dataclass
class Look:
    """What is done with each frame."""

    camera: Camera
    estimator: Searches
    independent: bool
    overlay: Path | None
    viewer: Viewer | None
    sensor: Inertial | None = None
    bad: int = 0
    """How many frames could not be used so far."""

    def each(
        self, frames: Frames, others: Frames | None, partners: Sequence[int | None] | None, rate_hz: float | None
    ) -> Iterator[tuple[float, str, CornerEstimate]]:
        """Time, name and estimate of the frames that can be used; the others are complained about. `partners` are those
        of `partners_of`.

        Times are those of the frames, if `rate_hz` does not say how many there are in a second. Raises
        `InvalidInputError` for frames without a time where readings of a sensor have times.
        """
        rights = None if others is None else Repeats(others)
        told = {*frames.told, *(() if others is None else others.told)}
        with ending_at_interrupt(frames) as coming, progress_bar(frames.count or 0, "frames") as bar:
            lefts = zip(itertools.count(), coming, picture_names(frames), strict=False)
            pairs: Iterable[tuple[tuple[int, Frame, str], Frame | None]]
            pairs = zip(lefts, itertools.repeat(None)) if rights is None else pairs_of(lefts, rights, partners or ())
            for (number, frame, name), partner in pairs:
                pair = [frame] if partner is None else [frame, partner]
                time_s = frame.time_s if rate_hz is None else number / rate_hz
                if time_s is None:
                    if self.sensor is not None:
                        raise InvalidInputError(f"{frame.name}: tells no time, expected --frame-rate with --imu")
                    time_s = number / frames.rate_hz
                try:
                    images = [one.read() for one in pair]
                    estimate = self._estimate(images, time_s)
                except TiltvpError as error:
                    names = [one.name for one in pair]
                    if told.isdisjoint(names):
                        bar.complain(_blamed(names, str(error)))
                    self.bad += 1
                else:
                    self._draw(name, number, frame.time_s if rate_hz is None else time_s, images[0], estimate)
                    yield time_s, frame.name, estimate
                bar.advance()
        if rights is not None:
            rights.tell()

    def _estimate(self, images: Sequence[NDArray[np.uint8]], time_s: float) -> CornerEstimate:
        if self.independent:
            self.estimator.reset()
        if self.sensor is None:
            return self.estimator(*images)
        known = self.sensor.known(time_s)
        estimate = self.estimator(*images, **known)
        self.sensor.took(time_s, known)
        return estimate

    def _draw(
        self, name: str, number: int, time_s: float | None, image: NDArray[np.uint8], estimate: CornerEstimate
    ) -> None:
        from tiltvp.images import write_image

        if self.overlay is None and self.viewer is None:
            return
        picture = drawn(image, self.camera, estimate)
        if self.overlay is not None:
            write_image(self.overlay / f"{name}.png", picture)
        if self.viewer is not None:
            send_corner(self.viewer, number, time_s, picture, estimate)


def _robot_of(calibration: Path, known: dict[str, Any]) -> tuple[Robot | None, dict[str, Any]]:
    """The robot of a file of one, and what is known with the direction down by its mounting, unless that is given."""
    from tiltvp.robot import Robot, is_robot

    if not is_robot(calibration):
        return None, known
    robot = Robot.load(calibration)
    return robot, {"down": tuple(-robot.robot_from_camera[2])} | known


def _tell_lenses(cameras: Sequence[Camera], left: Frames, right: Frames | None, mask: NDArray[np.bool_] | None) -> None:
    """A line on stderr for each camera whose images speak against its calibration."""
    sides = [(left, "")] if right is None else [(left, ", left camera"), (right, ", right camera")]
    for camera, (frames, which) in zip(cameras, sides, strict=True):
        tell_lens_of(frames, camera, mask, f"--calibration{which}")


def _blamed(names: Sequence[str], problem: str) -> str:
    """The problem with the names of the images that it may be of in front, unless it names one."""
    return problem if any(name in problem for name in names) else named(" and ".join(names), problem)


def _searches(
    calibration: Path,
    is_pair: bool,
    method: str,
    known: dict[str, Any],
    robot: Robot | None,
    image_size: tuple[int, int] | None,
) -> tuple[tuple[Camera, ...], Searches]:
    """The cameras, left and right of a pair, and what is looked for in their images."""
    from tiltvp import Camera
    from tiltvp.corner import CornerPoseEstimator
    from tiltvp.stereo_rigs import StereoRig

    methods = methods_for(method, known)
    if not is_pair:
        camera = Camera.load(calibration, image_size=image_size)
        # The cuboid is told from the robot's own body by its colours.
        mask = None if robot is None else robot.mask
        own = {name: {"mask": mask} if mask is not None and name == "general" else {} for name in methods}
        found = {name: CornerPoseEstimator(camera, method=name, **(own[name] | known)) for name in methods}
        return (camera,), Searches(found)
    rig = StereoRig.load(calibration, image_size=image_size)
    pair = (rig.left, rig.right, rig.left_from_right)
    return pair[:2], Searches({name: CornerPoseEstimator(*pair, method=name, **known) for name in methods})


def drawn(image: NDArray[np.uint8], camera: Camera, estimate: CornerEstimate) -> NDArray[np.uint8]:
    """The image with its corners, their names, and their boxes: the imaginary one where the pose is of none."""
    from tiltvp.corner_boxes import join_boxes
    from tiltvp.overlays.corners import draw_box, draw_corners, draw_names

    canvas = draw_corners(image, camera, estimate.features_left, estimate.chosen_left)
    pose, boxes = estimate.pose, join_boxes(estimate.corners)
    for box in boxes:
        draw_box(canvas, camera, box.vertex_m, box.edges, box.sizes_m)
    if pose is not None and not any(0 in box.corners for box in boxes):
        vertex = pose.vertex_m
        if vertex is None:
            vertex = estimate.features_left[estimate.chosen_left[0]].vertex
        draw_box(canvas, camera, vertex, pose.edges)
    draw_names(canvas, camera, estimate.features_left, estimate.corners)
    return canvas
