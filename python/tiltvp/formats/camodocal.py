"""camodocal camera YAML, alone or inside a VINS configuration: PINHOLE, PINHOLE_FULL, KANNALA_BRANDT, MEI, SCARAMUZZA.

KANNALA_BRANDT's k2..k5 are the coefficients of theta^3 .. theta^9. SCARAMUZZA's spaceToPlane applies [[c, d], [e, 1]]
to (column, row) and takes theta = atan2(-z, .), which is OCamCalib's sign with the affine matrix on (column, row)
(`coefficients.ocam_from_column_affine`); its liftProjective ignores the affine matrix for the direction, so the
projection is what counts. Pixel centres are at integers (corners come from OpenCV).
"""

from __future__ import annotations

from collections.abc import Callable

from tiltvp.formats.coefficients import ocam_from_column_affine
from tiltvp.formats.document import Document
from tiltvp.formats.node import Node
from tiltvp.formats.spec import CameraSpec, ImageSize, Parameters


def recognise(document: Document) -> bool:
    """It has `model_type` and one of camodocal's groups of parameters."""
    groups = ("projection_parameters", "mirror_parameters", "distortion_parameters", "poly_parameters")
    return "model_type" in document.tree and any(group in document.tree for group in groups)


def parse(document: Document, image_size: ImageSize | None) -> list[CameraSpec]:
    """The one camera of the file."""
    root = Node.root(document)
    size = root.image_size(image_size, root.get("image_width"), root.get("image_height"), "the file")
    kind = root.need("model_type")
    known = _MODELS.get(kind.text().upper())
    if known is None:
        kind.refuse(f"the camodocal model {kind.text()!r} is not supported", "one of " + ", ".join(_MODELS))
    model, read = known
    name = root.get("camera_name")
    return [root.spec(model, size, read(root), name.text() if name else "cam0")]


def _pinhole(root: Node) -> Parameters:
    values = root.need("projection_parameters").named("fx", "fy", "cx", "cy")
    return values | root.need("distortion_parameters").named("k1", "k2", "p1", "p2")


def _pinhole_full(root: Node) -> Parameters:
    values = root.need("projection_parameters").named("fx", "fy", "cx", "cy")
    return values | root.need("distortion_parameters").named("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")


def _kannala_brandt(root: Node) -> Parameters:
    group = root.need("projection_parameters")
    theirs = ("mu", "mv", "u0", "v0", "k2", "k3", "k4", "k5")
    ours = ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4")
    return {our: group.need(their).number() for our, their in zip(ours, theirs, strict=True)}


def _mei(root: Node) -> Parameters:
    group = root.need("projection_parameters")
    theirs = ("gamma1", "gamma2", "u0", "v0")
    values = {o: group.need(t).number() for o, t in zip(("fx", "fy", "cx", "cy"), theirs, strict=True)}
    xi = root.need("mirror_parameters").need("xi").number()
    return {"xi": xi, **values, **root.need("distortion_parameters").named("k1", "k2", "p1", "p2")}


def _scaramuzza(root: Node) -> Parameters:
    affine = root.need("affine_parameters")
    c, d, e, cx, cy = (affine.need(key).number() for key in ("ac", "ad", "ae", "cx", "cy"))
    inverse = root.get("inv_poly_parameters")
    parameters = ocam_from_column_affine(
        affine, _series(root.need("poly_parameters")), _series(inverse) if inverse else None, (c, d, e)
    )
    return parameters | {"cx": cx, "cy": cy}


def _series(group: Node) -> list[float]:
    group.only(*(f"p{k}" for k in range(len(group.tree))))
    return [group.need(f"p{k}").number() for k in range(max(len(group.tree), 1))]


_MODELS: dict[str, tuple[str, Callable[[Node], Parameters]]] = {
    "PINHOLE": ("pinhole", _pinhole),
    "PINHOLE_FULL": ("pinhole", _pinhole_full),
    "KANNALA_BRANDT": ("kannala_brandt", _kannala_brandt),
    "MEI": ("unified", _mei),
    "SCARAMUZZA": ("ocam", _scaramuzza),
}
