"""docs/options.md is what the core declares; `just options` writes it anew."""

from __future__ import annotations

import inspect

import tiltvp
from options_page import OWNERS, PAGE, page
from tiltvp import corner, lines


def test_the_page_is_of_this_build() -> None:
    assert PAGE.read_text(encoding="utf-8") == page()


def test_every_class_with_options_is_on_the_page() -> None:
    found = {
        name
        for module in (tiltvp, corner, lines)
        for name, thing in vars(module).items()
        if inspect.isclass(thing) and isinstance(getattr(thing, "options", None), property | type(tiltvp.Camera.width))
    }
    assert found <= set(OWNERS)
