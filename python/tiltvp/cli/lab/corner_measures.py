"""`tiltvp measure corners`: poses of corners against the truth, in closed form and in rendered sequences."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.options import ALL_CORES, AtLeast0, Seed, Threads
from tiltvp.cli.tables import write_frame
from tiltvp.cli.terminal import progress_bar, say
from tiltvp.errors import InvalidInputError
from tiltvp.files import check_output_folder

if TYPE_CHECKING:
    import polars as pl

    from tiltvp.lab.evaluation.corner_scenes import CornerScene
    from tiltvp.lab.evaluation.corners import CornerExperiment


def corners(
    *,
    poses: AtLeast0 = 100_000,
    noisy_poses: AtLeast0 = 2000,
    frames: AtLeast0 = 1000,
    scenes: Annotated[tuple[str, ...], Parameter(consume_multiple=True)] = (),
    rooms: AtLeast0 = 0,
    seed: Seed = 7001,
    threads: Threads = ALL_CORES,
    out: Path | None = None,
) -> None:
    """Poses of corners: the closed form on random poses, and rendered sequences of a hand-held stereo pair.

    Tables have the closed form's error, errors with noise against the Cramer-Rao bound, errors of attitude and position
    with flips in the sequences, of the published method and of OpenCV's ArUco markers beside ours, what an inertial
    sensor makes of the attitudes, and whether names of corners in rooms last.

    Parameters
    ----------
    poses
        Random poses with exact rays; 0 for none.
    noisy_poses
        Poses with noise of 0.3 pixels on rays of 200 pixels; 0 for none.
    frames
        Frames of the first sequence, the cuboid at 1280 x 720; the others have a tenth. 0 for none.
    scenes
        Only these sequences.
    rooms
        So many rooms of each kind in place of these sequences, each with a seed of its own and all of `--frames`, and a
        table over them.
    seed
        Seed of the first scene and motion.
    out
        Folder for the tables (Parquet) and the plots of errors over time (PNG).
    """
    from tiltvp.lab.evaluation import corner_closed_form as closed
    from tiltvp.lab.evaluation.corners import CornerExperiment

    chosen = _scenes(scenes, rooms)
    experiment = CornerExperiment(frames=frames, scenes=chosen, seed=seed) if frames else None
    if experiment is None and (scenes or rooms or out is not None):
        raise InvalidInputError("--scenes, --rooms and --out with --frames 0, expected frames")
    if experiment is None and not poses and not noisy_poses:
        raise InvalidInputError("--poses 0, --noisy-poses 0 and --frames 0, expected some of them")
    if out is not None:
        check_output_folder(out)
    if poses:
        with progress_bar(-(-poses // closed.BATCH), "batches of poses") as bar:
            exact = closed.exact_poses(poses, advance=bar.advance)
        show_frame("Closed form, exact rays: radians to the nearest hypothesis", closed.summarise_exact(exact), [])
    if noisy_poses:
        with progress_bar(noisy_poses, "noisy poses") as bar:
            noisy = closed.noisy_poses(noisy_poses, advance=bar.advance)
        title = "Closed form, 0.3 px of noise on rays of 200 px, against the Cramer-Rao bound"
        show_frame(title, closed.summarise_noisy(noisy), [])
    if experiment is not None:
        _sequences(experiment, threads, out, has_rooms=rooms > 0)


def _scenes(names: tuple[str, ...], rooms: int) -> tuple[CornerScene, ...]:
    """What the options name."""
    from tiltvp.lab.evaluation.corner_scenes import CORNER_SCENES, fresh_rooms

    if names and rooms:
        raise InvalidInputError(f"--scenes {' '.join(names)} and --rooms {rooms}, expected one of them")
    known = {scene.name: scene for scene in CORNER_SCENES}
    for name in names:
        if name not in known:
            raise InvalidInputError(f"--scenes {name!r}, expected some of {', '.join(known)}")
    return fresh_rooms(rooms) if rooms else tuple(known[name] for name in names) or CORNER_SCENES


def _sequences(experiment: CornerExperiment, threads: int, out: Path | None, *, has_rooms: bool) -> None:
    from tiltvp.images import write_image
    from tiltvp.lab.evaluation.corner_inertial import summarise_inertial_comparison
    from tiltvp.lab.evaluation.corners import measure_corners, summarise_corners, summarise_rooms
    from tiltvp.lab.plots.corners import corner_errors, inertial_errors
    from tiltvp.lab.plots.picture import figure_picture

    with progress_bar(sum(experiment.lengths()), "frames") as bar:
        table, inertial = measure_corners(experiment, threads=threads, advance=bar.advance)
    show_frame("Rendered sequences, errors of poses", summarise_corners(table), ["scene", "method"])
    if has_rooms:
        show_frame("Rooms", summarise_rooms(table, experiment.scenes), ["kind"])
    if inertial.height:
        summary = summarise_inertial_comparison(inertial)
        show_frame("With an inertial sensor, errors in degrees", summary, ["method"])
    named = _names(experiment, threads)
    if out is not None:
        write_frame(table, out / "corners.parquet")
        if named is not None:
            write_frame(named, out / "names.parquet")
        for key, part in table.partition_by("scene", "method", as_dict=True, maintain_order=True).items():
            name = ", ".join(map(str, key))
            file = out / f"{name.replace(', ', '-').replace(' ', '-')}.png"
            write_image(file, figure_picture(corner_errors(part, name)))
        if inertial.height:
            write_frame(inertial, out / "inertial.parquet")
            write_image(out / "inertial.png", figure_picture(inertial_errors(inertial)))
        say(f"{out}: tables and plots")


def _names(experiment: CornerExperiment, threads: int) -> pl.DataFrame | None:
    """The table of names of corners, shown; None without a room of 40 frames."""
    import polars as pl

    from tiltvp.lab.evaluation.corner_names import names_seen, summarise_names
    from tiltvp.lab.evaluation.corner_scenes import down_in

    rooms = [
        (scene, frames, experiment.seed + k)
        for k, (scene, frames) in enumerate(zip(experiment.scenes, experiment.lengths(), strict=True))
        if scene.kind != "laboratory" and frames >= 40
    ]
    if not rooms:
        return None
    rows = []
    with progress_bar(sum(frames for _, frames, _ in rooms), "frames of rooms") as bar:
        for scene, frames, seed in rooms:
            sequence = scene.sequence(frames, seed, threads)
            seen = names_seen(sequence, threads=threads, advance=bar.advance, down=down_in(sequence))
            rows += [{"scene": scene.name, "hidden": cover} | summarise_names(part) for cover, part in seen.items()]
    table = pl.DataFrame(rows)
    show_frame("Names of corners, 12 frames of each room hidden", table, ["scene", "hidden"])
    return table
