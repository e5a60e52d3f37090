"""Whether a camera is and sits as it is said to, as a few images tell: which of six directions is up, and the lens."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.errors import InvalidInputError
from tiltvp.images import gray_from
from tiltvp.lens_check import LensCheck, check_lens
from tiltvp.segments import SegmentDetector

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera, Segments

    Matrix = NDArray[np.float64]

__all__ = ["DIRECTIONS", "SetupCheck", "check_setup", "mounting_looking"]

DIRECTIONS: Final[dict[str, tuple[float, float, float]]] = {
    "-y": (0.0, -1.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "+x": (1.0, 0.0, 0.0),
    "+z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}
"""The six directions of the camera frame that may be up, by name."""

_WORDS: Final = {
    "-y": "it looks ahead, image upright",
    "+y": "it looks ahead, image upside down",
    "-x": "it looks ahead, the left side of the image up",
    "+x": "it looks ahead, the right side of the image up",
    "+z": "it looks up",
    "-z": "it looks down",
}

_AHEAD: Final = {"+z": (1.0, 0.0, 0.0), "-z": (0.0, -1.0, 0.0)}
"""What of the camera frame is to the front where it looks up or down: the words up and down of mountings; else z."""
_REACH_RAD: Final = float(np.deg2rad(14.0))
"""How far from a direction the vertical is looked for: 10 degrees of lean, and 4 by which mountings are off."""
_STEP_RAD: Final = float(np.deg2rad(1.75))
_SCATTER_RAD: Final = float(np.deg2rad(0.8))
"""By how much the edges of vertical things miss the vertical, with half a step of the grid."""
_EVEN_RAD: Final = float(np.deg2rad(3.0))
"""As of the method "segments": the scatter at which a segment is as likely vertical as not."""
_LENGTH_RAD: Final = 0.2
_LONGEST: Final = 120
"""Straight edges of an image that are looked at."""
_BANDS: Final = 8
"""Four above the horizon: ceiling, lamps, windows, doors. Twelve tell no more."""
_FEW: Final = 20
"""Sampled pixels, of 2000, below which a band's lightness is drawn to the mean, and its spread not told."""
_VARIES: Final = 1.0
"""Grey levels by which a view varies at least, for one that does not."""
_WEIGHTS: Final = np.array([
    4.897, -0.3919, 1.937, -3.579, -2.262, 4.982, 0.9539, -2.97, -2.172, -2.282,
    -0.003112, -0.4236, -0.7259, -1.435, 2.215, 0.05672, 0.7524, 1.387,
    -1.946, 0.7086, 0.2233, 0.05972, 0.08465, -0.9837, -0.258, -3.007,
])  # fmt: skip
"""Logarithm of the odds for each unit of a feature of one image: a conditional logit on views of half of the panoramas
of `tiltvp measure trust`, by `tiltvp.lab.evaluation.setups`."""
_SHARED: Final = 0.5
"""Images of one place err together: the logarithm of the odds of N images is that of N to this power of them. Of sets
of five of one building, cross-validated by building, 97 % believe the right direction and each wrong one 6 %; 0.2 tells
such sets best (98, 11 %), but the headings of a drive add more."""
BELIEVABLE: Final = 0.05


@dataclass(frozen=True)
class SetupCheck:
    """Which of the camera's six directions is up, and whether its lens is as told. True if mounting and calibration are
    believable.

    `given` is the direction of `DIRECTIONS` that is nearest to up by the mounting that was given, `best` the most
    probable by the images, `probabilities` those of all six, `images` how many were looked at, `lens` what the
    straightness of edges says of the calibration, and `reason` says all this in a sentence or two.
    """

    given: str
    best: str
    probabilities: dict[str, float]
    images: int
    lens: LensCheck

    @property
    def believable(self) -> bool:
        """Whether the direction that was given has a probability of at least 0.05."""
        return self.probabilities[self.given] >= BELIEVABLE

    @property
    def reason(self) -> str:
        """What was found; of the lens only if it is not believable."""
        return self.direction_reason if self.lens else f"{self.direction_reason}; {self.lens.reason}"

    @property
    def direction_reason(self) -> str:
        """Which direction is up, in a sentence."""
        shares = self.probabilities
        what = f"{_WORDS[self.best]}; probability {shares[self.best]:.2f}"
        told = f"{self.images} images: up is the camera's {self.best} ({what})"
        if self.best == self.given:
            return f"{told}, as the mounting says"
        return (
            f"{told}, where the mounting says {self.given} ({_WORDS[self.given]}; probability {shares[self.given]:.2f})"
        )

    def __bool__(self) -> bool:
        return self.believable and bool(self.lens)


