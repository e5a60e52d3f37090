"""A dataset through a sweep: image by image on threads or a cluster, in as many sittings as it takes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from tiltvp.errors import InvalidInputError
from tiltvp.lab.evaluation.combinations import Combination
from tiltvp.lab.evaluation.crossval import cross_validated
from tiltvp.lab.evaluation.each_image import evaluate_images, runner_of
from tiltvp.lab.evaluation.runner import ImageRunner
from tiltvp.lab.evaluation.runs import Run, RunFolder, new_manifest, open_run, read_run

if TYPE_CHECKING:
    from tiltvp.lab.datasets.folder import TiltDataset

__all__ = ["Experiment", "open_experiment"]


def _nothing() -> None:
    return None


@contextmanager
def open_experiment(
    dataset: TiltDataset, combinations: Sequence[Combination], directory: Path, *, sweep: str = "own", seed: int = 0
) -> Iterator[Experiment]:
    """An evaluation of a dataset in the folder of its run, begun now or continued.

    Raises `RunError` if the folder holds another run, `InvalidInputError` if there is nothing to do or an option is
    impossible.
    """
    if not dataset.images or not combinations:
        what = "images" if combinations else "combinations"
        raise InvalidInputError(f"{dataset.directory}: an evaluation without {what}, expected one or more")
    runner = runner_of(dataset, combinations, seed)
    described = [
        {"method": each.method, "label": each.label, "group": each.group, "options": options}
        for each, options in zip(combinations, runner.options, strict=True)
    ]
    manifest = new_manifest(
        dataset=dataset.directory,
        digest=dataset.digest(),
        images=len(dataset.images),
        sweep=sweep,
        combinations=described,
        seed=seed,
    )
    with open_run(directory, manifest) as folder:
        yield Experiment(dataset, runner, folder, seed)


class Experiment:
    """An evaluation in progress: first `estimate`, then `conclude`."""

    def __init__(self, dataset: TiltDataset, runner: ImageRunner, folder: RunFolder, seed: int) -> None:
        """Use `open_experiment`."""
        self.dataset, self.runner, self.folder, self.seed = dataset, runner, folder, seed

    @property
    def images(self) -> int:
        """How many images there are."""
        return len(self.dataset.images)

    def missing(self) -> list[int]:
        """The numbers of the images that are still to be done."""
        done = set(range(self.images)) if self.folder.whole else self.folder.done()
        return [number for number in range(self.images) if number not in done]

    def estimate(self, *, threads: int = 1, cluster: str | None = None, advance: Callable[[], None] = _nothing) -> None:
        """Does the images that are missing, each of them whole or not at all; `advance` is called after each.

        `cluster` is the address of a Dask scheduler whose workers see the dataset at the same path.
        """
        missing = self.missing()
        if not missing:
            return
        if cluster is not None:
            from tiltvp.lab.evaluation.cluster import estimate_on_cluster

            results = estimate_on_cluster(cluster, self.dataset, self.runner.combinations, missing, self.seed)
        else:
            results = evaluate_images(self.dataset, self.runner, missing, threads)
        for number, rows in results:
            self.folder.add(number, rows)
            advance()

    def conclude(self, *, threads: int = 1, advance: Callable[[], None] = _nothing) -> Run:
        """Trains the corrections location by location and writes the table; `advance` is called per combination."""
        if self.folder.whole:
            return read_run(self.folder.directory)
        return self.folder.finish(cross_validated(self.folder.parts(), threads=threads, advance=advance))
