"""py-OCamCalib's JSON, which carries no image size.

Its cam2world applies the inverse of [[c, d], [e, 1]] to (column, row) and takes z = +taylor(rho) forward, so the
polynomial is negated and the affine matrix is rewritten (`coefficients.ocam_from_column_affine`). `inverse_poly` is in
the angle from the axis, highest power first, another function than OCamCalib's: it is left to be recomputed.
"""

from __future__ import annotations

from tiltvp.formats.coefficients import ocam_from_column_affine
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize


def recognise(document: Document) -> bool:
    """It has `taylor_coefficient`."""
    return "taylor_coefficient" in document.tree


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The one camera of the file."""
    root = Node.root(document)
    size = root.image_size(image_size, None, None, "the py-OCamCalib format")
    taylor = root.need("taylor_coefficient").numbers()
    stretch = root.need("stretch_matrix")
    c, d, e, one = stretch.numbers(4)
    if one != 1.0:
        stretch.fail(f"the last entry is {one!r}", "[[c, d], [e, 1]]")
    parameters = ocam_from_column_affine(stretch, [0.0 - a for a in taylor], None, (c, d, e))
    parameters["cx"], parameters["cy"] = root.need("distortion_center").numbers(2)
    name = root.get("camera_name", "cam_name")
    return [
        root.spec(
            "ocam", size, parameters, name.text() if name else "cam0", "inverse_poly is another function; recomputed"
        )
    ]
