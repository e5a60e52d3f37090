"""Trajectories in the format of TUM, which evo and most programs that judge trajectories read."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from tiltvp.arguments import shaped_from
from tiltvp.files import write_whole

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["write_tum"]


def write_tum(
    path: str | os.PathLike[str], times_s: ArrayLike, positions_m: ArrayLike, quaternions: ArrayLike, about: str
) -> None:
    """Lines of time x y z qx qy qz qw, whole or not at all, below a comment that ends in `about`.

    `times_s` (N,), `positions_m` (N, 3), `quaternions` (N, 4) as x, y, z, w. Raises `OutputError`.
    """
    times = shaped_from(times_s, "times_s", None)
    positions = shaped_from(positions_m, "positions_m", len(times), 3)
    columns = [times[:, None], positions, shaped_from(quaternions, "quaternions", len(times), 4)]
    lines = [f"# time_s x_m y_m z_m qx qy qz qw {about}"]
    lines += [" ".join(f"{value:.9f}" for value in row) for row in np.hstack(columns).tolist()]
    write_whole(path, "\n".join(lines) + "\n")
