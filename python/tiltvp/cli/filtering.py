"""From the tilt of each image to that of the drive: abstaining, and the filter over images in their order."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Self

from cyclopts import Group, Parameter

from tiltvp.cli.declared_options import LibraryOptions, from_library
from tiltvp.cli.options import Switch
from tiltvp.cli.results import Outcome, outcome_table
from tiltvp.cli.tables import check_plot
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from tiltvp import TiltFilter
    from tiltvp.streams import FrameMotions, Frames, Motion

_FILTER = Group("Abstaining and filtering")
_WALK: Final = "walk_rad_per_sqrt_step"
_HALF_TRACK: Final = "half_track_m"
_TURNING_RAD_S: Final = 0.1
"""By how much the tilt of a floor changes in a second where nobody knows the turns: of three degrees, at two radians a
second. Frames that tell no time may be a second apart."""


@Parameter(name="*", group=_FILTER)
@dataclass(frozen=True, kw_only=True)
@from_library({"TiltFilter": ()})
class FilterOptions(LibraryOptions):
    """What is made of the estimates together."""

    confidence_min: float | None = None
    """Least confidence: images below are marked as not accepted, not made level, and with --filter not fused."""
    filter: Switch = False
    """Fuse the images in their order, as taken one after the other on a drive: columns filtered_... and verdicts."""
    estimate_mounting: Switch = False
    """Also estimate a lean of the robot itself, which turning tells from that of the floor: printed, and in columns
    mounting_... of the table."""
    filter_plot: Path | None = None
    """Picture of the tilt over the images, estimated and filtered (.png)."""
    step_s: Annotated[float | None, Parameter(parse=False)] = None
    """Seconds that the walk of one prediction stands for, where it is that of a floor under turns that nobody knows."""

    def check(self) -> None:
        """Refuses what cannot be, before any work is done."""
        for name in ("filter_plot", *self._keywords):
            given = (value := getattr(self, name)) is not None and value is not False
            if given and name != "confidence_min" and not self.filter:
                raise InvalidInputError(f"--{name.replace('_', '-')} without --filter, expected both")
        check_plot("--filter-plot", self.filter_plot)
        if self.filter or self.confidence_min is not None:
            self.make()

    def following(self, frames: Frames, moved: FrameMotions | None, wheel_base_m: float | None) -> Self:
        """The same with the robot's wheels, where these are known, and a walk where turns are not: the tilt of a floor
        that slopes then turns with the robot."""
        from tiltvp.streams import LiveCamera

        if not self.filter:
            return self
        given, changed = self.given(), dict[str, Any]()
        if wheel_base_m is not None and _HALF_TRACK not in given:
            changed[_HALF_TRACK] = 0.5 * wheel_base_m
        if (moved is None or not moved.turns_known) and _WALK not in given:
            timed = frames.times_s is not None or isinstance(frames, LiveCamera)
            step_s = 1.0 / frames.rate_hz if timed else 1.0
            changed[_WALK.replace("rad", "deg")] = math.degrees(_TURNING_RAD_S * step_s)
            changed["step_s"] = step_s
        return replace(self, **changed)

    def make(self) -> TiltFilter:
        """The filter with the options that were given."""
        from tiltvp import TiltFilter

        return TiltFilter(**self.given())

    def accepts(self, confidence: float) -> bool:
        """Whether an image is sure enough of itself."""
        return self.confidence_min is None or confidence >= self.confidence_min

    def judge(self) -> Judge:
        """What makes something of the outcomes, which are given in the order of the frames."""
        return Judge(self, self.make() if self.filter else None)


@dataclass
class Judge:
    """Makes the verdict of each outcome."""

    options: FilterOptions
    filter: TiltFilter | None
    plotted: list[Outcome] = field(default_factory=list)
    """What was made of all, where a plot is asked for."""
    before_s: float | None = None
    """When the image of the last prediction was taken, where that is known."""

    def __call__(self, outcome: Outcome, motion: Motion | None) -> Outcome:
        """The outcome with what was made of it; `motion` is what the robot did since the last, None: nobody knows."""
        judged = self._judged(outcome, motion)
        if self.options.filter_plot is not None:
            self.plotted.append(judged)
        return judged

    def plot(self) -> None:
        """Writes the picture of all outcomes so far, where it is asked for."""
        if self.options.filter_plot is None:
            return
        from tiltvp import write_image
        from tiltvp.lab.plots.filtering import filtered_tilt
        from tiltvp.lab.plots.picture import figure_picture

        write_image(self.options.filter_plot, figure_picture(filtered_tilt(outcome_table(self.plotted, "").frame())))

    def _judged(self, outcome: Outcome, motion: Motion | None) -> Outcome:
        if self.filter is not None:
            return _filtered(outcome, motion, self.filter, self._steps(outcome) if motion is not None else 0)
        if self.options.confidence_min is not None:
            return self._marked(outcome, self.options.confidence_min)
        return outcome

    def _steps(self, outcome: Outcome) -> int:
        """How many predictions stand for the time since the last image, if turns are not known: the tilt walks by as
        much as it is long, the variances of predictions add up. No more than make it as unknown as it was at first."""
        step_s, before_s, now_s = self.options.step_s, self.before_s, outcome.taken_s
        self.before_s = now_s
        if self.filter is None or step_s is None or before_s is None or now_s is None:
            return 1
        options = self.filter.options
        most = float(options["prior_rad"] / options[_WALK]) ** 2
        return max(1, round(min(most, ((now_s - before_s) / step_s) ** 2)))

    def _marked(self, outcome: Outcome, least: float) -> Outcome:
        e = outcome.estimate
        if e is None:
            return replace(outcome, accepted=False, verdict="no-image", verdict_reason=outcome.error)
        if not e:
            return replace(outcome, accepted=False, verdict="no-tilt", verdict_reason=e.reason)
        words = f"confidence {e.confidence:.3f}, at least {least:.3f} expected"
        if e.confidence >= least:
            return replace(outcome, accepted=True, verdict="accepted", verdict_reason=words)
        return replace(outcome, accepted=False, verdict="low-confidence", verdict_reason=words)


def _filtered(outcome: Outcome, motion: Motion | None, filter_: TiltFilter, steps: int) -> Outcome:
    if motion is None:
        words = "the odometry does not tell of its time"
        told = replace(outcome, accepted=False, verdict="no-odometry", verdict_reason=words, mounting=filter_.mounting)
        # Of a place that nobody knows as much is known as at first.
        return replace(told, filtered=type(filter_)(**filter_.options).estimate)
    filter_.predict(motion.yaw_rad, motion.distance_m)
    for _ in range(steps - 1):
        filter_.predict()
    if outcome.estimate is None:
        told = replace(outcome, accepted=False, verdict="no-image", verdict_reason=outcome.error)
    else:
        step = filter_.update(outcome.estimate)
        told = replace(outcome, accepted=step.accepted, verdict=step.verdict, verdict_reason=step.reason, nis=step.nis)
    return replace(told, filtered=filter_.estimate, mounting=filter_.mounting)
