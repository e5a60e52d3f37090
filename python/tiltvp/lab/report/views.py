"""Figures 10 to 14, 17, 18 and 27: example images of the run, seen through the edge pixels of the methods."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp.lab.evaluation.combinations import CONSENSUS, RANSAC, REJECT
from tiltvp.lab.plots.report.histograms import OffsetPanel, offset_panels
from tiltvp.lab.plots.report.normals import NormalPanel, normal_panels
from tiltvp.lab.plots.report.pixels import SeenEdges, consensus_pixels, pixels_and_offsets, prefiltered_pixels
from tiltvp.lab.plots.report.style import ESTIMATE_COLOUR, TRUE_COLOUR
from tiltvp.lab.plots.report.web import normal_panels_web
from tiltvp.lab.report.panel import Panel
from tiltvp.overlays.offsets import Cosine, cosine_of_tilt
from tiltvp.tilt import EdgeElements, TiltEstimate, TiltEstimator, normal_from_alpha_beta

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from tiltvp.lab.datasets.folder import TiltDataset
    from tiltvp.lab.report.choice import Chosen, Examples

__all__ = ["PARAMETERS", "Lens", "example_panels"]

_SHOWN: Final = 500
_RANSAC_COLOUR: Final = "#e69f00"

PARAMETERS: Final[dict[str, dict[str, Any]]] = {
    REJECT: {"gradient_min": 200.0, "keep_fraction": 0.8, "correction": None},
    RANSAC: {"gradient_min": 200.0, "threshold_px": 5.0, "correction": None},
    CONSENSUS: {
        "gradient_min": 200.0, "threshold_rad": math.radians(3.5), "tilt_max_rad": math.radians(7.0),
        "normal": "gradient", "correction": None,
    },
}  # fmt: skip
"""What the captions of the paper's figures 10, 12, 14, 17 and 18 say."""


@dataclass(frozen=True)
class Lens:
    """What the example figures need of a run: its dataset, the options of its methods, and the trained factor.

    By method: `options` are those in force, `best` those with which it was best, `factors_px` the factor a in pixels
    per radian with which the true tilts are drawn.
    """

    dataset: TiltDataset
    options: dict[str, dict[str, Any]]
    best: dict[str, dict[str, Any]]
    factors_px: dict[str, float]

    def gray(self, chosen: Chosen) -> NDArray[np.uint8]:
        """(H, W) uint8: an image of the dataset. Raises `ImageFileError` if it cannot be read."""
        image = next(image for image in self.dataset.images if image.file == chosen.file)
        return self.dataset.read(image)

    def edges(
        self, method: str, gray: NDArray[np.uint8], **changes: Any
    ) -> tuple[TiltEstimate, EdgeElements, dict[str, Any]]:
        """The estimate, the edge pixels and the options of a method with the captions' parameters and `changes`."""
        return self._run(method, gray, self.options.get(method, {}) | PARAMETERS[method] | changes)

    def best_edges(self, method: str, gray: NDArray[np.uint8]) -> tuple[TiltEstimate, EdgeElements, dict[str, Any]]:
        """The same with the parameters that were best."""
        return self._run(method, gray, self.best.get(method, PARAMETERS[method]) | {"correction": None})

    def _run(
        self, method: str, gray: NDArray[np.uint8], options: dict[str, Any]
    ) -> tuple[TiltEstimate, EdgeElements, dict[str, Any]]:
        mounting = {"robot_from_camera": self.dataset.robot_from_camera, "mask": self.dataset.mask}
        estimator = TiltEstimator(self.dataset.camera, method=method, **(options | mounting))
        return *estimator.with_edges(gray), estimator.options

    def true_cosine(self, chosen: Chosen, method: str = REJECT) -> Cosine:
        """The cosine predicted from the true tilt by the factor of a method."""
        normal = normal_from_alpha_beta(chosen.alpha_true_rad, chosen.beta_true_rad)
        shift = self.factors_px.get(method, math.nan) * chosen.alpha_true_rad
        rotation = self.dataset.robot_from_camera
        if chosen.alpha_true_rad == 0.0:
            return Cosine("true tilt", 0.0, 0.0, TRUE_COLOUR, dashed=True)
        return cosine_of_tilt(
            "true tilt", self.dataset.camera, normal, shift, rotation, colour=TRUE_COLOUR, dashed=True
        )

    def fitted_cosine(self, estimate: TiltEstimate, label: str = "fit", colour: str = ESTIMATE_COLOUR) -> Cosine:
        """The cosine that was fitted; NaN, and no line, without an estimate."""
        if not estimate or estimate.shift_px is None:
            return Cosine(label, math.nan, math.nan, colour)
        rotation = self.dataset.robot_from_camera
        return cosine_of_tilt(label, self.dataset.camera, estimate.normal, estimate.shift_px, rotation, colour=colour)


