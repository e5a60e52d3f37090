"""Attacks on the whole program: `just survive`."""

from __future__ import annotations

import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable

import pytest

SECONDS = 5
"""What an attack may take of the processor."""
GIBIBYTE = 1 << 30
"""What memory an attack may take beside that of the packages, which are imported before it."""


def address_space() -> int:
    """Bytes of this process's address space."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[0]) * resource.getpagesize()


def survived(action: Callable[[], object]) -> str:
    """What is wrong with the way in which a fork of this process does something within its limits; empty if nothing is.

    It may end, or raise an exception of ours.
    """
    with tempfile.TemporaryFile("w+") as said:
        child = os.fork()
        if child == 0:
            code = 3
            try:
                from tiltvp.errors import TiltvpError

                limit = address_space() + GIBIBYTE
                resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
                resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
                # Of the processor, so that a busy machine changes nothing; what waits for something uses none.
                used = round(time.process_time())
                resource.setrlimit(resource.RLIMIT_CPU, (used + SECONDS, used + SECONDS))
                signal.signal(signal.SIGALRM, signal.SIG_DFL)
                signal.alarm(12 * SECONDS)
                try:
                    action()
                    code = 0
                except TiltvpError as error:
                    code = 0 if "\n" not in str(error) and len(str(error)) < 2100 else 4
                    said.write(str(error)[:300])
            except BaseException:
                said.write(traceback.format_exc()[-1500:])
            finally:
                said.flush()
                os._exit(code)
        _, status = os.waitpid(child, 0)
        if status == 0:
            return ""
        said.seek(0)
        end = f"signal {os.WTERMSIG(status)}" if os.WIFSIGNALED(status) else f"exit code {os.WEXITSTATUS(status)}"
        return f"{end}: {said.read()}"


@pytest.fixture(scope="session", autouse=True)
def on_linux() -> None:
    """Limits and forks are those of Linux."""
    assert sys.platform == "linux"
