"""`tiltvp camera rim`, `new`, `crop` and `scale`: image circles, ideal lenses, parts of images, resized images."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tiltvp.cli.camera import FileOptions, app, built
from tiltvp.cli.declared_options import Whole
from tiltvp.cli.options import ABOVE_0, Switch, image_size_from
from tiltvp.cli.sources import KeptOptions
from tiltvp.cli.terminal import complain, named, new_table, say, show
from tiltvp.errors import InvalidInputError, TiltvpError
from tiltvp.files import check_output

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import Camera

    Mask = NDArray[np.bool_]

__all__ = ["app"]

_READING = FileOptions()


@app.command
def rim(images: list[str], /) -> int:
    """Find the circle of a mirror's or a lens' rim in images, for `camera new`, and for `lines --rim-radius-px`.

    The exit code is 1 if an image shows none well enough, or cannot be read.

    Parameters
    ----------
    images
        Images, folders of images and glob patterns, or a video.
    """
    from tiltvp.rim import rim_circle

    frames = KeptOptions().open(images)
    table = new_table(None, ("file", "centre u px", "centre v px", "radius px", "covered %"), ("file",))
    well = not frames.problems
    for frame in frames:
        try:
            found = rim_circle(frame.read())
        except TiltvpError as error:
            complain(named(frame.name, str(error)))
            well = False
            continue
        if found is None:
            complain(f"{frame.name}: no circle gets darker outwards all round, as a rim does")
            well = False
            continue
        u, v = found.centre_px
        numbers = f"{u:.1f}", f"{v:.1f}", f"{found.radius_px:.1f}", f"{100.0 * found.covered:.0f}"
        table.add_row(Path(frame.name).name, *numbers)
    show(table)
    return 0 if well else 1


@app.command
def new(
    out: Path,
    /,
    *,
    image_size: str,
    view_deg: Annotated[float, ABOVE_0],
    lens: str = "equidistant",
    centre: tuple[float, float] | None = None,
    radius_px: Annotated[float | None, ABOVE_0] = None,
    mirror: Switch = False,
) -> None:
    """Write the camera of an ideal lens, where there is no calibration: from a field of view, or an image circle.

    How far the real lens is from it nobody knows: calibrate where you can.

    Parameters
    ----------
    out
        File to write (.toml).
    image_size
        WIDTHxHEIGHT in pixels.
    view_deg
        The angle that is seen across the image circle, or without --radius-px across the width of the image.
    lens
        equidistant, equisolid, stereographic or pinhole.
    centre
        u and v of the image circle's centre; by default the image's.
    radius_px
        Radius of the image circle.
    mirror
        The image is seen in a mirror.
    """
    from tiltvp import Camera

    size = image_size_from(image_size)
    assert size is not None  # There is a text.
    _check(out)
    camera = Camera.from_view(
        lens, width=size[0], height=size[1], view_rad=math.radians(view_deg), radius_px=radius_px, centre_px=centre,
        mirror=mirror,
    )  # fmt: skip
    camera.save(out)
    _tell(out, camera)


@app.command
def crop(
    file: Path,
    out: Path,
    /,
    reading: FileOptions = _READING,
    *,
    at: tuple[Whole, Whole],
    size: str,
    camera_name: str | None = None,
) -> None:
    """Write the camera of a part of the images; of a robot's file the robot with it, the mask cropped alike.

    Parameters
    ----------
    file
        Calibration file of the whole images.
    out
        File to write (.toml).
    at
        u and v of the part's first pixel.
    size
        WIDTHxHEIGHT of the part.
    camera_name
        Name or number of the camera in a file of several, the first being 0.
    """
    part = image_size_from(size, "--size")
    assert part is not None  # There is a text.
    _check(out, file)
    whole = built(file, reading.one(file, camera_name))
    u, v = at
    if min(u, v) < 0 or u + part[0] > whole.width or v + part[1] > whole.height:
        inside = f"a part of {whole.width} x {whole.height} pixels"
        raise InvalidInputError(f"--at {u} {v} --size {size}: reaches beyond the image, expected {inside}")
    _write(file, out, whole.cropped(u, v, *part), lambda mask: mask[v : v + part[1], u : u + part[0]])


@app.command
def scale(
    file: Path,
    out: Path,
    /,
    reading: FileOptions = _READING,
    *,
    factor: Annotated[float | None, ABOVE_0] = None,
    to: str | None = None,
    camera_name: str | None = None,
) -> None:
    """Write the camera of resized images; of a robot's file the robot with it, the mask resized alike.

    Parameters
    ----------
    file
        Calibration file of the images as they were.
    out
        File to write (.toml).
    factor
        By how much they were made larger.
    to
        WIDTHxHEIGHT that they have now, in place of a factor.
    camera_name
        Name or number of the camera in a file of several, the first being 0.
    """
    if (factor is None) == (to is None):
        raise InvalidInputError("--factor and --to: expected one of them")
    _check(out, file)
    camera = built(file, reading.one(file, camera_name))
    wanted = image_size_from(to, "--to")
    if wanted is not None:
        # Either side tells it to half a pixel; the longer one better.
        factor = wanted[0] / camera.width if camera.width >= camera.height else wanted[1] / camera.height
        scaled = camera.scaled(factor)
        if max(abs(scaled.width - wanted[0]), abs(scaled.height - wanted[1])) > 1:
            expected = f"{scaled.width}x{scaled.height}, or `tiltvp camera crop` first"
            raise InvalidInputError(
                f"--to {to}: other proportions than {camera.width}x{camera.height}, expected {expected}"
            )
        camera = scaled if (scaled.width, scaled.height) == wanted else scaled.cropped(0, 0, *wanted)
    else:
        assert factor is not None  # One of them was given.
        camera = camera.scaled(factor)
    size = (camera.width, camera.height)
    _write(file, out, camera, lambda mask: _resized(mask, size))


def _check(out: Path, file: Path | None = None) -> None:
    if out.suffix.lower() != ".toml":
        raise InvalidInputError(f"{out}: ends in {out.suffix!r}, expected .toml")
    if file is not None and os.path.realpath(out) == os.path.realpath(file):
        raise InvalidInputError(f"{out}: is the file to be read, expected another name")
    check_output(out)


def _write(file: Path, out: Path, camera: Camera, of_mask: Callable[[Mask], Mask]) -> None:
    """Writes a camera made of that of `file`; of a robot's file the robot with it, and what becomes of its mask."""
    from tiltvp.robot import Robot, is_robot

    if is_robot(file):
        robot = Robot.load(file)
        replace(robot, camera=camera, mask=None if robot.mask is None else of_mask(robot.mask)).save(out)
    else:
        camera.save(out)
    _tell(out, camera)


def _resized(mask: Mask, size: tuple[int, int]) -> Mask:
    """True where more than half of a pixel of images of that size, (width, height), shows the world."""
    import cv2
    import numpy as np

    way = cv2.INTER_AREA if size[0] < mask.shape[1] else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(mask.astype(np.float32), size, interpolation=way) > 0.5)


def _tell(out: Path, camera: Camera) -> None:
    say(f"{out}: {camera.model}, {camera.width} x {camera.height} px")
