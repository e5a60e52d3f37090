"""`tiltvp measure descriptors`: figures 9 to 18 and 22 of Scaramuzza et al. 2009 on drives of known edges."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.options import ALL_CORES, AtLeast0, Seed, Threads
from tiltvp.cli.tables import write_frame
from tiltvp.cli.terminal import progress_bar, say
from tiltvp.errors import InvalidInputError
from tiltvp.files import check_output_folder


def descriptors(
    drives: Annotated[list[Path], Parameter(consume_multiple=True)],
    /,
    *,
    out: Path,
    frame: AtLeast0 = 0,
    tracked: AtLeast0 = 240,
    seed: Seed = 0,
    threads: Threads = ALL_CORES,
) -> None:
    """How well the descriptor of vertical lines tells them apart, on drives of known edges (sections 5 and 6).

    Tables and pictures: similarity matrices of one frame for the descriptor, SSD and ZNCC; correct matches over clip,
    noise, bins and areas; densities of correct and false matches for the three rules; the tracks of the first frames.

    Parameters
    ----------
    drives
        Folders that `tiltvp dataset drive` has written.
    out
        Folder for the pictures and tables.
    frame
        The frame of the first drive whose directions are compared with each other.
    tracked
        How many frames of the first drive are followed for the plot of tracks.
    seed
        Seed of the noise that is added.
    """
    from tiltvp.images import write_image
    from tiltvp.lab.datasets.driven import read_drive
    from tiltvp.lab.evaluation.descriptor_summary import RULES, alike, rules
    from tiltvp.lab.evaluation.descriptors import DescriptorExperiment, follow, measure_descriptors, similarity
    from tiltvp.lab.plots.descriptors import correct_matches, rule_densities, similarity_matrices
    from tiltvp.lab.plots.picture import figure_picture
    from tiltvp.lab.plots.tracks import track_plot

    check_output_folder(out)
    known = [read_drive(directory) for directory in drives]
    if frame >= len(known[0]):
        raise InvalidInputError(f"--frame {frame}, expected one of the {len(known[0])} frames of {drives[0]}")
    experiment = DescriptorExperiment(seed=seed)
    with progress_bar(experiment.steps * len(known), "settings") as bar:
        tables = measure_descriptors(known, experiment, threads=threads, advance=bar.advance)
    directions = similarity(known[0], frame)
    followed = follow(known[0], tracked)
    frames = {
        "similarity": directions, "settings": tables.settings, "measures": tables.measures, "matches": tables.matches,
        "tracks": followed,
    }  # fmt: skip
    for name, table in frames.items():
        write_frame(table, out / f"{name}.parquet")
    for name, figure in {
        "similarity": similarity_matrices(directions),
        "settings": correct_matches(tables.settings),
        "rules": rule_densities(tables.matches, RULES),
        "tracks": track_plot(followed),
    }.items():
        write_image(out / f"{name}.png", figure_picture(figure))
    total = sum(len(drive) for drive in known)
    show_frame("Directions that look alike (figures 9, 11, 12)", alike(directions), ["measure"])
    show_frame(f"Nearest is the same edge, {total} frames (figures 13 to 15)", tables.settings, ["sweep", "chart"])
    measures = tables.measures.pivot("frames_apart", index="measure", values="correct_%")
    show_frame("Nearest is the same edge, by frames apart, per cent", measures, ["measure"])
    show_frame("What the rules keep out (figures 16 to 18)", rules(tables.matches), ["rule"])
    show_frame("Matched between frames 1 to 2 m apart", tables.wide, ["matcher"])
    say(f"{out}: pictures and tables")
