"""The page of `tiltvp demo --page` in a real browser, Debian's chromium, without a network: by keyboard and touch."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from tiltvp.cli import demo_page, main

LEANS = (-16, 0, 16)
Frames = list[dict[str, str | None]]


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of few leans and a small panorama, in which one estimate was made wrong and one taken away."""
    path = tmp_path_factory.mktemp("page") / "page.html"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(demo_page, "LEANS_DEG", LEANS)
        patch.setattr(demo_page, "_PANORAMA_PX", 400)
        assert main(["demo", "--page", str(path)]) == 0
    text = path.read_text(encoding="utf-8")
    frames = frames_of(text)
    frames[0] |= {"verdict": "wrong", "error": "7.00", "level": frames[4]["level"]}
    frames[8] |= {"verdict": "none", "found": "too few observations"}
    frames[8].pop("level", None)
    data = json.dumps({"leans": LEANS, "frames": frames})
    path.write_text(re.sub(r'(application/json">).*?(</script>)', lambda found: found[1] + data + found[2], text))
    return path


def frames_of(text: str) -> Frames:
    found = re.search(r'application/json">(.*?)</script>', text, re.DOTALL)
    assert found is not None
    frames: Frames = json.loads(found[1])["frames"]
    return frames


def opened(browser: Browser, written: Path, complaints: list[str], **context: Any) -> Page:
    page = browser.new_context(offline=True, **context).new_page()
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda one: None if one.url.startswith(("file:", "data:")) else complaints.append(one.url))
    page.goto(written.as_uri())
    return page


def told(page: Page) -> str:
    return page.locator("#told").text_content() or ""


def picture(page: Page, name: str) -> str:
    return (page.locator(f"#{name}").get_attribute("src") or "").removeprefix("data:image/jpeg;base64,")


def test_sliders_by_the_keyboard_change_every_picture_and_the_numbers(browser: Browser, written: Path) -> None:
    complaints: list[str] = []
    page = opened(browser, written, complaints, viewport={"width": 1280, "height": 860})
    frames = frames_of(written.read_text(encoding="utf-8"))
    assert picture(page, "seen") == frames[4]["seen"]
    assert told(page).startswith("True lean upright.")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.id") == "front"
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Tab")
    page.keyboard.press("ArrowLeft")
    # To the front and to the left: third row, first column.
    for name in ("seen", "edges"):
        assert picture(page, name) == frames[6][name]
    assert "True lean 22.63° towards 45°" in told(page)
    assert page.locator("#right").get_attribute("aria-valuetext") == "-16°"
    assert page.evaluate("[...document.images].every(i => i.hidden || (i.complete && i.naturalWidth > 100))")
    assert complaints == []


def test_wrong_and_missing_estimates_are_shown_as_such(browser: Browser, written: Path) -> None:
    page = opened(browser, written, [], viewport={"width": 1280, "height": 860})
    border = "getComputedStyle(document.querySelector('.answer')).borderTopColor"
    right = page.evaluate(border)
    page.locator("#front").fill("0")
    page.locator("#right").fill("0")
    assert "WRONG: estimated" in told(page)
    assert "off by 7.00°" in told(page)
    assert page.locator("#level").is_visible()
    wrong = page.evaluate(border)
    page.locator("#front").fill("2")
    page.locator("#right").fill("2")
    assert "NO ANSWER: too few observations." in told(page)
    assert not page.locator("#level").is_visible()
    assert page.locator("#empty").is_visible()
    assert len({right, wrong, page.evaluate(border)}) == 3


def test_a_phone_shows_pictures_and_sliders_together_and_does_not_scroll_sideways(
    browser: Browser, written: Path
) -> None:
    complaints: list[str] = []
    size = {"width": 390, "height": 844}
    page = opened(browser, written, complaints, viewport=size, is_mobile=True, has_touch=True)
    assert page.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    for name in ("seen", "edges", "front", "right", "told"):
        box = page.locator(f"#{name}").bounding_box()
        assert box is not None
        assert box["y"] >= 0.0
        assert box["y"] + box["height"] <= size["height"], name
    before = told(page)
    slider = page.locator("#front").bounding_box()
    assert slider is not None
    assert slider["height"] >= 32.0
    page.touchscreen.tap(slider["x"] + 0.97 * slider["width"], slider["y"] + 0.5 * slider["height"])
    assert told(page) != before
    assert complaints == []
