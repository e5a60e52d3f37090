"""What the tests of the calibration readers share: the reader of a text, its refusal, and a sample that is changed."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from calibration_texts import SAMPLES
from tiltvp.errors import CalibrationError
from tiltvp.formats import CameraSpec

Read = Callable[..., list[CameraSpec]]


def message(read: Read, text: str | bytes, **options: object) -> str:
    """The sentence with which a text is refused."""
    with pytest.raises(CalibrationError) as refusal:
        read(text, **options)
    return str(refusal.value)


def edited(key: str, *changes: tuple[str, str]) -> str:
    """A sample with parts of its text exchanged, each of which has to be there."""
    text = SAMPLES[key].text
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return text
