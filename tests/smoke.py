"""What an installation without extras must do: run it with the Python that has it, `python tests/smoke.py`."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import tiltvp

ROOT = Path(__file__).parents[1]
LEAN_RAD = 0.07
ERROR_RAD = 0.01
"""More than half a degree would be no answer; the README's own image is estimated to 0.1 degrees."""


def main() -> None:
    """A lean found, a wall refused, a file read, a command run; without anything that only the laboratory needs."""
    assert not Path(tiltvp.__file__).is_relative_to(ROOT / "python"), "this is the source tree, not an installation"
    camera = tiltvp.Camera.equidistant(width=640, height=480, focal_px=139.7, cx=319.5, cy=239.5)
    image = tiltvp.synth.render_room(camera, kind="office", seed=1, alpha_rad=LEAN_RAD, beta_rad=0.5).gray
    estimate = tiltvp.TiltEstimator(camera)(image)
    assert estimate
    assert tiltvp.tilt_error_rad(estimate.normal, tiltvp.normal_from_alpha_beta(LEAN_RAD, 0.5)) < ERROR_RAD
    assert not tiltvp.TiltEstimator(camera)(image * 0 + 128)
    with tempfile.TemporaryDirectory() as folder:
        tiltvp.write_image(f"{folder}/room.png", image)
        camera.save(f"{folder}/camera.toml")
        assert tiltvp.Camera.load(f"{folder}/camera.toml") == camera
        command = [sys.executable, "-m", "tiltvp", "tilt", f"{folder}/room.png", "--camera", f"{folder}/camera.toml"]
        done = subprocess.run([*command, "--out", "-"], capture_output=True, text=True, timeout=120, check=False)
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)["alpha_rad"] == estimate.alpha_rad, done.stdout
        if importlib.util.find_spec("polars") is None:
            command += ["--out", f"{folder}/tilts.parquet"]
            lacking = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
            assert "pip install 'tiltvp[lab]'" in lacking.stderr, lacking.stderr


if __name__ == "__main__":
    main()
