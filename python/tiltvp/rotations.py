"""How the camera sits on the robot: `robot_from_camera` from a word or a small file."""

from __future__ import annotations

import difflib
import math
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from tiltvp.arguments import number_from, path_from, shaped_from
from tiltvp.errors import CalibrationError, CalibrationNotFoundError, InvalidInputError
from tiltvp.formats.document import Document

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Matrix = NDArray[np.float64]

__all__ = [
    "ROTATION_WORDS",
    "about_vertical",
    "levelling",
    "mounting_from",
    "quaternion",
    "read_rotation",
    "rotation_from",
    "rotation_from_document",
    "rotation_from_quaternion",
]

ROTATION_WORDS: Final[dict[str, tuple[tuple[float, float, float], ...]]] = {
    "up": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "forward": ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)),
}
"""`up`: the camera looks up, image columns point forward. `forward`: it looks forward, image rows point down."""

_KEYS: Final = ("robot_from_camera", "quaternion")
_EXPECTED: Final = (
    "nine numbers in rows, or the key robot_from_camera with a 3x3 matrix, or the key quaternion with [x, y, z, w]"
)
_SLACK: Final = 1e-3
"""Files carry rounded numbers: a matrix or quaternion this close to a rotation is replaced by the nearest one."""


def about_vertical(angle_rad: float) -> Matrix:
    """(3, 3): the turn to the left about the robot's z axis."""
    if math.isinf(angle := number_from(angle_rad, "angle_rad")):
        raise InvalidInputError(f"angle_rad = {angle}, expected radians")
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def levelling(normal: NDArray[np.floating]) -> Matrix:
    """(3, 3): the smallest rotation that takes a unit vector (3,), not straight down, to the robot's z axis."""
    x, y, z = shaped_from(normal, "normal", 3).tolist()
    scale = 1.0 / (1.0 + z)
    return np.array([[1.0 - x * x * scale, -x * y * scale, -x], [-x * y * scale, 1.0 - y * y * scale, -y], [x, y, z]])


def quaternion(rotation: NDArray[np.floating]) -> Matrix:
    """(4,): x, y, z, w of a rotation (3, 3), w not negative: the main eigenvector of Bar-Itzhack's matrix."""
    matrix = shaped_from(rotation, "rotation", 3, 3)
    if not np.isfinite(matrix).all():
        raise InvalidInputError("rotation: numbers that are not finite, expected a rotation")
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = matrix.tolist()
    symmetric = np.array([
        [xx - yy - zz, xy + yx, xz + zx, zy - yz],
        [xy + yx, yy - xx - zz, yz + zy, xz - zx],
        [xz + zx, yz + zy, zz - xx - yy, yx - xy],
        [zy - yz, xz - zx, yx - xy, xx + yy + zz],
    ])  # fmt: skip
    found: Matrix = np.linalg.eigh(symmetric)[1][:, -1]
    return found if found[3] >= 0 else -found


def read_rotation(source: str | os.PathLike[str]) -> Matrix:
    """The (3, 3) rotation `R` of v_robot = R v_camera that a word of `ROTATION_WORDS` or a file names.

    A file is nine numbers as text (white space or commas), or JSON, TOML or YAML with the key `robot_from_camera`, or
    `quaternion` in the order [x, y, z, w]; a robot's file, of `tiltvp setup`; or what `StaticTransform.write` writes.
    What is within 1e-3 of a rotation is taken as the nearest rotation. Raises `CalibrationError` with the file, what is
    wrong and what was expected; `InvalidInputError` for an unknown word.
    """
    if isinstance(source, str) and source in ROTATION_WORDS:
        return np.array(ROTATION_WORDS[source])
    file = path_from(source)
    if not os.path.exists(file):
        raise _missing(str(source), is_word=file.name == str(source) and not file.suffix)
    return rotation_from_document(Document.load(file, "a file with a rotation"))


def rotation_from_document(document: Document) -> Matrix:
    """The (3, 3) rotation of what is written in a file. Raises as `read_rotation` does."""
    numbers = _plain_numbers(document.text)
    if numbers is not None:
        if len(numbers) != 9:
            raise CalibrationError(f"{document.path}: {len(numbers)} numbers, expected {_EXPECTED}")
        return _rotation(np.reshape(numbers, (3, 3)), document.path)
    tree = _tree(document)
    noted = " ".join([str(tree.get("not_known")), *re.findall("not known, and set to 0: .*", document.text)])
    if unknown := [name for name in ("roll", "pitch") if name in noted]:
        raise CalibrationError(f"{document.path}: {' and '.join(unknown)} not known, expected a rotation that is known")
    return _from_keys(document.path, tree)


def rotation_from(value: object, where: str) -> Matrix:
    """The (3, 3) rotation that a word of `ROTATION_WORDS` or three rows of three numbers stand for.

    What is within 1e-3 of a rotation is taken as the nearest rotation. Raises `CalibrationError` that begins with
    `where`.
    """
    if isinstance(value, str):
        if value not in ROTATION_WORDS:
            raise CalibrationError(
                f"{where}: {value!r}, expected one of {', '.join(ROTATION_WORDS)}, or a 3 x 3 matrix"
            )
        return np.array(ROTATION_WORDS[value])
    return _from_rows(value, where)


def mounting_from(robot_from_camera: ArrayLike) -> Matrix:
    """The (3, 3) rotation that an argument of this name is: `R` of v_robot = R v_camera, to 1e-3.

    Raises `InvalidInputError` for anything else.
    """
    try:
        return _from_rows(np.asarray(robot_from_camera, dtype=object).tolist(), "robot_from_camera")
    except CalibrationError as error:
        raise InvalidInputError(str(error)) from None


