"""From a recording to what is known of a robot: image circle, own body, which way is up, mounting, sense of turns."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp.arguments import each_from, refuse_unless
from tiltvp.body import BodyMask, body_mask
from tiltvp.errors import InvalidInputError, TiltvpError, counted
from tiltvp.images import checked_camera, gray_from, size_problem
from tiltvp.mounting import MountingTilt, mounting_tilt
from tiltvp.robot import Robot
from tiltvp.rotations import mounting_from
from tiltvp.setup_check import SURE, SetupCheck, check_setup, mounting_looking, opposite_direction
from tiltvp.streams.frames import Frames
from tiltvp.streams.odometry import Motion
from tiltvp.streams.wheels import Wheels
from tiltvp.surround import surround_mask
from tiltvp.tilt import TiltEstimate, TiltEstimator
from tiltvp.turn_errors import TurnError, turn_error
from tiltvp.turning import TurnCheck, made_small, small_camera, turn_axis

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tiltvp import _core
    from tiltvp.cameras import Camera
    from tiltvp.streams.frames import Frame

    Image = NDArray[np.uint8]

__all__ = ["DriveTilts", "RobotSetup", "drive_tilts", "find_setup"]

LOOKED_AT: Final = 24
"""Images, spread over the drive, by which rim, body and direction are found: see `body_mask`."""
LEAST: Final = 5
"""Images without which none of these can be told."""
_TRIES: Final = 3
"""Frames of each part that are tried: files of a folder may be anything."""
TURNED: Final = 60
"""Images, spread over the drive, that are turned back. Of twelve rendered drives one told its axis by less than 3
standard errors with 24, none by less than 4.9 with 50."""
_REVERSED: Final = 0.05
"""Share of recordings that turn the other way round, mirrored or with swapped wheels, of those new to us: a guess."""
_OTHER_AXIS: Final = 1e-3
"""Probability of another axis than that about which images turn by three standard errors."""
MEASURED: Final = 200
"""Images, spread over the drive, whose tilts tell the mounting. Of rendered drives 60 leave 0.02 degrees."""
TILT_OPTIONS: Final[dict[str, Any]] = {"method": "segments", "tilt_max_rad": math.radians(20.0)}
"""Leans of the mounting and of the floor: farther away another axis may be taken for up."""


@dataclass(frozen=True, eq=False)
class DriveTilts:
    """The tilts of images spread over a drive, and what the robot did from each to the next."""

    estimates: list[TiltEstimate | None]
    motions: list[Motion | None]
    """None where the odometry does not tell."""
    problems: dict[str, TiltvpError]
    """What is wrong with those images that could not be used, by their names."""


@dataclass(frozen=True, eq=False)
class RobotSetup:
    """What a recording tells of a robot with a camera. False, with reasons, where it cannot be relied upon."""

    robot: Robot
    """What was found, to be saved."""
    given_robot_from_camera: NDArray[np.float64]
    """(3, 3): the mounting that was given, or that of the direction that is up, before roll and pitch."""
    direction: SetupCheck
    """Which way is up, and whether the lens is as told."""
    rim: bool | None
    """Whether a dark surround was found that the calibration does not know; None where a mask was given."""
    body: BodyMask
    """The robot's own body in view."""
    turns: TurnCheck | None
    """Which way round images turn by the odometry; None without odometry."""
    turn_error: TurnError | None
    """How far their turns are off what it says; None without odometry."""
    mounting: MountingTilt
    """Roll and pitch of the mounting."""
    problems: dict[str, TiltvpError]
    """What is wrong with images that were measured and could not be used, by their names."""

    @property
    def sure_of_direction(self) -> bool:
        """Whether the direction that is up is that of the mounting, with a probability of at least 0.9."""
        given, best = self.direction.given, self.direction.best
        return best == given and self.direction.probabilities[best] >= SURE

    @property
    def turns_reason(self) -> str:
        """How images turn by the odometry, in a sentence; empty without odometry."""
        if self.turns is None or self.turn_error is None:
            return ""
        return self.turns.reason if self.turns.reversed or self._turns_fit else self.turn_error.reason

    @property
    def _turns_fit(self) -> bool:
        """Whether images turn by as much as the odometry says, as far as is known: about another axis none do."""
        return not self.sure_of_direction or self.turn_error is None or bool(self.turn_error)

    @property
    def reasons(self) -> list[str]:
        """What keeps it from being used, a sentence each."""
        found = [] if self.sure_of_direction else [f"which way is up is not sure: {self.direction.direction_reason}"]
        if not self.direction.lens:
            found.append(self.direction.lens.reason)
        if self.turns is not None and (self.turns.reversed or not self._turns_fit):
            found.append(self.turns_reason)
        return found if self.mounting else [*found, self.mounting.reason]

    def again(self, robot: Robot) -> Robot:
        """That robot, whose mounting was given, with what was found anew; all else is kept.

        Its place and yaw have the errors that they had, independent of those of roll and pitch (see
        `tiltvp.Extrinsics`). Where nothing tells roll and pitch they stay as they were.
        """
        covariance, lean = robot.covariance, robot.covariance_rad2
        if self.mounting:
            lean = self.robot.covariance_rad2
            if covariance is not None:
                covariance = np.array(covariance)
                covariance[2:4] = covariance[:, 2:4] = 0.0
                covariance[2:4, 2:4] = lean
        return replace(
            self.robot, covariance=covariance, covariance_rad2=lean, place_m=robot.place_m, height_m=robot.height_m,
            topics=robot.topics | self.robot.topics,
        )  # fmt: skip

    def __bool__(self) -> bool:
        return not self.reasons


