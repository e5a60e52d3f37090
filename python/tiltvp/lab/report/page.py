"""The page: contents to one HTML text with everything in it, so that it opens without a network."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from importlib import resources
from typing import Any

from tiltvp.errors import MissingExtraError
from tiltvp.lab.report.panel import Contents, Panel

__all__ = ["page_of"]


def page_of(contents: Contents, pictures: Mapping[str, bytes]) -> str:
    """The HTML of the page; `pictures` are the PNG files by the stems of the panels.

    Plotly's script is written into it once, if any figure needs it. Raises `MissingExtraError` without the packages of
    `tiltvp[lab]`.
    """
    try:
        import jinja2
        import plotly.offline  # type: ignore[import-untyped]
    except ImportError as error:
        raise MissingExtraError.of("the page of a report", "lab", error) from error
    panels = [item for section in contents.sections for item in section.items if isinstance(item, Panel)]
    figures = {panel.stem: panel.web for panel in panels if panel.web is not None}
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    template = environment.from_string(_asset("page.html.jinja"))
    return template.render(
        contents=contents,
        pictures={stem: base64.b64encode(data).decode("ascii") for stem, data in pictures.items()},
        style=_asset("page.css"),
        script=_asset("page.js"),
        plotly=plotly.offline.get_plotlyjs() if figures else "",
        figures=_safe_json(figures),
    )


def _asset(name: str) -> str:
    return resources.files("tiltvp.lab.report").joinpath(name).read_text(encoding="utf-8")


def _safe_json(value: dict[str, Any]) -> str:
    """JSON that may stand in a script element: no `<` that could end it."""
    return json.dumps(value, ensure_ascii=True, allow_nan=False).replace("<", "\\u003c")
