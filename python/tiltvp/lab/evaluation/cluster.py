"""The images of an evaluation on a Dask cluster: chunks of images as tasks, done again where a worker dies."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from functools import lru_cache
from importlib import metadata
from typing import TYPE_CHECKING

from tiltvp.errors import RunError
from tiltvp.lab.cluster import results_of
from tiltvp.lab.evaluation.combinations import Combination

if TYPE_CHECKING:
    import polars as pl

    from tiltvp.lab.datasets.folder import TiltDataset
    from tiltvp.lab.evaluation.runner import ImageRunner

__all__ = ["estimate_on_cluster"]

_CHUNK = 4
"""Images of a task: a second or so of work, lost if its worker dies."""


def estimate_on_cluster(
    address: str, dataset: TiltDataset, combinations: Sequence[Combination], numbers: Sequence[int], seed: int
) -> Iterator[tuple[int, pl.DataFrame]]:
    """The rows of these images as they come, from the workers of the Dask scheduler at `address`.

    The workers read the dataset from its path; it has to be the same there. Raises `MissingExtraError` if Dask is
    not installed, `RunError` if the scheduler does not answer or has no workers, and if a worker has another version or
    another dataset.
    """
    job = json.dumps(
        {
            "directory": str(dataset.directory.resolve()),
            "digest": dataset.digest(),
            "combinations": [asdict(each) for each in combinations],
            "seed": seed,
            "version": metadata.version("tiltvp"),
        }
    )
    chunks = ((i, list(numbers[i : i + _CHUNK])) for i in range(0, len(numbers), _CHUNK))
    for _, results in results_of(address, _estimate_chunk, job, chunks):
        yield from results


def _estimate_chunk(job: str, numbers: Sequence[int]) -> list[tuple[int, pl.DataFrame]]:
    """The task that a worker does."""
    from tiltvp.lab.evaluation.each_image import evaluate_images

    dataset, runner = _prepared(job)
    return list(evaluate_images(dataset, runner, numbers))


@lru_cache(maxsize=1)
def _prepared(job: str) -> tuple[TiltDataset, ImageRunner]:
    """The dataset and the estimators, made once in each worker."""
    from tiltvp.lab.datasets.folder import read_dataset
    from tiltvp.lab.evaluation.each_image import runner_of

    asked = json.loads(job)
    own = metadata.version("tiltvp")
    if own != asked["version"]:
        raise RunError(f"a worker has tiltvp {own}, expected {asked['version']} as here")
    dataset = read_dataset(asked["directory"])
    if dataset.digest() != asked["digest"]:
        raise RunError(f"{asked['directory']}: a worker sees another dataset there, expected the same files as here")
    return dataset, runner_of(dataset, [Combination(**each) for each in asked["combinations"]], asked["seed"])
