"""Which method `tiltvp corner` looks with, and what to try where it finds nothing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final

from tiltvp._core import CORNER_METHODS, option_fields
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp.corner import CornerEstimate, CornerPoseEstimator

AUTO: Final = "auto"
_IN_TURN: Final = ("coloured", "general")
"""What auto tries: the cuboid takes a fortieth of the time of straight edges, and nothing else looks like it."""

SCALES: Final = frozenset(("camera_height_m", "edge_length_m", "box_size_m"))
"""Options of which each tells one camera its place."""

_LOOKED_FOR: Final = {
    "coloured": "the coloured cuboid",
    "general": "corners of straight edges",
    "paper": "the coloured cuboid, as published",
}


class Searches:
    """The estimators of one method or more, in their order: the first that has a pose goes on alone."""

    def __init__(self, estimators: Mapping[str, CornerPoseEstimator]) -> None:
        self._estimators = dict(estimators)
        self._chosen: str | None = next(iter(estimators)) if len(estimators) == 1 else None
        self.found: Counter[str] = Counter()
        self.without: Counter[str] = Counter()
        self.placeless: Counter[str] = Counter()
        """Why poses have no place."""

    @property
    def methods(self) -> tuple[str, ...]:
        """The methods that are tried."""
        return tuple(self._estimators)

    def reset(self) -> None:
        """Forgets what was seen and, of several methods, which one it is."""
        for estimator in self._estimators.values():
            estimator.reset()
        if len(self._estimators) > 1:
            self._chosen = None

    def __call__(self, *images: NDArray[np.uint8], **known: Any) -> CornerEstimate:
        """The first pose that a method has, or the last one's reason for none; `known` is what a sensor tells.

        Grey images are not for colours: of several methods these are passed over, and the one that goes on alone
        raises `InvalidInputError`.
        """
        for method, estimator in self._estimators.items():
            if self._chosen not in (None, method):
                continue
            if self._chosen is None and method != "general" and any(image.ndim == 2 for image in images):
                continue
            estimate = estimator(*images, **known)
            if estimate:
                self._chosen = method
                self.found[method] += 1
                if estimate.place_reason:
                    self.placeless[estimate.place_reason] += 1
                return estimate
        self.without[estimate.reason] += 1
        return estimate


def methods_for(method: str, options: Mapping[str, Any]) -> tuple[str, ...]:
    """The methods that are tried, of those that take all `options` (keywords of the library).

    Raises `InvalidInputError` for a method that there is not, and for options that do not go together.
    """
    known = (AUTO, *CORNER_METHODS)
    if method not in known:
        raise InvalidInputError(f"--method {method!r}, expected {', '.join(known[:-1])} or {known[-1]}")
    shared = {field["name"] for field in option_fields("CornerPoseEstimator")}
    own = {name: _options_of(name) for name in CORNER_METHODS}
    lone = [option for option in options if option not in shared]
    candidates = _IN_TURN if method == AUTO else (method,)
    if method == AUTO and options.get("known_edge", "y") != "y":
        # Only its colours name level edges.
        candidates = ("coloured",)
    fitting = tuple(name for name in candidates if own[name].issuperset(lone))
    if not fitting:
        whose = [f"{_flag(o)} (of {' and '.join(m for m in own if o in own[m])})" for o in lone]
        wanted = "options of one method" if method == AUTO else f"options of {method}"
        raise InvalidInputError(f"--method {method} with {', '.join(whose)}: expected {wanted}")
    return fitting


def _options_of(method: str) -> set[str]:
    return {field["name"] for field in option_fields("CornerDetector", method)} | (
        {"mask"} if method == "general" else set()
    )


def _flag(option: str) -> str:
    return "--" + "-".join("deg" if part == "rad" else part for part in option.split("_"))


def looked_for(methods: Iterable[str]) -> str:
    """What is looked for, in words."""
    return ", else ".join(_LOOKED_FOR[method] for method in methods)


def shown(counts: Mapping[str, int]) -> str:
    """`several hypotheses and nothing to choose by (9), no corner in the left image (2)`."""
    return ", ".join(f"{what} ({count})" for what, count in Counter(counts).most_common())


def advice(reason: str, methods: tuple[str, ...], *, is_pair: bool, given: Mapping[str, Any]) -> str:
    """What to try where `reason` is why most frames have no pose."""
    if reason.startswith("no corner in the"):
        if methods == ("general",):
            tries = "a smaller --gradient-min or --segment-min-px, images in which three edges of one corner are seen"
        elif "general" in methods:
            tries = "--faces for a cuboid of other colours, a smaller --gradient-min for faint edges"
        else:
            tries = "--method general where there is no cuboid with faces in red, green and blue, --faces for its order"
        if "general" in methods and given.get("down") is not None:
            tries += ", another --pitch or --down, or a larger --vertical-max-deg where it is rough"
        return tries + (", that left and right are not exchanged" if is_pair and "right" in reason else "")
    if reason.startswith("several"):
        helps = [] if given.get("down") is not None else ["--pitch or --down, roughly"]
        helps += [] if given.get("right_handed") is not None else ["--right-handed for the outside of a box"]
        helps += [] if is_pair else ["a second camera"]
        return ", ".join(helps) or "a smaller --down-sigma-deg if the direction down is known well"
    if "gravity" in reason:
        return "--camera-from-imu from the sensor's axes to the camera's, readings of the frames' own times"
    pair = "that left and right are not exchanged, of one moment and of this calibration, in metres"
    if "calibration" in reason:
        return pair
    causes = [pair, "a larger --misfit-max"] if is_pair else []
    causes += [] if given.get("down") is None else ["another --pitch or --down"]
    return ", ".join([*causes, "--gamma for level edges at another angle"])
