"""`tiltvp lab train`: a correction of the paper's methods from images of known lean, as a file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from tiltvp.cli.lab.demo import demo
from tiltvp.cli.lab.drive import app
from tiltvp.cli.options import ALL_CORES, MethodOptions, Threads
from tiltvp.cli.tables import check_file
from tiltvp.cli.terminal import progress_bar, say
from tiltvp.errors import InvalidInputError, counted

__all__ = ["app"]

_OPTIONS = MethodOptions()
_METHOD = "image-space-ransac"

app.command(demo)


@app.command
def train(
    dataset: Path,
    /,
    *,
    out: Path,
    kind: str = "posterior",
    options: MethodOptions = _OPTIONS,
    threads: Threads = ALL_CORES,
) -> None:
    """Train what takes a method's shift or raw angle to the lean, on a dataset of known lean.

    Give the file as --correction to `tiltvp tilt`, which takes method and options from it. It is for the camera of the
    dataset. `tiltvp evaluate` says how good such a correction is where it was not trained.

    Parameters
    ----------
    dataset
        Folder with a dataset.toml and an images.csv.
    out
        File for the correction (.toml).
    kind
        posterior (the mean lean given the shift), affine, or factor.
    options
        The method, image-space-ransac if none is given, and its options.
    """
    from tiltvp.corrections import train_correction
    from tiltvp.lab.datasets.folder import read_dataset
    from tiltvp.lab.evaluation.training import measured_shifts

    check_file("--out", out, ".toml")
    for name in ("correction", "robot_from_camera", "mask"):
        if getattr(options, name) is not None:
            told = f"--{name.replace('_', '-')}"
            raise InvalidInputError(f"{told} with a training, expected none: it is the dataset's, or what is trained")
    known = read_dataset(dataset)
    method = options.method or _METHOD
    estimator = replace(options, method=method).estimator(
        known.camera, correction=None, robot_from_camera=known.robot_from_camera, mask=known.mask
    )
    with progress_bar(len(known.images), "images") as bar:
        shifts = measured_shifts(known, estimator, threads=threads, advance=bar.advance)
    try:
        trained = train_correction(estimator, shifts, [image.alpha_rad for image in known.images], kind=kind)
    except InvalidInputError as error:
        raise InvalidInputError(f"{dataset}, {counted(len(known.images), 'images')}: {error}") from error
    trained.save(out)
    say(f"{out}: {kind} of {method}, trained on {trained.images} of {counted(len(known.images), 'images')}")
