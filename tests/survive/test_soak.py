"""A short soak: `just soak` goes on for an hour."""

from __future__ import annotations

import pytest

from soak import WARM_UP, soak


@pytest.mark.parametrize("seed", [2])
def test_a_short_soak(seed: int) -> None:
    totals = soak(0.0, 120, seed)
    assert totals["rounds"] == WARM_UP + 1
    assert totals["disks filled"] == WARM_UP + 1
    assert totals["gaps"] > 0
    assert totals["wrong sizes"] > 0