def _from_rows(rows: object, where: str) -> Matrix:
    array = _array(where, rows)
    if array.shape != (3, 3):
        raise CalibrationError(f"{where}: shape {array.shape}, expected 3 x 3 numbers")
    return _rotation(array, where)


def _missing(source: str, *, is_word: bool) -> Exception:
    words = ", ".join(ROTATION_WORDS)
    near = difflib.get_close_matches(source, ROTATION_WORDS, 1)
    meant = f" (did you mean {near[0]}?)" if near else ""
    if is_word:
        return InvalidInputError(
            f"{source!r} is no file and no word{meant}, expected a file with a rotation, or one of {words}"
        )
    return CalibrationNotFoundError(f"{source}: no such file, expected a file with a rotation, or one of {words}")


def _plain_numbers(text: str) -> list[float] | None:
    """The numbers of a text that holds nothing else but `#` comments; None for any other text."""
    words = re.split(r"[\s,;]+", re.sub(r"#[^\n]*", " ", text).strip(" \t\n,;"))
    try:
        return [float(word) for word in words]
    except ValueError:
        return None


def _tree(document: Document) -> dict[str, object]:
    if document.path.suffix.lower() == ".toml":
        return document.toml(_EXPECTED)
    if document.is_xml:
        return {"robot_from_camera": _of_joint(document).tolist()}
    if not document.tree:
        raise CalibrationError(f"{document.path}: no rotation ({document.syntax_problem}), expected {_EXPECTED}")
    match document.tree:
        # Of Kalibr's own files, which have more keys, the sensor's axes are not the robot's.
        case {"cam0": {"T_cam_imu": [[*x, _], [*y, _], [*z, _], _], **others}} if not others:
            return {"robot_from_camera": [list(row) for row in zip(x, y, z, strict=False)]}
    return document.tree


def _of_joint(document: Document) -> Matrix:
    """(3, 3): of the child in the parent of the only joint, where the robot has the child's name: then it is ours."""
    root = document.xml
    joints = [] if root is None else root.findall("joint")
    child, origin = (joints[0].find(name) if len(joints) == 1 else None for name in ("child", "origin"))
    if root is None or child is None or origin is None or child.get("link") != root.get("name"):
        found = document.syntax_problem or "other XML"
        raise CalibrationError(f"{document.path}: {found}, expected {_EXPECTED}, or the .urdf of a transform")
    angles = _array(f"{document.path}: rpy", origin.get("rpy", "").split())
    if angles.shape != (3,) or not np.isfinite(angles).all():
        raise CalibrationError(f"{document.path}: rpy: {angles}, expected three angles")
    roll, pitch, yaw = angles.tolist()
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    rolled: Matrix = np.array([[cp, sp * sr, sp * cr], [0.0, cr, -sr], [-sp, cp * sr, cp * cr]])
    return about_vertical(yaw) @ rolled


def _from_keys(file: Path, tree: dict[str, object]) -> Matrix:
    if isinstance(mounting := tree.get("mounting"), dict):
        tree = mounting  # A robot's file.
    found = [key for key in _KEYS if key in tree]
    if len(found) != 1:
        what = "both keys" if found else f"the keys {', '.join(list(tree)[:6])}"
        raise CalibrationError(f"{file}: {what}, expected one of the keys {' and '.join(_KEYS)}")
    key = found[0]
    value = tree[key]
    if isinstance(value, dict):
        value = list(value.values()) if [*value] == [*"xyzw"] else value.get("data", value)
    array = _array(f"{file}: {key}", value)
    if array.shape == (4,):
        return rotation_from_quaternion(array, f"{file}: {key}")
    if key == "robot_from_camera" and array.shape in ((3, 3), (9,)):
        return _rotation(array.reshape(3, 3), f"{file}: {key}")
    expected = "3 x 3 numbers" if key == "robot_from_camera" else "[x, y, z, w]"
    raise CalibrationError(f"{file}: {key} has the shape {array.shape}, expected {expected}")


def _array(where: str, value: object) -> Matrix:
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise CalibrationError(f"{where}: {value!r}, expected a list of numbers")
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise CalibrationError(f"{where}: {value!r}, expected a list of numbers") from None


def rotation_from_quaternion(q: Matrix, where: str) -> Matrix:
    """(3, 3) of a quaternion (4,) x, y, z, w whose length is within 1e-3 of 1.

    Raises `CalibrationError` that begins with `where`.
    """
    q = _array(where, np.asarray(q, dtype=object).tolist())
    if q.shape != (4,):
        raise CalibrationError(f"{where}: shape {q.shape}, expected [x, y, z, w]")
    norm = math.sqrt(float(q @ q))
    if not abs(norm - 1.0) <= _SLACK:
        raise CalibrationError(f"{where}: a quaternion of length {norm:.6g}, expected [x, y, z, w] of length 1")
    x, y, z, w = (float(value) / norm for value in q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _rotation(matrix: Matrix, where: object) -> Matrix:
    if not np.isfinite(matrix).all():
        raise CalibrationError(f"{where}: numbers that are not finite, expected a rotation")
    # Of huge numbers both are infinite or none at all.
    with np.errstate(over="ignore", invalid="ignore"):
        off = float(np.linalg.norm(matrix.T @ matrix - np.eye(3)))
        determinant = float(np.linalg.det(matrix))
    if not off <= _SLACK or determinant < 0.0:
        what = "a reflection" if off <= _SLACK else "no rotation"
        raise CalibrationError(
            f"{where}: {what} (determinant {determinant:.6g}, |R^T R - I| = {off:.2g}), "
            "expected a rotation: orthonormal columns, determinant 1"
        )
    left, _, right = np.linalg.svd(matrix)
    return np.asarray(left @ right, dtype=np.float64)
