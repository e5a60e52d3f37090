"""`tiltvp measure corners-real`: corners of a real cabinet and a real box, against motion capture and a ruler."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tiltvp.cli.corner import drawn
from tiltvp.cli.terminal import new_table, progress_bar, show
from tiltvp.errors import InvalidInputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tiltvp import Camera
    from tiltvp.corner import CornerEstimate

_FRAMES = 121


def corners_real(folder: Path, /, *, overlay: Path | None = None) -> None:
    """Corners of real things: attitude against motion capture, right angles and sizes against a ruler, smoothness.

    Parameters
    ----------
    folder
        Folder with cube_slam_cabinet (CubeSLAM's images and poses) and visp_teabox_stereo (ViSP's videos).
    overlay
        Folder for the images with corners and imaginary boxes.
    """
    import numpy as np

    from tiltvp.images import write_image
    from tiltvp.lab.evaluation import corners_real as real

    def draw(name: str, camera: Camera, place: int, image: NDArray[np.uint8], estimate: CornerEstimate) -> None:
        if overlay is not None:
            write_image(overlay / name / f"{place:04d}.png", drawn(image, camera, estimate))

    for name in ("cube_slam_cabinet/truth_cam_poses.txt", "visp_teabox_stereo/cRightMcLeft.txt"):
        if not (folder / name).is_file():
            raise InvalidInputError(f"{folder / name}: no such file, expected the images of the cabinet and the box")
    lens = real.cabinet_camera()
    with progress_bar(58, "images") as bar:
        found = real.cabinet(
            folder / "cube_slam_cabinet", bar.advance, lambda place, image, e: draw("cabinet", lens, place, image, e)
        )
    table = new_table("Cabinet, one camera, attitude against motion capture", ("what", "value"), ["what"])
    share = len(found.places) / found.frames
    table.add_row("images with a pose", f"{len(found.places)} of {found.frames} ({100 * share:.0f} %)")
    for words, errors in (("about the vertical", found.error_deg), ("about any axis", found.free_error_deg)):
        rms, median = np.sqrt(np.mean(errors**2)), np.median(errors)
        table.add_row(
            f"after one turn {words}: rms, median, largest (deg)", f"{rms:.2f} {median:.2f} {errors.max():.2f}"
        )
    table.add_row("vertical of the cabinet from that of the capture (deg)", f"{found.lean_deg:.2f}")
    median, most = np.quantile(found.nees, [0.5, 0.9])
    table.add_row("NEES of 3, with the capture's own errors: median, 90 %", f"{median:.1f} {most:.0f}")
    own, told = np.nanmedian(found.edges_off_deg, axis=0)
    table.add_row("LSD's edges off the axes: as estimated, as captured (deg)", f"{own:.2f} {told:.2f}")
    nearer = int((found.edges_off_deg[:, 0] < found.edges_off_deg[:, 1]).sum())
    table.add_row("images in which they are nearer to the estimated ones", f"{nearer} of {len(found.places)}")
    show(table)

    box_folder = folder / "visp_teabox_stereo"
    rig = real.tea_box_rig(box_folder)
    with progress_bar(_FRAMES, "pairs") as bar:
        box = real.tea_box(box_folder, bar.advance, lambda place, image, e: draw("teabox", rig.left, place, image, e))
    table = new_table("Tea box, two cameras", ("what", "value"), ["what"])
    table.add_row("pairs with a pose", f"{len(box.places)} of {box.frames}")
    angles = " ".join(f"{angle:.1f}" for angle in np.nanmedian(box.angles_deg, axis=0))
    table.add_row("median angles x y, y z, z x, vertex to vertex (deg)", angles)
    for name, values in box.lengths_mm.items():
        middle, low, high = np.nanquantile(values, (0.5, 0.25, 0.75))
        table.add_row(
            f"{name}: by the ruler; pairs, median, quartiles (mm)",
            f"{real.TEA_BOX_MM[name]:.0f}; {np.isfinite(values).sum()}, {middle:.1f}, {low:.1f} {high:.1f}",
        )
    for number in np.unique(box.objects):
        of = box.objects == number
        lengths = (values[of & np.isfinite(values)] for values in box.lengths_mm.values())
        medians = " x ".join(f"{np.median(seen):.1f}" if seen.size else "none" for seen in lengths)
        table.add_row(f"corner {number}, {np.count_nonzero(of)} pairs: long x depth x height (mm)", medians)
    step_mm, turn_deg = real.steps(box)
    table.add_row(
        "from frame to frame: median, 95 % (mm)", f"{np.median(step_mm):.1f} {np.quantile(step_mm, 0.95):.1f}"
    )
    table.add_row(
        "from frame to frame: median, 95 % (deg)", f"{np.median(turn_deg):.2f} {np.quantile(turn_deg, 0.95):.2f}"
    )
    show(table)
