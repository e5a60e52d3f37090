"""Work on a Dask cluster: tasks that workers do, done again where a worker dies, and their results as they come."""

from __future__ import annotations

import logging
import re
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from importlib import import_module
from itertools import islice
from typing import Any, Final, TypeVar

from tiltvp.errors import MissingExtraError, RunError

__all__ = ["results_of"]

_PATIENCE_S = 20.0
"""How long the scheduler may take to answer."""

_WORKERS_S = 120.0
"""How long there may be no worker."""

_POLL_S = 0.01
"""Between two looks for a result: little beside what a task takes."""

_WAITING: Final = 1024
"""Tasks that the scheduler holds at once, so that it and this process need the same memory for any number of them. A
cluster of a hundred workers with eight threads is never idle."""

Given = TypeVar("Given")
Made = TypeVar("Made")


def results_of(
    address: str, task: Callable[[Any, Given], Made], job: object, chunks: Iterable[tuple[int, Given]]
) -> Iterator[tuple[int, Made]]:
    """The numbers of the chunks and what `task(job, chunk)` made of each, as they come.

    Raises `MissingExtraError` if Dask is not installed, `RunError` if the scheduler does not answer, has no workers or
    has gone, and where a task has ended one worker after the other.
    """
    distributed = _dask()
    client = _client(distributed, address)
    left, numbers = iter(chunks), dict[str, int]()
    try:
        done = distributed.as_completed([], loop=client.loop, with_results=True)

        async def submitted(chunks: Iterable[Given]) -> list[Any]:
            """In Dask's own thread, where alone its tasks do not change while it goes through them."""
            return [client.submit(task, job, chunk, pure=False) for chunk in chunks]

        def submit(count: int) -> None:
            taken = dict(islice(left, count))
            futures = client.sync(submitted, taken.values())
            numbers.update((future.key, number) for future, number in zip(futures, taken, strict=True))
            done.update(futures)

        submit(_WAITING)
        try:
            for future, made in _as_they_come(distributed, done, client, address):
                if future.cancelled():  # What Dask made of it is then an error, or nothing.
                    raise distributed.CancelledError("its tasks are cancelled")
                yield numbers.pop(future.key), made
                submit(1)
        except distributed.KilledWorker as error:
            raise RunError(f"{address}: {error}, expected workers that live") from error
        except (distributed.CancelledError, distributed.client.ClosedClientError) as error:
            raise RunError(f"{address}: the scheduler has gone ({error}), expected one that lives") from error
    finally:
        _close(client)


def _as_they_come(distributed: Any, done: Any, client: Any, address: str) -> Iterator[tuple[Any, Any]]:
    """What `done` has; Dask itself waits for ever where no worker is left."""
    while not done.is_empty():
        seen_s = asked_s = time.monotonic()
        while not done.has_ready():
            if client.status != "running":  # A task that is given now Dask loses without a word.
                raise distributed.CancelledError("its connection is lost")
            time.sleep(_POLL_S)
            if time.monotonic() > asked_s + 1.0:
                asked_s = time.monotonic()
                with suppress(OSError):  # A scheduler that has gone: the tasks tell it.
                    seen_s = asked_s if client.nthreads() else seen_s
                if asked_s > seen_s + _WORKERS_S:
                    raise _without_workers(address)
        yield next(done)


def _without_workers(address: str) -> RunError:
    return RunError(f"{address}: a scheduler without workers for {_WORKERS_S:g} s, expected one or more")


def _close(client: Any) -> None:
    """Without the traceback that Dask logs where the scheduler has gone."""
    log = logging.getLogger("distributed.client")
    before = log.level
    log.setLevel(logging.CRITICAL)
    try:
        client.close()
    finally:
        log.setLevel(before)


def _dask() -> Any:
    try:
        return import_module("dask.distributed")
    except ImportError as error:
        raise MissingExtraError.of("a cluster", "cluster", error) from error


def _client(distributed: Any, address: str) -> Any:
    """A client of the scheduler, which has at least one worker."""
    if re.search(r"^inproc://|^((tcp|tls|ucx|wss?)://)?[^/]+:\d+$", address) is None:
        # Dask would look for it at the port 0, and wait, or leave a client that it cannot close.
        raise RunError(f"{address}: no address of a Dask scheduler, expected one with a port, as tcp://host:8786")
    try:
        client = distributed.Client(address, timeout=_PATIENCE_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise RunError(f"{address}: no Dask scheduler answers ({error}), expected one, as tcp://host:8786") from error
    try:
        client.wait_for_workers(1, timeout=_WORKERS_S)
    except TimeoutError as error:
        _close(client)
        raise _without_workers(address) from error
    return client
