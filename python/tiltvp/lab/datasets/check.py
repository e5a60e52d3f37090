"""Everything that is wrong with a dataset, not just the first thing."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from tiltvp.errors import TiltvpError
from tiltvp.lab.datasets.description import CALIBRATION
from tiltvp.lab.datasets.driven import read_drive
from tiltvp.lab.datasets.findings import Finding, Findings
from tiltvp.lab.datasets.folder import find_dataset
from tiltvp.lab.datasets.rows import ROWS
from tiltvp.stereo_rigs import StereoRig
from tiltvp.streams import frame_motions, open_frames

__all__ = ["Finding", "check_dataset", "is_stereo"]


def check_dataset(directory: str | os.PathLike[str], advance: Callable[[], None] = lambda: None) -> list[Finding]:
    """All that is wrong with a dataset: its description, calibration, table, and every image.

    Of a drive also its tables; of a stereo sequence (`is_stereo`) that is calibration, times, and the pairs of images.

    Warnings are of what hinders some uses only: fewer than two locations cannot be cross-validated, and without a lean
    there is no factor to train. `advance` is called after each image.
    """
    folder = Path(directory)
    findings = Findings()
    if is_stereo(folder):
        _check_stereo(folder, findings)
        return findings.all
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
    if dataset.source.get("kind") == "drive":
        _check_drive(folder, findings)
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


def is_stereo(folder: Path) -> bool:
    """Whether a folder has a stereo sequence, of `tiltvp dataset stereo`, and no images of known lean."""
    return (folder / CALIBRATION).is_file() and not (folder / ROWS).exists()


def _check_drive(folder: Path, findings: Findings) -> None:
    for read in (read_drive, lambda drive: frame_motions(open_frames(drive), drive / "odometry.csv")):
        try:
            read(folder)
        except TiltvpError as error:
            what, _, expected = str(error).removeprefix(f"{folder}: ").partition(", expected ")
            findings.add(folder, None, what, expected or "a drive")


def _check_stereo(folder: Path, findings: Findings) -> None:
    names: dict[str, list[str]] = {}
    try:
        rig = StereoRig.load(folder / CALIBRATION)
        for side, camera in (("left", rig.left), ("right", rig.right)):
            frames = open_frames(folder / side)
            names[side] = [Path(frame.name).name for frame in frames]
            if frames.times_s is None:
                findings.add(folder / side, None, "images without times", "those of frames.csv")
            for frame in frames:
                try:
                    height, width = frame.read().shape[:2]
                except TiltvpError as error:
                    findings.add(frame.name, None, str(error), "an image")
                    continue
                if (width, height) != (camera.width, camera.height):
                    findings.add(frame.name, None, f"{width} x {height} pixels", f"{camera.width} x {camera.height}")
    except TiltvpError as error:
        findings.add(folder, None, str(error), "a stereo sequence")
        return
    for name in sorted(set(names["left"]) ^ set(names["right"])):
        findings.add(folder, None, f"{name} of one side alone", "an image of the same name of the other")
