"""Lines tell the camera and the mounting that found them: of others they are refused."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import tiltvp
from tiltvp import lines as tl
from tiltvp.errors import InvalidInputError
from tiltvp.overlays.lines import draw_lines
from tiltvp.rotations import about_vertical, levelling
from tiltvp.synth import RoomImage


def test_lines_are_those_of_the_camera_and_the_mounting_that_found_them(room: RoomImage, camera: tiltvp.Camera) -> None:
    other = tiltvp.Camera.equidistant(width=camera.width, height=camera.height, focal_px=80.0, cx=100.0, cy=99.0)
    leaning = levelling(np.array([0.0, 0.05, 1.0]) / math.hypot(0.05, 1.0))
    for method, reach in (("great-circle", {}), ("radial", {"length_min": 0.2})):
        extractor = tl.LineExtractor(camera, method=method, **reach)  # type: ignore[arg-type]
        found = extractor(room.gray)
        assert len(found) > 0
        for lines in (found, extractor.lines_at([0.5])):
            for wrong, mounting in ((other, None), (camera, leaning)):
                if method == "great-circle":
                    another = tl.LineExtractor(wrong, robot_from_camera=mounting)
                    for use in (another.describe, another.patches):
                        with pytest.raises(InvalidInputError, match="lines of another camera or mounting"):
                            use(room.gray, lines)
                with pytest.raises(InvalidInputError, match="lines of another camera or mounting"):
                    tl.describe(room.gray, wrong, lines, mounting)
                with pytest.raises(InvalidInputError, match="lines of another camera or mounting"):
                    draw_lines(room.gray, wrong, lines, mounting)
        # Options, copies and what differs by rounding are the same camera; of lines of unknown origin nothing is said.
        turned = about_vertical(2.0 * math.pi)
        again = tl.Lines.from_dict(json.loads(json.dumps(found.to_dict())))
        assert len(tl.describe(room.gray, camera, again, turned, descriptor_bins=16)) == len(found)
        unknown = tl.Lines.from_dict({**found.to_dict(), "seen_by": None})
        assert len(tl.describe(room.gray, other, unknown)) == len(found)


def test_lines_are_those_of_images_of_any_size_but_for_radial_ones(room: RoomImage, camera: tiltvp.Camera) -> None:
    half, small = camera.scaled(0.5), np.ascontiguousarray(room.gray[::2, ::2])
    assert tl.describe(small, half, tl.extract(room.gray, camera)).shape[1] == 192
    with pytest.raises(InvalidInputError, match="lines of another camera or mounting"):
        tl.describe(small, half, tl.extract(room.gray, camera, method="radial", length_min=0.2))
