"""How long calls take."""

from __future__ import annotations

import time
from collections.abc import Callable


def times_s(work: Callable[[], object], rounds: int) -> list[float]:
    """Seconds of each of several calls."""
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return times
