"""Images that mislead: views through cameras that are not as told, harmed views, and images without a vertical."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from tiltvp.cameras import Camera
from tiltvp.lab.datasets.ahead import AHEAD_CAMERAS, FORWARD
from tiltvp.lab.datasets.degrading import beneath, degrade_image, pixel_bearings, turned, unfocused
from tiltvp.lab.datasets.panoramas import Panorama, PanoramaViews, paper_camera
from tiltvp.rotations import read_rotation
from tiltvp.tilt import normal_from_alpha_beta

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Matrix = NDArray[np.float64]

__all__ = ["CASES", "UNHARMED", "HostileImage", "centre_off", "focal_off", "hostile_images"]

LEAN_MAX_DEG: Final = 8.0
"""Leans are drawn up to this: the default method looks for 10."""
UP: Final = read_rotation("up")
DOWN: Final = np.diag([1.0, -1.0, -1.0])
ROLLED: Final = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""A quarter turn about the optical axis: portrait for landscape."""
UPWARD: Final = paper_camera()
AHEAD: Final = AHEAD_CAMERAS["pinhole 80"]
WHOLE: Final = Camera.equirectangular(width=800, height=400)
GREY: Final = 110.0
THETA_MAX_RAD: Final = np.deg2rad(92.5)


@dataclass(frozen=True)
class HostileImage:
    """An image (H, W), the camera and mounting that are told, and the ground normal (3,) in the robot frame as told.

    `normal` is None where the image shows no vertical: every sure answer to it is wrong.
    """

    case: str
    location: str
    image: NDArray[Any]
    camera: Camera
    robot_from_camera: Matrix
    normal: Matrix | None


@dataclass(frozen=True)
class _Place:
    """One panorama and what is drawn for it; views are rendered when first asked for."""

    panorama: Panorama
    seed: int
    views: dict[str, NDArray[np.uint8]] = field(default_factory=dict)

    @cached_property
    def lean(self) -> Matrix:
        """The ground normal in the frame of the robot that the views are of."""
        rng = np.random.default_rng((self.seed, 1))
        return normal_from_alpha_beta(np.deg2rad(rng.uniform(0.0, LEAN_MAX_DEG)), rng.uniform(-np.pi, np.pi))

    def view(self, camera: Camera, mounting: Matrix, normal: Matrix | None = None) -> NDArray[np.uint8]:
        key = repr((camera, mounting.tolist(), None if normal is None else normal.tolist()))
        if key not in self.views:
            yaw = float(np.random.default_rng((self.seed, 2)).uniform(-np.pi, np.pi))
            lean = self.lean if normal is None else normal
            source = PanoramaViews(self.panorama, camera, robot_from_camera=mounting)
            self.views[key] = source.render(lean, yaw_rad=yaw, seed=self.seed)
        return self.views[key]

    def upward(self) -> NDArray[np.uint8]:
        return self.view(UPWARD, UP)


Made = tuple["NDArray[Any]", Camera, "Matrix", "Matrix | None"]
Make = Callable[[_Place, np.random.Generator], Made]


def _told(camera: Camera, mounting: Matrix, told: Matrix) -> Make:
    """Seen by a camera in a mounting, and told to be in another."""

    def make(place: _Place, _: np.random.Generator) -> Made:
        normal = told @ mounting.T @ place.lean
        return place.view(camera, mounting), camera, told, normal

    return make


def _harmed(harm: Callable[[NDArray[np.uint8], np.random.Generator], NDArray[Any]]) -> Make:
    """An upward view, harmed."""

    def make(place: _Place, rng: np.random.Generator) -> Made:
        return harm(place.upward(), rng), UPWARD, UP, place.lean

    return make


def _harmed_ahead(harm: Callable[[NDArray[np.uint8], np.random.Generator], NDArray[np.uint8]]) -> Make:
    """A view ahead, harmed."""

    def make(place: _Place, rng: np.random.Generator) -> Made:
        return harm(place.view(AHEAD, FORWARD), rng), AHEAD, FORWARD, place.lean

    return make


def _bare(draw: Callable[[np.random.Generator], NDArray[np.uint8]]) -> Make:
    """An image of nothing that stands upright, through the upward camera."""

    def make(_: _Place, rng: np.random.Generator) -> Made:
        return draw(rng), UPWARD, UP, None

    return make


def _bytes(levels: NDArray[Any]) -> NDArray[np.uint8]:
    return np.asarray(np.clip(np.rint(levels), 0, 255), dtype=np.uint8)


def _equidistant(**changes: Any) -> Camera:
    parts = {"width": 640, "height": 480, "focal_px": 139.7, "cx": 319.5, "cy": 239.5, "max_theta_rad": THETA_MAX_RAD}
    return Camera.equidistant(**parts | changes)


