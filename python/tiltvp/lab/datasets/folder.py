"""A dataset is a folder: `dataset.toml`, `images.csv`, a calibration file, and images of known lean."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tiltvp.errors import InvalidInputError
from tiltvp.files import read_bytes
from tiltvp.images import LARGEST_IMAGE_BYTES, gray_from, read_image
from tiltvp.lab.datasets.description import Wheels, read_description
from tiltvp.lab.datasets.findings import Findings
from tiltvp.lab.datasets.rows import ROWS, TiltImage, read_rows

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp.cameras import Camera

__all__ = ["TiltDataset", "TiltImage", "read_dataset"]


@dataclass(frozen=True, eq=False)
class TiltDataset:
    """Images of one camera on a robot that leaned as is known, and what is known of camera and robot.

    `robot_from_camera` is the (3, 3) rotation R in v_robot = R v_camera, `mask` (H, W) bool is True where the image
    shows the world, `wheels` is where the heights were measured, `source` is what the maker wrote of himself.
    """

    directory: Path
    camera: Camera
    robot_from_camera: NDArray[np.float64]
    mask: NDArray[np.bool_] | None
    images: tuple[TiltImage, ...]
    wheels: Wheels | None = None
    source: dict[str, Any] = field(default_factory=dict)
    files: tuple[Path, ...] = ()

    def read(self, image: TiltImage) -> NDArray[np.uint8]:
        """(H, W) uint8: the grey levels of an image.

        Raises `ImageFileError` or, if it is not of the camera's size, `InvalidInputError`, both with the file.
        """
        gray = gray_from(read_image(image.path), str(image.path))
        if gray.shape != (self.camera.height, self.camera.width):
            found, size = f"{gray.shape[1]} x {gray.shape[0]}", f"{self.camera.width} x {self.camera.height}"
            raise InvalidInputError(f"{image.path}: {found} pixels, expected {size}, the size of the camera's images")
        return gray

    def digest(self, advance: Callable[[], None] = lambda: None) -> str:
        """SHA-256, in hexadecimal, of the bytes of description, table, calibration, mask and images, with their names.

        Equal for copies in other folders, different if anything changed. `advance` is called after each image.
        """
        total = hashlib.sha256()
        for file in (*self.files, *(image.path for image in self.images)):
            name = os.path.relpath(file, self.directory).replace(os.sep, "/")
            try:
                content = hashlib.sha256(read_bytes(file, LARGEST_IMAGE_BYTES))
            except OSError as error:
                raise InvalidInputError(f"{file}: {error.strerror or error}, expected a file of the dataset") from error
            total.update(f"{name}\0{content.hexdigest()}\n".encode())
            if file not in self.files:
                advance()
        return total.hexdigest()


def read_dataset(directory: str | os.PathLike[str]) -> TiltDataset:
    """The dataset of a folder. Images are looked for, but not read.

    Raises `InvalidInputError` with the first thing that is wrong and where (`check_dataset` finds all).
    """
    findings = Findings()
    dataset = find_dataset(Path(directory), findings)
    findings.refuse()
    if dataset is None:
        raise InvalidInputError(f"{directory}: expected a dataset")
    return dataset


def find_dataset(directory: Path, findings: Findings) -> TiltDataset | None:
    """The dataset as far as it can be read; what is wrong goes to `findings`. None without a camera."""
    if not os.path.isdir(directory):
        findings.add(directory, None, "is no folder", "a dataset: a folder with dataset.toml and images.csv")
        return None
    description = read_description(directory, findings)
    images = read_rows(directory, description.wheels, findings)
    if description.camera is None:
        return None
    return TiltDataset(
        directory=directory,
        camera=description.camera,
        robot_from_camera=description.robot_from_camera,
        mask=description.mask,
        images=images,
        wheels=description.wheels,
        source=description.source,
        files=(*description.files, directory / ROWS),
    )
