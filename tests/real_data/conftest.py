"""The folder of real data, named by the environment variable TILTVP_DATA; without it these tests fail."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder that holds `calib_formats` and `omni`."""
    named = os.environ.get("TILTVP_DATA")
    if not named:
        pytest.fail("TILTVP_DATA is not set: it names the folder that holds calib_formats and omni")
    folder = Path(named)
    for part in ("calib_formats", "omni"):
        if not (folder / part).is_dir():
            pytest.fail(f"TILTVP_DATA={named} holds no folder {part}")
    return folder