def check_setup(
    images: Iterable[ArrayLike],
    camera: Camera,
    robot_from_camera: ArrayLike | None = None,
    *,
    mask: ArrayLike | None = None,
) -> SetupCheck:
    """Which of the camera's six directions is up in some images, and whether mounting and calibration are believable.

    Five images from different places, or with different headings, are enough. `robot_from_camera` is (3, 3), by default
    the identity; `mask` (H, W) bool is True where images show the world. `check_lens` looks at the lens. A turn of the
    camera about the vertical, and an image that is mirrored, cannot be told from images alone. Raises
    `InvalidInputError` for no images and for images of another size than the camera's.
    """
    rotation = np.eye(3) if robot_from_camera is None else np.asarray(robot_from_camera, dtype=np.float64)
    if rotation.shape != (3, 3):
        raise InvalidInputError(f"robot_from_camera: shape {rotation.shape}, expected (3, 3)")
    grays = [gray_from(image, f"images[{number}]") for number, image in enumerate(images)]
    lens = check_lens(grays, camera, mask=mask)
    seen = setup_features(grays, camera, mask=mask)
    shares = {name: float(share) for name, share in zip(DIRECTIONS, shares_of(seen), strict=True)}
    up = rotation.T @ np.array([0.0, 0.0, 1.0])
    given = max(DIRECTIONS, key=lambda name: float(np.dot(up, DIRECTIONS[name])))
    return SetupCheck(given, max(shares, key=lambda name: shares[name]), shares, len(seen), lens)


def mounting_looking(direction: str) -> Matrix:
    """(3, 3): the mounting with that direction of `DIRECTIONS` up, looking ahead, or with the image's right or top side
    to the front where it looks up or down."""
    up, ahead = np.array(DIRECTIONS[direction]), np.array(_AHEAD.get(direction, (0.0, 0.0, 1.0)))
    return np.array([ahead, np.cross(up, ahead), up])


def shares_of(features: Matrix, weights: Matrix | None = None) -> Matrix:
    """(6,): probabilities of the six directions by the features (N, 6, F) of images."""
    log_odds = features.sum(axis=0) @ (_WEIGHTS if weights is None else weights) * len(features) ** (_SHARED - 1.0)
    odds = np.exp(log_odds - log_odds.max())
    return np.asarray(odds / odds.sum())


def setup_features(images: Iterable[ArrayLike], camera: Camera, *, mask: ArrayLike | None = None) -> Matrix:
    """(N, 6, F): what tells of each image how likely each of the six directions is up."""
    detector = SegmentDetector(camera, mask=None if mask is None else np.asarray(mask, dtype=bool))
    places, bearings = _sample_of(camera)
    rows = []
    for image in images:
        gray = gray_from(image)
        edges = detector(gray)
        levels = gray[places[:, 1], places[:, 0]].astype(np.float64)
        axes = [_axis_features(edges, axis) for axis in np.eye(3)]
        rows.append([_signed(edges, axes, np.array(direction), levels, bearings) for direction in DIRECTIONS.values()])
    return np.array(rows)


