"""Motion and inertial data of a recording: Odometry, JointState, Twist and Imu of ROS."""

from __future__ import annotations

import math
import re
from collections.abc import Set
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tiltvp.arguments import refuse_unless
from tiltvp.errors import InvalidInputError
from tiltvp.streams.bags import Recording, Topic
from tiltvp.streams.inertial import InertialSamples
from tiltvp.streams.odometry import Odometry, refuse_set_back
from tiltvp.streams.wheels import Wheels, cumulative_m

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["ODOMETRY_KINDS", "bag_odometry", "inertial_samples"]

_POSES, _JOINTS = "nav_msgs/Odometry", "sensor_msgs/JointState"
_TWISTS: Final = ("geometry_msgs/TwistStamped", "geometry_msgs/TwistWithCovarianceStamped", "geometry_msgs/Twist")
ODOMETRY_KINDS: Final = (_POSES, _JOINTS, *_TWISTS)
_IMU: Final = "sensor_msgs/Imu"
_SIDES: Final = (r"(^|[_/.\-])(l|left)([_/.\-]|$)|left", r"(^|[_/.\-])(r|right)([_/.\-]|$)|right")
"""What the names of joints of the left and of the right wheel have in them."""
_MOVES: Final = 0.05
"""Metres or radians a second that are more than what robots that stand tremble by: for what sends velocities alone."""
_TUMBLES_RAD: Final = math.radians(60.0)
"""No ramp that a robot drives is as steep. In a camera's axes, y down, as of visual odometry, a turn is such a lean."""
_UNIT_SLACK: Final = 1e-2
"""Of a quaternion's length: by what those of few digits are off. One that nobody has filled in has length 0."""


def bag_odometry(recording: Recording, topic: str | None, wheels: Wheels) -> Odometry:
    """The odometry of a topic; without one, of the only nav_msgs/Odometry, or of the only sensor_msgs/JointState.

    With a wheel's radius the JointState is preferred. Velocities are taken only from a topic that is named: most are
    what a robot was told, not what it did. Raises `InvalidInputError` that lists the topics.
    """
    chosen = _chosen(recording, topic, wheels)
    if chosen.kind == _JOINTS:
        return _from_joints(recording, chosen, wheels)
    more: dict[str, Any] = {"source": f"{recording.path} {chosen.name}", "gap_max_s": wheels.gap_max_s}
    where = f"{recording.path}: {chosen.name}, message"
    rows, fastest, leans = [], 0.0, list[float]()
    for k, (time_s, content) in enumerate(recording.decoded(chosen)):
        rows.append((time_s, *_values(content, chosen.kind, f"{where} {k}")))
        if chosen.kind == _POSES:
            leans.append(_lean_rad(content))
        fastest = max(fastest, *map(abs, _velocity(content)))
    if chosen.kind == _POSES:
        if (by := float(np.ptp(leans or [0.0]))) > _TUMBLES_RAD:
            raise InvalidInputError(
                f"{more['source']}: poses that lean by {math.degrees(by):.0f} degrees more at one time than at "
                "another, expected those of a level frame, z up"
            )
        _refuse_standing(
            {row[1:] for row in rows}, fastest, more["source"], "poses", "a topic of poses, or one of Twist"
        )
    more["notes"] = recording.unread(chosen, len(rows))
    table = _rising(np.array(rows, dtype=np.float64), more["source"])
    if chosen.kind == _POSES:
        return Odometry.from_poses(*table.T, **more)
    return Odometry.from_velocities(*table.T, **more)


def _chosen(recording: Recording, topic: str | None, wheels: Wheels) -> Topic:
    if topic is not None:
        return recording.choose(ODOMETRY_KINDS, "--odometry-topic", topic)
    by_kind = {kind: [one for one in recording.topics if one.kind == kind and one.count] for kind in ODOMETRY_KINDS}
    order = (_JOINTS, _POSES) if wheels.wheel_radius_m is not None else (_POSES, _JOINTS)
    for kind in order:
        if len(by_kind[kind]) == 1:
            return by_kind[kind][0]
    return recording.choose(order, "--odometry-topic")


def _values(content: Any, kind: str, where: str) -> tuple[float, ...]:
    if kind == _POSES:
        place, q = content.pose.pose.position, content.pose.pose.orientation
        length = float(np.linalg.norm([q.x, q.y, q.z, q.w]))
        if not abs(length - 1.0) <= _UNIT_SLACK:
            raise InvalidInputError(
                f"{where}: an orientation of length {length:.6g}, expected a quaternion of length 1"
            )
        return place.x, place.y, math.atan2(2.0 * (q.w * q.z + q.x * q.y), q.w**2 + q.x**2 - q.y**2 - q.z**2)
    return _velocity(content)


def _lean_rad(content: Any) -> float:
    """How far the z axis of a pose is off its frame's."""
    q = content.pose.pose.orientation
    return math.atan2(2.0 * math.hypot(q.x * q.z + q.w * q.y, q.y * q.z - q.w * q.x), q.w**2 - q.x**2 - q.y**2 + q.z**2)


def _velocity(content: Any) -> tuple[float, float]:
    twist = content.twist if hasattr(content, "twist") else content
    twist = twist.twist if hasattr(twist, "twist") else twist
    return twist.linear.x, twist.angular.z


def _refuse_standing(values: Set[object], fastest: float, source: str, what: str, expected: str) -> None:
    """Refuses what has one value, as where nobody fills it in, beside velocities of up to `fastest`."""
    if len(values) == 1 and fastest > _MOVES:
        raise InvalidInputError(
            f"{source}: {what} that never change beside velocities of up to {fastest:.3g} m/s or rad/s, "
            f"expected {expected}"
        )


