"""Verbs that find something in each of many images: read, look, draw, and go on past images that cannot be read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from cyclopts import Parameter

from tiltvp.cli.frame_checks import tell_setup_of
from tiltvp.cli.sources import SourceOptions, check_apart, ending_at_interrupt, picture_names
from tiltvp.cli.tables import Out, check_ending
from tiltvp.cli.terminal import progress_bar
from tiltvp.errors import OutputError, TiltvpError
from tiltvp.files import check_output_folder

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp.lines import LineExtractor
    from tiltvp.segments import SegmentDetector

    Image = NDArray[Any]

__all__ = ["FoundOptions", "Images", "find_in_each"]

_IMAGES = (
    "Image files, folders of images and glob patterns; or one video or recording of ROS; or -, for names of files "
    "on stdin."
)
Images = Annotated[list[str] | None, Parameter(help=_IMAGES)]
Found = TypeVar("Found")


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class FoundOptions:
    """Where what is found goes."""

    out: Out | None = None
    """File for what is found, angles in radians, one row for each: .csv, .json or .parquet."""
    overlay: Path | None = None
    """Folder for the images with what is found in colour."""

    def check(self) -> None:
        """Refuses what cannot be written, before any work is done."""
        check_ending(self.out)
        if self.overlay is not None:
            check_output_folder(self.overlay)


def find_in_each(
    images: list[str] | None,
    source: SourceOptions,
    finder: LineExtractor | SegmentDetector,
    look: Callable[[Image], Found],
    results: FoundOptions,
    draw: Callable[[Image, Found], Image],
    *,
    beside: Sequence[Path | None],
) -> tuple[list[tuple[str, Found]], bool]:
    """What `look` finds by a `finder` in each gray frame, with its name, drawn into a folder if asked; whether all
    went well.

    No output takes the place of what is read `beside` the images.
    """
    from tiltvp.images import gray_from, write_image

    frames, overlay = source.open(images or [], finder.camera), results.overlay
    check_apart(frames, overlay, results.out, beside=beside)
    tell_setup_of(frames, finder)
    found: list[tuple[str, Found]] = []
    well = not frames.problems
    with ending_at_interrupt(frames) as coming, progress_bar(frames.count or 0, "images", told=frames.told) as bar:
        for frame, name in zip(coming, picture_names(frames), strict=False):
            try:
                gray = gray_from(frame.read())
                seen = look(gray)
                if overlay is not None:
                    write_image(overlay / f"{name}.png", draw(gray, seen))
                found.append((frame.name, seen))
            except OutputError:
                raise
            except TiltvpError as error:
                bar.blame(frame.name, str(error))
                well = False
            bar.advance()
    return found, well
