"""A run of an evaluation as a folder: what it is made of, its parts while it grows, and the table when it is whole."""

from __future__ import annotations

import io
import json
import os
import platform
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from hashlib import sha256
from importlib import metadata
from pathlib import Path
from typing import Any, Final

import numpy as np
import polars as pl

from tiltvp import _core
from tiltvp.errors import OutputError, RunError
from tiltvp.files import write_whole
from tiltvp.lab.evaluation.schema import COLUMNS

__all__ = ["Run", "RunFolder", "kept", "new_manifest", "open_run", "read_run", "versions"]

_MANIFEST: Final = "manifest.json"
_TABLE: Final = "estimates.parquet"
_PARTS: Final = "parts"
_OWN: Final = re.compile(r"manifest\.json|estimates\.parquet|parts|\..*\.part\..*")


@dataclass(frozen=True)
class Run:
    """A whole run: what it is made of, and its long table (`tiltvp.lab.evaluation.schema`)."""

    manifest: dict[str, Any]
    table: pl.DataFrame


def versions() -> dict[str, str]:
    """The versions that decide about the numbers; `core` is a digest of the compiled extension."""
    return {
        "tiltvp": metadata.version("tiltvp"),
        "core": sha256(Path(_core.__file__).read_bytes()).hexdigest()[:16],
        "numpy": np.__version__,
        "polars": pl.__version__,
        "python": platform.python_version(),
    }


