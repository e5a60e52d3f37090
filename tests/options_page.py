"""docs/options.md: every option with default, domain and meaning, as the core declares it; `just options` writes it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tiltvp import _core

PAGE = Path(__file__).parents[1] / "docs" / "options.md"
OWNERS: dict[str, tuple[str, Sequence[str]]] = {
    "TiltEstimator": ("the tilt of one image: [tilt.md](tilt.md)", _core.METHODS),
    "TiltFilter": ("the tilt of successive images: [tilt.md](tilt.md#successive-images)", ()),
    "common_direction": ("great-circle normals of your own", ()),
    "SegmentDetector": ("straight edges of an image: [segments.md](segments.md)", ()),
    "LineExtractor": ("vertical lines of an image: [lines.md](lines.md)", _core.LINE_METHODS),
    "match_descriptors": ("`tiltvp.lines.match`", ()),
    "match_wide": ("`tiltvp.lines.match_wide`", ()),
    "LineTracker": ("lines through successive images", ()),
    "SelfCalibrator": ("the mounting while driving: [calibration.md](calibration.md)", _core.CALIBRATION_METHODS),
    "calibrate": ("the mounting from a whole log", ()),
    "CornerDetector": ("corners of an image: [corner_images.md](corner_images.md)", _core.CORNER_METHODS),
    "CornerPoseEstimator": ("poses from corners, frame by frame", ()),
    "ComplementaryFilter": ("attitude between images", ()),
}
"""What each belongs to, and its methods, if it has several with options of their own."""
HEAD = """# Options

Made by `just options` from what the core declares; every keyword of Python, `.options` and the command line follow from
the same declaration (there `_rad` is `-deg`). A dash says that the method has no such option.
"""


def shown(value: object) -> str:
    """A default as a reader wants it: short numbers, words as they are."""
    if isinstance(value, bool) or value is None:
        return str(value)
    if isinstance(value, int | float):
        return f"{value:g}"
    if isinstance(value, str):
        return f'"{value}"'
    return ", ".join(f"{number:g}" for number in np.asarray(value).ravel())


def table(owner: str, methods: Sequence[str]) -> list[str]:
    """The rows of one owner."""
    of_method = {method: _core.option_fields(owner, method) for method in methods or [None]}
    names = dict.fromkeys(field["name"] for fields in of_method.values() for field in fields)
    heads = [f"`{method}`" for method in methods] or ["default"]
    rows = [f"| option | meaning | {' | '.join(heads)} | expected |", "|---" * (len(heads) + 3) + "|"]
    for name in names:
        found = [next((field for field in fields if field["name"] == name), None) for fields in of_method.values()]
        told = next(field for field in found if field)
        docs = {field["doc"]: method for field, method in zip(found, of_method, strict=True) if field}
        doc = told["doc"] if len(docs) == 1 else " ".join(f"`{method}`: {doc}" for doc, method in docs.items())
        defaults = ["–" if field is None else shown(field["default"]) for field in found]  # noqa: RUF001
        rows.append(f"| `{name}` | {' '.join(doc.split())} | {' | '.join(defaults)} | {told['expected']} |")
    return rows


def page() -> str:
    """The whole page."""
    parts = [HEAD]
    for owner, (what, methods) in OWNERS.items():
        parts.append("\n".join([f"## {owner}", "", f"For {what}.", "", *table(owner, methods)]) + "\n")
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
