"""Drives as folders: frames, odometry, and the true identity of every upright edge; the same bytes for any threads."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import CancelledError
from threading import Event
from typing import Any, Final

from tiltvp.cameras import Camera
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.new import in_order, new_dataset
from tiltvp.lab.datasets.rows import TiltImage
from tiltvp.synth import ROOM_KINDS, Drive, DriveTruth, Room

__all__ = ["DRIVE_KINDS", "OPEN_KINDS", "POSES", "TRUTH", "drive_room", "write_drive"]

_PLACES: Final = {"corridor": ("corridor", 2.0), "hall": ("office", 2.0)}
"""Kind of room and how many times larger than usual it is."""

DRIVE_KINDS: tuple[str, ...] = ("corridor", "hall", *(kind for kind in ROOM_KINDS if kind != "corridor"))
"""Places to drive in: a long corridor, a hall with pillars, and the rooms of `ROOM_KINDS`."""

OPEN_KINDS: Final = tuple(kind for kind in ROOM_KINDS if kind != "under-table")
"""Rooms of `ROOM_KINDS` but those under tables, where no image tells which way is up, and the world looks much the same
after half a turn: upright min-warping takes one for the other in a quarter of the pairs, which drowns what a lean does.
"""

_ODOMETRY: Final = ("file", "left_m", "right_m", "distance_m", "yaw_rad")
POSES: Final = ("frame", "file", "x_m", "y_m", "yaw_rad", "alpha_rad", "beta_rad", "left_m", "right_m")
"""Columns of poses.csv."""
TRUTH: Final = (
    "frame",
    "edge",
    "bearing_rad",
    "elevation_low_rad",
    "elevation_high_rad",
    "visible_share",
    "contrast",
)
"""Columns of truth.csv."""
_EDGES: Final = ("edge", "x_m", "y_m", "low_m", "high_m")


def drive_room(
    kind: str,
    seed: int = 0,
    *,
    extent: float | None = None,
    floor_gloss: float | None = None,
    wall_pattern: str | None = None,
    threads: int | None = None,
) -> Room:
    """A room of one of `DRIVE_KINDS` with a floor that shines (None: 0.4). Raises `InvalidInputError`."""
    if kind not in DRIVE_KINDS:
        raise InvalidInputError(f"kind {kind!r}, expected one of {', '.join(DRIVE_KINDS)}")
    own, usual = _PLACES.get(kind, (kind, 1.0))
    size = usual if extent is None else extent
    return Room(
        own,
        seed,
        extent=size,
        floor_gloss=0.4 if floor_gloss is None else floor_gloss,
        wall_pattern=wall_pattern,
        # Large rooms have many lamps.
        light_spacing_m=0.15 if size < 1.5 else 0.3,
        threads=threads,
    )


def write_drive(
    drive: Drive,
    out: str | os.PathLike[str],
    *,
    threads: int = 1,
    source: dict[str, Any] | None = None,
    force: bool = False,
    advance: Callable[[], None] = lambda: None,
) -> None:
    """A dataset of all frames of a drive, whole or not at all, each a location of its own; and beside it:

    odometry.csv (file, left_m, right_m, distance_m, yaw_rad: what the encoders say, as `read_odometry` takes it),
    poses.csv (the true pose, lean and wheels of each frame), edges.csv (where each upright edge stands), truth.csv (the
    edges in sight at each frame, as `DriveTruth`), and drive.toml (room, robot and seeds). `advance` is called after
    each frame. Raises `InvalidInputError`.
    """
    digits = max(6, len(str(len(drive) - 1)))
    names = [f"{frame:0{digits}d}" for frame in range(len(drive))]
    stop = Event()
    room, camera = drive.room, Camera.from_dict(drive.camera.to_dict())
    with new_dataset(
        out,
        camera,
        robot_from_camera=drive.robot_from_camera,
        source={"kind": "drive"} | (source or {}),
        force=force,
    ) as new:

        def render(frame: int) -> tuple[TiltImage, DriveTruth]:
            if stop.is_set():
                raise CancelledError
            view = drive.render(frame, threads=1)
            image = new.write(
                names[frame],
                view.gray,
                location=names[frame],
                environment=room.kind,
                alpha_rad=view.alpha_rad,
                beta_rad=view.beta_rad,
            )
            return image, drive.truth(frame, threads=1)

        truth: list[tuple[object, ...]] = []
        with in_order(render, range(len(drive)), threads, stop) as results:
            for frame, (image, seen) in enumerate(results):
                new.images.append(image)
                truth.extend(_truth_rows(frame, seen))
                advance()
        files = [f"{name}.png" for name in names]
        read = zip(files, drive.odometry.tolist(), drive.motions.tolist(), strict=True)
        new.write_table("odometry.csv", _ODOMETRY, ((file, *wheels, *motion) for file, wheels, motion in read))
        state = zip(files, drive.poses.tolist(), drive.tilts.tolist(), drive.true_odometry.tolist(), strict=True)
        new.write_table("poses.csv", POSES, ((k, file, *a, *b, *c) for k, (file, a, b, c) in enumerate(state)))
        new.write_table("edges.csv", _EDGES, ((k, *edge) for k, edge in enumerate(drive.edges_m.tolist())))
        new.write_table("truth.csv", TRUTH, truth)
        new.write_toml("drive.toml", _description(drive))


def _truth_rows(frame: int, seen: DriveTruth) -> list[tuple[object, ...]]:
    columns = (seen.edges, seen.bearings_rad, *seen.elevations_rad.T, seen.visible_share, seen.contrast)
    return [(frame, *row) for row in zip(*(column.tolist() for column in columns), strict=True)]


def _description(drive: Drive) -> dict[str, Any]:
    room = drive.room
    x_m, y_m, yaw_rad, height_m = drive.mount
    return {
        "frames": len(drive),
        "seed": drive.seed,
        "room": {
            "kind": room.kind,
            "seed": room.seed,
            "extent": room.extent,
            "clutter": room.clutter,
            "daylight": room.daylight,
            "light_spacing_m": room.light_spacing_m,
            "floor_gloss": room.floor_gloss,
            "wall_pattern": room.wall_pattern,
        },
        "camera": {"x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad, "height_m": height_m},
        "wheels": {
            "base_m": drive.wheel_base_m,
            "encoder_k_m": drive.encoder_k_m,
            "radius_errors": list(drive.wheel_radius_errors),
        },
        "bumps_max_rad": drive.bumps_max_rad,
        "lighting": drive.lighting,
    }