def new_manifest(
    *, dataset: Path, digest: str, images: int, sweep: str, combinations: list[dict[str, Any]], seed: int
) -> dict[str, Any]:
    """What a run is made of. Another sitting has to agree in all but the dataset's path, the machine and the date."""
    return {
        "dataset": {"path": str(dataset.resolve()), "digest": digest, "images": images},
        "sweep": sweep,
        "combinations": combinations,
        "seed": seed,
        "versions": versions(),
        "machine": {"cpu": _cpu(), "cores": os.cpu_count(), "system": platform.platform()},
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _cpu() -> str:
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


class RunFolder:
    """A run that grows by one part for each image. Whatever is killed at whatever moment, what is there is whole."""

    def __init__(self, directory: Path, manifest: dict[str, Any]) -> None:
        """Use `open_run`, which keeps others out."""
        self.directory, self.manifest = directory, manifest
        self._parts = directory / _PARTS

    @property
    def whole(self) -> bool:
        """Whether the table is there: nothing is left to do."""
        return (self.directory / _TABLE).exists()

    def done(self) -> set[int]:
        """The numbers of the images whose parts are there."""
        return {int(path.stem) for path in self._parts.glob("*.parquet") if path.stem.isdecimal()}

    def add(self, number: int, rows: pl.DataFrame) -> None:
        """Writes the part of an image."""
        write_whole(self._part(number), _parquet(rows))

    def parts(self) -> pl.DataFrame:
        """The rows of all parts, by image."""
        return pl.concat([pl.read_parquet(self._part(number)) for number in sorted(self.done())], rechunk=True)

    def finish(self, table: pl.DataFrame) -> Run:
        """Writes the table, and then deletes the parts."""
        write_whole(self.directory / _TABLE, _parquet(table))
        self.tidy()
        return Run(self.manifest, table)

    def tidy(self) -> None:
        """Deletes what an interrupted sitting has left: files half written, and the parts of a table that is there."""
        for path in [*self.directory.glob(".*.part.*"), *self._parts.glob(".*.part.*")]:
            path.unlink()
        if self.whole:
            for path in self._parts.glob("*.parquet"):
                path.unlink()
            with suppress(FileNotFoundError):
                self._parts.rmdir()

    def _part(self, number: int) -> Path:
        return self._parts / f"{number:06d}.parquet"


@contextmanager
def open_run(directory: Path, manifest: dict[str, Any]) -> Iterator[RunFolder]:
    """The folder of a run, begun now or in an earlier sitting of the same one; nobody else may write to it meanwhile.

    Raises `RunError` that names what differs if the folder holds a run of something else, and if it is in use or holds
    other files.
    """
    _make(directory)
    with kept(directory):
        path = directory / _MANIFEST
        if path.exists():
            earlier = _read_manifest(directory)
            _refuse_differences(directory, earlier, manifest)
            manifest = earlier
        else:
            others = sorted(entry.name for entry in directory.iterdir() if not _OWN.fullmatch(entry.name))
            if others:
                raise RunError(f"{directory}: holds {others[0]} and no {_MANIFEST}, expected an empty folder or a run")
            text = json.dumps(manifest, indent=1)
            write_whole(path, text + "\n")
        folder = RunFolder(directory, manifest)
        folder.tidy()
        if not folder.whole:
            _make(directory / _PARTS)
        yield folder


def read_run(directory: str | os.PathLike[str]) -> Run:
    """A run that is whole. Raises `RunError` for a folder that is none, or none yet."""
    folder = Path(directory)
    manifest = _read_manifest(folder)
    if not (folder / _TABLE).exists():
        done, images = len(list((folder / _PARTS).glob("[0-9]*.parquet"))), manifest["dataset"]["images"]
        raise RunError(f"{folder}: {done} of {images} images are done, expected a whole run: evaluate once more")
    try:
        table = pl.read_parquet(folder / _TABLE)
    except (OSError, pl.exceptions.PolarsError) as error:
        raise RunError(f"{folder / _TABLE}: cannot be read ({error}), expected the table of a run") from error
    if missing := [name for name in COLUMNS if name not in table.columns]:
        raise RunError(f"{folder / _TABLE}: no columns {', '.join(missing)}, expected a run of this version of tiltvp")
    return Run(manifest, table)


def _read_manifest(directory: Path) -> dict[str, Any]:
    path = directory / _MANIFEST
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RunError(f"{path}: {error.strerror or error}, expected the folder of a run") from error
    except ValueError as error:
        raise RunError(f"{path}: {error}, expected the manifest of a run") from error
    if not isinstance(manifest, dict) or not {"dataset", "combinations", "seed", "versions"} <= manifest.keys():
        raise RunError(f"{path}: not the manifest of a run, expected dataset, combinations, seed and versions in it")
    return manifest


def _refuse_differences(directory: Path, earlier: dict[str, Any], now: dict[str, Any]) -> None:
    """Names everything that differs; numbers are compared as they are after the way through JSON."""
    now = json.loads(json.dumps(now))
    found = _differences("dataset ", earlier["dataset"], now["dataset"], ("digest", "images"))
    if earlier["combinations"] != now["combinations"]:
        found.append(_difference_of_combinations(earlier["combinations"], now["combinations"]))
    found += _differences("", earlier, now, ("seed",))
    found += _differences("version of ", earlier["versions"], now["versions"], now["versions"])
    if found:
        raise RunError(f"{directory}: holds another run ({'; '.join(found)}), expected the same or another folder")


def _differences(what: str, there: dict[str, Any], now: dict[str, Any], names: Iterable[str]) -> list[str]:
    different = [name for name in names if there.get(name) != now[name]]
    return [f"{what}{name}: {there.get(name)} there, {now[name]} now" for name in different]


def _difference_of_combinations(there: list[dict[str, Any]], now: list[dict[str, Any]]) -> str:
    if len(there) != len(now):
        return f"combinations: {len(there)} there, {len(now)} now"
    first, second = next((a, b) for a, b in zip(there, now, strict=True) if a != b)
    if first["label"] != second["label"]:
        return f"combinations: {first['label']} there, {second['label']} now"
    a, b = first["options"], second["options"]
    name = next((name for name in b if a.get(name) != b[name]), "method")
    return f"{name} of {first['label']}: {a.get(name)} there, {b.get(name)} now"


def _make(directory: Path) -> None:
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        why = error.strerror or error
        raise OutputError(f"{directory}: cannot be written ({why}), expected a folder that can") from error


def _parquet(table: pl.DataFrame) -> bytes:
    memory = io.BytesIO()
    table.write_parquet(memory)
    return memory.getvalue()


@contextmanager
def kept(directory: Path) -> Iterator[None]:
    """Keeps other processes out until this one leaves or dies, where the system has such locks."""
    if sys.platform == "win32":
        yield
        return
    import fcntl

    handle = os.open(directory, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise RunError(f"{directory}: another process is at work on it, expected a folder of its own") from error
        yield
    finally:
        os.close(handle)
