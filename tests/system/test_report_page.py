"""The page of a report in a real browser, Debian's chromium, without a network."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from tiltvp.lab.report.files import PAGE

WEB_FIGURES = ["figure-17", "figure-21", "figure-22", "figure-24", "figure-28"]


@dataclass
class Opened:
    """The page, and what it has said and asked for."""

    page: Page
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)


@pytest.fixture(scope="module")
def opened(browser: Browser, report: Path) -> Iterator[Opened]:
    """The report by its file, in a window of 1200 x 900 pixels that has no network."""
    context = browser.new_context(viewport={"width": 1200, "height": 900}, offline=True)
    page = context.new_page()
    seen = Opened(page)
    page.on("console", lambda message: seen.complaints.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: seen.complaints.append(str(error)))
    page.on("request", lambda request: seen.requests.append(request.url))
    page.goto((report / PAGE).as_uri())
    for stem in WEB_FIGURES:
        page.wait_for_selector(f"#{stem} .main-svg, #{stem} canvas", state="attached", timeout=60_000)
    yield seen
    context.close()


def test_nothing_is_asked_of_a_network(opened: Opened) -> None:
    assert opened.complaints == []
    assert opened.requests
    assert [url[:80] for url in opened.requests if not url.startswith(("file:", "data:", "blob:"))] == []


def test_every_figure_can_be_seen(opened: Opened, report: Path) -> None:
    figures = opened.page.locator("figure")
    stems = {path.stem for path in report.glob("*.png")}
    assert {figures.nth(i).get_attribute("id") for i in range(figures.count())} == stems
    for stem in sorted(stems):
        shown = opened.page.locator(f"#{stem} img, #{stem} .touch, #{stem} table").first
        shown.scroll_into_view_if_needed()
        assert shown.is_visible(), stem
        box = shown.bounding_box()
        assert box is not None
        assert min(box["width"] / 300.0, box["height"] / 60.0) > 1.0, (stem, box)
    pictures = "[...document.querySelectorAll('figure img')].every(i => i.complete && i.naturalWidth > 100)"
    assert opened.page.evaluate(pictures)
    wide = "document.documentElement.scrollWidth <= document.documentElement.clientWidth"
    assert opened.page.evaluate(wide)


@pytest.mark.parametrize("stem", ["figure-21", "figure-22", "figure-24", "figure-28"])
def test_hovering_tells_a_value(opened: Opened, stem: str) -> None:
    place = opened.page.locator(f"#{stem} .touch")
    place.scroll_into_view_if_needed()
    curve = "gd => gd.data.findIndex(d => d.hoverinfo !== 'skip' && d.x.length > 0)"
    number = place.evaluate(curve)
    where = place.evaluate(
        """(gd, number) => {
          const layout = gd._fullLayout, box = gd.getBoundingClientRect(), d = gd.data[number];
          const i = Math.floor(d.x.length / 2);
          return [box.left + layout.xaxis._offset + layout.xaxis.d2p(d.x[i]),
                  box.top + layout.yaxis._offset + layout.yaxis.d2p(d.y[i])];
        }""",
        number,
    )
    opened.page.mouse.move(where[0] + 2, where[1])
    opened.page.mouse.move(where[0], where[1], steps=4)
    label = opened.page.wait_for_selector(f"#{stem} .hoverlayer .hovertext", timeout=10_000)
    assert label is not None
    assert any(digit in (label.text_content() or "") for digit in "0123456789")


def test_normals_turn(opened: Opened) -> None:
    place = opened.page.locator("#figure-17 .touch")
    place.scroll_into_view_if_needed()
    eye = "gd => ({...gd._fullLayout.scene._scene.getCamera().eye})"
    opened.page.wait_for_function(
        "document.querySelector('#figure-17 .touch')._fullLayout.scene._scene !== undefined", timeout=30_000
    )
    before: dict[str, Any] = place.evaluate(eye)
    box = place.bounding_box()
    assert box is not None
    x, y = box["x"] + 0.25 * box["width"], box["y"] + 0.55 * box["height"]
    opened.page.mouse.move(x, y)
    opened.page.mouse.down()
    opened.page.mouse.move(x + 120.0, y + 30.0, steps=8)
    opened.page.mouse.up()
    opened.page.wait_for_timeout(500)
    after: dict[str, Any] = place.evaluate(eye)
    assert max(abs(after[axis] - before[axis]) for axis in "xyz") > 0.05


def test_tables_sort(opened: Opened) -> None:
    def column() -> list[float]:
        cells = opened.page.locator("#table-3 tbody tr td:nth-child(5)").all_text_contents()
        return [float(cell.split()[0]) for cell in cells]

    head = opened.page.locator("#table-3 th:nth-child(5)")
    as_written = column()
    head.locator("button").click()
    assert column() == sorted(as_written)
    assert head.get_attribute("aria-sort") == "ascending"
    head.locator("button").click()
    assert column() == sorted(as_written, reverse=True)
    names = opened.page.locator("#table-3 th:nth-child(1)")
    names.locator("button").click()
    methods = opened.page.locator("#table-3 tbody tr td:nth-child(1)").all_text_contents()
    assert [text.strip() for text in methods] == sorted(text.strip() for text in methods)
    assert head.get_attribute("aria-sort") == "none"


def test_narrow_windows_do_not_scroll_sideways(opened: Opened) -> None:
    opened.page.set_viewport_size({"width": 420, "height": 800})
    opened.page.wait_for_timeout(800)
    wide = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
    assert opened.page.evaluate(wide) <= 0
    opened.page.set_viewport_size({"width": 1200, "height": 900})
