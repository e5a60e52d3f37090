"""MultiCol-SLAM's OCam settings in an OpenCV FileStorage (`Camera.a0`, `Camera.pol0`, ...).

Its ImgToWorld applies the inverse of [[c, d], [e, 1]] to (column - u0, row - v0) and takes z = -f(rho): OCamCalib's
sign with the affine matrix on (column, row) (`coefficients.ocam_from_column_affine`).
"""

from __future__ import annotations

from tiltvp.formats.coefficients import ocam_from_column_affine
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize


def parse(root: Node, image_size: ImageSize | None) -> CameraSpec:
    """The camera of the keys `Camera.*` of `root`."""
    size = root.image_size(image_size, root.get("Camera.Iw"), root.get("Camera.Ih"), "the file")
    polynomial = _series(root, "Camera.a", "Camera.nrpol")
    inverse = _series(root, "Camera.pol", "Camera.nrinvpol")
    c, d, e = (root.need(f"Camera.{key}").number() for key in "cde")
    parameters = ocam_from_column_affine(root.need("Camera.c"), polynomial, inverse, (c, d, e))
    parameters["cx"], parameters["cy"] = root.need("Camera.u0").number(), root.need("Camera.v0").number()
    return root.spec("ocam", size, parameters, "cam0")


def _series(root: Node, prefix: str, count_key: str) -> list[float]:
    count = root.get(count_key)
    present = 0
    while root.has(f"{prefix}{present}"):
        present += 1
    if count is not None and count.integer() != present:
        count.fail(f"{present} coefficients {prefix}0 to {prefix}{max(present - 1, 0)}", f"{count.integer()} of them")
    return [root.need(f"{prefix}{k}").number() for k in range(max(present, 1))]
