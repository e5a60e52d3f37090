"""Lines tell the camera and the mounting that found them: of others they are refused."""

from __future__ import annotations

import copy
import json
import math
import pickle

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


def test_lines_of_two_origins_are_not_followed_or_matched_as_if_of_one(room: RoomImage, camera: tiltvp.Camera) -> None:
    """A tracker went on with the lines of a camera that was turned by a degree: their bearings were another robot's."""
    turned = tl.LineExtractor(camera, robot_from_camera=about_vertical(math.radians(1.0)))
    extractor = tl.LineExtractor(camera)
    own, other = extractor(room.gray), turned(room.gray)
    values, others = extractor.describe(room.gray, own), turned.describe(room.gray, other)
    profiles = [np.zeros((len(lines), 190), np.float32) for lines in (own, other)]
    tl.match_wide(own, profiles[0], own, profiles[0])
    with pytest.raises(InvalidInputError, match="lines of another camera or mounting"):
        tl.match_wide(own, profiles[0], other, profiles[1])
    tracker = tl.LineTracker()
    tracker.update(own, values)
    unknown = tl.Lines.from_dict({**own.to_dict(), "seen_by": None})
    for before in (tracker, pickle.loads(pickle.dumps(tracker))):
        kept = copy.copy(before)
        with pytest.raises(InvalidInputError, match="lines of another camera or mounting"):
            before.update(other, others)
        assert before == kept
        assert len(before.update(unknown, values)) == len(own)
        with pytest.raises(InvalidInputError, match="lines of another camera or mounting"):
            before.update(other, others)


def test_lines_in_another_order_are_refused_where_order_counts(room: RoomImage, camera: tiltvp.Camera) -> None:
    extractor = tl.LineExtractor(camera, descriptor_kind="profile")
    lines = extractor.lines_at([2.0, 1.0])
    assert pickle.loads(pickle.dumps(lines)) == lines
    values = extractor.describe(room.gray, lines)
    areas = tl.LineExtractor(camera).describe(room.gray, lines)
    assert len(tl.LineTracker().update(lines, areas)) == 2
    for use in (
        lambda: tl.match_wide(lines, values, lines, values),
        lambda: tl.LineTracker(ordered=True).update(lines, areas),
    ):
        with pytest.raises(InvalidInputError, match="rising bearing"):
            use()
