"""`tiltvp measure colmap`: what priors of gravity do to COLMAP's reconstructions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tiltvp.cli.colmap import BELIEVED_MIN
from tiltvp.cli.declared_options import Whole
from tiltvp.cli.lab.measure_options import Saved
from tiltvp.cli.lab.tables import show_frame
from tiltvp.cli.options import Seed, at_least
from tiltvp.cli.tables import check_ending, write_frame
from tiltvp.cli.terminal import progress_bar
from tiltvp.files import scratch_folder

_WAYS = 3


def colmap(
    *,
    kinds: Annotated[tuple[str, ...], Parameter(consume_multiple=True)] = ("office", "living-room"),
    seed: Seed = 5,
    views: Annotated[Whole, at_least(3)] = 24,
    out: Saved = None,
) -> None:
    """COLMAP on views of rendered rooms: errors of gravity of its reconstructions, without priors and with them.

    Parameters
    ----------
    kinds
        Rooms, each of which is reconstructed.
    seed
        Which room of its kind.
    views
        Of each room, leaning by up to 20 degrees.
    """
    import polars as pl

    from tiltvp.lab.evaluation.colmap import reconstruct_room

    check_ending(out)
    with scratch_folder(Path("out/colmap")) as folder, progress_bar(len(kinds) * (views + _WAYS), "steps") as bar:
        wanted = {"views": views, "confidence_min": BELIEVED_MIN, "advance": bar.advance}
        table = pl.concat([reconstruct_room(kind, seed, folder / kind, **wanted) for kind in kinds])  # type: ignore[arg-type]
    if out is not None:
        write_frame(table, out)
    show_frame("Gravity of each image by the reconstruction against the truth, degrees", table, ["room", "way"])