def find_setup(
    frames: Frames,
    camera: Camera,
    motions: Sequence[Motion | None] | None = None,
    *,
    robot_from_camera: ArrayLike | None = None,
    mask: NDArray[np.bool_] | None = None,
    level_floor: bool = False,
    wheels: Wheels | None = None,
    topics: dict[str, str] | None = None,
    advance: Callable[[], None] = lambda: None,
) -> RobotSetup:
    """Looks at a recording: finds the image circle, the robot's own body, which way is up, and the mounting.

    `frames` are those of `tiltvp.streams.open_frames`; `motions` say of each what the robot did since the one before,
    None where nobody knows, and none of them without odometry. Where `robot_from_camera` (3, 3) is not given, the
    direction that is up is found; its turn about the vertical is left as of a camera that looks along the robot.
    `mask` (H, W) bool is True where images show the world; without it rim and body are looked for. `level_floor` is as
    for `mounting_tilt`. `advance` is called after each image. Raises `InvalidInputError` for frames that come only
    once, for as many motions as there are not frames, and for fewer than 5 images of the camera's size.
    """
    checked_camera(camera)
    _count_of(frames, motions)
    wheels, topics = Wheels() if wheels is None else wheels, {} if topics is None else topics
    refuse_unless(wheels, Wheels, "wheels", "tiltvp.streams.Wheels")
    refuse_unless(topics, dict, "topics", "a dict")
    _refuse_few(frames, camera)
    rim, body = None, BodyMask(None, 0, "a mask was given")
    if mask is None:
        inside, body = rim_and_body(frames, camera)
        rim, mask = inside is not None, joined_mask(inside, body)

    looked_at = (image for _, image in spread(frames, camera, LOOKED_AT))
    direction = check_setup(looked_at, camera, robot_from_camera, mask=mask)
    seen = None if motions is None else turning(frames, camera, motions)
    axis = None if seen is None else turn_axis(*seen, robot_from_camera)
    if axis:
        direction = _told_by_turns(direction, axis.best)
    if robot_from_camera is None:
        rotation = mounting_looking(direction.best)
        direction = replace(direction, given=direction.best)
    else:
        rotation = mounting_from(robot_from_camera)
    turns = None if axis is None else axis.check(direction.given)
    error = None if seen is None else turn_error(*seen, rotation)
    estimator = TiltEstimator(camera, **TILT_OPTIONS, robot_from_camera=rotation, mask=mask)
    tilts = drive_tilts(frames, estimator, motions, advance=advance)
    mounting = mounting_tilt(
        tilts.estimates, tilts.motions, rotation, level_floor=level_floor, half_track_m=wheels.half_track_m
    )
    robot = Robot(
        camera,
        mounting.robot_from_camera,
        covariance_rad2=mounting.covariance_rad2 if mounting else None,
        mask=mask,
        wheels=wheels,
        topics=topics,
    )
    return RobotSetup(robot, rotation, direction, rim, body, turns, error, mounting, tilts.problems)


