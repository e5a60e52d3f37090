"""`tiltvp corner`: the pose of a camera or a pair of cameras before a corner, image after image."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter, validators

from tiltvp._core import CORNER_METHODS
from tiltvp.cli.corner_methods import AUTO, SCALES, Searches, advice, looked_for, methods_for, shown
from tiltvp.cli.declared_options import LibraryOptions, from_library, mask_from
from tiltvp.cli.options import image_size_from
from tiltvp.cli.rerun_views import send_corner
from tiltvp.cli.showing import RerunOptions
from tiltvp.cli.sources import SourceOptions, ending_at_interrupt, picture_names
from tiltvp.cli.tables import Table, check_ending, check_plot, write_table
from tiltvp.cli.terminal import named, progress_bar, say
from tiltvp.errors import InvalidInputError, TiltvpError
from tiltvp.files import check_output, check_output_folder

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import Camera
    from tiltvp.corner import CornerEstimate
    from tiltvp.streams import Frames
    from tiltvp.streams.outputs.viewer import Viewer

_ANGLE = Parameter(validator=validators.Number(gt=0, lt=180))


@Parameter(name="*", group=Group("Corners", help="An option that is not given has the default of its method."))
@dataclass(frozen=True, kw_only=True)
@from_library({"CornerDetector": CORNER_METHODS, "CornerPoseEstimator": ()}, but=("gamma_rad",))
class CornerOptions(LibraryOptions):
    """How corners are found and told apart."""

    mask: Path | None = None
    """For general: image of the cameras' size, white where the world is seen and black where it is not; of a pair, for
    both images."""

    def given(self) -> dict[str, Any]:
        """The keywords of the library."""
        return super().given() | ({} if self.mask is None else {"mask": mask_from(self.mask)})


_OPTIONS, _SOURCE, _WATCHING = CornerOptions(), SourceOptions(), RerunOptions()
_POSE = ("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m")


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
    gamma: Annotated[float, _ANGLE] = 90.0,
    pitch: Annotated[float | None, Parameter(validator=validators.Number(gte=-90, lte=90))] = None,
    out: Path | None = None,
    corners: Path | None = None,
    trajectory: Path | None = None,
    overlay: Path | None = None,
    plot: Path | None = None,
    frame_rate: Annotated[float | None, Parameter(validator=validators.Number(gt=0))] = None,
    image_size: str | None = None,
    independent: Annotated[bool, Parameter(negative="")] = False,
    watching: RerunOptions = _WATCHING,
) -> int:
    """Find a corner in each image, or pair of images, and from it the camera's attitude, with a pair also its position.

    One camera tells its position too where its height above the corner (--camera-height-m), the length of an edge
    (--edge-length-m) or the size of the box (--box-size-m) is known.

    The last pose is where the next one is looked for. Images that cannot be read are named on stderr and skipped,
    and the exit code is 1; images without a corner have rows without a pose that say why. Where no image has a pose, a
    line says what to try.

    Parameters
    ----------
    left
        Image, folder of images, glob pattern, video or recording of ROS of the left or only camera; or - for names of
        files on stdin.
    right
        The same of the right camera, with as many frames.
    calibration
        Of two cameras: a camchain of Kalibr or a TOML of tiltvp with left, right and left_from_right. Of one camera:
        any format that `tiltvp camera formats` lists.
    topic_right
        The topic of the right camera's images, where its recording has several.
    method
        auto: coloured, and where it finds nothing general; the first that has a pose goes on alone. coloured: a cuboid
        with red, green and blue faces; general: corners of rooms, boxes and buildings; paper: the cuboid by the method
        as it was published, to compare.
    gamma
        Angle between the corner's level edges, degrees.
    pitch
        How far the left camera looks above the horizon, degrees, held without roll: negative looks down. Roughly; it
        says which of the edges is vertical, for the first image. With roll: --down.
    out
        File for the poses, one row for each frame: .csv, .json or .parquet.
    corners
        File for all corners that are believed, with names that last, poses, covariances, and lengths and angles of
        their edges, one row for each hypothesis of each corner in each frame: .csv, .json or .parquet.
    trajectory
        File for the trajectory in TUM's format: time, position and quaternion of the camera in the object's frame.
    overlay
        Folder for the left images with corners, their names, the cuboids that they make, and imaginary boxes.
    plot
        Picture of attitude and position over time (.png).
    frame_rate
        Frames per second: by default the times that frames tell, and 25 for images that tell none.
    image_size
        WIDTHxHEIGHT in pixels, for calibrations that do not carry it.
    independent
        Look at every frame anew.
    """
    from tiltvp.corner_tables import CORNER_COLUMNS, POSE_COLUMNS, corner_rows, pose_rows

    for file in (out, corners):
        if file is not None:
            check_ending(file)
    known = _known(options, math.radians(gamma), pitch)
    has_scale = right is not None or not SCALES.isdisjoint(known)
    if trajectory is not None and not has_scale:
        expected = "expected two, or --camera-height-m, --edge-length-m or --box-size-m"
        raise InvalidInputError(f"--trajectory {trajectory} of one camera, which tells no position: {expected}")
    if topic_right is not None and right is None:
        raise InvalidInputError(f"--topic-right {topic_right} of one camera: expected two")
    if pitch is not None and options.given().get("down") is not None:
        raise InvalidInputError("--pitch and --down: expected one of them")
    if trajectory is not None:
        check_output(trajectory)
    if overlay is not None:
        check_output_folder(overlay)
    check_plot("--plot", plot)
    watching.check()
    camera, estimator = _searches(calibration, right is not None, method, known, image_size_from(image_size))
    frames = source.open([] if left is None else [left])
    others = None if right is None else SourceOptions(topic=topic_right).open([right])
    if others is not None and (others.count != frames.count or frames.count is None):
        raise InvalidInputError(f"{right}: {others.count} frames, expected {frames.count} as in {left}")
    with watching.viewer() as viewer:
        look = Look(camera, estimator, independent, overlay, viewer)
        estimates = list(look.each(frames, others, frame_rate))
    if not estimates:
        raise InvalidInputError(f"{frames.source}: {look.bad} frames, none of which can be used")
    table = Table(POSE_COLUMNS, pose_rows(estimates))
    _write(table, out, trajectory, plot)
    if corners is not None:
        write_table(Table(CORNER_COLUMNS, corner_rows(estimates)), corners)
    _conclude(str(frames.source), estimator, look.bad, has_scale=has_scale, advice_for=(right is not None, known))
    return 1 if look.bad or frames.problems else 0


@dataclass
class Look:
    """What is done with each frame."""

    camera: Camera
    estimator: Searches
    independent: bool
    overlay: Path | None
    viewer: Viewer | None
    bad: int = 0
    """How many frames could not be used so far."""

    def each(
        self, frames: Frames, others: Frames | None, rate_hz: float | None
    ) -> Iterator[tuple[float, str, CornerEstimate]]:
        """Time, name and estimate of the frames that can be used; the others are complained about.

        Times are those of the frames, if `rate_hz` does not say how many there are in a second.
        """
        with ending_at_interrupt(frames) as coming, progress_bar(frames.count or 0, "frames") as bar:
            pairs = ((frame,) for frame in coming) if others is None else zip(coming, others, strict=True)
            for number, (pair, name) in enumerate(zip(pairs, picture_names(frames), strict=False)):
                frame = pair[0]
                even_s = number / (rate_hz or frames.rate_hz)
                time_s = even_s if rate_hz is not None or frame.time_s is None else frame.time_s
                try:
                    images = [one.read() for one in pair]
                    estimate = self._estimate(images)
                except TiltvpError as error:
                    bar.complain(named(frame.name, str(error)))
                    self.bad += 1
                else:
                    self._draw(name, number, time_s, images[0], estimate)
                    yield time_s, frame.name, estimate
                bar.advance()

    def _estimate(self, images: Sequence[NDArray[np.uint8]]) -> CornerEstimate:
        if self.independent:
            self.estimator.reset()
        return self.estimator(*images)

    def _draw(self, name: str, number: int, time_s: float, image: NDArray[np.uint8], estimate: CornerEstimate) -> None:
        from tiltvp.images import write_image

        if self.overlay is None and self.viewer is None:
            return
        picture = drawn(image, self.camera, estimate)
        if self.overlay is not None:
            write_image(self.overlay / f"{name}.png", picture)
        if self.viewer is not None:
            send_corner(self.viewer, number, time_s, picture, estimate)


def _write(table: Table, out: Path | None, trajectory: Path | None, plot: Path | None) -> None:
    if out is not None:
        write_table(table, out)
    if trajectory is not None:
        from tiltvp.corner_tables import write_trajectory

        write_trajectory(table.rows, trajectory)
    if plot is not None:
        from tiltvp.images import write_image
        from tiltvp.lab.plots.corner_poses import pose_plot
        from tiltvp.lab.plots.picture import figure_picture

        write_image(plot, figure_picture(pose_plot(table.frame())))


def _conclude(
    source: str, estimator: Searches, bad: int, *, has_scale: bool, advice_for: tuple[bool, dict[str, Any]]
) -> None:
    """How many frames have a pose, by which method, why the others have none, and what to try if all are such."""
    found, without = estimator.found.total(), estimator.without.total()
    skipped = f", {bad} skipped" if bad else ""
    by = f" ({looked_for(estimator.found)})" if found else ""
    say(f"{source}: {found + without} frames{skipped}, {found} with a pose{by}")
    if without:
        say(f"without a pose: {shown(estimator.without)}")
    if has_scale and estimator.placeless:
        say(f"without a place: {shown(estimator.placeless)}")
    if without and not found:
        [(reason, _)] = estimator.without.most_common(1)
        is_pair, known = advice_for
        say(f"looked for {looked_for(estimator.methods)}")
        say(f"try: {advice(reason, estimator.methods, is_pair=is_pair, given=known)}")


def _known(options: CornerOptions, gamma_rad: float, pitch_deg: float | None) -> dict[str, Any]:
    """The keywords of the estimator."""
    known: dict[str, Any] = {"gamma_rad": gamma_rad} | options.given()
    if pitch_deg is not None:
        pitch_rad = math.radians(pitch_deg)
        known["down"] = (0.0, math.cos(pitch_rad), -math.sin(pitch_rad))
    return known


def _searches(
    calibration: Path, is_pair: bool, method: str, known: dict[str, Any], image_size: tuple[int, int] | None
) -> tuple[Camera, Searches]:
    from tiltvp import Camera
    from tiltvp.corner import CornerPoseEstimator
    from tiltvp.stereo_rigs import StereoRig

    methods = methods_for(method, known)
    if not is_pair:
        camera = Camera.load(calibration, image_size=image_size)
        return camera, Searches({name: CornerPoseEstimator(camera, method=name, **known) for name in methods})
    rig = StereoRig.load(calibration, image_size=image_size)
    pair = (rig.left, rig.right, rig.left_from_right)
    return rig.left, Searches({name: CornerPoseEstimator(*pair, method=name, **known) for name in methods})


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
