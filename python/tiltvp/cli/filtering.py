"""From the tilt of each image to that of the drive: abstaining, and the filter over images in their order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import Group, Parameter

from tiltvp.cli.declared_options import LibraryOptions, from_library
from tiltvp.cli.options import Switch
from tiltvp.cli.results import Outcome
from tiltvp.cli.tables import check_plot
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from tiltvp import TiltFilter
    from tiltvp.odometry import Motion

_FILTER = Group("Abstaining and filtering")


@Parameter(name="*", group=_FILTER)
@dataclass(frozen=True, kw_only=True)
@from_library({"TiltFilter": ()})
class FilterOptions(LibraryOptions):
    """What is made of the estimates together."""

    confidence_min: float | None = None
    """Least confidence: images below are marked as not accepted, not made level, and with --filter not fused."""
    filter: Switch = False
    """Fuse the images in their order, as taken one after the other on a drive: columns filtered_... and verdicts."""
    odometry: Path | None = None
    """CSV of the motion that led to each image: yaw_rad or yaw_deg, distance_m; file, or one row for each image."""
    estimate_mounting: Switch = False
    """Also estimate a lean of the robot itself, which turning tells from that of the floor: printed, and in columns
    mounting_... of the table."""
    filter_plot: Path | None = None
    """Picture of the tilt over the images, estimated and filtered (.png)."""

    def check(self) -> None:
        """Refuses what cannot be, before any work is done."""
        for name in ("odometry", "filter_plot", *self._keywords):
            given = getattr(self, name) not in (None, False)
            if given and name != "confidence_min" and not self.filter:
                raise InvalidInputError(f"--{name.replace('_', '-')} without --filter, expected both")
        check_plot("--filter-plot", self.filter_plot)
        if self.filter or self.confidence_min is not None:
            self.make()

    def make(self) -> TiltFilter:
        """The filter with the options that were given."""
        from tiltvp import TiltFilter

        return TiltFilter(**self.given())

    def motions(self, files: Sequence[Path]) -> list[Motion]:
        """What the robot did between the images; nothing that is known without odometry."""
        from tiltvp.odometry import Motion, read_odometry

        return [Motion()] * len(files) if self.odometry is None else read_odometry(self.odometry, files)

    def accepts(self, confidence: float) -> bool:
        """Whether an image is sure enough of itself."""
        return self.confidence_min is None or confidence >= self.confidence_min

    def judged(self, outcomes: Iterable[Outcome], motions: Sequence[Motion]) -> Iterator[Outcome]:
        """The outcomes with what was made of them, as they come."""
        if self.filter:
            yield from _filtered(outcomes, motions, self.make())
        elif self.confidence_min is not None:
            yield from map(self._marked, outcomes)
        else:
            yield from outcomes

    def _marked(self, outcome: Outcome) -> Outcome:
        e = outcome.estimate
        if e is None:
            return replace(outcome, accepted=False, verdict="no-image", verdict_reason=outcome.error)
        if not e:
            return replace(outcome, accepted=False, verdict="no-tilt", verdict_reason=e.reason)
        words = f"confidence {e.confidence:.3f}, at least {self.confidence_min:.3f} expected"
        if self.accepts(e.confidence):
            return replace(outcome, accepted=True, verdict="accepted", verdict_reason=words)
        return replace(outcome, accepted=False, verdict="low-confidence", verdict_reason=words)


def _filtered(outcomes: Iterable[Outcome], motions: Sequence[Motion], filter_: TiltFilter) -> Iterator[Outcome]:
    for outcome, motion in zip(outcomes, motions, strict=True):
        filter_.predict(motion.yaw_rad, motion.distance_m)
        if outcome.estimate is None:
            told = replace(outcome, accepted=False, verdict="no-image", verdict_reason=outcome.error)
        else:
            step = filter_.update(outcome.estimate)
            told = replace(
                outcome, accepted=step.accepted, verdict=step.verdict, verdict_reason=step.reason, nis=step.nis
            )
        yield replace(told, filtered=filter_.estimate, mounting=filter_.mounting)
