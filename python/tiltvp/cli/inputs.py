"""From the words on the command line to image files, and from these to the names of what is written for them."""

from __future__ import annotations

import glob
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final

IMAGE_ENDINGS: Final = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm", ".pnm", ".webp", ".jp2")


def find_images(words: Sequence[str]) -> tuple[list[Path], list[str]]:
    """The image files that files, folders and glob patterns name, each once, and what is wrong with the words.

    A folder stands for the images directly in it, a pattern for what it matches (`**` for folders below), both sorted.
    """
    files: list[Path] = []
    problems: list[str] = []
    for word in words:
        path = Path(word)
        if path.is_dir():
            found = _images_of(path)
            if not found:
                problems.append(f"{word}: a folder without images, expected files in {' '.join(IMAGE_ENDINGS)}")
        elif path.exists() or not glob.has_magic(word):
            found = [path]
        else:
            found = [Path(match) for match in sorted(glob.glob(word, recursive=True)) if not os.path.isdir(match)]
            if not found:
                problems.append(f"{word}: no file fits this pattern")
        files.extend(found)
    once = {os.path.realpath(file): file for file in reversed(files)}
    return [file for file in dict.fromkeys(files) if once[os.path.realpath(file)] is file], problems


def _images_of(folder: Path) -> list[Path]:
    return sorted(file for file in folder.iterdir() if file.suffix.lower() in IMAGE_ENDINGS and file.is_file())


def distinct_names(files: Sequence[Path]) -> list[str]:
    """A name without ending for each file: its stem, with folders in front and the ending behind where stems are equal.

    Names that differ only in case count as equal, as some file systems have it.
    """
    groups: dict[str, list[int]] = {}
    for i, file in enumerate(files):
        groups.setdefault(file.stem.lower(), []).append(i)
    names = [file.stem for file in files]
    for places in groups.values():
        if len(places) > 1:
            for i, name in zip(places, _told_apart([files[i] for i in places]), strict=True):
                names[i] = name
    return _numbered(names)


def _told_apart(files: Sequence[Path]) -> list[str]:
    """Names for files of one stem: as few folders as tell them apart, and the endings if one folder has several."""
    folders = [Path(os.path.abspath(file)).parent.parts[1:] for file in files]
    several = len(set(folders)) < len(folders)
    ends = [f"{file.stem}_{file.suffix.lstrip('.')}" if several else file.stem for file in files]
    for depth in range(0 if len(set(folders)) == 1 else 1, max(map(len, folders)) + 1):
        names = [
            "_".join([*parts[max(0, len(parts) - depth) :], end]) for parts, end in zip(folders, ends, strict=True)
        ]
        if len({name.lower() for name in names}) == len(names):
            return names
    return ["_".join([*parts[-1:], end]) for parts, end in zip(folders, ends, strict=True)]


def _numbered(names: list[str]) -> list[str]:
    """The names, with a number where two are still equal."""
    taken: set[str] = set()
    for i, name in enumerate(names):
        number, candidate = 2, name
        while candidate.lower() in taken:
            candidate, number = f"{name}_{number}", number + 1
        names[i] = candidate
        taken.add(candidate.lower())
    return names
