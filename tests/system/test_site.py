"""The pages of the site in a real browser, Debian's chromium, without a network, as wide as a desk's and as a phone's."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, sync_playwright

import tiltvp

ROOT = Path(__file__).parents[2]
PAGES = ["docs/index", "docs/tilt", "docs/options", "docs/reference/tiltvp", "docs/command_line", "docs/glossary"]
WIDTHS = {"desk": 1280, "phone": 390}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pages, without running the notebooks, which `just notebooks` does; a warning is an error, as in `just docs`."""
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "--quiet", "--fail-on-warning", "--keep-going", "--conf-dir", "docs"]
    command += ["--define", "nb_execution_mode=off", "--doctree-dir", str(out / "doctrees"), ".", str(out / "html")]
    environment = {**os.environ, "HTTPS_PROXY": "http://127.0.0.1:9", "HTTP_PROXY": "http://127.0.0.1:9"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=280, check=False)
    assert done.returncode == 0, done.stderr
    return out / "html"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    path = shutil.which("chromium")
    assert path, "no chromium: `just test-system` installs it"
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.mark.parametrize("device", WIDTHS)
def test_pages_are_as_wide_as_the_window_and_ask_for_nothing(site: Path, browser: Browser, device: str) -> None:
    page = browser.new_page(viewport={"width": WIDTHS[device], "height": 800})
    page.context.set_offline(True)
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    for name in PAGES:
        page.goto((site / f"{name}.html").as_uri())
        assert page.locator("article h1").is_visible(), name
        fits = "document.documentElement.scrollWidth <= document.documentElement.clientWidth"
        assert page.evaluate(fits), name
        pictures = "[...document.querySelectorAll('article img')].every(i => i.complete && i.naturalWidth > 100)"
        assert page.evaluate(pictures), name
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []


def test_links_lead_somewhere(site: Path, browser: Browser) -> None:
    page = browser.new_page()
    page.context.set_offline(True)
    collect = "[...document.querySelectorAll('article a[href], nav a[href], aside a[href]')].map(a => a.href)"
    known = "[...document.querySelectorAll('[id]')].map(e => e.id)"
    links: dict[str, set[str]] = {}
    marks: dict[str, set[str]] = {}
    for path in sorted(site.rglob("*.html")):
        page.goto(path.as_uri(), wait_until="domcontentloaded")
        page.wait_for_load_state("domcontentloaded")
        own = page.url.split("#")[0]
        links[own], marks[own] = set(page.evaluate(collect)), set(page.evaluate(known))
    astray = []
    for own, found in links.items():
        for link in found:
            target, _, mark = link.partition("#")
            if not target.startswith("file:") or target.rsplit("/", 1)[1].startswith(
                ("genindex", "py-modindex", "search")
            ):
                continue
            if target in marks:
                if mark and mark not in marks[target]:
                    astray.append((own, link))
            elif not Path(target.removeprefix("file://")).exists():
                astray.append((own, link))
    assert astray == []


def test_every_public_name_is_in_the_reference(site: Path) -> None:
    text = (site / "docs" / "reference" / "tiltvp.html").read_text(encoding="utf-8")
    modules = {"corner", "lines", "synth"}
    assert [name for name in tiltvp.__all__ if name not in modules and f'id="tiltvp.{name}"' not in text] == []
    for module in sorted(modules):
        pages = [path.read_text(encoding="utf-8") for path in (site / "docs" / "reference").glob("*.html")]
        names = getattr(tiltvp, module).__all__
        assert [name for name in names if not any(f'id="tiltvp.{module}.{name}"' in page for page in pages)] == []
