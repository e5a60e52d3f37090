"""The pages of the site in Debian's chromium, without a network, as wide as a desk's window and as a phone's."""

from __future__ import annotations

import os
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest
from playwright.sync_api import Browser

import tiltvp

ROOT = Path(__file__).parents[2]
WITHOUT_A_TITLE = {"index", "genindex", "py-modindex", "search"}
"""What leads to pages, and is none."""
WIDTHS = {"desk": 1280, "phone": 390}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pages, without running the notebooks, which `just notebooks` does; a warning is an error."""
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "--quiet", "--fail-on-warning", "--keep-going", "--conf-dir", "docs"]
    command += ["--define", "nb_execution_mode=off", "--doctree-dir", str(out / "doctrees"), ".", str(out / "html")]
    environment = {**os.environ, "HTTPS_PROXY": "http://127.0.0.1:9", "HTTP_PROXY": "http://127.0.0.1:9"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=280, check=False)
    assert done.returncode == 0, done.stderr
    return out / "html"


@pytest.mark.parametrize("device", WIDTHS)
def test_pages_are_as_wide_as_the_window_and_ask_for_nothing(site: Path, browser: Browser, device: str) -> None:
    page = browser.new_page(viewport={"width": WIDTHS[device], "height": 800})
    page.context.set_offline(True)
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    pages = [path for path in site.rglob("*.html") if path.parent != site or path.stem not in WITHOUT_A_TITLE]
    assert len(pages) > 40
    for path in pages:
        name = str(path.relative_to(site))
        page.goto(path.as_uri())
        assert page.locator("article h1").is_visible(), name
        fits = "document.documentElement.scrollWidth <= document.documentElement.clientWidth"
        assert page.evaluate(fits), name
        pictures = "[...document.querySelectorAll('article img')].every(i => i.complete && i.naturalWidth > 100)"
        assert page.evaluate(pictures), name
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []


class Marks(HTMLParser):
    """What a page links to, and the places in it that can be linked to."""

    def __init__(self) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.ids: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        told = dict(attrs)
        if tag == "a" and told.get("href"):
            self.links.add(str(told["href"]))
        if told.get("id"):
            self.ids.add(str(told["id"]))


def test_links_lead_somewhere(site: Path) -> None:
    pages = {}
    for path in site.rglob("*.html"):
        pages[path] = Marks()
        pages[path].feed(path.read_text(encoding="utf-8"))
    astray = []
    for path, page in pages.items():
        for link in page.links:
            place, _, mark = unquote(link).partition("#")
            target = (path.parent / place).resolve() if place else path
            if ":" not in place and not (target.exists() and (not mark or mark in pages[target].ids)):
                astray.append(f"{path.relative_to(site)}: {link}")
    assert astray == []


def test_every_public_name_is_in_the_reference(site: Path) -> None:
    text = (site / "docs" / "reference" / "tiltvp.html").read_text(encoding="utf-8")
    modules = {"corner", "lines", "streams", "synth"}
    assert [name for name in tiltvp.__all__ if name not in modules and f'id="tiltvp.{name}"' not in text] == []
    for module in sorted(modules):
        pages = [path.read_text(encoding="utf-8") for path in (site / "docs" / "reference").glob("*.html")]
        names = getattr(tiltvp, module).__all__
        assert [name for name in names if not any(f'id="tiltvp.{module}.{name}"' in page for page in pages)] == []
