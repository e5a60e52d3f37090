"""Whether a camera is and sits as it is said to, as a few images tell: which of six directions is up, and the lens."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.errors import counted
from tiltvp.images import grays_from
from tiltvp.lens_check import LensCheck, check_lens
from tiltvp.rotations import mounting_from
from tiltvp.setup_features import DIRECTIONS, EDGE_FEATURES, ImageFeatures
from tiltvp.setup_weights import BIASES, HIDDEN, MEANS, OUT, SCALES

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import Camera

    Matrix = NDArray[np.float64]

__all__ = [
    "BELIEVABLE", "DIRECTIONS", "SURE", "SetupCheck", "check_setup", "mounting_looking", "nearest_direction",
    "opposite_direction",
]  # fmt: skip

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
_FARTHEST: Final = 4.0
"""Standard deviations beyond which a feature tells no more."""
_ALONE: Final = 0.8
_TOGETHER: Final = 1.2
"""By how much the mean log odds of images count: of one alone, and of several of one place. These err together, so
that five tell as much as 24. Of sets of five of buildings that trained nothing 1.6 % are sure of a wrong direction, and
59 % are not sure."""
BELIEVABLE: Final = 0.05
SURE: Final = 0.9
"""Least probability of a direction that is taken for up."""


@dataclass(frozen=True)
class SetupCheck:
    """Which of the camera's six directions is up, and whether its lens is as told. True if mounting and calibration are
    believable.

    `given` is the direction of `DIRECTIONS` that is nearest to up by the mounting that was given, `best` the most
    probable by the images, `probabilities` those of all six, `images` how many were looked at, `lens` what the
    straightness of edges says of the calibration, and `reason` says all this in a sentence or two. `turns_about` is the
    direction about which images turn to the left where the odometry says so; None where nothing tells.
    """

    given: str
    best: str
    probabilities: dict[str, float]
    images: int
    lens: LensCheck
    turns_about: str | None = None

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
        if len(set(shares.values())) == 1:
            return f"{counted(self.images, 'images')} without straight edges, which do not tell which direction is up"
        turns = f" that turn about the camera's {self.turns_about}" if self.turns_about else ""
        told = f"{counted(self.images, 'images')}{turns}: up is the camera's {self.best} ({self._words(self.best)})"
        if self.best != self.given:
            told += f", where the mounting says {self.given} ({self._words(self.given)})"
        else:
            told += ", as the mounting says"
        if self.turns_about is None:
            return told
        reversed_ = opposite_direction(self.turns_about)
        if shares[reversed_] < BELIEVABLE:
            return told
        also = "if" if self.best == reversed_ else f"or {reversed_} ({self._words(reversed_)}) if"
        return f"{told}; {also} the image is mirrored, or left and right of the odometry are swapped"

    def _words(self, direction: str) -> str:
        return f"{_WORDS[direction]}; probability {self.probabilities[direction]:.2f}"

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

    Five images from different places, or with different headings, are enough; one without straight edges tells nothing
    of a direction. `robot_from_camera` is (3, 3), by default
    the identity; `mask` (H, W) bool is True where images show the world. `check_lens` looks at the lens. A turn of the
    camera about the vertical, and an image that is mirrored, cannot be told from images alone. Raises
    `InvalidInputError` for no images, for images and masks of another size than the camera's, for masks of another type
    than bool, and for a matrix that is no rotation.
    """
    rotation = np.eye(3) if robot_from_camera is None else mounting_from(robot_from_camera)
    grays = grays_from(images)
    lens = check_lens(grays, camera, mask=mask)
    features = ImageFeatures(camera, mask=mask)
    seen = np.array([features(gray) for gray in grays])
    shares = {name: float(share) for name, share in zip(DIRECTIONS, shares_of(seen), strict=True)}
    up = rotation.T @ np.array([0.0, 0.0, 1.0])
    given = nearest_direction(up)
    best = max(shares, key=lambda name: (shares[name], name == given))
    return SetupCheck(given, best, shares, len(seen), lens)


def nearest_direction(ray: Matrix) -> str:
    """The name in `DIRECTIONS` of the direction that is nearest to a ray (3,) of the camera frame."""
    return max(DIRECTIONS, key=lambda name: float(np.dot(ray, DIRECTIONS[name])))


def opposite_direction(name: str) -> str:
    """The name of the opposite direction."""
    return name.translate(str.maketrans("+-", "-+"))


def mounting_looking(direction: str) -> Matrix:
    """(3, 3): the mounting with that direction of `DIRECTIONS` up, looking ahead, or with the image's right or top side
    to the front where it looks up or down."""
    up, ahead = np.array(DIRECTIONS[direction]), np.array(_AHEAD.get(direction, (0.0, 0.0, 1.0)))
    return np.array([ahead, np.cross(up, ahead), up])


def log_odds(features: Matrix) -> Matrix:
    """(6,): of the features (6, F) of an image; all alike for one without straight edges, which tells nothing."""
    if not features[:, :EDGE_FEATURES].any():
        return np.zeros(len(features))
    scaled = np.clip((features - MEANS) / SCALES, -_FARTHEST, _FARTHEST)
    return np.asarray(np.tanh(scaled @ HIDDEN.T + BIASES) @ OUT)


def shares_of(features: Matrix, scored: Callable[[Matrix], Matrix] = log_odds) -> Matrix:
    """(6,): probabilities of the six directions by the features (N, 6, F) of images of one place."""
    mean = np.mean([scored(each) for each in features], axis=0)
    together = mean * min(_ALONE * len(features) ** 0.25, _TOGETHER)
    odds = np.exp(together - together.max())
    return np.asarray(odds / odds.sum())
