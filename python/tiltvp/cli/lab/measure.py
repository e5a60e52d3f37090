"""`tiltvp measure`: the tilt methods on panoramas and rooms, and what they cost; other measures join here."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter, validators

from tiltvp.cli.declared_options import Whole
from tiltvp.cli.lab.body import body
from tiltvp.cli.lab.calibration_measures import calibration, calibration_images, trust_calibration, trust_pictures
from tiltvp.cli.lab.colmap import colmap
from tiltvp.cli.lab.corner_attitude_measures import corner_attitudes
from tiltvp.cli.lab.corner_measures import corners
from tiltvp.cli.lab.corner_real import corners_real
from tiltvp.cli.lab.descriptors import descriptors
from tiltvp.cli.lab.evaluate import determined_errors
from tiltvp.cli.lab.levelling import level
from tiltvp.cli.lab.line_measures import lines
from tiltvp.cli.lab.measure_options import (
    Every,
    NoiseSigma,
    Panoramas,
    PanoramasIfAny,
    Rooms,
    Samples,
    Saved,
    refuse_every,
)
from tiltvp.cli.lab.mounting import mounting
from tiltvp.cli.lab.planar_pose import planar_pose
from tiltvp.cli.lab.striding import striding
from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.lab.trust import trust
from tiltvp.cli.options import ALL_CORES, AtLeast1, Switch, Threads, at_least
from tiltvp.cli.root import group
from tiltvp.cli.tables import check_ending, write_frame
from tiltvp.cli.terminal import progress_bar, say
from tiltvp.errors import InvalidInputError

_SENSORS = Parameter(validator=validators.Number(gte=0.01, lte=100))
"""From 64 x 48 pixels to 31 megapixels."""
_SAMPLED_EVERY = 4

app = group("measure", "Measure how well all this works, where the truth is known.")
app.command(body)
app.command(calibration)
app.command(calibration_images)
app.command(colmap)
app.command(corner_attitudes)
app.command(corners)
app.command(corners_real)
app.command(descriptors)
app.command(level)
app.command(lines)
app.command(mounting)
app.command(planar_pose)
app.command(striding)
app.command(trust)
app.command(trust_calibration)
app.command(trust_pictures)


@app.command
def panoramas(
    directory: Panoramas,
    /,
    *,
    every: Every = 1,
    samples: Samples = 2,
    noise_sigma: NoiseSigma = 2.0,
    turn: Switch = False,
    out: Path | None = None,
) -> None:
    """Every method on views of upright panoramas through an upward fisheye, at the seven leans of the paper's table 1.

    Parameters
    ----------
    turn
        Give each view a heading of its own.
    out
        Also write the long table, one row for each image, combination and correction: .csv, .json or .parquet.
    """
    from tiltvp.lab.datasets.panoramas import paper_camera, read_panorama_index
    from tiltvp.lab.evaluation.combinations import choose
    from tiltvp.lab.evaluation.panoramas import evaluate_views
    from tiltvp.lab.evaluation.summary import variants

    check_ending(out)
    chosen = read_panorama_index(directory)[::every]
    with progress_bar(len(chosen), "panoramas") as bar:
        table = evaluate_views(
            chosen, paper_camera(), choose("table3"), samples=samples, noise_sigma=noise_sigma, turn=turn,
            advance=bar.advance,
        )  # fmt: skip
    if out is not None:
        write_frame(table, out)
    summary = determined_errors(table)
    show_frame(f"Errors in degrees (eq. 44), {len(chosen)} panoramas", variants(summary), ["variant"])


@app.command
def views(
    directory: Panoramas,
    /,
    *,
    every: Every = 1,
    weights: Switch = False,
    prior_deg: Annotated[float, Parameter(validator=validators.Number(gt=0, lte=180))] = 15.0,
    out: Saved = None,
) -> None:
    """The vertical of views that look anywhere, pinhole and fisheye, by the method of straight edges.

    Roll and pitch are within 45 degrees; which direction is up is chosen by a network that has not seen the building.
    A second table is of views that lean by at most what the method is told, a third of views as of the first, as held
    and turned upside down, where any lean is allowed: these are other views than those that trained the software's
    network, but of its buildings.

    Parameters
    ----------
    weights
        Also print the network that all views train, as `choice_weights.rs` has it.
    prior_deg
        Largest lean of the views of the second table.
    """
    from tiltvp.lab.datasets.panoramas import read_panorama_index
    from tiltvp.lab.evaluation.ahead import ahead_table, any_lean_table, look_ahead, prior_table, train_choice

    check_ending(out)
    chosen = read_panorama_index(directory)[::every]
    if len({panorama.location for panorama in chosen}) < 2:
        raise InvalidInputError(f"{directory}: panoramas of one building, expected more, as networks learn from others")
    with progress_bar(3 * len(chosen), "panoramas") as bar:
        seen = look_ahead(chosen, advance=bar.advance)
        told = prior_table(chosen, prior_deg, advance=bar.advance)
        anyhow = any_lean_table(chosen, advance=bar.advance)
    table = ahead_table(seen)
    if out is not None:
        write_frame(table, out)
    show_frame(
        "Area under the recall curve of roll and pitch, per cent, to 1, 5 and 10 degrees", table, ["camera", "choice"]
    )
    show_frame(f"Views that lean by at most {prior_deg:g} degrees, per cent and degrees", told, ["camera"])
    show_frame("Views of which any lean is allowed, per cent and degrees", anyhow, ["camera", "held"])
    if weights:
        say(train_choice(seen).rust())


@app.command
def inertial(directory: Path, /, *, samples: Samples = 2) -> None:
    """The refined method on panoramas as they were taken, against the camera's own inertial sensor.

    Parameters
    ----------
    directory
        Folder with the panoramas and an INDEX.csv of columns name, environment, imu_pitch_deg, imu_roll_deg.
    """
    from tiltvp.lab.datasets.panoramas import paper_camera
    from tiltvp.lab.evaluation.imu import estimate_leaning, read_inertial_index, summarise_inertial

    chosen = read_inertial_index(directory)
    with progress_bar(len(chosen), "panoramas") as bar:
        table = estimate_leaning(chosen, paper_camera(), samples=samples, advance=bar.advance)
    show_frame("Refined lean minus sensor, degrees, constant offset removed", summarise_inertial(table), ["panoramas"])


@app.command
def scaling(
    *,
    images: Annotated[tuple[Whole, ...], Parameter(consume_multiple=True), at_least(1)] = (21, 42, 84, 168),
    scales: Annotated[tuple[float, ...], Parameter(consume_multiple=True), _SENSORS] = (0.25, 0.5, 1.0, 2.0, 4.0),
    sweep: str = "paper",
    threads: Threads = ALL_CORES,
    out: Saved = None,
) -> None:
    """The time that an evaluation of rendered rooms takes, over the number of images and over their pixels.

    Parameters
    ----------
    images
        Numbers of images of 640 x 480.
    scales
        Pixels of an image, in multiples of 640 x 480.
    sweep
        What is tried: paper or table3.
    """
    from tiltvp.lab.datasets.panoramas import paper_camera
    from tiltvp.lab.evaluation.combinations import choose
    from tiltvp.lab.evaluation.scaling import exponents, measure_scaling

    check_ending(out)
    combinations = choose(sweep)
    with progress_bar(len(images) + len(scales), "evaluations") as bar:
        table = measure_scaling(
            paper_camera(), combinations, images=images, scales=scales, threads=threads,
            advance=bar.advance,
        )  # fmt: skip
    if out is not None:
        write_frame(table, out)
    show_frame(f"Seconds of an evaluation of {len(combinations)} combinations", table, ["over"])
    if len(fitted := exponents(table)):
        show_frame("Exponents of growth: 1 is linear", fitted, ["over"])


@app.command
def confidence(
    runs: Annotated[list[Path], Parameter(consume_multiple=True)],
    /,
    *,
    out: Saved = None,
) -> None:
    """How far covariance and confidence can be trusted: the truths that regions hold, and failures that were foreseen.

    Parameters
    ----------
    runs
        Folders that `tiltvp evaluate` has written.
    """
    from tiltvp.lab.evaluation.runs import read_run
    from tiltvp.lab.evaluation.summary import errors
    from tiltvp.lab.evaluation.trust import trust
    from tiltvp.lab.evaluation.variants import best_rows

    check_ending(out)
    tables = {}
    for directory in runs:
        table = read_run(directory).table
        tables[directory.name] = best_rows(table, errors(table))
    if len(tables) < len(runs):
        raise InvalidInputError(f"{', '.join(map(str, runs))}: expected runs with names of their own")
    table = trust(tables)
    if out is not None:
        write_frame(table, out)
    show_frame(
        "Failures (above 2 degrees) foreseen, and truths inside the covariance's regions", table, ["run", "variant"]
    )


@app.command
def sampling(
    directory: PanoramasIfAny = None,
    /,
    *,
    every: Every = _SAMPLED_EVERY,
    rooms: Rooms = 4,
    kind: str | None = None,
    seeds: AtLeast1 = 5,
    samples: Samples = 2,
    noise_sigma: NoiseSigma = 2.0,
    out: Path | None = None,
) -> None:
    """Each option of the sampling loop, alone and together, against plain RANSAC: errors, trials, times, what pays.

    Parameters
    ----------
    kind
        Rooms of this kind alone.
    seeds
        Seeds for each image.
    out
        Also write the long table, one row for each image, method, way and seed: .csv, .json or .parquet.
    """
    import polars as pl

    from tiltvp.lab.datasets.panoramas import paper_camera
    from tiltvp.lab.evaluation.sampling import sample_views, summarise_sampling
    from tiltvp.lab.evaluation.views import view_sources
    from tiltvp.synth import ROOM_KINDS

    check_ending(out)
    refuse_every(directory, every, _SAMPLED_EVERY)
    if kind is not None and rooms == 0:
        raise InvalidInputError(f"--kind {kind} with --rooms 0, expected rooms")
    camera, kinds = paper_camera(), ROOM_KINDS if kind is None else (kind,)
    tables = []
    for source in view_sources(
        directory, camera, every=every, rooms=rooms, kinds=kinds, samples=samples, noise_sigma=noise_sigma
    ):
        with progress_bar(source.count, source.title) as bar:
            table = sample_views(source.views, camera, seeds=seeds, advance=bar.advance)
        tables.append(table.with_columns(source=pl.lit(source.title)))
        summary = summarise_sampling(table)
        for (method,), part in summary.group_by("method", maintain_order=True):
            show_frame(f"{source.title}, {method}: degrees (eq. 44)", part.drop("method"), ["way"])
            paying = part.filter(~pl.col("pays").is_in(["", "no"])).select("way", "pays", "image").iter_rows()
            words = [f"{way} (in {what}, at {image:.2f} of an image's time)" for way, what, image in paying]
            say(f"Pays: {'; '.join(words) or 'none'}.")
    if out is not None:
        write_frame(pl.concat(tables), out)
