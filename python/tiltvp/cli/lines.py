"""`tiltvp lines`: the vertical lines of each of many images."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from tiltvp.cli.each_image import FoundOptions, Images, find_in_each
from tiltvp.cli.line_options import LineOptions
from tiltvp.cli.options import CameraOptions
from tiltvp.cli.results import degrees
from tiltvp.cli.sources import SourceOptions
from tiltvp.cli.tables import Table, write_table
from tiltvp.cli.terminal import new_table, show

if TYPE_CHECKING:
    from tiltvp.lines import Lines

_DEFAULTS, _RESULTS, _SOURCE = LineOptions(), FoundOptions(), SourceOptions()


def lines(
    images: Images = None,
    /,
    *,
    camera: CameraOptions,
    options: LineOptions = _DEFAULTS,
    results: FoundOptions = _RESULTS,
    source: SourceOptions = _SOURCE,
) -> int:
    """Find the vertical lines of each image.

    Frames that cannot be read are named on stderr, the others are done, and the exit code is 1.
    """
    from tiltvp.overlays.lines import draw_lines

    results.check()
    source = source.of_robot(camera.robot(), images or [])
    lens, options = camera.load(source.topic), camera.complete(options.of_topic(source.topic))
    extractor, tilt = options.extractor(lens), options.tilts(lens)
    found, well = find_in_each(
        images,
        source,
        extractor,
        lambda gray: extractor(gray, tilt(gray)),
        results,
        lambda gray, seen: draw_lines(gray, lens, seen, extractor.robot_from_camera),
        beside=(options.mask, camera.camera),
    )
    table = line_table(found)
    if results.out is not None:
        write_table(table, results.out)
    printed = new_table(
        None, ("file", "line", "bearing deg", "1-sigma deg", "from deg", "to deg", "support px"), ["file"]
    )
    for row in table.rows:
        low, high = degrees(row["elevation_min_rad"], 1), degrees(row["elevation_max_rad"], 1)
        bearing, sigma = degrees(row["bearing_rad"]), degrees(row["sigma_rad"], 3)
        printed.add_row(row["file"], str(row["line"]), bearing, sigma, low, high, str(row["support_px"]))
    show(printed)
    return 0 if well else 1


LINE_TYPES: Final = {"bearing_rad": "Float64", "sigma_rad": "Float64", "support_px": "UInt32"} | dict.fromkeys(
    ("elevation_min_rad", "elevation_max_rad", "polarity"), "Float64"
)
"""The columns of a table that lines have by themselves."""


def line_columns(found: Lines) -> dict[str, list[Any]]:
    """The columns of `LINE_TYPES`."""
    return {name: getattr(found, name).tolist() for name in LINE_TYPES}


def line_table(found: list[tuple[str, Lines]]) -> Table:
    """One row for each line of each image: file, line, bearing_rad, sigma_rad, support_px, elevations, polarity."""
    table = Table({"file": "String", "line": "UInt32"} | LINE_TYPES)
    for file, seen in found:
        table.add({"file": [file] * len(seen), "line": range(len(seen)), **line_columns(seen)})
    return table
