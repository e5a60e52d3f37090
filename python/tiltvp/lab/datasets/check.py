"""Everything that is wrong with a dataset, not just the first thing."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from tiltvp.errors import TiltvpError
from tiltvp.lab.datasets.findings import Finding, Findings
from tiltvp.lab.datasets.folder import find_dataset
from tiltvp.lab.datasets.rows import ROWS

__all__ = ["Finding", "check_dataset"]


def check_dataset(directory: str | os.PathLike[str], advance: Callable[[], None] = lambda: None) -> list[Finding]:
    """All that is wrong with a dataset: its description, calibration, table, and every image.

    Warnings are of what hinders some uses only: fewer than two locations cannot be cross-validated, and without a lean
    there is no factor to train. `advance` is called after each image.
    """
    folder = Path(directory)
    findings = Findings()
    dataset = find_dataset(folder, findings)
    if dataset is None:
        return findings.all
    for image in dataset.images:
        try:
            dataset.read(image)
        except TiltvpError as error:
            what, _, expected = str(error).removeprefix(f"{image.path}: ").partition(", expected ")
            findings.add(image.path, None, what, expected or "an image")
        advance()
    if dataset.images:
        table = folder / ROWS
        locations = {image.location for image in dataset.images}
        if len(locations) < 2:
            findings.warn(
                table, None, "images of one location only", "two or more, to leave one out in cross-validation"
            )
        if not any(image.alpha_rad > 0.0 for image in dataset.images):
            findings.warn(table, None, "no image of a lean", "some, to train the correction of angles")
    return findings.all
