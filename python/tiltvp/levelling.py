"""Level images: what a leaning camera has seen, as a camera on the upright robot would have seen it."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

import numpy as np

from tiltvp import _core
from tiltvp.arguments import number_from, size_from
from tiltvp.cameras import Camera
from tiltvp.errors import InvalidInputError
from tiltvp.images import checked_camera, pixels_from
from tiltvp.tilt import TiltEstimator, normal_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import ArrayLike, NDArray

    from tiltvp.tilt import Tilt

__all__ = ["VIEWS", "Leveller", "Unwrapper", "level"]

View: TypeAlias = Literal["same", "fisheye", "pinhole", "panorama"]
VIEWS: Final[tuple[View, ...]] = ("same", "fisheye", "pinhole", "panorama")
"""What a level image may be."""
_FIELD_OF_VIEW_RAD: Final = {"fisheye": math.pi, "pinhole": 0.5 * math.pi}
"""From the left to the right border: a half sphere, and what is not yet drawn out at the borders."""
_LEVELLED: Final = ("uint8", "uint16", "int16", "float32", "float64")
_OUTSIDE_PX: Final = -1e6
"""Where OpenCV is sent for what was not seen."""
_LARGEST_SIDE_PX: Final = 32_765
"""What `cv2.remap` takes, less the column that is given twice."""
_AHEAD: Final = ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
"""The mounting "forward", as `tiltvp.rotations` has it, which would double the time of the import."""
_UPRIGHT: Final = (0.0, 0.0, 1.0)
_ACROSS, _DOWN = 4, 2
"""Places that are averaged in each pixel of a strip, along the row and along the column."""


class Leveller:
    """Makes images of one camera level by their tilt: as it, or another, would take them on the upright robot.

    The rays of the level image's pixels are made once. For a tilt, those at the corners of cells of 32 x 32 pixels (16
    x 16 in panoramas) are projected, and places between them interpolated where their differences say that this is good
    to 0.0125 pixels; it is to 0.05. Other cells are split, in the end into single pixels.
    `cv2.remap` interpolates levels between four pixels; black where nothing was seen. The sides of panoramas leave no
    seam. May be called from many threads at once, and pickled.

    Parameters
    ----------
    camera : tiltvp.Camera
    robot_from_camera : (3, 3) rotation R, v_robot = R v_camera; default identity: an upward camera, columns to the
        front. The mounting that the tilt was estimated with.
    to : {"same", "fisheye", "pinhole", "panorama"} or tiltvp.Camera
        What is shown: the camera's own image; an equidistant one; a perspective one; an equirectangular panorama of
        all directions with the robot's front in its middle; or what another camera would see.
    size : (width, height) in pixels; by default the camera's, and of a panorama one as fine as the camera at its
        centre.
    field_of_view_rad : of "fisheye" and "pinhole", from the left to the right border; default pi and pi / 2.
    robot_from_output : (3, 3), where the level image looks; default as the camera, of a panorama ahead.

    Raises `tiltvp.errors.InvalidInputError` for anything else.
    """

    def __init__(
        self,
        camera: _core.Camera,
        robot_from_camera: ArrayLike | None = None,
        *,
        to: View | _core.Camera = "same",
        size: tuple[int, int] | None = None,
        field_of_view_rad: float | None = None,
        robot_from_output: ArrayLike | None = None,
    ) -> None:
        _not_too_large(camera)
        self._output = _not_too_large(_output(camera, to, size, field_of_view_rad))
        ahead = to == "panorama" and robot_from_output is None
        looks = _AHEAD if ahead else robot_from_output
        self._core = _core.Leveller(camera, self._output, robot_from_camera=robot_from_camera, robot_from_shown=looks)
        self._looks = None if looks is None else np.array(looks, dtype=np.float64)

    @property
    def camera(self) -> _core.Camera:
        """Whose images are made level."""
        return self._core.camera

    @property
    def output(self) -> _core.Camera:
        """Whose images they become."""
        return self._output

    @property
    def robot_from_camera(self) -> NDArray[np.float64]:
        """(3, 3): R of v_robot = R v_camera."""
        return self._core.robot_from_camera

    @property
    def robot_from_output(self) -> NDArray[np.float64]:
        """(3, 3): where the level image looks."""
        return self.robot_from_camera if self._looks is None else self._looks.copy()

    def __call__(self, image: ArrayLike, tilt: Tilt) -> NDArray[Any]:
        """The level image of one (H, W) or (H, W, channels) of the camera, of the same dtype and channels.

        `tilt` is an estimate, a filter's or an image's, (alpha_rad, beta_rad), or the ground normal (3,) of the robot
        frame. Raises `InvalidInputError` for images of other sizes than the camera's, of other types than
        uint8, uint16, int16 and float, and for an estimate without a tilt.
        """
        import cv2

        array = _closed(_checked(image, self.camera), self.camera)
        level = np.zeros((self.output.height, self.output.width, *array.shape[2:]), array.dtype)
        for rows, seen, u, v in _strips(self._core, tilt, unseen=_OUTSIDE_PX):
            cv2.remap(array, u, v, cv2.INTER_LINEAR, dst=level[rows, seen])
        return level

    def map(self, tilt: Tilt) -> NDArray[np.float32]:
        """(H, W, 2): the pixel (u, v) of the leaning image that each pixel of the level one shows; NaN for none.

        Both are from 0 to the last column and row, of a panorama to the one after it, which is its first.
        """
        return _places(self._core, tilt)

    def __reduce__(self) -> tuple[Any, ...]:
        make = partial(type(self), to=self.output, robot_from_output=self._looks)
        return make, (self.camera, self.robot_from_camera)

    def __repr__(self) -> str:
        return f"Leveller({self.camera!r}, to={self.output!r})"


def _output(
    camera: _core.Camera,
    to: View | _core.Camera,
    size: tuple[int, int] | None,
    field_of_view_rad: float | None,
) -> _core.Camera:
    """The camera whose images the level ones are."""
    if isinstance(to, _core.Camera):
        if size is not None or field_of_view_rad is not None:
            raise InvalidInputError("size, field_of_view_rad: given beside a camera, expected neither: it has them")
        return to
    if not (isinstance(to, str) and to in VIEWS):
        raise InvalidInputError(f"to = {to!r}, expected one of {', '.join(VIEWS)}, or a tiltvp.Camera")
    if field_of_view_rad is not None and to not in _FIELD_OF_VIEW_RAD:
        raise InvalidInputError(f"field_of_view_rad: given with to={to!r}, expected it with fisheye or pinhole only")
    size = None if size is None else size_from(size, "size")
    if to == "same":
        return camera if size is None else _resized(camera, size)
    if to == "panorama":
        width, height = size or _panorama_size(camera)
        return Camera.equirectangular(width=width, height=height)
    width, height = size or (camera.width, camera.height)
    angle = _FIELD_OF_VIEW_RAD[to] if field_of_view_rad is None else number_from(field_of_view_rad, "field_of_view_rad")
    most = math.pi if to == "pinhole" else 2.0 * math.pi
    if not 0.0 < 0.5 * angle <= 0.5 * most or (to == "pinhole" and angle == most):
        raise InvalidInputError(f"field_of_view_rad = {angle}, expected an angle in (0, {most:.4f}) of a {to}")
    cx, cy = (width - 1) / 2.0, (height - 1) / 2.0
    if to == "pinhole":
        f = width / (2.0 * math.tan(angle / 2.0))
        return Camera.pinhole(width=width, height=height, fx=f, fy=f, cx=cx, cy=cy)
    return Camera.equidistant(
        width=width, height=height, focal_px=width / angle, cx=cx, cy=cy, max_theta_rad=angle / 2.0
    )


def _resized(camera: _core.Camera, size: tuple[int, int]) -> _core.Camera:
    """The camera at another size of the same shape."""
    scaled = camera.scaled(size[0] / camera.width)
    if (scaled.width, scaled.height) != size:
        raise InvalidInputError(
            f"size = {size}, expected {scaled.width} x {scaled.height}, of the shape of the camera's "
            f"{camera.width} x {camera.height}, or to='fisheye', 'pinhole' or 'panorama'"
        )
    return scaled


def _panorama_size(camera: _core.Camera) -> tuple[int, int]:
    """A panorama as fine as the camera is at its centre; the camera's own size if it is one."""
    if camera.model == "equirectangular":
        return camera.width, camera.height
    u, v = (camera.width - 1) / 2.0, (camera.height - 1) / 2.0
    a, b = camera.unproject(np.array([[u, v], [u + 1.0, v]]))
    per_rad = 1.0 / float(np.linalg.norm(b - a))
    if not math.isfinite(per_rad):
        raise InvalidInputError("size: none, and the camera sees nothing at its centre, expected (width, height)")
    height = max(2, round(math.pi * per_rad))
    return 2 * height, height