def _sample_of(camera: Camera) -> tuple[NDArray[np.int64], Matrix]:
    """Pixels (N, 2) that have bearings (N, 3), one in so many that about 2000 are left."""
    step = max(1, int(np.sqrt(camera.width * camera.height / 2000.0)))
    v, u = np.mgrid[step // 2 : camera.height : step, step // 2 : camera.width : step]
    places = np.column_stack([u.ravel(), v.ravel()])
    bearings = camera.unproject(places.astype(np.float64))
    held = np.isfinite(bearings).all(axis=1)
    return places[held], bearings[held]


def _cap() -> Matrix:
    """(K, 2): offsets across an axis, a grid of steps within the reach."""
    n = int(_REACH_RAD / _STEP_RAD)
    i, k = np.mgrid[-n : n + 1, -n : n + 1]
    grid = np.column_stack([i.ravel(), k.ravel()]) * _STEP_RAD
    return np.asarray(np.sin(grid[np.hypot(grid[:, 0], grid[:, 1]) <= _REACH_RAD]))


def _axis_features(edges: Segments, axis: Matrix) -> tuple[Matrix, Matrix, float]:
    """The most likely vertical near an axis, how likely each edge is vertical, and the sum of the log odds."""
    normal, middle, length = edges.normal[:_LONGEST], edges.middle[:_LONGEST], edges.length_rad[:_LONGEST]
    if not len(normal):
        return axis, np.zeros(0), 0.0
    basis = np.eye(3)[axis == 0.0]
    cap = _cap()
    ups = cap @ basis + np.sqrt(1.0 - np.sum(cap**2, axis=1))[:, None] * axis
    variance = _SCATTER_RAD**2 + edges.variances_rad2[:_LONGEST].max(axis=1)
    chance = np.sqrt(np.maximum(1.0 - (middle @ axis) ** 2, 1e-3))
    odds = _EVEN_RAD * chance / np.sqrt(variance) * np.exp(-0.5 * (ups @ normal.T) ** 2 / variance)
    weight = np.sqrt(length / _LENGTH_RAD)
    score = np.log1p(odds) @ weight
    best = int(np.argmax(score))
    shares = odds[best] / (1.0 + odds[best])
    return ups[best], shares, float(score[best])


def _signed(
    edges: Segments, axes: list[tuple[Matrix, Matrix, float]], direction: Matrix, levels: Matrix, bearings: Matrix
) -> list[float]:
    """What tells whether a direction is up, of one image."""
    own = int(np.argmax(np.abs(direction)))
    up, vertical, score = axes[own]
    up = up if up @ direction > 0.0 else -up
    normal, middle, length = edges.normal[:_LONGEST], edges.middle[:_LONGEST], edges.length_rad[:_LONGEST]
    weight = np.sqrt(length / _LENGTH_RAD)
    level = 1.0 - vertical
    total = float(weight.sum()) + 1.0
    height = middle @ up
    brighter = normal @ up
    elevation = bearings @ up
    centre = float(elevation.mean())
    short = length < np.median(length) if len(length) else np.zeros(0, dtype=bool)
    across = middle[vertical > 0.5] @ np.eye(3)[direction == 0.0].T
    sectors = np.unique(np.floor(np.arctan2(across[:, 1], across[:, 0]) * 6.0 / np.pi))
    return [
        score / total,
        float(weight @ vertical) / total,
        np.log1p(len(sectors)),
        float(weight @ (vertical * np.abs(height))) / (1.0 + float(weight @ vertical)),
        float(weight @ (level * brighter)) / total,
        float(weight @ (level * height)) / total,
        float(np.max(length * vertical, initial=0.0)),
        float(height[short].mean()) - centre if short.any() else 0.0,
        float(height.mean()) - centre if len(height) else 0.0,
        float((vertical @ height) / (1.0 + vertical.sum())),
        *_bands(elevation, levels),
    ]


def _bands(elevation: Matrix, levels: Matrix) -> list[float]:
    """How light the view is in bands of equal solid angle, from the lowest up, and by how much it varies there."""
    levels = (levels - levels.mean()) / max(float(levels.std()), _VARIES)
    band = np.minimum(((elevation + 1.0) * (0.5 * _BANDS)).astype(np.int64), _BANDS - 1)
    seen = np.bincount(band, minlength=_BANDS)
    sums, squares = (np.bincount(band, weights=values, minlength=_BANDS) for values in (levels, levels**2))
    mean = sums / np.maximum(seen, 1)
    spread = np.sqrt(np.maximum(squares / np.maximum(seen, 1) - mean**2, 0.0))
    return [*(sums / (seen + _FEW)), *np.where(seen > _FEW, spread, 0.0)]
