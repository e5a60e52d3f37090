"""Which images of a run serve as examples: chosen by rules, so that nobody picks the prettiest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl

__all__ = ["Chosen", "Examples", "choose_examples"]


@dataclass(frozen=True)
class Chosen:
    """An image of the run: its file, where it was taken, the true lean and the error of the estimate in radians."""

    file: str
    location: str
    alpha_true_rad: float
    beta_true_rad: float
    error_rad: float

    @property
    def words(self) -> str:
        """The true lean for the title of a picture, in degrees."""
        alpha, beta = np.degrees([self.alpha_true_rad, self.beta_true_rad])
        lean = rf"$\alpha_T$ = {alpha:.2f}°"
        return lean if self.alpha_true_rad == 0.0 else rf"{lean}, $\beta_T$ = {beta:.0f}°"


@dataclass(frozen=True)
class Examples:
    """`upright` and `leaning` of the typical location, the `worst` of all images, a leaning one of each location."""

    upright: Chosen
    leaning: Chosen
    worst: Chosen
    by_location: tuple[Chosen, ...]


def choose_examples(rows: pl.DataFrame) -> Examples | None:
    """The examples among the rows of one variant (one for each image); None if no image has an estimate.

    The typical location has the median of the locations' mean errors (the lower one of two); of it come the image with
    the least lean and the one that leans forward the most. The worst image has the largest error of all. Of every
    location there is the image that leans forward the most.
    """
    found = rows.filter(pl.col("error_rad").is_not_null()).sort("image")
    if found.is_empty():
        return None
    means = found.group_by("location").agg(pl.col("error_rad").mean()).sort("error_rad", "location")
    typical = found.filter(pl.col("location") == means["location"][(len(means) - 1) // 2])
    return Examples(
        upright=_chosen(typical.sort("alpha_true_rad", "image").head(1)),
        leaning=_chosen(_most_forward(typical)),
        worst=_chosen(found.sort("error_rad", "image", descending=[True, False]).head(1)),
        by_location=tuple(_chosen(_most_forward(part)) for part in found.partition_by("location", maintain_order=True)),
    )


def _most_forward(rows: pl.DataFrame) -> pl.DataFrame:
    """The row that leans forward the most."""
    forward = (pl.col("alpha_true_rad") * pl.col("beta_true_rad").cos()).alias("forward")
    return rows.with_columns(forward).sort("forward", "image", descending=[True, False]).head(1)


def _chosen(row: pl.DataFrame) -> Chosen:
    values = row.row(0, named=True)
    names = ("file", "location", "alpha_true_rad", "beta_true_rad", "error_rad")
    return Chosen(*(values[name] for name in names))