def focal_off(rng: np.random.Generator, share: float = 0.1) -> Camera:
    """The upward camera with a focal length that is off by a share, either way."""
    focal = 139.7 * (1.0 + share * rng.choice([-1.0, 1.0]))
    return _equidistant(focal_px=focal, max_theta_rad=THETA_MAX_RAD * 139.7 / focal)


def pinhole_focal_off(rng: np.random.Generator, share: float = 0.1) -> Camera:
    """The camera that looks ahead with a focal length that is off by a share, either way."""
    parts = AHEAD.parameters
    focal = parts["fx"] * (1.0 + share * rng.choice([-1.0, 1.0]))
    return Camera.pinhole(width=640, height=480, fx=focal, fy=focal, cx=parts["cx"], cy=parts["cy"])


def centre_off(rng: np.random.Generator, off_px: float = 10.0) -> Camera:
    """The upward camera with a centre that is off by so many pixels, in any direction."""
    azimuth = rng.uniform(-np.pi, np.pi)
    return _equidistant(cx=319.5 + off_px * np.cos(azimuth), cy=239.5 + off_px * np.sin(azimuth))


def _by(told: Callable[[np.random.Generator], Camera]) -> Make:
    """An upward view, told to be of another camera."""

    def make(place: _Place, rng: np.random.Generator) -> Made:
        return place.upward(), told(rng), UP, place.lean

    return make


def _rim(place: _Place, rng: np.random.Generator) -> Made:
    """The image circle ends above the horizon, darker towards its rim, and nothing says where."""
    v, u = np.indices((480, 640))
    radius = rng.uniform(170.0, 215.0)
    centre = rng.normal([319.5, 239.5], 3.0)
    inside = (radius - np.hypot(u - centre[0], v - centre[1])) / rng.uniform(1.0, 4.0)
    light = np.clip(0.5 + inside, 0.0, 1.0)
    dark = rng.normal(rng.uniform(2.0, 12.0), 2.0, light.shape)
    image = light * place.upward() + (1.0 - light) * dark
    return _bytes(image), _equidistant(max_theta_rad=None), UP, place.lean


def _robot(place: _Place, rng: np.random.Generator) -> Made:
    """Posts of the robot itself stand upright to it, however it leans."""
    image = place.upward().copy()
    for _ in range(int(rng.integers(2, 5))):
        azimuth = rng.uniform(-np.pi, np.pi)
        elevations = np.deg2rad([-2.0, rng.uniform(15.0, 35.0)])
        corners = []
        for side, ends in ((-1.0, elevations), (1.0, elevations[::-1])):
            for elevation in ends:
                bearing = azimuth + side * np.deg2rad(2.0)
                flat = np.cos(elevation)
                corners.append([flat * np.cos(bearing), flat * np.sin(bearing), np.sin(elevation)])
        cv2.fillPoly(image, [np.rint(UPWARD.project(np.array(corners))).astype(np.int32)], float(rng.uniform(5, 60)))
    noisy = image + rng.normal(0.0, 2.0, image.shape)
    return _bytes(noisy), UPWARD, UP, place.lean


def _small(factor: float) -> Make:
    def make(place: _Place, _: np.random.Generator) -> Made:
        camera = UPWARD.scaled(factor)
        image = cv2.resize(place.upward(), (camera.width, camera.height), interpolation=cv2.INTER_AREA)
        return np.asarray(image), camera, UP, place.lean

    return make


def _deep(bits: int) -> Make:
    """Of a sensor of so many bits, in 16."""

    def harm(image: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint16]:
        levels = image.astype(np.float64) * (2**bits - 1) / 255.0 + rng.uniform(-0.5, 0.5, image.shape) * 2 ** (
            bits - 8
        )
        return np.asarray(np.clip(np.rint(levels), 0, 2**bits - 1), dtype=np.uint16)

    return _harmed(harm)


