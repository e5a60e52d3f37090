"""From what a method measures, a shift in pixels or a raw angle, to the lean: learned from images of known tilt."""

from __future__ import annotations

from tiltvp._core import (
    AffineCorrection,
    PosteriorCorrection,
    PriorOfTilt,
    apply_correction,
    train_affine,
    train_factor,
    train_posterior,
)

__all__ = [
    "AffineCorrection",
    "PosteriorCorrection",
    "PriorOfTilt",
    "apply_correction",
    "train_affine",
    "train_factor",
    "train_posterior",
]
