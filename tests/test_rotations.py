"""How the camera sits on the robot: words and files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tiltvp.errors import CalibrationError, TiltvpError
from tiltvp.rotations import read_rotation

FORWARD = [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("r.txt", "# rows\n0 0 1\n-1 0 0\n0 -1 0\n"),
        ("r.csv", "0,0,1\n-1,0,0\n0,-1,0\n"),
        ("r.json", '{"robot_from_camera": [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]}'),
        ("r.json", '{"quaternion": [-0.5, 0.5, -0.5, 0.5]}'),
        ("r.toml", "robot_from_camera = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]"),
        ("r.toml", "robot_from_camera = [-0.5, 0.5, -0.5, 0.5]"),
        ("r.yaml", "robot_from_camera:\n- [0, 0, 1]\n- [-1, 0, 0]\n- [0, -1, 0]\n"),
        (
            "r.yaml",
            "%YAML:1.0\nrobot_from_camera: !!opencv-matrix\n   rows: 3\n   data: [0, 0, 1, -1, 0, 0, 0, -1, 0]\n",
        ),
        ("r.txt", "0 0.0001 1\n-1 0 0.0001\n0 -1 0\n"),
    ],
)
def test_rotation_files(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    rotation = read_rotation(tmp_path / name)
    assert np.abs(rotation - FORWARD).max() < 2e-4
    assert np.abs(rotation.T @ rotation - np.eye(3)).max() < 1e-14
    assert np.array_equal(read_rotation("forward"), FORWARD)
    assert np.array_equal(read_rotation("up"), np.eye(3))


@pytest.mark.parametrize(
    ("name", "text", "problem"),
    [
        ("r.txt", "1 0 0\n0 1 0\n0 0 -1\n", "reflection"),
        ("r.txt", "2 0 0\n0 1 0\n0 0 1\n", "no rotation"),
        ("r.txt", "1 0 0 0 1 0 0 0\n", "8 numbers"),
        ("r.txt", "1 0 0\n0 nan 0\n0 0 1\n", "not finite"),
        ("r.txt", "\n", "empty"),
        ("r.json", '{"quaternion": [0, 0, 0, 2]}', "length 2"),
        ("r.json", '{"quaternion": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}', "shape (3, 3)"),
        ("r.json", '{"rotation": [0, 0, 0, 1]}', "rotation"),
        ("r.json", '{"quaternion": [0, 0, 0, 1], "robot_from_camera": [0, 0, 0, 1]}', "both keys"),
        ("r.yaml", "robot_from_camera: up\n", "a list of numbers"),
        ("r.yaml", "robot_from_camera: [[1, 0], [0]]\n", "a list of numbers"),
        ("r.json", f'{{"quaternion": [0, 0, 0, {10**400}]}}', "a list of numbers"),
        ("r.txt", "1e200 -1e200 0\n1e200 1e200 0\n0 0 1\n", "no rotation"),
        ("r.toml", "robot_from_camera = [", "not TOML"),
        ("r.yaml", "[", "no rotation"),
    ],
)
def test_rotation_files_that_are_refused(tmp_path: Path, name: str, text: str, problem: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(CalibrationError) as refusal:
        read_rotation(tmp_path / name)
    assert problem in str(refusal.value)
    assert name in str(refusal.value)


def test_rotation_that_is_not_there(tmp_path: Path) -> None:
    for source in (tmp_path, tmp_path / "none.txt", "fwd"):
        with pytest.raises(TiltvpError):
            read_rotation(source)
    # It is read for several options, so that no name of one begins it.
    with pytest.raises(TiltvpError, match=r"^'foward' is no file and no word \(did you mean forward\?\)"):
        read_rotation("foward")
