"""Poses before a corner as rows of a table and as a trajectory."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp._core import CornerEstimate
from tiltvp.arguments import each_from, refuse_single, refuse_unless, shaped_from
from tiltvp.corner_boxes import join_boxes
from tiltvp.errors import InvalidInputError
from tiltvp.rotations import quaternion
from tiltvp.streams.outputs.tum import write_tum

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp._core import CornerHypothesis

__all__ = ["CORNER_COLUMNS", "POSE_COLUMNS", "corner_rows", "pose_rows", "roll_pitch_yaw", "write_trajectory"]

_QUATERNION = ("qx", "qy", "qz", "qw")
_POSITION = ("x_m", "y_m", "z_m")
_ANGLES = ("roll_deg", "pitch_deg", "yaw_deg")
_SIGMAS = ("sigma_rx_rad", "sigma_ry_rad", "sigma_rz_rad", "sigma_x_m", "sigma_y_m", "sigma_z_m")


POSE_COLUMNS: Final[dict[str, str]] = (
    {"time_s": "Float64", "file": "String", "found": "Boolean"}
    | dict.fromkeys((*_ANGLES, *_QUATERNION, *_POSITION, *_SIGMAS), "Float64")
    | {"confidence": "Float64", "hypotheses": "Int64", "misfit": "Float64", "object": "Int64", "id": "Int64"}
    | {"corners_left": "Int64", "corners_right": "Int64", "reason": "String", "place_reason": "String"}
)
"""The keys of the rows in their order, each with the name of its type in Polars."""


def pose_rows(estimates: Sequence[tuple[float, str, CornerEstimate]]) -> list[dict[str, Any]]:
    """One row for each frame: time_s, file, found, the camera in the object's frame, how sure it is, and its name.

    qx..qw and x_m..z_m are `object_from_camera`; the object's frame has y along the vertical edge away from the vertex.
    roll, pitch and yaw are those of `object_from_camera` about the camera's z, x and y axis. sigma_x_m..sigma_z_m are
    the standard deviations of x_m..z_m, those before them of the rotation vector in the camera's frame. None where
    there is no pose, and where it has no position, which `place_reason` says why.
    """
    rows = []
    for time_s, file, estimate in _each(estimates):
        row: dict[str, Any] = dict.fromkeys(POSE_COLUMNS)
        row |= {"time_s": time_s, "file": file, "found": bool(estimate), "confidence": estimate.confidence}
        row |= {"hypotheses": len(estimate.hypotheses), "reason": estimate.reason, "object": estimate.object}
        row |= {"corners_left": len(estimate.features_left), "corners_right": len(estimate.features_right)}
        row["place_reason"] = estimate.place_reason
        row["id"] = estimate.corners[0].id if estimate else None
        pose = estimate.pose
        if pose is not None:
            turn = pose.camera_from_object.T
            angles = np.degrees(roll_pitch_yaw(turn))
            row |= dict(zip(_ANGLES, angles.tolist(), strict=True))
            row |= dict(zip(_QUATERNION, quaternion(turn).tolist(), strict=True))
            sigmas = np.sqrt(np.diag(pose.covariance))
            row |= dict(zip(_SIGMAS[:3], sigmas[:3].tolist(), strict=True))
            place = pose.camera_in_object_m
            if place is not None:
                row |= dict(zip(_POSITION, place.tolist(), strict=True))
                row |= dict(zip(_SIGMAS[3:], _place_sigmas(pose).tolist(), strict=True))
            row["misfit"] = pose.misfit
        rows.append(row)
    return rows


def _each(estimates: Iterable[tuple[float, str, CornerEstimate]]) -> Iterator[tuple[float, str, CornerEstimate]]:
    """Each frame's, as it should be. Raises `InvalidInputError` with the number of another."""
    expected = "(time_s, file, CornerEstimate)"
    refuse_single(estimates, "estimates", f"several {expected}")
    for number, one in enumerate(estimates):
        name = f"estimates[{number}]"
        if not isinstance(one, Sequence) or len(one) != 3:
            raise InvalidInputError(f"{name} = {one!r}, expected {expected}")
        refuse_unless(one[2], CornerEstimate, f"{name}[2]", f"the last of {expected}")
        yield one


def _place_sigmas(pose: CornerHypothesis) -> NDArray[np.float64]:
    """(3,): the standard deviations of `camera_in_object_m`, -R^T v of the vertex v, to first order, metres."""
    vertex = pose.vertex_m
    assert vertex is not None
    by = pose.camera_from_object.T @ np.hstack([np.cross(np.eye(3), vertex), np.eye(3)])
    return np.asarray(np.sqrt(np.diag(by @ pose.covariance @ by.T)))


_AXES: Final = ("rx", "ry", "rz", "x", "y", "z")
_COVARIANCE: Final = tuple(f"cov_{a}_{b}" for k, a in enumerate(_AXES) for b in _AXES[k:])
_VERTEX: Final = ("vertex_x_m", "vertex_y_m", "vertex_z_m")
_LENGTHS: Final = ("edge_x_m", "edge_y_m", "edge_z_m")
_LENGTH_SIGMAS: Final = ("sigma_edge_x_m", "sigma_edge_y_m", "sigma_edge_z_m")
_BETWEEN: Final = ("angle_yz_deg", "angle_zx_deg", "angle_xy_deg")
_BETWEEN_SIGMAS: Final = ("sigma_angle_yz_deg", "sigma_angle_zx_deg", "sigma_angle_xy_deg")
_SIZES: Final = ("box_x_m", "box_y_m", "box_z_m")
_SIZE_SIGMAS: Final = ("sigma_box_x_m", "sigma_box_y_m", "sigma_box_z_m")

