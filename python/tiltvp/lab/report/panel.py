"""What a page is made of: figures with captions, tables, and sections of both."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure

__all__ = ["Contents", "Panel", "Section", "Sheet"]


@dataclass(frozen=True)
class Panel:
    """A figure: the stem of its files, its name, its caption, and plotly's data of it where it can be touched."""

    stem: str
    title: str
    caption: str
    figure: Figure
    web: dict[str, Any] | None = None


@dataclass(frozen=True)
class Sheet:
    """A table: the stem of its files, its name, its caption, the cells as people read them, and the numbers."""

    stem: str
    title: str
    caption: str
    cells: pl.DataFrame
    numbers: pl.DataFrame


@dataclass(frozen=True)
class Section:
    """A heading, words below it, and what follows, in order."""

    title: str
    words: str = ""
    items: tuple[Panel | Sheet, ...] = ()


@dataclass(frozen=True)
class Contents:
    """The page: its title, facts about the run by name, and the sections."""

    title: str
    facts: dict[str, str] = field(default_factory=dict)
    sections: tuple[Section, ...] = ()
