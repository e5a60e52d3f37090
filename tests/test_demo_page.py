"""The page of `tiltvp demo --page`: what is in it, and that its views are those of the renderer."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tiltvp.cli import demo_page, main
from tiltvp.synth import Room

pytestmark = pytest.mark.slow


def test_every_lean_has_its_pictures_and_a_verdict(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(demo_page, "LEANS_DEG", (0, 30))
    monkeypatch.setattr(demo_page, "_PANORAMA_PX", 240)
    path = tmp_path / "page.html"
    assert main(["demo", "--page", str(path), "--kind", "narrow"]) == 0
    text = path.read_text(encoding="utf-8")
    frames = json.loads(text.split('application/json">')[1].split("</script>")[0])["frames"]
    assert len(frames) == 4
    for frame in frames:
        assert frame["verdict"] in ("right", "wrong", "doubted", "none")
        assert ("level" in frame) == (frame["verdict"] in ("right", "wrong"))
    # 42 degrees are beyond what is looked for.
    assert frames[3]["verdict"] != "right"
    assert "http://" not in text
    assert "https://" not in text
    assert main(["demo", "--page", str(path)]) == 2
    assert main(["demo", "--page", str(tmp_path / "page.txt")]) == 2


def test_verdicts() -> None:
    assert demo_page._verdict(False, None) == "none"
    assert demo_page._verdict(False, 0.1) == "doubted"
    assert demo_page._verdict(True, demo_page.WRONG_DEG) == "right"
    assert demo_page._verdict(True, demo_page.WRONG_DEG + 0.1) == "wrong"


def test_a_view_of_the_panorama_is_that_of_the_renderer() -> None:
    """Of the same room, place and lean: a robot that leans about its camera sees the same panorama, turned."""
    camera, room = demo_page._camera(), Room("narrow", 3)
    pose = room.free_poses(1, 3)[0]
    panorama = room.render_panorama(pose=pose, height=600, samples=2).bgr
    theirs = room.render(camera, pose=pose, alpha_rad=0.2, beta_rad=0.7, samples=2).bgr
    seen = camera.valid_mask()

    def difference(alpha_rad: float, beta_rad: float) -> float:
        ours = demo_page._view(panorama, camera, alpha_rad, beta_rad, np.random.default_rng(0))
        return float(np.abs(ours.astype(float) - theirs)[seen].mean())

    right = difference(0.2, 0.7)
    assert right < 6.0
    for wrong in ((0.2, -0.7), (0.2, 0.7 + np.pi), (0.0, 0.0), (0.16, 0.7)):
        assert difference(*wrong) > 1.3 * right, wrong
