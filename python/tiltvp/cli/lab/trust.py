"""`tiltvp measure trust`: how often estimates are wrong and sure, where images, cameras and mountings mislead them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.options import AtLeast0, AtLeast1, Seed, Switch
from tiltvp.cli.tables import check_ending, write_frame
from tiltvp.cli.terminal import progress_bar, say
from tiltvp.errors import InvalidInputError


def trust(
    panoramas: Annotated[list[Path], Parameter(consume_multiple=True)],
    /,
    *,
    count: AtLeast1 = 200,
    sets: AtLeast0 = 2,
    seed: Seed = 0,
    unseen: Switch = False,
    weights: Switch = False,
    out: Path | None = None,
) -> None:
    """Each method on images that mislead: answers, those wrong and sure, abstentions, reasons that name the cause.

    Mountings and lenses that are not as told, harmed views, and images without a vertical. An error beyond two degrees
    is wrong, a confidence from 0.9 on is sure.

    Parameters
    ----------
    panoramas
        Folders with panoramas and an INDEX.csv of columns name, environment, tilt_x_deg, tilt_z_deg.
    count
        Images of each case.
    sets
        Sets of five images of each building that `check_setup` is asked about, by weights that other buildings trained;
        with one or more, `check_lens` too.
    seed
        Seed of headings, leans and harm.
    unseen
        Only the half of the buildings on which nothing was set.
    weights
        Show images of the other half alone, and also print the weights that it trains, of the confidences, and, of all
        buildings, those of `check_setup`.
    out
        Also write the long table, one row for each image and method: .csv, .json or .parquet.
    """
    from tiltvp._core import METHODS
    from tiltvp.lab.datasets.hostile import CASES, hostile_images
    from tiltvp.lab.datasets.panoramas import read_panorama_index
    from tiltvp.lab.evaluation.hostile import judge_images, summarise_cases, train_trust
    from tiltvp.lab.evaluation.setups import image_sets, judge_lenses, summarise_sets, train_setups
    from tiltvp.lab.evaluation.trust import was_set_on

    check_ending(out)
    chosen = [
        panorama
        for folder in panoramas
        for panorama in read_panorama_index(folder)
        if not (unseen and was_set_on(panorama.location))
    ]
    if unseen and weights:
        raise InvalidInputError("--weights with --unseen: what trains them is left out, expected one of them")
    shown = [panorama for panorama in chosen if not weights or was_set_on(panorama.location)]
    if not shown:
        raise InvalidInputError(f"{', '.join(map(str, panoramas))}: no building of the half that is asked for")
    places = len({panorama.location for panorama in chosen})
    with progress_bar(count * len(CASES) + 2 * places, "images") as bar:
        images = hostile_images(shown, count=count, seed=seed)
        table = judge_images(images, features=weights, advance=bar.advance)
        asked = image_sets(chosen, sets=sets, seed=seed, advance=bar.advance)
        lenses = judge_lenses(chosen, seed=seed, advance=bar.advance) if sets else None
    if out is not None:
        write_frame(table.select(column for column in table.columns if column != "features"), out)
    title = f"Shares in per cent, of {count} images of each case, by {len(shown)} panoramas"
    show_frame(title, summarise_cases(table), ["method", "case"])
    for method in METHODS if weights else ():
        for what, (constant, own) in train_trust(table, method).items():
            say(f"{method}, {what}: {constant:.4g}; {', '.join(f'{weight:.4g}' for weight in own)}")
    if asked:
        show_frame("Sets of five images of one building: which direction is up", summarise_sets(asked), ["of", "setup"])
    if lenses is not None:
        show_frame("Sets of images of one building: whether its lens is believed", lenses, ["setup", "told"])
    if weights and asked:
        print(train_setups(asked).python())
