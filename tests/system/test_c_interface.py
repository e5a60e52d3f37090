"""The C interface as docs/c.md builds it: the examples, compiled by gcc, tell what Python tells, under valgrind."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import tiltvp

ROOT = Path(__file__).parents[2]
GUIDE = (ROOT / "docs" / "c.md").read_text(encoding="utf-8")
INCLUDE = ROOT / "crates" / "tiltvp-capi" / "include"
# Memory that is still reachable at the end is that of the runtime of Rust.
LEAKS = ["--leak-check=full", "--errors-for-leak-kinds=definite,indirect,possible"]
SUPPRESSED = f"--suppressions={Path(__file__).with_name('valgrind.supp')}"
VALGRIND = ["valgrind", "--quiet", "--error-exitcode=99", SUPPRESSED, *LEAKS]


@pytest.fixture(scope="module")
def programs() -> dict[str, Path]:
    """The examples by name, made by the lines of the guide."""
    (lines,) = re.findall(r"^```console\n(.*?)^```$", GUIDE, re.MULTILINE | re.DOTALL)
    for line in lines.splitlines():
        line = line.replace("gcc ", "gcc -std=c11 -Wall -Wextra -Wpedantic -Werror ", 1)
        subprocess.run(line, shell=True, cwd=ROOT, check=True)
    return {name: ROOT / "target" / name for name in ("tilt", "calibrate")}


def run(*command: str | Path, given: str = "") -> subprocess.CompletedProcess[str]:
    """The program under valgrind, which has nothing to complain of."""
    assert shutil.which("valgrind"), "no valgrind: `just test-system` installs it"
    words = [*VALGRIND, *map(str, command)]
    done = subprocess.run(words, cwd=ROOT, input=given, capture_output=True, text=True, check=False)
    assert done.returncode != 99, done.stderr
    assert "==" not in done.stderr, done.stderr
    return done


@pytest.fixture(scope="module")
def camera() -> tiltvp.Camera:
    return tiltvp.Camera.equidistant(width=320, height=240, focal_px=70.0, cx=159.5, cy=119.5, max_theta_rad=1.6)


@pytest.fixture(scope="module")
def gray(camera: tiltvp.Camera) -> np.ndarray:
    return tiltvp.synth.render_room(camera, seed=1, alpha_rad=0.06, beta_rad=0.5, samples=1).gray


def write_pgm(path: Path, gray: np.ndarray) -> Path:
    path.write_bytes(b"P5\n# a room\n%d %d\n255\n" % gray.shape[::-1] + gray.tobytes())
    return path


@pytest.mark.timeout(900)
@pytest.mark.parametrize("method", ["refined", "segments", "vector-consensus"])
def test_tilt_and_lines_are_those_of_python(
    programs: dict[str, Path], camera: tiltvp.Camera, gray: np.ndarray, tmp_path: Path, method: str
) -> None:
    camera.save(tmp_path / "camera.toml")
    image = write_pgm(tmp_path / "room.pgm", gray)
    done = run(programs["tilt"], tmp_path / "camera.toml", image, f"method = '{method}'")
    estimate = tiltvp.TiltEstimator(camera, method=method)(gray)
    # A normal alone tells no standard deviation: lines slant by `tilt_sigma_rad`.
    lines = tiltvp.lines.LineExtractor(camera)(gray, estimate.normal)
    expected = [
        f"alpha {estimate.alpha_rad:.4f} beta {estimate.beta_rad:.4f} rad, "
        f"confidence {estimate.confidence:.2f}: {estimate.reason}"
    ]
    expected += [f"line at {b:.4f} rad, sigma {s:.5f}" for b, s in zip(lines.bearing_rad, lines.sigma_rad, strict=True)]
    assert (done.returncode, done.stderr, done.stdout.splitlines()) == (0, "", expected)
    assert len(lines) > 3


def test_an_image_of_nothing_and_refusals_are_told(
    programs: dict[str, Path], camera: tiltvp.Camera, gray: np.ndarray, tmp_path: Path
) -> None:
    camera.save(tmp_path / "camera.toml")
    image = write_pgm(tmp_path / "room.pgm", gray)
    blank = run(programs["tilt"], tmp_path / "camera.toml", write_pgm(tmp_path / "wall.pgm", np.full_like(gray, 90)))
    assert (blank.returncode, blank.stdout.split(":")[0]) == (0, "no tilt")
    other = run(programs["tilt"], tmp_path / "camera.toml", write_pgm(tmp_path / "small.pgm", gray[1:]))
    assert (other.returncode, "239 x 320 pixels, expected 240 x 320" in other.stderr) == (1, True)
    slip = run(programs["tilt"], tmp_path / "camera.toml", image, "tilt_mx_rad = 0.1")
    assert (slip.returncode, "did you mean tilt_max_rad?" in slip.stderr) == (1, True)
    missing = run(programs["tilt"], tmp_path / "none.toml", image)
    assert (missing.returncode, "none.toml: No such file" in missing.stderr) == (1, True)


def test_a_robots_file_asks_for_its_mask(
    programs: dict[str, Path], camera: tiltvp.Camera, gray: np.ndarray, tmp_path: Path
) -> None:
    image = write_pgm(tmp_path / "room.pgm", gray)
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    tiltvp.Robot(camera, turned).save(tmp_path / "robot.toml")
    done = run(programs["tilt"], tmp_path / "robot.toml", image)
    estimate = tiltvp.TiltEstimator(camera, robot_from_camera=turned)(gray)
    assert done.stdout.startswith(f"alpha {estimate.alpha_rad:.4f} beta {estimate.beta_rad:.4f} rad")
    tiltvp.Robot(camera, turned, mask=np.ones(gray.shape, dtype=bool)).save(tmp_path / "masked.toml")
    refused = run(programs["tilt"], tmp_path / "masked.toml", image)
    assert (refused.returncode, 'the pixels of "masked-mask.png"' in refused.stderr) == (1, True)


def test_a_mounting_is_that_of_python(programs: dict[str, Path]) -> None:
    wheel_base_m = 0.4
    drive = tiltvp.synth.simulate_drive(seed=1, wheel_base_m=wheel_base_m)
    log, calibrator = [], tiltvp.SelfCalibrator(wheel_base_m=wheel_base_m)
    for step, (left, right) in enumerate(drive.odometry.tolist()):
        log.append(f"move {left!r} {right!r}")
        seen = drive.bearings[drive.bearings[:, 0] == step]
        log += [f"see {int(landmark)} {bearing!r}" for _, landmark, bearing in seen.tolist()]
        calibrator.step(left, right, seen[:, 1], seen[:, 2])
    calibrator.examine()
    found = calibrator.estimate
    done = run(programs["calibrate"], repr(wheel_base_m), given="\n".join(log) + "\n")
    expected = f"x {found.x_m:.3f} m, y {found.y_m:.3f} m, yaw {found.yaw_rad:.4f} rad: {found.reason}\n"
    assert (done.stdout, done.returncode) == (expected, 0 if found else 1)
    assert found


@pytest.mark.parametrize("compiler", ["gcc -std=c99", "g++ -x c++ -std=c++17"])
def test_the_header_is_good_in_c_and_in_cpp(compiler: str, tmp_path: Path) -> None:
    (tmp_path / "all.c").write_text('#include "tiltvp.h"\nint main(void) { return (int)TILTVP_STATUS_OK; }\n')
    command = [*compiler.split(), "-Wall", "-Wextra", "-Wpedantic", "-Werror", f"-I{INCLUDE}", "-fsyntax-only", "all.c"]
    subprocess.run(command, cwd=tmp_path, check=True)
