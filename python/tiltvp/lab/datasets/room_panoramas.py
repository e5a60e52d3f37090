"""Panoramas of rendered rooms, upright, with the index that real panoramas have: one source of views for both."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Sequence
from pathlib import Path

from tiltvp.images import write_image
from tiltvp.synth import ROOM_KINDS, Room

__all__ = ["render_room_panoramas"]


def render_room_panoramas(
    out: str | os.PathLike[str],
    *,
    rooms: int = 4,
    places: int = 2,
    height: int = 768,
    first_seed: int = 0,
    kinds: Sequence[str] = ROOM_KINDS,
    advance: Callable[[], None] = lambda: None,
) -> None:
    """Writes panoramas of `places` places in each of `rooms` rooms of each kind, and their `INDEX.csv`.

    The index has the columns that `tiltvp.lab.datasets.panoramas.read_panorama_index` reads; a room is an environment.
    `advance` is called after each panorama. Raises `InvalidInputError`, `ImageFileError` and `OSError`.
    """
    folder = Path(out)
    rows = []
    for seed in range(first_seed, first_seed + rooms):
        for kind in kinds:
            room = Room(kind, seed)
            for place, pose in enumerate(room.free_poses(places, seed)):
                name = f"{kind}-{seed}-{place}"
                image = room.render_panorama(pose=pose, height=height, samples=2, seed=place)
                write_image(folder / f"{name}.jpg", image.gray)
                rows.append((name, f"{kind} {seed}", 0.0, 0.0))
                advance()
    with (folder / "INDEX.csv").open("w", newline="", encoding="utf-8") as lines:
        writer = csv.writer(lines)
        writer.writerow(("name", "environment", "tilt_x_deg", "tilt_z_deg"))
        writer.writerows(rows)
