"""`--cluster`: images on many machines, their answers as a folder of Parquet files that can be gone on with."""

from __future__ import annotations

import io
import json
import os
import pickle
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tiltvp.cli.sources import picture_names
from tiltvp.cli.tables import Table, need_lab
from tiltvp.cli.terminal import progress_bar
from tiltvp.errors import InvalidInputError, RunError
from tiltvp.files import check_output, write_whole

if TYPE_CHECKING:
    import polars as pl

    from tiltvp.streams import Frame, Frames
    from tiltvp.streams.image_files import ImageFiles

__all__ = ["Each", "Task", "check_cluster", "files_of", "is_begun", "on_cluster"]

_CHUNK: Final = 100
"""Images of a task and of a file: a second or so of 640 x 480 pixels, half a minute of 12 megapixels, is lost with a
worker; a million images make 10,000 files."""
_MANIFEST: Final = "manifest.json"
Item = tuple[str, str, float | None]
"""File, name of what is written for it, and time of an image."""
Each = Callable[[Sequence[tuple["Frame", str]]], Table]
"""What a worker does: images with their names to a row for each."""


@dataclass(frozen=True)
class Task:
    """What is done with all images, and what must be the same to go on with it."""

    verb: str
    each: Each
    """Can be pickled."""


def check_cluster(out: Path | None, **others: object) -> None:
    """Refuses what cannot be with --cluster, before any work is done; `others` are options and what was given."""
    for name, given in others.items():
        if given is not None and given is not False:
            raise InvalidInputError(f"--{name.replace('_', '-')} with --cluster, expected one of them")
    if out is None or out.suffix or (out.exists() and not out.is_dir()):
        raise InvalidInputError(f"--cluster with --out {out or 'not given'}, expected a folder for Parquet files")
    need_lab("--cluster")


def is_begun(folder: Path) -> bool:
    """Whether an earlier --cluster has written there."""
    return (folder / _MANIFEST).exists()


def files_of(frames: Frames) -> ImageFiles:
    """The frames, which must be image files: these can be read from everywhere, and in any order."""
    from tiltvp.streams.image_files import ImageFiles

    if not isinstance(frames, ImageFiles):
        raise InvalidInputError(f"--cluster with {frames.source}, expected images or folders of images")
    return frames


def on_cluster(address: str, frames: ImageFiles, task: Task, folder: Path) -> tuple[int, pl.LazyFrame]:
    """Does what is not yet done; how many images were done before, and the whole table, in the order of the images.

    Each part is written as it is done. Raises `RunError`, also for a folder with the answers of something else.
    """
    import polars as pl

    from tiltvp.lab.cluster import results_of
    from tiltvp.lab.evaluation.runs import kept, versions

    job = zlib.compress(pickle.dumps((versions(), task), protocol=5))
    folder.mkdir(parents=True, exist_ok=True)
    with kept(folder):
        _open(folder, _manifest(task, frames, versions()))
        starts = range(0, len(frames.files), _CHUNK)
        parts = {number: folder / f"part-{number:06d}.parquet" for number in range(len(starts))}
        missing = [number for number, part in parts.items() if not part.exists()]
        count = sum(min(_CHUNK, len(frames.files) - starts[number]) for number in missing)
        before = len(frames.files) - count
        with progress_bar(len(frames.files), "images", done=before, told=frames.told) as bar:
            for number, table in results_of(address, _do, job, _chunks(frames, set(missing))) if missing else ():
                _rename(table, frames.files[starts[number] : starts[number] + _CHUNK])
                memory = io.BytesIO()
                table.frame().write_parquet(memory)
                write_whole(parts[number], memory.getvalue())
                for row in table.rows:
                    problem = row.get("problem") or row["error"]
                    if problem is not None:
                        bar.blame(row["file"], problem)
                    bar.advance()
    return before, pl.scan_parquet(list(parts.values()))


def _chunks(frames: ImageFiles, numbers: set[int]) -> Iterator[tuple[int, list[Item]]]:
    """Files with whole paths, as workers have folders of their own."""
    chunk: list[Item] = []
    for place, (file, name) in enumerate(zip(frames.files, picture_names(frames), strict=True)):
        time_s = None if frames.times_s is None else float(frames.times_s[place])
        chunk.append((os.path.abspath(file), name, time_s))
        if len(chunk) == _CHUNK or place + 1 == len(frames.files):
            if place // _CHUNK in numbers:
                yield place // _CHUNK, chunk
            chunk = []


def _do(job: bytes, items: Sequence[Item]) -> Table:
    """The task of a worker."""
    from tiltvp.images import read_image
    from tiltvp.streams import Frame

    work = _prepared(job)
    return work.each(
        [(Frame(file, time_s, lambda file=file: read_image(file)), name) for file, name, time_s in items]  # type: ignore[misc]
    )


@lru_cache(maxsize=1)
def _prepared(job: bytes) -> Task:
    """What is to be done, with its tables, which are made once in each worker."""
    from tiltvp.lab.evaluation.runs import versions

    # A worker does whatever the scheduler says: it runs code that it is sent in any case.
    asked, task = pickle.loads(zlib.decompress(job))
    own = versions()
    for name in ("tiltvp", "core"):
        if own[name] != asked[name]:
            raise RunError(f"a worker has {name} {own[name]}, expected {asked[name]} as here")
    assert isinstance(task, Task)
    return task


def _rename(table: Table, files: Sequence[Path]) -> None:
    """Calls the files as they were called on the command line, as on one machine."""
    for row, file in zip(table.rows, files, strict=True):
        for name, cell in row.items():
            if isinstance(cell, str):
                row[name] = cell.replace(os.path.abspath(file), str(file))


def _manifest(task: Task, frames: ImageFiles, versions: dict[str, str]) -> dict[str, Any]:
    files = sha256()
    for file in frames.files:
        try:
            state = file.stat()
            told = f"{state.st_size} {state.st_mtime_ns}"
        except OSError:
            told = "none"
        files.update(f"{file}\0{told}\0".encode("utf-8", "surrogateescape"))
    return {
        "verb": task.verb,
        "images": len(frames.files),
        "files": files.hexdigest(),
        "options": sha256(pickle.dumps(task, protocol=5)).hexdigest(),
        "images of a part": _CHUNK,
        "tiltvp": versions["tiltvp"],
        "core": versions["core"],
    }


def _open(folder: Path, manifest: dict[str, Any]) -> None:
    """Makes the folder that of this work, or finds that it is; with --overwrite what is of another is removed."""
    path = folder / _MANIFEST
    if path.exists():
        try:
            earlier = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise RunError(f"{path}: cannot be read ({error}), expected what an earlier --cluster wrote") from error
        if earlier == manifest:
            return
        there = earlier if isinstance(earlier, dict) else {}
        different = ", ".join(name for name in manifest if there.get(name) != manifest[name])
        try:
            check_output(path)
        except InvalidInputError:
            hint = "expected the same, another folder, or --overwrite"
            raise RunError(f"{folder}: holds the answers of something else ({different} differ), {hint}") from None
        for part in folder.glob("part-*.parquet"):
            part.unlink()
    elif any(folder.glob("*.parquet")):
        raise RunError(f"{folder}: holds Parquet files and no {_MANIFEST}, expected a folder of its own")
    write_whole(path, json.dumps(manifest, indent=1) + "\n")