def _refuse_few(frames: Frames, camera: Camera) -> None:
    usable = sum(1 for _ in spread(frames, camera, LOOKED_AT))
    if usable < LEAST:
        words = f"{counted(usable, 'images')} of the camera's size, expected {LEAST} or more"
        words = f"{words} of {camera.width} x {camera.height} pixels, each another than the one before"
        raise InvalidInputError(f"{frames.source}: {words}{_first_problem(frames, camera)}")


def turning(
    frames: Frames, camera: _core.Camera, motions: Sequence[Motion | None]
) -> tuple[list[Image], NDArray[np.float64], _core.Camera]:
    """Small images, spread over the drive, their headings, and their camera: what `check_turns` takes."""
    headings: NDArray[np.float64] = np.cumsum([0.0 if motion is None else motion.yaw_rad for motion in motions])
    # Nobody knows the heading of a frame of whose time the odometry does not tell.
    small = {
        number: made_small(gray_from(image), camera)
        for number, image in spread(frames, camera, TURNED)
        if motions[number] is not None
    }
    return list(small.values()), headings[list(small)], small_camera(camera)


def _told_by_turns(direction: SetupCheck, turns_about: str) -> SetupCheck:
    """Which way is up by what is seen and by the direction about which it turns to the left: that is up, or down where
    images are mirrored or left and right of the odometry are swapped."""
    turning = {turns_about: 1.0 - _REVERSED, opposite_direction(turns_about): _REVERSED}
    odds = {name: share * turning.get(name, _OTHER_AXIS) for name, share in direction.probabilities.items()}
    total = sum(odds.values())
    shares = {name: each / total for name, each in odds.items()}
    best = max(shares, key=lambda name: shares[name])
    return replace(direction, best=best, probabilities=shares, turns_about=turns_about)


def drive_tilts(
    frames: Frames,
    estimator: TiltEstimator,
    motions: Sequence[Motion | None] | None,
    *,
    advance: Callable[[], None] = lambda: None,
) -> DriveTilts:
    """The tilts of at most 200 images, spread over a drive of known length. What cannot be read, leans more than 20
    degrees, or was taken where the odometry does not tell, is None.

    Without odometry (`motions` is None) the robot is taken not to have moved, so that nothing can tell floor and
    mounting apart. Raises `InvalidInputError` where no image can be read and has the camera's size.
    """
    count = _count_of(frames, motions)
    numbers = [int(number) for number in np.linspace(0, count - 1, measured_count(frames))]
    estimates: list[TiltEstimate | None] = []
    problems = dict[str, TiltvpError]()
    for number, frame in zip(numbers, frames.sample(numbers), strict=False):
        image = _image_of(frame, estimator.camera) if motions is None or motions[number] is not None else None
        if isinstance(image, TiltvpError):
            problems[frame.name] = image
        estimate = None if image is None or isinstance(image, TiltvpError) else estimator(image)
        estimates.append(estimate if estimate else None)
        advance()
    if len(problems) == len(numbers):
        problem = _first_problem(frames, estimator.camera)
        raise InvalidInputError(f"{frames.source}: none of {counted(len(numbers), 'images')} can be used{problem}")
    return DriveTilts(estimates, _joined(motions, numbers), problems)