def _not_too_large(camera: _core.Camera) -> _core.Camera:
    checked_camera(camera)
    if max(camera.width, camera.height) > _LARGEST_SIDE_PX:
        size = f"{camera.width} x {camera.height}"
        raise InvalidInputError(f"camera: images of {size}, expected at most {_LARGEST_SIDE_PX} pixels a side")
    return camera


def _checked(image: ArrayLike, camera: _core.Camera) -> NDArray[Any]:
    expected = f"({camera.height}, {camera.width}) or ({camera.height}, {camera.width}, channels)"
    array = pixels_from(image, "image", expected)
    if array.ndim not in (2, 3) or array.shape[:2] != (camera.height, camera.width):
        raise InvalidInputError(f"image: shape {array.shape}, expected {expected}, as the camera's images")
    if array.dtype not in _LEVELLED or (array.ndim == 3 and not 1 <= array.shape[2] <= 4):
        kinds = ", ".join(_LEVELLED)
        raise InvalidInputError(f"image: dtype {array.dtype}, shape {array.shape}, expected {kinds} of 1 to 4 channels")
    return array


def _closed(array: NDArray[Any], camera: _core.Camera) -> NDArray[Any]:
    """A panorama with its first column behind the last one again, any other image as it is.

    OpenCV wraps rows and columns alike or not at all.
    """
    if camera.model != "equirectangular":
        return array
    return np.concatenate([array, array[:, :1]], axis=1)


