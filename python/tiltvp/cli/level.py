"""`tiltvp level`: images, 360-degree photographs and videos made level."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import repeat
from pathlib import Path

from cyclopts import Group, Parameter

from tiltvp.cli.cluster import check_cluster, files_of, is_begun
from tiltvp.cli.filtering import FilterOptions
from tiltvp.cli.frame_checks import check_panoramas, tell_setup_of
from tiltvp.cli.level_images import TILTS, Levelling, Looks, level_on_cluster, write_images
from tiltvp.cli.level_videos import write_video
from tiltvp.cli.options import CameraOptions, MethodOptions, Switch, image_size_from, rotation_of
from tiltvp.cli.sources import MotionOptions, SourceOptions, check_apart, wheel_base_of
from tiltvp.cli.terminal import say
from tiltvp.errors import InvalidInputError
from tiltvp.files import check_output, check_output_folder, is_file_name
from tiltvp.levelling import View

_OUTPUT = Group("What is shown")
_METHOD_DEFAULTS, _FILTER_DEFAULTS = MethodOptions(), FilterOptions()
_SOURCE, _MOTION = SourceOptions(), MotionOptions()


@Parameter(name="*", group=_OUTPUT)
@dataclass(frozen=True, kw_only=True)
class OutputOptions:
    """What level images show."""

    to: View = "same"
    """The camera's own image, an equidistant fisheye's, a pinhole camera's, or a panorama of all directions."""
    size: str | None = None
    """WIDTHxHEIGHT of level images in pixels; by default the camera's, of panoramas as fine as it is."""
    field_of_view_deg: float | None = None
    """From the left to the right border, with --to fisheye (default 180) or pinhole (default 90)."""
    robot_from_output: str | None = None
    """Where level images look: up, forward, or a file with a rotation; by default as the camera, panoramas forward."""

    def keywords(self) -> dict[str, object]:
        """Those of `tiltvp.Leveller`."""
        angle = None if self.field_of_view_deg is None else math.radians(self.field_of_view_deg)
        looks = (
            None
            if self.robot_from_output is None
            else rotation_of(self.robot_from_output, option="--robot-from-output")
        )
        size = image_size_from(self.size, "--size")
        return {"to": self.to, "size": size, "field_of_view_rad": angle, "robot_from_output": looks}


_OUTPUT_DEFAULTS = OutputOptions()


def level(
    images: list[str] | None = None,
    /,
    *,
    out: Path,
    source: SourceOptions = _SOURCE,
    camera: CameraOptions | None = None,
    output: OutputOptions = _OUTPUT_DEFAULTS,
    method: MethodOptions = _METHOD_DEFAULTS,
    filtering: FilterOptions = _FILTER_DEFAULTS,
    motion: MotionOptions = _MOTION,
    metadata_only: Switch = False,
    copy_unlevelled: Switch = False,
    cluster: str | None = None,
) -> int:
    """Make images level by the tilt of each, videos by the tilt of the drive.

    Without --camera images are taken for 360-degree photographs: equirectangular, by their GPano metadata or their
    shape 2:1. Level JPEG files keep quality, EXIF and colour profile; level panoramas are marked so (GPano). An image
    whose tilt is not believed (confidence below 0.5, or --confidence-min) is named on stderr and left out, and the
    exit code is 1. A video's frame is then made level by what the filter predicts, and black where that has not begun.

    Parameters
    ----------
    images
        Image files, folders of images and glob patterns; or one video or recording of ROS.
    out
        Folder for level images, or a video (.mp4 or .avi) of the frames in their order. Of a video, a recording or a
        live camera a folder gets a video.
    metadata_only
        Of 360-degree JPEG photographs: write pitch and roll as GPano metadata, and leave the pixels' bytes untouched.
    copy_unlevelled
        Write images whose tilt is not believed as they are, instead of leaving them out; video frames too.
    cluster
        Address of a Dask scheduler: its workers, which must see the same files, make the images level. Their tilts are
        Parquet files in the folder tilts of --out; the same command goes on where it was ended.
    """
    from tiltvp.streams import Motion
    from tiltvp.streams.image_files import ImageFiles

    robot = None if camera is None else camera.robot()
    source = source.of_robot(robot, images or [])
    if camera is not None:
        method = camera.complete(method.of_topic(source.topic))
    looks = Looks(None if camera is None else camera.load(source.topic), method, output.keywords(), metadata_only)
    as_video = _is_video(out)
    if cluster is not None:
        check_cluster(out, filter=filtering.filter)
    if cluster is None or not is_begun(out / TILTS):
        check_output(out) if as_video else check_output_folder(out)
    frames = source.open(images or [], looks.camera)
    if looks.camera is None:
        check_panoramas(frames)
    of_files = isinstance(frames, ImageFiles)
    path = out if as_video or of_files else out / f"{Path(frames.source).stem}.mp4"
    calibration = None if camera is None else camera.camera
    check_apart(frames, path, filtering.filter_plot, beside=(motion.odometry, method.mask, calibration))
    if metadata_only and (as_video or not of_files):
        raise InvalidInputError("--metadata-only with a video, expected photographs")
    fused = filtering.filter or as_video or not of_files
    filtering = replace(filtering, filter=fused)
    filtering.check()
    if not fused:
        motion.refuse("--filter")
    moved = motion.motions_of(robot, frames) if fused else None
    filtering = filtering.following(frames, moved, wheel_base_of(robot, motion.wheel_base))
    if looks.camera is not None and looks.camera.model != "equirectangular":
        tell_setup_of(frames, looks.of(looks.camera.width, looks.camera.height).estimator, moved)
    work = Levelling(looks, filtering, copy_unlevelled)
    motions = repeat(Motion()) if moved is None else moved.motions
    if cluster is not None:
        levelled, of = level_on_cluster(cluster, files_of(frames), out, work)
    elif isinstance(frames, ImageFiles) and not as_video:
        levelled, of = write_images(frames, motions, out, work)
    else:
        levelled, of = write_video(frames, motions, path, work)
    of += len(frames.problems)
    say(f"{levelled} of {of} made level" + ("" if not metadata_only else ", by their metadata alone"))
    return 0 if levelled == of else 1


def _is_video(out: Path) -> bool:
    """Whether a video is written, not a folder. Raises `InvalidInputError` for the name of a file that is neither's."""
    from tiltvp.videos import CODECS

    if not is_file_name(out):
        return False
    if out.suffix.lower() not in CODECS:
        raise InvalidInputError(f"--out {out}: ends in {out.suffix!r}, expected {' or '.join(CODECS)}, or a folder")
    return True