def _count_of(frames: Frames, motions: Sequence[Motion | None] | None) -> int:
    """How many frames there are, each with its motion. Raises `InvalidInputError`."""
    refuse_unless(frames, Frames, "frames", "what tiltvp.streams.open_frames opens")
    if frames.count is None:
        raise InvalidInputError(f"{frames.source}: comes only once, expected images, a video or a recording")
    if motions is not None:
        told = len(each_from(motions, "motions", "yaw_rad", "Motion or None", or_none=True))
        if told != frames.count:
            raise InvalidInputError(f"motions: {told}, expected {frames.count}, one for each frame")
    return frames.count


def measured_count(frames: Frames) -> int:
    """How many frames are measured."""
    return min(MEASURED, frames.count or 0)


def rim_and_body(frames: Frames, camera: _core.Camera) -> tuple[NDArray[np.bool_] | None, BodyMask]:
    """The image circle, (H, W) True within it where a dark surround shows one that the camera does not know; and the
    robot's own body.
    """
    rim = surround_mask((image for _, image in spread(frames, camera, LEAST)), camera)
    return rim, body_mask((image for _, image in spread(frames, camera, LOOKED_AT)), camera, mask=rim)


def joined_mask(rim: NDArray[np.bool_] | None, body: BodyMask) -> NDArray[np.bool_] | None:
    """(H, W), True where images show the world; None: everywhere."""
    if not body:
        return rim
    return body.mask if rim is None else rim & np.asarray(body.mask)


def spread(frames: Frames, camera: _core.Camera, parts: int) -> Iterator[tuple[int, Image]]:
    """Number and image of the first usable frame in each of so many parts of a source; none of one that comes once.

    The image of the part before, as of a frozen camera, tells nothing new, and would count as often as it is there.
    """
    count = frames.count or 0
    starts = [part * count // parts for part in range(parts + 1)]
    tried = [
        (part, number)
        for part in range(parts)
        for number in range(starts[part], min(starts[part + 1], starts[part] + _TRIES))
    ]
    coming = frames.sample([number for _, number in tried]) if tried else iter(())
    had, before = -1, None
    for (part, number), frame in zip(tried, coming, strict=False):
        if part == had or (image := _usable(frame, camera)) is None:
            continue
        if before is None or not np.array_equal(image, before):
            had, before = part, image
            yield number, image


def _usable(frame: Frame, camera: _core.Camera) -> Image | None:
    image = _image_of(frame, camera)
    return None if isinstance(image, TiltvpError) else image


def _image_of(frame: Frame, camera: _core.Camera) -> Image | TiltvpError:
    image = frame.image
    if isinstance(image, TiltvpError) or image.shape[:2] == (camera.height, camera.width):
        return image
    return InvalidInputError(f"{frame.name}: {size_problem((image.shape[1], image.shape[0]), camera)}")


def _first_problem(frames: Frames, camera: _core.Camera) -> str:
    """What is wrong with the first frame that cannot be used and is not told, to be put behind a sentence; or empty."""
    first = frames.sample(range(min(frames.count or 0, LEAST)))
    images = (_image_of(frame, camera) for frame in first if frame.name not in frames.told)
    return next((f": {image}" for image in images if isinstance(image, TiltvpError)), "")


def _joined(motions: Sequence[Motion | None] | None, numbers: Sequence[int]) -> list[Motion | None]:
    """What the robot did up to frames of these numbers since the last one that the odometry tells of."""
    if motions is None:
        return [Motion() for _ in numbers]
    joined: list[Motion | None] = []
    before = numbers[0] if numbers else 0
    for number in numbers:
        if motions[number] is None:
            joined.append(None)
            continue
        parts = [motion for motion in motions[before + 1 : number + 1] if motion is not None]
        joined.append(Motion(sum(part.yaw_rad for part in parts), sum(abs(part.distance_m) for part in parts)))
        before = number
    return joined