def _strips(
    made: _core.Leveller, tilt: Tilt, *, unseen: float
) -> Iterator[tuple[slice, slice, NDArray[np.float32], NDArray[np.float32]]]:
    """Rows and columns of the level image beside which nothing is seen, and where their pixels are in the leaning one:
    columns and rows."""
    level_map, (height, width) = made._map(normal_of(tilt)), made.shape
    places = np.empty((2, level_map.strip_rows * width), np.float32)
    for number, first in enumerate(range(0, height, level_map.strip_rows)):
        count = min(level_map.strip_rows, height - first)
        u, v = places[:, : count * width]
        seen = slice(*level_map.write_strip(number, u, v, unseen))
        if seen.start < seen.stop:
            yield slice(first, first + count), seen, u.reshape(count, width)[:, seen], v.reshape(count, width)[:, seen]


def _places(made: _core.Leveller, tilt: Tilt) -> NDArray[np.float32]:
    places = np.full((*made.shape, 2), np.nan, np.float32)
    for rows, seen, u, v in _strips(made, tilt, unseen=math.nan):
        places[rows, seen, 0], places[rows, seen, 1] = u, v
    return places


def level(
    image: ArrayLike,
    seen_by: TiltEstimator | _core.Camera,
    tilt: Tilt,
    robot_from_camera: ArrayLike | None = None,
) -> NDArray[Any]:
    """The image as the untilted camera would have seen it, same shape and dtype; black where nothing was seen.

    `seen_by` is the estimator of the tilt, of which camera and mounting are taken, or a camera with its mounting,
    `robot_from_camera` (3, 3). For many images make a `Leveller`, whose tables are made once; `tilt` and what is raised
    are as there, and `InvalidInputError` also where a camera comes without a mounting, or an estimator with another.
    """
    if isinstance(seen_by, TiltEstimator):
        camera, own = seen_by.camera, seen_by.robot_from_camera
        if robot_from_camera is not None:
            from tiltvp.rotations import mounting_from

            if not np.allclose(own, mounting_from(robot_from_camera), atol=1e-6):
                raise InvalidInputError(
                    "robot_from_camera: another one than that of the estimator, expected none beside it"
                )
        robot_from_camera = own
    else:
        camera = seen_by
        if robot_from_camera is None:
            raise InvalidInputError(
                "robot_from_camera: none, expected the mounting (3, 3) beside a camera, or the TiltEstimator instead"
            )
    return Leveller(camera, robot_from_camera)(image, tilt)


