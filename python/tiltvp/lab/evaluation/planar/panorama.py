"""The grid of the strips, azimuth by elevation, that min-warping takes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["PanoramaGrid"]


@dataclass(frozen=True)
class PanoramaGrid:
    """Where the pixels of a panorama look to.

    Column j is at the azimuth `2 pi j / columns`, from the robot's front to its left. Row 0 is the highest; rows are
    equally spaced from the horizon to `elevation_max_rad`, half a step clear of both: as `tiltvp.Unwrapper` makes them.
    """

    columns: int = 72
    rows: int = 40
    elevation_max_rad: float = float(np.deg2rad(60.0))

    def __post_init__(self) -> None:
        """Raises `tiltvp.errors.InvalidInputError` for a grid that is none."""
        if self.columns < 8 or self.columns % 2 or self.rows < 4:
            size = f"{self.columns} columns, {self.rows} rows"
            raise InvalidInputError(f"grid: {size}, expected an even number of at least 8 columns, at least 4 rows")
        if not 0.0 < self.elevation_max_rad < np.pi / 2.0:
            raise InvalidInputError(f"elevation_max_rad = {self.elevation_max_rad}, expected a number in (0, pi/2)")

    @property
    def step_rad(self) -> float:
        """The angle between neighbouring columns."""
        return 2.0 * np.pi / self.columns

    @cached_property
    def elevations_rad(self) -> NDArray[np.float64]:
        """(rows,): falling elevations of the rows."""
        return self.elevation_max_rad * (1.0 - (np.arange(self.rows) + 0.5) / self.rows)
