"""What `tiltvp corner` writes, and how it says what it found."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import Group, Parameter

from tiltvp.cli.corner_methods import Searches, advice, looked_for, shown
from tiltvp.cli.tables import Out, Table, check_ending, check_plot, write_table
from tiltvp.cli.terminal import say
from tiltvp.errors import InvalidInputError, counted
from tiltvp.files import check_output, check_output_folder

if TYPE_CHECKING:
    from tiltvp.corner import CornerEstimate


@Parameter(name="*", group=Group("Results"))
@dataclass(frozen=True, kw_only=True)
class CornerResults:
    """Where poses and pictures go."""

    out: Out | None = None
    """File for the poses, one row for each frame: .csv, .json or .parquet."""
    corners: Out | None = None
    """File for all corners that are believed, with names that last, poses, covariances, and lengths and angles of their
    edges, one row for each hypothesis of each corner in each frame: .csv, .json or .parquet."""
    trajectory: Path | None = None
    """File for the trajectory in TUM's format: time, position and quaternion of the camera in the object's frame."""
    overlay: Path | None = None
    """Folder for the left images with corners, their names, the cuboids that they make, and imaginary boxes."""
    plot: Path | None = None
    """Picture of attitude and position over time (.png)."""

    @property
    def files(self) -> dict[str, Path | None]:
        """What is written, by the names of the options."""
        return {name: getattr(self, name) for name in ("out", "corners", "trajectory", "plot", "overlay")}

    def check(self, *, has_scale: bool) -> None:
        """Refuses what cannot be written, before any work is done; a trajectory wants poses that have a place."""
        check_ending(self.out)
        check_ending(self.corners, "--corners")
        given = {name: os.path.realpath(path) for name, path in self.files.items() if path is not None}
        for name, path in given.items():
            other = next(one for one in given if given[one] == path)
            if other != name:
                raise InvalidInputError(f"--{other} and --{name} are both {self.files[name]}, expected two files")
        if self.trajectory is not None:
            if not has_scale:
                expected = "expected two, or --camera-height-m, --edge-length-m or --box-size-m"
                raise InvalidInputError(
                    f"--trajectory {self.trajectory} of one camera, which tells no position: {expected}"
                )
            check_output(self.trajectory)
        if self.overlay is not None:
            check_output_folder(self.overlay)
        check_plot("--plot", self.plot)

    def write(self, estimates: Sequence[tuple[float, str, CornerEstimate]]) -> None:
        """The tables, the trajectory and the plot of estimates with times and names of their frames."""
        from tiltvp.corner_tables import CORNER_COLUMNS, POSE_COLUMNS, corner_rows, pose_rows, write_trajectory

        table = Table(POSE_COLUMNS, pose_rows(estimates))
        if self.out is not None:
            write_table(table, self.out)
        if self.corners is not None:
            write_table(Table(CORNER_COLUMNS, corner_rows(estimates)), self.corners)
        if self.plot is not None:
            from tiltvp.images import write_image
            from tiltvp.lab.plots.corner_poses import pose_plot
            from tiltvp.lab.plots.picture import figure_picture

            write_image(self.plot, figure_picture(pose_plot(table.frame())))
        if self.trajectory is not None:
            # Last, as it is refused where no frame has a place.
            write_trajectory(table.rows, self.trajectory)
            jumps = _jumps(table.rows)
            if jumps:
                what = "its origin is another corner than before, or not known to be the same"
                say(f"{self.trajectory}: from {counted(jumps, 'frames')} on {what} (columns object and id of --out)")


def _jumps(rows: Sequence[Mapping[str, Any]]) -> int:
    """In how many rows with a place the origin is not known to be that of the one before.

    Names tell it. `object` does not where frames are looked at anew.
    """
    placed = [row for row in rows if row["x_m"] is not None]
    pairs = [[(one["id"], one["object"]) for one in pair] for pair in pairwise(placed)]
    return sum(a != b if None not in (a, b) else before != now for (a, before), (b, now) in pairs)


def tell(
    source: str, estimator: Searches, bad: int, *, has_scale: bool, advice_for: tuple[bool, dict[str, Any]]
) -> None:
    """How many frames have a pose, by which method, why the others have none, and what to try if all are such."""
    found, without = estimator.found.total(), estimator.without.total()
    skipped = f", {bad} skipped" if bad else ""
    by = f" ({looked_for(estimator.found)})" if found else ""
    say(f"{source}: {counted(found + without, 'frames')}{skipped}, {found} with a pose{by}")
    if without:
        say(f"without a pose: {shown(estimator.without)}")
    if has_scale and estimator.placeless:
        say(f"without a place: {shown(estimator.placeless)}")
    if without and not found:
        [(reason, _)] = estimator.without.most_common(1)
        is_pair, known = advice_for
        say(f"looked for {looked_for(estimator.methods)}")
        say(f"try: {advice(reason, estimator.methods, is_pair=is_pair, given=known)}")
