"""What `--rerun` of `track`, `calibrate` and `corner` sends: lines, the mounting as it converges, and poses."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from tiltvp.cli.showing import rgb

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tiltvp import LogCalibration, MountingEstimate
    from tiltvp.corner import CornerEstimate
    from tiltvp.drive_logs import DriveLog
    from tiltvp.lines import TrackedLines
    from tiltvp.streams.outputs.viewer import Viewer

    Picture = NDArray[np.uint8]

__all__ = ["send_calibration", "send_corner", "send_lines"]

_BLUE, _PALE = [36, 99, 168], [160, 190, 225]


def send_lines(
    viewer: Viewer, number: int, time_s: float | None, picture: Picture, found: TrackedLines, before: Iterable[int]
) -> Sequence[int]:
    """A frame with its lines, and the bearing of each track, in the colours of the picture; the tracks that it has.

    The curves of those that the frame `before` had, and this one has not, have a gap here.
    """
    from tiltvp.overlays.lines import track_colour

    viewer.at(number, time_s)
    viewer.picture("image", picture)
    bearings_rad = dict.fromkeys(before, np.nan) | dict(zip(found.track.tolist(), found.lines.bearing_rad, strict=True))
    for track, bearing_rad in bearings_rad.items():
        colour = rgb(track_colour(track))
        viewer.curves(f"tracks/{track}/bearing_deg", [float(np.degrees(bearing_rad))], [f"track {track}"], [colour])
    tracks: Sequence[int] = found.track.tolist()
    return tracks


def send_calibration(viewer: Viewer, log: DriveLog, history: Sequence[MountingEstimate], whole: LogCalibration) -> None:
    """The filter's mounting after each step with bands of 95 %, the robot's way, the camera on it, and the landmarks.

    Way, camera and landmarks are those of the whole log.
    """
    from tiltvp.overlays.drive_map import landmark_places, robot_poses
    from tiltvp.overlays.lines import track_colour
    from tiltvp.overlays.live import BAND_SIGMAS
    from tiltvp.rotations import about_vertical

    e = whole.mounting
    poses = robot_poses(log.odometry, wheel_base_m=whole.wheel_base_m)
    seen = landmark_places(poses, log.bearings, (e.x_m, e.y_m, e.yaw_rad))
    way = np.column_stack([poses[:, :2], np.zeros(len(poses))])
    viewer.at(0, None if log.times_s is None else float(log.times_s[0]))
    viewer.path("world/way", way)
    viewer.pose("world/robot/camera", (e.x_m, e.y_m, 0.0), about_vertical(e.yaw_rad))
    if seen:
        places = np.array([[*place, 0.0] for place in seen.values()])
        labels, colours = [str(name) for name in seen], [rgb(track_colour(name)) for name in seen]
        viewer.points("world/landmarks", places, labels=labels, colours=colours, radius=0.04)
    looked_at: dict[int, list[int]] = {}
    for at_step, landmark in log.bearings[:, :2].astype(int).tolist():
        looked_at.setdefault(at_step, []).append(landmark)
    for step, estimate in enumerate(history):
        viewer.at(step, None if log.times_s is None else float(log.times_s[step]))
        sigmas = np.sqrt(np.diag(estimate.covariance_xy_yaw))
        values = np.array([1e3 * estimate.x_m, 1e3 * estimate.y_m, np.degrees(estimate.yaw_rad)])
        halves = BAND_SIGMAS * sigmas * [1e3, 1e3, np.degrees(1.0)]
        for name, value, half in zip(("x_mm", "y_mm", "yaw_deg"), values, halves, strict=True):
            names = [name, f"{name}: lower end of 95 %", f"{name}: upper end of 95 %"]
            viewer.curves(f"mounting/{name}", [value, value - half, value + half], names, [_BLUE, _PALE, _PALE])
        viewer.pose("world/robot", way[step], about_vertical(poses[step, 2]))
        shown = [landmark for landmark in looked_at.get(step, ()) if landmark in seen]
        places = np.array([[*seen[landmark], 0.0] for landmark in shown]).reshape(-1, 3)
        viewer.points("world/seen", places, colours=[rgb(track_colour(landmark)) for landmark in shown], radius=0.08)


def send_corner(viewer: Viewer, number: int, time_s: float | None, picture: Picture, estimate: CornerEstimate) -> None:
    """A frame with its corner, the camera's pose in the object's frame, and its angles."""
    from tiltvp.corner_tables import pose_rows

    viewer.at(number, time_s)
    viewer.picture("image", picture)
    row = pose_rows([(0.0, "", estimate)])[0]
    for name in ("roll_deg", "pitch_deg", "yaw_deg", "confidence"):
        value = row[name]
        viewer.curves(f"corner/{name}", [float("nan") if value is None else value], [name])
    pose = estimate.pose
    if pose is None:
        viewer.say(f"frame {number}: {estimate.reason}", warns=True)
        viewer.gone("world/camera")
        return
    # From one camera the place is not known, and stays at the vertex.
    place = np.zeros(3) if pose.camera_in_object_m is None else pose.camera_in_object_m
    viewer.pose("world/camera", place, pose.camera_from_object.T)
