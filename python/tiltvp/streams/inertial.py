"""What an inertial sensor has measured over time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["InertialSamples"]


@dataclass(frozen=True, eq=False)
class InertialSamples:
    """Samples of an inertial sensor in its own axes. N is their number."""

    times_s: NDArray[np.float64]
    """(N,): rising."""
    rates_rad_s: NDArray[np.float64]
    """(N, 3): of rotation."""
    accelerations_m_s2: NDArray[np.float64]
    """(N, 3): what a body at rest feels upwards is positive (specific force, as ROS has it)."""
    orientations: NDArray[np.float64] | None = None
    """(N, 4): quaternions x y z w that take the sensor's axes to the world's; None where the sensor tells none."""
    frame: str = ""
    """The frame of the sensor, by the name that the recording has for it."""
    source: str = "inertial sensor"
    """What messages call it."""
