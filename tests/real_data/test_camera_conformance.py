"""Every calibration that loads is inverted and differentiated rightly, from the axis to the rim. `-s` shows a table."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import tiltvp
from tiltvp.errors import CalibrationError
from tiltvp.formats import CameraSpec, read_cameras

WITHOUT_SIZE = {"libper_omni_xml.xml": (400, 400), "libper_theta_dual_fisheye.xml": (1280, 640)}


def specs(folder: Path) -> Iterator[tuple[str, CameraSpec]]:
    """The cameras of all the files that load, each with a name."""
    for path in sorted(folder.iterdir()):
        if path.name == "INDEX.md":
            continue
        try:
            cameras = read_cameras(path, image_size=WITHOUT_SIZE.get(path.name))
        except CalibrationError as refusal:
            if "carries no image size" not in str(refusal):
                raise
            cameras = read_cameras(path, image_size=(640, 480))
        for spec in cameras:
            yield f"{path.name}: {spec.name}", spec


def test_every_calibration_conforms(data: Path) -> None:
    wrong, count = [], 0
    print(f"\n{'calibration':58} {'model':18} {'rim/deg':>8} {'trip/px':>9} {'trip/rad':>9} {'Jacobian':>9}")
    for name, spec in specs(data / "calib_formats"):
        count += 1
        found = tiltvp.Camera.from_spec(spec).conformance()
        trip, jacobian = found["max_round_trip_px"], found["max_jacobian_error_relative"]
        rim = found["rim_theta_rad"] * 57.29577951308232
        print(f"{name:58} {spec.model:18} {rim:8.2f} {trip:9.1e} {found['max_round_trip_rad']:9.1e} {jacobian:9.1e}")
        if not (trip <= 1e-6 and jacobian <= 1e-6 and found["pixels_lost"] == 0 and found["pixels_tested"] > 300):
            wrong.append(f"{name}: {found}")
    assert count > 60
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("mirror", [False, True])
def test_every_calibration_is_saved_and_loaded(data: Path, tmp_path: Path, mirror: bool) -> None:
    for name, spec in specs(data / "calib_formats"):
        camera = tiltvp.Camera.from_spec(spec)
        camera = camera.mirrored() if mirror else camera
        camera.save(tmp_path / "camera.toml")
        assert tiltvp.Camera.load(tmp_path / "camera.toml") == camera, name
