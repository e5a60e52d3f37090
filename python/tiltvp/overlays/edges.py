"""Edge pixels drawn over their image: hue is the gradient's direction, saturation the edge offset (figure 10)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiltvp._core import EdgeElements
from tiltvp.arguments import number_from, refuse_unless
from tiltvp.errors import InvalidInputError
from tiltvp.images import gray_from

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


__all__ = ["draw_edges"]


def draw_edges(
    image: ArrayLike, edges: EdgeElements, *, offset_max_px: float = 40.0, only: str = "prefiltered"
) -> NDArray[np.uint8]:
    """The image in grey, (H, W, 3) BGR uint8, with the edge pixels in colour.

    Hue is `phi`, full saturation an offset of zero, none an offset of `offset_max_px` (where the camera does not see
    the vertical there is no offset and all are saturated). `only` picks "prefiltered", "inlier" or "all" edge pixels.
    """
    import cv2

    gray = gray_from(image)
    refuse_unless(edges, EdgeElements, "edges", "EdgeElements, as with_edges gives them")
    picks = {"prefiltered": edges.prefiltered, "inlier": edges.inlier, "all": np.ones(len(edges), dtype=bool)}
    if not (isinstance(only, str) and only in picks):
        raise InvalidInputError(f"only = {only!r}, expected one of {', '.join(picks)}")
    if not number_from(offset_max_px, "offset_max_px") > 0.0:
        raise InvalidInputError(f"offset_max_px = {offset_max_px}, expected a positive number of pixels")
    chosen = picks[only]
    u, v = edges.u[chosen], edges.v[chosen]
    if len(u) and (u.max() >= gray.shape[1] or v.max() >= gray.shape[0]):
        raise InvalidInputError(f"image: shape {gray.shape}, expected the image that the edges were found in")
    offset = np.nan_to_num(np.abs(edges.offset_px[chosen]), nan=0.0)
    phi = np.nan_to_num(edges.phi_rad[chosen], nan=0.0)
    hsv = np.empty((len(u), 1, 3), dtype=np.uint8)
    hsv[:, 0, 0] = np.minimum(phi / np.pi * 180.0, 179.0).astype(np.uint8)
    hsv[:, 0, 1] = (255.0 * (1.0 - np.minimum(offset, offset_max_px) / offset_max_px)).astype(np.uint8)
    hsv[:, 0, 2] = 255
    canvas = np.asarray(cv2.cvtColor(gray, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    if len(u):
        canvas[v, u] = cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)[:, 0, :]
    return canvas