def _noisy(image: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    return _bytes(image + rng.normal(0.0, rng.uniform(10.0, 40.0), image.shape))


def _overexposed(image: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    return _bytes(image * rng.uniform(2.0, 6.0) + rng.uniform(0.0, 60.0))


def _boxes(image: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Boxes about things, as detectors draw them."""
    drawn = image.copy()
    for _ in range(int(rng.integers(2, 9))):
        u, v, across, down = rng.integers([0, 20, 30, 40], [540, 380, 200, 250]).tolist()
        cv2.rectangle(drawn, (u, v), (u + across, v + down), float(rng.uniform(150, 255)), 2)
    return drawn


def _cut_off(image: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """As decoders show an image that is cut off: its last row again and again."""
    last = int(rng.uniform(0.2, 0.8) * len(image))
    return np.asarray(np.vstack([image[:last], np.repeat(image[last : last + 1], len(image) - last, axis=0)]))


def _compressed(image: NDArray[np.uint8], _: np.random.Generator) -> NDArray[np.uint8]:
    """JPEG of quality 10."""
    data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 10])[1]
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


_UPWARD_BEARINGS: list[NDArray[np.float32]] = []


def _bearings() -> NDArray[np.float32]:
    """(H, W, 3): of the pixels of the upward camera; zero outside of the lens."""
    if not _UPWARD_BEARINGS:
        _UPWARD_BEARINGS.append(pixel_bearings(UPWARD).astype(np.float32))
    return _UPWARD_BEARINGS[0]


def _slanted(image: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Bars of staircases, roofs, plants and cables: half of them parallel, 15 to 50 degrees off the vertical."""
    bearings, levels = _bearings(), image.astype(np.float32)
    common = normal_from_alpha_beta(np.deg2rad(rng.uniform(15.0, 50.0)), rng.uniform(-np.pi, np.pi))
    for _ in range(int(rng.integers(15, 50))):
        own = normal_from_alpha_beta(np.deg2rad(rng.uniform(5.0, 60.0)), rng.uniform(-np.pi, np.pi))
        along = common if rng.random() < 0.5 else own
        normal = np.cross(along, rng.normal(size=3))
        normal /= np.linalg.norm(normal)
        start = normal_from_alpha_beta(np.deg2rad(rng.uniform(40.0, 90.0)), rng.uniform(-np.pi, np.pi))
        half, reach, level = (
            np.deg2rad(rng.uniform(0.2, 1.0)),
            np.cos(np.deg2rad(rng.uniform(15.0, 45.0))),
            rng.uniform(10.0, 245.0),
        )
        aside, ahead = np.abs(bearings @ normal.astype(np.float32)), bearings @ start.astype(np.float32)
        at = np.nonzero((aside < half + 0.01) & (ahead > reach))
        shown = np.clip(1.0 + (half - aside[at]) * 139.7, 0.0, 1.0) * np.clip((ahead[at] - reach) * 60.0, 0.0, 1.0)
        levels[at] += shown * (level - levels[at])
    return _bytes(levels)


def _cloudy(rng: np.random.Generator, power: float, contrast: float) -> Matrix:
    """Noise whose spectrum falls with a power of the frequency, of so many grey levels."""
    v, u = np.fft.fftfreq(480)[:, None], np.fft.fftfreq(640)[None, :]
    frequency = np.maximum(np.hypot(u, v), 1.0 / 640.0)
    spectrum = np.fft.fft2(rng.normal(size=(480, 640))) * frequency**-power
    levels = np.real(np.fft.ifft2(spectrum))
    return np.asarray(GREY + contrast * (levels - levels.mean()) / levels.std())


def _seen(levels: Matrix, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Seen by the upward camera: black outside of its circle, with the noise of views."""
    noisy = levels + rng.normal(0.0, 2.0, levels.shape)
    return _bytes(np.where(np.any(_bearings() != 0.0, axis=2), noisy, 0.0))


def _texture(rng: np.random.Generator) -> NDArray[np.uint8]:
    return _seen(_cloudy(rng, rng.uniform(0.5, 1.2), rng.uniform(20.0, 60.0)), rng)


def _sky(rng: np.random.Generator) -> NDArray[np.uint8]:
    return _seen(_cloudy(rng, rng.uniform(1.5, 2.2), rng.uniform(10.0, 50.0)) + 60.0, rng)


def _wall(rng: np.random.Generator) -> NDArray[np.uint8]:
    return _seen(_cloudy(rng, 2.0, rng.uniform(1.0, 6.0)), rng)


def _pure_noise(rng: np.random.Generator) -> NDArray[np.uint8]:
    return _seen(np.full((480, 640), GREY) + rng.normal(0.0, rng.uniform(5.0, 70.0), (480, 640)), rng)


def _portrait(rng: np.random.Generator) -> NDArray[np.uint8]:
    """Head and shoulders before a blurred ground: hair, eyes, mouth."""
    levels = _cloudy(rng, 2.2, 25.0)
    at, size, turn = rng.uniform([200, 160], [440, 320]), rng.uniform(60.0, 130.0), rng.uniform(-180.0, 180.0)
    away = np.deg2rad(turn)
    rotation = np.array([[np.cos(away), -np.sin(away)], [np.sin(away), np.cos(away)]])
    skin, dark = rng.uniform(120, 220), rng.uniform(10, 80)
    parts: list[tuple[tuple[float, float], tuple[float, float], float]] = [
        ((0.0, 1.9), (1.7, 0.9), dark + 40.0), ((0.0, -0.25), (0.95, 1.15), dark), ((0.0, 0.0), (0.75, 1.0), skin),
        ((-0.3, -0.2), (0.14, 0.07), dark), ((0.3, -0.2), (0.14, 0.07), dark), ((0.0, 0.5), (0.3, 0.08), skin - 60.0),
    ]  # fmt: skip
    for place, axes, level in parts:
        centre = at + size * (rotation @ np.array(place))
        box = (tuple(centre.tolist()), tuple((2.0 * size * np.array(axes)).tolist()), turn)
        cv2.ellipse(levels, box, level, -1, cv2.LINE_AA)
    return _seen(np.asarray(cv2.GaussianBlur(levels, (0, 0), 0.8)), rng)


def _leaning(place: _Place, rng: np.random.Generator) -> Made:
    """A lean of 20 to 40 degrees, twice and more what the methods look for."""
    normal = normal_from_alpha_beta(np.deg2rad(rng.uniform(20.0, 40.0)), rng.uniform(-np.pi, np.pi))
    return place.view(UPWARD, UP, normal), UPWARD, UP, normal


def _with_hardship(hardship: str) -> Make:
    return _harmed(lambda image, rng: degrade_image(image, hardship, UPWARD, rng))


def _beneath(widest_deg: float | None = None) -> Make:
    return lambda place, rng: (beneath(place.upward(), UPWARD, place.lean, rng, widest_deg), UPWARD, UP, place.lean)


CASES: Final[dict[str, Make]] = {
    "upward": _told(UPWARD, UP, UP),
    "ahead": _told(AHEAD, FORWARD, FORWARD),
    "panorama": _told(WHOLE, FORWARD, FORWARD),
    "upward read as ahead": _told(UPWARD, UP, FORWARD),
    "upward read as downward": _told(UPWARD, UP, DOWN),
    "downward read as upward": _told(UPWARD, DOWN, UP),
    "ahead read as upward": _told(AHEAD, FORWARD, UP),
    "ahead read as downward": _told(AHEAD, FORWARD, DOWN),
    "portrait read as landscape": _told(AHEAD, FORWARD @ ROLLED, FORWARD),
    "panorama read as upward": _told(WHOLE, FORWARD, UP),
    "focal length off by 10 %": _by(focal_off),
    "centre off by 10 px": _by(centre_off),
    "rim not masked": _rim,
    "robot not masked": _robot,
    "320 x 240": _small(0.5),
    "160 x 120": _small(0.25),
    "80 x 60": _small(0.125),
    "40 x 30": _small(0.0625),
    "10 bits in 16": _deep(10),
    "12 bits in 16": _deep(12),
    "dark": _with_hardship("dark"),
    "blurred": _with_hardship("blurred"),
    "noisy": _harmed(_noisy),
    "half hidden": _with_hardship("hidden"),
    "over-exposed": _harmed(_overexposed),
    "slanted edges": _harmed(_slanted),
    "texture": _bare(_texture),
    "sky": _bare(_sky),
    "noise alone": _bare(_pure_noise),
    "bare wall": _bare(_wall),
    "portrait of a person": _bare(_portrait),
    "lean of 20 to 40 degrees": _leaning,
    "downward": _told(UPWARD, DOWN, DOWN),
    "fisheye ahead": _told(UPWARD, FORWARD, FORWARD),
    "portrait": _told(AHEAD, FORWARD @ ROLLED, FORWARD @ ROLLED),
    "downward read as ahead": _told(UPWARD, DOWN, FORWARD),
    "fisheye ahead read as upward": _told(UPWARD, FORWARD, UP),
    "fisheye ahead read as downward": _told(UPWARD, FORWARD, DOWN),
    "fisheye upside down read as upright": _told(UPWARD, FORWARD @ ROLLED @ ROLLED, FORWARD),
    "ahead, boxes drawn": _harmed_ahead(_boxes),
    "ahead, last row repeated": _harmed_ahead(_cut_off),
    "ahead, JPEG of quality 10": _harmed_ahead(_compressed),
    "out of focus": _harmed(unfocused),
    "turned while exposed": _harmed(turned),
    "beneath a table": _beneath(),
    "beneath a beam": _beneath(12.0),
}
"""What is done, by name."""

UNHARMED: Final = ("upward", "ahead", "panorama", "downward", "fisheye ahead", "portrait")
"""The views that are not harmed and read as they are: each mounting that another is read as is among them, lest cameras
tell what images are to tell."""


def hostile_images(
    panoramas: Sequence[Panorama], *, count: int = 200, seed: int = 0, cases: Sequence[str] = tuple(CASES)
) -> Iterator[HostileImage]:
    """`count` images of each case: panoramas take turns, each time with another heading and lean."""
    for number in range(count):
        panorama = panoramas[number % len(panoramas)]
        place = _Place(panorama, 100_000 * seed + number)
        for case in cases:
            rng = np.random.default_rng((seed, number, list(CASES).index(case)))
            yield HostileImage(case, panorama.location, *CASES[case](place, rng))
