"""The reader of a text as a calibration file."""

from __future__ import annotations

from pathlib import Path

import pytest

from calibration_reading import Read
from tiltvp.formats import read_cameras


@pytest.fixture
def read(tmp_path: Path) -> Read:
    """Reads a text as a file."""

    def read_text(text: str | bytes, format: str | None = None, image_size: tuple[int, int] | None = None):
        path = tmp_path / "calibration"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return read_cameras(path, format, image_size)

    return read_text
