"""The options that the commands which make datasets share, and their way from words to what the library takes."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import Parameter, validators

from tiltvp.cli.declared_options import Whole
from tiltvp.cli.options import ALL_CORES, CameraOptions, Seed, Switch, Threads, rotation_of
from tiltvp.csv_files import LARGEST_CSV_BYTES
from tiltvp.errors import InvalidInputError
from tiltvp.files import keeps_existing, read_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from tiltvp import Camera


Words = Annotated[list[str] | None, Parameter(consume_multiple=True, negative="")]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class MakingOptions:
    """Where a dataset goes, and how it is made."""

    out: Path
    """Folder to make. It appears when it is whole."""
    seed: Seed = 0
    """Seed of whatever is random."""
    threads: Threads = ALL_CORES
    force: Switch = False
    """Replace a dataset that is there, as --overwrite does."""

    @property
    def replaces(self) -> bool:
        """Whether a dataset that is there makes room."""
        return self.force or not keeps_existing()

    def check(self) -> None:
        """Refuses a place that is taken, before what is written there is made."""
        from tiltvp.lab.datasets.new import refuse_taken

        refuse_taken(self.out, self.replaces)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class LensOptions:
    """Which camera looks, and how it is held."""

    camera: Path | None = None
    """Calibration file, equirectangular:WIDTHxHEIGHT, or a robot's file, whose rotation of the mounting is taken too;
    default is a 640 x 480 upward fisheye of 185 degrees like the paper's."""
    camera_name: str | None = None
    """Name or number of the camera in a file of several; the first is 0."""
    resolution_scale: float = 1.0
    """Take a camera with so many times the pixels per side; 0.75 makes 480 x 360."""
    robot_from_camera: str | None = None
    """How the camera sits in its mounting: up, forward, or a file with a rotation; default is a robot file's, or up."""

    def load(self) -> Camera:
        """The camera."""
        lens = self._lens()
        return lens if self.resolution_scale == 1.0 else lens.scaled(self.resolution_scale)

    def rotation(self) -> NDArray[np.float64] | None:
        """(3, 3) `robot_from_camera`, where it was given or a robot's file tells it."""
        from tiltvp.robot import is_robot

        source = self.robot_from_camera
        if source is None and self.camera is not None and is_robot(self.camera):
            source = str(self.camera)
        return None if source is None else rotation_of(source)

    @property
    def source(self) -> dict[str, str]:
        """What a dataset's description says of its camera."""
        return {"camera": "like the paper's" if self.camera is None else self.camera.name}

    def _lens(self) -> Camera:
        from tiltvp.lab.datasets.panoramas import paper_camera

        if self.camera is None:
            self._refuse_name()
            return paper_camera()
        return CameraOptions(camera=self.camera, camera_name=self.camera_name).load()

    def _refuse_name(self) -> None:
        if self.camera_name is not None:
            raise InvalidInputError(f"--camera-name {self.camera_name} without a calibration file, expected --camera")


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class DriveLensOptions(LensOptions):
    """Which camera a robot drives with."""

    camera: Path = Path("mirror")
    """mirror (a camera below a hyperbolic mirror), fisheye (like the tilt paper's), a calibration file, or a robot's
    file, whose rotation of the mounting is taken too."""

    def _lens(self) -> Camera:
        from tiltvp.lab.datasets.panoramas import paper_camera
        from tiltvp.synth import mirror_camera

        known = {"mirror": mirror_camera, "fisheye": paper_camera}
        word = str(self.camera)
        if word not in known:
            return super()._lens()
        self._refuse_name()
        return known[word]()

    @property
    def blind_rad(self) -> float | None:
        """How far from the axis the camera sees itself."""
        from tiltvp.synth import MIRROR_BLIND_RAD

        return MIRROR_BLIND_RAD if str(self.camera) == "mirror" else None


Mount = Annotated[tuple[float, float, float, float], Parameter(validator=validators.Number(gte=-360, lte=360))]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class WayOptions:
    """Where a robot drives, with its camera where."""

    legs: Words = None
    """Instead of wandering, the legs of a way, METRES,DEGREES each (2.3,0 0,180); or paper, alternating or straight."""
    mount: Mount | None = None
    """Where the camera is on the robot: metres to the front and to the left, degrees turned to the left, metres up;
    default 0 0 0 0.4."""
    bumps_deg: float = 0.0
    """Greatest lean from bumps."""
    encoder_k_m: float | None = None
    """Variance of an encoder's reading per metre; default 1e-5."""

    @property
    def mount_rad(self) -> Mount | None:
        """The mount, where it was given, its angle in radians."""
        if self.mount is None:
            return None
        x, y, yaw_deg, height = self.mount
        return x, y, math.radians(yaw_deg), height


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RenderingOptions:
    """How pictures of rooms are taken."""

    noise_sigma: float | None = None
    """Gaussian noise in grey levels; default 2."""
    samples: Whole | None = None
    """Rays per pixel and side where surfaces meet; default 3."""


def tilts_from(words: list[str] | None) -> list[tuple[float, float]]:
    """(alpha, beta) in degrees, from pairs or a CSV file."""
    from tiltvp.lab.datasets.panoramas import TABLE_1_TILTS_DEG

    if not words:
        return list(TABLE_1_TILTS_DEG)
    if len(words) == 1 and "," not in words[0]:
        return _tilts_of_file(Path(words[0]))
    return [_pair(word.split(","), f"--tilts-deg {word!r}") for word in words]


def legs_from(words: Sequence[str]) -> NDArray[np.float64]:
    """(L, 2) metres and radians, from pairs or the name of a trajectory."""
    from tiltvp.synth import drive_legs

    if len(words) == 1 and words[0].isalpha():
        try:
            return drive_legs(words[0])
        except InvalidInputError as error:  # It calls the word a kind.
            raise InvalidInputError(str(error).replace("kind", "--legs", 1)) from error
    return np.array([_pair(word.split(","), f"--legs {word!r}", "METRES,DEGREES") for word in words]) * (
        1.0,
        np.pi / 180.0,
    )


def made_by(command: str) -> dict[str, str]:
    """What a dataset's description says of its making."""
    from tiltvp import __version__

    return {"made_by": f"tiltvp dataset {command}", "version": __version__}


def _tilts_of_file(file: Path) -> list[tuple[float, float]]:
    columns = ["alpha_deg", "beta_deg"]
    try:
        lines = list(csv.reader(read_text(file, LARGEST_CSV_BYTES).splitlines()))
    except OSError as error:
        problem = error.strerror or error
        raise InvalidInputError(f"{file}: {problem}, expected ALPHA,BETA in degrees, or a CSV file") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InvalidInputError(
            f"{file}: is not CSV in UTF-8 ({error}), expected the columns alpha_deg, beta_deg"
        ) from error
    rows = [(number, [cell.strip() for cell in row]) for number, row in enumerate(lines, 1) if row]
    if not rows or rows[0][1] != columns:
        raise InvalidInputError(f"{file}: expected the columns {', '.join(columns)}")
    return [_pair(row, f"{file}, line {number}: {','.join(row)!r}") for number, row in rows[1:]]


def _pair(cells: list[str], where: str, expected: str = "ALPHA,BETA in degrees") -> tuple[float, float]:
    try:
        first, second = (float(cell) for cell in cells)
    except ValueError:
        raise InvalidInputError(f"{where}, expected {expected}") from None
    return first, second
