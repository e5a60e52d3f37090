"""The options that measures and makers of datasets share."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter, validators

from tiltvp.cli.declared_options import Whole
from tiltvp.cli.options import AtLeast0, AtLeast1
from tiltvp.errors import InvalidInputError

_INDEX = "Folder with the panoramas and an INDEX.csv of columns name, environment, tilt_x_deg, tilt_z_deg"

Panoramas = Annotated[Path, Parameter(help=f"{_INDEX}.")]
PanoramasIfAny = Annotated[Path | None, Parameter(help=f"{_INDEX}; without one, rendered rooms alone are measured.")]
Every = Annotated[AtLeast1, Parameter(help="Take one panorama in so many.")]
Rooms = Annotated[AtLeast0, Parameter(help="Rendered rooms of each kind; 0 for none.")]
Samples = Annotated[Whole, Parameter(help="Rays per pixel and side.")]
NoiseSigma = Annotated[float, Parameter(help="Gaussian noise in grey levels.")]
LeansDeg = Annotated[tuple[float, ...], Parameter(consume_multiple=True, validator=validators.Number(gte=0, lte=28))]
"""Up to half a radian, as drives have them."""
Saved = Annotated[Path | None, Parameter(help="Also write the table: .csv, .json or .parquet.")]


def refuse_every(directory: Path | None, every: int, default: int = 1) -> None:
    """Refuses one panorama in so many where there are none."""
    if directory is None and every != default:
        raise InvalidInputError(f"--every {every} without a folder of panoramas, expected both")
