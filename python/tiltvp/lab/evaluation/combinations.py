"""What an evaluation tries: the parameters of the paper's tables 2 and 3, the other reading of Q, and our methods."""

from __future__ import annotations

import difflib
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Literal

from tiltvp._core import METHODS
from tiltvp.errors import InvalidInputError

__all__ = [
    "PAPER_METHODS",
    "PIXEL_METHODS",
    "SWEEPS",
    "TABLE_2",
    "TABLE_3",
    "Combination",
    "Group",
    "choose",
    "paper_sweep",
    "table_3_sweep",
]

Group = Literal["paper", "literal", "beyond"]

RANSAC, REJECT, CONSENSUS, _REFINED, _SEGMENTS = (
    "image-space-ransac", "image-space-reject-refit", "vector-consensus", "refined", "segments",
)  # fmt: skip

PAPER_METHODS: Final = (RANSAC, REJECT, CONSENSUS)
"""The methods of the paper, whose angles corrections are trained for."""

PIXEL_METHODS: Final = (*PAPER_METHODS, _REFINED)
"""The methods that take edge pixels, of all rows or of some. Straight edges are followed through the whole image."""

TABLE_2: Final[dict[str, tuple[float, ...]]] = {
    "gradient_min": (100.0, 150.0, 200.0, 250.0, 300.0, 600.0),
    "keep_fraction": (0.5, 0.6, 0.7, 0.8, 0.9),
    "threshold_px": (2.5, 5.0, 7.5, 10.0, 12.5, 15.0),
    "threshold_deg": (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0),
}
"""Table 2. It prints four values of Q and counts five: 0.6 is the fifth."""


@dataclass(frozen=True)
class Combination:
    """A method with options. `options` are keywords of `TiltEstimator`; what is not among them has its default.

    `group` is "paper" for table 2 with Q as the share kept, "literal" for Q as the share rejected (the text and eqs. 34
    and 35), "beyond" for what the paper does not have. `label` is the method and its parameters in words.
    """

    method: str
    label: str
    group: Group
    options: dict[str, Any] = field(default_factory=dict)

    @property
    def trainable(self) -> bool:
        """Whether its angle is one that a factor is trained for: eq. 26 (image space) and eq. 45 with a' = 1."""
        return self.method in PAPER_METHODS and self.options.get("correction") is None


def _ransac(gradient_min: float, threshold_px: float) -> Combination:
    options = {"gradient_min": gradient_min, "threshold_px": threshold_px, "correction": None}
    return Combination(RANSAC, f"image-space RANSAC, I_min {gradient_min:g}, {threshold_px:g} px", "paper", options)


def _reject(gradient_min: float, keep_fraction: float) -> Combination:
    options = {"gradient_min": gradient_min, "keep_fraction": keep_fraction, "correction": None}
    label = f"image-space reject-refit, I_min {gradient_min:g}, Q {keep_fraction:g}"
    return Combination(REJECT, label, "paper", options)


def _literal(gradient_min: float, rejected: float) -> Combination:
    options = {"gradient_min": gradient_min, "keep_fraction": round(1.0 - rejected, 6), "correction": None}
    label = f"image-space reject-refit, I_min {gradient_min:g}, Q {rejected:g} read as rejected"
    return Combination(REJECT, label, "literal", options)


def _consensus(gradient_min: float, threshold_deg: float) -> Combination:
    options = {"gradient_min": gradient_min, "threshold_rad": math.radians(threshold_deg), "correction": None}
    label = f"vector consensus, I_min {gradient_min:g}, {threshold_deg:g} deg"
    return Combination(CONSENSUS, label, "paper", options)


def _varied(combination: Combination, words: str, **options: Any) -> Combination:
    return Combination(combination.method, f"{combination.label}, {words}", "beyond", combination.options | options)


TABLE_3: Final[tuple[Combination, ...]] = (
    _ransac(150.0, 10.0),
    _reject(200.0, 0.8),
    _consensus(600.0, 5.0),
    _consensus(300.0, 2.0),
)
"""The parameters of table 3: of its third row uncorrected, of its fourth corrected."""

_BEYOND: Final[tuple[Combination, ...]] = (
    Combination(_REFINED, "refined", "beyond"),
    Combination(_SEGMENTS, "segments", "beyond"),
    *(_varied(each, "closed-form gain", correction="closed-form") for each in TABLE_3[:2]),
    *(_varied(each, "prefilter 10 deg", tilt_max_rad=math.radians(10.0)) for each in TABLE_3[2:]),
    _varied(TABLE_3[3], "tangent normals", normal="tangent"),
)


def paper_sweep() -> tuple[Combination, ...]:
    """The 30 + 36 + 60 combinations of table 2, the literal reading of Q where it differs, and what goes beyond."""
    values = TABLE_2
    return (
        *itertools.starmap(_reject, itertools.product(values["gradient_min"], values["keep_fraction"])),
        *itertools.starmap(_ransac, itertools.product(values["gradient_min"], values["threshold_px"])),
        *itertools.starmap(_consensus, itertools.product(values["gradient_min"], values["threshold_deg"])),
        *itertools.starmap(_literal, itertools.product(values["gradient_min"], values["keep_fraction"][1:])),
        *_BEYOND,
    )


def table_3_sweep() -> tuple[Combination, ...]:
    """The parameters of table 3, its Q read literally, and what goes beyond."""
    return (*TABLE_3, _literal(200.0, 0.8), *_BEYOND)


SWEEPS: Final[dict[str, Callable[[], tuple[Combination, ...]]]] = {"paper": paper_sweep, "table3": table_3_sweep}
"""The sweeps by name."""


def choose(sweep: str, methods: Iterable[str] | None = None) -> tuple[Combination, ...]:
    """The combinations of a sweep, of these methods only. Raises `InvalidInputError` for names that do not exist."""
    chosen = SWEEPS[_known(sweep, tuple(SWEEPS), "sweep")]()
    if methods is None:
        return chosen
    wanted = {_known(method, METHODS, "method") for method in methods}
    return tuple(each for each in chosen if each.method in wanted)


def _known(word: str, names: Sequence[str], what: str) -> str:
    if word in names:
        return word
    near = difflib.get_close_matches(word, names, 1, 0.3)
    meant = f" (did you mean {near[0]}?)" if near else ""
    raise InvalidInputError(f"{what} {word!r}{meant}, expected one of {', '.join(names)}")
