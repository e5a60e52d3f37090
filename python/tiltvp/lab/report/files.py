"""The files of a report: every figure and table as PNG and PDF, tables as CSV, and the page; all of them or none."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Final

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf

from tiltvp.errors import RunError
from tiltvp.files import whole_folder
from tiltvp.lab.plots.report.tables import table_figure
from tiltvp.lab.report.page import page_of
from tiltvp.lab.report.panel import Contents, Panel, Sheet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["DPI", "PAGE", "check_target", "write_report"]

PAGE: Final = "report.html"
_ENDINGS: Final = (".html", ".png", ".pdf", ".csv")
"""Of the files of a report."""
DPI: Final = 200.0
"""Pixels per inch of the PNG files, which are about seven inches wide."""


def check_target(directory: Path) -> None:
    """Raises `RunError` if the folder holds something else than a report, which would be lost."""
    if not directory.exists():
        return
    if not directory.is_dir():
        raise RunError(f"{directory}: is a file, expected a folder for the report")
    there = list(directory.iterdir())
    others = [path.name for path in there if path.suffix not in _ENDINGS or not path.is_file()]
    if others or (there and not (directory / PAGE).is_file()):
        what = f"holds other files ({min(others or [path.name for path in there])})"
        raise RunError(f"{directory}: {what}, expected an empty folder, an earlier report alone, or none")


def write_report(
    contents: Contents, directory: Path, *, dpi: float = DPI, advance: Callable[[str], None] = lambda _: None
) -> Path:
    """Writes the report in place of an earlier one and gives the path of its page.

    Everything is made in a folder beside it, which takes its place at the end. Raises `RunError` if the folder holds
    something else, `OutputError` if it cannot be written.
    """
    check_target(directory)
    with whole_folder(directory) as part:
        _fill(part, contents, dpi, advance)
    return directory / PAGE


def _fill(part: Path, contents: Contents, dpi: float, advance: Callable[[str], None]) -> None:
    pictures: dict[str, bytes] = {}
    for section in contents.sections:
        for item in section.items:
            advance(item.title)
            pictures[item.stem] = _write(item, part, dpi)
    advance("page")
    (part / PAGE).write_text(page_of(contents, pictures), encoding="utf-8")


def _write(item: Panel | Sheet, part: Path, dpi: float) -> bytes:
    """Writes the files of a figure or table; the bytes of its PNG."""
    if isinstance(item, Sheet):
        item.numbers.write_csv(part / f"{item.stem}.csv")
        figure = table_figure(item.cells)
    else:
        figure = item.figure
    (part / f"{item.stem}.pdf").write_bytes(_pdf(figure))
    # What has been laid out for the one file is laid out for the other.
    figure.set_layout_engine("none")
    png = _png(figure, dpi)
    (part / f"{item.stem}.png").write_bytes(png)
    return png


def _png(figure: Figure, dpi: float) -> bytes:
    FigureCanvasAgg(figure)
    return _saved(figure, "png", {"Software": None}, dpi)


def _pdf(figure: Figure) -> bytes:
    """Without the date and the name of the program, so that the same run gives the same bytes."""
    FigureCanvasPdf(figure)
    nobody = dict.fromkeys(("CreationDate", "ModDate", "Creator", "Producer"))
    return _saved(figure, "pdf", nobody, DPI)


def _saved(figure: Figure, kind: str, metadata: dict[str, None], dpi: float) -> bytes:
    memory = io.BytesIO()
    figure.savefig(memory, format=kind, dpi=dpi, metadata=metadata)
    return memory.getvalue()
