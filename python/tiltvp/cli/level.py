"""`tiltvp level`: images, 360-degree photographs and videos made level."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

from cyclopts import Group, Parameter

from tiltvp.cli.filtering import FilterOptions
from tiltvp.cli.frames import open_frames
from tiltvp.cli.inputs import distinct_names, find_images
from tiltvp.cli.level_images import Levelling, Looks, write_images
from tiltvp.cli.level_videos import write_video
from tiltvp.cli.options import CameraOptions, MethodOptions, Switch, image_size_from
from tiltvp.cli.terminal import complain, say
from tiltvp.errors import InvalidInputError
from tiltvp.files import check_output, check_output_folder
from tiltvp.videos import VIDEO_ENDINGS

_OUTPUT = Group("What is shown")
_METHOD_DEFAULTS, _FILTER_DEFAULTS = MethodOptions(), FilterOptions()
To: TypeAlias = Literal["same", "fisheye", "pinhole", "panorama"]


@Parameter(name="*", group=_OUTPUT)
@dataclass(frozen=True, kw_only=True)
class OutputOptions:
    """What level images show."""

    to: To = "same"
    """The camera's own image, an equidistant fisheye's, a pinhole camera's, or a panorama of all directions."""
    size: str | None = None
    """WIDTHxHEIGHT of level images in pixels; by default the camera's, of panoramas as fine as it is."""
    field_of_view_deg: float | None = None
    """From the left to the right border, with --to fisheye (default 180) or pinhole (default 90)."""
    robot_from_output: str | None = None
    """Where level images look: up, forward, or a file with a rotation; by default as the camera, panoramas forward."""

    def keywords(self) -> dict[str, object]:
        """Those of `tiltvp.Leveller`."""
        from tiltvp.rotations import read_rotation

        angle = None if self.field_of_view_deg is None else math.radians(self.field_of_view_deg)
        looks = None if self.robot_from_output is None else read_rotation(self.robot_from_output)
        size = image_size_from(self.size, "--size")
        return {"to": self.to, "size": size, "field_of_view_rad": angle, "robot_from_output": looks}


_OUTPUT_DEFAULTS = OutputOptions()


def level(
    sources: list[str],
    /,
    *,
    out: Path,
    camera: CameraOptions | None = None,
    output: OutputOptions = _OUTPUT_DEFAULTS,
    method: MethodOptions = _METHOD_DEFAULTS,
    filtering: FilterOptions = _FILTER_DEFAULTS,
    metadata_only: Switch = False,
    copy_unlevelled: Switch = False,
) -> int:
    """Make images level by the tilt of each, videos by the tilt of the drive.

    Without --camera images are taken for 360-degree photographs: equirectangular, by their GPano metadata or their
    shape 2:1. Level JPEG files keep quality, EXIF and colour profile; level panoramas are marked so (GPano). An image
    whose tilt is not believed (confidence below 0.5, or --confidence-min) is named on stderr and left out, and the
    exit code is 1. A video's frame is then made level by what the filter predicts, and black where that has not begun.

    Parameters
    ----------
    sources
        Image files, folders of images, glob patterns, and videos.
    out
        Folder for level images, or a video (.mp4 or .avi) of the one source's frames in their order.
    metadata_only
        Of 360-degree JPEG photographs: write pitch and roll as GPano metadata, and leave the pixels' bytes untouched.
    copy_unlevelled
        Write images whose tilt is not believed as they are, instead of leaving them out; video frames too.
    """
    filtering.check()
    looks = Looks(None if camera is None else camera.load(), method, output.keywords(), metadata_only)
    work = Levelling(looks, filtering, copy_unlevelled)
    videos = [word for word in sources if _is_video(word)]
    if _is_video(str(out)):
        _check_video(sources, metadata_only)
        check_output(out)
        levelled, of = write_video(open_frames(sources[0]), out, work)
    else:
        check_output_folder(out)
        files, problems = find_images([word for word in sources if word not in videos])
        for problem in problems:
            complain(problem)
        levelled, of = write_images(files, distinct_names(files), out, work)
        of += len(problems)
        for word in videos:
            _check_video([word], metadata_only)
            more, frames = write_video(open_frames(word), out / f"{Path(word).stem}.mp4", work)
            levelled, of = levelled + more, of + frames
    say(f"{levelled} of {of} made level" + ("" if not metadata_only else ", by their metadata alone"))
    return 0 if levelled == of else 1


def _is_video(word: str) -> bool:
    return Path(word).suffix.lower() in VIDEO_ENDINGS and not Path(word).is_dir()


def _check_video(sources: list[str], metadata_only: bool) -> None:
    if len(sources) != 1:
        raise InvalidInputError(f"--out is a video, and there are {len(sources)} sources, expected one")
    if metadata_only:
        raise InvalidInputError("--metadata-only with a video, expected photographs")
