"""`tiltvp segments`: the straight edges of each of many images."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import Group, Parameter

from tiltvp.cli.inputs import distinct_names, find_images
from tiltvp.cli.library_options import LibraryOptions, from_library
from tiltvp.cli.options import CameraOptions
from tiltvp.cli.results import degrees
from tiltvp.cli.tables import Table, check_ending, write_table
from tiltvp.cli.terminal import complain, named, new_table, progress_bar, show
from tiltvp.errors import OutputError, TiltvpError
from tiltvp.files import check_output_folder

if TYPE_CHECKING:
    from tiltvp.segments import Segments

_EDGES = Group("Straight edges")


@Parameter(name="*", group=_EDGES)
@dataclass(frozen=True, kw_only=True)
@from_library({"SegmentDetector": ()})
class SegmentOptions(LibraryOptions):
    """What a straight edge is."""


_DEFAULTS = SegmentOptions()


def segments(
    images: list[str],
    /,
    *,
    camera: CameraOptions,
    options: SegmentOptions = _DEFAULTS,
    out: Path | None = None,
    overlay: Path | None = None,
) -> int:
    """Find the straight edges of each image, as arcs of great circles.

    Images that cannot be read are named on stderr, the others are done, and the exit code is 1.

    Parameters
    ----------
    images
        Image files, folders of images, and glob patterns.
    out
        File for the edges in the camera frame, radians, one row for each: .csv, .json or .parquet.
    overlay
        Folder for the images with their edges in colour.
    """
    from tiltvp.images import gray_from, read_image, write_image
    from tiltvp.overlays.segments import draw_segments
    from tiltvp.segments import SegmentDetector

    if out is not None:
        check_ending(out)
    if overlay is not None:
        check_output_folder(overlay)
    lens = camera.load()
    detector = SegmentDetector(lens, **options.given())
    files, problems = find_images(images)
    for problem in problems:
        complain(problem)
    found: list[tuple[str, Segments]] = []
    failed = bool(problems)
    with progress_bar(len(files), "images") as bar:
        for file, name in zip(files, distinct_names(files), strict=True):
            try:
                gray = gray_from(read_image(file))
                seen = detector(gray)
                if overlay is not None:
                    write_image(overlay / f"{name}.png", draw_segments(gray, lens, seen))
                found.append((str(file), seen))
            except OutputError:
                raise
            except TiltvpError as error:
                bar.complain(named(file, str(error)))
                failed = True
            bar.advance()
    printed = new_table(None, ("file", "edges", "pixels", "longest deg", "median deg", "median rms px"), ["file"])
    for image, seen in found:
        printed.add_row(image, *_summary(seen))
    show(printed)
    if out is not None:
        write_table(segment_table(found), out)
    return 1 if failed else 0


def _summary(seen: Segments) -> list[str]:
    import numpy as np

    counts = [str(len(seen)), str(int(seen.support.sum()))]
    if not len(seen):
        return [*counts, "", "", ""]
    longest, median = degrees(float(seen.length_rad[0]), 1), degrees(float(np.median(seen.length_rad)), 1)
    return [*counts, longest, median, f"{np.median(seen.rms_px):.2f}"]


def segment_table(found: list[tuple[str, Segments]]) -> Table:
    """One row for each edge of each image: file, edge, normal, ends, length_rad, contrast, rms_px, support."""
    directions = [f"{what}_{axis}" for what in ("normal", "first", "last") for axis in "xyz"]
    numbers = dict.fromkeys((*directions, "length_rad", "contrast", "rms_px"), "Float64")
    table = Table({"file": "String", "edge": "UInt32", **numbers, "support": "UInt32"})
    for file, seen in found:
        rows: dict[str, Any] = {"file": [file] * len(seen), "edge": range(len(seen))}
        vectors = {"normal": seen.normal, "first": seen.ends[:, 0], "last": seen.ends[:, 1]}
        for what, vector in vectors.items():
            rows |= {f"{what}_{axis}": vector[:, k].tolist() for k, axis in enumerate("xyz")}
        plain = ("length_rad", "contrast", "rms_px", "support")
        table.add(rows | {name: getattr(seen, name).tolist() for name in plain})
    return table
