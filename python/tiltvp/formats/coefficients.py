"""Turns camera matrices and coefficient lists, in the orders most tools share, into named parameters."""

from __future__ import annotations

from tiltvp.formats.node import Node
from tiltvp.formats.spec import Parameters

BROWN = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_NEGLIGIBLE_SKEW_PX = 1e-9


def four(values: list[float]) -> Parameters:
    """fx, fy, cx, cy in this order."""
    return dict(zip(("fx", "fy", "cx", "cy"), values, strict=True))


def camera_matrix(node: Node) -> tuple[Parameters, float]:
    """fx, fy, cx, cy of a 3 by 3 camera matrix [[fx, skew, cx], [0, fy, cy], [0, 0, 1]], and its skew in pixels."""
    m = node.numbers(9)
    if (m[3], m[6], m[7], m[8]) != (0.0, 0.0, 0.0, 1.0):
        node.fail(f"the matrix has {m[3]}, {m[6]}, {m[7]}, {m[8]} where 0, 0, 0, 1 belong", "[fx s cx; 0 fy cy; 0 0 1]")
    return four([m[0], m[4], m[2], m[5]]), m[1]


def without_skew(node: Node, what: str) -> Parameters:
    """As `camera_matrix`, for a model that has no skew: one that matters is refused."""
    parameters, skew = camera_matrix(node)
    refuse_skew(node, skew, what)
    return parameters


def refuse_skew(node: Node, skew: float, what: str) -> None:
    """Refuses a skew that moves a pixel, in a model that has none."""
    if abs(skew) > _NEGLIGIBLE_SKEW_PX:
        node.refuse(f"a skew of {skew!r} px is not supported for {what}", "a skew of 0")


def brown_conrady(node: Node | None) -> Parameters:
    """OpenCV's order k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tx ty]]]]; thin prism and sensor tilt have to be zero."""
    if node is None:
        return {}
    values = node.numbers(0, 4, 5, 8, 12, 14)
    if any(values[8:]):
        node.refuse("thin prism or tilted sensor coefficients are not supported", "zeros after the eighth coefficient")
    return dict(zip(BROWN, values, strict=False))


def mei(node: Node | None) -> Parameters:
    """k1 k2 p1 p2 [k3] on the plane z = 1 of the unified model."""
    if node is None:
        return {}
    return dict(zip(BROWN, node.numbers(0, 4, 5), strict=False))


def kannala_brandt(node: Node, *more: int) -> Parameters:
    """k1 k2 k3 k4 of theta + k1 theta^3 + k2 theta^5 + k3 theta^7 + k4 theta^9, and zeros where there may be `more`."""
    values = node.numbers(4, *more)
    if any(values[4:]):
        node.refuse("more than four coefficients are not supported", "zeros after the fourth")
    return dict(zip(("k1", "k2", "k3", "k4"), values, strict=False))


def unified_from_alpha(node: Node, fx: float, fy: float, alpha: float) -> Parameters:
    """xi, fx, fy of the unified model written with alpha: xi = alpha / (1 - alpha), focal lengths over (1 - alpha)."""
    if not 0.0 <= alpha < 1.0:
        node.refuse(f"a unified model with alpha = {alpha!r} is not supported", "an alpha from 0 to below 1")
    return {"xi": alpha / (1.0 - alpha), "fx": fx / (1.0 - alpha), "fy": fy / (1.0 - alpha)}


def ocam_from_column_affine(
    node: Node, polynomial: list[float], inverse: list[float] | None, affine: tuple[float, float, float]
) -> Parameters:
    """OCam parameters of tools that apply [[c, d], [e, 1]] to (column, row); OCamCalib applies it to (row, column).

    They have column = c u + d v + cx, row = e u + v + cy and the bearing (u, v, -f(|(u, v)|)). With (u, v) scaled by
    s = c the bearing stays the same for f_s(r) = s f(r / s), and the affine matrix becomes OCamCalib's form with
    c' = 1 / c, d' = e / c, e' = d / c: so a_k' = a_k c^(1 - k), and the inverse polynomial is multiplied by c.
    """
    c, d, e = affine
    if c <= 0.0:
        node.fail(f"the affine parameter c is {c!r}", "a positive number")
    parameters: Parameters = {"c": 1.0 / c, "d": e / c, "e": d / c}
    try:
        parameters["polynomial"] = [a * c ** (1 - k) for k, a in enumerate(polynomial)]
    except OverflowError:
        node.fail(f"the affine parameter c is {c!r}", "a number near 1")
    if inverse is not None:
        parameters["inverse_polynomial"] = [c * b for b in inverse]
    return parameters
