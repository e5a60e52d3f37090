"""`tiltvp colmap`: gravity of each image of a COLMAP database, as a prior of its pose."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from cyclopts import Parameter, validators

from tiltvp.cli.option_words import typed
from tiltvp.cli.options import MethodOptions
from tiltvp.cli.terminal import complain, new_table, progress_bar, say, show
from tiltvp.errors import InvalidInputError, counted
from tiltvp.files import check_replacing

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import Camera, TiltEstimator
    from tiltvp.colmap import ImageGravity

BELIEVED_MIN: Final = 0.9
"""Least confidence of an image whose gravity is written where no other is asked for: COLMAP takes priors of gravity for
exact, and from here on next to none is wrong (`sure_wrong` of `tiltvp measure views`)."""
_METHOD = MethodOptions()


def colmap(
    database: Path,
    /,
    *,
    images: Path,
    cameras: Path | None = None,
    confidence_min: Annotated[float, Parameter(validator=validators.Number(gte=0, lte=1))] = BELIEVED_MIN,
    method: MethodOptions = _METHOD,
) -> int:
    """Write the gravity of each image of a COLMAP database as a prior of its pose, where its tilt is believed.

    Cameras are those of the database. Images are taken as held upright, or as the orientation tag of a photograph says,
    within 60 degrees. Images that are not believed get no gravity, and are counted with the reason; positions stay.
    COLMAP uses the priors in global mapping, with rotation_averaging.use_gravity. The exit code is 1 if an image cannot
    be read; where none can, nothing is written.

    Parameters
    ----------
    database
        COLMAP's database, with cameras and images; it is changed all at once or not at all.
    images
        Folder that the names of images in the database are below.
    cameras
        COLMAP's cameras.bin or cameras.txt, of a reconstruction for instance, in place of those cameras of the
        database that it has: without a known focal length these are of no use.
    confidence_min
        Least confidence of an image that is believed.
    """
    from tiltvp.colmap import ColmapDatabase, image_gravities
    from tiltvp.formats import read_cameras

    opened = ColmapDatabase(database)
    told = sum(image.has_gravity for image in opened.images)
    if told:
        check_replacing(f"{database}: {counted(told, 'images')} with a gravity")
    if cameras is not None:
        opened.use_cameras(read_cameras(cameras, "colmap"))

    def estimator_of(camera: Camera, mounting: NDArray[np.float64]) -> TiltEstimator:
        from tiltvp.photos import PHOTO_TILT_MAX_RAD

        otherwise = {"method": "segments", "tilt_max_rad": PHOTO_TILT_MAX_RAD} if method.method is None else {}
        return method.estimator(camera, robot_from_camera=mounting, **otherwise)

    with progress_bar(len(opened.images), "images") as bar:
        found = image_gravities(opened, images, estimator_of, confidence_min=confidence_min, advance=bar.advance)
    unread = [one.image.name for one in found if one.is_unreadable]
    if unread and len(unread) == len(found):
        raise InvalidInputError(f"{images}: none of the {len(unread)} images of {database} can be read there")
    opened.write(found)
    _show(found, database)
    for name in unread:
        complain(f"{images / name}: cannot be read")
    return 1 if unread else 0


def _show(found: Sequence[ImageGravity], database: Path) -> None:
    """How many images have gravity now, and why the others have none."""
    say(f"{database}: gravity of {sum(map(bool, found))} of {counted(len(found), 'images')}")
    reasons = Counter(one.reason for one in found if not one)
    if reasons:
        table = new_table(None, ("images", "without gravity, because"), ("without gravity, because",))
        for reason, count in reasons.most_common():
            table.add_row(str(count), typed(reason))
        show(table)
