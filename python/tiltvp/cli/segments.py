"""`tiltvp segments`: the straight edges of each of many images."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cyclopts import Group, Parameter

from tiltvp.cli.declared_options import LibraryOptions, from_library
from tiltvp.cli.each_image import FoundOptions, Images, find_in_each
from tiltvp.cli.options import CameraOptions
from tiltvp.cli.results import degrees
from tiltvp.cli.sources import SourceOptions
from tiltvp.cli.tables import Table, write_table
from tiltvp.cli.terminal import new_table, show

if TYPE_CHECKING:
    from tiltvp.segments import Segments

_EDGES = Group("Straight edges")


@Parameter(name="*", group=_EDGES)
@dataclass(frozen=True, kw_only=True)
@from_library({"SegmentDetector": ()})
class SegmentOptions(LibraryOptions):
    """What a straight edge is."""


_DEFAULTS, _RESULTS, _SOURCE = SegmentOptions(), FoundOptions(), SourceOptions()


def segments(
    images: Images = None,
    /,
    *,
    camera: CameraOptions,
    options: SegmentOptions = _DEFAULTS,
    results: FoundOptions = _RESULTS,
    source: SourceOptions = _SOURCE,
) -> int:
    """Find the straight edges of each image, as arcs of great circles in the camera frame.

    Frames that cannot be read are named on stderr, the others are done, and the exit code is 1.
    """
    from tiltvp.overlays.segments import draw_segments
    from tiltvp.segments import SegmentDetector

    results.check()
    source = source.of_robot(camera.robot(), images or [])
    lens = camera.load(source.topic)
    detector = SegmentDetector(lens, **camera.complete(options).given())
    found, well = find_in_each(
        images,
        source,
        detector,
        detector,
        results,
        lambda gray, seen: draw_segments(gray, lens, seen),
        beside=(camera.camera,),
    )
    if results.out is not None:
        write_table(segment_table(found), results.out)
    printed = new_table(None, ("file", "edges", "pixels", "longest deg", "median deg", "median rms px"), ["file"])
    for image, seen in found:
        printed.add_row(image, *_summary(seen))
    show(printed)
    return 0 if well else 1


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
