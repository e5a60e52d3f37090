"""What the writers of calibration files share: the numbers of a lens in the orders of other tools, and refusals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NoReturn

from tiltvp.errors import UnsupportedFormatError
from tiltvp.formats.spec import CameraSpec, Parameters

__all__ = [
    "brown_of",
    "four_of",
    "general",
    "kannala_brandt_of",
    "mei_of",
    "only_one",
    "refuse",
    "refuse_mirror",
    "value",
]


def value(spec: CameraSpec, key: str, otherwise: float = 0.0) -> float:
    """One parameter, or what it is where the lens leaves it out."""
    number = spec.parameters.get(key, otherwise)
    assert not isinstance(number, list)
    return float(number)


def general(spec: CameraSpec, tool: str) -> CameraSpec:
    """The same lens by the model that tools know: an equidistant one is a Kannala-Brandt one without coefficients.

    Raises as `refuse_mirror`.
    """
    refuse_mirror(spec, tool)
    if spec.model != "equidistant":
        return spec
    focal = value(spec, "focal_px")
    parameters: Parameters = {"fx": focal, "fy": focal, "cx": value(spec, "cx"), "cy": value(spec, "cy")}
    return replace(spec, model="kannala_brandt", parameters=parameters)


def four_of(spec: CameraSpec) -> list[float]:
    """fx, fy, cx, cy."""
    return [value(spec, key) for key in ("fx", "fy", "cx", "cy")]


def kannala_brandt_of(spec: CameraSpec) -> list[float]:
    """k1 k2 k3 k4."""
    return [value(spec, key) for key in ("k1", "k2", "k3", "k4")]


def brown_of(spec: CameraSpec) -> list[float]:
    """OpenCV's eight of a pinhole camera, k1 k2 p1 p2 k3 k4 k5 k6, without zeros at the end: four, five or eight."""
    all_eight = [value(spec, key) for key in ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")]
    return all_eight if any(all_eight[5:]) else all_eight[:5] if all_eight[4] else all_eight[:4]


def mei_of(spec: CameraSpec) -> list[float] | None:
    """k1 k2 p1 p2 of the unified model; None if the lens has a k3 beside them."""
    if value(spec, "k3"):
        return None
    return [value(spec, key) for key in ("k1", "k2", "p1", "p2")]


def only_one(specs: Sequence[CameraSpec], tool: str) -> CameraSpec:
    """The only camera. Raises `UnsupportedFormatError` for several."""
    if len(specs) != 1:
        names = ", ".join(spec.name for spec in specs)
        raise UnsupportedFormatError(f"{len(specs)} cameras, expected one in a file of {tool}: name one of {names}")
    return specs[0]


def refuse_mirror(spec: CameraSpec, tool: str) -> None:
    """Raises `UnsupportedFormatError` for a camera that looks into a mirror, which no other tool's files say."""
    if spec.mirror:
        raise UnsupportedFormatError(f"{spec.name}: is seen in a mirror, and {tool} has no word for that")


def refuse(spec: CameraSpec, tool: str, holds: str) -> NoReturn:
    """Raises `UnsupportedFormatError`: the tool's files cannot hold this lens."""
    plain = {key for key, one in spec.parameters.items() if one not in (0, 0.0)} - {"fx", "fy", "cx", "cy"}
    lens = spec.model + (f" with {', '.join(sorted(plain))}" if plain else "")
    raise UnsupportedFormatError(f"{spec.name}: {tool} has no {lens} lens, it has {holds}")
