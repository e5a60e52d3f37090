"""Panoramas of rendered rooms, upright, with the index that real panoramas have: one source of views for both."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable, Sequence
from pathlib import Path

from tiltvp.errors import InvalidInputError
from tiltvp.files import check_output_folder, write_whole
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
    The index is written last. `advance` is called after each panorama. Raises `InvalidInputError` and `OutputError`.
    """
    for name, value in (("rooms", rooms), ("places", places)):
        if value < 1:
            raise InvalidInputError(f"{name} = {value}, expected 1 or more")
    check_output_folder(out)
    folder = Path(out)
    index = io.StringIO()
    writer = csv.writer(index)
    writer.writerow(("name", "environment", "tilt_x_deg", "tilt_z_deg"))
    for seed in range(first_seed, first_seed + rooms):
        for kind in kinds:
            room = Room(kind, seed)
            for place, pose in enumerate(room.free_poses(places, seed)):
                name = f"{kind}-{seed}-{place}"
                image = room.render_panorama(pose=pose, height=height, samples=2, seed=place)
                write_image(folder / f"{name}.jpg", image.gray)
                writer.writerow((name, f"{kind} {seed}", 0.0, 0.0))
                advance()
    write_whole(folder / "INDEX.csv", index.getvalue())
