"""py-omnicalib's YAML, which carries no image size.

Its view vector over radius r has z = +poly_radius_to_z(r) forward and the principal point as (column, row), so the
polynomial is negated and the affine matrix is the identity. `poly_incident_angle_to_radius` is a separate fit of the
inverse in another variable and is left to be recomputed.
"""

from __future__ import annotations

from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize, Parameters


def recognise(document: Document) -> bool:
    """It has `poly_radius_to_z`."""
    return "poly_radius_to_z" in document.tree


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The one camera of the file."""
    root = Node.root(document)
    size = root.image_size(image_size, None, None, "the py-omnicalib format")
    cx, cy = root.need("principal_point").numbers(2)
    polynomial = [0.0 - a for a in root.need("poly_radius_to_z").numbers()]
    parameters: Parameters = {"polynomial": polynomial, "c": 1.0, "d": 0.0, "e": 0.0, "cx": cx, "cy": cy}
    return [root.spec("ocam", size, parameters, "cam0", "poly_incident_angle_to_radius is another fit; recomputed")]
