"""The words that measures on panoramas and rendered rooms share."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter, validators

_INDEX = "Folder with the panoramas and an INDEX.csv of columns name, environment, tilt_x_deg, tilt_z_deg"

Panoramas = Annotated[Path, Parameter(help=f"{_INDEX}.")]
PanoramasIfAny = Annotated[Path | None, Parameter(help=f"{_INDEX}; without one, rendered rooms alone are measured.")]
Every = Annotated[int, Parameter(help="Take one panorama in so many.", validator=validators.Number(gte=1))]
Rooms = Annotated[int, Parameter(help="Rendered rooms of each kind; 0 for none.", validator=validators.Number(gte=0))]
Out = Annotated[Path | None, Parameter(help="Also write the table: .csv, .json or .parquet.")]