def example_panels(lens: Lens, examples: Examples) -> list[Panel]:
    """The figures in the order of their numbers. Raises `ImageFileError` if an image cannot be read."""
    pair = (examples.upright, examples.leaning)
    grays = [lens.gray(chosen) for chosen in pair]
    panels = [*_typical(lens, pair, grays), *_disturbed(lens, examples.by_location)]
    panels += [*_normals(lens, pair, grays), _worst(lens, examples.worst)]
    return panels


def _typical(lens: Lens, pair: Sequence[Chosen], grays: Sequence[NDArray[np.uint8]]) -> list[Panel]:
    seen, histograms = [], []
    limit = 0.0
    for letter, chosen, gray in zip("ab", pair, grays, strict=True):
        _, edges, options = lens.edges(REJECT, gray)
        limit = max(limit, _limit_px(options, edges))
        seen.append(SeenEdges(gray, edges, f"({letter}) {chosen.words}"))
        picked = edges.prefiltered
        histograms.append(
            OffsetPanel(
                f"({letter}) {chosen.words}", edges.phi_rad[picked], edges.offset_px[picked],
                (lens.true_cosine(chosen),),
            )
        )  # fmt: skip
    files = " and ".join(chosen.file for chosen in pair)
    return [
        Panel(
            "figure-10", "Figure 10",
            f"The prefiltered edge pixels F of two images of one location ({files}; the location with the median of "
            "the locations' mean errors): (a) the least tilted, (b) the one with the largest forward tilt. Hue is the "
            "gradient direction φ, full saturation an edge offset s of 0, no saturation one of "
            f"{limit:.0f} pixels, beyond which pixels are rejected. I_min = 200, at most 45° above the horizon.",
            prefiltered_pixels(seen, offset_max_px=limit),
        ),
        Panel(
            "figure-11", "Figure 11",
            "Gradient direction φ and edge offset s of the edge pixels of figure 10, as histograms: darker bins hold "
            "more pixels. The red, dashed line is the cosine predicted from the true tilt with the trained factor a "
            f"({lens.factors_px[REJECT]:.0f} pixels per radian), the thin dashed line is s = 0.",
            offset_panels(histograms, offset_max_px=limit),
        ),
    ]  # fmt: skip


def _disturbed(lens: Lens, candidates: Sequence[Chosen]) -> list[Panel]:
    chosen = max(candidates, key=lambda one: _gain_px(lens, one))
    gray = lens.gray(chosen)

    def panel(
        title: str, estimate: TiltEstimate, edges: EdgeElements, picked: NDArray[np.bool_], method: str = REJECT
    ) -> OffsetPanel:
        cosines = (lens.true_cosine(chosen, method), lens.fitted_cosine(estimate, "least-squares fit"))
        return OffsetPanel(title, edges.phi_rad[picked], edges.offset_px[picked], cosines)

    plain, everything, options = lens.edges(REJECT, gray, max_iterations=0)
    sampled, sampled_edges, _ = lens.edges(RANSAC, gray)
    early, early_edges, _ = lens.edges(REJECT, gray, max_iterations=2)
    late, late_edges, _ = lens.edges(REJECT, gray)
    limit, threshold = _limit_px(options, everything), PARAMETERS[RANSAC]["threshold_px"]
    twelve = [
        panel("(a) nothing rejected", plain, everything, everything.prefiltered),
        panel(f"(b) after RANSAC, {threshold:g} px", sampled, sampled_edges, sampled_edges.inlier, RANSAC),
    ]
    rounds = max(late.report.iterations - 1, 0)
    fourteen = [
        panel("(a) after 2 iterations", early, early_edges, early_edges.inlier),
        panel(f"(b) {'converged' if late.report.stop == 'converged' else late.report.stop}, n = {rounds}",
              late, late_edges, late_edges.inlier),
    ]  # fmt: skip
    apart = [
        _words(_apart_px(lens, chosen, estimate, method))
        for estimate, method in ((plain, REJECT), (sampled, RANSAC), (early, REJECT), (late, REJECT))
    ]
    return [
        Panel(
            "figure-12", "Figure 12",
            f"The edge pixels of figure 13 as in figure 11, with the cosine fitted by least squares (blue): (a) to all "
            f"prefiltered pixels, (b) to those that remain after RANSAC with a threshold of {threshold:g} pixels. Red, "
            f"dashed: the true tilt, by the trained factor of the method. Their vanishing points are {apart[0]} apart "
            f"in (a) and {apart[1]} in (b).",
            offset_panels(twelve, offset_max_px=limit),
        ),
        Panel(
            "figure-13", "Figure 13",
            f"Edge pixels after prefiltering, as in figure 10, of an image with many incorrect ones: {chosen.file}. Of "
            "the most forward tilts of all locations it is the one where rejecting incorrect pixels, by RANSAC as well "
            "as by rejecting and refitting, brings the least-squares fit the farthest towards the truth.",
            prefiltered_pixels([SeenEdges(gray, everything, chosen.words)], offset_max_px=limit),
        ),
        Panel(
            "figure-14", "Figure 14",
            "Rejecting and refitting on the image of figure 13: (a) the pixels that remain after two iterations, (b) "
            f"after {rounds}. The vanishing points of the fitted (blue) and the true tilt (red, dashed) are "
            f"{apart[2]} apart in (a) and {apart[3]} in (b).",
            offset_panels(fourteen, offset_max_px=limit),
        ),
    ]  # fmt: skip


