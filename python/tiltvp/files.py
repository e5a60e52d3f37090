"""The doors to files: what is read is a regular file of a limited size, what is written appears whole or not at all."""

from __future__ import annotations

import errno
import mimetypes
import os
import re
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import Final

from tiltvp.arguments import path_from
from tiltvp.errors import InvalidInputError, OutputError, TiltvpError

__all__ = [
    "check_output",
    "check_output_folder",
    "check_replacing",
    "check_toml",
    "is_file_name",
    "keeping_existing",
    "keeps_existing",
    "read_bytes",
    "read_text",
    "refuse_file_name",
    "scratch_folder",
    "whole_file",
    "whole_folder",
    "write_whole",
]

_OTHER_FILES: Final = (".jp2", ".json", ".m4v", ".mcap", ".mkv", ".parquet", ".pdf", ".toml", ".yaml")
"""Endings of files that `mimetypes` does not know, or not by what they are."""
_HEX: Final = re.compile("[0-9a-f]{16}")
_KEEPS: Final[ContextVar[bool]] = ContextVar("keeps", default=False)


def read_bytes(path: str | os.PathLike[str], most: int) -> bytes:
    """The content of a regular file of at most so many bytes; pipes and devices are refused. Raises `OSError`."""
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
    try:
        handle = os.open(path, flags)
    except ValueError:
        raise OSError(errno.EINVAL, "a name with a zero byte") from None
    with open(handle, "rb") as stream:
        state = os.fstat(handle)
        if stat.S_ISDIR(state.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        if not stat.S_ISREG(state.st_mode):
            raise OSError(errno.EINVAL, "is no regular file")
        content = b"" if state.st_size > most else stream.read(state.st_size + 1)
        if len(content) > state.st_size:
            # It grows, or does not tell its size, as in /proc.
            content += stream.read(most + 1 - len(content))
    size = max(state.st_size, len(content))
    if size > most:
        raise OSError(errno.EFBIG, f"larger than {most} bytes: {size}")
    return content


def read_text(path: str | os.PathLike[str], most: int) -> str:
    """The same as UTF-8, with or without a mark at its beginning. Raises `OSError` and `UnicodeDecodeError`."""
    return read_bytes(path, most).decode("utf-8-sig")


@contextmanager
def keeping_existing() -> Iterator[None]:
    """Within, outputs that exist are refused, not replaced."""
    token = _KEEPS.set(True)
    try:
        yield
    finally:
        _KEEPS.reset(token)


def keeps_existing() -> bool:
    """Whether outputs that exist are refused."""
    return _KEEPS.get()


def check_output(path: str | os.PathLike[str]) -> None:
    """Refuses what no file can be written to, before any work is done: what is no regular file, what is to be kept, and
    what is in a folder that may not be written to.

    Raises `OutputError` or `InvalidInputError`.
    """
    file = path_from(path)
    _check_writable(file)
    try:
        state = os.stat(file)
    except FileNotFoundError:
        return
    except (OSError, ValueError) as error:
        raise _failed(path, error) from None
    if not stat.S_ISREG(state.st_mode):
        what = "a folder" if stat.S_ISDIR(state.st_mode) else "no regular file"
        raise OutputError(f"{os.fspath(path)}: cannot be written (is {what}), expected a file")
    if keeps_existing():
        raise InvalidInputError(f"{os.fspath(path)}: exists, expected a new file, or --overwrite to replace it")


def check_toml(path: str | os.PathLike[str]) -> None:
    """Refuses a name that promises another format than our own. Raises `InvalidInputError`."""
    ending = path_from(path).suffix
    if ending.lower() != ".toml":
        raise InvalidInputError(
            f"{os.fspath(path)}: ends in {ending!r}, expected .toml (tiltvp.formats.write_cameras has other formats)"
        )


def check_replacing(what: str) -> None:
    """Refuses to replace what a file has within it where outputs are kept. Raises `InvalidInputError`."""
    if keeps_existing():
        raise InvalidInputError(f"{what}, expected none, or --overwrite to replace it")


def check_output_folder(path: str | os.PathLike[str]) -> None:
    """Refuses a file, or its name, a folder that is to be kept: one that holds anything, and one that may not be
    written to.

    Raises `InvalidInputError` or `OutputError`.
    """
    folder = path_from(path)
    refuse_file_name(folder)
    _check_writable(folder)
    if folder.exists() and not folder.is_dir():
        raise InvalidInputError(f"{folder}: is a file, expected a folder")
    if keeps_existing() and folder.is_dir() and any(folder.iterdir()):
        raise InvalidInputError(f"{folder}: exists, expected a new or empty folder, or --overwrite to replace it")


def refuse_file_name(folder: Path) -> None:
    """Refuses the name of a file for a folder that is to be made. Raises `InvalidInputError`."""
    if is_file_name(folder):
        raise InvalidInputError(f"{folder}: ends in {folder.suffix!r} as a file does, expected a folder")


def is_file_name(path: Path) -> bool:
    """Whether a name is that of a picture, a video, a text or data, and no folder that is there."""
    kind, _ = mimetypes.MimeTypes().guess_type(path.name, strict=False)
    known = (kind or "").startswith(("image/", "video/", "text/")) or path.suffix.lower() in _OTHER_FILES
    return known and not path.is_dir()


def _check_writable(path: Path) -> None:
    """Refuses an output where the nearest folder that is there may not be written to."""
    try:
        folder = os.path.realpath(path)
    except (OSError, ValueError):
        return  # What is wrong with the name is told where it is written.
    while not os.path.isdir(folder):
        folder = os.path.dirname(folder)
    if not os.access(folder, os.W_OK | os.X_OK):
        why = f"its folder {folder} may not be written to"
        raise OutputError(f"{path}: cannot be written ({why}), expected a place that can")


def write_whole(path: str | os.PathLike[str], content: bytes | str) -> None:
    """Writes a file that appears whole or not at all, text as UTF-8. Raises as `whole_file`."""
    with whole_file(path) as part:
        part.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A file beside `path`, to be filled in the block; at its end, and on the disk, it takes the place of `path`.

    After any failure it is removed, and so is what killed processes have left of the same output. If the block removes
    it, nothing happens to `path`. Folders above are made. Raises `OutputError` where it cannot be written,
    `InvalidInputError` where `path` exists and is to be kept.
    """
    check_output(path)
    with _part_of(path, _new_file, follow=True) as (part, target):
        yield part
        if part.exists():
            with open(part, "rb+") as written:
                os.fsync(written.fileno())
            os.replace(part, target)
            _sync_folder(target.parent)


@contextmanager
def whole_folder(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A new folder beside `path`, to be filled in the block; at its end it takes the place of `path`, which may exist.

    After any failure it is removed, and so is what killed processes have left of the same output. Raises `OutputError`.
    """
    with _part_of(path, _new_folder, follow=False) as (part, target):
        yield part
        if target.exists():
            # A folder cannot replace a full one: the earlier one steps aside first, and comes back if that fails.
            old = part.with_suffix(".old")
            target.rename(old)
            try:
                part.rename(target)
            except OSError:
                old.rename(target)
                raise
            _remove(old)
        else:
            part.rename(target)


@contextmanager
def scratch_folder(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A folder beside the output `path` for what must be made before it, removed at the end of the block.

    What killed processes have left of it is removed by the next one that writes `path`. Raises `OutputError`.
    """
    with _part_of(path, _new_folder, follow=True) as (part, _):
        yield part


@contextmanager
def _part_of(path: str | os.PathLike[str], make: Callable[[Path], int], *, follow: bool) -> Iterator[tuple[Path, Path]]:
    """A locked part beside `path`, and where `path` is. With `follow` that is where links lead, and has its ending.

    What is left of the part at the end of the block is removed. Raises `OutputError`.
    """
    part = None
    try:
        target = Path(os.path.realpath(path)) if follow else path_from(path).absolute()
        target.parent.mkdir(parents=True, exist_ok=True)
        part, handle = _locked_beside(target, target.suffix if follow else "", make)
        try:
            yield part, target
        finally:
            os.close(handle)
    except TiltvpError:
        raise
    except (OSError, ValueError) as error:
        if part is not None and not isinstance(error, OSError | UnicodeError):
            raise  # Nothing of files: of a name that cannot be there would be no part.
        raise _failed(path, error) from error
    finally:
        if part is not None:
            _remove(part)


def _failed(path: str | os.PathLike[str], error: OSError | ValueError) -> OutputError:
    why = (error.strerror if isinstance(error, OSError) else None) or error
    return OutputError(f"{os.fspath(path)}: cannot be written ({why}), expected a place that can")


def _new_file(part: Path) -> int:
    return os.open(part, os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)


def _new_folder(part: Path) -> int:
    part.mkdir()
    return os.open(part if sys.platform != "win32" else os.devnull, os.O_RDONLY)


def _locked_beside(target: Path, ending: str, make: Callable[[Path], int]) -> tuple[Path, int]:
    """A part beside the target that is locked as long as its handle is open, so that a dead process's is known."""
    stem = target.name.removesuffix(ending)
    _sweep(target.parent, f".{stem}.", (f".part{ending}", ".old"))
    while True:
        part = target.with_name(f".{stem}.{os.urandom(8).hex()}.part{ending}")
        handle = make(part)
        with suppress(OSError):
            _lock(handle)
        if part.exists():
            return part, handle
        # Somebody who sweeps has come between the making and the lock.
        os.close(handle)


def _remove(part: Path) -> None:
    if not part.is_dir():
        with suppress(OSError):
            part.unlink()
        return
    # It brings five modules, a twentieth of what importing the package takes, and most programs make no folder.
    import shutil

    shutil.rmtree(part, ignore_errors=True)


def _sweep(folder: Path, begin: str, ends: tuple[str, ...]) -> None:
    """Removes the parts of processes that were killed."""
    try:
        # Once, and without patterns: pictures are written beside all those before them.
        names = os.listdir(folder)
    except OSError:
        return  # One may write where one may not look.
    random = slice(len(begin), len(begin) + 16)
    for name in names:
        if not (name.startswith(begin) and name[random.stop :] in ends and _HEX.fullmatch(name[random])):
            continue
        with suppress(OSError):
            handle = os.open(folder / name, os.O_RDONLY)
            try:
                _lock(handle)
                _remove(folder / name)
            finally:
                os.close(handle)


def _lock(handle: int) -> None:
    """Takes the lock till the handle is closed. Raises `OSError` where another process has it or there are none."""
    if sys.platform == "win32":
        raise OSError(errno.ENOSYS, "no such locks")
    import fcntl

    fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _sync_folder(folder: Path) -> None:
    """Brings the new name to the disk too, where folders can be opened."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
