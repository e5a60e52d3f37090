"""Lines followed through the images of a drive, and their bearings as a log that self-calibration takes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp._core import MOST_LANDMARKS, LineTracker
from tiltvp.arguments import each_from, number_from, refuse_single, refuse_uncallable, refuse_unless
from tiltvp.errors import InvalidInputError, TiltvpError, UnknownLeanError
from tiltvp.images import gray_from
from tiltvp.lines import LineExtractor
from tiltvp.selfcalib import wheel_displacements

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp._core import TiltEstimate
    from tiltvp.lines import Lines, TrackedLines
    from tiltvp.streams.odometry import Motion
    from tiltvp.tilt import TiltEstimator

__all__ = [
    "FollowedFrame",
    "SeenFrame",
    "bearing_log",
    "believed_leans",
    "displacements",
    "follow_lines",
    "see_lines",
]

_TRACKS: Final = 150
"""Tracks of a log, or as many as there are frames where these are more: those that are seen longest. A step of the
whole log takes time by the cube of their number, and the others say little: with the 120 longest of 203 a rendered
office gave an answer as near to the truth, with all 720 of a living room it took minutes."""


@dataclass(frozen=True, eq=False)
class FollowedFrame:
    """An image of a drive and the lines in it."""

    number: int
    """Of the frame in the drive, from 0; frames that cannot be used count."""
    gray: NDArray[np.uint8]
    """(H, W)."""
    tracked: TrackedLines
    """The lines and whose they are."""


@dataclass(frozen=True, eq=False)
class SeenFrame:
    """An image of a drive, the lines in it, and what the robot did since the image before that could be used."""

    number: int
    """As of a `FollowedFrame`."""
    gray: NDArray[np.uint8]
    """(H, W)."""
    lines: Lines
    """What is to be followed."""
    descriptors: NDArray[np.float32]
    """(N, D): of each line."""
    turn_rad: float | None
    """None where the motion is not known."""
    distance_m: float | None
    """None where it is not known, or motions tell turns only."""

    def followed(self, tracker: LineTracker) -> FollowedFrame:
        """The lines as `tracker` has them, which has seen the frames before."""
        refuse_unless(tracker, LineTracker, "tracker", "a LineTracker")
        tracked = tracker.update(self.lines, self.descriptors, yaw_change_rad=self.turn_rad, distance_m=self.distance_m)
        return FollowedFrame(self.number, self.gray, tracked)


def believed_leans(
    estimator: TiltEstimator, extractor: LineExtractor, *, confidence_min: float = 0.5
) -> Callable[[NDArray[np.uint8]], TiltEstimate]:
    """What tells the lean of a grey image (H, W) for its lines; raises `UnknownLeanError` where it is not believed."""
    refuse_uncallable(estimator, "estimator", "a TiltEstimator")
    refuse_unless(extractor, LineExtractor, "extractor", "a LineExtractor")

    def lean(gray: NDArray[np.uint8]) -> TiltEstimate:
        estimate = estimator(gray)
        if not extractor.believes(gray, estimate, confidence_min=confidence_min):
            doubt = f"confidence {estimate.confidence:.2f}, or lines that speak against it"
            raise UnknownLeanError(f"lean not known: {doubt if estimate else estimate.reason}")
        return estimate

    return lean


def see_lines(
    images: Iterable[NDArray[np.uint8] | TiltvpError],
    extractor: LineExtractor,
    *,
    tilt: Callable[[NDArray[np.uint8]], TiltEstimate | ArrayLike | None] = lambda _: None,
    motions: Sequence[Motion] | None = None,
) -> Iterator[SeenFrame | TiltvpError]:
    """For each image, grey or BGR, its lines with their descriptors, or what is wrong with it.

    `tilt` tells the lean of a grey image (None: upright), or raises that it is not known; `motions`, one for each
    image, what the robot did since the one before. The motion of a frame that cannot be used is added to that of the
    next. Raises `InvalidInputError` if there are more images than motions.
    """
    refuse_single(images, "images", "several images")
    refuse_unless(extractor, LineExtractor, "extractor", "a LineExtractor")
    refuse_uncallable(tilt, "tilt", "what tells the lean of an image")
    # Motions without any distance tell turns only.
    if motions is not None:
        motions = each_from(motions, "motions", "yaw_rad", "Motion")
    drives = motions is not None and any(motion.distance_m for motion in motions)
    turn_rad, distance_m = 0.0, 0.0
    for number, image in enumerate(images):
        if motions is not None:
            if number >= len(motions):
                raise InvalidInputError(f"motions: {len(motions)}, expected one for each image")
            turn_rad += motions[number].yaw_rad
            distance_m += motions[number].distance_m
        try:
            if isinstance(image, TiltvpError):
                raise image
            gray = gray_from(image)
            lines = extractor(gray, tilt(gray))
        except TiltvpError as error:
            yield error
            continue
        turn, distance = None if motions is None else turn_rad, distance_m if drives else None
        turn_rad, distance_m = 0.0, 0.0
        # A copy is kept: drivers write one image after the other into the same memory.
        yield SeenFrame(number, gray.copy(), lines, extractor.describe(gray, lines), turn, distance)


def follow_lines(
    images: Iterable[NDArray[np.uint8] | TiltvpError],
    extractor: LineExtractor,
    tracker: LineTracker,
    *,
    tilt: Callable[[NDArray[np.uint8]], TiltEstimate | ArrayLike | None] = lambda _: None,
    motions: Sequence[Motion] | None = None,
) -> Iterator[FollowedFrame | TiltvpError]:
    """For each image its lines as `tracker` has them, or what is wrong with it; arguments are those of `see_lines`."""
    for seen in see_lines(images, extractor, tilt=tilt, motions=motions):
        yield seen if isinstance(seen, TiltvpError) else seen.followed(tracker)


def bearing_log(frames: Sequence[FollowedFrame], *, frames_min: float = 2) -> NDArray[np.float64]:
    """(M, 3): number of the frame, track, bearing in radians, of tracks seen in at least `frames_min` frames.

    Of more than 150 tracks, or than there are frames, those that are seen in most; no more than a whole log may have.
    """
    frames, frames_min = each_from(frames, "frames", "tracked", "FollowedFrame"), number_from(frames_min, "frames_min")
    rows = [
        (frame.number, track, bearing)
        for frame in frames
        for track, bearing in zip(frame.tracked.track.tolist(), frame.tracked.lines.bearing_rad.tolist(), strict=True)
    ]
    table = np.array(rows, dtype=np.float64).reshape(-1, 3)
    _, which, counts = np.unique(table[:, 1], return_inverse=True, return_counts=True)
    longest = np.argsort(-counts, kind="stable")[: min(max(_TRACKS, len(frames)), MOST_LANDMARKS)]
    return table[(counts[which] >= frames_min) & np.isin(which, longest)]


def displacements(motions: Sequence[Motion], *, wheel_base_m: float) -> NDArray[np.float64]:
    """(N, 2): how far left and right wheels rolled up to each frame: as recorded, or as distance and turn have it."""
    motions = each_from(motions, "motions", "yaw_rad", "Motion")
    derived = wheel_displacements(
        [motion.distance_m for motion in motions], [motion.yaw_rad for motion in motions], wheel_base_m=wheel_base_m
    )
    recorded = [motion.wheels_m for motion in motions]
    return np.array(
        [rolled if wheels is None else wheels for wheels, rolled in zip(recorded, derived.tolist(), strict=True)],
        dtype=np.float64,
    ).reshape(-1, 2)