def _gain_px(lens: Lens, chosen: Chosen) -> float:
    """By how much both ways of rejecting pixels bring the vanishing point nearer to the true one than no rejection."""
    gray = lens.gray(chosen)
    plain = _apart_px(lens, chosen, lens.edges(REJECT, gray, max_iterations=0)[0])
    mended = [_apart_px(lens, chosen, lens.edges(method, gray)[0], method) for method in (REJECT, RANSAC)]
    gain = plain - max(mended)
    return gain if math.isfinite(gain) else -math.inf


def _apart_px(lens: Lens, chosen: Chosen, estimate: TiltEstimate, method: str = REJECT) -> float:
    """How far apart the vanishing points of the fitted and the true cosine are."""
    true, fit = lens.true_cosine(chosen, method), lens.fitted_cosine(estimate)
    shifts = [cosine.shift_px * np.exp(1j * cosine.direction_rad) for cosine in (true, fit)]
    return float(abs(shifts[0] - shifts[1]))


def _limit_px(options: dict[str, Any], edges: EdgeElements) -> float:
    """The largest edge offset that passed the prefilter: the option, or where it follows the lens what has passed."""
    largest = options["offset_max_px"]
    if largest is None:
        largest = math.ceil(np.abs(edges.offset_px[edges.prefiltered]).max(initial=1.0))
    return float(largest)


def _words(pixels: float) -> str:
    return f"{pixels:.1f} pixels" if math.isfinite(pixels) else "an unknown distance"


def _normals(lens: Lens, pair: Sequence[Chosen], grays: Sequence[NDArray[np.uint8]]) -> list[Panel]:
    runs = [lens.edges(CONSENSUS, gray) for gray in grays]
    edges = runs[0][1]
    generator = np.random.default_rng(0)
    arrows = []
    for title, picked in (
        ("(a) all edge pixels", np.ones(len(edges), dtype=bool)),
        ("(b) after prefilter and RANSAC", edges.inlier),
    ):
        places = np.flatnonzero(picked)
        some = np.sort(generator.choice(places, min(_SHOWN, len(places)), replace=False))
        pixels = np.stack([edges.u[some], edges.v[some]], axis=1).astype(np.float64)
        bearings = lens.dataset.camera.unproject(pixels) @ lens.dataset.robot_from_camera.T
        arrows.append(NormalPanel(title, bearings, edges.normal[some]))
    seen = [
        SeenEdges(gray, run[1], f"({letter}) {chosen.words}")
        for letter, chosen, gray, run in zip("ab", pair, grays, runs, strict=True)
    ]
    reds = ", ".join(f"{run[0].inlier_pixels} of {run[0].edge_pixels}" for run in runs)
    return [
        Panel(
            "figure-17", "Figure 17",
            f"The normals m_k of up to {_SHOWN} random edge pixels of {pair[0].file}, each an arrow whose base lies on "
            "the pixel's bearing: (a) of all edge pixels with I_min = 200, (b) after the prefilter (7°) and RANSAC "
            "(3.5°), where they are mostly orthogonal to the vertical.",
            normal_panels(arrows), normal_panels_web(arrows),
        ),
        Panel(
            "figure-18", "Figure 18",
            "Edge pixels of vertical things, as found by RANSAC (red): the images of figure 10, cropped to the area "
            f"above the horizon. I_min = 200, prefilter 7°, threshold 3.5°; {reds} edge pixels agree.",
            consensus_pixels(seen),
        ),
    ]  # fmt: skip


def _worst(lens: Lens, chosen: Chosen) -> Panel:
    gray = lens.gray(chosen)
    refit, edges, options = lens.best_edges(REJECT, gray)
    sampled, _, _ = lens.best_edges(RANSAC, gray)
    picked, limit = edges.prefiltered, _limit_px(options, edges)
    cosines = (
        lens.true_cosine(chosen), lens.fitted_cosine(refit, "reject-refit"),
        lens.fitted_cosine(sampled, "RANSAC", _RANSAC_COLOUR),
    )  # fmt: skip
    histogram = OffsetPanel("(b)", edges.phi_rad[picked], edges.offset_px[picked], cosines)
    return Panel(
        "figure-27", "Figure 27",
        f"Where the reject-refit scheme errs the most, by {math.degrees(chosen.error_rad):.1f}°: {chosen.file} "
        f"({chosen.location}). (a) The prefiltered edge pixels as in figure 10. (b) Their histogram as in figure 11, "
        "with the true tilt (red, dashed), and what reject-refit (blue) and RANSAC (orange) have fitted with the "
        "parameters of table 3. The fits follow what pixels there are, whether or not they lie near the red line.",
        pixels_and_offsets(SeenEdges(gray, edges, f"(a) {chosen.words}"), histogram, offset_max_px=limit),
    )  # fmt: skip