def _from_joints(recording: Recording, topic: Topic, wheels: Wheels) -> Odometry:
    source = f"{recording.path} {topic.name}"
    if wheels.wheel_radius_m is None:
        raise InvalidInputError(f"{source}: angles of wheels, expected their radius by --wheel-radius")
    rows: list[tuple[float, float, float]] = []
    names: tuple[str, str] | None = None
    count, fastest = 0, [0.0, 0.0]
    for time_s, content in recording.decoded(topic):
        count += 1
        if names is None or not set(names) <= set(content.name):
            # Some robots send the joints of arms and wheels in turn.
            found = _wheel_joints(list(content.name), wheels.joints, source, must=False)
            if found is None:
                continue
            names = found
        angles = dict(zip(content.name, np.asarray(content.position).tolist(), strict=False))
        if not set(names) <= set(angles):
            raise InvalidInputError(f"{source}: no positions of {' and '.join(names)}, expected the angles of wheels")
        rows.append((time_s, angles[names[0]], angles[names[1]]))
        speeds = dict(zip(content.name, np.asarray(content.velocity).tolist(), strict=False))
        fastest = [max(most, abs(speeds.get(name, 0.0))) for most, name in zip(fastest, names, strict=True)]
    if names is None:
        seen = sorted({name for _, content in recording.decoded(topic) for name in content.name})
        _wheel_joints(seen, wheels.joints, source, must=True)
    for k, name in enumerate(names or ()):
        _refuse_standing(
            {row[k + 1] for row in rows}, fastest[k], source, f"angles of {name}", "those of a wheel that turns"
        )
    table = _rising(np.array(rows, dtype=np.float64), source)
    rolled, notes = cumulative_m(table[:, 1:], 2.0 * np.pi, wheels.wheel_radius_m, source)
    notes = (*recording.unread(topic, count), *notes)
    return Odometry.from_wheels(
        table[:, 0], rolled, wheel_base_m=wheels.wheel_base_m, source=source, gap_max_s=wheels.gap_max_s, notes=notes
    )


def _wheel_joints(
    names: list[str], joints: tuple[str, str] | None, source: str, *, must: bool
) -> tuple[str, str] | None:
    """The joints of the left and the right wheel: those that were named, or the only ones that are called so."""
    if joints is not None:
        sides = [[name for name in names if name == joint] for joint in joints]
    else:
        wheels = [name for name in names if "wheel" in name.lower()] or names
        sides = [[name for name in wheels if re.search(side, name.lower())] for side in _SIDES]
    if len(sides[0]) == len(sides[1]) == 1:
        return sides[0][0], sides[1][0]
    if must or any(sides):
        told = ", ".join(names) or "none"
        raise InvalidInputError(f"{source}: joints {told}, expected those of two wheels, by --wheel-joints LEFT RIGHT")
    return None


def inertial_samples(recording: Recording, topic: str | None = None) -> InertialSamples:
    """What the inertial sensor of a recording has measured: of a topic, or of the only one.

    Raises `InvalidInputError` that lists the topics, and for a sensor without rates or accelerations.
    """
    refuse_unless(recording, Recording, "recording", "a tiltvp.streams.Recording")
    chosen = recording.choose((_IMU,), "--imu-topic", topic)
    source, frame = f"{recording.path} {chosen.name}", ""
    rows = []
    told = {"angular_velocity": True, "linear_acceleration": True, "orientation": True}
    for time_s, content in recording.decoded(chosen):
        frame = content.header.frame_id
        # By sensor_msgs/Imu a sensor without a quantity says so by -1 as the first number of its covariance.
        for name in told:
            told[name] &= float(getattr(content, f"{name}_covariance")[0]) != -1.0
        w, a, q = content.angular_velocity, content.linear_acceleration, content.orientation
        rows.append((time_s, w.x, w.y, w.z, a.x, a.y, a.z, q.x, q.y, q.z, q.w))
    for name in ("angular_velocity", "linear_acceleration"):
        if not told[name]:
            raise InvalidInputError(f"{source}: a sensor that says it has no {name}, expected one that has")
    table = np.array(rows, dtype=np.float64)
    if not told["orientation"] and len(rows):
        table[:, 7:] = 0.0  # Of a sensor without orientation some drivers send NaN.
    table = _rising(table, source)
    norms = np.linalg.norm(table[:, 7:], axis=1)
    whole = told["orientation"] and bool((np.abs(norms - 1.0) <= _UNIT_SLACK).all())
    turns = table[:, 7:] / norms[:, None] if whole else None
    lost = recording.unread(chosen, len(rows))
    return InertialSamples(table[:, 0], table[:, 1:4], table[:, 4:7], turns, frame, source, lost)


def _rising(table: NDArray[np.float64], source: str) -> NDArray[np.float64]:
    """The rows in the order of their times, the first of each time.

    Messages may overtake each other by a little. Raises `InvalidInputError` for a clock that was set back, as of a
    simulation.
    """
    if table.ndim != 2:
        raise InvalidInputError(f"{source}: no messages, expected some")
    bad = np.flatnonzero(~np.isfinite(table).all(axis=1))
    if len(bad):
        raise InvalidInputError(
            f"{source}: {len(bad)} of {len(table)} messages with numbers that are not finite, the first at "
            f"{table[bad[0], 0]:.3f} s, expected finite numbers"
        )
    refuse_set_back(table[:, 0], source)
    order = np.unique(table[:, 0], return_index=True)[1]
    return table[order]