CORNER_COLUMNS: Final[dict[str, str]] = (
    {"time_s": "Float64", "file": "String", "id": "Int64", "hypothesis": "Int64", "probability": "Float64"}
    | dict.fromkeys((*_QUATERNION, *_VERTEX), "Float64")
    | {"right_handed": "Boolean", "misfit": "Float64"}
    | dict.fromkeys((*_LENGTHS, *_LENGTH_SIGMAS, *_BETWEEN, *_BETWEEN_SIGMAS), "Float64")
    | {"box": "Int64"}
    | dict.fromkeys((*_SIZES, *_SIZE_SIGMAS, *_COVARIANCE), "Float64")
)
"""The keys of the rows of `corner_rows` in their order, each with the name of its type in Polars."""


def corner_rows(estimates: Sequence[tuple[float, str, CornerEstimate]]) -> list[dict[str, Any]]:
    """One row for each hypothesis of each corner that is believed in each frame, that of the pose first.

    `hypothesis` counts from 0, the likeliest. qx..qw are `object_from_camera`, the vertex is in the left camera's
    frame, cov_rx_rx..cov_z_z are the upper triangle of its `covariance`, without a place that of the attitude alone.
    Lengths and angles of edges are of the corner, not of the hypothesis. `box` is the number of its cuboid in the
    frame, from 1 (`join_boxes`), with its sizes along the edges of the first corner of it. None where something is not
    told.
    """
    rows = []
    upper = np.triu_indices(6)
    for time_s, file, estimate in _each(estimates):
        boxes: dict[int, dict[str, Any]] = {}
        for number, box in enumerate(join_boxes(estimate.corners), start=1):
            sizes: dict[str, Any] = dict(zip(_SIZES, box.sizes_m.tolist(), strict=True))
            sizes |= {"box": number} | dict(zip(_SIZE_SIGMAS, box.size_sigmas_m.tolist(), strict=True))
            boxes |= dict.fromkeys(box.corners, sizes)
        for place, corner in enumerate(estimate.corners):
            edges: dict[str, Any] = dict(zip(_LENGTHS, corner.edge_lengths_m.tolist(), strict=True))
            edges |= boxes.get(place, {})
            edges |= dict(zip(_LENGTH_SIGMAS, corner.edge_length_sigmas_m.tolist(), strict=True))
            edges |= dict(zip(_BETWEEN, np.degrees(corner.edge_angles_rad).tolist(), strict=True))
            edges |= dict(zip(_BETWEEN_SIGMAS, np.degrees(corner.edge_angle_sigmas_rad).tolist(), strict=True))
            edges = {name: None if np.isnan(value) else value for name, value in edges.items()}
            for number, pose in enumerate(corner.hypotheses):
                row: dict[str, Any] = dict.fromkeys(CORNER_COLUMNS)
                row |= {"time_s": time_s, "file": file, "id": corner.id, "hypothesis": number}
                row |= {"probability": pose.probability, "right_handed": pose.right_handed, "misfit": pose.misfit}
                row |= dict(zip(_QUATERNION, quaternion(pose.camera_from_object.T).tolist(), strict=True))
                covariance = np.full((6, 6), None, dtype=object)
                if pose.vertex_m is None:
                    covariance[:3, :3] = pose.covariance[:3, :3]
                else:
                    covariance[:] = pose.covariance
                    row |= dict(zip(_VERTEX, pose.vertex_m.tolist(), strict=True))
                rows.append(row | edges | dict(zip(_COVARIANCE, covariance[upper].tolist(), strict=True)))
    return rows


def write_trajectory(rows: Sequence[Mapping[str, Any]], path: str | os.PathLike[str]) -> None:
    """The poses of `pose_rows` in TUM's format: time x y z qx qy qz qw, a line for each; whole or not at all.

    Raises `InvalidInputError` where no row has a place, `OutputError` where the file cannot be written.
    """
    names = ("time_s", *_POSITION, *_QUATERNION)
    rows = each_from(rows, "rows", "keys", "row of pose_rows")
    for number, row in enumerate(rows):
        if missing := [name for name in names if name not in row]:
            raise InvalidInputError(f"rows[{number}]: no {missing[0]}, expected a row of pose_rows")
    poses = [[row[name] for name in names] for row in rows]
    placed = np.array([pose for pose in poses if None not in pose])
    if not len(placed):
        raise InvalidInputError(f"{path}: no frame has a pose with a place, expected one at least")
    write_tum(path, placed[:, 0], placed[:, 1:4], placed[:, 4:], "of object_from_camera")


def roll_pitch_yaw(object_from_camera: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,): radians about the camera's z, x and y axis in R = Ry(yaw) Rx(pitch) Rz(roll), of a camera whose y is down.

    All zero where the camera's axes are the object's, the paper's initial orientation.
    """
    r = shaped_from(object_from_camera, "object_from_camera", 3, 3)
    pitch = np.arctan2(-r[1, 2], np.hypot(r[0, 2], r[2, 2]))
    return np.array([np.arctan2(r[1, 0], r[1, 1]), pitch, np.arctan2(r[0, 2], r[2, 2])])