class Unwrapper:
    """Unwraps images of one camera into level strips, azimuth by elevation, as methods of planar motion want them.

    The lean goes into the map from strip to image, so that an image is resampled once whether it is made level or not.
    Column j is at the azimuth `2 pi j / width`, from the robot's front to its left. Row 0 is the highest; rows are
    equally spaced between the two elevations, half a step clear of both. Each pixel is the mean of 4 x 2 places. What
    lies outside the camera's reach repeats the last row above that is seen at that azimuth, and is black where none is.
    May be called from many threads at once, and pickled.

    Parameters
    ----------
    camera : tiltvp.Camera
    robot_from_camera : (3, 3) rotation R, v_robot = R v_camera; default identity: an upward camera, columns to the
        front.
    size : (width, height) in pixels, at least 8 x 4, and at most 25 million in all; default (72, 40), five degrees for
        a column.
    elevation_min_rad, elevation_max_rad : of the lowest and highest row's border, in [-pi/2, pi/2]; default 0 and pi/3.

    Raises `tiltvp.errors.InvalidInputError` for anything else.
    """

    def __init__(
        self,
        camera: _core.Camera,
        robot_from_camera: ArrayLike | None = None,
        *,
        size: tuple[int, int] = (72, 40),
        elevation_min_rad: float = 0.0,
        elevation_max_rad: float = math.pi / 3.0,
    ) -> None:
        width, height = size_from(size, "size")
        elevation_min_rad = number_from(elevation_min_rad, "elevation_min_rad")
        elevation_max_rad = number_from(elevation_max_rad, "elevation_max_rad")
        if width < 8 or height < 4:
            raise InvalidInputError(f"size = {width} x {height}, expected at least 8 x 4 pixels")
        if _ACROSS * width * _DOWN * height > _core.MOST_PIXELS:
            most = _core.MOST_PIXELS // (_ACROSS * _DOWN)
            raise InvalidInputError(f"size = {width} x {height}, expected at most {most} pixels in all")
        if not -math.pi / 2.0 <= elevation_min_rad < elevation_max_rad <= math.pi / 2.0:
            limits = f"{elevation_min_rad}, {elevation_max_rad}"
            raise InvalidInputError(f"elevation_min_rad, elevation_max_rad = {limits}, expected rising in +-pi/2")
        _not_too_large(camera)
        self._size = (width, height)
        self._elevations = (elevation_min_rad, elevation_max_rad)
        azimuth = (np.arange(_ACROSS * width) + 0.5 - 0.5 * _ACROSS) * (2.0 * np.pi / (_ACROSS * width))
        rows = _DOWN * height
        reach = elevation_max_rad - elevation_min_rad
        across, up = np.meshgrid(azimuth, elevation_max_rad - reach * (np.arange(rows) + 0.5) / rows)
        rays = np.stack([np.cos(up) * np.cos(across), np.cos(up) * np.sin(across), np.sin(up)], axis=-1)
        self._core = _core.Leveller(
            camera, robot_from_camera=robot_from_camera, rays=rays.reshape(-1, 3), columns=across.shape[1]
        )

    @property
    def camera(self) -> _core.Camera:
        """Whose images are unwrapped."""
        return self._core.camera

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows of strips."""
        return self._size

    def __call__(self, image: ArrayLike, tilt: Tilt | None = None) -> NDArray[np.float32]:
        """(height, width) or (height, width, channels) levels of an image of the camera, made level by its tilt.

        `tilt` is an estimate, a filter's or an image's, or (alpha_rad, beta_rad); without one the robot is taken to be
        upright. Raises `InvalidInputError` as `Leveller` does.
        """
        import cv2

        places = _places(self._core, np.array(_UPRIGHT) if tilt is None else tilt)
        array = _closed(_checked(image, self.camera), self.camera)
        seen = np.isfinite(places[:, :, 0])
        # The number of the last row that is seen, from the top down to each row.
        rows = np.maximum.accumulate(np.where(seen, np.arange(places.shape[0])[:, None], 0), axis=0)
        places = np.nan_to_num(np.take_along_axis(places, rows[:, :, None], axis=0), nan=_OUTSIDE_PX)
        u, v = np.ascontiguousarray(np.moveaxis(places, 2, 0))
        fine = cv2.remap(array, u, v, cv2.INTER_LINEAR)
        strip = cv2.resize(fine.astype(np.float32), self.size, interpolation=cv2.INTER_AREA)
        # OpenCV leaves out an axis of one channel.
        return np.asarray(strip, dtype=np.float32).reshape(self.size[1], self.size[0], *array.shape[2:])

    def __reduce__(self) -> tuple[Any, ...]:
        low, high = self._elevations
        make = partial(type(self), size=self.size, elevation_min_rad=low, elevation_max_rad=high)
        return make, (self.camera, self._core.robot_from_camera)

    def __repr__(self) -> str:
        return f"Unwrapper({self.camera!r}, size={self.size})"
