"""Datasets made of panoramas and of rendered rooms: any leans, any camera, the same bytes for any number of threads."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from tiltvp._core import normal_from_alpha_beta
from tiltvp.errors import InvalidInputError
from tiltvp.lab.datasets.new import NewDataset, in_order, new_dataset
from tiltvp.lab.datasets.panoramas import TABLE_1_TILTS_DEG, Panorama, PanoramaViews, read_panorama_index
from tiltvp.lab.datasets.rows import TiltImage
from tiltvp.synth import ROOM_KINDS, Room

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from tiltvp.cameras import Camera

__all__ = ["find_panoramas", "render_panoramas", "render_rooms"]

Job = TypeVar("Job")

_ENDINGS: Final = (".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".bmp")


def find_panoramas(directory: str | os.PathLike[str], limit: int | None = None) -> list[tuple[int, Panorama]]:
    """The panoramas of a folder and their numbers: those of its INDEX.csv or, without one, all of its images.

    Images without an index are taken as level, and the folder as their environment. `limit` takes that many, evenly
    spread. Raises `InvalidInputError`.
    """
    folder = Path(directory)
    if (folder / "INDEX.csv").exists():
        panoramas = read_panorama_index(folder)
    else:
        if not folder.is_dir():
            raise InvalidInputError(f"{folder}: is no folder, expected one with equirectangular panoramas")
        files = sorted(file for file in folder.iterdir() if file.suffix.lower() in _ENDINGS)
        panoramas = [Panorama(file.stem, file, folder.absolute().name, None) for file in files]
        if not panoramas:
            raise InvalidInputError(f"{folder}: no images, expected equirectangular panoramas")
    numbered = list(enumerate(panoramas))
    if limit is None or limit >= len(numbered):
        return numbered
    if limit < 1:
        raise InvalidInputError(f"limit = {limit}, expected 1 or more panoramas")
    return [numbered[k * len(numbered) // limit] for k in range(limit)]


def render_panoramas(
    panoramas: Sequence[tuple[int, Panorama]],
    camera: Camera,
    out: str | os.PathLike[str],
    *,
    tilts_deg: Sequence[tuple[float, float]] = TABLE_1_TILTS_DEG,
    robot_from_camera: ArrayLike | None = None,
    samples: int = 2,
    noise_sigma: float = 2.0,
    turn: bool = False,
    seed: int = 0,
    threads: int = 1,
    source: dict[str, Any] | None = None,
    force: bool = False,
    advance: Callable[[], None] = lambda: None,
) -> None:
    """A dataset of views of numbered panoramas (`find_panoramas`) at each of the leans; a location is a panorama.

    `samples` x `samples` rays are averaged in each pixel, noise is in grey levels. With `turn` each view has a heading
    of its own; headings and noise are drawn by `seed`, the panorama's number and the lean's. `source` is added to what
    is written of the making. `advance` is called after each panorama.
    """
    tilts = _checked(tilts_deg)
    about = {"kind": "panoramas", "locations": len(panoramas), "samples": samples, "noise_sigma": noise_sigma}
    about |= {"turn": turn, "seed": seed, "tilts_deg": " ".join(f"{alpha:g},{beta:g}" for alpha, beta in tilts)}
    _check_noise(noise_sigma)
    names = [panorama.name for _, panorama in panoramas]
    for place, name in enumerate(names):
        if name in names[:place]:
            raise InvalidInputError(f"two panoramas are named {name}, expected a name of its own for each")
    stop = Event()
    with new_dataset(
        out, camera, robot_from_camera=robot_from_camera, source=about | (source or {}), force=force
    ) as new:

        def render(numbered: tuple[int, Panorama]) -> list[TiltImage]:
            number, panorama = numbered
            views = PanoramaViews(panorama, camera, robot_from_camera=robot_from_camera, samples=samples)
            draws = np.random.default_rng(number + _far_apart(seed))
            headings = draws.uniform(-math.pi, math.pi, len(tilts)) if turn else np.zeros(len(tilts))
            images = []
            for place, ((alpha_deg, beta_deg), yaw) in enumerate(zip(tilts, headings, strict=True)):
                if stop.is_set():
                    raise CancelledError
                alpha_rad, beta_rad = math.radians(alpha_deg), math.radians(beta_deg)
                gray = views.render(
                    normal_from_alpha_beta(alpha_rad, beta_rad),
                    yaw_rad=float(yaw),
                    noise_sigma=noise_sigma,
                    seed=1000 * number + place + _far_apart(seed),
                )
                images.append(
                    new.write(
                        f"{panorama.name}_{place:02d}",
                        gray,
                        location=panorama.name,
                        environment=panorama.location,
                        alpha_rad=alpha_rad,
                        beta_rad=beta_rad,
                        yaw_rad=float(yaw),
                    )
                )
            return images

        _fill(new, render, panoramas, threads, stop, advance)


def render_rooms(
    camera: Camera,
    out: str | os.PathLike[str],
    *,
    kinds: Sequence[str] = ROOM_KINDS,
    rooms: int = len(ROOM_KINDS),
    locations_per_room: int = 4,
    tilts_deg: Sequence[tuple[float, float]] = TABLE_1_TILTS_DEG,
    robot_from_camera: ArrayLike | None = None,
    camera_height_m: float | None = None,
    samples: int | None = None,
    noise_sigma: float = 2.0,
    seed: int = 0,
    threads: int = 1,
    source: dict[str, Any] | None = None,
    force: bool = False,
    advance: Callable[[], None] = lambda: None,
) -> None:
    """A dataset of views of seeded rooms, which take turns in kind, at each of the leans.

    A location is one place in one room, an environment a kind of room. Rooms, places and noise are drawn by `seed` and
    the numbers of room, place and lean. `advance` is called after each room.
    """
    tilts = _checked(tilts_deg)
    for kind in kinds:
        if kind not in ROOM_KINDS:
            raise InvalidInputError(f"kind {kind!r}, expected some of {', '.join(ROOM_KINDS)}")
    for name, value in (("rooms", rooms), ("locations_per_room", locations_per_room), ("kinds", len(kinds))):
        if value < 1:
            raise InvalidInputError(f"{name} = {value}, expected 1 or more")
    _check_noise(noise_sigma)
    if seed < 0:
        raise InvalidInputError(f"seed = {seed}, expected 0 or more")
    about: dict[str, Any] = {"kind": "rooms", "kinds": list(kinds), "rooms": rooms}
    about |= {"locations_per_room": locations_per_room, "noise_sigma": noise_sigma, "seed": seed}
    about |= {"tilts_deg": " ".join(f"{alpha:g},{beta:g}" for alpha, beta in tilts)}
    about |= {name: value for name, value in (("samples", samples), ("camera_height_m", camera_height_m)) if value}
    stop = Event()
    # Threads that have no room of their own help with those of others.
    helping = max(1, threads // rooms)
    with new_dataset(
        out, camera, robot_from_camera=robot_from_camera, source=about | (source or {}), force=force
    ) as new:

        def render(number: int) -> list[TiltImage]:
            kind = kinds[number % len(kinds)]
            room = Room(kind, _drawn(seed, number), threads=helping)
            images = []
            for spot, pose in enumerate(room.free_poses(locations_per_room, _drawn(seed, number, 0))):
                for place, (alpha_deg, beta_deg) in enumerate(tilts):
                    if stop.is_set():
                        raise CancelledError
                    alpha_rad, beta_rad = math.radians(alpha_deg), math.radians(beta_deg)
                    view = room.render(
                        camera,
                        pose=pose,
                        alpha_rad=alpha_rad,
                        beta_rad=beta_rad,
                        robot_from_camera=robot_from_camera,
                        camera_height_m=camera_height_m,
                        noise_sigma=noise_sigma,
                        samples=samples,
                        seed=_drawn(seed, number, 1 + spot, place),
                        threads=helping,
                    )
                    location = f"{kind}-{number:03d}-{spot:02d}"
                    images.append(
                        new.write(
                            f"{location}_{place:02d}",
                            view.gray,
                            location=location,
                            environment=kind,
                            alpha_rad=alpha_rad,
                            beta_rad=beta_rad,
                        )
                    )
            return images

        _fill(new, render, range(rooms), threads, stop, advance)


def _fill(
    new: NewDataset,
    render: Callable[[Job], list[TiltImage]],
    jobs: Sequence[Job],
    threads: int,
    stop: Event,
    advance: Callable[[], None],
) -> None:
    with in_order(render, jobs, threads, stop) as results:
        for images in results:
            new.images.extend(images)
            advance()


def _checked(tilts_deg: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    tilts = [(float(alpha), float(beta)) for alpha, beta in tilts_deg]
    for alpha, beta in tilts:
        if not (0.0 <= alpha <= 90.0 and math.isfinite(beta)):
            raise InvalidInputError(f"tilt {alpha:g}, {beta:g}, expected alpha from 0 to 90 degrees and a finite beta")
    if not tilts:
        raise InvalidInputError("no tilts, expected one or more")
    return tilts


def _check_noise(noise_sigma: float) -> None:
    if not 0.0 <= noise_sigma <= 255.0:
        raise InvalidInputError(f"noise_sigma = {noise_sigma}, expected grey levels from 0 to 255")


def _far_apart(seed: int) -> int:
    """Seeds so far from each other that numbers of images can be added."""
    if seed < 0:
        raise InvalidInputError(f"seed = {seed}, expected 0 or more")
    return seed << 32


def _drawn(*numbers: int) -> int:
    """A seed below 2^64 for a tuple of numbers."""
    return int(np.random.SeedSequence(numbers).generate_state(1, np.uint64)[0])
