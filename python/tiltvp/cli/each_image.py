"""Verbs that find something in each of many images: read, look, draw, and go on past images that cannot be read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from tiltvp.cli.inputs import distinct_names, find_images
from tiltvp.cli.terminal import complain, named, progress_bar
from tiltvp.errors import OutputError, TiltvpError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Image = NDArray[Any]

__all__ = ["find_in_each"]

Found = TypeVar("Found")


def find_in_each(
    images: list[str], look: Callable[[Image], Found], overlay: Path | None, draw: Callable[[Image, Found], Image]
) -> tuple[list[tuple[str, Found]], bool]:
    """What `look` finds in each gray image, with its file, drawn into the folder `overlay`; whether all went well."""
    from tiltvp.images import gray_from, read_image, write_image

    files, problems = find_images(images)
    for problem in problems:
        complain(problem)
    found: list[tuple[str, Found]] = []
    well = not problems
    with progress_bar(len(files), "images") as bar:
        for file, name in zip(files, distinct_names(files), strict=True):
            try:
                gray = gray_from(read_image(file))
                seen = look(gray)
                if overlay is not None:
                    write_image(overlay / f"{name}.png", draw(gray, seen))
                found.append((str(file), seen))
            except OutputError:
                raise
            except TiltvpError as error:
                bar.complain(named(file, str(error)))
                well = False
            bar.advance()
    return found, well
