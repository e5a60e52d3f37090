"""How a self-calibration converges: the paper's figure 25."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

__all__ = ["convergence"]

_ROWS = (
    ("phi_rad", "variance_phi", r"$\phi$ (rad)", r"$\sigma_\phi^2$ (rad$^2$)"),
    ("rho_m", "variance_rho", r"$\rho$ (m)", r"$\sigma_\rho^2$ (m$^2$)"),
    ("psi_rad", "variance_psi", r"$\psi$ (rad)", r"$\sigma_\psi^2$ (rad$^2$)"),
)


def convergence(table: Mapping[str, NDArray[Any]], truth: dict[str, float] | None = None) -> Figure:
    """phi, rho and psi over the steps, in a band of two standard deviations, beside their variances (logarithmic).

    `table` is that of `tiltvp.selfcalib.convergence_table`; `truth` may hold phi_rad, rho_m, psi_rad, drawn dashed.
    """
    figure = Figure(figsize=(11.0, 7.6), layout="constrained")
    axes = figure.subplots(3, 2, sharex=True)
    steps = np.arange(len(table["phi_rad"]))
    for (value, variance, name, spread), (left, right) in zip(_ROWS, axes, strict=True):
        values, variances = table[value], table[variance]
        sigma = np.sqrt(np.where(np.isfinite(variances) & (variances >= 0.0), variances, np.nan))
        left.fill_between(steps, values - 2.0 * sigma, values + 2.0 * sigma, color="tab:blue", alpha=0.2, linewidth=0)
        left.plot(steps, values, color="tab:blue", linewidth=1.6)
        if truth is not None and value in truth:
            left.axhline(truth[value], color="black", linewidth=1.0, linestyle="--")
        # The last two thirds set the scale: before, the band may be as wide as the circle.
        late = values[len(values) // 3 :]
        shown = np.concatenate([late, [truth[value]] if truth is not None and value in truth else []])
        shown = shown[np.isfinite(shown)]
        if shown.size:
            room = 0.25 * float(np.ptp(shown)) + 4.0 * float(np.nan_to_num(sigma[-1])) + 1e-6
            left.set_ylim(float(shown.min()) - room, float(shown.max()) + room)
        left.set_ylabel(name)
        if (np.nan_to_num(variances, posinf=0.0) > 0.0).any():
            right.semilogy(steps, sigma**2, color="tab:red", linewidth=1.6)
        right.set_ylabel(spread)
        for one in (left, right):
            one.grid(color="0.9", linewidth=0.6)
            one.spines[["top", "right"]].set_visible(False)
    axes[2][0].set_xlabel("step")
    axes[2][1].set_xlabel("step")
    axes[0][0].set_title("value, two standard deviations")
    axes[0][1].set_title("variance")
    return figure
