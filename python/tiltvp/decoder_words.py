"""What decoders of images write to stderr themselves, without a file's name, which the command line leaves out."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

__all__ = ["left_out", "quietly"]

_STDERR: Final = 2
_LOCK: Final = threading.Lock()
_kept: list[int] = []
"""Where stderr goes when nothing is decoded; empty where decoders may write."""
_decoding = 0


@contextmanager
def left_out(stderr: int) -> Iterator[None]:
    """Within the block decoders write nowhere; `stderr` is an open duplicate of it, which stays open."""
    _kept.append(stderr)
    try:
        yield
    finally:
        _kept.remove(stderr)
        # An interrupt may have come within `quietly` before it heard of one.
        os.dup2(stderr, _STDERR)


@contextmanager
def quietly() -> Iterator[None]:
    """Something is decoded in the block, maybe in several threads."""
    global _decoding
    if not _kept:
        yield
        return
    kept = _kept[-1]
    with _LOCK:
        _decoding += 1
        if _decoding == 1:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, _STDERR)
            os.close(nowhere)
    try:
        yield
    finally:
        with _LOCK:
            _decoding -= 1
            if _decoding == 0:
                os.dup2(kept, _STDERR)
