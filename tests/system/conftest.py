"""What the tests of this folder share: the report of a small run, and Debian's chromium."""

from __future__ import annotations

import shutil
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, sync_playwright

from reports import report, run

__all__ = ["browser", "report", "run"]


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """It draws in three dimensions by the processor: figures of a report want that."""
    path = shutil.which("chromium")
    assert path, "no chromium: `just test-system` installs it"
    arguments = ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader"]
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=path, args=arguments)
        yield started
        started.close()
