"""Orientation and calibration from the straight lines of man-made places.

Robot frame: x forward, y left, z up. Camera frame: z along the optical axis, x right (u, columns), y down (v, rows),
pixel centres at integers. `robot_from_camera` is R in v_robot = R v_camera. A lean (alpha, beta) has the ground normal
(-sin a cos b, -sin a sin b, cos a) in the robot frame; beta = 0 is a forward lean. Radians and metres.
"""

from tiltvp import _command  # noqa: F401 - before all that takes time

# isort: split
from typing import TYPE_CHECKING, Any

from tiltvp import lines
from tiltvp._core import METHODS, ComplementaryFilter, simd_level
from tiltvp.body import BodyMask, body_mask
from tiltvp.cameras import Camera
from tiltvp.corrections import (
    AffineCorrection,
    PosteriorCorrection,
    PriorOfTilt,
    TrainedCorrection,
    apply_correction,
    train_affine,
    train_correction,
    train_factor,
    train_posterior,
)
from tiltvp.images import read_image, write_image
from tiltvp.lens_check import LensCheck, check_lens
from tiltvp.levelling import Leveller, Unwrapper, level
from tiltvp.overlays.edges import draw_edges
from tiltvp.overlays.segments import draw_segments
from tiltvp.rim import RimCircle, rim_circle
from tiltvp.segments import SegmentDetector, Segments
from tiltvp.selfcalib import (
    CALIBRATION_METHODS,
    CalibrationStep,
    LogCalibration,
    MountingEstimate,
    SelfCalibrator,
    calibrate,
    wheel_displacements,
)
from tiltvp.surround import surround_mask
from tiltvp.tilt import (
    CommonDirection,
    EdgeElements,
    FilteredTilt,
    FilterStep,
    FitReport,
    ImageEdges,
    TiltEstimate,
    TiltEstimator,
    TiltFilter,
    common_direction,
    normal_from_alpha_beta,
    tilt_error_rad,
    tilt_from_wheel_heights,
)

if TYPE_CHECKING:
    from tiltvp import corner, streams, synth
    from tiltvp.extrinsics import Extrinsics, JoinedLogs, JoinedTilts, join_logs, join_tilts
    from tiltvp.mounting import MountingTilt, mounting_tilt
    from tiltvp.robot import Robot
    from tiltvp.robot_setup import RobotSetup, find_setup
    from tiltvp.setup_check import SetupCheck, check_setup
    from tiltvp.turning import FrameDelay, TurnCheck, check_turns, frame_delay

__version__ = "0.2.0"

__all__ = [
    "CALIBRATION_METHODS",
    "METHODS",
    "AffineCorrection",
    "BodyMask",
    "CalibrationStep",
    "Camera",
    "CommonDirection",
    "ComplementaryFilter",
    "EdgeElements",
    "Extrinsics",
    "FilterStep",
    "FilteredTilt",
    "FitReport",
    "FrameDelay",
    "ImageEdges",
    "JoinedLogs",
    "JoinedTilts",
    "LensCheck",
    "Leveller",
    "LogCalibration",
    "MountingEstimate",
    "MountingTilt",
    "PosteriorCorrection",
    "PriorOfTilt",
    "RimCircle",
    "Robot",
    "RobotSetup",
    "SegmentDetector",
    "Segments",
    "SelfCalibrator",
    "SetupCheck",
    "TiltEstimate",
    "TiltEstimator",
    "TiltFilter",
    "TrainedCorrection",
    "TurnCheck",
    "Unwrapper",
    "apply_correction",
    "body_mask",
    "calibrate",
    "check_lens",
    "check_setup",
    "check_turns",
    "common_direction",
    "corner",
    "draw_edges",
    "draw_segments",
    "find_setup",
    "frame_delay",
    "join_logs",
    "join_tilts",
    "level",
    "lines",
    "mounting_tilt",
    "normal_from_alpha_beta",
    "read_image",
    "rim_circle",
    "simd_level",
    "streams",
    "surround_mask",
    "synth",
    "tilt_error_rad",
    "tilt_from_wheel_heights",
    "train_affine",
    "train_correction",
    "train_factor",
    "train_posterior",
    "wheel_displacements",
    "write_image",
]


_MODULES = ("corner", "streams", "synth")
_HOMES = {
    "Extrinsics": "extrinsics", "FrameDelay": "turning", "JoinedLogs": "extrinsics", "JoinedTilts": "extrinsics",
    "MountingTilt": "mounting", "Robot": "robot", "RobotSetup": "robot_setup", "SetupCheck": "setup_check",
    "TurnCheck": "turning", "check_setup": "setup_check", "check_turns": "turning", "find_setup": "robot_setup",
    "frame_delay": "turning", "join_logs": "extrinsics", "join_tilts": "extrinsics", "mounting_tilt": "mounting",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """What many programs do without: it comes when it is asked for, a half of the import's time."""
    from importlib import import_module

    if name in _MODULES:
        return import_module(f"tiltvp.{name}")
    if name in _HOMES:
        return getattr(import_module(f"tiltvp.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'tiltvp' has no attribute {name!r}")


def __dir__() -> list[str]:
    """For completion and documentation, those names too."""
    return sorted({*globals(), *__all__})
